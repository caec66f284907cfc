"""What is asked of designs: objectives that are to be small, constraints that are to be at most zero."""

from __future__ import annotations

from collections.abc import MutableMapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Memo = MutableMapping[bytes, Array]
"""What is known already, so that a study that was interrupted finds it again: values by the bytes of what they were asked of.
New ones come by one call of `update` per batch."""

MET = 1e-9
"""A constraint is met where it is at most this: zero but for rounding."""
VOID = 10.0
"""What a constraint without value counts as."""


class Values(NamedTuple):
    """What designs come to; NaN where a design has no value."""

    objectives: Array
    """(n, m), each to be as small as can be."""
    constraints: Array
    """(n, k), met where at most 0; about 1 is far from met."""

    def at(self, index: Any) -> Values:
        """Of some of the designs."""
        return Values(self.objectives[index], self.constraints[index])

    @property
    def has_value(self) -> Array:
        """(n,) whether all of a design has a value."""
        return np.asarray(np.isfinite(self.objectives).all(axis=1) & np.isfinite(self.constraints).all(axis=1))

    @property
    def violation(self) -> Array:
        """(n,) by how much the worst constraint is missed: zero where all are met, infinite without a value."""
        worst = np.max(self.constraints, axis=1, initial=0.0)
        return np.where(self.has_value, np.where(worst <= MET, 0.0, worst), np.inf)

    @property
    def is_feasible(self) -> Array:
        """(n,) whether a design has all values and meets all constraints."""
        return np.asarray(self.violation == 0)


class Model(Protocol):
    """A smooth model of a problem about one design, exact there.

    An objective or constraint is the greatest of its rows.  So the worst of many poses, each smooth by itself, stays smooth.
    """

    @property
    def owner(self) -> Array:
        """(r,) whose row each is: objective j by j, constraint j by m + j."""

    def rows(self, design: Array) -> Array:
        """(r,) at a design (d,)."""

    def slopes(self, design: Array) -> Array:
        """(r, d) by the variables, at a design (d,)."""


class Problem(Protocol):
    """Objectives and constraints of designs (d,)."""

    variables: tuple[str, ...]
    objectives: tuple[str, ...]
    constraints: tuple[str, ...]
    low: Array
    """(d,) least values."""
    high: Array
    """(d,) greatest values."""
    discrete: tuple[tuple[float, ...] | None, ...]
    """The values of variables that take no other."""

    def values(self, designs: Array) -> Values:
        """Of designs (n, d)."""

    def model(self, design: Array) -> Model:
        """About a design (d,)."""

    def missed(self, constraint: int, value: float) -> str:
        """Words for a constraint that is missed, and by how much; `value` as in `Values.constraints`."""


@dataclass
class Asked:
    """A problem that is asked for no design twice, and always for equally many at a time, as kernels compile by shape."""

    problem: Problem
    memo: Memo = field(default_factory=dict)
    batch: int = 64
    count: int = 0
    """Designs asked for so far, known ones too, so that a run that is resumed counts as one that was not interrupted."""

    def __call__(self, designs: Array) -> Values:
        """Values of designs (n, d)."""
        designs = np.ascontiguousarray(designs, dtype=float) + 0.0
        keys = [design.tobytes() for design in designs]
        self.count += len(keys)
        new = {key: design for key, design in zip(keys, designs, strict=True) if key not in self.memo}
        for first in range(0, len(new), self.batch):
            self._work_out(dict(list(new.items())[first : first + self.batch]))
        size = len(self.problem.objectives)
        rows = np.array([self.memo[key] for key in keys]).reshape(len(keys), size + len(self.problem.constraints))
        return Values(rows[:, :size], rows[:, size:])

    def _work_out(self, new: dict[bytes, Array]) -> None:
        designs = np.array(list(new.values()))
        spare = np.repeat(designs[:1], self.batch - len(new), axis=0)
        found = self.problem.values(np.concatenate([designs, spare]))
        rows = np.concatenate([found.objectives, found.constraints], axis=1).astype(float)
        self.memo.update(zip(new, rows, strict=False))
