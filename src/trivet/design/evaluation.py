"""The kernel over designs: what is asked of every one of them, in pieces of one size, over all cores, in constant memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.design.looked import Stand
from trivet.design.quantities import Asked, Quantity
from trivet.design.rolls import turns
from trivet.design.studied import Studied, worked
from trivet.design.study import CONTRADICTION, NO_RESULT, NOT_REACHED, PARTLY, WORKED_OUT, Column, Study
from trivet.design.variables import machine_of
from trivet.model.rules import kept
from trivet.space.batches import in_threads
from trivet.space.scalar import Scalar
from trivet.space.surface import hemisphere

Array = NDArray[Any]

TILE = 4096
"""Poses that a core works on at a time: what the kernel needs for them stays in its cache."""
PIECE = 1_000_000
"""Poses of a call, about."""
MOST_DESIGNS = 65_536
"""Of a call."""
CLIMBING = 270
"""Rolls of the grid that climbing takes as long as."""
BYTES_PER_POSE = 4096
"""Memory that an accelerator is taken to need for a pose."""


class Worked(NamedTuple):
    """Designs worked out."""

    values: Array
    """(n, columns) SI; NaN where a design has no such number."""
    status: Array
    """(n,) int8, `study.STATUSES`."""


class Evaluation:
    """A study's quantities of any designs; kernels compile once."""

    def __init__(self, study: Study, piece: int | None = None, most: int = MOST_DESIGNS) -> None:
        """`piece` designs per call, a fixed number, where many are not asked for at a time; or at `most` about so many."""
        self.study = study
        self.columns: list[Column] = study.columns
        self._piece, self._most = piece, most

    @property
    def is_over_points(self) -> bool:
        """Whether the check points are asked for at all."""
        return any(isinstance(own, Quantity) and own.is_over_points for own in self.study.quantities)

    @cached_property
    def points(self) -> int:
        """Check points; one, home, where none are asked for."""
        return len(hemisphere(0.0, 1.0, self.study.subjects[0].points.steps)) if self.is_over_points else 1

    @property
    def poses(self) -> int:
        """Of a machine per design."""
        if not self.is_over_points:
            return 1
        rolls = [len(turns(one.points.rolls, one.points.symmetry).cos) for one in self.study.subjects]
        return self.points * (max(rolls) + (CLIMBING if self.study.subjects[0].points.climbs else 0))

    @property
    def cost(self) -> int:
        """Poses of a map that take about as long as a design."""
        studied = sum({own.study: own.cost for own in self.study.quantities if isinstance(own, Studied)}.values())
        return (self.poses + studied) * len(self.study.subjects)

    @cached_property
    def tile(self) -> int:
        """Designs that are worked on as one batch."""
        device = jax.devices()[0]
        most = TILE if device.platform == "cpu" else _room(device) // BYTES_PER_POSE
        return _power_of_two(max(1, most // self.poses))

    @cached_property
    def piece(self) -> int:
        """Designs per call."""
        if self._piece is not None:
            return self._piece
        usual = max(self.tile, min(MOST_DESIGNS, _power_of_two(max(1, PIECE // self.poses))))
        # No single tile where there are usually more: a loop of one round is compiled otherwise, and rounds otherwise.
        return min(usual, max(2 * self.tile, _power_of_two(self._most)))

    def __call__(self, designs: Array) -> Worked:
        """Designs (n, d) worked out."""
        count = len(designs)
        values = np.full((count, len(self.columns)), np.nan)
        good = np.ones(count, dtype=bool)
        for place in range(len(self.study.subjects)):
            good &= self._kept(place, designs)
        rows = np.flatnonzero(good)
        status = np.where(good, WORKED_OUT, CONTRADICTION).astype(np.int8)
        for place in range(len(self.study.subjects)):
            for work in (self._by_kernel, self._by_study):
                status[rows] = np.maximum(status[rows], work(place, designs, rows, values))
        return Worked(values, status)

    @cached_property
    def _had(self) -> list[list[int]]:
        """Per machine the columns that are its own, but for what machines of its kind have no number of."""
        own: list[list[int]] = [[] for _ in self.study.subjects]
        for k, (_, place, asked) in enumerate(self.columns):
            if asked.lacks(self.study.subjects[place].machine) is None:
                own[place].append(k)
        return own

    def _kept(self, place: int, designs: Array) -> Array:
        """Which designs' numbers do not contradict each other."""
        machine = machine_of(self.study.subjects[place].machine, place, self.study.variables, list(designs.T))
        return np.broadcast_to(kept(machine), len(designs))

    def _by_kernel(self, place: int, designs: Array, rows: Array, values: Array) -> Any:
        """Fill in values of the rows; what these have come to."""
        columns = [k for k in self._had[place] if isinstance(self.columns[k].asked, Quantity)]
        if not columns or not len(rows):
            return WORKED_OUT
        kernel = self.kernel(place)
        size = self.piece

        def pieces() -> Iterator[Array]:
            for start in range(0, len(rows), size):
                index = np.minimum(np.arange(start, start + size), len(rows) - 1)
                yield designs[rows[index]]

        found = np.concatenate(list(in_threads(lambda piece: np.asarray(kernel(piece)), pieces())))[: len(rows)]
        values[rows[:, None], columns] = found[:, :-1]
        return found[:, -1].astype(np.int8)

    def _by_study(self, place: int, designs: Array, rows: Array, values: Array) -> Any:
        """The same of studies of their own, which say what designs have come to where nothing else asks for poses."""
        own = {k: asked for k in self._had[place] if isinstance(asked := self.columns[k].asked, Studied)}
        points, mode = self.study.subjects[place].points, self.study.given.poses.mode
        for row in rows if own else ():
            values[row, list(own)] = worked(list(own.values()), self.study.machine(place, designs[row]), points, mode)
        if not own or _poses([self.columns[k].asked for k in self._had[place]]):
            return WORKED_OUT
        return np.where(np.isfinite(values[rows][:, list(own)]).any(axis=1), WORKED_OUT, NO_RESULT)

    def kernel(self, place: int) -> Callable[[Array], Any]:
        """The compiled kernel of one machine: designs (piece, d) to quantities and status (piece, q + 1)."""
        if place not in self._kernels:
            self._kernels[place] = self._made(place)
        return self._kernels[place]

    @cached_property
    def _kernels(self) -> dict[int, Callable[[Array], Any]]:
        return {}

    def _made(self, place: int) -> Callable[[Array], Any]:
        study, subject = self.study, self.study.subjects[place]
        had = [self.columns[k].asked for k in self._had[place]]
        asked = [own for own in had if isinstance(own, Quantity)]
        numbers, structure = jax.tree.flatten(subject.machine)

        @jax.jit
        def run(numbers: list[Any], signs: Any, designs: Any) -> Any:
            base = jax.tree.unflatten(structure, numbers)

            def one(design: Any) -> Any:
                machine = machine_of(base, place, study.variables, list(design))
                stand = Stand(machine, subject.points, signs, subject.scene, study.load)
                return jnp.stack([*(own.value(stand) for own in asked), _status(asked, stand)])

            return jax.lax.map(one, designs, batch_size=self.tile if self.tile > 1 else None)

        held, signs = [np.float64(v) for v in numbers], jnp.asarray(subject.signs)
        return lambda designs: run(held, signs, designs)


def _poses(asked: Sequence[Asked]) -> list[Quantity]:
    """The quantities that a kernel works out over poses."""
    return [own for own in asked if isinstance(own, Quantity) and own.own is None]


def _status(asked: Sequence[Quantity], stand: Stand) -> Scalar:
    """What a machine has come to: by its check points, or by home where they are not asked for."""
    own = _poses(asked)
    if not own:
        return jnp.asarray(float(WORKED_OUT))
    reached = (stand.surface if any(one.is_over_points for one in own) else stand.home).reached
    return jnp.where(reached.all(), WORKED_OUT, jnp.where(reached.any(), PARTLY, NOT_REACHED)).astype(float)


def _room(device: Any) -> int:
    """Bytes of an accelerator that may be used."""
    stats = device.memory_stats() or {}
    return int(stats.get("bytes_limit", 4 << 30)) // 2


def _power_of_two(count: int) -> int:
    """The greatest that is not above a number."""
    return 1 << (count.bit_length() - 1)
