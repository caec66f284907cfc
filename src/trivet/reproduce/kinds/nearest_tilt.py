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
        cases = [Sphere(*case) for case in product(axes, self.heights, self.radii)]
        (paper,) = (one.paper for one in asked if one.quantity == "tilt")
        rows, notes, reached = [], [], dict.fromkeys(cases, 0)
        for number, name in enumerate(machines):
            machine, tilts = choose(name), {}
            for done, case in enumerate(cases, 1):
                value = greatest(machine, case, self.bodies, self.step)
                if value is not None:
                    tilts[case] = value
                    reached[case] += 1
                progress(number * len(cases) + done, len(machines) * len(cases))
            wanted = paper[name]
            for axis in axes:
                own = {case: value for case, value in tilts.items() if case.neutral == axis}
                best = min(own, key=lambda c: abs(own[c] - wanted.value)) if own and wanted is not None else None
                rows.append(Ours("tilt", name, _setting(axis), None if best is None else own[best], "deg"))
                if best is not None:
                    notes.append(f"{name} comes nearest at {best}.")
        everywhere = sum(count == len(machines) for count in reached.values())
        notes.append(
            f"Of {len(cases)} spheres and axes {everywhere} are reached at their pole by all {len(machines)} machines."
        )
        rows.sort(key=lambda row: axes.index(row.setting.partition(",")[0]))  # type: ignore[arg-type]
        return Found(tuple(rows), notes=tuple(notes))


def _setting(axis: str) -> str:
    return f"{axis}, nearest sphere"
