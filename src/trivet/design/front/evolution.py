"""The front by evolution: NSGA-II for up to two objectives (K. Deb and others, 2002), SMS-EMOA for three (N. Beume and others,
2007), NSGA-III for more (K. Deb and H. Jain, 2014), all from pymoo, with its rules of feasibility."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from trivet.design.front.archive import Archive
from trivet.design.front.box import Box
from trivet.design.front.problem import VOID, Array, Asked, Values


@dataclass(frozen=True)
class Evolution:
    """How long and from where."""

    evaluations: int = 10_000
    """Designs worked out, at most; whole generations."""
    seconds: float = float("inf")
    population: int = 100
    seed: int = 0


class Progress(NamedTuple):
    """How far a search has come."""

    stage: str
    """The first word of each has nothing done yet: it comes before what may take long, as kernels that are compiled."""
    done: int
    """Designs evolved, or polished."""
    of: int | None
    """How many will be; None where that is not known."""
    archive: Archive


Tell = Callable[[Progress], None]


def evolved(
    asked: Asked, how: Evolution, start: Array | None = None, tell: Tell | None = None, archive: Archive | None = None
) -> Archive:
    """The best designs met; the same for the same seed, whatever is known beforehand.

    Args:
        asked: the problem.
        how: how long.
        start: designs (n, d) to begin with, beside random ones.
        tell: called first, and after every generation.
        archive: what takes in the best, an empty one where not given.
    """
    problem, box = asked.problem, Box.of(asked.problem)
    if archive is None:
        archive = Archive.empty(len(box.low), len(problem.objectives), len(problem.constraints))
    if tell is not None:
        tell(Progress("evolution", 0, how.evaluations, archive))

    from pymoo.core.evaluator import Evaluator
    from pymoo.problems.static import StaticProblem

    algorithm = _algorithm(asked, box, how, np.zeros((0, len(box.low))) if start is None else box.genes(np.asarray(start)))
    ends, done = time.monotonic() + how.seconds, 0
    while done < how.evaluations and (done == 0 or time.monotonic() < ends):
        children = algorithm.ask()
        if children is None or not len(children):
            break
        designs = box.designs(children.get("X").astype(float))
        values = asked(designs)
        Evaluator().eval(StaticProblem(algorithm.problem, **_for_pymoo(values)), children)
        algorithm.tell(infills=children)
        archive.add(designs, values)
        done += len(designs)
        if tell is not None:
            tell(Progress("evolution", min(done, how.evaluations), how.evaluations, archive))
    archive.prune()
    return archive


def _for_pymoo(values: Values) -> dict[str, Array]:
    """Numbers everywhere.  Objectives without value are put within the range of the others, where they do no harm; what
    lacks is one more constraint."""
    has_value, (objectives, constraints) = values.has_value, values
    least = np.min(objectives[has_value], axis=0) if has_value.any() else np.zeros(objectives.shape[1])
    lacking = VOID * ((~np.isfinite(objectives)).sum(axis=1) + (~np.isfinite(constraints)).sum(axis=1))
    met = np.where(values.is_feasible[:, None], 0.0, constraints)
    return {
        "F": np.where(has_value[:, None], objectives, least),
        "G": np.column_stack([np.nan_to_num(met, nan=VOID, posinf=VOID, neginf=VOID), lacking]),
    }


def _algorithm(asked: Asked, box: Box, how: Evolution, given: Array) -> Any:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.algorithms.moo.nsga3 import NSGA3
    from pymoo.algorithms.moo.sms import SMSEMOA
    from pymoo.core.problem import Problem as Asks
    from pymoo.core.termination import NoTermination
    from pymoo.util.ref_dirs import get_reference_directions

    from trivet.design.front.operators import Crossed, Mutated, Spread

    counts = box.counts
    parts = {
        "pop_size": how.population, "sampling": Spread(counts, given),
        "crossover": Crossed(counts), "mutation": Mutated(counts),
        "seed": how.seed, "termination": NoTermination(),
    }  # fmt: skip
    many = len(asked.problem.objectives)
    if many <= 2:
        made = NSGA2(**parts)
    elif many == 3:
        made = SMSEMOA(**parts)
    else:
        made = NSGA3(get_reference_directions("energy", many, how.population, seed=how.seed), **parts)
    top = np.where(box.is_discrete, np.maximum(counts - 1, 0), np.where(box.is_free, 1, 0)).astype(float)
    stands_for = Asks(
        n_var=len(counts), n_obj=many, n_ieq_constr=len(asked.problem.constraints) + 1, xl=np.zeros(len(counts)), xu=top
    )
    made.setup(stands_for)
    return made
