"""How the forces of the actuators change with the state and with every dimension of the machine."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.dynamics import equations as eq
from trivet.dynamics.batch import NO_LOAD, Array, Case
from trivet.dynamics.bodies import Bodies, require_masses
from trivet.kinematics.singularity import nudged
from trivet.model import dimensions
from trivet.space.frame import Frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec


class Slopes(NamedTuple):
    """Derivatives of the actuators' forces tau_Q, in the order of Q, with everything else held."""

    dimensions: dict[str, Array]
    """(6,) per dimension of the machine, by its key path: N or N m per its SI unit.  The pose is held, not the joints."""
    pose: Array
    """(6, 6) per displacement of the platform: of its centre (m), and by a small turn about it (rad), in {O}."""
    twist: Array
    """(6, 6) per V (m/s, rad/s)."""
    acceleration: Array
    """(6, 6) per Vdot (m/s^2, rad/s^2): M_Q J_G^-1."""


def force_slopes(case: Case, state: eq.State, acceleration: Twist, load: Wrench = NO_LOAD) -> Slopes:
    """Derivatives at one state.

    Args:
        case: a machine with a working mode.
        state: one pose and twist, of numbers.
        acceleration: Vdot.
        load: on the platform, at its centre in {O}.

    Raises:
        InputError: as `batch.drive_motion`.
    """
    require_masses(case.machine)
    Bodies.of(case.machine)  # refuses what has not six drives
    twist, rise = (np.array([*t.linear, *t.angular], dtype=float) for t in (state.twist, acceleration))
    numbers, structure = jax.tree.flatten(case.machine)
    given = np.concatenate([np.array(numbers, dtype=float), np.zeros(6), twist, rise])
    held = jax.tree.map(lambda c: jnp.asarray(c, dtype=float).reshape(1), (state.pose, load, tuple(case.gravity), case.creep))
    # One compiled directional derivative, called per direction: all at once, and backwards too, take minutes to compile.
    columns = np.stack([_slope(structure, given, unit, held, jnp.asarray(case.signs)) for unit in np.eye(len(given))], axis=1)
    parts = np.split(columns, np.cumsum([len(numbers), 6, 6]), axis=1)
    own = dimensions(jax.tree.unflatten(structure, list(parts[0].T)))
    return Slopes(own, *parts[1:])


@partial(jax.jit, static_argnums=0)
def _slope(structure: Any, given: Any, direction: Any, held: Any, signs: Any) -> Any:
    """The derivative along one direction of all that is given: numbers of the machine, displacement, V and Vdot."""
    pose: Frame
    pose, load, gravity, creep = held

    def forces(given: Any) -> Any:
        count = len(given) - 18
        numbers, shift, twist, rise = jnp.split(given, [count, count + 6, count + 12])
        bodies = Bodies.of(jax.tree.unflatten(structure, list(numbers)))
        state = eq.State(nudged(pose, shift[:, None]), _twist(twist))
        stand = [group.stand(state.pose, signs) for group in bodies.alike()]
        around = eq.Surroundings(Vec(*gravity), load, creep)
        # Arrays compile in a few seconds; the derivative of the fused kernel takes four times as long.
        return eq.forces_of(eq.task_space(bodies, state, stand, around), rise[None], load, bodies.length)[0]

    return jax.jvp(forces, (given,), (direction,))[1]


def _twist(six: Any) -> Twist:
    return Twist(Vec(*six[:3, None]), Vec(*six[3:, None]))
