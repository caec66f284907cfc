"""Inverse kinematics in closed form, for every chain of a kind that `chains/` knows."""

from __future__ import annotations

from types import ModuleType

from trivet.errors import InputError
from trivet.kinematics.chains import foot, planar, strut
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import Drivable
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar

KINDS: tuple[ModuleType, ...] = (planar, strut, foot)


def kind_of(leg: Leg) -> ModuleType:
    """The kind of chain which solves a leg.

    Raises:
        InputError: when the chain has not six freedoms, or no kind matches.
    """
    elements = leg.chain.elements
    _require_six(leg)
    for kind in KINDS:
        if kind.matches(elements):
            return kind
    kinds = " ".join(e.type for e in elements)
    raise InputError(
        f"chains.{leg.name}: no closed-form inverse kinematics for the chain {kinds}; solved are a circular or straight guide "
        "with a slide and link, a telescope or two links; a strut; a foot in the plane (single poses are closed numerically)"
    )


def require_six_freedoms(machine: Machine) -> None:
    """Raise InputError, naming the joints to lock or release, unless every chain has the platform's six freedoms."""
    for leg in machine.legs:
        _require_six(leg)


def _require_six(leg: Leg) -> None:
    joints = leg.chain.elements
    count = sum(len(e.unknowns) for e in joints)
    drives = ", ".join(e.name for e in joints if isinstance(e, Drivable) and e.is_driven)
    if count > 6:
        raise InputError(
            f"chains.{leg.name}: has {count} freedoms, {count - 6} more than the platform; "
            f"lock {count - 6} of its drives {drives}"
        )
    if count < 6:
        raise InputError(
            f"chains.{leg.name}: has {count} freedoms, so the platform cannot keep its six; release {6 - count} of its joints"
        )


def has_closed_form(leg: Leg) -> bool:
    """Whether a kind of chain solves a leg."""
    try:
        kind_of(leg)
    except InputError:
        return False
    return True


def branches(leg: Leg) -> tuple[int, ...]:
    """The choices which a chain's inverse kinematics has, out of SIDE and ELBOW."""
    found: tuple[int, ...] = kind_of(leg).branches(leg.chain.elements)
    return found


def inverse(leg: Leg, pose: Frame, signs: Scalar) -> Posture:
    """How one chain stands at a platform pose (paper Eqs 2-4, with every branch).

    Args:
        leg: the chain.
        pose: platform frame {E} in {O}; component arrays of one batch shape.
        signs: (2,) side and elbow, +1 or -1.

    Returns:
        The posture; coordinates are NaN where `reach` is below zero.

    Raises:
        InputError: no kind of chain solves the leg.
    """
    posture: Posture = kind_of(leg).stand(leg, pose, signs)
    return posture
