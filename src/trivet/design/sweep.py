"""Sweeps: quantities of all designs that a sampling of the variables gives, worked out chunk by chunk into a store."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.design.engine import Outcome
from trivet.design.engine import run as run_chunks
from trivet.design.evaluation import Evaluation
from trivet.design.sampling import Grid, Sampling, sampling
from trivet.design.store import Chunk, Column, Layout, Results, open_store, read
from trivet.design.study import PARTLY, STATUSES, WORKED_OUT, Study, unpacked
from trivet.errors import InputError

Array = NDArray[Any]
Progress = Callable[[int, int, float | None], None]

CHUNK_COST = 60_000_000
"""Poses of a map that are worked out together with one writing, about."""
LEAST_COST = 6_000_000
"""The same of a small sweep, which has more chunks, so that it tells how far it is and several workers have something to do."""
CHUNKS = 64
"""Of a small sweep."""
FEWEST = 20
"""Chunks that even a smaller sweep has, so that it keeps something when it is stopped, where they are worth their writing."""
WORTH = 300_000
"""Poses of a map that take about as long as to send, to write and to settle a chunk."""
CALLS = 4
"""Of a chunk at least, which are under way on several cores together."""
MOST_IN_CHUNK = 65_536
READ = 65_536
"""Designs that are read at a time."""


class SweepTask(NamedTuple):
    """What a worker is told: the study, and how designs are drawn."""

    packed: str
    sampling: Sampling
    chunk: int

    def prepared(self) -> Callable[[int], Chunk]:
        """The work on one chunk."""
        study = unpacked(self.packed)
        evaluation = Evaluation(study, most=max(1, self.chunk // CALLS))

        def work(k: int) -> Chunk:
            designs = drawn(study, self.sampling, k * self.chunk, min((k + 1) * self.chunk, self.sampling.count))
            found = evaluation(designs)
            return Chunk(np.concatenate([designs, found.values], axis=1).T, found.status)

        return work


@dataclass(frozen=True)
class Sweep:
    """A study and what its store holds."""

    study: Study
    results: Results

    @property
    def variables(self) -> list[str]:
        """Names of the variables."""
        return [variable.name for variable in self.study.variables]

    @property
    def quantities(self) -> list[str]:
        """Names of the quantities, with the machine where there are several."""
        return [column.name for column in self.study.columns]

    @property
    def count(self) -> int:
        """Designs, worked out or not."""
        return self.results.layout.count

    @cached_property
    def statuses(self) -> dict[str, int]:
        """How many designs have come to what."""
        counts = np.zeros(len(STATUSES), dtype=int)
        for start in range(0, self.count, READ):
            counts += np.bincount(self.results.status(start, start + READ), minlength=len(STATUSES))
        return {word: int(count) for word, count in zip(STATUSES, counts, strict=True) if count}

    @cached_property
    def summaries(self) -> list[Summary]:
        """Every quantity in short."""
        return [self._summary(name) for name in self.quantities]

    def _summary(self, name: str) -> Summary:
        count, total, square = 0, 0.0, 0.0
        least, greatest = (np.inf, -1), (-np.inf, -1)
        for start in range(0, self.count, READ):
            values = self.results.column(name, start, start + READ)
            has_value = np.isfinite(values)
            if not has_value.any():
                continue
            own = values[has_value]
            # Of parts (T. Chan and others, 1979): a sum of squares alone would lose digits.
            shift = own.mean() - (total / count if count else own.mean())
            square += ((own - own.mean()) ** 2).sum() + shift**2 * count * len(own) / (count + len(own))
            count, total = count + len(own), total + float(own.sum())
            low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
            least = min(least, (float(values[low]), start + low))
            greatest = max(greatest, (float(values[high]), start + high), key=lambda one: one[0])
        mean, deviation = (total / count, float(np.sqrt(square / count))) if count else (np.nan, np.nan)
        return Summary(name, count, mean, deviation, *least, *greatest)

    def design(self, index: int) -> Array:
        """One design (d,)."""
        return np.array([float(self.results.column(name, index, index + 1)[0]) for name in self.variables])

    def some(self, most: int) -> tuple[Array, Array]:
        """Designs and quantities of at most so many designs that are worked out, evenly picked: (n, d) and (n, q)."""
        step = max(1, -(-self.count // most))
        # One of each run of designs, at random: every so-and-so-many-th of a grid or a Sobol sequence is no fair sample.
        picked = np.arange(0, self.count, step)
        picked = np.minimum(picked + np.random.default_rng(0).integers(0, step, len(picked)), self.count - 1)
        rows = []
        for start in range(0, self.count, READ):
            own = picked[(picked >= start) & (picked < start + READ)] - start
            names = [*self.variables, *self.quantities]
            part = np.column_stack([self.results.column(name, start, start + READ)[own] for name in names])
            rows.append(part[np.isin(self.results.status(start, start + READ)[own], (WORKED_OUT, PARTLY))])
        found = np.concatenate(rows)
        return found[:, : len(self.variables)], found[:, len(self.variables) :]


class Summary(NamedTuple):
    """A quantity over all designs that have it, SI."""

    name: str
    designs: int
    """How many."""
    mean: float
    deviation: float
    """Of the population."""
    least: float
    at_least: int
    """Number of the design."""
    greatest: float
    at_greatest: int


def drawn(study: Study, drawing: Sampling, start: int, stop: int) -> Array:
    """Designs (n, d) of a sampling."""
    points = drawing.points(start, stop)
    return np.column_stack([variable.law.values(points[:, k]) for k, variable in enumerate(study.variables)])


def check(study: Study) -> None:
    """Raise InputError for a study without what a sweep needs: quantities, and how designs are drawn."""
    study.require_quantities()
    sampling_of(study)


def sampling_of(study: Study) -> Sampling:
    """How a study's sweep draws its designs.

    Raises:
        InputError: for a grid without steps, or another method without a count.
    """
    given = study.given.sweep
    if given.method == "grid":
        if given.count is not None:
            raise InputError("sweep.count: that of a grid follows from the steps of its variables; leave it out")
        for variable in study.variables:
            if variable.steps is None:
                raise InputError(f"variables.{variable.name}: needs steps, as the sweep is a grid")
        return Grid(tuple(variable.steps or 1 for variable in study.variables))
    if given.count is None:
        raise InputError(
            f"sweep.count: missing; say how many designs, as the sweep is no grid but of the method {given.method}"
        )
    return sampling(given.method, len(study.variables), given.count, given.seed)


def chunk_of(study: Study, count: int) -> int:
    """Designs that are worked out and written together."""
    if study.given.sweep.chunk is not None:
        return study.given.sweep.chunk
    cost = Evaluation(study).cost
    most = min(MOST_IN_CHUNK, CHUNK_COST // cost, max(LEAST_COST // cost, -(-count // CHUNKS)))
    most = max(1, min(most, max(WORTH // cost, -(-count // FEWEST))))
    return 1 << (most.bit_length() - 1)


def layout_of(study: Study, drawing: Sampling, chunk: int) -> Layout:
    """What the store of a sweep holds."""
    variables = [Column(one.name, one.kind.si, _meaning(one)) for one in study.variables]
    quantities = [Column(one.name, one.asked.kind.si, f"{one.asked.name} of {study.names[one.place]}") for one in study.columns]
    packed = json.loads(study.packed)
    attributes = {
        "machines": ", ".join(study.names),
        "quantities": ", ".join(one.name for one in study.quantities),
        "sampling": repr(drawing),
        **{key: json.dumps(packed["study"][key], sort_keys=True) for key in ("variables", "poses", "load")},
        "machine_files": "\n".join(own["file"] for own in packed["machines"]),
    }
    return Layout((*variables, *quantities), drawing.count, chunk, attributes, STATUSES[1:])


def _meaning(variable: Any) -> str:
    return (
        f"variable; {', '.join(f'{k}: {label}' for k, label in enumerate(variable.labels))}" if variable.labels else "variable"
    )


def sweep(
    study: Study,
    store: str | os.PathLike[str],
    *,
    drawing: Sampling | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    progress: Progress = lambda done, total, remaining: None,
) -> tuple[Sweep, Outcome]:
    """Work out all designs of a study's sweep that a store does not hold yet.

    Args:
        study: with quantities.
        store: folder to be made, or to go on with: one of the same study that was interrupted, or is done.
        drawing: how designs are drawn; as the study file says when not given.
        workers: processes to be started on this machine; none for a thread of this one.
        scheduler: address of a dask scheduler, whose workers are taken instead.
        progress: called with designs that are done, all of them, and the seconds that the rest takes, where that is known.

    Raises:
        InputError: for a study without quantities, a store of another study, or one that cannot be written.
        NoResultError: when the scheduler or all workers are lost.
    """
    study.require_quantities()
    drawing = sampling_of(study) if drawing is None else drawing
    chunk = chunk_of(study, drawing.count)
    layout = layout_of(study, drawing, chunk)

    def told(done: int, total: int, remaining: float | None) -> None:
        progress(min(done * chunk, drawing.count), drawing.count, remaining)

    with open_store(store, layout) as opened:
        outcome = run_chunks(
            opened, SweepTask(study.packed, drawing, chunk), workers=workers, scheduler=scheduler, progress=told
        )
    return Sweep(study, read(store)), outcome
