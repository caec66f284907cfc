"""The greatest least of a measure over poses, by sequential quadratic programming in the epigraph form,

    greatest t  with  measure(pose) >= t  and  margin(chain, pose) >= 0  at all poses

(D. Kraft, SLSQP, DFVLR-FB 88-28, 1988), whose constraints make the worst of several poses a smooth matter.  Coordinates of the
spare drives are linear in coefficients: those of splines of a path, or one for all poses where drives are locked.  Rolls that
are free are variables too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.held import Held
from trivet.study.lock_measures import Measure
from trivet.study.lock_values import Poses, ends, looked, slopes_at, span, values_at

Array = NDArray[Any]

FAR = 10.0
"""A margin or measure, as a part, beyond which it is cut off: there a chain is far from closing."""
FAINT = 1e-12
"""Least unit of a measure."""
BACK = (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Parts of the way back to what meets all constraints."""


class Chosen(NamedTuple):
    """What is chosen."""

    coefficients: Array
    """(c, d) m or rad."""
    rolls: Array
    """(p,) rad; as the poses have them where they are not free."""


@dataclass(frozen=True)
class Epigraph:
    """Variables: coefficients in travels, rolls where they are free, and the least of the measure in units of `level`."""

    asked: Measure
    ways: tuple[Held, ...]
    poses: Poses
    matrix: Array
    """(p, c): times coefficients (c, d) it gives the coordinates (p, d)."""
    level: float
    """About what the measure will be."""

    def values(self, chosen: Chosen) -> Array:
        """(p,) the measure; minus infinity outside the travel."""
        return values_at(self.asked, self.ways, self.matrix @ chosen.coefficients, self.poses.frames, chosen.rolls)

    def climbed(self, start: Chosen, steps: int, pace: Array | None = None, rate: float = np.inf) -> Chosen:
        """The best in so many steps at most; constraints are met to rounding where the search ends well.

        Args:
            start: from where on.
            steps: how many.
            pace: (r, c), times coefficients in travels at most `rate` and at least its negative; no such bound when not given.
        """
        from scipy.optimize import minimize

        width, (low, high) = span(self.ways), ends(self.ways)
        least = self.values(start).min() / self._unit
        rolls = start.rolls if self.poses.rolls is None else start.rolls[:0]
        first = np.concatenate([(start.coefficients / width).ravel(), rolls, [least if np.isfinite(least) else 0.0]])
        inside = list(zip(low / width, high / width, strict=True)) * len(start.coefficients)
        constraints = [{"type": "ineq", "fun": self.spare, "jac": self.slopes}]
        if pace is not None:
            by = np.zeros((len(pace) * len(width), len(first)))
            by[:, : start.coefficients.size] = np.kron(pace, np.eye(len(width)))
            both = np.concatenate([by, -by])
            constraints.append({"type": "ineq", "fun": lambda x: rate - both @ x, "jac": lambda x: -both})
        with np.errstate(all="ignore"):
            done = minimize(
                lambda x: -x[-1], first, jac=lambda x: -np.eye(len(x))[-1], method="SLSQP", constraints=constraints,
                bounds=inside + [(None, None)] * (len(first) - len(inside)),
                options={"maxiter": steps, "ftol": self.asked.precision},
            )  # fmt: skip
        found = self._chosen(done.x if np.all(np.isfinite(done.x)) else first)
        return found._replace(coefficients=np.clip(found.coefficients, low, high))

    @property
    def _unit(self) -> float:
        return max(abs(self.level), FAINT)

    def _chosen(self, x: Array) -> Chosen:
        width, size = span(self.ways), self.matrix.shape[1] * len(span(self.ways))
        return Chosen(x[:size].reshape(-1, len(width)) * width, x[size:-1] if self.poses.rolls is None else self.poses.rolls)

    def spare(self, x: Array) -> Array:
        """How far every constraint is met."""
        own = self._chosen(x)
        found, margins = looked(self.asked, self.ways, self.matrix @ own.coefficients, self.poses.frames, own.rolls)
        both = np.concatenate([(found / self._unit - x[-1]).ravel(), margins.ravel()])
        return np.clip(np.nan_to_num(both, nan=-FAR), -FAR, FAR)

    def slopes(self, x: Array) -> Array:
        """(constraints, variables)."""
        own, is_free = self._chosen(x), self.poses.rolls is None
        values, width = self.matrix @ own.coefficients, span(self.ways)
        measure, margins = slopes_at(self.asked, self.ways, values, self.poses.frames, own.rolls, by_roll=is_free)
        made = []
        for part, least in ((measure / self._unit, -1.0), (margins, 0.0)):
            by = [np.einsum("pkd,pc->pkcd", part[..., : len(width)] * width, self.matrix)]
            by += [np.einsum("pk,pq->pkq", part[..., -1], np.eye(len(values)))] if is_free else []
            rows = [one.reshape(part.shape[0] * part.shape[1], -1) for one in by]
            made.append(np.column_stack([*rows, np.full(len(rows[0]), least)]))
        return np.nan_to_num(np.concatenate(made), nan=0.0, posinf=0.0, neginf=0.0)


def drawn_back(found: Chosen, safe: Chosen, is_met: Callable[[Chosen], bool]) -> Chosen:
    """What is beyond a constraint by rounding, drawn towards what meets all of them, and that itself where it is far beyond."""
    drawn = (Chosen(*(a + part * (b - a) for a, b in zip(found, safe, strict=True))) for part in BACK)
    return next((one for one in drawn if is_met(one)), safe)
