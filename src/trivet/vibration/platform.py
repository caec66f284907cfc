"""The rigid platform's inertia at its centre."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp

from trivet.model import Machine
from trivet.space.frame import Frame


def platform_inertia(machine: Machine, poses: Frame) -> jax.Array:
    """(p, 6, 6): [force; moment about the centre] = inertia [acceleration; angular acceleration], in {O}, at poses (p,).

    The JAX counterpart of `kinematics.inertia.platform_mass`, differentiable in the platform's dimensions.
    """
    platform = machine.platform
    mass, moments = 0.0 if platform.mass is None else platform.mass, jnp.diag(jnp.asarray(platform.inertia or (0.0, 0.0, 0.0)))
    if platform.products_of_inertia is not None:
        xy, xz, yz = platform.products_of_inertia
        moments = moments + jnp.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
    if platform.disc is not None:
        disc = platform.disc
        mass = math.pi * disc.radius**2 * disc.thickness * machine.materials[disc.material].density
        across = mass * (3 * disc.radius**2 + disc.thickness**2) / 12
        moments = jnp.diag(jnp.stack([jnp.asarray(m, dtype=float) for m in (across, across, mass * disc.radius**2 / 2)]))
    x, y, z = (jnp.asarray(c, dtype=float) for c in platform.centre_of_mass or (0.0, 0.0, 0.0))
    arm = jnp.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # times a vector: arm x vector
    own = jnp.block([[mass * jnp.eye(3), -mass * arm], [mass * arm, moments - mass * arm @ arm]])
    axes = jnp.stack([jnp.stack([jnp.asarray(c) for c in v], axis=-1) for v in poses[1:]], axis=-1)
    turn = jnp.kron(jnp.eye(2), axes)
    turned: jax.Array = turn @ own @ jnp.swapaxes(turn, -1, -2)
    return turned
