"""What is left of the margins that a way must keep, over poses; and its exact slopes by every dimension of the machine."""

from __future__ import annotations

from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.alike import alike
from trivet.kinematics.travel import margin
from trivet.model import Machine
from trivet.reach.margins import clearance, control, forces, travel_margin
from trivet.reach.scene import distances, placed
from trivet.reach.touch import Touch
from trivet.space.scalar import Scalar
from trivet.study.roll_grid import RESERVE_GAP, RESERVE_TRAVEL, Rules, frames_of

Array = NDArray[Any]
Margin = Literal["travel", "clearance", "sigma_min"]

LEAST_SIGMA = 0.05
"""sigma_min below which no way is worth a change of the machine, where none is demanded."""


def demanded(rules: Rules) -> tuple[Margin, ...]:
    """The margins that rules ask for, as far as dimensions can mend them: of a mesh no slope is known."""
    asked: dict[Margin, bool] = {
        "travel": rules.limits,
        "clearance": rules.scene is not None and bool(rules.scene.plain.pairs),
        "sigma_min": rules.least_sigma > 0,
    }
    return tuple(name for name, is_asked in asked.items() if is_asked)


def without(rules: Rules, margins: tuple[Margin, ...]) -> Rules:
    """Rules that leave some margins aside; pairs of bodies with a mesh in them must stay apart as before."""
    if "travel" in margins:
        rules = rules._replace(limits=False)
    if "clearance" in margins and rules.scene is not None:
        rules = rules._replace(scene=rules.scene.meshed if rules.scene.meshed.pairs else None)
    return rules._replace(least_sigma=0.0 if "sigma_min" in margins else rules.least_sigma or LEAST_SIGMA)


def spare(rules: Rules, touch: Touch, name: Margin) -> Array:
    """What is left of a margin at poses (n,) beyond what is demanded; below zero where it is not kept.

    In parts of half a joint's travel, in sizes of the machine (the mean radius of the platform's joints), or of sigma_min.
    """
    machine, poses = rules.machine, frames_of(touch, rules.radius)
    if name == "travel":
        found = travel_margin(machine, poses, rules.signs) - RESERVE_TRAVEL
    elif name == "clearance":
        assert rules.scene is not None
        gap = clearance(machine, rules.scene.plain, poses, rules.signs, rules.workpiece)
        found = (gap - rules.gap - RESERVE_GAP) / float(machine.characteristic_length)
    else:
        found = control(machine, poses, rules.signs).sigma_min - rules.least_sigma
    return np.where(np.isnan(found), -np.inf, found)


def slopes(rules: Rules, touch: Touch, name: Margin) -> tuple[Machine, float]:
    """Slopes of `spare` at one pose (1,): by every dimension, and by a rise of the sphere, workpiece and all (1/m).

    The size of the machine, by which distances are divided, is left as it is.
    """
    machine = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), rules.machine)
    by_machine, by_rise = jax.jit(jax.grad(lambda *moved: _least(rules, touch, name, *moved), argnums=(0, 1)))(machine, 0.0)
    return by_machine, float(by_rise)


def _least(rules: Rules, touch: Touch, name: Margin, machine: Machine, rise: Scalar) -> Scalar:
    """What moves with `spare` at one pose (1,): the margin itself, traced."""
    poses, legs, ball = touch._replace(z=touch.z + rise).frame(rules.radius), machine.legs_unnamed, rules.workpiece
    groups = alike(legs)
    stands = [group.stand(poses, rules.signs) for group in groups]
    if name == "travel":
        return jnp.min(jnp.stack([jnp.min(margin(g.leg, own, poses)) for g, own in zip(groups, stands, strict=True)]))
    if name == "clearance":
        assert rules.scene is not None
        risen = ball and ball._replace(centre=ball.centre._replace(z=ball.centre.z + rise))
        shapes = placed(rules.scene.plain, machine, groups, stands, poses, risen)
        gaps = [jnp.min(found) for _, found in distances(rules.scene.plain, shapes)]
        return jnp.min(jnp.stack(gaps)) / float(rules.machine.characteristic_length)
    length = machine.characteristic_length
    rows = jnp.array([[c[0] for c in row] for row in forces(legs, length, poses, rules.signs)])
    return jnp.linalg.svd(rows / jnp.array([1.0] * 3 + [length] * 3), compute_uv=False)[-1]
