"""What drives are locked for: stiffness, least dynamic stiffness, distance from singularities of both kinds, travel.

A measure is made of a piece per chain (`kinematics.held`), so that chains are worked out once for all lock sets, and of what
the pieces are together.  Slopes come the same way: the pieces' slopes, pushed through what they are together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, nearest
from trivet.kinematics.held import Piece, ease_piece, over_rows, standing_piece
from trivet.kinematics.jacobian import arm_of, chain_rows
from trivet.kinematics.travel import margin
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements.base import Stock
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.singular import least_singular_values
from trivet.space.symmetric import Symmetric
from trivet.statics.compliance import leg_stiffness
from trivet.statics.objective import NAMES, Objective, objective
from trivet.study.frf import check_range, directions
from trivet.vibration import spectral
from trivet.vibration.damping import check_loss_factor, least_damping
from trivet.vibration.directional import CHUNK, ROWS, Asked, Entries, greatest, own_frequency
from trivet.vibration.resonance import check_damping
from trivet.vibration.spectral_machine import Stand

Array = NDArray[Any]
Pieces = Sequence[Any]
"""One tree per chain, its arrays (m, ...)."""

SIGMA, TRAVEL, EASE, DYNAMIC = "sigma_min", "travel", "1/rate", "D_"


class Goal(NamedTuple):
    """What is to be great at every pose."""

    objective: str = "1/C_xx"
    """Of the stiffness ("K_xx", "1/C_zz", ...); "D_xx" (any entry of the receptance) for the least dynamic stiffness over
    frequency; "sigma_min" for the least singular value of J_x; "travel" for the least margin of travel; "1/rate" for one over
    the greatest rate of a drive (`kinematics.drive_rates`)."""
    low: float = 5.0
    """Hz, of a dynamic stiffness."""
    high: float = 3000.0
    loss_factor: float = 0.02
    """Of a dynamic stiffness: of all that has none of its own."""

    @property
    def is_dynamic(self) -> bool:
        """Whether it is of vibrations."""
        return self.objective.startswith(DYNAMIC)


class Measure(Protocol):
    """A goal over many poses."""

    @property
    def name(self) -> str: ...

    @property
    def unit(self) -> str:
        """SI; "" when it has none."""
        ...

    @property
    def piece(self) -> Piece: ...

    @property
    def rows(self) -> int:
        """How many poses a search may look at in its first round."""
        ...

    @property
    def is_costly(self) -> bool:
        """Whether a pose costs so much that a search takes few steps, and no look around ends it."""
        ...

    @property
    def precision(self) -> float:
        """Change of the measure, in parts of it, at which a search by slopes ends."""
        ...

    def values(self, pieces: Pieces, poses: Frame) -> Array:
        """(m, k) numbers of which the least counts; NaN where a chain does not close."""
        ...

    def slopes(self, pieces: Pieces, poses: Frame, pushed: Sequence[Pieces]) -> Array:
        """(m, k, v) along the changes of pieces that v variables make."""
        ...


def measure(machine: Machine, goal: Goal) -> Measure:
    """A goal of a machine, whose drives are free.

    Raises:
        InputError: for an unknown objective, a loss factor that none can be, or a dynamic stiffness over no range of
            frequencies or without damping.
    """
    name = goal.objective
    if name == SIGMA:
        return Singular()
    if name == TRAVEL:
        return Travel()
    if name == EASE:
        return Ease()
    if goal.is_dynamic:
        entry = Entries.named([directions(name.removeprefix(DYNAMIC))])
        check_loss_factor(goal.loss_factor)
        check_range(goal.low, goal.high)
        check_damping(least_damping(machine, goal.loss_factor))
        return Dynamic(name, machine, entry, goal.low, goal.high, goal.loss_factor)
    try:
        return Stiffness(objective(name))
    except InputError:
        known = nearest(name, (*NAMES, "D_xx", "D_yy", "D_zz", SIGMA, TRAVEL, EASE))
        raise InputError(f"objective '{name}' is not known{known}") from None


def upper_piece(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Scalar:
    """A `Piece`: the upper triangle of the chain's stiffness, 21 numbers."""
    return jnp.stack([jnp.asarray(c, dtype=float) for c in leg_stiffness(stock, leg, pose, signs).upper])


@dataclass(frozen=True)
class Stiffness:
    """A scalar of the stiffness, that of all drives in it."""

    scalar: Objective
    piece = staticmethod(upper_piece)
    rows = 200_000
    is_costly = False
    precision = 1e-10

    @property
    def name(self) -> str:
        return self.scalar.name

    @property
    def unit(self) -> str:
        return "N m/rad" if self.scalar.is_rotational else "N/m"

    def values(self, pieces: Pieces, poses: Frame) -> Array:
        found: Array = over_rows(partial(_stiffness, self.scalar), _total(pieces))
        return found[:, None]

    def slopes(self, pieces: Pieces, poses: Frame, pushed: Sequence[Pieces]) -> Array:
        kernel = partial(_stiffness_slope, self.scalar)
        made = [over_rows(kernel, (_total(pieces), _total(one))) for one in pushed]
        return np.stack(made, axis=-1)[:, None]


def _total(pieces: Pieces) -> tuple[Array, ...]:
    """The upper triangle of all chains together, 21 arrays (m,)."""
    return tuple(np.sum(pieces, axis=0).T)


def _scalar(scalar: Objective, upper: tuple[Array, ...]) -> Any:
    """(m,) of an upper triangle of arrays (m,)."""
    return jnp.broadcast_to(scalar(Symmetric.of(6, upper)), jnp.shape(upper[0]))


@partial(jax.jit, static_argnums=0)
def _stiffness(scalar: Objective, upper: tuple[Array, ...]) -> Any:
    return _scalar(scalar, upper)


@partial(jax.jit, static_argnums=0)
def _stiffness_slope(scalar: Objective, both: tuple[tuple[Array, ...], tuple[Array, ...]]) -> Any:
    return jax.jvp(partial(_scalar, scalar), (both[0],), (both[1],))[1]


def _constraints(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Scalar:
    """Rows of J_x, moments over the characteristic length."""
    moved = [w.carried(posture.heading, arm_of(leg, pose)) for w in chain_rows(leg, posture, scale).wrenches]
    return jnp.stack(
        [jnp.stack([jnp.asarray(c, dtype=float) for c in (*w.force, *(m / scale for m in w.moment))]) for w in moved]
    )


@dataclass(frozen=True)
class Singular:
    """The least singular value of J_x (`kinematics.singularity`)."""

    name = SIGMA
    unit = ""
    piece = staticmethod(_constraints)
    rows = 100_000
    is_costly = False
    precision = 1e-10

    def values(self, pieces: Pieces, poses: Frame) -> Array:
        matrices = np.concatenate(pieces, axis=1)
        return np.asarray(over_rows(_least, tuple(matrices.reshape(len(matrices), 36).T)))[:, None]

    def slopes(self, pieces: Pieces, poses: Frame, pushed: Sequence[Pieces]) -> Array:
        matrices = np.concatenate(pieces, axis=1)
        left, _, right = np.linalg.svd(np.nan_to_num(matrices))
        changes = [np.concatenate(one, axis=1) for one in pushed]
        return np.stack([np.einsum("mi,mij,mj->m", left[:, :, -1], c, right[:, -1]) for c in changes], axis=-1)[:, None]


@jax.jit
def _least(entries: tuple[Array, ...]) -> Any:
    return least_singular_values(jnp.stack(entries).reshape(6, 6, -1))


def _margin(leg: Leg, posture: Posture, pose: Frame, signs: Scalar, stock: Stock, scale: Scalar) -> Scalar:
    return jnp.asarray(margin(leg, posture, pose), dtype=float)


@dataclass(frozen=True)
class Travel:
    """The least margin of travel of all joints, of every chain: 1 in the middle of the travel, 0 at an end."""

    name = TRAVEL
    unit = ""
    piece = staticmethod(_margin)
    rows = 200_000
    is_costly = False
    precision = 1e-10

    def values(self, pieces: Pieces, poses: Frame) -> Array:
        return np.stack(pieces, axis=1)

    def slopes(self, pieces: Pieces, poses: Frame, pushed: Sequence[Pieces]) -> Array:
        return np.stack([np.stack(one, axis=1) for one in pushed], axis=-1)


@dataclass(frozen=True)
class Ease(Travel):
    """One over the greatest rate of a drive, of every chain: 0 at a Type 1 singularity."""

    name = EASE
    piece = staticmethod(ease_piece)


@dataclass(frozen=True)
class Dynamic:
    """The least dynamic stiffness 1/|H| over a range of frequencies, that of all drives in it."""

    name: str
    machine: Machine
    """Its drives free: kernels then serve all lock sets, for a drive at work yields as one that is locked does."""
    entries: Entries
    low: float
    high: float
    """Hz."""
    loss_factor: float
    piece = staticmethod(standing_piece)
    rows = 1_500
    is_costly = True
    precision = 1e-5

    @property
    def unit(self) -> str:
        (pair,) = self.entries.pairs
        turns = sum(any(self.entries.directions[k][3:]) for k in pair)
        return ("N/m", "N/rad or N", "N m/rad")[turns]

    def _asked(self, pieces: Pieces, poses: Frame) -> Asked:
        return Asked(self.machine, poses, Stand(None, tuple(pieces)), self.entries, None, self.loss_factor)

    def values(self, pieces: Pieces, poses: Frame) -> Array:
        return self._found(pieces, poses)[0]

    def _found(self, pieces: Pieces, poses: Frame) -> tuple[Array, Array]:
        closed = np.flatnonzero(np.all([np.isfinite(p.end.x) & (p.reach >= 0) for p in pieces], axis=0))
        value, frequency = (np.full((len(poses.origin.x), 1), np.nan) for _ in range(2))
        if len(closed):
            # Filled up, since kernels are compiled for every number of poses.
            index = np.resize(closed, -(-len(closed) // CHUNK) * CHUNK)
            asked = self._asked(pieces, poses).part(index)
            found = greatest(asked, self.low, self.high, least_damping(self.machine, self.loss_factor))
            value[closed], frequency[closed] = 1 / found.size[: len(closed)], found.frequency[: len(closed)]
        return value, frequency

    def slopes(self, pieces: Pieces, poses: Frame, pushed: Sequence[Pieces]) -> Array:
        """At the frequency of the least value, where the derivative by the frequency vanishes (envelope theorem).

        Poses stand still, so that slopes by a roll, which turns the platform's mass as well, are not these.
        """
        _, frequency = self._found(pieces, poses)
        made = np.full((len(frequency), 1, len(pushed)), np.nan)
        closed = np.flatnonzero(np.isfinite(frequency[:, 0]))
        if not len(closed):
            return made
        index = np.resize(closed, -(-len(closed) // ROWS) * ROWS)
        asked, omega = self._asked(pieces, poses).part(index), 2 * np.pi * frequency[index, 0]
        effort = spectral.plan(self.machine, asked.poses, asked.stand, 2 * np.pi * self.high).effort
        for start in range(0, len(index), ROWS):
            some = np.arange(start, start + ROWS)
            part = asked.part(some)

            def stiffness(postures: Any, part: Asked = part, some: Array = some) -> Any:
                own = Asked(part.machine, part.poses, Stand(None, postures), part.entries, None, part.loss_factor)
                return 1 / jnp.abs(own_frequency(own, omega[some], effort)[:, 0])

            for v, one in enumerate(pushed):
                change = jax.tree.map(lambda c, some=some: np.asarray(c)[index[some]], tuple(one))
                slope = np.asarray(jax.jvp(stiffness, (part.stand.postures,), (change,))[1])
                rows = some[some < len(closed)]
                made[closed[rows], 0, v] = slope[rows - start]
        return made
