"""Aspects: which poses a machine reaches from another one without crossing a singularity or a joint limit.

Two poses of different working modes, or with different signs of det J^-1, are apart: every way between them crosses a
singularity.  That two poses are of one aspect is shown by a way between them, looked at in small steps.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.kinematics.jacobian import inverse_jacobian
from trivet.kinematics.report import JointState, joint_elements, joint_state, travel_excess
from trivet.model import Machine
from trivet.space.elimination import determinant
from trivet.space.frame import Angle, Frame
from trivet.space.pose import between
from trivet.space.scalar import Scalar

Verdict = Literal["connected", "apart", "unknown"]
"""Whether a way was found, there can be none, or neither is known."""

STEPS = 128
"""Steps along a way."""
DETOURS = 24
"""Ways over a random pose between the ends, tried in a fixed order after the straight one."""
JUMP = 0.5
"""Step of a joint (rad, or in units of the machine's size) above which it has jumped from one branch to another."""


def _looked_at(machine: Machine, pose: Frame, signs: Scalar) -> tuple[Scalar, ...]:
    state = joint_state(machine, pose, signs)
    return (*state, determinant(inverse_jacobian(machine, pose, signs)))


_look = jax.jit(jax.vmap(_looked_at, in_axes=(None, 0, None)))


def connected(machine: Machine, start: Frame, end: Frame, signs: Any) -> Verdict:
    """Whether a machine gets from one pose to another in a working mode without a singularity or a limit on the way.

    Args:
        machine: the machine; its chains in closed form.
        start, end: platform frames {E} in {O}, of floats (m).
        signs: (n_chains, 2) working mode of both.
    """
    straight = _travelled(machine, between(start, end, np.linspace(0, 1, STEPS + 1)), signs)
    if straight.side[0] * straight.side[-1] < 0 or not straight.inside[[0, -1]].all():
        return "apart"
    if straight.is_clear:
        return "connected"
    random = np.random.default_rng(0)
    spread = float(np.linalg.norm(np.subtract(end.origin, start.origin))) + float(machine.characteristic_length)
    half = np.linspace(0, 1, STEPS // 2 + 1)
    for _ in range(DETOURS):
        middle = _beside(start, end, random, spread)
        there, back = between(start, middle, half[:-1]), between(middle, end, half)
        way = jax.tree.map(lambda a, b: np.concatenate([a, b]), there, back)
        if _travelled(machine, way, signs).is_clear:
            return "connected"
    return "unknown"


def _beside(start: Frame, end: Frame, random: np.random.Generator, spread: float) -> Frame:
    """A random pose about the middle of the straight way."""
    part = float(random.uniform(0.2, 0.8))
    middle = jax.tree.map(lambda c: float(c[0]), between(start, end, np.array([part])))
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    tip = float(random.uniform(-0.6, 0.6))
    turned = middle.turn(tuple(axis), Angle(math.cos(tip), math.sin(tip)))
    shift = random.uniform(-0.5, 0.5, 3) * spread
    found: Frame = turned._replace(origin=type(middle.origin)(*(c + s for c, s in zip(middle.origin, shift, strict=True))))
    return found


class _Way(NamedTuple):
    """What is met along a way, pose by pose."""

    inside: Any
    """Whether all chains close with all joints inside their travel."""
    side: Any
    """Sign of det J^-1.  It does not depend on how the constraints are written."""
    step: Any
    """Greatest step of a joint to the next pose, rad or in units of the machine's size."""

    @property
    def is_clear(self) -> bool:
        """Whether neither a limit nor a singularity is met."""
        return bool(self.inside.all() and self.side[0] != 0 and (self.side == self.side[0]).all() and (self.step < JUMP).all())


def _travelled(machine: Machine, way: Frame, signs: Any) -> _Way:
    *joints, determinants = (np.asarray(a) for a in _look(jax.tree.map(jnp.asarray, machine), way, jnp.asarray(signs)))
    state = JointState(*joints)
    inside = np.all(state.reach >= 0, axis=1) & np.all(travel_excess(state) <= 0, axis=1)
    turning = np.array([e.is_angular for e in joint_elements(machine)])
    steps = np.abs(np.diff(state.coordinate, axis=0))
    turns = np.minimum(steps, np.abs(steps - 2 * math.pi))
    # A slide that jumps does so by far more than the platform moves.
    size = max(float(np.abs(np.stack(way.origin)).max()), float(machine.characteristic_length))
    return _Way(inside, np.sign(determinants), np.where(turning, turns, steps / size).max(axis=1))
