"""The greatest tilt over the radius of the sphere, and what neutral axis and height do to it (paper section 3.1, Fig 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, get_args

from pydantic import Field

from trivet.model.quantity import Length, PositiveLength
from trivet.model.section import STRICT
from trivet.reach.neutral import Reference
from trivet.reproduce.found import Asked, Chart, Found, Ours, Progress, Series

if TYPE_CHECKING:
    from trivet.model import Machine

AZIMUTHS = 3
"""A machine on a circular guide is the same seen from anywhere; three is the least that the study takes."""
ALL: tuple[Reference, ...] = get_args(Reference)[1:]
"""Neutral axes that machine files leave open."""


class Sphere(NamedTuple):
    """A sphere that the platform touches, and from where the cones of the ball joints are counted."""

    neutral: Reference
    height: float
    """Of its centre, m."""
    radius: float
    """m"""

    def __str__(self) -> str:
        return f"{self.neutral}, z0 {1e3 * self.height:g} mm, radius {1e3 * self.radius:g} mm"


@dataclass(frozen=True)
class Tilt:
    """Tilts over the radius with one neutral axis and height, and on one sphere with all of both."""

    __pydantic_config__ = STRICT

    kind: Literal["tilt"]
    neutral: Reference
    """Of the curves, and of what is set beside the paper."""
    height: Length
    """The same."""
    radius: PositiveLength
    """The same, and of all that is varied."""
    radii: tuple[PositiveLength, ...]
    """Of the curves."""
    heights: tuple[Length, ...]
    """What is varied with all neutral axes."""
    bodies: bool = True
    """Whether bodies must stay apart."""
    step: Annotated[float, Field(gt=0, le=30)] = 1.0
    """Of the tilt, degrees; it is refined between."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """Tilts in every setting, and the curves."""
        from trivet.study.machines import choose

        own = Sphere(self.neutral, self.height, self.radius)
        varied = [Sphere(n, h, self.radius) for n, h in product(ALL, self.heights)]
        curve = [Sphere(self.neutral, self.height, radius) for radius in self.radii]
        spheres = dict.fromkeys([own, *varied, *curve])
        tilts: dict[tuple[str, Sphere], float | None] = {}
        for name in machines:
            machine = choose(name)
            for sphere in spheres:
                tilts[name, sphere] = greatest(machine, sphere, self.bodies, self.step)
                progress(len(tilts), len(machines) * len(spheres))
        rows = [
            Ours("tilt", name, str(sphere), tilts[name, sphere], "deg")
            for sphere in dict.fromkeys([own, *varied])
            for name in machines
        ]
        return Found(tuple(rows), tuple(self._charts(machines, curve, varied, tilts)))

    def _charts(
        self,
        machines: tuple[str, ...],
        curve: list[Sphere],
        varied: list[Sphere],
        tilts: dict[tuple[str, Sphere], float | None],
    ) -> list[Chart]:
        def line(label: str, name: str, spheres: list[Sphere], along: Literal["height", "radius"]) -> Series:
            degrees = [None if (t := tilts[name, s]) is None else round(math.degrees(t), 3) for s in spheres]
            return Series(label, [1e3 * float(getattr(s, along)) for s in spheres], degrees)

        title = f"neutral axis {self.neutral}, z0 = {1e3 * self.height:g} mm"
        over_radius = [line(name, name, curve, "radius") for name in machines]
        charts = [Chart(title, "", "radius of the sphere, mm", "tilt, °", over_radius)]
        for name in machines:
            series = [line(n, name, [s for s in varied if s.neutral == n], "height") for n in ALL]
            panel = name.partition("@")[2] or name
            charts.append(Chart(f"radius {1e3 * self.radius:g} mm, neutral axis by axis", panel, "z0, mm", "tilt, °", series))
        return charts


def greatest(machine: Machine, sphere: Sphere, bodies: bool, step: float) -> float | None:
    """The tilt (rad) that is reached at every azimuth; None where the machine reaches no pose, or not the pole."""
    from trivet.errors import NoResultError
    from trivet.study.tilt import tilt

    neutral, height, radius = sphere
    try:
        report = tilt(machine, radius, height, neutral=neutral, bodies=bodies, azimuths=AZIMUTHS, step=math.radians(step))
    except NoResultError:
        return None
    return report.tilt if math.isfinite(report.tilt) else None
