"""Chains that are made alike as one: JAX then compiles one of them, over chains and poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from trivet.kinematics.inverse import inverse
from trivet.kinematics.walk import Posture
from trivet.model import Leg
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar


class Alike(NamedTuple):
    """Chains that are made alike."""

    places: tuple[int, ...]
    """Which of the machine's chains they are."""
    leg: Leg
    """All of them, numbers with shape (chains, 1): poses go along the last axis."""

    def stand(self, pose: Frame, signs: Scalar) -> Posture:
        """How they stand at poses (n,) in a working mode, (n_chains, 2): components (chains, n)."""
        side, elbow = jnp.asarray(signs)[jnp.array(self.places)].T[..., None]
        return inverse(self.leg, pose, (side, elbow))


def alike(legs: Sequence[Leg]) -> list[Alike]:
    """Legs without names (`Leg.unnamed`) in groups of those made alike."""
    found: dict[Any, list[int]] = {}
    for place, leg in enumerate(legs):
        found.setdefault(jax.tree.structure(leg), []).append(place)
    return [Alike(tuple(places), stacked([legs[k] for k in places])) for places in found.values()]


def stacked(parts: Sequence[Any]) -> Any:
    """Trees of one structure as one, numbers with shape (parts, 1)."""
    return jax.tree.map(lambda *values: jnp.stack([jnp.asarray(v, dtype=float) for v in values])[:, None], *parts)
