"""What the drives bear at rest, under weight and load: the greatest of all forces, or of all torques."""

from __future__ import annotations

import jax.numpy as jnp

from trivet.design.fields import Field
from trivet.design.looked import Looked
from trivet.dynamics.bodies import Bodies, require_masses
from trivet.dynamics.equations import REST, State, Surroundings, inverse_dynamics
from trivet.kinematics.jacobian import actuators
from trivet.model import Machine
from trivet.model.quantity import Quantity
from trivet.space.scalar import Scalar
from trivet.space.screw import Wrench
from trivet.space.vector import Vec

FORCE, TORQUE = "drive force", "drive torque"
NAMES = (FORCE, TORQUE)

_KINDS = {FORCE: Quantity("force", "N", "N"), TORQUE: Quantity("torque", "N m", "N m")}


def read(name: str) -> Field | None:
    """The field of a name."""
    if name not in NAMES:
        return None
    is_torque = name == TORQUE

    def lacks(machine: Machine) -> str | None:
        return None if any(_counted(machine, is_torque)) else f"no drive of it {'turns' if is_torque else 'slides'}"

    return Field(name, _KINDS[name], lambda looked: _greatest(looked, is_torque), _check, lacks)


def _check(machine: Machine) -> None:
    require_masses(machine)
    Bodies.of(machine)


def _counted(machine: Machine, is_torque: bool) -> list[bool]:
    """Per actuator whether it counts: a carriage on a circle has a torque about the axis of the circle."""
    return [joint.is_angular == is_torque for _, joint in actuators(machine)]


def _greatest(looked: Looked, is_torque: bool) -> Scalar:
    bodies = Bodies.of(looked.machine)
    stand = [group.stand(looked.poses, looked.signs) for group in bodies.alike()]
    load, one = looked.load, jnp.ones_like(looked.poses.origin.x)
    wrench = Wrench(*(Vec(*(one * c for c in part)) for part in (load.force, load.moment)))
    around = Surroundings(Vec(*load.gravity), wrench)
    forces = inverse_dynamics(bodies, State(looked.poses, REST), REST, stand, around).force
    counted = [jnp.abs(f) for f, counts in zip(forces, _counted(looked.machine, is_torque), strict=True) if counts]
    return jnp.max(jnp.stack(counted), axis=0)
