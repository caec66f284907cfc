"""The Jacobian over the hemisphere and the ring of Type 2 singularities (paper section 3.2, Fig 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from trivet.model.quantity import AngleValue, Length
from trivet.model.section import STRICT
from trivet.reproduce.found import Asked, Chart, Found, Ours, Progress, Series, rounded

if TYPE_CHECKING:
    from trivet.study.singularity_map import SingularityMap

SHOWN = "1/det J^-1"
"""What Fig 4 shows."""


@dataclass(frozen=True)
class Ring:
    """Where det J_x vanishes: distances from the axis, "least radius" and "greatest radius"."""

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
                progress(len(rows) // 2, total)
            wide = choose(name, self.wider)
            for height in self.heights:
                result = singularity_map(wide, surface_of(wide, height=height), roll=self.varied_roll)
                rows += _rows(name, f"z0 {1e3 * height:g} mm, roll {self.varied_roll}", result)
                progress(len(rows) // 2, total)
        ring = Chart("Type 2 singularities, seen from above", "", "x, mm", "y, mm", rings + _circles(asked), is_square=True)
        return Found(tuple(rows), (*charts, ring))


def _rows(name: str, setting: str, result: SingularityMap) -> list[Ours]:
    """The ring's distance from the axis; nothing where there is no curve."""
    away = [_distance(curve.surface.position) for curve in result.curves]
    ends = (min(a.min() for a in away), max(a.max() for a in away)) if away else (None, None)
    return [
        Ours(f"{which} radius", name, setting, None if value is None else float(value), "mm")
        for which, value in zip(("least", "greatest"), ends, strict=True)
    ]


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


def _circles(asked: tuple[Asked, ...]) -> list[Series]:
    """Circles of the radii that the paper tells."""
    turn = np.linspace(0, 2 * np.pi, 91)
    radii = {1e3 * n.value for one in asked for n in one.paper.values() if n is not None and one.quantity.endswith("radius")}
    return [
        Series(f"the paper's radius, {radius:g} mm", rounded(radius * np.cos(turn)), rounded(radius * np.sin(turn)), "dashed")
        for radius in sorted(radii)
    ]


def _distance(position: Any) -> Any:
    return np.hypot(position[:, 0], position[:, 1])
