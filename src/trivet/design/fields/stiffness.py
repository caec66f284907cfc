"""Scalars of the stiffness: "K_xx", "1/C_zz", "K(1,0,1)"."""

from __future__ import annotations

from trivet.design.fields import Field
from trivet.errors import InputError
from trivet.model.quantity import Quantity
from trivet.statics.objective import NAMES as OBJECTIVES
from trivet.statics.objective import objective

NAMES = OBJECTIVES

LINEAR, ROTATIONAL = Quantity("stiffness", "N/m", "N/um"), Quantity("rotational stiffness", "N m/rad", "N m/rad")


def read(name: str) -> Field | None:
    """The field of a name."""
    if not name.startswith(("K", "1/C")):
        return None
    try:
        scalar = objective(name)
    except InputError:
        if "(" in name:
            raise
        return None
    return Field(name, ROTATIONAL if scalar.is_rotational else LINEAR, lambda looked: scalar(looked.stiffness))
