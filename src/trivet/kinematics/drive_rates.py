"""How fast the drives of a chain go for a motion of the platform: the drive side (Type 1) of its singularities.

The rows of J_q^-1 J_x of one chain are the rates of its drives.  Turns, of the platform and of drives, count at a length, as in
`jacobian.homogenised_inverse`: rates then have no unit, or are mm/s per mm/s.
"""

from __future__ import annotations

import jax.numpy as jnp

from trivet.kinematics.jacobian import arm_of, chain_rows
from trivet.kinematics.walk import Posture
from trivet.model import Leg
from trivet.space.elimination import solve
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar

MOST_RATE = 5.0
"""Of a drive, that a search allows: it then moves the platform with a fifth of its own speed, at least."""


def ease(leg: Leg, posture: Posture, pose: Frame, scale: Scalar) -> Scalar:
    """One over the greatest rate of a drive of a chain, over all unit motions of the platform; zero at a Type 1 singularity.

    Infinite for a chain whose drives are not as many as its wrenches, which then have no rates of their own.

    Args:
        leg: the chain.
        posture: how it stands.
        pose: platform frame in {O}.
        scale: the length (m) at which turns count.
    """
    chain = chain_rows(leg, posture, scale)
    if not chain.driven or len(chain.driven) != len(chain.wrenches):
        return jnp.inf
    moved = [wrench.carried(posture.heading, arm_of(leg, pose)) for wrench in chain.wrenches]
    powers = [[wrench @ twist for _, twist in chain.driven] for wrench in chain.wrenches]
    rows = solve(powers, [[*w.force, *(m / scale for m in w.moment)] for w in moved])
    speeds = [scale if joint.is_angular else 1.0 for joint, _ in chain.driven]
    rates = [speed * jnp.sqrt(sum(jnp.square(c) for c in row)) for speed, row in zip(speeds, rows, strict=True)]
    greatest = jnp.max(jnp.stack(rates))
    return jnp.where(jnp.isfinite(greatest), 1 / greatest, 0.0)


def rate_margin(leg: Leg, posture: Posture, pose: Frame, scale: Scalar) -> Scalar:
    """How far a chain's drives are below `MOST_RATE`: 0 at that, 1 at half of it, -1 at a singularity."""
    return ease(leg, posture, pose, scale) * MOST_RATE - 1
