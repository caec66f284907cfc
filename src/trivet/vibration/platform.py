"""The rigid platform's inertia at its centre."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from trivet.model import Machine
from trivet.model.mass import platform_mass
from trivet.space.frame import Frame


def platform_inertia(machine: Machine, poses: Frame) -> jax.Array:
    """(p, 6, 6): [force; moment about the centre] = inertia [acceleration; angular acceleration], in {O}, at poses (p,)."""
    mass, moment, inertia = platform_mass(machine.platform, machine.stock)
    x, y, z = (jnp.asarray(c, dtype=float) for c in moment)
    arm = jnp.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # times a vector: moment x vector
    moments = jnp.array([[jnp.asarray(entry, dtype=float) for entry in row] for row in inertia.matrix()])
    own = jnp.block([[mass * jnp.eye(3), -arm], [arm, moments]])
    axes = jnp.stack([jnp.stack([jnp.asarray(c) for c in v], axis=-1) for v in poses[1:]], axis=-1)
    turn = jnp.kron(jnp.eye(2), axes)
    turned: jax.Array = turn @ own @ jnp.swapaxes(turn, -1, -2)
    return turned
