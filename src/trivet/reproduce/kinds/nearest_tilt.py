"""Published tilts without neutral axis, height or radius: which sphere comes nearest, and which leans most (paper Table 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from trivet.model.quantity import Length, PositiveLength
from trivet.model.section import STRICT
from trivet.reach.neutral import Reference
from trivet.reproduce.found import Asked, Found, Progress
from trivet.reproduce.kinds.leaning import ALL, MOST, Lean, Leaning, Sphere, best_sphere, rows_of
from trivet.reproduce.numbers import Number

WAYS = {"tilt": "nearest sphere", "greatest tilt": "sphere of the greatest tilt"}
"""What is told, and on which sphere; "tilt" is the one that comes nearest to the published one."""


class Best(NamedTuple):
    """One machine with one neutral axis."""

    leans: dict[str, Lean | None]
    """By what is told, one of WAYS; None where no sphere is reached, or nothing published."""
    poles: set[Sphere]
    """Spheres of the grid whose pole is reached."""
    one_sided: float
    """How far it comes from upright on any of them without crossing a singularity, rad."""


@dataclass(frozen=True)
class NearestTilt:
    """Per machine and neutral axis two spheres: the tilt of one is nearest to the published one, that of the other greatest.

    Both are sought over a grid of heights and radii, and then about its best.
    """

    __pydantic_config__ = STRICT

    kind: Literal["nearest tilt"]
    neutral: Reference
    """Of the tilt that is set beside the paper's digits."""
    greatest_neutral: Reference
    """Of the greatest tilt that orders and statements are looked at."""
    heights: tuple[Length, ...]
    radii: tuple[PositiveLength, ...]
    bodies: bool = False
    """Whether bodies must stay apart."""
    step: Annotated[float, Field(gt=0, le=30)] = 1.0
    """Of the tilt, degrees; it is refined between."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """Nearest and greatest tilts, what of them is reached without a singularity, how many spheres all machines reach."""
        from trivet.study.machines import choose

        (paper,) = (one.paper for one in asked if one.quantity == "tilt")
        chosen = {name: choose(name) for name in machines}
        firsts = dict(zip(WAYS, (self.neutral, self.greatest_neutral), strict=True))
        axes: list[Reference] = list(dict.fromkeys((*firsts.values(), *ALL)))
        best: dict[tuple[Reference, str], Best] = {}
        for axis, name in product(axes, machines):
            best[axis, name] = self._best(Leaning(chosen[name], axis, self.bodies, self.step), paper[name])
            progress(len(best), len(axes) * len(machines))
        rows = [
            row
            for told, where in WAYS.items()
            for axis in dict.fromkeys((firsts[told], *axes))
            for name in machines
            for row in rows_of(told, name, f"{axis}, {where}", best[axis, name].leans[told])
        ]
        leans = ((name, own.leans[told]) for told in WAYS for (_, name), own in best.items())
        notes = dict.fromkeys(lean.words(name) for name, lean in leans if lean)
        far = {name: max(best[axis, name].one_sided for axis in axes) for name in machines}
        words = ", ".join(f"{name} {math.degrees(own):.0f}°" for name, own in far.items())
        ways = f"From upright, over all spheres of the grid and with all axes, without crossing a singularity: {words}."
        together = sum(len(set.intersection(*(best[axis, name].poles for name in machines))) for axis in axes)
        cases = len(axes) * len(self.heights) * len(self.radii)
        last = f"Of {cases} spheres and axes of the grid {together} are reached at their pole by all {len(machines)} machines."
        return Found(tuple(rows), notes=(*notes, ways, last))

    def _best(self, leaning: Leaning, wanted: Number | None) -> Best:
        tilt = cache(leaning.tilt)
        asked = {"greatest tilt": MOST} | ({} if wanted is None else {"tilt": wanted.value})
        grid = leaning.neutral, self.heights, self.radii
        spheres = {told: best_sphere(tilt, angle, *grid) for told, angle in asked.items()}
        leans = {told: None if (sphere := spheres.get(told)) is None else leaning.lean(sphere) for told in WAYS}
        every = (Sphere(leaning.neutral, *case) for case in product(self.heights, self.radii))
        poles = {sphere for sphere in every if tilt(sphere) is not None}
        return Best(leans, poles, max(map(leaning.from_upright, poles), default=0.0))
