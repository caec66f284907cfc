"""Workspaces of machines: where the platform centre can go, how it can lean at a place, and who covers more."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError, nearest
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.kinematics.report import joint_state_once, shortfall
from trivet.kinematics.standing import home_pose
from trivet.model import Machine
from trivet.model.elements import Beam, Curvilinear, Drivable, Offset
from trivet.reach.margins import travel_margin_on_grid
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.scene import scene_of
from trivet.reach.tilt import Looked, is_clear, turned
from trivet.reach.workspace import COARSE, Columns, Orientations, Region, columns, found_region, grown, joined, reached
from trivet.space.frame import Frame
from trivet.space.pose import tangent_axes, zyz_frame
from trivet.space.vector import Vec
from trivet.study.home import what_would
from trivet.study.machines import MachineLike, choose, pose_numbers
from trivet.study.tilt import require_clear_home

Array = NDArray[Any]

Kind = Literal["constant", "reachable", "total", "dexterous"]

KINDS: dict[Kind, str] = {
    "constant": "with one orientation",
    "reachable": "with some orientation of the cone",
    "total": "with every direction of the cone, each with some roll",
    "dexterous": "with every orientation whatever",
}

COUNT, CONE_COUNT, MOST_COLUMNS = 60, 24, 400
MOST_ORIENTATIONS = 100_000
MOST_POSES = 4_000_000_000
ROLL_STEP = math.radians(10.0)


@dataclass(frozen=True)
class WorkspaceReport:
    """Where the platform centre of a machine can go, in {O}."""

    machine: Machine
    mode: str
    kind: Kind
    orientations: Orientations
    with_bodies: bool
    columns: Columns
    part_from_home: float
    """Part of it that hangs together with the place of home, its orientation kept, on one side of every Type 2 singularity; NaN
    where that is not known: of many orientations, and of machines without six drives."""

    @property
    def volume_from_home(self) -> float:
        """m^3."""
        return self.part_from_home * self.volume

    @property
    def volume(self) -> float:
        """m^3."""
        return self.columns.volume

    @property
    def error(self) -> float:
        """Estimate of the volume's error, m^3."""
        return self.columns.error

    @property
    def boundary(self) -> Array:
        """(n, 3) where columns enter and leave the workspace, m."""
        found = []
        for k, (low, high) in enumerate(self.columns.spans):
            i, j = divmod(k, len(self.columns.y))
            found += [(self.columns.x[i], self.columns.y[j], z) for z in (*low, *high)]
        return np.array(found).reshape(-1, 3)

    @property
    def extent(self) -> tuple[Array, Array]:
        """Least and greatest coordinates of the boundary, (3,) each, m."""
        return self.boundary.min(axis=0), self.boundary.max(axis=0)


@dataclass(frozen=True)
class WorkspaceStudy:
    """Workspaces of several machines."""

    reports: tuple[WorkspaceReport, ...]
    missing: tuple[tuple[str, str], ...] = ()
    """Machines without a result, and why."""


@dataclass(frozen=True)
class OrientationReport:
    """How a machine can lean at one place."""

    machine: Machine
    mode: str
    position: tuple[float, float, float]
    """Platform centre in {O}, m."""
    azimuth: Array
    """(a,) rad."""
    cosine: Array
    """(b,) of the tilt, evenly from -1 to 1."""
    share: Array
    """(a, b) part of all rolls that are reached with this direction of the normal."""

    @property
    def solid_angle(self) -> float:
        """Of the directions that some roll reaches, sr; 4 pi are all."""
        return float(4 * np.pi * np.mean(self.share > 0))

    @property
    def solid_angle_error(self) -> float:
        """Estimate of its error, sr: half the greatest difference from what one direction in four tells."""
        parts = [4 * np.pi * np.mean(self.share[i::2, j::2] > 0) for i in (0, 1) for j in (0, 1)]
        return float(max(abs(part - self.solid_angle) for part in parts) / 2)

    @property
    def part_of_all(self) -> float:
        """Part of all orientations that are reached, by the measure which no rotation changes."""
        return float(np.mean(self.share))


def workspace(
    machine: MachineLike,
    kind: Kind = "constant",
    *,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    cone: float = math.radians(30.0),
    step: float = math.radians(10.0),
    neutral: Reference = "as-described",
    mode: str | None = None,
    bodies: bool = True,
    count: int | None = None,
    region: tuple[Sequence[float], Sequence[float]] | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> WorkspaceReport:
    """Where the platform centre of a machine can go.

    Args:
        machine: machine, name or file; with a closed form.
        kind: with one orientation, with some or with every direction of a cone, or with every orientation whatever.
        azimuth, tilt, roll: the one orientation (rad), that of home when not given; `roll` alone holds in a cone too, where any
            roll will do otherwise.
        cone: half the opening of the cone of directions about z, rad.
        step: between directions, rad; of rolls ten degrees.
        neutral: from what the stems of the platform's sockets deviate, see `trivet.reach.neutral`.
        mode: working mode; the machine's own when not given.
        bodies: whether bodies must stay apart.
        count: columns along x and along y, and samples in each; COUNT of one orientation, CONE_COUNT of many, when not given.
        region: least and greatest x, y, z (m) between which it is looked; all that the machine's size allows when not given.
        progress: called with how many slices of how many are done.

    Raises:
        InputError: for an unknown kind, or too few or too many columns.
        NoResultError: when no place is reached, or the machine collides at home.
    """
    if kind not in get_args(Kind):
        raise InputError(f"workspace '{kind}'{nearest(kind, get_args(Kind))}")
    count = (COUNT if kind == "constant" else CONE_COUNT) if count is None else count
    if not 4 <= count <= MOST_COLUMNS:
        raise InputError(f"columns: {count} along each axis; between 4 and {MOST_COLUMNS}")
    looked, chosen, signs = _looked(machine, neutral, mode, bodies)
    orientations = _orientations(chosen, kind, azimuth, tilt, roll, cone, step)
    many = max(count, COARSE[0]) ** 3 * orientations.rolls.size
    if many > MOST_POSES:
        raise InputError(
            f"{orientations.rolls.size:,} orientations at each of {max(count, COARSE[0])}^3 places; at most {MOST_POSES:.0e} "
            "poses, take wider steps or fewer columns"
        )
    inner: Literal["constant", "reachable", "total"] = "total" if kind == "dexterous" else kind
    within = partial(reached, looked, kind=inner, orientations=orientations)
    around = _around(chosen)
    home = np.array([float(c) for c in home_pose(chosen).origin])
    found = found_region(within, around, home) if region is None else _given(region)
    if found is None:
        miss = shortfall(chosen, joint_state_once(chosen, home_pose(chosen), signs))
        hint = (
            "choose other orientations, or say with --region where to look"
            if miss is None
            else f"at home {miss.reason}{what_would(chosen, signs)}"
        )
        raise NoResultError(f"{chosen.name}: no place is reached {KINDS[kind]}; {hint}")
    own = columns(within, grown(within, found, around, count) if region is None else found, count, progress)
    if not own.volume > 0:
        raise NoResultError(
            f"{chosen.name}: no place of the region is reached {KINDS[kind]}; look elsewhere, or with more columns"
        )
    part = math.nan
    if kind == "constant" and len(actuators(chosen)) == 6:
        axes = zyz_frame(np.zeros(3), *(float(angles.flat[0]) for angles in orientations))
        part = joined(looked, own, axes, home)
    return WorkspaceReport(chosen, mode_text(chosen, signs), kind, orientations, bodies, own, part)


def workspaces(
    machines: Sequence[MachineLike],
    kind: Kind = "constant",
    *,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
    **settings: Any,
) -> WorkspaceStudy:
    """`workspace` of several machines; those which reach nothing are told, not raised, unless there is one alone."""
    found, missing = [], []
    for machine in [choose(machine) for machine in machines]:
        try:
            found.append(workspace(machine, kind, progress=partial(progress, machine.name), **settings))
        except NoResultError as error:
            if len(machines) == 1:
                raise
            missing.append((machine.name, str(error)))
    if not found:
        raise NoResultError("; ".join(reason for _, reason in missing))
    return WorkspaceStudy(tuple(found), tuple(missing))


def orientation_workspace(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    *,
    neutral: Reference = "as-described",
    mode: str | None = None,
    bodies: bool = True,
    count: int = 60,
) -> OrientationReport:
    """How a machine can lean at one place of its platform centre.

    Args:
        machine, neutral, mode, bodies: as for `workspace`.
        position: in {O}, m; home when not given.
        count: azimuths, and tilts of equal solid angle; rolls are as many.

    Raises:
        InputError: for too few or too many directions.
        NoResultError: when no orientation is reached there, or the machine collides at home.
    """
    if not 4 <= count <= MOST_COLUMNS:
        raise InputError(f"directions: {count} each way; between 4 and {MOST_COLUMNS}")
    looked, chosen, signs = _looked(machine, neutral, mode, bodies)
    place, _ = pose_numbers(chosen, position, None, None, None)
    # Off the axes of symmetry, as a workspace's columns are.
    azimuths = 2 * np.pi * (np.arange(count) + 0.37) / count
    cosines = -1 + 2 * (np.arange(count) + 0.5) / count
    rolls = 2 * np.pi * np.arange(count) / count
    share = np.zeros((count, count))
    for i, azimuth in enumerate(azimuths):
        normal, x, y = tangent_axes(np.full(count, azimuth), np.arccos(cosines))
        frames = Frame(Vec(*(np.full(count, c) for c in place)), x, y, normal)
        share[i] = _share(looked, frames, rolls)
    if not np.any(share > 0):
        raise NoResultError(f"{chosen.name}: no orientation is reached with the platform centre at that place")
    return OrientationReport(chosen, mode_text(chosen, signs), place, azimuths, cosines, share)


def _share(looked: Looked, frames: Frame, rolls: Array) -> Array:
    """(n,) part of the rolls that are reached."""
    good = travel_margin_on_grid(looked.machine, frames, rolls, looked.signs) >= 0
    rows, columns = np.nonzero(good)
    good[rows, columns] = is_clear(looked, turned(frames, rows, rolls[columns]))
    found: Array = good.mean(axis=1)
    return found


def _looked(machine: MachineLike, neutral: Reference, mode: str | None, bodies: bool) -> tuple[Looked, Machine, Any]:
    plain = choose(machine)
    signs = closed_form_signs(plain, mode)
    chosen = with_neutral(plain, neutral, mode)
    if bodies:
        require_clear_home(chosen, signs)
    return Looked(chosen, signs, scene_of(chosen, with_workpiece=False) if bodies else None, None), chosen, signs


def _orientations(
    machine: Machine, kind: Kind, azimuth: float | None, tilt: float | None, roll: float | None, cone: float, step: float
) -> Orientations:
    if kind == "constant":
        _, angles = pose_numbers(machine, None, azimuth, tilt, roll)
        return Orientations.one(*angles)
    if azimuth is not None or tilt is not None:
        raise InputError("azimuth and tilt are those of a constant orientation; a cone has all azimuths and tilts")
    if not (step > 0 and 0 <= cone <= math.pi * (1 + 1e-12)):
        raise InputError(
            f"a cone of {math.degrees(cone):g} deg in steps of {math.degrees(step):g} deg; expected 0 to 180 deg, and a step"
        )
    if kind == "dexterous" and roll is not None:
        raise InputError("roll: a dexterous workspace is that of every roll")
    many = 4 * math.pi / step**2 * (1 if kind != "dexterous" else 2 * math.pi / ROLL_STEP)
    if many > MOST_ORIENTATIONS:
        raise InputError(
            f"a step of {math.degrees(step):g} deg makes some {many:.1g} orientations; at most {MOST_ORIENTATIONS:,}"
        )
    rolls = np.arange(0.0, 2 * math.pi - 1e-9, ROLL_STEP) if roll is None else np.array([roll])
    return Orientations.cone(math.pi, step, rolls).one_by_one() if kind == "dexterous" else Orientations.cone(cone, step, rolls)


def _given(region: tuple[Sequence[float], Sequence[float]]) -> Region:
    low, high = (np.asarray(part, dtype=float) for part in region)
    if low.shape != (3,) or high.shape != (3,):
        raise InputError("region: expected least x, y, z and greatest x, y, z")
    for axis, least, most in zip("xyz", low, high, strict=True):
        if not most > least:
            raise InputError(f"region: its greatest {axis}, {most * 1e3:g} mm, is not above the least, {least * 1e3:g} mm")
    return Region(low, high)


def _around(machine: Machine) -> Region:
    """All that the lengths of the longest chain allow."""
    longest = 0.0
    for leg in machine.legs:
        base = (
            0.0 if leg.chain.base is None else abs(float(leg.chain.base.radius or 0)) + abs(float(leg.chain.base.height or 0))
        )
        length = base + abs(float(leg.chain.platform_joint.radius)) + abs(float(leg.chain.platform_joint.height or 0))
        for element in leg.chain.elements:
            if isinstance(element, Curvilinear):
                length += float(element.radius)
            elif isinstance(element, Beam):
                length += float(element.length)
            elif isinstance(element, Offset):
                length += float(np.linalg.norm(element.vector))
            elif isinstance(element, Drivable) and not element.is_angular:
                length += max((abs(float(v)) for v in element.travel or (_home_size(machine),)), default=0.0)
        longest = max(longest, length)
    return Region(np.full(3, -longest), np.full(3, longest))


def _home_size(machine: Machine) -> float:
    """What a slide without travel is taken to be able to go."""
    return 2 * float(np.linalg.norm(np.asarray(machine.home.position, dtype=float)))
