"""One machine of a report: how commands name it, and what is worked out of it, once, however often it is told."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from trivet.model import Machine
from trivet.space.surface import Surface

if TYPE_CHECKING:
    from trivet.study.comparison import Comparison
    from trivet.study.dynamic_comparison import DynamicComparison
    from trivet.study.modes import ModesReport
    from trivet.study.motion import MotionReport
    from trivet.study.pose import PoseReport
    from trivet.study.response_summary import ShownResponse
    from trivet.study.singularity import SingularityReport
    from trivet.study.singularity_map import SingularityMap
    from trivet.study.tilt import TiltReport
    from trivet.study.workspace import WorkspaceReport

MODES = 12
"""Natural modes told of."""
PART = 0.1
"""Radius of the circle of a motion, of the characteristic length, where there is no workpiece."""


@dataclass(frozen=True)
class CheckPoints:
    """The check points; the machine's own workpiece where radius and height (m) are not given."""

    steps: int = 10
    radius: float | None = None
    height: float | None = None

    @property
    def lengths(self) -> tuple[str, ...]:
        """Options of commands for the sphere."""
        given = {"--radius": self.radius, "--height": self.height}
        return tuple(word for name, value in given.items() if value is not None for word in (name, f"{1e3 * value:g} mm"))

    @property
    def options(self) -> tuple[str, ...]:
        """Options of commands for the points."""
        return ("--steps", str(self.steps), *self.lengths) if self.steps != CheckPoints.steps else self.lengths


@dataclass(frozen=True)
class Subject:
    """A machine of a report; what is worked out is kept."""

    word: str
    """As commands name it: "azulay", "mine.toml", "azulay@link.length=200 mm"."""
    described: Machine
    """As its file says."""
    machine: Machine
    """With the switches of the model thrown."""
    switches: tuple[str, ...] = ()
    """Options of commands that throw them."""
    mode: str | None = None
    points: CheckPoints = CheckPoints()

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.machine.name

    def command(self, name: str, *options: str, before: str | None = None, model: bool = False, mode: bool = True) -> str:
        """The command that repeats something.

        Args:
            name: "map", "measure correlate".
            options: of its own.
            before: what stands before the machine.
            model, mode: whether it takes switches of the model, and a working mode.
        """
        words = (self.word,) if before is None else (before, self.word)
        switches = self.switches if model else ()
        signs = (f"--mode={self.mode}",) if mode and self.mode is not None else ()
        return shlex.join(["trivet", *name.split(), *words, *options, *switches, *signs])

    @property
    def radius(self) -> float | None:
        """Radius (m) of the hemisphere; None where nobody gives one."""
        piece = self.machine.workpiece
        return float(piece.radius) if self.points.radius is None and piece is not None else self.points.radius

    @property
    def surface(self) -> Surface:
        """The check points."""
        from trivet.study.stiffness_map import surface_of

        return surface_of(self.machine, self.points.steps, self.points.radius, self.points.height)

    @cached_property
    def home(self) -> PoseReport:
        """The machine at home."""
        from trivet.study.pose import pose

        return pose(self.machine, mode=self.mode)

    @cached_property
    def hidden(self) -> float:
        """Mass (kg) of rods inside the guides in which they slide, at home: it moves, and its inertia is in no mode."""
        from trivet.statics.assembly import assemble

        structure = assemble(self.machine, self.home.frame, self.home.signs)
        return sum(float(part.mass) for part in structure.sheathed)

    @cached_property
    def tilt(self) -> TiltReport:
        """How far it tilts."""
        from trivet.study.tilt import tilt

        return tilt(self.machine, self.points.radius, self.points.height, mode=self.mode)

    @cached_property
    def workspace(self) -> WorkspaceReport:
        """Where it gets to, oriented as at home."""
        from trivet.study.workspace import workspace

        return workspace(self.machine, mode=self.mode)

    @cached_property
    def singularity(self) -> SingularityReport:
        """How near home is to one."""
        from trivet.study.home import require_home
        from trivet.study.singularity import singularity_report

        require_home(self.machine, self.mode, within_travel=False)
        return singularity_report(self.machine, mode=self.mode)

    @cached_property
    def singularities(self) -> SingularityMap:
        """Over the check points."""
        from trivet.study.singularity_map import singularity_map

        return singularity_map(self.machine, self.surface, mode=self.mode)

    @cached_property
    def comparison(self) -> Comparison:
        """Stiffness over the check points, beside published values and a finer lattice: the static comparison of one."""
        from trivet.study.comparison import compare

        steps, radius, height = self.points.steps, self.points.radius, self.points.height
        return compare(self.machine, mode=self.mode, steps=steps, radius=radius, height=height)

    @cached_property
    def dynamics(self) -> DynamicComparison:
        """Least dynamic stiffness at home: the dynamic comparison of one."""
        from trivet.study.dynamic_comparison import compare_dynamics

        return compare_dynamics(self.machine, mode=self.mode, sensitivity=False)

    @cached_property
    def modes(self) -> ModesReport:
        """At home."""
        from trivet.study.mode_summary import MORE, aligned
        from trivet.study.modes import modes

        return aligned(modes(self.machine, mode=self.mode, count=MODES + MORE), MODES)

    @cached_property
    def response(self) -> ShownResponse:
        """At home."""
        from trivet.study.frf import frf
        from trivet.study.response_summary import ShownResponse

        return ShownResponse(frf(self.machine, mode=self.mode))

    @property
    def circle(self) -> float:
        """Radius (m) of the motion: that of the hemisphere, or a part of the machine's size."""
        if self.points.radius is not None:
            return self.points.radius
        own = PART * float(self.machine.characteristic_length) if self.radius is None else self.radius
        return float(f"{own:.2g}")

    @cached_property
    def motion(self) -> MotionReport:
        """Once round a level circle about home."""
        from trivet.kinematics.standing import home_pose
        from trivet.space.curve import Limits, circle, timed
        from trivet.study.home import require_home
        from trivet.study.motion import motion

        require_home(self.machine, self.mode)
        way = timed([circle(home_pose(self.machine), self.circle)], Limits())
        return motion(self.machine, way, mode=self.mode)
