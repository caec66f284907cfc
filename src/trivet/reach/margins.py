"""How far a machine is from what stops it, over many poses: ends of travel, collisions, and the sides of singularities."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.kinematics.alike import alike
from trivet.kinematics.jacobian import arm_of, chain_rows, require_six_each
from trivet.kinematics.travel import margin, room
from trivet.model import Machine
from trivet.reach.meshes import distances as distances_of_solids
from trivet.reach.scene import FAR, Ball, Scene, distances, placed
from trivet.space.batches import in_batches, in_threads
from trivet.space.elimination import expanded
from trivet.space.frame import Angle, Frame
from trivet.space.pose import rolled
from trivet.space.scalar import Scalar
from trivet.space.singular import least_singular_values

Array = NDArray[Any]

ROWS = 32
"""Frames per call of a grid."""


def travel_margin(machine: Machine, poses: Frame, signs: Any) -> Array:
    """The least margin of all joints (n,), as a part of half their travel: `kinematics.travel.Gauge.margin`.

    Args:
        machine: the machine.
        poses: platform frames, components (n,).
        signs: (n_chains, 2) working mode.

    Returns:
        1 in the middle of every travel, 0 at an end, below zero outside, minus infinity where a chain does not close.
    """
    return _over(partial(margins, machine.legs_unnamed), poses, signs)


def travel_margin_on_grid(machine: Machine, frames: Frame, rolls: Array, signs: Any) -> Array:
    """`travel_margin` (n, m) of frames (n,) turned about their own normals by rolls (m,), rad."""
    count, turns = len(frames.origin.x), Angle(np.cos(rolls), np.sin(rolls))
    legs, signs = machine.legs_unnamed, np.asarray(signs)

    def parts() -> Iterator[Frame]:
        for start in range(0, count, ROWS):
            index = np.minimum(np.arange(start, start + ROWS), count - 1)
            yield jax.tree.map(lambda c, index=index: np.asarray(c)[index], frames)

    found = list(in_threads(lambda part: np.asarray(_margins_on_grid(legs, part, turns, signs)), parts()))
    return np.concatenate(found)[:count]


def clearance(machine: Machine, scene: Scene, poses: Frame, signs: Any, workpiece: Ball | None = None) -> Array:
    """Signed distance (n,) of the nearest pair of bodies that must not touch, m; infinite where there is none."""
    least = np.full(len(poses.origin.x), FAR)
    if scene.plain.pairs:
        least = _over(partial(clearances, scene.plain, machine, workpiece), poses, signs)
    if scene.meshed.pairs:
        least = np.minimum(least, _of_meshes(machine, scene.meshed, poses, signs, workpiece).min(axis=1))
    return least


def all_distances(machine: Machine, scene: Scene, poses: Frame, signs: Any, workpiece: Ball | None = None) -> Array:
    """Signed distances (n, pairs), m, in the order of the scene's pairs."""
    found = np.empty((len(poses.origin.x), len(scene.pairs)))
    for some, by in ((scene.plain, _of_plain_shapes), (scene.meshed, _of_meshes)):
        if some.pairs:
            found[:, [scene.pairs.index(pair) for pair in some.pairs]] = by(machine, some, poses, signs, workpiece)
    return found


def _of_plain_shapes(machine: Machine, scene: Scene, poses: Frame, signs: Any, workpiece: Ball | None) -> Array:
    return _over(partial(_all_distances, scene, machine, workpiece), poses, signs)


def _of_meshes(machine: Machine, scene: Scene, poses: Frame, signs: Any, workpiece: Ball | None) -> Array:
    """One pose after the other; bodies are put into place by the kernel that others share."""
    count = len(poses.origin.x)
    rows: dict[int, Any] = {}
    found = in_batches(lambda part: _shapes(scene, machine, workpiece, part, np.asarray(signs)), poses)
    for parts, own in found.items():
        rows |= {part: jax.tree.map(lambda c, k=k: c[:, k], own) for k, part in enumerate(parts)}
    wanted = sorted({k for pair in scene.pairs for k in pair})
    shapes = [(rows[k], scene.parts[k].hull()) for k in wanted]
    return distances_of_solids(shapes, [(wanted.index(a), wanted.index(b)) for a, b in scene.pairs], count)


def nearest_bodies(
    machine: Machine, scene: Scene, poses: Frame, signs: Any, workpiece: Ball | None = None
) -> tuple[list[tuple[str, str]], Array]:
    """The pair of bodies that are nearest at every pose, and their distance (n,), m; ("", "") and infinite for none."""
    if not scene.pairs:
        count = len(poses.origin.x)
        return [("", "")] * count, np.full(count, FAR)
    found = all_distances(machine, scene, poses, signs, workpiece)
    least = found.argmin(axis=1)
    names = scene.names()
    return [names[k] for k in least], found[np.arange(len(found)), least]


def side(machine: Machine, poses: Frame, signs: Any) -> Array:
    """The sign of det J_x (n,): poses on either side of a Type 2 singularity differ in it; NaN where a chain does not close."""
    require_six_each(machine)
    found: Array = np.sign(_over(partial(_determinants, machine.legs_unnamed, machine.characteristic_length), poses, signs))
    return found


class Control(NamedTuple):
    """How well the drives control the platform at poses (n,); NaN where a chain does not close."""

    sigma_min: Array
    """Smallest singular value of J_x, its moments divided by the characteristic length."""
    side: Array
    """Sign of det J_x."""


def control(machine: Machine, poses: Frame, signs: Any) -> Control:
    """How far poses (n,) are from Type 2 singularities, and on which side of them."""
    require_six_each(machine)
    least, found = _over(partial(controls, machine.legs_unnamed, machine.characteristic_length), poses, signs)
    return Control(least, np.sign(found))


def _over(kernel: Callable[[Frame, Any], Any], poses: Frame, signs: Any) -> Any:
    return in_batches(lambda part: kernel(part, np.asarray(signs)), poses)


@jax.jit
def margins(legs: Any, poses: Frame, signs: Scalar) -> Scalar:
    """`travel_margin` of legs without names, a kernel."""
    return _least(margin, legs, poses, signs)


@jax.jit
def rooms(legs: Any, length: Scalar, poses: Frame, signs: Scalar) -> Scalar:
    """The least `kinematics.travel.room` (n,) of legs without names, a kernel; `length` is the characteristic one."""
    return _least(partial(room, length=length), legs, poses, signs)


def _least(of: Callable[..., Scalar], legs: Any, poses: Frame, signs: Scalar) -> Scalar:
    """Of all chains."""
    found = [jnp.min(of(group.leg, group.stand(poses, signs), poses), axis=0) for group in alike(legs)]
    least = jnp.min(jnp.stack(found), axis=0)
    return jnp.where(jnp.isnan(least), -jnp.inf, least)


@jax.jit
def _margins_on_grid(legs: Any, frames: Frame, rolls: Angle, signs: Scalar) -> Scalar:
    count, turns = len(frames.origin.x), len(rolls.cos)
    tall = jax.tree.map(lambda c: jnp.broadcast_to(c[:, None], (count, turns)).ravel(), frames)
    wide = jax.tree.map(lambda c: jnp.broadcast_to(c, (count, turns)).ravel(), rolls)
    return margins(legs, rolled(tall, wide), signs).reshape(count, turns)


def _distances(
    scene: Scene, machine: Machine, workpiece: Ball | None, poses: Frame, signs: Scalar
) -> Iterator[tuple[list[int], Scalar]]:
    groups = alike(machine.legs_unnamed)
    shapes = placed(scene, machine, groups, [group.stand(poses, signs) for group in groups], poses, workpiece)
    yield from distances(scene, shapes)


@partial(jax.jit, static_argnums=0)
def clearances(scene: Scene, machine: Machine, workpiece: Ball | None, poses: Frame, signs: Scalar) -> Scalar:
    """`clearance` of plain shapes, a kernel."""
    parts = [jnp.min(found, axis=0) for _, found in _distances(scene, machine, workpiece, poses, signs)]
    return jnp.min(jnp.stack(parts), axis=0)


@partial(jax.jit, static_argnums=0)
def _shapes(scene: Scene, machine: Machine, workpiece: Ball | None, poses: Frame, signs: Scalar) -> dict[tuple[int, ...], Any]:
    """Every shape in {O}, components (n, parts), by the parts which they are."""
    groups = alike(machine.legs_unnamed)
    shapes = placed(scene, machine, groups, [group.stand(poses, signs) for group in groups], poses, workpiece)
    return {parts: jax.tree.map(jnp.transpose, own) for parts, own in shapes.values()}


@partial(jax.jit, static_argnums=0)
def _all_distances(scene: Scene, machine: Machine, workpiece: Ball | None, poses: Frame, signs: Scalar) -> Scalar:
    """(n, pairs) in the order of the scene."""
    order, parts = [], []
    for pairs, found in _distances(scene, machine, workpiece, poses, signs):
        order += pairs
        parts.append(jnp.broadcast_to(found, (len(pairs), len(poses.origin.x))))
    return jnp.concatenate(parts)[np.argsort(order)].T


@jax.jit
def controls(legs: Any, length: Scalar, poses: Frame, signs: Scalar) -> tuple[Scalar, Scalar]:
    """Smallest singular values and determinants of J_x (n,), a kernel; `length` is the characteristic one."""
    rows = forces(legs, length, poses, signs)
    ours = [jnp.stack([*row[:3], *(moment / length for moment in row[3:])]) for row in rows]
    return least_singular_values(jnp.stack(ours)), expanded(rows)


@jax.jit
def _determinants(legs: Any, length: Scalar, poses: Frame, signs: Scalar) -> Scalar:
    return expanded(forces(legs, length, poses, signs))


def forces(legs: Any, length: Scalar, poses: Frame, signs: Scalar) -> list[list[Scalar]]:
    """The rows of J_x at poses (n,), chain by chain, as in `jacobian.constraint_rows`; six components (n,) each."""
    found: dict[tuple[int, int], list[Scalar]] = {}
    for group in alike(legs):
        posture = group.stand(poses, signs)
        arm = arm_of(group.leg, poses)
        for k, wrench in enumerate(chain_rows(group.leg, posture, length).wrenches):
            moved = wrench.carried(posture.heading, arm)
            own = jnp.broadcast_arrays(*(jnp.asarray(c, dtype=float) for c in (*moved.force, *moved.moment)), arm.x)[:6]
            found |= {(place, k): [c[row] for c in own] for row, place in enumerate(group.places)}
    return [found[key] for key in sorted(found)]
