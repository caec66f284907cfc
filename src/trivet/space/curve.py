"""Curves of poses: straight moves, smooth ways through several poses, circles; and how they are run through in time.

A curve is given over a parameter s from 0 to 1 with its first two derivatives; of the turn these are the angular velocity omega
per unit of s, in {O}, and its derivative.  A `TimeLaw` makes s a function of time with bounded speed, acceleration and jerk.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError
from trivet.space.frame import Frame
from trivet.space.screw import Twist
from trivet.space.vector import Vec

Array = NDArray[Any]

SAMPLES = 10_000
"""Places of a curve, and times of a motion, at which limits are looked at."""

FEW = 400
"""The same while the fastest law is searched for."""

LONGEST = 1e6
"""Duration (s) of a motion, at most."""

SPARE = 1e-3
"""By how much a bent way is run through slower than the samples ask for: peaks lie between them."""


class Course(NamedTuple):
    """A curve of poses at parameters s (n,)."""

    position: Array
    """(n, 3), m."""
    slope: Array
    """(n, 3): derivative of the position, m."""
    bend: Array
    """(n, 3): second derivative, m."""
    axes: Array
    """(n, 3, 3): columns are the platform's axes."""
    turn: Array
    """(n, 3): angular velocity per unit of s, rad."""
    swing: Array
    """(n, 3): its derivative, rad."""


@dataclass(frozen=True)
class Curve:
    """A curve of poses."""

    course: Callable[[Array], Course]
    """Of parameters s (n,) in [0, 1]."""
    knots: tuple[float, ...] = ()
    """Parameters inside, at which the second derivatives have kinks."""
    is_straight: bool = False
    """Whether there are no second derivatives."""

    def __call__(self, s: Array) -> Course:
        return self.course(s)


def straight(start: Frame, end: Frame) -> Curve:
    """From one pose to another: the centre along a line, the platform about one axis."""
    from scipy.spatial.transform import Rotation

    first, last = _place(start), _place(end)
    axes = Rotation.from_matrix(_axes(start))
    arc = (Rotation.from_matrix(_axes(end)) * axes.inv()).as_rotvec()

    def at(s: Array) -> Course:
        still = np.zeros((len(s), 3))
        turned = (Rotation.from_rotvec(np.multiply.outer(s, arc)) * axes).as_matrix()
        return Course(first + np.multiply.outer(s, last - first), still + last - first, still, turned, still + arc, still)

    return Curve(at, is_straight=True)


def through(poses: Sequence[Frame], length: float) -> Curve:
    """A smooth way through several poses, with two continuous derivatives: cubic splines, of rotation vectors for the turns.

    Parameters are spread by the root of the distance (E. T. Y. Lee, Choosing nodes in parametric curve interpolation,
    Computer-Aided Design 21, 1989): poses that lie close together make other ways swing out.

    Args:
        poses: at least two, each another than the one before.
        length: by which turns are compared with distances (m).

    Raises:
        InputError: when a pose is that before it.
    """
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    if len(poses) == 2:
        return straight(*poses)
    turns = Rotation.from_matrix(np.stack([_axes(pose) for pose in poses]))
    places = np.stack([_place(pose) for pose in poses])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1) + length * (turns[1:] * turns[:-1].inv()).magnitude()
    for k, step in enumerate(steps):
        if not step > 1e-9 * length:
            raise InputError(f"poses: the pose {k + 2} of the path is where the pose {k + 1} is; leave one of them out")
    knots = np.concatenate([[0.0], np.cumsum(np.sqrt(steps))]) / np.sqrt(steps).sum()
    if not np.diff(knots).min() > 1e-9:
        k = int(np.argmin(np.diff(knots)))
        raise InputError(f"poses: the pose {k + 2} is too near to the pose {k + 1} for a path of {steps.sum():.3g} m")
    way, turning = CubicSpline(knots, places, bc_type="natural"), RotationSpline(knots, turns)

    def at(s: Array) -> Course:
        turned = turning(s)
        # The spline tells rates in the axes of the platform.
        rates = turned.apply(turning(s, 1)), turned.apply(turning(s, 2))
        return Course(way(s), way(s, 1), way(s, 2), turned.as_matrix(), *rates)

    return Curve(at, tuple(knots[1:-1].tolist()))


def circle(start: Frame, radius: float) -> Curve:
    """Once round a level circle of the platform centre, against the clock seen from above; starts at its +x side.

    Args:
        start: the pose in the middle of the circle; the platform stays parallel to it.
        radius: m.
    """
    middle, axes = _place(start), _axes(start)

    def at(s: Array) -> Course:
        angle, still = 2 * math.pi * s, np.zeros((len(s), 3))
        out = radius * np.stack([np.cos(angle), np.sin(angle), 0 * s], axis=1)
        along = 2 * math.pi * np.stack([-out[:, 1], out[:, 0], 0 * s], axis=1)
        return Course(middle + out, along, -((2 * math.pi) ** 2) * out, np.broadcast_to(axes, (len(s), 3, 3)), still, still)

    return Curve(at)


@dataclass(frozen=True)
class Limits:
    """How fast the platform may move: its centre, and its turning."""

    speed: float = 0.1
    """m/s."""
    acceleration: float = 1.0
    """m/s^2."""
    jerk: float = 50.0
    """m/s^3."""
    angular_speed: float = 1.0
    """rad/s."""
    angular_acceleration: float = 10.0
    """rad/s^2."""
    angular_jerk: float = 500.0
    """rad/s^3."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (value > 0 and math.isfinite(value)):
                raise InputError(f"{field.name.replace('_', ' ')}: {value:g} is no limit; it must be greater than zero")

    @property
    def pairs(self) -> tuple[tuple[float, float], ...]:
        """Of the centre and of the turning: speed, acceleration, jerk."""
        return (
            (self.speed, self.angular_speed),
            (self.acceleration, self.angular_acceleration),
            (self.jerk, self.angular_jerk),
        )


class Moving(NamedTuple):
    """A motion at times (n,)."""

    time: Array
    """(n,), s."""
    pose: Frame
    """Components (n,), m."""
    twist: Twist
    """Of the centre, in {O}; m/s and rad/s."""
    acceleration: Twist
    """Its time derivative; m/s^2 and rad/s^2."""


@dataclass(frozen=True)
class Trajectory:
    """Curves that are run through one after the other, each from rest to rest."""

    laws: tuple[TimeLaw, ...]

    @property
    def duration(self) -> float:
        """s."""
        return sum(law.duration for law in self.laws)

    def times(self, samples: int) -> Array:
        """Equally spaced times over the motion, and those at which its jerk changes: there accelerations have their peaks."""
        ends = np.cumsum([0.0, *(law.duration for law in self.laws)])
        switches = [start + law.switches for start, law in zip(ends[:-1], self.laws, strict=True)]
        found = np.unique(np.concatenate([np.linspace(0.0, ends[-1], samples), *switches]))
        # Rounding makes two times of one.
        apart = np.diff(found, prepend=-1.0) > 1e-9 * ends[-1]
        return np.minimum(found[apart], ends[-1])

    def at(self, time: Array) -> Moving:
        """The motion at times (n,); at rest before its beginning and after its end."""
        ends = np.cumsum([law.duration for law in self.laws])
        which = np.minimum(np.searchsorted(ends, time), len(self.laws) - 1)
        found = np.zeros((len(time), 24))
        for k, law in enumerate(self.laws):
            own = which == k
            if np.any(own):
                found[own] = law.at(time[own] - (ends[k] - law.duration))
        columns = [Vec(*found[:, i : i + 3].T) for i in range(0, 24, 3)]
        return Moving(time, Frame(*columns[:4]), Twist(*columns[4:6]), Twist(*columns[6:]))


@dataclass(frozen=True)
class TimeLaw:
    """A curve in time, from rest to rest."""

    curve: Curve
    law: Any
    """s of time: what `at_time(t)` gives, with its first two derivatives."""
    stretch: float
    """Factor by which it is slower."""

    @property
    def duration(self) -> float:
        """s."""
        return float(self.law.duration) * self.stretch

    @cached_property
    def switches(self) -> Array:
        """Times at which the jerk jumps, s: where the law changes it, and at the knots of the curve."""
        own = np.cumsum(self.law.profiles[0][0].t)
        passed = [self.law.get_first_time_at_position(0, s) for s in self.curve.knots]
        return np.unique([*own, *(t for t in passed if t is not None)]) * self.stretch

    def at(self, time: Array) -> Array:
        """(n, 24): position, three axes, velocity, angular velocity, and their derivatives."""
        inside = np.clip(time / self.stretch, 0.0, self.law.duration)
        s, rate, rise = np.array([np.ravel(self.law.at_time(t)) for t in inside.tolist()]).reshape(-1, 3).T
        rate, rise = (rate / self.stretch)[:, None], (rise / self.stretch**2)[:, None]
        course = self.curve(np.clip(s, 0.0, 1.0))
        axes = np.swapaxes(course.axes, 1, 2).reshape(-1, 9)
        velocity = course.slope * rate, course.turn * rate
        growth = course.bend * rate**2 + course.slope * rise, course.swing * rate**2 + course.turn * rise
        return np.hstack([course.position, axes, *velocity, *growth])


def timed(curves: Sequence[Curve], limits: Limits, duration: float | None = None) -> Trajectory:
    """Curves run through as fast as limits allow: rest to rest, with bounded jerk.

    Args:
        curves: one after the other.
        limits: of the platform's motion.
        duration: of the whole motion (s), if it is to take longer than it must.

    Raises:
        InputError: when a curve has no extent, or the duration is shorter than the limits allow.
    """
    motion = Trajectory(tuple(_fastest(curve, limits) for curve in curves))
    if duration is None:
        return motion
    least = motion.duration
    if not duration <= LONGEST:
        raise InputError(f"duration: {duration:g} s; at most {LONGEST:g} s")
    if not duration >= least * (1 - 1e-9):
        raise InputError(f"duration: {duration:g} s is too short; within its limits the motion takes {least:.4g} s")
    longer = duration / least
    return Trajectory(tuple(TimeLaw(law.curve, law.law, law.stretch * longer) for law in motion.laws))


def _fastest(curve: Curve, limits: Limits) -> TimeLaw:
    """The fastest of the laws that are Ruckig's for some speed and acceleration, as a whole as slow as the limits ask for."""
    from scipy.optimize import minimize

    course = curve(np.linspace(0.0, 1.0, 2 if curve.is_straight else SAMPLES))
    sizes = np.linalg.norm(course.slope, axis=1).max(), np.linalg.norm(course.turn, axis=1).max()
    if not max(sizes) > 1e-12:
        raise InputError("the path has no extent; give another pose to go to")
    bounds = [min(limit / size for limit, size in zip(pair, sizes, strict=True) if size > 1e-12) for pair in limits.pairs]
    if curve.is_straight:
        return TimeLaw(curve, _rest_to_rest(*bounds), 1.0)  # exact on a straight way

    # Greater ones than these are not reached on a way of length 1.
    reached = min(bounds[0], math.sqrt(bounds[1]), math.cbrt(bounds[2])), min(bounds[1], math.cbrt(bounds[2]) ** 2)

    def within(lower: Array, samples: int) -> TimeLaw:
        """A law for speeds and accelerations lower by these powers of two, as slow as a whole as fits."""
        law = TimeLaw(curve, _rest_to_rest(*np.array([*(np.exp2(-np.abs(lower)) * reached), bounds[2]])), 1.0)
        return TimeLaw(curve, law.law, _excess(law, limits, samples) * (1 + SPARE))

    # Where the way bends, speed costs acceleration: a law that is too fast must be slowed down as a whole.
    starts = [np.array([a, b]) for a in (0.0, 0.5, 1.0, 2.0, 4.0) for b in (0.0, 0.5, 1.0)]
    start = min(starts, key=lambda lower: within(lower, FEW).duration)
    found = minimize(lambda lower: within(lower, FEW).duration, start, method="Nelder-Mead", options={"maxfev": 60})
    return within(found.x, SAMPLES)


def _excess(law: TimeLaw, limits: Limits, samples: int) -> float:
    """By what factor a law must be slower than it is, to be within limits at some samples."""
    # Jerks jump: they are looked at on either side of every switch, over a time in which nothing else changes.
    short = 1e-6 * law.duration
    times = np.concatenate([np.linspace(0.0, law.duration, samples), law.switches - 2 * short, law.switches + 2 * short])
    times = np.clip(times, short, law.duration - short)
    found = law.at(times)
    jerk = (law.at(times + short)[:, 18:] - law.at(times - short)[:, 18:]) / (2 * short)
    excess = 0.0
    for order, (values, pair) in enumerate(zip((found[:, 12:18], found[:, 18:], jerk), limits.pairs, strict=True), start=1):
        for limit, part in zip(pair, (values[:, :3], values[:, 3:]), strict=True):
            excess = max(excess, (np.linalg.norm(part, axis=1).max() / limit) ** (1 / order))
    return excess


def _rest_to_rest(speed: float, acceleration: float, jerk: float) -> Any:
    """The fastest law from 0 to 1 (L. Berscheid and T. Kroeger, Jerk-limited real-time trajectory generation, RSS 2021)."""
    from ruckig import InputParameter, Ruckig
    from ruckig import Trajectory as Law

    if not all(1e-12 < bound < 1e12 for bound in (speed, acceleration, jerk)):
        raise InputError("limits: they and the length of the path are too many orders of magnitude apart")
    wanted = InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [1.0]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [speed], [acceleration], [jerk]
    law = Law(1)
    Ruckig(1).calculate(wanted, law)
    return law


def _place(pose: Frame) -> Array:
    return np.array(pose.origin, dtype=float)


def _axes(pose: Frame) -> Array:
    return np.array(pose.matrix(), dtype=float)
