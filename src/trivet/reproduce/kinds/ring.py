"""The Jacobian over the hemisphere and the ring of Type 2 singularities (paper section 3.2, Fig 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from trivet.model.quantity import AngleValue, Length, PositiveLength
from trivet.model.section import STRICT
from trivet.reproduce.found import Asked, Chart, Found, Ours, Progress, Series, rounded

if TYPE_CHECKING:
    from trivet.study.singularity_map import SingularityMap

RADII = ("mean radius", "least radius", "greatest radius")
SHOWN = "1/det J^-1"
"""What Fig 4 shows."""


@dataclass(frozen=True)
class Ring:
    """Where det J_x vanishes: distances from the axis, "mean radius" along the curve, "least radius" and "greatest radius"."""

    __pydantic_config__ = STRICT

    kind: Literal["ring"]
    rolls: tuple[Annotated[AngleValue | str, Field(union_mode="left_to_right")], ...]
    """Policies for the roll; the first one is set beside the paper."""
    heights: tuple[Length, ...] = ()
    """Of the hemisphere, varied with the roll `varied_roll`."""
    varied_roll: str = "-alpha"
    """Policy for the roll at these heights."""
    wider: dict[str, Any] | None = None
    """Settings of the machine at these heights, since its travel may not reach all of the hemisphere there."""
    circle: PositiveLength | None = None
    """Radius of a circle that is drawn beside the ring: what the paper says."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """The ring for every policy and height, and the Jacobian over the distance from the axis."""
        from trivet.study.machines import choose
        from trivet.study.singularity_map import singularity_map
        from trivet.study.stiffness_map import surface_of

        rows, charts, rings = [], [], []
        total = len(machines) * (len(self.rolls) + len(self.heights))
        for name in machines:
            for roll in self.rolls:
                result = singularity_map(choose(name), roll=roll, quantity=SHOWN)
                setting = f"roll {result.policy}"
                rows += _rows(name, setting, result)
                rings += _rings(setting, result)
                charts += [_over_distance(result)] if roll == self.rolls[0] else []
                progress(len(rows) // len(RADII), total)
            wide = choose(name, self.wider)
            for height in self.heights:
                result = singularity_map(wide, surface_of(wide, height=height), roll=self.varied_roll)
                rows += _rows(name, f"z0 {1e3 * height:g} mm, roll {self.varied_roll}", result)
                progress(len(rows) // len(RADII), total)
        ring = Chart("Type 2 singularities, seen from above", "", "x, mm", "y, mm", rings + self._circle(), is_square=True)
        return Found(tuple(rows), (*charts, ring))

    def _circle(self) -> list[Series]:
        """The paper's radius all round."""
        if self.circle is None:
            return []
        turn, radius = np.linspace(0, 2 * np.pi, 91), 1e3 * self.circle
        name = f"the paper's radius, about {radius:g} mm"
        return [Series(name, rounded(radius * np.cos(turn)), rounded(radius * np.sin(turn)), "dashed")]


def _rows(name: str, setting: str, result: SingularityMap) -> list[Ours]:
    """The ring's distance from the axis; nothing where there is no curve."""
    values: tuple[float | None, ...] = (None,) * len(RADII)
    if result.curves:
        away = [_distance(curve.surface.position) for curve in result.curves]
        steps = [np.linalg.norm(np.diff(curve.surface.position, axis=0), axis=1) for curve in result.curves]
        middles = np.concatenate([(a[:-1] + a[1:]) / 2 for a in away])
        every = np.concatenate(away)
        values = float(np.average(middles, weights=np.concatenate(steps))), float(every.min()), float(every.max())
    return [Ours(which, name, setting, value, "mm") for which, value in zip(RADII, values, strict=True)]


def _rings(label: str, result: SingularityMap) -> list[Series]:
    places = [1e3 * curve.surface.position for curve in result.curves]
    return [Series(label, rounded(p[:, 0]), rounded(p[:, 1])) for p in places]


def _over_distance(result: SingularityMap) -> Chart:
    """What is shown in Fig 4, over the distance from the axis; the sign is told by the series."""
    away, values = 1e3 * _distance(result.surface.position), result.fields[SHOWN]
    power = int(unit[2:]) if (unit := result.unit(SHOWN)) else 0
    sides = (("above zero", values > 0), ("below zero", values < 0))
    series = [
        Series(side, rounded(away[rows]), rounded(np.abs(values[rows]) * 1e3**power), "points")
        for side, own in sides
        for rows in (own & np.isfinite(values),)
    ]
    unit = f", mm^{power}" if power else ""
    return Chart(
        f"|{SHOWN}| over the distance from the axis", "", "distance from the axis, mm", f"|{SHOWN}|{unit}", series, "y"
    )


def _distance(position: Any) -> Any:
    return np.hypot(position[:, 0], position[:, 1])
