"""What every joint does at a pose, and why a pose is not reached."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeGuard

import jax
import jax.numpy as jnp
import numpy as np

from trivet.kinematics.standing import postures
from trivet.kinematics.travel import gauges
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Revolute, Socket
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar

OK, UNREACHABLE, OUTSIDE_TRAVEL = 0, 1, 2
"""Status of a pose: reached; some chain cannot close; some joint is outside its travel."""

STATUS_WORDS = ("reached", "unreachable", "outside travel")


class JointState(NamedTuple):
    """Joints of all chains, in the order of `joint_names`; arrays over joints in the last axis (m or rad)."""

    coordinate: Scalar
    gauge: Scalar
    """What the travel limits: the coordinate, the elevation of the next body, or how a socket's stem stands."""
    low: Scalar
    high: Scalar
    reach: Scalar
    """Per chain: below zero where it cannot close (m^2)."""


def joint_names(machine: Machine) -> list[str]:
    """Names of the joints which reports list, those of one freedom and those with a cone: "leg-1.slide"."""
    return [f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if _is_listed(e)]


def joint_elements(machine: Machine) -> list[Drivable | Socket]:
    """The joints in the order of `joint_names`."""
    return [e for leg in machine.legs for e in leg.chain.elements if _is_listed(e)]


def _is_listed(element: Element) -> TypeGuard[Drivable | Socket]:
    return isinstance(element, Drivable) or (isinstance(element, Socket) and element.is_limited)


def joint_state(machine: Machine, pose: Frame, signs: Scalar) -> JointState:
    """Coordinates, travel and reach of all joints at one pose (NaN where a chain cannot close); signs as for `postures`."""
    columns: list[tuple[Scalar, ...]] = []
    reach = []
    for leg, posture in zip(machine.legs, postures(machine, pose, signs), strict=True):
        reach.append(posture.reach)
        limited = {gauge.joint.name: gauge for gauge in gauges(leg, posture, pose)}
        for element, coordinate in zip(leg.chain.elements, posture.coordinates, strict=True):
            if not _is_listed(element):
                continue
            gauge = limited.get(element.name)
            measured = None if gauge is None else gauge.plain(gauge.value)
            if isinstance(element, Socket):
                low = -element.cone if element.neutral.measure == "elevation" else -math.inf  # type: ignore[operator, union-attr]
                columns.append((measured, measured, low, element.cone))
                continue
            plain = element.number(coordinate)
            low, high = element.travel or (-math.inf, math.inf)
            columns.append((plain, plain if measured is None else measured, low, high))
    coordinate, measured, lows, highs = (_stack(column) for column in zip(*columns, strict=True))
    return JointState(coordinate, measured, lows, highs, _stack(reach))


def _stack(values: Sequence[Scalar]) -> Scalar:
    return jnp.stack([jnp.asarray(v, dtype=float) for v in values])


joint_states = jax.jit(jax.vmap(joint_state, in_axes=(None, 0, None)))
"""`joint_state` over a batch of poses: component arrays of shape (n,)."""


def joint_state_once(machine: Machine, pose: Frame, signs: Any) -> JointState:
    """`joint_state` at one pose of floats as a batch of one, NumPy arrays; signs may be None."""
    if signs is None:
        return JointState(*(np.asarray(a)[None] for a in joint_state(machine, pose, None)))
    batch = Frame(*(type(v)(*(np.asarray([c], dtype=float) for c in v)) for v in pose))
    return JointState(*(np.asarray(a) for a in joint_states(machine, batch, signs)))


class Shortfall(NamedTuple):
    """How a pose fails: status, chain and joint (None for a chain that cannot close), and a sentence."""

    status: int
    chain: str
    joint: str | None
    reason: str


def shortfall(machine: Machine, state: JointState, roll_index: int = 0) -> Shortfall | None:
    """Why one pose is not reached, by the joint which is furthest outside; None when it is reached.

    Args:
        machine: the machine.
        state: joint states of a batch of poses, as NumPy arrays (n, joints).
        roll_index: which pose of the batch.
    """
    legs = machine.legs
    reach = np.asarray(state.reach[roll_index])
    if not np.all(reach >= 0):
        worst = int(np.argmin(np.where(np.isnan(reach), -np.inf, reach)))
        missing = math.sqrt(-reach[worst]) * 1e3 if reach[worst] < 0 else math.nan
        where = legs[worst].name
        if reach[worst] > -1e-15 and isinstance(legs[worst].chain.elements[0], Curvilinear):
            return Shortfall(
                UNREACHABLE, where, None, f"{where} has no place: its platform joint lies on the axis of the guide"
            )
        reason = f"{where} cannot close: its links are too short or too long (off by {missing:.3g} mm)"
        return Shortfall(UNREACHABLE, where, None, reason)
    outside = travel_excess(state)[roll_index]
    worst = int(np.argmax(outside))
    if outside[worst] <= 0:
        return None
    name, element = joint_names(machine)[worst], joint_elements(machine)[worst]
    value, low, high = (float(a[roll_index, worst]) for a in (state.gauge, state.low, state.high))
    unit, scale = ("deg", math.degrees(1)) if element.is_angular else ("mm", 1e3)
    word = _measured(element)
    relation, limit = ("below", low) if value < low else ("above", high)
    reason = f"{name} {word}at {value * scale:.4g} {unit} is {relation} its limit of {limit * scale:.4g} {unit}"
    return Shortfall(OUTSIDE_TRAVEL, name.split(".")[0], element.name, reason)


def _measured(element: Drivable | Socket) -> str:
    """What the travel limits, if it is not the coordinate."""
    if isinstance(element, Socket):
        assert element.neutral is not None
        return f"{element.neutral.measure} "
    return "elevation " if isinstance(element, Revolute) and element.measure == "elevation" else ""


def travel_excess(state: JointState) -> Any:
    """How far each joint is outside its travel, as a fraction of the travel (n, joints); zero or less inside."""
    gauge, low, high = (np.asarray(a) for a in (state.gauge, state.low, state.high))
    limited = np.isfinite(high)
    span = np.where(limited, high - np.where(np.isfinite(low), low, 0.0), 1.0)
    return np.where(limited, np.maximum(low - gauge, gauge - np.where(limited, high, 0.0)) / span, -np.inf)


def travel_margins(state: JointState) -> Any:
    """How far each joint (n, joints) is inside its travel, m or rad: below zero outside, infinite without any."""
    gauge, low, high = (np.asarray(a) for a in (state.gauge, state.low, state.high))
    return np.minimum(gauge - low, high - gauge)
