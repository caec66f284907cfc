"""Means and variances of the static stiffness over the check points (paper section 3.3.1, Tables 2 and 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from trivet.model.section import STRICT
from trivet.reproduce.found import AS_DESCRIBED, Asked, Found, Ours, Progress


@dataclass(frozen=True)
class Static:
    """Stiffness maps with the best roll; quantities are "mean K_xx", "variance K_xx" and "points"."""

    __pydantic_config__ = STRICT

    kind: Literal["static"]
    steps: Annotated[int, Field(ge=1, le=100)] = 10
    """Lattice steps from pole to rim."""
    balls: tuple[str, ...] = (AS_DESCRIBED,)
    """How ball joints give way, setting by setting: as described, free, clamped, or a stiffness with its unit."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """Moments in every setting."""
        from trivet.study.comparison import CAVEATS, HELD, compare
        from trivet.study.machines import choose, switched

        rows: list[Ours] = []
        done, total = 0, len(machines) * len(self.balls)
        for balls in self.balls:
            setting = balls if balls == AS_DESCRIBED else f"balls {balls}"
            for name in machines:
                machine = switched(choose(name), spherical=None if balls == AS_DESCRIBED else balls)
                samples = compare(machine, steps=self.steps, finer=1).samples()[machine.name]
                for quantity in HELD:
                    own = samples[quantity]
                    rows.append(Ours(f"mean {quantity}", name, setting, own.mean, "N/um"))
                    rows.append(Ours(f"variance {quantity}", name, setting, own.variance, "N^2/um^2"))
                rows.append(Ours("points", name, setting, float(own.n), ""))
                done += 1
                progress(done, total)
        return Found(tuple(rows), notes=CAVEATS)
