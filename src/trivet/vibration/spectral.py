"""Exact dynamic stiffness of a machine: poses times frequencies, no mesh, every result differentiable in every dimension."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp

from trivet.kinematics.inverse import inverse
from trivet.model import Leg
from trivet.model.elements import Stock
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.vibration.spectral_chain import Excitation, leg_dynamics


@partial(jax.jit, static_argnames="terms")
def leg_stiffness(stock: Stock, leg: Leg, pose: Frame, signs: Scalar, omega: Scalar, loss: Scalar, terms: int):
    posture = inverse(leg, pose, signs)
    arm = pose.direction(leg.platform_frame().origin)
    part = leg_dynamics(leg, posture, stock, Excitation(omega, loss), terms)
    wrenches = [w.carried(posture.heading, arm) for w in part.wrenches]
    rows = jnp.stack([jnp.stack([jnp.asarray(c,dtype=float) for c in (*w.force, *w.moment)]) for w in wrenches], axis=-1)
    return rows @ part.stiffness @ rows.T, part.denominator
