"""A machine at poses while JAX traces it: what several quantities ask for is worked out once."""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from numpy.typing import NDArray

from trivet.design.rolls import climbed, on_the_grid, turns
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import within
from trivet.model import Machine
from trivet.model.machine import turned_by
from trivet.reach.scene import Scene
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.pose import rolled, tangent_axes
from trivet.space.scalar import Scalar
from trivet.space.surface import Surface, hemisphere
from trivet.space.symmetric import Symmetric
from trivet.space.vector import Vec
from trivet.statics.best_roll import on_grid
from trivet.statics.compliance import platform_stiffness
from trivet.statics.objective import Objective

Array = NDArray[Any]
Triple = tuple[float, float, float]

_Y, _Z = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class Load(NamedTuple):
    """What acts on the platform at its centre, and on all bodies; in {O}, SI."""

    force: Triple
    moment: Triple
    gravity: Triple


class Points(NamedTuple):
    """The check points, and how the roll is chosen at each."""

    steps: int
    """Lattice steps from pole to rim of the hemisphere."""
    radius: float | None
    """m; that of the workpiece where it is None."""
    height: float | None
    """Of the centre of the hemisphere, m; that of the workpiece where it is None."""
    objective: Objective
    """What the roll maximises."""
    rolls: int
    """That are looked at, evenly all round."""
    symmetry: int = 1
    """After this part of a turn the machine looks the same, but for the names of its chains."""
    climbs: bool = False
    """Whether the best roll is sought uphill from the best ones of the grid."""

    def sphere(self, machine: Machine) -> tuple[Any, Any]:
        """Height of the centre and radius (m); numbers of the machine may be traced."""
        piece = machine.workpiece
        radius = self.radius if piece is None or self.radius is not None else piece.radius
        return (self.height if piece is None or self.height is not None else piece.height), radius

    def surface(self, machine: Machine) -> Surface:
        """The points of a machine with plain numbers."""
        height, radius = self.sphere(machine)
        return hemisphere(float(height), float(radius), self.steps)

    def frames(self, machine: Machine) -> Frame:
        """Frames (n,) at zero roll; numbers of the machine may be traced."""
        unit = hemisphere(0.0, 1.0, self.steps)
        height, radius = self.sphere(machine)
        normal, first, second = tangent_axes(unit.azimuth, unit.tilt)
        x, y, z = (unit.position[:, k] * radius for k in range(3))
        return Frame(Vec(x, y, z + height), first, second, normal)


class Looked:
    """A machine at poses (n,), and whether what each stands for is reached: where it is not, the pose says nothing."""

    def __init__(self, machine: Machine, poses: Frame, reached: Scalar, signs: Any, scene: Scene, load: Load) -> None:
        self.machine, self.poses, self.reached = machine, poses, reached
        self.signs, self.scene, self.load = signs, scene, load

    @cached_property
    def stiffness(self) -> Symmetric:
        """6 x 6 at the platform centre in {O}, components (n,)."""
        mechanism = self.machine.mechanism
        upper = jax.vmap(lambda pose: tuple(platform_stiffness(mechanism, pose, self.signs)[0].upper()))(self.poses)
        return Symmetric.of(6, list(upper))

    def parts(self, index: Any, reached: Any) -> Looked:
        """The machine at some of the poses, and whether what they stand for is reached."""
        poses = jax.tree.map(lambda c: jnp.asarray(c)[index], self.poses)
        return Looked(self.machine, poses, reached, self.signs, self.scene, self.load)


class Stand:
    """A machine over its check points, each with its best roll, and at home."""

    def __init__(self, machine: Machine, points: Points, signs: Any, scene: Scene, load: Load) -> None:
        self.machine, self.points, self.signs = machine, points, signs
        self._scene, self._load = scene, load

    @cached_property
    def roll(self) -> tuple[Angle, Scalar]:
        """The best roll at every check point, and whether any is reached (n,)."""
        points, mechanism = self.points, self.machine.mechanism
        frames = jax.tree.map(jnp.asarray, points.frames(self.machine))
        if points.climbs:
            return climbed(mechanism, frames, self.signs, points.objective, points.rolls, points.symmetry)
        every = jax.tree.map(jnp.asarray, turns(points.rolls, points.symmetry))
        return on_the_grid(on_grid(mechanism, frames, every, self.signs, points.objective), every)

    @cached_property
    def surface(self) -> Looked:
        """Over the check points."""
        return self.at_rolls(*self.roll)

    def at_rolls(self, roll: Angle, reached: Any) -> Looked:
        """Over the check points with rolls (n,) that are known."""
        frames = jax.tree.map(jnp.asarray, self.points.frames(self.machine))
        return Looked(self.machine, rolled(frames, roll), reached, self.signs, self._scene, self._load)

    @cached_property
    def home(self) -> Looked:
        """At home."""
        home = self.machine.home
        frame = IDENTITY.shift(home.position)
        for axis, angle in ((_Z, home.azimuth), (_Y, home.tilt), (_Z, home.roll)):
            frame = frame.turn(axis, turned_by(angle, 0.0))
        frame = jax.tree.map(lambda c: jnp.asarray(c, dtype=float), frame)
        signs = self.signs
        legs = self.machine.legs_unnamed
        reached = jnp.all(jnp.stack([within(leg, inverse(leg, frame, signs[k]), frame) for k, leg in enumerate(legs)]))
        one = jax.tree.map(lambda c: c[None], frame)
        return Looked(self.machine, one, reached[None], signs, self._scene, self._load)
