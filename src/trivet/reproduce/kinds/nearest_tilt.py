"""Published tilts without neutral axis, height or radius: which sphere comes nearest (paper Table 3, last row)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated, Literal

from pydantic import Field

from trivet.model.quantity import Length, PositiveLength
from trivet.model.section import STRICT
from trivet.reach.neutral import Reference
from trivet.reproduce.found import Asked, Found, Ours, Progress
from trivet.reproduce.kinds.tilt import ALL, Sphere, greatest
from trivet.reproduce.numbers import Number


@dataclass(frozen=True)
class NearestTilt:
    """Per machine and neutral axis the tilt, over all spheres of a grid, that is nearest to the published one."""

    __pydantic_config__ = STRICT

    kind: Literal["nearest tilt"]
    neutral: Reference
    """Of what is set beside the paper."""
    heights: tuple[Length, ...]
    radii: tuple[PositiveLength, ...]
    bodies: bool = False
    """Whether bodies must stay apart."""
    step: Annotated[float, Field(gt=0, le=30)] = 1.0
    """Of the tilt, degrees; it is refined between."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """The nearest tilts, and how many spheres all machines reach."""
        from trivet.study.machines import choose

        axes = list(dict.fromkeys((self.neutral, *ALL)))
        spheres = [Sphere(*case) for case in product(axes, self.heights, self.radii)]
        tilts: dict[str, dict[Sphere, float]] = {}
        for number, name in enumerate(machines):
            machine, tilts[name] = choose(name), {}
            for done, sphere in enumerate(spheres, 1):
                value = greatest(machine, sphere, self.bodies, self.step)
                if value is not None:
                    tilts[name][sphere] = value
                progress(number * len(spheres) + done, len(machines) * len(spheres))
        (paper,) = (one.paper for one in asked if one.quantity == "tilt")
        best = {(name, axis): _nearest(tilts[name], axis, paper[name]) for axis in axes for name in machines}
        rows = [
            Ours("tilt", name, f"{axis}, nearest sphere", None if sphere is None else tilts[name][sphere], "deg")
            for (name, axis), sphere in best.items()
        ]
        notes = [
            f"{name} comes nearest at {'; '.join(str(near) for (own, _), near in best.items() if own == name and near)}."
            for name in machines
        ]
        everywhere = sum(all(sphere in own for own in tilts.values()) for sphere in spheres)
        cases = f"Of {len(spheres)} spheres and axes {everywhere} are"
        return Found(tuple(rows), notes=(*notes, f"{cases} reached at their pole by all {len(machines)} machines."))


def _nearest(tilts: dict[Sphere, float], axis: Reference, wanted: Number | None) -> Sphere | None:
    """The sphere whose tilt is nearest to a published one; None where none is reached, or nothing published."""
    own = [sphere for sphere in tilts if sphere.neutral == axis]
    return min(own, key=lambda sphere: abs(tilts[sphere] - wanted.value)) if own and wanted is not None else None
