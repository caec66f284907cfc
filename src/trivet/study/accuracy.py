"""How far the platform is from where it is commanded, its drives at their coordinates: error budgets over a family of poses."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.deviation import platform_errors
from trivet.kinematics.jacobian import require_six_each
from trivet.kinematics.mode import closed_form_signs, mode_text, mode_words
from trivet.kinematics.report import JointState, joint_states, shortfall
from trivet.model import Machine
from trivet.reach.margins import travel_margin
from trivet.results.netcdf import COMPONENTS
from trivet.space.batches import SIZES, in_batches
from trivet.space.family import Family, Places
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.statics.best_roll import ROLLS
from trivet.study.families import hemisphere_of, one_pose
from trivet.study.home import NOT_REACHED
from trivet.study.inexactness import Inexactness, Source, inexactness
from trivet.study.machines import MachineLike, choose
from trivet.study.roll_policy import roll_policy
from trivet.study.tolerance_file import Tolerances, read_tolerances

Array = NDArray[Any]
Progress = Callable[[str, int, int], None]

AT_LIMIT = 1e-9
"""Margin of travel below zero that is rounding."""
FACETS = 8
"""Facets per edge of the cube through which directions are looked along."""
TOGETHER = 64
"""Poses worked on at a time: amounts times directions times these should stay in the cache of a core."""
SIGMAS = 3.0
"""Standard deviations of the ellipsoid that is told."""
SMALL = math.radians(3.0)
"""Angle at worst up to which first order is taken at its word: what it leaves out grows with the square."""


@dataclass(frozen=True)
class Accuracy:
    """Errors of a machine over a family of poses, to first order; arrays over its n points, NaN where none is reached.

    An error is the displacement of the point and the small rotation of the platform in {O}: three components in m, three in
    rad.
    """

    machine: Machine
    mode: str
    family: Family
    policy: str
    """How the roll was chosen: "best K_xx", "-alpha", "30 deg"; "as given" along a path."""
    places: Places
    """Of the grid, rolls included."""
    point: str
    """"platform" (its centre) or "tool" (its tip)."""
    inexact: Inexactness
    shifts: Array
    """(n, s, 6) errors that are there for sure, by source: of warm bodies."""
    variances: Array
    """(n, s, 6) variances of the components, by source."""
    covariance: Array
    """(n, 6, 6) of all sources, which are independent."""
    worst: Array
    """(n, 6) greatest size of each component, all amounts at their worst."""
    farthest: Array
    """(n, 2) greatest distance (m) and angle (rad), all amounts at their worst; a bound that is at most 1.6 % above it."""

    @property
    def sources(self) -> tuple[Source, ...]:
        """What is inexact, s of them."""
        return self.inexact.sources

    @property
    def used(self) -> Array:
        """(n,) points at which the pose is reached with all joints inside their travel."""
        return ~np.any(np.isnan(self.worst), axis=1)

    @property
    def shift(self) -> Array:
        """(n, 6) error that is there for sure."""
        total: Array = self.shifts.sum(axis=1)
        return total

    @property
    def deviation(self) -> Array:
        """(n, 6) standard deviations of the components."""
        return np.sqrt(self.variances.sum(axis=1))

    @cached_property
    def size(self) -> Array:
        """(n, 2) root mean square of the distance (m) and of the angle (rad)."""
        squares = self.shift**2 + self.variances.sum(axis=1)
        return np.sqrt(squares.reshape(-1, 2, 3).sum(axis=2))

    @cached_property
    def ellipsoids(self) -> Array:
        """(n, 2, 3) half axes, ascending, of the ellipsoids of three standard deviations of position (m) and rotation (rad)."""
        found = np.full((len(self.worst), 2, 3), np.nan)
        own = self.covariance[self.used]
        blocks = np.stack([own[:, :3, :3], own[:, 3:, 3:]], axis=1)
        found[self.used] = SIGMAS * np.sqrt(np.maximum(np.linalg.eigvalsh(blocks), 0))
        return found

    def shares(self, what: str = "position") -> Array:
        """(n, s) parts of the sources in a variance: of the "position", the "rotation", or one component ("x", "rz").

        NaN where there is no variance.
        """
        chosen = {"position": slice(0, 3), "rotation": slice(3, 6)} | {name: k for k, name in enumerate(COMPONENTS)}
        own = self.variances[:, :, np.r_[chosen[what]]].sum(axis=2)
        with np.errstate(invalid="ignore", divide="ignore"):
            return own / own.sum(axis=1, keepdims=True)

    @property
    def beyond(self) -> Array:
        """(n,) points at which the platform may turn by more than first order can tell of, as near a singularity."""
        return self.farthest[:, 1] > SMALL

    @property
    def told(self) -> Array:
        """(n,) points of which statistics are made: those reached where first order holds; all that are reached if it holds
        nowhere."""
        held = self.used & ~self.beyond
        return held if held.any() else self.used

    @property
    def is_one_pose(self) -> bool:
        """Whether it is of one pose alone."""
        return len(self.family) == 1

    @property
    def least_accurate(self) -> int:
        """Of the points `told` that at which the root mean square of the distance is greatest."""
        return int(np.nanargmax(np.where(self.told, self.size[:, 0], np.nan)))

    def contributions(self) -> Iterator[tuple[slice, Array]]:
        """(some, r, 6) errors by row of `inexact`, at its limit or one standard deviation, of the points in their order and a
        few at a time; NaN where not reached."""
        signs, frames = closed_form_signs(self.machine, self.mode or None), _frames(self.places, self.used)
        tip = _tip(self.machine, self.point)
        for start in range(0, len(self.worst), SIZES[1]):
            rows = slice(start, min(start + SIZES[1], len(self.worst)))
            part = jax.tree.map(lambda c, rows=rows: c[rows], frames)
            found = in_batches(lambda poses: _rows(self.machine, self.inexact.rows, tip, signs, poses), part)
            yield rows, np.where(self.used[rows, None, None], found, np.nan)


class _Kept(NamedTuple):
    """What is kept of one pose."""

    shifts: Scalar
    variances: Scalar
    covariance: Scalar
    worst: Scalar
    farthest: Scalar


def accuracy(
    machine: MachineLike,
    tolerances: Tolerances | str | os.PathLike[str],
    family: Family | Sequence[float] | None = None,
    *,
    point: str = "platform",
    roll: str | float | None = None,
    mode: str | None = None,
    rolls: int | None = None,
    progress: Progress = lambda what, done, total: None,
) -> Accuracy:
    """Errors of the platform from tolerances, misalignments, drives, play and warm bodies, over a family of poses.

    Args:
        machine: machine, name or file; six drives that hold six freedoms, every chain solved in closed form.
        tolerances: what is inexact, or the file that says it.
        family: see `over_hemisphere`, `in_block`, `along_path`, `along`; or one pose, (x, y, z, azimuth, tilt, roll) in m and
            rad; by default the machine's own workpiece, at 317 points.
        point: "platform" (its centre) or "tool" (its tip).
        roll: policy for the roll where the family leaves it free, see `roll_policy`; "best K_xx" by default.
        mode: working mode; the machine's own when not given.
        rolls: rolls of the first grid of a best roll.
        progress: called with what is being done, how many points are done, and how many there are.

    Raises:
        InputError: for a wrong entry, point, policy or mode, a tool tip that the machine does not have, or a machine that is
            redundant or has a chain without closed form.
        NoResultError: when no pose is reached; of one pose it says which chain or joint does not.
    """
    chosen = choose(machine)
    inexact = _looked_up(chosen, tolerances)
    require_six_each(chosen)
    signs, tip = closed_form_signs(chosen, mode), _tip(chosen, point)
    if family is None:
        family = hemisphere_of(chosen)
    elif not isinstance(family, Family):
        family = one_pose(family)
    places, policy = _placed(chosen, signs, family, roll, rolls, lambda done: progress("best rolls", done, len(family)))
    progress("errors", 0, len(family))
    used = _reached(chosen, signs, places)
    name = mode_text(chosen, signs)
    if not used.any():
        raise NoResultError(f"{chosen.name}: {_none_reached(chosen, signs, family, places, policy)}")
    found = in_batches(lambda poses: _summaries(chosen, inexact, tip, signs, poses), _frames(places.some(used), used[used]))
    whole = []
    for values in found:
        every = np.full((len(family), *values.shape[1:]), np.nan)
        every[used] = values
        whole.append(every)
    progress("errors", len(family), len(family))
    return Accuracy(chosen, name, family, policy, places, point, inexact, *whole)


def _looked_up(machine: Machine, tolerances: Tolerances | str | os.PathLike[str]) -> Inexactness:
    if isinstance(tolerances, Tolerances):
        return inexactness(machine, tolerances)
    given = read_tolerances(tolerances)
    try:
        return inexactness(machine, given)
    except InputError as error:
        raise InputError(f"{os.fspath(tolerances)}: {error}") from None


def _tip(machine: Machine, point: str) -> Array | None:
    """(3,) place of the tool in {E}, m; None for the platform centre."""
    if point not in ("platform", "tool"):
        raise InputError(f"point '{point}' is not known; platform or tool")
    tip = machine.platform.tool_tip
    if point == "tool" and tip is None:
        raise InputError(f"point tool: {machine.name} has no platform.tool_tip; give one, or write platform")
    return np.array(tip, dtype=float) if point == "tool" else None


def _placed(
    machine: Machine, signs: Any, family: Family, roll: str | float | None, rolls: int | None, progress: Callable[[int], None]
) -> tuple[Places, str]:
    """The grid of a family with its rolls, and the name of their policy."""
    places = family.places(family.coordinates)
    if places.roll is not None:
        if roll is not None or rolls is not None:
            raise InputError(f"roll: the {family.name} has rolls of its own; leave the policy and its grid out")
        return places, "as given"
    policy = roll_policy("best K_xx" if roll is None else roll, ROLLS if rolls is None else rolls, progress)
    return places._replace(roll=policy.choose(machine, places.surface(family.name), signs)), policy.name


def _reached(machine: Machine, signs: Any, places: Places) -> Array:
    """(n,) whether the pose is known and all joints are inside their travel."""
    known = _known(places)
    return known & (travel_margin(machine, _frames(places, known), signs) >= -AT_LIMIT)


def _known(places: Places) -> Array:
    """(n,) whether the pose is one."""
    assert places.roll is not None
    known: Array = np.all(np.isfinite(places.position), axis=1) & np.isfinite(places.roll)
    return known


def _none_reached(machine: Machine, signs: Any, family: Family, places: Places, policy: str) -> str:
    """Why there is no pose: of one, which chain or joint it is."""
    known = _known(places)
    if len(known) == 1 and known.all():
        state = joint_states(machine, _frames(places, known), signs)
        miss = shortfall(machine, JointState(*(np.asarray(a) for a in state)))
        if miss is not None:
            return f"{NOT_REACHED}: {miss.reason}"
    return f"no pose of the {family.name} is reached, {mode_words(mode_text(machine, signs))}, with the roll {policy}"


def _frames(places: Places, known: Array) -> Frame:
    """Platform frames; upright in {O} where they are not known."""
    fields = (np.where(known[:, None] if values.ndim > 1 else known, values, 0.0) for values in places if values is not None)
    return Places(*fields).frames()


def _at(machine: Machine, tip: Scalar | None, signs: Scalar, pose: Frame) -> Scalar:
    """(d + 3, 6): errors per unit of every deviation, those of the tool tip last."""
    errors = platform_errors(machine, pose, signs)
    if tip is None:
        return jnp.concatenate([errors, jnp.zeros((3, 6))])
    axes = jnp.stack([jnp.stack([jnp.asarray(c, dtype=float) for c in axis]) for axis in pose[1:]])
    moved = errors[:, :3] + jnp.cross(errors[:, 3:], tip @ axes)
    return jnp.concatenate([jnp.concatenate([moved, errors[:, 3:]], axis=1), jnp.pad(axes, ((0, 0), (0, 3)))])


@jax.jit
def _row_errors(machine: Machine, rows: Scalar, tip: Scalar | None, signs: Scalar, poses: Frame) -> Scalar:
    return jax.vmap(lambda pose: rows @ _at(machine, tip, signs, pose))(poses)


def _rows(machine: Machine, rows: Array, tip: Array | None, signs: Any, poses: Frame) -> Scalar:
    return _row_errors(jax.tree.map(jnp.asarray, machine), rows, tip, jnp.asarray(signs), poses)


def _summaries(machine: Machine, inexact: Inexactness, tip: Array | None, signs: Any, poses: Frame) -> Scalar:
    count, amounts = len(inexact.sources), len(inexact.names)
    members = (np.arange(amounts)[:, None] == inexact.amount).astype(float)
    owners = (np.arange(count)[:, None] == inexact.source).astype(float)
    laws = inexact.variance, inexact.reach, members, owners
    arrays = jax.tree.map(jnp.asarray, machine)
    return _kept_of(arrays, (inexact.rows, inexact.known), laws, tip, directions(FACETS), jnp.asarray(signs), poses)


@jax.jit
def _kept_of(machine: Machine, rows: Any, laws: Any, tip: Scalar | None, looked: Scalar, signs: Scalar, poses: Frame) -> _Kept:
    def one(pose: Frame) -> _Kept:
        errors = _at(machine, tip, signs, pose)
        return _summed(rows[0] @ errors, rows[1] @ errors, laws, looked)

    found: _Kept = jax.lax.map(one, poses, batch_size=TOGETHER)
    return found


def _summed(errors: Scalar, shifts: Scalar, laws: Any, looked: Scalar) -> _Kept:
    """From errors by row (r, 6) and what is there for sure by source (s, 6)."""
    variance, reach, members, owners = laws
    squares = members @ (errors * errors)
    variances = owners @ (squares * variance[:, None])
    weighted = errors * (variance @ members)[:, None]
    sure = shifts.sum(axis=0)
    worst = reach @ jnp.sqrt(squares) + jnp.abs(sure)

    def farthest(part: Scalar, own: Scalar) -> Scalar:
        """The greatest distance is the greatest of what all amounts together do along a direction."""
        along = reach @ jnp.sqrt(members @ (part @ looked.T) ** 2) + jnp.abs(looked @ own)
        return along.max() / math.cos(apart(FACETS))

    both = jnp.stack([farthest(errors[:, :3], sure[:3]), farthest(errors[:, 3:], sure[3:])])
    return _Kept(shifts, variances, weighted.T @ errors, worst, both)


def directions(facets: int) -> Array:
    """(m, 3): unit vectors, one of every opposite pair, no direction being further than `apart` from the nearest."""
    line = np.linspace(-1, 1, facets + 1)
    u, v = (a.ravel() for a in np.meshgrid(line, line))
    faces = [np.roll(np.stack([np.ones_like(u), u, v], axis=1), k, axis=1) for k in range(3)]
    points: Array = np.unique(np.concatenate(faces), axis=0)
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def apart(facets: int) -> float:
    """Greatest angle (rad) from any direction to the nearest of `directions`: half the diagonal of a square of the cube."""
    return math.sqrt(2) / facets
