"""One chain with some of its drives held at coordinates: kernels over many coordinates and poses at once.

A platform pose and where its spare drives are held decide how a chain stands, and nothing else of the machine does.  So all
lock sets of a machine are made of few parts: each chain held in each way, worked out once (`Held`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.drive_rates import MOST_RATE, ease, rate_margin
from trivet.kinematics.inverse import branches, inverse
from trivet.kinematics.travel import gauges, margin
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import AnyElement, Drivable
from trivet.model.elements.base import Stock
from trivet.space.batches import in_batches
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.space.scalar import Scalar, cosine, sine

Array = NDArray[Any]
Piece = Callable[[Leg, Posture, Frame, Scalar, Stock, Scalar], Any]
"""What is made of one chain at one pose: leg, posture, pose, signs, stock and a length (m)."""
FAINT = 1e-6
"""Part of a drive's speed, left to the platform, that is rounding."""
FEW = 64
"""Rows that are done in one call, filled up to so many."""


@dataclass(frozen=True)
class Held:
    """A chain with drives held, in a working mode; its leg is locked somewhere, to be moved by the kernels."""

    machine: Machine
    number: int
    """Of the chain."""
    leg: Leg
    joints: tuple[str, ...]
    """The held drives."""
    signs: tuple[float, float]
    low: Array
    """(s,) travel of the held drives, m or rad."""
    high: Array

    @property
    def drives(self) -> tuple[str, ...]:
        """With the name of the chain: "leg-1.guide"."""
        return tuple(f"{self.leg.name}.{joint}" for joint in self.joints)

    def rows(self, piece: Piece, values: Array, frames: Frame, rolls: Array) -> tuple[Any, Array]:
        """What a piece makes of coordinates (m, s) and poses (m,) turned by rolls (m,), and the least margin (m,).

        The margin is the lesser of `travel.margin`, for which all limited joints of the chain count, those held too, and of
        `drive_rates.rate_margin`.
        """
        kernel = partial(_rows, piece, *self._fixed)
        found: tuple[Any, Array] = over_rows(lambda case: kernel(*case), (tuple(values.T), frames, rolls))
        return found

    def pushed(self, piece: Piece, values: Array, frames: Frame, rolls: Array, along: Array, turn: Array) -> tuple[Any, Array]:
        """Slopes of `rows` along changes of the coordinates (m, s) and of the rolls (m,)."""
        kernel = partial(_pushed, piece, *self._fixed)
        cases = (tuple(values.T), frames, rolls, tuple(along.T), turn)
        found: tuple[Any, Array] = over_rows(lambda case: kernel(*case), cases)
        return found

    @property
    def _fixed(self) -> tuple[Leg, Array, Stock, float]:
        return self.leg.unnamed, np.array(self.signs), self.machine.stock, float(self.machine.characteristic_length)

    def coordinates(self, values: Array, frames: Frame, rolls: Array) -> dict[str, Array]:
        """Coordinates (m,) of all drives of the chain, m or rad, by "leg-1.guide"."""
        posture, _ = self.rows(standing_piece, values, frames, rolls)
        return {
            f"{self.leg.name}.{e.name}": np.asarray(e.number(c))
            for e, c in zip(self.leg.chain.elements, posture.coordinates, strict=True)
            if isinstance(e, Drivable) and e.actuated
        }

    def margins(self, values: Array, frames: Frame, rolls: Array) -> dict[str, Array]:
        """Margins of travel (m,) of all limited joints of the chain, as `travel.Gauge.margin`, by "leg-1.guide"."""
        found, _ = self.rows(margins_piece, values, frames, rolls)
        limited = (e.name for e, limits in zip(self.leg.chain.elements, self.leg.limits, strict=True) if limits is not None)
        return {f"{self.leg.name}.{name}": found[:, k] for k, name in enumerate(limited)}

    def rates(self, values: Array, frames: Frame, rolls: Array) -> Array:
        """Greatest rates (m,) of the drives of the chain, see `drive_rates`."""
        found, _ = self.rows(ease_piece, values, frames, rolls)
        with np.errstate(divide="ignore"):
            return np.asarray(1 / found)

    def miss(self, values: Sequence[float] | Array, frame: Frame) -> str:
        """Why a pose (of floats) is not reached with the drives held at coordinates; empty where it is."""
        leg = _moved(self.leg, tuple(float(v) for v in values))
        with np.errstate(all="ignore"):
            posture = inverse(leg, frame, self.signs)
        reach = float(posture.reach)
        if not reach >= 0:
            missing = math.sqrt(-reach) * 1e3 if reach < 0 else math.nan
            return f"{leg.name} cannot close (off by {missing:.3g} mm)"
        worst = min(gauges(leg, posture, frame), key=lambda gauge: float(gauge.margin), default=None)
        if worst is None or float(worst.margin) >= 0:
            return self._too_fast(posture, frame, leg)
        unit, scale = (
            ("mm", 1e3) if isinstance(worst.joint, Drivable) and not worst.joint.is_angular else ("deg", 180 / math.pi)
        )
        value, low, high = (float(worst.plain(c)) * scale for c in (worst.value, worst.low, worst.high))
        below = float(worst.value) < float(worst.low)
        limit = low if below != (worst.scale == "cosine") else high
        relation = "below" if value < limit else "above"
        return f"{leg.name}.{worst.joint.name} at {value:.4g} {unit} is {relation} its limit of {limit:.4g} {unit}"

    def _too_fast(self, posture: Posture, frame: Frame, leg: Leg) -> str:
        own = float(ease(leg, posture, frame, float(self.machine.characteristic_length)))
        if own * MOST_RATE >= 1:
            return ""
        rate = f"{1 / own:.4g} times as fast as the platform" if own > FAINT else "without moving the platform"
        return f"a drive of {leg.name} goes {rate}, near a Type 1 singularity; at most {MOST_RATE:g} times is allowed"


def over_rows(kernel: Callable[[Any], Any], cases: Any) -> Any:
    """`in_batches`, and without its threads where rows are few: a search asks for few rows, often."""
    columns = [np.asarray(c, dtype=float) for c in jax.tree.leaves(cases)]
    count = len(columns[0])
    if not 0 < count <= FEW:
        return in_batches(kernel, cases)
    filled = [np.concatenate([c, np.broadcast_to(c[-1], FEW - count)]) for c in columns]
    return jax.tree.map(lambda c: np.asarray(c)[:count], kernel(jax.tree.unflatten(jax.tree.structure(cases), filled)))


def ways(machine: Machine, number: int, joints: Sequence[str], only: Array | None = None) -> list[Held]:
    """A chain with drives held, in every working mode that it then has.

    Args:
        machine: the machine, its drives free.
        number: of the chain.
        joints: the drives to hold, each with a travel.
        only: (2,) signs of the one working mode that is wanted; all when not given.

    Raises:
        InputError: the chain so held has no inverse kinematics in closed form, or a drive has no travel.
    """
    leg = machine.legs[number]
    travels = []
    for e in leg.chain.elements:
        if e.name in joints:
            assert isinstance(e, Drivable)
            if e.travel is None:
                raise InputError(f"chains.{leg.name}.{e.name}: has no travel; where to lock it is sought within one")
            travels.append((float(e.travel[0]), float(e.travel[1])))
    middle = [(low + high) / 2 for low, high in travels]
    elements = tuple(replace(e, locked=0.0) if e.name in joints and isinstance(e, Drivable) else e for e in leg.chain.elements)
    held = _moved(_with_elements(leg, elements), tuple(middle))
    low, high = np.array(travels).reshape(-1, 2).T
    names = tuple(e.name for e in elements if e.name in joints)
    own = branches(held)
    chosen = []
    for signs in product((1.0, -1.0), repeat=len(own)):
        full = [1.0, 1.0]
        for branch, sign in zip(own, signs, strict=True):
            full[branch] = sign
        if only is None or all(full[b] == only[b] for b in own):
            chosen.append(Held(machine, number, held, names, (full[0], full[1]), low, high))
    return chosen


def _with_elements(leg: Leg, elements: tuple[AnyElement, ...]) -> Leg:
    return replace(leg, chain=replace(leg.chain, elements=elements), limits=tuple(e.limits for e in elements))


def _moved(leg: Leg, values: Sequence[Scalar]) -> Leg:
    """The leg with its locked drives at other coordinates, in order."""
    given = iter(values)
    elements = tuple(
        replace(e, locked=next(given)) if isinstance(e, Drivable) and e.actuated and e.locked is not None else e
        for e in leg.chain.elements
    )
    return replace(leg, chain=replace(leg.chain, elements=elements))


def standing_piece(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Posture:
    """A `Piece`: how the chain stands, numbers throughout."""
    found: Posture = jax.tree.map(lambda c: jnp.asarray(c, dtype=float), posture)
    return found


def margins_piece(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Scalar:
    """A `Piece`: margins of travel of all limited joints."""
    return jnp.stack([jnp.asarray(gauge.margin, dtype=float) for gauge in gauges(leg, posture, pose)] or [jnp.ones(())])


def ease_piece(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Scalar:
    """A `Piece`: one over the greatest rate of a drive."""
    return jnp.asarray(ease(leg, posture, pose, scale), dtype=float)


def _one(piece: Piece, leg: Leg, signs: Array, stock: Stock, scale: Scalar, case: Any) -> tuple[Any, Scalar]:
    values, frame, roll = case
    own, pose = _moved(leg, values), rolled(frame, Angle(cosine(roll), sine(roll)))
    posture = inverse(own, pose, signs)
    inside = jnp.minimum(margin(own, posture, pose), rate_margin(own, posture, pose, scale))
    return piece(own, posture, pose, signs, stock, scale), jnp.asarray(inside, dtype=float)


@partial(jax.jit, static_argnums=0)
def _rows(piece: Piece, leg: Leg, signs: Array, stock: Stock, scale: Scalar, *case: Any) -> Any:
    return jax.vmap(lambda case: _one(piece, leg, signs, stock, scale, case))(case)


@partial(jax.jit, static_argnums=0)
def _pushed(
    piece: Piece, leg: Leg, signs: Array, stock: Stock, scale: Scalar, values: Any, frame: Frame, roll: Array, *change: Any
) -> Any:
    def one(case: Any, along: Any, turn: Any) -> Any:
        still = jax.tree.map(jnp.zeros_like, case[1])
        return jax.jvp(lambda c: _one(piece, leg, signs, stock, scale, c), (case,), ((along, still, turn),))[1]

    return jax.vmap(one)((values, frame, roll), *change)
