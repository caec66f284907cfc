"""Condensed path: the stiffness which one chain lends the platform, from its compliances along screws.

With C = sum c_k s_k s_k^T the compliance of a chain in series (flexibilities of `model.elements`), W a basis of the wrenches
that its slack joints transmit, and G the map from the platform's twist to the twist at P,

    K = sum over chains of  G^T W (W^T C W)^-1 W^T G .

Each flexibility enters through the power of the basis wrenches on its screw, so C itself never appears.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp

from trivet.errors import NoResultError
from trivet.kinematics.constraint import transmitted
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import within
from trivet.kinematics.walk import Posture, walk
from trivet.model import Chain, Leg, Machine, Mechanism
from trivet.model.elements import Element, Flexibility, Stock
from trivet.model.machine import copy_rotation
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, is_known, is_zero
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


class LegStiffness(NamedTuple):
    """What one chain lends the platform at a pose."""

    upper: tuple[Scalar, ...]
    """Upper triangle by rows of the stiffness at the platform centre in {O}."""
    reached: Scalar
    """Whether the chain closes with every joint inside its travel."""
    shared: tuple[Scalar, ...]
    """What several entries are made of: a kernel that wants many of them keeps these (`statics.stiffness`)."""


@jax.jit
def leg_stiffness(stock: Stock, leg: Leg, pose: Frame, signs: Scalar) -> LegStiffness:
    """The stiffness of one chain; a function of its own to JAX, which traces it once for all copies of a chain."""
    posture = inverse(leg, pose, signs)
    part = leg_compliance(leg, posture, stock)
    arm = pose.direction(leg.platform_frame().origin)
    wrenches = [w.carried(posture.heading, arm) for w in part.wrenches]
    rows = [(*w.force, *w.moment) for w in wrenches]
    middle = part.matrix.inverse()
    shared = (*posture.end, *part.matrix.upper(), *middle.upper(), *(component for row in rows for component in row))
    entries = product(middle, rows).upper()
    return LegStiffness(tuple(entries), within(leg, posture, pose), tuple(s for s in shared if not is_known(s)))


def platform_stiffness(mechanism: Mechanism, pose: Frame, signs: Scalar) -> tuple[Symmetric, Scalar]:
    """Stiffness of a machine at one pose.

    Args:
        mechanism: of the machine, its actuators at rest.
        pose: platform frame {E} in {O}, scalar components.
        signs: (n_chains, 2) working mode, see `kinematics.mode.parse_mode`.

    Returns:
        The 6 x 6 stiffness at the platform centre in {O} (forces first; N/m, N/rad, N m/rad), and whether the pose is
        reached with all joints inside their travel.
    """
    return total(leg_stiffnesses(mechanism, pose, signs))


def leg_stiffnesses(mechanism: Mechanism, pose: Frame, signs: Scalar) -> list[LegStiffness]:
    """The stiffness of every chain at one pose; arguments as for `platform_stiffness`."""
    return [leg_stiffness(mechanism.stock, leg.unnamed, pose, signs[k]) for k, leg in enumerate(mechanism.legs)]


def total(parts: Sequence[LegStiffness]) -> tuple[Symmetric, Scalar]:
    """Stiffness of all chains together, and whether all of them reach the pose."""
    entries = [reduce(operator.add, column) for column in zip(*(part.upper for part in parts), strict=True)]
    return Symmetric.of(6, entries), reduce(operator.and_, (part.reached for part in parts))


def platform_stiffness_by_copies(machine: Machine, pose: Frame, signs: Scalar) -> Symmetric:
    """The same stiffness with a loop over the copies of a chain that JAX compiles once.

    Its derivatives compile and run faster; maps could not bear what the loop writes to memory.
    """
    entries, first = Symmetric(6), 0
    for _, chain in sorted(machine.chains.items()):

        def add_copy(
            upper: tuple[Scalar, ...], copy: tuple[Scalar, Scalar], chain: Chain = chain
        ) -> tuple[tuple[Scalar, ...], None]:
            rotation, sign = copy
            own = leg_stiffness(machine.stock, Leg.standing(chain, rotation), pose, sign).upper
            return tuple(map(operator.add, upper, own)), None

        rotations = jnp.asarray([copy_rotation(chain, k) for k in range(chain.copies)])
        nothing = (jnp.zeros_like(pose.origin.x),) * 21
        upper, _ = jax.lax.scan(add_copy, nothing, (rotations, signs[first : first + chain.copies]))
        entries = entries.plus(Symmetric.of(6, upper))
        first += chain.copies
    return entries


def product(middle: Symmetric, rows: list[tuple[Scalar, ...]]) -> Symmetric:
    """rows^T middle rows, 6 x 6."""
    size, result = middle.size, Symmetric(6)
    for j in range(6):
        column = [dot([middle[a, b] for b in range(size)], [row[j] for row in rows]) for a in range(size)]
        for i in range(j + 1):
            result[i, j] = dot([row[i] for row in rows], column)
    return result
