"""Inverse Jacobian, with J_q and J_x apart (paper Eqs 33-35)."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from trivet.errors import InputError
from trivet.kinematics.constraint import transmitted
from trivet.kinematics.standing import postures
from trivet.kinematics.walk import walk
from trivet.model import Machine
from trivet.model.elements import Drivable, Element
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar


class ConstraintRows(NamedTuple):
    """J_q Qdot = J_x V for one pose; rows are the wrenches which the chains transmit when their passive joints are free."""

    j_q: Scalar
    """(n, n_actuators): N resp. N m per unit of force."""
    j_x: Scalar
    """(n, 6): the wrenches at the platform centre in {O}, forces first."""


def is_driven(element: Element) -> bool:
    """Whether an element is a joint that a drive moves: actuated, and not locked."""
    return isinstance(element, Drivable) and element.is_driven


def actuator_names(machine: Machine) -> list[str]:
    """Actuators in the order of Q: the first of every chain, then the second of every chain (paper section 2)."""
    ranked = [
        (rank, f"{leg.name}.{element.name}")
        for leg in machine.legs
        for rank, element in enumerate(e for e in leg.chain.elements if is_driven(e))
    ]
    return [name for _, name in sorted(ranked, key=lambda pair: pair[0])]


def constraint_rows(machine: Machine, pose: Frame, signs: Scalar) -> ConstraintRows:
    """J_q and J_x of Eq (33) at one pose.

    Args:
        machine: the machine.
        pose: platform frame in {O}, scalar components.
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.
    """
    names = actuator_names(machine)
    rows_q, rows_x = [], []
    for leg, posture in zip(machine.legs, postures(machine, pose, signs), strict=True):
        steps = walk(leg.chain.elements, posture)
        passive = [t for e, f, c in steps if not is_driven(e) for t in e.freedoms(f, c, posture.end)]
        driven = {f"{leg.name}.{e.name}": e.freedoms(f, c, posture.end)[0] for e, f, c in steps if is_driven(e)}
        arm = pose.direction(leg.platform_frame().origin)
        for wrench in transmitted(passive):
            rows_q.append([wrench @ driven[name] if name in driven else 0.0 for name in names])
            moved = wrench.carried(posture.heading, arm)
            rows_x.append([*moved.force, *moved.moment])
    return ConstraintRows(_matrix(rows_q), _matrix(rows_x))


def inverse_jacobian(machine: Machine, pose: Frame, signs: Scalar) -> Scalar:
    """Geometric inverse Jacobian: Qdot = J^-1 V, (n_actuators, 6), rad/s and m/s per m/s and rad/s.

    Raises:
        InputError: when the actuators are not as many as the wrenches which the chains transmit (a redundant machine).
    """
    rows = constraint_rows(machine, pose, signs)
    n, actuators = rows.j_q.shape
    if n != actuators:
        raise InputError(f"{machine.name}: {actuators} actuators against {n} constraints; lock {abs(actuators - n)} of them")
    return jnp.linalg.solve(rows.j_q, rows.j_x)


def _matrix(rows: list[list[Scalar]]) -> Scalar:
    return jnp.stack([jnp.stack([jnp.asarray(v, dtype=float) for v in row]) for row in rows])
