"""How much room a machine takes: how far from the axis and how high its joints and bodies begin."""

from __future__ import annotations

import jax.numpy as jnp

from trivet.design.fields import Field
from trivet.design.looked import Looked
from trivet.kinematics.alike import alike
from trivet.kinematics.walk import walk_from
from trivet.model.quantity import Quantity
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

RADIUS, HEIGHT = "outer radius", "top height"
NAMES = (RADIUS, HEIGHT)

_LENGTH = Quantity("length", "m", "mm")


def read(name: str) -> Field | None:
    """The field of a name: the greatest distance of a place from the z axis of {O}, or the greatest z.

    Places are the platform centre, and where the elements of the chains start; what stands out of the lines between
    them, such as the thickness of bodies, does not count.
    """
    fields = {RADIUS: Field(RADIUS, _LENGTH, _radius), HEIGHT: Field(HEIGHT, _LENGTH, _height)}
    return fields.get(name)


def _places(looked: Looked) -> list[Vec]:
    """Components (chains, n)."""
    found = [Vec(*(jnp.asarray(c)[None] for c in looked.poses.origin))]
    for group in alike(looked.machine.legs_unnamed):
        posture = group.stand(looked.poses, looked.signs)
        steps = walk_from(group.leg.base_frame(), group.leg.chain.elements, posture.coordinates)
        found += [frame.origin for _, frame, _ in steps]
    return found


def _radius(looked: Looked) -> Scalar:
    return jnp.max(jnp.concatenate([_spread(looked, jnp.hypot(p.x, p.y)) for p in _places(looked)]), axis=0)


def _height(looked: Looked) -> Scalar:
    return jnp.max(jnp.concatenate([_spread(looked, p.z) for p in _places(looked)]), axis=0)


def _spread(looked: Looked, value: Scalar) -> Scalar:
    """(chains, n), also of what is the same at all poses."""
    value = jnp.atleast_2d(value)
    return jnp.broadcast_to(value, (value.shape[0], looked.poses.origin.x.shape[0]))
