"""Condensed path: the stiffness which one chain lends the platform, from its compliances along screws.

With C = sum c_k s_k s_k^T the compliance of a chain in series (flexibilities of `model.elements`), W a basis of the wrenches
that its slack joints transmit, and G the map from the platform's twist to the twist at P,

    K = sum over chains of  G^T W (W^T C W)^-1 W^T G .

Each flexibility enters through the power of the basis wrenches on its screw, so C itself never appears.
"""

from __future__ import annotations

from typing import NamedTuple

from trivet.kinematics.constraint import transmitted
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import within
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg, Machine
from trivet.model.elements import Element, Flexibility, Stock
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar, add, mul
from trivet.space.screw import Wrench
from trivet.space.symmetric import Symmetric


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
    slack, parts = [], []
    for element, frame, coordinate in walk(leg.chain.elements, posture):
        # The walk rests the first joint; a beam on it is as long as its coordinate all the same.
        slack += element.slack(frame, coordinate, posture.end)
        parts += [(element, f) for f in element.flexibilities(frame, coordinate, posture.end, stock)]
    wrenches = transmitted(slack)
    matrix = Symmetric(len(wrenches))
    for _, flexibility in parts:
        matrix.add_dyad([w @ flexibility.twist for w in wrenches], flexibility.compliance)
    return LegCompliance(wrenches, matrix, parts)


def platform_stiffness(machine: Machine, pose: Frame, signs: Scalar) -> tuple[Symmetric, Scalar]:
    """Stiffness of a machine at one pose.

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}.
        signs: (n_chains, 2) working mode, see `kinematics.mode.parse_mode`.

    Returns:
        The 6 x 6 stiffness at the platform centre in {O} (forces first; N/m, N/rad, N m/rad), and whether the pose is
        reached with all joints inside their travel.
    """
    total, reached = Symmetric(6), None
    stock = machine.stock
    for index, leg in enumerate(machine.legs):
        posture = inverse(leg, pose, signs[index])
        part = leg_compliance(leg, posture, stock)
        arm = pose.direction(leg.platform_frame().origin)
        wrenches = [w.carried(posture.heading, arm) for w in part.wrenches]
        _add_product(total, part.matrix.inverse(), [(*w.force, *w.moment) for w in wrenches])
        inside = within(leg, posture)
        reached = inside if reached is None else reached & inside
    return total, reached


def _add_product(total: Symmetric, middle: Symmetric, rows: list[tuple[Scalar, ...]]) -> None:
    """Add rows^T middle rows."""
    size = middle.size
    for j in range(total.size):
        column = [_sum(mul(middle[a, b], rows[b][j]) for b in range(size)) for a in range(size)]
        for i in range(j + 1):
            total[i, j] = add(total[i, j], _sum(mul(rows[a][i], column[a]) for a in range(size)))


def _sum(terms: object) -> Scalar:
    result: Scalar = 0
    for term in terms:  # type: ignore[attr-defined]
        result = add(result, term)
    return result
