"""Condensed path: the stiffness which one chain lends the platform, from its compliances along screws.

With C = sum c_k s_k s_k^T the compliance of a chain in series (flexibilities of `model.elements`), W a basis of the wrenches
that its slack joints transmit, and G the map from the platform's twist to the twist at P,

    K = sum over chains of  G^T W (W^T C W)^-1 W^T G .

Each flexibility enters through the power of the basis wrenches on its screw, so C itself never appears.
"""

from __future__ import annotations

import math
import operator
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp

from trivet.errors import NoResultError
from trivet.kinematics.constraint import transmitted
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import within
from trivet.kinematics.walk import Posture, walk
from trivet.model import Chain, Leg, Machine
from trivet.model.elements import Element, Flexibility, Stock
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, is_zero
from trivet.space.screw import Twist, Wrench
from trivet.space.symmetric import Symmetric, dot


class LegCompliance(NamedTuple):
    """What one chain is made of, seen from its platform joint, in its own frame."""

    wrenches: list[Wrench]
    """Basis W of the wrenches it transmits, reduced at P."""
    matrix: Symmetric
    """W^T C W."""
    parts: list[tuple[Element, Flexibility]]
    """The flexibilities, each with the element to which it belongs."""


def leg_compliance(leg: Leg, posture: Posture, stock: Stock) -> LegCompliance:
    """Compliance of one chain at its platform joint."""
    slack: list[Twist] = []
    parts: list[tuple[Element, Flexibility]] = []
    for element, frame, coordinate in walk(leg.chain.elements, posture):
        slack += element.slack(frame, coordinate, posture.end)
        parts += [(element, f) for f in element.flexibilities(frame, coordinate, posture.end, stock)]
    wrenches = transmitted(slack)
    matrix = Symmetric(len(wrenches))
    for _, flexibility in parts:
        matrix.add_dyad([w @ flexibility.twist for w in wrenches], flexibility.compliance)
    if any(is_zero(matrix[i, i]) for i in range(matrix.size)):
        raise NoResultError(
            "a chain is rigid in a direction in which it transmits a force; give a joint a stiffness, or a slide a beam"
        )
    return LegCompliance(wrenches, matrix, parts)


@jax.jit
def leg_stiffness(
    machine: Machine, chain: Chain, rotation: Scalar, pose: Frame, signs: Scalar
) -> tuple[tuple[Scalar, ...], Scalar]:
    """The stiffness which one copy of a chain lends the platform (upper triangle by rows), and whether it reaches the pose.

    A function of its own to JAX, which traces it once for all copies of a chain and all kernels that use it.
    """
    leg = Leg("", chain, rotation)
    posture = inverse(leg, pose, signs)
    part = leg_compliance(leg, posture, machine.stock)
    arm = pose.direction(leg.platform_frame().origin)
    wrenches = [w.carried(posture.heading, arm) for w in part.wrenches]
    stiffness = _product(part.matrix.inverse(), [(*w.force, *w.moment) for w in wrenches])
    return tuple(stiffness.upper()), within(leg, posture)


def platform_stiffness(machine: Machine, pose: Frame, signs: Scalar) -> tuple[Symmetric, Scalar]:
    """Stiffness of a machine at one pose.

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, scalar components.
        signs: (n_chains, 2) working mode, see `kinematics.mode.parse_mode`.

    Returns:
        The 6 x 6 stiffness at the platform centre in {O} (forces first; N/m, N/rad, N m/rad), and whether the pose is
        reached with all joints inside their travel.
    """
    parts = [leg_stiffness(machine, leg.chain, leg.rotation, pose, signs[index]) for index, leg in enumerate(machine.legs)]
    entries = [reduce(operator.add, column) for column in zip(*(upper for upper, _ in parts), strict=True)]
    return Symmetric.of(6, entries), reduce(operator.and_, (inside for _, inside in parts))


def platform_stiffness_by_copies(machine: Machine, pose: Frame, signs: Scalar) -> Symmetric:
    """The same stiffness with the copies of a chain as a batch of one kernel instead of one after the other.

    It compiles three times as fast for three copies, which derivatives need, and runs slower, which maps could not bear.
    """
    total, first = Symmetric(6), 0
    for _, chain in sorted(machine.chains.items()):
        rotations = jnp.asarray([2 * math.pi * k / chain.copies for k in range(chain.copies)])
        by_copy = jax.vmap(leg_stiffness, in_axes=(None, None, 0, None, 0))
        entries, _ = by_copy(machine, chain, rotations, pose, signs[first : first + chain.copies])
        total = total.plus(Symmetric.of(6, [entry.sum(axis=0) for entry in entries]))
        first += chain.copies
    return total


def _product(middle: Symmetric, rows: list[tuple[Scalar, ...]]) -> Symmetric:
    """rows^T middle rows, 6 x 6."""
    size, result = middle.size, Symmetric(6)
    for j in range(6):
        column = [dot([middle[a, b] for b in range(size)], [row[j] for row in rows]) for a in range(size)]
        for i in range(j + 1):
            result[i, j] = dot([row[i] for row in rows], column)
    return result
