"""How far a machine is from what stops it: ends of travel, collisions, Type 2 singularities."""

from __future__ import annotations

from trivet.design.fields import Field
from trivet.design.looked import Looked
from trivet.errors import InputError
from trivet.kinematics.jacobian import require_six_each
from trivet.model import Machine
from trivet.model.quantity import Quantity
from trivet.reach import margins
from trivet.reach.scene import scene_of
from trivet.space.scalar import Scalar

TRAVEL, CLEARANCE, SINGULARITY = "travel margin", "clearance", "singularity margin"
NAMES = (TRAVEL, CLEARANCE, SINGULARITY)

_PART = Quantity("part of half the travel", "", "")
_SIGMA = Quantity("singular value", "", "")
_DISTANCE = Quantity("length", "m", "mm")


def read(name: str) -> Field | None:
    """The field of a name.

    The travel margin is the least of all joints, `reach.margins.travel_margin`; the singularity margin is the smallest singular
    value of J_x, `reach.margins.Control`; the clearance the distance of the nearest bodies that must not touch.
    """
    fields = {
        TRAVEL: Field(TRAVEL, _PART, _travel),
        CLEARANCE: Field(CLEARANCE, _DISTANCE, _clearance, _require_plain, _no_pairs),
        SINGULARITY: Field(SINGULARITY, _SIGMA, _singularity, require_six_each),
    }
    return fields.get(name)


def room(looked: Looked) -> Scalar:
    """How far all chains are from where they cannot stand, at poses (n,): `kinematics.travel.room`."""
    return margins.rooms(looked.machine.legs_unnamed, looked.machine.characteristic_length, looked.poses, looked.signs)


def _travel(looked: Looked) -> Scalar:
    return margins.margins(looked.machine.legs_unnamed, looked.poses, looked.signs)


def _clearance(looked: Looked) -> Scalar:
    return margins.clearances(looked.scene.plain, looked.machine, None, looked.poses, looked.signs)


def _singularity(looked: Looked) -> Scalar:
    length = looked.machine.characteristic_length
    return margins.controls(looked.machine.legs_unnamed, length, looked.poses, looked.signs)[0]


def _require_plain(machine: Machine) -> None:
    if scene_of(machine, with_workpiece=False).meshed.pairs:
        raise InputError(f"{machine.name}: clearance: shapes from mesh files cannot vary; give plain shapes")


def _no_pairs(machine: Machine) -> str | None:
    scene = scene_of(machine, with_workpiece=False)
    return None if scene.meshed.pairs or scene.plain.pairs else "no two of its bodies could touch"
