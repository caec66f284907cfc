"""Singularities over a surface of check points under a policy for the roll: fields, and the Type 2 singularities as curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError, nearest
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs, mode_text, mode_words
from trivet.kinematics.singularity import Condition, conditions
from trivet.kinematics.transmission import Transmission, transmissions
from trivet.kinematics.travel import within
from trivet.model import Machine
from trivet.space.batches import in_batches
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.scalar import Scalar
from trivet.space.surface import Surface
from trivet.statics.best_roll import ROLLS
from trivet.study.machines import MachineLike, choose
from trivet.study.roll_policy import RollPolicy, roll_policy
from trivet.study.stiffness_map import surface_of
from trivet.study.zero_set import zero_set

Array = NDArray[Any]

QUANTITIES = ("sigma_min", "det J_x", "1/det J_G^-1", "1/det J^-1", "ITI", "OTI", "LTI")
"""What can be shown.  Of the transmission indices the least over the actuators.  1/det J^-1 is that of the paper's Fig 4, whose
angles make it infinite at zero tilt as well; J_G^-1 has no such fault."""


@dataclass(frozen=True)
class Curve:
    """A curve of Type 2 singularities; its points lie on the surface, in order."""

    surface: Surface
    roll: Array
    """(k,) rad."""
    is_closed: bool
    """The first point is then repeated at the end."""

    @property
    def length(self) -> float:
        """Of the polygon through its points, m."""
        return float(np.linalg.norm(np.diff(self.surface.position, axis=0), axis=1).sum())


@dataclass(frozen=True)
class SingularityMap:
    """Singularities of a machine over a surface; arrays over the n check points, NaN where the pose is not reached."""

    machine: Machine
    mode: str
    surface: Surface
    quantity: str
    """What a picture of it shows, one of QUANTITIES."""
    policy: str
    """How the roll was chosen: "best K_xx", "-alpha", "30 deg"."""
    roll: Array
    """(n,) rad."""
    condition: Condition
    transmission: Transmission
    curves: tuple[Curve, ...]
    """Where det J_x is zero between check points that are reached."""
    jumps: int
    """Edges along which det J_x changes its sign by a jump of the roll or of a carriage, not through zero."""

    @property
    def used(self) -> Array:
        """(n,) points at which the pose is reached with all joints inside their travel."""
        return np.isfinite(self.roll)

    @cached_property
    def fields(self) -> dict[str, Array]:
        """Every one of QUANTITIES, (n,) in SI; for units see `unit`."""
        det, moved = self.condition.determinants, self.transmission
        with np.errstate(divide="ignore", invalid="ignore"):
            ours = 1 / det.inverse, 1 / det.inverse_analytical
        least = (np.min(a, axis=1) for a in moved)
        found = dict(zip(QUANTITIES, (self.condition.sigma_min, det.j_x, *ours, *least, moved.local), strict=True))
        return {name: np.where(self.used, values, np.nan) for name, values in found.items()}

    @property
    def values(self) -> Array:
        """(n,) the field of `quantity`."""
        return self.fields[self.quantity]

    @property
    def poses(self) -> Frame:
        """Platform frames (zero roll where the pose is not reached)."""
        return _poses(self.surface, self.roll)

    def unit(self, quantity: str | None = None) -> str:
        """SI unit of a field, "" when it has none."""
        chosen = quantity or self.quantity
        if chosen == "det J_x":
            return "m^3"
        power = sum(joint.is_angular for _, joint in actuators(self.machine)) - 3
        return f"m^{power}" if chosen.startswith("1/det") and power else ""


def singularity_map(
    machine: MachineLike,
    surface: Surface | None = None,
    *,
    quantity: str = "sigma_min",
    roll: str | float = "best K_xx",
    mode: str | None = None,
    rolls: int = ROLLS,
    progress: Callable[[int], None] = lambda points: None,
) -> SingularityMap:
    """Singularities over a surface (paper Fig 4).

    Args:
        machine: machine, name or file; six actuators and six constraints.
        surface: check points, each seen from one side: no two of them on a line along their mean normal; the machine's own
            workpiece with the paper's 317 points when not given.
        quantity: what a picture of the map shows, one of QUANTITIES.
        roll: policy for the roll, see `roll_policy`.
        mode: working mode; the machine's own when not given.
        rolls: rolls of the first grid of a best roll.
        progress: called with the number of points done of a best roll.

    Raises:
        InputError: for an unknown quantity or policy, a machine that is redundant or has a chain without closed form.
        NoResultError: when no point of the surface is reached.
    """
    if quantity not in QUANTITIES:
        raise InputError(f"quantity '{quantity}' is not known{nearest(quantity, QUANTITIES)}")
    machine = choose(machine)
    surface = surface if surface is not None else surface_of(machine)
    policy, signs = roll_policy(roll, rolls, progress), closed_form_signs(machine, mode)
    gamma = policy.choose(machine, surface, signs)
    poses = _poses(surface, gamma)
    found = conditions(machine, poses, signs)
    used = np.isfinite(gamma) & in_batches(lambda frames: _within(machine, frames, signs), poses)
    if not used.any():
        raise NoResultError(
            f"{machine.name}: no point of the {surface.name} is reached, {mode_words(mode_text(machine, signs))}, "
            f"with the roll {policy.name}"
        )
    det = np.where(used, found.determinants.j_x, np.nan)
    zeros = zero_set(surface, det, lambda points: _determinant(machine, points, policy, signs))
    curves = tuple(Curve(points, policy.choose(machine, points, signs), closed) for points, closed in zeros.curves)
    return SingularityMap(
        machine,
        mode_text(machine, signs),
        surface,
        quantity,
        policy.name,
        np.where(used, gamma, np.nan),
        found,
        transmissions(machine, poses, signs),
        curves,
        zeros.jumps,
    )


@jax.jit
def _within(machine: Machine, poses: Frame, signs: Scalar) -> Scalar:
    def one(pose: Frame) -> Scalar:
        return jnp.all(jnp.stack([within(leg, inverse(leg, pose, signs[k]), pose) for k, leg in enumerate(machine.legs)]))

    return jax.vmap(one)(poses)


def _poses(surface: Surface, roll: Array) -> Frame:
    return zyz_frame(surface.position, surface.azimuth, surface.tilt, np.where(np.isfinite(roll), roll, 0.0))


def _determinant(machine: Machine, surface: Surface, policy: RollPolicy, signs: Any) -> Array:
    rolls = policy.choose(machine, surface, signs)
    return np.where(np.isfinite(rolls), conditions(machine, _poses(surface, rolls), signs).determinants.j_x, np.nan)
