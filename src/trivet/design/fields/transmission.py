"""How well the drives' power reaches the platform: the local transmission index."""

from __future__ import annotations

import jax

from trivet.design.fields import Field
from trivet.design.looked import Looked
from trivet.kinematics.transmission import lacks, transmission
from trivet.model.quantity import Quantity
from trivet.space.scalar import Scalar

TRANSMISSION = "transmission"
NAMES = (TRANSMISSION,)

_INDEX = Quantity("index", "", "")


def read(name: str) -> Field | None:
    """The field of a name: the least of all input and output indices, `kinematics.transmission`."""
    return Field(TRANSMISSION, _INDEX, _local, lacks=lacks) if name == TRANSMISSION else None


def _local(looked: Looked) -> Scalar:
    return jax.vmap(lambda pose: transmission(looked.machine, pose, looked.signs).local)(looked.poses)
