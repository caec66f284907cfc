"""How far machines can tilt on a sphere, pose by pose and connected to home (paper section 3.1, Fig 3, Table 3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs, mode_text
from trivet.kinematics.report import joint_state_once, joint_states, shortfall
from trivet.kinematics.standing import home_pose
from trivet.model import Machine
from trivet.reach.margins import nearest_bodies, side, travel_margin
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.scene import Ball, scene_of
from trivet.reach.tilt import Grid, Looked, freest_roll, hanging_together, inside, is_clear, refined, sides_of, unbroken
from trivet.space.batches import in_batches
from trivet.space.frame import Angle, Frame
from trivet.space.pose import between, rolled, zyz_angles, zyz_frame
from trivet.space.vector import Vec
from trivet.study.home import what_would
from trivet.study.machines import MachineLike, choose

Array = NDArray[Any]

AZIMUTHS, ROLLS = 36, 180
STEP, MOST = math.radians(1.0), math.radians(180.0)
LARGEST_GRID = 50_000_000
"""Poses of a grid, at most: some thirty bytes each are held in memory."""
BEYOND = math.radians(0.02)
"""How far beyond the greatest tilt it is looked at what stops the machine."""
TOUCHING = 5e-5
"""Distance to spare (m) with which bodies are named beside a joint that stops a machine."""
WAY = 201
"""Poses on the way from home to the pole of the sphere that are looked at."""


@dataclass(frozen=True)
class TiltReport:
    """How far a machine can tilt on one sphere; angles in rad, arrays over a azimuths."""

    machine: Machine
    """With the neutral axes as they were taken."""
    mode: str
    neutral: Reference
    with_bodies: bool
    """Whether bodies had to stay apart."""
    is_solid: bool
    """Whether they had to stay clear of the sphere as well."""
    grid: Grid
    largest: Array
    """(a,) greatest tilt that is found with some roll, whatever lies below it; NaN for none."""
    unbroken: Array
    """(a,) tilt up to which every tilt is reached with some roll, refined between the grid's; NaN where the pole is not."""
    connected: Array
    """(a,) greatest tilt of the grid to which the machine comes from home; NaN for none."""
    connected_stops: list[str]
    """What stops it there, by azimuth."""
    rolls: Array
    """(a, b) roll with the greatest margin of travel; NaN where none reaches."""
    poses: int
    """Poses that were looked at."""
    apart: str
    """Why home does not hang together with the pole of the sphere; empty where it does."""

    @property
    def tilt(self) -> float:
        """The tilt which is reached at every azimuth, pose by pose."""
        return float(np.min(self.unbroken))

    @property
    def connected_tilt(self) -> float:
        """The tilt to which the machine comes from home at every azimuth."""
        return float(np.min(self.connected))

    @property
    def signs(self) -> Any:
        """Signs of the working mode."""
        return closed_form_signs(self.machine, self.mode)

    @cached_property
    def stops(self) -> list[str]:
        """What stops the machine just beyond the unbroken tilt, at the roll that comes nearest, by azimuth."""
        tilt = np.where(np.isfinite(self.unbroken), self.unbroken + BEYOND, 0.0)
        found = _faults(self.looked, self.grid.frames(self.grid.azimuths, tilt), self.grid.rolls)
        end = f"nothing, up to {math.degrees(self.grid.tilts[-1]):g} deg"
        return [end if own >= self.grid.tilts[-1] else fault for own, fault in zip(self.unbroken, found, strict=True)]

    @property
    def looked(self) -> Looked:
        """How the grid was looked at."""
        scene = scene_of(self.machine, with_workpiece=self.is_solid) if self.with_bodies else None
        return Looked(self.machine, self.signs, scene, ball_of(self.grid.centre, self.grid.radius))


@dataclass(frozen=True)
class TiltStudy:
    """Tilts of machines, spheres and neutral axes."""

    reports: tuple[TiltReport, ...]
    missing: tuple[tuple[str, Reference, float, float, str], ...] = ()
    """Cases without a result: machine, neutral axis, radius and height (m), and why."""


def ball_of(centre: Sequence[float], radius: float) -> Ball:
    """A sphere as something to run into."""
    return Ball(Vec(*(float(c) for c in centre)), radius)


def tilt(
    machine: MachineLike,
    radius: float | None = None,
    height: float | None = None,
    *,
    neutral: Reference = "as-described",
    mode: str | None = None,
    bodies: bool = True,
    solid: bool = False,
    azimuths: int = AZIMUTHS,
    step: float = STEP,
    most: float = MOST,
    rolls: int = ROLLS,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> TiltReport:
    """How far a machine can tilt while its platform centre touches a sphere and its platform lies tangent.

    Args:
        machine: machine, name or file; with a closed form.
        radius: of the sphere, m; that of the workpiece when not given.
        height: of its centre above {O}, on the z axis, m; that of the workpiece when not given.
        neutral: from what the stems of the platform's sockets deviate, see `trivet.reach.neutral`.
        mode: working mode; the machine's own when not given.
        bodies: whether bodies must stay apart.
        solid: whether they must stay clear of the sphere as well; else it is a place for the platform centre, and no thing.
        azimuths: directions of tilt, evenly all round.
        step, most: of the tilt, rad.
        rolls: at least so many rolls about the normal, evenly all round.
        progress: called with how many azimuths of how many are done.

    Raises:
        InputError: for a sphere without radius, a grid without poses or with too many.
        NoResultError: when the machine collides at home, or reaches no pose on the sphere; says what stops it.
    """
    plain = choose(machine)
    signs = closed_form_signs(plain, mode)
    radius, height = sphere_of(plain, radius, height)
    if solid and not bodies:
        raise InputError("a solid sphere is something that bodies stay clear of; look at bodies as well")
    _check_grid(azimuths, step, most, rolls)
    chosen = with_neutral(plain, neutral, mode)
    grid = Grid.of((0.0, 0.0, height), radius, azimuths, step, most, rolls)
    scene = scene_of(chosen, with_workpiece=solid) if bodies else None
    looked = Looked(chosen, signs, scene, ball_of(grid.centre, radius))
    if bodies:
        require_clear_home(chosen, signs)
    done = 0

    def told(count: int) -> None:
        nonlocal done
        done += count
        progress(done, azimuths)

    reached = inside(looked, grid, told)
    is_reached: Any = reached.roll >= 0
    if not np.any(is_reached):
        raise NoResultError(f"{chosen.name}: no pose on the {_sphere(radius, height)} is reached: {_why(looked, grid)}")
    start, apart = _from_home(looked, grid, reached.inside)
    connected, stops = np.full(azimuths, np.nan), [apart] * azimuths
    if not apart:
        sides = sides_of(looked, grid, reached.inside)
        joined = hanging_together(sides, start)
        last = _last(joined.any(axis=2))
        connected = np.append(grid.tilts, np.nan)[last]
        stops = [_end(looked, grid, grid.azimuths[k], sides[k], joined[k], int(last[k])) for k in range(azimuths)]
    edge = refined(looked, grid, unbroken(is_reached))
    return TiltReport(
        chosen,
        mode_text(chosen, signs),
        neutral,
        bodies,
        bodies and solid,
        grid,
        np.fmax(np.append(grid.tilts, np.nan)[_last(is_reached)], edge),
        edge,
        connected,
        stops,
        np.where(is_reached, grid.rolls[reached.roll], np.nan),
        is_reached.size * len(grid.rolls),
        apart,
    )


def _end(looked: Looked, grid: Grid, azimuth: float, sides: Array, joined: Array, last: int) -> str:
    """What ends the ways from home at one azimuth: sides and joined (b, c)."""
    if last < 0:
        return "no pose at this azimuth hangs together with home"
    if last == len(grid.tilts) - 1:
        return f"nothing, up to {math.degrees(grid.tilts[-1]):g} deg"
    near = joined[last] | np.roll(joined[last], 1) | np.roll(joined[last], -1)
    if np.any(sides[last + 1, near]):
        return "a Type 2 singularity"
    return _faults(looked, grid.frames(np.full(1, azimuth), grid.tilts[last + 1 : last + 2]), grid.rolls)[0]


def _faults(looked: Looked, frames: Frame, rolls: Array) -> list[str]:
    """What is wrong with frames (n,), at the roll, of these or between, at which they are freest."""
    best, _ = freest_roll(looked, frames, rolls)
    poses = rolled(frames, Angle(np.cos(best), np.sin(best)))
    states = in_batches(lambda part: joint_states(looked.machine, part, looked.signs), poses)
    names, gaps = [("", "")] * len(best), np.full(len(best), np.inf)
    if looked.scene is not None:
        names, gaps = nearest_bodies(looked.machine, looked.scene, poses, looked.signs, looked.workpiece)
    least = float(looked.machine.apart.clearance)
    found = []
    for k, (pair, gap) in enumerate(zip(names, gaps, strict=True)):
        miss = shortfall(looked.machine, states, k)
        parts = [miss.reason] if miss is not None else []
        if gap < least + TOUCHING:
            parts.append(f"{pair[0]} and {pair[1]} are {gap * 1e3:.3g} mm apart, {least * 1e3:g} mm is the least")
        found.append(", and ".join(parts) or "a window of rolls narrower than is looked for")
    return found


def tilts(
    machines: Sequence[MachineLike],
    radii: Sequence[float | None] = (None,),
    heights: Sequence[float | None] = (None,),
    neutrals: Sequence[Reference] = ("as-described",),
    *,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
    **settings: Any,
) -> TiltStudy:
    """`tilt` of every machine on every sphere with every neutral axis; cases which reach nothing are told, not raised."""
    found, missing = [], []
    chosen = [choose(machine) for machine in machines]
    cases = [(m, n, r, h) for m in chosen for n in neutrals for h in heights for r in radii]
    for k, (machine, neutral, radius, height) in enumerate(cases):
        told = partial(progress, f"{k + 1} of {len(cases)}")
        try:
            found.append(tilt(machine, radius, height, neutral=neutral, progress=told, **settings))
        except NoResultError as error:
            if len(cases) == 1:
                raise
            missing.append((machine.name, neutral, *sphere_of(machine, radius, height), str(error)))
    if not found:
        raise NoResultError(f"none of {len(cases)} cases has a result; the first: {missing[0][-1]}")
    return TiltStudy(tuple(found), tuple(missing))


def sphere_of(machine: Machine, radius: float | None, height: float | None) -> tuple[float, float]:
    """Radius and height of a sphere (m), those of the workpiece where they are not given.

    Raises:
        InputError: when there is no workpiece, or no radius.
    """
    if (radius is None or height is None) and machine.workpiece is None:
        raise InputError(f"{machine.name}: has no [workpiece]; give radius and height of the sphere")
    found = machine.workpiece.radius if radius is None else radius  # type: ignore[union-attr]
    if not (found > 0 and math.isfinite(found)):
        raise InputError(f"radius of the sphere: {found * 1e3:g} mm; must be greater than zero")
    return float(found), float(machine.workpiece.height if height is None else height)  # type: ignore[union-attr]


def require_clear_home(machine: Machine, signs: Any) -> None:
    """Raise NoResultError, naming the pair, when bodies touch at home."""
    scene = scene_of(machine, with_workpiece=False)
    home = Frame(*(Vec(*(np.atleast_1d(c) for c in v)) for v in home_pose(machine)))
    names, gaps = nearest_bodies(machine, scene, home, signs, None)
    least = float(machine.apart.clearance)
    if gaps[0] < least:
        raise NoResultError(
            f"{machine.name}: at home {names[0][0]} and {names[0][1]} are {gaps[0] * 1e3:.3g} mm apart, {least * 1e3:g} mm is "
            f'the least; if they may touch, add ["{names[0][0]}", "{names[0][1]}"] to interference.may_touch'
        )


def _check_grid(azimuths: int, step: float, most: float, rolls: int) -> None:
    if not (3 <= azimuths <= LARGEST_GRID and 3 <= rolls <= LARGEST_GRID):
        raise InputError(f"{azimuths:.3g} azimuths and {rolls:.3g} rolls; from 3 to {LARGEST_GRID:.0e} of each")
    if not 0 < step <= most <= math.pi * (1 + 1e-12):
        raise InputError(
            f"tilts from 0 to {math.degrees(most):g} deg in steps of {math.degrees(step):g} deg; expected a step above zero "
            "and not above the greatest tilt, which is at most 180 deg"
        )
    count = azimuths * (most / step + 1) * max(rolls, azimuths)
    if count > LARGEST_GRID:
        raise InputError(f"a grid of {count:.2g} poses; at most {LARGEST_GRID:.0e}")


def _last(reached: Any) -> Any:
    """(a,) the last index of each row (a, b) that is set; -1 for none."""
    return np.where(reached.any(axis=1), reached.shape[1] - 1 - reached[:, ::-1].argmax(axis=1), -1)


def _sphere(radius: float, height: float) -> str:
    return f"sphere of {radius * 1e3:g} mm about z0 = {height * 1e3:g} mm"


def _why(looked: Looked, grid: Grid) -> str:
    """What keeps the machine from the pole of a sphere, at the roll that comes nearest."""
    return f"at its pole {_faults(looked, grid.frames(np.zeros(1), np.zeros(1)), grid.rolls)[0]}"


def _from_home(looked: Looked, grid: Grid, reached: Array) -> tuple[int, str]:
    """The roll (an index) at the pole, azimuth 0, to which a straight way leads from home, and why none does."""
    home = home_pose(looked.machine)
    alpha, _, gamma = (float(a) for a in zyz_angles(home))
    nearest = int(np.argmax(np.cos(grid.rolls - (alpha + gamma))))
    x, y, z = grid.centre
    end = zyz_frame((x, y, z + grid.radius), 0.0, 0.0, grid.rolls[nearest])
    miss = shortfall(looked.machine, joint_state_once(looked.machine, home, looked.signs))
    if miss is not None:
        return nearest, f"home itself is not reached, {miss.reason}{what_would(looked.machine, looked.signs)}"
    if len(actuators(looked.machine)) != 6:
        return nearest, "singularities are told of machines with six drives"
    if not reached[0, 0, nearest]:
        return nearest, "the pole is not reached with the roll of home"
    way = between(home, end, np.linspace(0.0, 1.0, WAY))
    if not np.all(travel_margin(looked.machine, way, looked.signs) >= 0):
        return nearest, "a joint leaves its travel on the straight way from home to the pole"
    # The sphere is not in the way: home may lie within it, and the platform comes down to it.
    scene = None if looked.scene is None else scene_of(looked.machine, with_workpiece=False)
    if not np.all(is_clear(looked._replace(scene=scene, workpiece=None), way)):
        return nearest, "bodies touch on the straight way from home to the pole"
    sides = side(looked.machine, way, looked.signs)
    if not np.all(sides == sides[0]):
        return nearest, "a Type 2 singularity lies on the straight way from home to the pole"
    return nearest, ""
