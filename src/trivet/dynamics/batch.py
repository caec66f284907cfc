"""Rigid-body dynamics of a machine in numbers: batches of states in, NumPy arrays out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.dynamics import equations as eq
from trivet.dynamics.bodies import Bodies, require_masses
from trivet.dynamics.reactions import joint_wrenches
from trivet.errors import InputError
from trivet.kinematics.standing import postures
from trivet.model import Machine
from trivet.model.elements import Joint
from trivet.space.batches import in_batches
from trivet.space.frame import Frame
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import ZERO, Vec

Array = NDArray[Any]

NO_LOAD = Wrench(ZERO, ZERO)


class DriveMotion(NamedTuple):
    """What the actuators do; arrays (n, 6) in the order of Q, see `equations.Drives`."""

    force: Array
    speed: Array
    acceleration: Array


class Equations(NamedTuple):
    """The equations of motion, `equations.TaskSpace` and `equations.ActuatorSpace`, as NumPy arrays."""

    task: eq.TaskSpace
    actuators: eq.ActuatorSpace


class Case(NamedTuple):
    """A machine to be evaluated: how it stands, and what acts on it."""

    machine: Machine
    signs: Any
    """(n_chains, 2) working mode; None for a machine which is closed numerically, one pose at a time."""
    gravity: Sequence[float] = (0.0, 0.0, 0.0)
    """Acceleration of free fall in {O}, m/s^2."""
    creep: float = 0.0
    """Speed (m/s, rad/s) around which Coulomb friction passes through zero; zero for a jump."""


def drive_motion(case: Case, state: eq.State, acceleration: Twist, load: Wrench = NO_LOAD) -> DriveMotion:
    """Inverse dynamics: forces, speeds and accelerations of the actuators in given motions.

    Args:
        case: the machine.
        state: poses and twists, components (n,) or numbers.
        acceleration: Vdot.
        load: on the platform, at its centre in {O}.

    Returns:
        NaN where a chain does not reach.

    Raises:
        InputError: unless six drives move the platform's six freedoms, or a rod's mass is unknown.
        NoResultError: a machine without working modes does not reach the pose.
    """
    columns = _over(case, _drive_motion, (state, acceleration, load))
    return DriveMotion(*(np.stack(column, axis=-1) for column in columns))


def equations(case: Case, state: eq.State) -> Equations:
    """M, C, g and F of Eq (17) and of Eq (27); arguments and errors as for `drive_motion`."""
    return Equations(*_over(case, _equations, (state,)))


def platform_acceleration(case: Case, state: eq.State, forces: Array, load: Wrench = NO_LOAD) -> Array:
    """Forward dynamics: Vdot (n, 6) under actuator forces (n, 6) in the order of Q; the rest as for `drive_motion`."""
    columns = tuple(np.moveaxis(np.asarray(forces, dtype=float), -1, 0))
    return np.asarray(_over(case, _platform_acceleration, (state, columns, load)))


def reactions(case: Case, state: eq.State, acceleration: Twist, load: Wrench = NO_LOAD) -> Array:
    """Wrenches (n, joints, 6) in all joints, see `reactions.joint_wrenches`, in the order of `joint_list`."""
    return np.asarray(_over(case, _reactions, (state, acceleration, load)))


def energies(case: Case, state: eq.State) -> tuple[Array, Array]:
    """Kinetic and potential energy (n,), J; arguments and errors as for `drive_motion`."""
    kinetic, potential = _over(case, _energies, (state,))
    return kinetic, potential


def joint_list(machine: Machine) -> list[str]:
    """Names of all joints, chain by chain: "leg-1.guide"."""
    return [f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if isinstance(e, Joint)]


def _over(case: Case, kernel: Callable[..., Any], cases: tuple[Any, ...]) -> Any:
    """A kernel of bodies, stand, surroundings and cases over a batch."""
    require_masses(case.machine)
    bodies = jax.tree.map(np.asarray, Bodies.of(case.machine))  # of NumPy: JAX's own cost 30 µs each to make
    cases = _shaped(cases)
    around = (np.asarray(case.gravity, dtype=float), np.asarray(case.creep, dtype=float))
    if case.signs is not None:
        run = partial(_in_mode, kernel, bodies, np.asarray(case.signs), around)
        return in_batches(run, cases)
    pose: Frame = cases[0].pose
    if len(pose.origin.x) != 1:
        raise InputError(f"{case.machine.name}: a chain without closed form is followed one pose at a time")
    one = jax.tree.map(lambda c: float(c[0]), pose)
    return jax.tree.map(np.asarray, _closed(kernel, bodies, bodies.grouped(postures(case.machine, one, None)), around, cases))


def _shaped(cases: tuple[Any, ...]) -> tuple[Any, ...]:
    """All components as arrays (n,)."""
    leaves, structure = jax.tree.flatten(cases)
    shape = np.broadcast_shapes((1,), *(np.shape(leaf) for leaf in leaves))
    spread = [np.broadcast_to(np.asarray(leaf, dtype=float), shape) for leaf in leaves]
    return tuple(jax.tree.unflatten(structure, spread))


@partial(jax.jit, static_argnums=0)
def _in_mode(kernel: Callable[..., Any], bodies: Bodies, signs: Any, around: Any, cases: Any) -> Any:
    return kernel(bodies, [group.stand(cases[0].pose, signs) for group in bodies.alike()], around, *cases)


@partial(jax.jit, static_argnums=0)
def _closed(kernel: Callable[..., Any], bodies: Bodies, stand: Any, around: Any, cases: Any) -> Any:
    return kernel(bodies, stand, around, *cases)


def _surroundings(around: Any, load: Wrench) -> eq.Surroundings:
    gravity, creep = around
    return eq.Surroundings(Vec(gravity[0], gravity[1], gravity[2]), load, creep)


def _drive_motion(bodies: Bodies, stand: eq.Stand, around: Any, state: eq.State, rise: Twist, load: Wrench) -> Any:
    # Components, not an array of them: XLA would work out all of it once more per entry.
    return tuple(eq.inverse_dynamics(bodies, state, rise, stand, _surroundings(around, load)))


def _equations(bodies: Bodies, stand: eq.Stand, around: Any, state: eq.State) -> Any:
    task = eq.task_space(bodies, state, stand, _surroundings(around, NO_LOAD))
    return task, eq.actuator_space(task, bodies.length)


def _platform_acceleration(
    bodies: Bodies, stand: eq.Stand, around: Any, state: eq.State, forces: tuple[Any, ...], load: Wrench
) -> Any:
    task = eq.task_space(bodies, state, stand, _surroundings(around, load))
    return eq.forward_dynamics(task, jnp.stack(forces, axis=-1), load)


def _reactions(bodies: Bodies, stand: eq.Stand, around: Any, state: eq.State, rise: Twist, load: Wrench) -> Any:
    surroundings = _surroundings(around, load)
    forces = eq.inverse_dynamics(bodies, state, rise, stand, surroundings).force
    return joint_wrenches(bodies, state, rise, stand, surroundings, forces)


def _energies(bodies: Bodies, stand: eq.Stand, around: Any, state: eq.State) -> Any:
    return eq.energy(bodies, state, stand, _surroundings(around, NO_LOAD).gravity)
