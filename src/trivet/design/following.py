"""How the best rolls of a machine follow its dimensions, to first order about one design.

At a check point the best roll gamma is where the objective g has its top, g_gamma = 0, and stays so as the design x changes:
d gamma / dx = -g_gamma,x / g_gamma,gamma.  Where a limit of travel or the reach of a chain cuts the hill, it stays there, where
the room m vanishes: d gamma / dx = -m_x / m_gamma.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.design.fields.margins import room
from trivet.design.looked import Looked, Stand
from trivet.design.rolls import turns
from trivet.space.frame import Angle
from trivet.space.scalar import Scalar

Array = NDArray[Any]

BEYOND = 1e-5
"""rad uphill from the best roll: where a limit cuts the hill, no chain can stand there."""
APART = 1e-4
"""rad on either side of a roll, at which slopes are compared for second derivatives: these are true to some 1e-8."""
NEAR = 0.1
"""Of the way to where the room ends, at which they are compared where that is nearer: stretched elbows make hills whose tops
lie some 1e-5 rad before it, and beyond it stiffness is NaN."""
STEEPEST = 1e3
"""rad, by which a roll may turn over the range of a variable; a flat top says nothing of where to go."""


class Held(NamedTuple):
    """The rolls at n check points about a design (d,)."""

    design: Array
    roll: Array
    """(n,) the best at the design, rad."""
    turn: Array
    """(n, d) how it follows, rad per unit of each variable."""
    freest: Array
    """(n,) the roll with the most room, rad."""
    roomiest: Array
    """(n,) numbers of the check points, those with the most room at these rolls first."""
    point: Array
    """(n,) which check points are looked at: those that are reached; the first of them again in the place of others."""
    reached: Array
    """(n,) whether the check point itself is."""

    def looked(self, stand: Stand, design: Scalar) -> Looked:
        """A machine near the design at the rolls that follow."""
        roll = self.roll + self.turn @ (design - self.design)
        return stand.at_rolls(_angle(roll), self.reached).parts(self.point, self.reached)

    def freely(self, stand: Stand, count: int) -> Looked:
        """So many check points, reached or not, at the rolls with the most room; those that have the most of it."""
        some = self.roomiest[:count]
        return stand.at_rolls(_angle(self.freest), self.reached).parts(some, self.reached[some])


def nowhere(design: Array) -> Held:
    """Where no check points are asked for."""
    none = np.zeros(1)
    first = np.zeros(1, dtype=int)
    return Held(design, none, np.zeros((1, len(design))), none, first, first, np.ones(1, dtype=bool))


class Follower:
    """Rolls about any design; compiled once."""

    def __init__(self, stand: Callable[[Any], Stand], width: Array) -> None:
        self._choose = jax.jit(partial(_chosen, stand))
        self._follow = jax.jit(partial(_turns, stand))
        self._width = width

    def about(self, design: Array) -> Held:
        """The rolls about a design (d,)."""
        roll, reached, freest, roomiest = (np.asarray(c) for c in self._choose(design))
        first = int(np.argmax(reached))
        turn = np.asarray(self._follow(design, roll))
        most = STEEPEST / np.where(self._width > 0, self._width, 1.0)
        # One that turns too fast to be followed is held.
        turn = np.where((np.abs(turn) <= most).all(axis=1, keepdims=True), turn, 0.0)
        point = np.where(reached, np.arange(len(roll)), first)
        return Held(design, roll, turn, freest, roomiest, point, reached)


def _chosen(stand: Callable[[Any], Stand], design: Any) -> Any:
    """The best roll at every check point (n,), whether any is reached, the one with the most room, and points by how much."""
    own = stand(design)
    roll, reached = own.roll
    every = jax.tree.map(jnp.asarray, turns(own.points.rolls, own.points.symmetry))

    def left(roll: Angle) -> Any:
        return room(own.at_rolls(jax.tree.map(lambda c: jnp.broadcast_to(c, reached.shape), roll), reached))

    rooms = jax.lax.map(left, every)
    freest = jnp.arctan2(every.sin, every.cos)[jnp.argmax(rooms, axis=0)]
    return jnp.arctan2(roll.sin, roll.cos), reached, freest, jnp.argsort(-rooms.max(axis=0))


def _turns(stand: Callable[[Any], Stand], design: Any, roll: Any) -> Any:
    """(n, d) slopes of the rolls by the variables."""
    everywhere = jnp.ones(len(roll), dtype=bool)

    def both(design: Any, roll: Any) -> tuple[Any, Any]:
        own = stand(design)
        looked = own.at_rolls(_angle(roll), everywhere)
        return own.points.objective(looked.stiffness), room(looked)

    def room_at(roll: Any) -> Any:
        """(n,)"""
        return room(stand(design).at_rolls(_angle(roll), everywhere))

    def slopes(roll: Any) -> tuple[Any, Any]:
        """Of objective and room: along the roll (n,), and by the variables (n, d)."""
        return jax.jvp(partial(both, design), (roll,), (jnp.ones_like(roll),))[1], jax.jacfwd(both)(design, roll)

    # Differences of slopes: second derivatives of all that a machine is take minutes to compile.
    left, lost = jax.jvp(room_at, (roll,), (jnp.ones_like(roll),))
    apart = jnp.minimum(APART, NEAR * jnp.abs(left / lost))
    ways = jnp.array([-1.0, 0.0, 1.0])[:, None] * apart
    (rise, narrowing), (by, narrowed_by) = jax.lax.map(slopes, roll + ways)
    curvature, bend = (part[2] - part[0] for part in (rise, by))
    is_cut = room_at(roll + jnp.sign(rise[1]) * BEYOND) < 0
    top, edge = -bend / curvature[:, None], -narrowed_by[1] / narrowing[1][:, None]
    found = jnp.where(is_cut[:, None], edge, jnp.where(curvature[:, None] < 0, top, 0.0))
    return jnp.where(jnp.isfinite(found), found, jnp.inf)


def _angle(roll: Any) -> Angle:
    return Angle(jnp.cos(roll), jnp.sin(roll))
