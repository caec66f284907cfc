"""Proofs that limits, clearance and control hold all over sets of poses, not at samples only.

The poses are patches: bilinear pieces of a line or a surface in the coordinates of a `Touch`.  Over a patch the values at its
middle change by no more than their slopes allow (`space.enclosure`, rounding included); and

- no singular value of J_x changes by more than the norm of the change of J_x does (Weyl's inequality),
- no signed distance of two bodies by more than the farthest that points of both are displaced, added.

A patch for which that does not suffice is cut in two, until it does or the budget is spent.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.kinematics.alike import alike
from trivet.kinematics.jacobian import require_six_each
from trivet.kinematics.travel import Gauge, gauges, winding
from trivet.model import Machine
from trivet.reach.distance import Box, Capsule
from trivet.reach.margins import all_distances, forces
from trivet.reach.scene import FAR, Ball, Scene, placed
from trivet.reach.touch import Touch
from trivet.space import enclosure
from trivet.space.batches import in_threads
from trivet.space.vector import Vec

Array = NDArray[Any]

PATCHES = 1024
"""Per call: fixed, so that a machine is traced once."""
SMALLEST = 1e-6
"""Size of a patch (rad, or m) below which it is not cut: something is the matter there."""
OVERLAP = 1e-8
"""Of patches, in parts of themselves."""
SPARE = 1e-12
"""By how much the values at a middle, worked out in floating point, may be wrong, and by how much cutting moves a middle off
its patch: parts, and m."""


class Patches(NamedTuple):
    """Bilinear pieces of lines or surfaces: middle + u first + v second + u v twist, -1 <= u, v <= 1.

    Arrays (6, n) over the coordinates of a `Touch`.
    """

    middle: Array
    first: Array
    second: Array
    twist: Array

    @classmethod
    def along(cls, knots: Array) -> Patches:
        """The pieces of a line of straight parts through knots (6, n + 1)."""
        nothing = np.zeros((6, knots.shape[1] - 1))
        return cls((knots[:, 1:] + knots[:, :-1]) / 2, (knots[:, 1:] - knots[:, :-1]) / 2, nothing, nothing)

    @classmethod
    def over(cls, knots: Array) -> Patches:
        """The pieces of a surface through knots (6, m + 1, n + 1)."""
        a, b, c, d = knots[:, :-1, :-1], knots[:, 1:, :-1], knots[:, :-1, 1:], knots[:, 1:, 1:]
        parts = ((a + b + c + d) / 4, (b + d - a - c) / 4, (c + d - a - b) / 4, (a + d - b - c) / 4)
        return cls(*(part.reshape(6, -1) for part in parts))

    @property
    def many(self) -> int:
        """How many there are."""
        return int(self.middle.shape[1])

    def some(self, index: Any) -> Patches:
        """Some of them."""
        return Patches(*(part[:, index] for part in self))

    def halved(self) -> Patches:
        """Each cut in two, across its longer side."""
        swap = np.abs(self.second).max(axis=0) > np.abs(self.first).max(axis=0)
        first, second = np.where(swap, self.second, self.first), np.where(swap, self.first, self.second)
        halves = [Patches(self.middle + s / 2 * first, first / 2, second + s / 2 * self.twist, self.twist / 2) for s in (-1, 1)]
        return Patches(*(np.concatenate(parts, axis=1) for parts in zip(*halves, strict=True)))

    @property
    def size(self) -> Array:
        """(n,) how far the coordinates are from those of the middle, at most: rad, or m."""
        return (np.abs(self.first) + np.abs(self.second) + np.abs(self.twist)).max(axis=0)


class Demand(NamedTuple):
    """What is to hold."""

    travel: float = 0.0
    """Least margin of all joints, as a part of half their travel."""
    clearance: float | None = 0.0
    """Least signed distance of bodies, m; None where they need not stay apart."""
    sigma_min: float = 0.0
    """Smallest singular value of J_x, moments divided by the characteristic length."""


class Bounds(NamedTuple):
    """Numbers (n,) that travel, clearance and sigma_min do not fall below, over patches or at their middles."""

    travel: Array
    clearance: Array
    sigma_min: Array

    def lacking(self, demand: Demand, spare: float = 0.0) -> Array:
        """(n, 3) where they are not known to be as demanded, less what is to spare."""
        least = demand.travel, -FAR if demand.clearance is None else demand.clearance, demand.sigma_min
        return np.stack([~(own >= bound - spare) for own, bound in zip(self, least, strict=True)], axis=-1)


class Proof(NamedTuple):
    """What became of a proof."""

    demand: Demand
    is_proven: bool
    patches: int
    """How many were looked at."""
    least: Demand
    """The least bounds of the patches that are proven."""
    open: Patches
    """The patches that are left; none where all is proven."""
    smallest: int
    """The smallest of these; -1 for none."""
    reason: str
    """What is not known to hold there; empty for none."""
    is_refuted: bool
    """Whether it is known not to hold: at the middle of that patch."""


class Prover:
    """Bounds of one machine in one working mode, on spheres of one radius."""

    def __init__(self, machine: Machine, signs: Any, scene: Scene | None, radius: float, workpiece: Ball | None = None) -> None:
        """Get ready.

        Args:
            machine: six actuators and six constraints, all chains in closed form.
            signs: (n_chains, 2) working mode.
            scene: bodies that must stay apart; None when they need not.
            radius: of the spheres, m; 0 for poses that touch nothing.
            workpiece: a sphere to run into, if the scene has one.

        Raises:
            InputError: for other machines, or bodies with meshes.
        """
        require_six_each(machine)
        if scene is not None and scene.meshed.pairs:
            raise InputError(f"{machine.name}: bodies with meshes have no proofs; describe them by capsules, boxes and spheres")
        self.machine, self.signs, self.scene, self.radius, self.workpiece = machine, signs, scene, radius, workpiece
        self._leaves, self._structure = jax.tree.flatten((machine, np.asarray(signs, dtype=float), radius, workpiece))

    def prove(
        self, patches: Patches, demand: Demand, budget: int, progress: Callable[[int, int], None] = lambda looked, left: None
    ) -> Proof:
        """Try to prove that demands hold all over patches.

        Args:
            patches: where.
            demand: what.
            budget: patches to look at, at most.
            progress: called with the numbers of patches that have been looked at and that are left.

        Raises:
            InputError: for no patches, or limits of joints that may turn by more than once round.
        """
        wound = winding(self.machine) if demand.travel > -np.inf else []
        if wound:
            raise InputError(f"{self.machine.name}: {', '.join(wound)} may turn beyond a turn, and proofs do not count turns")
        if not patches.many:
            raise InputError(f"{self.machine.name}: nothing to be proven, for there are no poses")
        looked, left = 0, patches
        least = np.full(3, np.inf)
        reasons: Array = np.zeros((0, 4), dtype=bool)
        refuted: Any = np.zeros(0, dtype=bool)
        while left.many and looked + left.many <= budget:
            is_smooth, bounds, middles = self.bounds(left)
            lacking = np.concatenate([~is_smooth[:, None], bounds.lacking(demand)], axis=1)
            is_open: Any = lacking.any(axis=1)
            if not is_open.all():
                least = np.minimum(least, np.stack(bounds)[:, ~is_open].min(axis=1))
            looked += left.many
            wrong = middles.lacking(demand, 2 * SPARE)[is_open]
            left, reasons, refuted = left.some(is_open), lacking[is_open], wrong.any(axis=1)
            progress(looked, left.many)
            if refuted.any():
                reasons[refuted, 0] = ~np.isfinite(np.stack(middles)[:, is_open][:, refuted]).all(axis=0)
                reasons[:, 1:] &= wrong | ~refuted[:, None]
                break
            if looked + 2 * left.many > budget or np.any(left.size < SMALLEST):
                break
            left = left.halved()
        smallest = -1
        if left.many:
            smallest = int(np.argmin(np.where(refuted, 0.0, left.size) if len(refuted) == left.many else left.size))
        names = ("the chains close and move on smoothly", "the margin of travel", "the clearance", "sigma_min")
        found = (
            [name for name, lacks in zip(names, reasons[smallest], strict=True) if lacks]
            if len(reasons) > smallest >= 0
            else []
        )
        return Proof(
            demand,
            not left.many,
            looked,
            Demand(*(float(v) for v in least)),
            left,
            smallest,
            ", ".join(found),
            bool(len(refuted) == left.many and refuted.any()),
        )

    def bounds(self, patches: Patches) -> tuple[Array, Bounds, Bounds]:
        """Over patches (n,): whether chains close and all joints move on without a jump, bounds, and values at the middles."""
        count = patches.many

        def parts() -> Any:
            for start in range(0, count, PATCHES):
                yield patches.some(np.minimum(np.arange(start, start + PATCHES), count - 1))

        traced = _traced(self._structure, self.scene, 3 if np.any(patches.second) or np.any(patches.twist) else 1)
        found = list(in_threads(lambda part: self._bounds(part, traced), parts()))
        return jax.tree.map(lambda *columns: np.concatenate(columns)[:count], *found)

    def _bounds(self, patches: Patches, traced: _Traced) -> tuple[Array, Bounds, Bounds]:
        # Neighbours overlap, so that no rounding of their middles leaves a gap between them.
        edges = [list(edge * (1 + OVERLAP)) for edge in patches[1 : traced.edges + 1]]
        reaches, joints, travels, rows, shapes = traced.enclosure(list(patches.middle), edges, self._leaves)
        is_smooth = np.ones(PATCHES, dtype=bool)
        for reach in reaches:
            is_smooth &= np.all(reach.middle > reach.radius, axis=0)
        for joint in jax.tree.leaves(joints, is_leaf=_is_ball):
            is_smooth &= np.all(np.isfinite(np.atleast_2d(joint.radius + joint.middle)), axis=0)
            if joint.jumps is not None:
                is_smooth &= ~np.any(np.atleast_2d(joint.jumps), axis=0)
        travel, at_travel = np.ones(PATCHES), np.ones(PATCHES)
        for gauge, (value, low, high) in zip(traced.gauges, travels, strict=True):
            gauge = gauge._replace(low=low.middle, high=high.middle)
            own = gauge._replace(value=value.middle).margin
            # Every margin is concave in the value: the least is at an end.
            ends = [np.asarray(gauge._replace(value=value.middle + sign * value.radius).margin) for sign in (-1, 1)]
            worst = np.min([end.min(axis=0) for end in ends], axis=0) - SPARE
            travel, at_travel = np.minimum(travel, worst), np.minimum(at_travel, np.asarray(own).min(axis=0))
        sigma, at_sigma = self._controlled(rows)
        gap, at_gap = self._apart(patches, traced.places, shapes)
        return is_smooth, Bounds(travel, gap, sigma), Bounds(at_travel, at_gap, at_sigma)

    def _controlled(self, rows: list[list[enclosure.Ball]]) -> tuple[Array, Array]:
        """Bounds of sigma_min, and sigma_min at the middles."""
        length = float(self.machine.characteristic_length)
        scale = np.array([1.0, 1.0, 1.0, length, length, length])

        def matrices(part: int) -> Array:
            whole = np.stack(
                [np.stack([np.broadcast_to(ball[part], PATCHES) for ball in row], axis=-1) for row in rows], axis=1
            )
            return np.asarray(whole / scale)

        middle, radius = matrices(0), matrices(1)
        is_known: Any = np.isfinite(middle).all(axis=(1, 2))
        least = np.linalg.svd(np.where(is_known[:, None, None], middle, 0.0), compute_uv=False)[:, -1]
        least = np.where(is_known, least - SPARE, -np.inf)
        change = np.minimum(
            np.sqrt((radius * radius).sum(axis=(1, 2))),
            np.sqrt(radius.sum(axis=1).max(axis=1) * radius.sum(axis=2).max(axis=1)),
        )
        return np.where(np.isnan(change), -np.inf, least - change * (1 + SPARE)), least

    def _apart(self, patches: Patches, places: list[tuple[int, ...]], shapes: list[Any]) -> tuple[Array, Array]:
        """Bounds of the clearance, and the clearance at the middles."""
        if self.scene is None or not self.scene.pairs:
            return np.full(PATCHES, FAR), np.full(PATCHES, FAR)
        poses = jax.tree.map(np.asarray, Touch(*patches.middle).frame(self.radius))
        gaps = all_distances(self.machine, self.scene, poses, self.signs, self.workpiece) - SPARE
        moved = np.zeros((PATCHES, len(self.scene.parts)))
        for parts, shape in zip(places, shapes, strict=True):
            moved[:, list(parts)] = np.broadcast_to(_displaced(shape), (len(parts), PATCHES)).T
        one, two = np.array(self.scene.pairs).T
        bounds = gaps - (moved[:, one] + moved[:, two]) * (1 + SPARE)
        return np.where(np.isnan(bounds), -np.inf, bounds).min(axis=1), np.where(np.isnan(gaps), -np.inf, gaps).min(axis=1)


class _Traced(NamedTuple):
    """The kinematics of machines of one topology, ready to be bounded."""

    enclosure: enclosure.Enclosure
    edges: int
    gauges: list[Gauge]
    """In the order of the travels, without numbers."""
    places: list[tuple[int, ...]]
    """In the order of the shapes, which parts of the scene they are."""


@lru_cache(maxsize=32)
def _traced(structure: Any, scene: Scene | None, edges: int) -> _Traced:
    kept: list[Gauge] = []
    places: list[tuple[int, ...]] = []

    def quantities(*values: Any) -> Any:
        machine, signs, radius, workpiece = jax.tree.unflatten(structure, values[6:])
        pose = Touch(*values[:6]).frame(radius)
        groups = alike(machine.legs_unnamed)
        stands = [group.stand(pose, signs) for group in groups]
        limited = [g for group, stand in zip(groups, stands, strict=True) for g in gauges(group.leg, stand, pose)]
        kept[:] = [Gauge(None, None, None, None, g.scale) for g in limited]  # type: ignore[arg-type]
        shapes = []
        if scene is not None:
            found = placed(scene, machine, groups, stands, pose, workpiece)
            watched = {part for pair in scene.pairs for part in pair}
            kept_shapes = [(parts, own) for parts, own in found.values() if watched.intersection(parts)]
            places[:], shapes = [parts for parts, _ in kept_shapes], [own for _, own in kept_shapes]
        joints = [jax.tree.leaves(stand.coordinates) for stand in stands]
        rows = forces(machine.legs_unnamed, machine.characteristic_length, pose, signs)
        return [stand.reach for stand in stands], joints, [(g.value, g.low, g.high) for g in limited], rows, shapes

    examples = [np.zeros(PATCHES)] * 6
    # Of the legs' signs the shape matters as well; all other numbers are scalars.
    fixed = jax.tree.unflatten(structure, [0.0] * structure.num_leaves)
    machine, _, radius, workpiece = fixed
    fixed = jax.tree.leaves((machine, np.ones((len(machine.legs), 2)), radius, workpiece))
    return _Traced(enclosure.Enclosure(quantities, examples, edges, fixed), edges, kept, places)


def _displaced(shape: Any) -> Array:
    """How far any point of a shape, made of balls, is displaced at most."""
    if isinstance(shape, Capsule):
        return np.maximum(_length(shape.start), _length(shape.end)) + shape.radius.radius
    assert isinstance(shape, Box)
    found = _length(shape.frame.origin)
    for axis, half in zip(shape.frame[1:], shape.half, strict=True):
        found = found + _length(axis) * (half.middle + half.radius) + half.radius
    return found


def _length(vector: Vec) -> Array:
    return np.sqrt(sum(c.radius * c.radius for c in vector))


def _is_ball(found: Any) -> bool:
    return isinstance(found, enclosure.Ball)
