"""Forward kinematics of any machine from a starting pose: Newton's method on the drives, and the residual that certifies it."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import NoResultError
from trivet.kinematics.jacobian import actuator_names, actuators, inverse_jacobian, is_driven
from trivet.kinematics.locked import by_leg
from trivet.kinematics.standing import postures
from trivet.kinematics.walk import walk_from
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.space.pose import moved
from trivet.space.scalar import Scalar

MOST_STEPS = 60
CLOSED = 1e-11
"""Greatest gap of a chain, relative to the machine's size, at a pose that counts as found; rounding leaves about 1e-16."""
LONGEST = 0.5
"""Greatest step: of the platform in units of its radius, and of its rotation in rad."""


class Approach(NamedTuple):
    """The pose to which a starting pose leads."""

    frame: Frame
    """{E} in {O}, m."""
    residual: float
    """Greatest deviation of the drives at the pose from their given coordinates, m or rad."""
    gap: float
    """Greatest distance, m, by which a chain with its drives at the given coordinates misses its platform joint."""
    error: float
    """Length of the Newton step that is left, m; rotation times the platform radius: the error, near a root."""


def _drives(machine: Machine, pose: Frame, signs: Any) -> Scalar:
    """Coordinates of the drives in the order of Q."""
    found: dict[str, Scalar] = {}
    for leg, posture in zip(machine.legs, postures(machine, pose, signs), strict=True):
        for element, coordinate in zip(leg.chain.elements, posture.coordinates, strict=True):
            if is_driven(element):
                found[f"{leg.name}.{element.name}"] = element.number(coordinate)
    return jnp.stack([jnp.asarray(found[name], dtype=float) for name in actuator_names(machine)])


drives_at = jax.jit(jax.vmap(_drives, in_axes=(None, 0, None)))
"""Drive coordinates (n, n_actuators) in the order of Q at poses with component arrays (n,), in one working mode; NaN where a
chain does not reach."""


def _drives_and_slope(machine: Machine, pose: Frame, signs: Any) -> tuple[Scalar, Scalar]:
    return _drives(machine, pose, signs), inverse_jacobian(machine, pose, signs)


_compiled = jax.jit(_drives_and_slope)


def drive_coordinates(machine: Machine, pose: Frame, signs: Any) -> dict[str, float]:
    """Coordinates of the drives (m or rad, angles in (-pi, pi]) at a pose, by name in the order of Q.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, of floats (m).
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Raises:
        NoResultError: a chain does not reach the pose.
    """
    values = np.asarray(_drives(machine, pose, signs))
    if not np.all(np.isfinite(values)):
        raise NoResultError(f"{machine.name}: a chain does not reach this pose, so its drives have no coordinates")
    return dict(zip(actuator_names(machine), values.tolist(), strict=True))


def approach(machine: Machine, values: NDArray[Any], start: Frame, signs: Any) -> Approach:
    """The pose at drive coordinates to which Newton's method leads from a starting pose.

    Args:
        machine: any machine with six drives.
        values: (6,) drive coordinates in the order of Q, m and rad.
        start: platform frame {E} in {O} from which to search, of floats (m).
        signs: (n_chains, 2) working mode in which the pose is sought, or None as for `standing.postures`.

    Raises:
        NoResultError: when the search ends without a pose: at a singularity, or out of reach.
        InputError: when the machine has not as many drives as the platform has freedoms.
    """
    angular = np.array([joint.is_angular for _, joint in actuators(machine)])
    radius = float(machine.characteristic_length) or 1.0
    run = _drives_and_slope if signs is None else _compiled
    arrays = machine if signs is None else jax.tree.map(jnp.asarray, machine)

    def off(pose: Frame) -> tuple[NDArray[Any], NDArray[Any]]:
        found, slope = (np.asarray(a) for a in run(arrays, pose, signs))
        apart = values - found
        return np.where(angular, np.remainder(apart + math.pi, 2 * math.pi) - math.pi, apart), slope

    weight = np.where(angular, radius, 1.0)
    pose, (gap, slope) = start, off(start)
    step: NDArray[Any] | None = None
    for _ in range(MOST_STEPS):
        step = _newton_step(slope, gap)
        if step is None:
            break
        nearer, ahead = _shortened(off, pose, step, gap * weight, radius)
        if nearer is None:
            break
        pose, (gap, slope) = nearer, ahead
        if np.linalg.norm(gap * weight) < 1e-16 * radius:
            break
    size = float(np.max(np.abs(values[~angular]), initial=radius))
    missed = chain_gap(machine, pose, values, signs)
    if not missed < CLOSED * size:
        raise NoResultError(
            f"{machine.name}: no pose found from the starting pose; the nearest misses a joint by {missed * 1e3:.3g} mm"
        )
    last = _newton_step(slope, gap)
    error = 0.0 if last is None else float(max(np.linalg.norm(last[:3]), radius * np.linalg.norm(last[3:])))
    return Approach(pose, float(np.abs(gap).max()), missed, error)


def _newton_step(slope: NDArray[Any], gap: NDArray[Any]) -> NDArray[Any] | None:
    """The platform twist that takes the drives where they should be; None at a singularity or out of reach."""
    if not np.all(np.isfinite(slope)):
        return None
    try:
        step: NDArray[Any] = np.linalg.solve(slope, gap)
    except np.linalg.LinAlgError:
        return None
    return step


def _shortened(off: Any, pose: Frame, step: NDArray[Any], gap: NDArray[Any], radius: float) -> tuple[Any, Any]:
    """The step, not too long and halved until the drives come nearer; None when it never brings them nearer."""
    longest = max(float(np.linalg.norm(step[:3])) / radius, float(np.linalg.norm(step[3:])))
    factor = min(1.0, LONGEST / longest) if longest > 0 else 1.0
    while factor > 1e-6:
        nearer = moved(pose, factor * step)
        ahead = off(nearer)
        if np.all(np.isfinite(ahead[0])) and np.linalg.norm(ahead[0]) < np.linalg.norm(gap):
            return nearer, ahead
        factor /= 2
    return None, None


def chain_gap(machine: Machine, pose: Frame, values: NDArray[Any], signs: Any) -> float:
    """Greatest distance (m) between the end of a chain, walked with its drives at given coordinates, and its platform joint."""
    worst = 0.0
    for leg, posture, own in zip(machine.legs, postures(machine, pose, signs), by_leg(machine, values), strict=True):
        coordinates = []
        for element, coordinate in zip(leg.chain.elements, posture.coordinates, strict=True):
            if is_driven(element) and element.name in own:
                coordinate = element.coordinate(own[element.name])
            coordinates.append(coordinate)
        end = walk_from(leg.base_frame(), leg.chain.elements, tuple(coordinates))[-1][1].origin
        wanted = pose.shift(leg.platform_frame().origin).origin
        worst = max(worst, float(np.linalg.norm(np.subtract(end, wanted, dtype=float))))
    return worst if math.isfinite(worst) else math.inf
