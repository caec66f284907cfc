"""The greatest tilt over the radius of the sphere, and what neutral axis and height do to it (paper section 3.1, Fig 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Literal

from pydantic import Field

from trivet.model.quantity import Length, PositiveLength
from trivet.model.section import STRICT
from trivet.reach.neutral import Reference
from trivet.reproduce.found import Asked, Chart, Found, Progress, Series
from trivet.reproduce.kinds.leaning import ALL, Lean, Leaning, Sphere, rows_of


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
        leans: dict[tuple[str, Sphere], Lean | None] = {}
        for name in machines:
            machine = choose(name)
            leaning = {axis: Leaning(machine, axis, self.bodies, self.step) for axis in (self.neutral, *ALL)}
            for sphere in spheres:
                leans[name, sphere] = leaning[sphere.neutral].lean(sphere)
                progress(len(leans), len(machines) * len(spheres))
        told = product(dict.fromkeys([own, *varied]), machines)
        rows = [row for sphere, name in told for row in rows_of("tilt", name, str(sphere), leans[name, sphere])]
        notes = tuple(lean.words(name) for name in machines if (lean := leans[name, own]))
        return Found(tuple(rows), tuple(self._charts(machines, curve, varied, leans)), notes)

    def _charts(
        self,
        machines: tuple[str, ...],
        curve: list[Sphere],
        varied: list[Sphere],
        leans: dict[tuple[str, Sphere], Lean | None],
    ) -> list[Chart]:
        def line(label: str, name: str, spheres: list[Sphere], along: Literal["height", "radius"]) -> Series:
            degrees = [None if (lean := leans[name, s]) is None else round(math.degrees(lean.tilt), 3) for s in spheres]
            return Series(label, [1e3 * float(getattr(s, along)) for s in spheres], degrees)

        title = f"neutral axis {self.neutral}, z0 = {1e3 * self.height:g} mm"
        over_radius = [line(name, name, curve, "radius") for name in machines]
        charts = [Chart(title, "", "radius of the sphere, mm", "tilt, °", over_radius)]
        for name in machines:
            series = [line(n, name, [s for s in varied if s.neutral == n], "height") for n in ALL]
            panel = name.partition("@")[2] or name
            charts.append(Chart(f"radius {1e3 * self.radius:g} mm, neutral axis by axis", panel, "z0, mm", "tilt, °", series))
        return charts
