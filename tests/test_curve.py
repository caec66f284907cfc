"""Curves of poses and their laws of time: derivatives, limits, rest at the ends, and what cannot be run through; path files."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from trivet.errors import InputError
from trivet.space.curve import SAMPLES, Curve, Limits, Moving, Trajectory, circle, straight, through, timed
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.study.pathfile import read_path

START = zyz_frame((0.01, -0.02, 0.1), 0.3, 0.2, -0.4)
END = zyz_frame((-0.03, 0.04, 0.15), -1.1, 0.7, 1.9)
PASSED = (
    START,
    zyz_frame((0.0, 0.02, 0.13), 0.9, 0.5, -0.2),
    zyz_frame((-0.02, 0.01, 0.12), 1.4, 0.3, 0.3),
    zyz_frame((-0.01, 0.05, 0.16), 0.2, 0.6, 0.1),
    zyz_frame((0.03, 0.03, 0.14), -0.5, 0.1, 0.8),
    zyz_frame((0.02, -0.01, 0.11), 0.1, 0.4, 0.2),
    END,
)
CURVES: dict[str, Curve] = {
    "straight": straight(START, END),
    "through two": through([START, END], 0.05),
    "through three": through(PASSED[:3], 0.05),
    "through seven": through(PASSED, 0.05),
    "circle": circle(START, 0.03),
    "only the turn": straight(START, zyz_frame((0.01, -0.02, 0.1), 0.9, 0.6, 0.1)),
    "only the centre": straight(START, zyz_frame((0.05, 0.03, 0.2), 0.3, 0.2, -0.4)),
    "half a turn": straight(zyz_frame((0, 0, 0.1), 0, 0, 0), zyz_frame((0, 0, 0.1), 0, math.pi, 0)),
}
LIMITS = {
    "as they are": Limits(),
    "slow": Limits(speed=0.01, angular_speed=0.2),
    "soft": Limits(acceleration=0.2, angular_acceleration=1.0),
    "smooth": Limits(jerk=0.5, angular_jerk=4.0),
    "hardly a turn": Limits(
        speed=10.0, acceleration=100.0, jerk=1e4, angular_speed=0.3, angular_acceleration=2.0, angular_jerk=9.0
    ),
    "hardly a way": Limits(0.02, 0.1, 0.9, 100.0, 1e3, 1e5),
}


@cache
def run(name: str, limits: str = "as they are") -> Trajectory:
    return timed([CURVES[name]], LIMITS[limits])


def columns(moving: Moving) -> tuple[np.ndarray, ...]:
    """Of a motion (n, 3) each: position, velocity, angular velocity, acceleration, angular acceleration."""
    parts = moving.pose.origin, *moving.twist, *moving.acceleration
    return tuple(np.stack(list(part), axis=1) for part in parts)


def axes_of(pose: Frame) -> np.ndarray:
    """(n, 3, 3): columns are the platform's axes."""
    return np.stack([np.stack([np.broadcast_to(c, np.shape(pose.z.z)) for c in v], axis=-1) for v in pose[1:]], axis=-1)


def spin(before: np.ndarray, after: np.ndarray, step: float) -> np.ndarray:
    """Angular velocity (n, 3) from the axes a step apart."""
    w = np.einsum("nij,nkj->nik", after - before, (before + after) / 2) / step
    return np.stack([w[:, 2, 1] - w[:, 1, 2], w[:, 0, 2] - w[:, 2, 0], w[:, 1, 0] - w[:, 0, 1]], axis=1) / 2


@pytest.mark.parametrize("name", CURVES)
def test_derivatives_are_those_of_the_pose(name: str) -> None:
    curve, step, s = CURVES[name], 1e-5, np.linspace(0.02, 0.98, 31)
    here, before, after = curve(s), curve(s - step), curve(s + step)
    np.testing.assert_allclose(here.axes @ np.swapaxes(here.axes, 1, 2), np.broadcast_to(np.eye(3), (31, 3, 3)), atol=1e-12)
    for value, slope in (("position", "slope"), ("slope", "bend"), ("turn", "swing")):
        found = (getattr(after, value) - getattr(before, value)) / (2 * step)
        size = max(1.0, float(np.abs(getattr(here, slope)).max()))
        np.testing.assert_allclose(getattr(here, slope), found, rtol=0, atol=1e-6 * size, err_msg=slope)
    size = max(1.0, float(np.abs(here.turn).max()))
    np.testing.assert_allclose(here.turn, spin(before.axes, after.axes, 2 * step), rtol=0, atol=1e-6 * size)


def test_smooth_ways_pass_their_poses() -> None:
    """Each pose is met where the root of its share of the way (turns as arcs of the length) says."""
    steps = []
    for one, two in pairwise(PASSED):
        turn = np.array(two.matrix()) @ np.array(one.matrix()).T
        angle = math.acos((np.trace(turn) - 1) / 2)
        steps.append(math.sqrt(float(np.linalg.norm(np.subtract(two.origin, one.origin))) + 0.05 * angle))
    course = CURVES["through seven"](np.concatenate([[0.0], np.cumsum(steps)]) / sum(steps))
    np.testing.assert_allclose(course.position, [pose.origin for pose in PASSED], rtol=0, atol=1e-12)
    np.testing.assert_allclose(course.axes, [pose.matrix() for pose in PASSED], rtol=0, atol=1e-12)


@pytest.mark.parametrize(("first", "second"), [(170, -170), (-100, -80), (80, 100)])
def test_turns_go_the_short_way(first: float, second: float) -> None:
    """Here by 20 degrees: a rotation has two quaternions, one of them the long way round."""
    poses = [zyz_frame((0, 0, 0.1), 0, 0, math.radians(angle)) for angle in (first, second)]
    for curve in (straight(*poses), through(poses, 0.1)):
        turn = curve(np.linspace(0, 1, 5)).turn
        np.testing.assert_allclose(turn[:, 2], math.radians(20), rtol=2e-2)
        np.testing.assert_allclose(turn[:, :2], 0, atol=1e-12)


def test_circle_goes_round_the_pose() -> None:
    course = CURVES["circle"](np.linspace(0, 1, 41))
    out = course.position - np.array(START.origin)
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 0.03, rtol=1e-12)
    np.testing.assert_allclose(out[[0, 10, 20, 40]], 0.03 * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]]), atol=1e-15)
    np.testing.assert_array_equal(course.axes, np.broadcast_to(np.array(START.matrix()), (41, 3, 3)))


@pytest.mark.parametrize(
    ("name", "limits"),
    [
        *((name, "as they are") for name in CURVES),
        *(("straight", limits) for limits in LIMITS if limits != "as they are"),
        *(("through seven", limits) for limits in LIMITS if limits != "as they are"),
        ("only the turn", "smooth"),
        ("only the centre", "hardly a turn"),
    ],
)
def test_limits_are_kept_and_used(name: str, limits: str) -> None:
    """Looked at ten times finer than the code does; one limit at least is reached, or the law could be faster."""
    motion, bounds = run(name, limits), LIMITS[limits]
    times = np.linspace(0, motion.duration, 10 * SAMPLES)
    _, velocity, spins, rise, swing = columns(motion.at(times))
    jerk, snap = (np.diff(part, axis=0) / np.diff(times)[:, None] for part in (rise, swing))
    used = []
    for parts, pair in zip(((velocity, spins), (rise, swing), (jerk, snap)), bounds.pairs, strict=True):
        for part, limit in zip(parts, pair, strict=True):
            used.append(float(np.linalg.norm(part, axis=1).max()) / limit)
            assert used[-1] < 1 + 1e-6
    # Slowed by the spare, which counts three times in a jerk.
    assert max(used) > 1 - 4e-3


def test_looser_limits_are_no_slower() -> None:
    ring, last = circle(zyz_frame((0, 0, 0.12), 0, 0, 0), 0.003), np.inf
    for speed in (0.04, 0.05, 0.06, 0.08, 0.1, 0.2, 1.0, 10.0):
        duration = timed([ring], Limits(speed=speed)).duration
        assert duration < last * (1 + 1e-4)
        last = duration


def test_smooth_ways_hardly_leave_poses_that_lie_close() -> None:
    """A corner refined: its way is not longer than the corner by more than a few percent, at any distance of the poses."""
    for near in (1e-4, 1e-5, 1e-6):
        corners = [(0, 0), (3e-3 - near, 0), (3e-3, 0), (3e-3, near), (3e-3, 3e-3), (0, 3e-3)]
        course = through([zyz_frame((x, y, 0.12), 0, 0, 0) for x, y in corners], 0.05)(np.linspace(0, 1, 20_001))
        assert np.linalg.norm(np.diff(course.position, axis=0), axis=1).sum() < 1.06 * 9e-3


@pytest.mark.parametrize("name", CURVES)
def test_from_rest_to_rest_at_the_poses(name: str) -> None:
    motion, ends = run(name), CURVES[name](np.array([0.0, 1.0]))
    found = motion.at(np.array([-1.0, 0.0, motion.duration, motion.duration + 1.0]))
    for part in columns(found)[1:]:
        np.testing.assert_allclose(part, 0, atol=1e-9)
    np.testing.assert_allclose(columns(found)[0], ends.position[[0, 0, 1, 1]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(axes_of(found.pose), ends.axes[[0, 0, 1, 1]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_rates_in_time_are_those_of_the_pose(name: str) -> None:
    motion, rng = run(name), np.random.default_rng(3)
    step = 1e-6 * motion.duration
    times = np.sort(rng.uniform(0.01, 0.99, 40)) * motion.duration
    times = times[np.abs(times[:, None] - motion.laws[0].switches).min(axis=1) > 2 * step]
    before, here, after = (motion.at(times + side * step) for side in (-1, 0, 1))
    (p0, v0, w0, *_), (_, v, w, a, b), (p1, v1, w1, *_) = (columns(part) for part in (before, here, after))
    np.testing.assert_allclose(v, (p1 - p0) / (2 * step), rtol=0, atol=1e-8)
    np.testing.assert_allclose(w, spin(axes_of(before.pose), axes_of(after.pose), 2 * step), rtol=0, atol=1e-8)
    np.testing.assert_allclose(a, (v1 - v0) / (2 * step), rtol=0, atol=1e-6)
    np.testing.assert_allclose(b, (w1 - w0) / (2 * step), rtol=0, atol=1e-6)


def test_a_long_straight_way_takes_what_the_textbook_says() -> None:
    """With all three limits reached: way / speed + speed / acceleration + acceleration / jerk."""
    limits = Limits(speed=0.05, acceleration=0.4, jerk=8.0)
    way = straight(zyz_frame((0, 0, 0.1), 0, 0, 0), zyz_frame((0.06, 0, 0.18), 0, 0, 0))
    assert timed([way], limits).duration == pytest.approx(0.1 / 0.05 + 0.05 / 0.4 + 0.4 / 8.0, rel=1e-9)


def test_longer_durations_stretch_the_motion() -> None:
    short, curves = run("through seven"), [CURVES["through seven"]]
    long = timed(curves, Limits(), 3 * short.duration)
    assert long.duration == pytest.approx(3 * short.duration, rel=1e-12)
    times = np.linspace(0, short.duration, 50)
    for k, order in enumerate((0, 1, 1, 2, 2)):
        theirs = columns(long.at(3 * times))[k] * 3.0**order
        np.testing.assert_allclose(theirs, columns(short.at(times))[k], rtol=0, atol=1e-10)


def corners(duration: float | None = None) -> Trajectory:
    ways = [straight(one, two) for one, two in pairwise(PASSED[:4])]
    return timed(ways, Limits(), duration)


@pytest.mark.parametrize("duration", [None, 5.0])
def test_it_stops_at_corners(duration: float | None) -> None:
    motion = corners(duration)
    ends = np.cumsum([0.0, *(law.duration for law in motion.laws)])
    assert ends[-1] == pytest.approx(motion.duration if duration is None else duration, rel=1e-12)
    for side in (-1e-9, 0.0, 1e-9):
        found = motion.at(ends + side)
        for part in columns(found)[1:]:
            np.testing.assert_allclose(part, 0, atol=1e-6)
        np.testing.assert_allclose(columns(found)[0], [pose.origin for pose in PASSED[:4]], rtol=0, atol=1e-12)
        np.testing.assert_allclose(axes_of(found.pose), [pose.matrix() for pose in PASSED[:4]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("samples", [2, 50, 1001])
@pytest.mark.parametrize("name", [*CURVES, "corners"])
def test_times_hold_the_ends_and_where_the_jerk_changes(name: str, samples: int) -> None:
    motion = corners() if name == "corners" else run(name)
    times = motion.times(samples)
    assert np.all(np.diff(times) > 1e-10 * motion.duration)
    assert times[0] == 0
    assert times[-1] == pytest.approx(motion.duration, rel=1e-12)
    assert times[-1] <= motion.duration * (1 + 1e-15)
    starts = np.cumsum([0.0, *(law.duration for law in motion.laws)])
    wanted = np.concatenate(
        [np.linspace(0, motion.duration, samples), *(a + law.switches for a, law in zip(starts, motion.laws, strict=False))]
    )
    assert np.abs(wanted[:, None] - times).min(axis=1).max() < 2e-9 * motion.duration
    # Between them the jerk of the way is steady: the acceleration of s is linear in time.
    middle, rise = (times[1:] + times[:-1]) / 2, columns(motion.at(times))[3]
    if name == "only the centre":
        np.testing.assert_allclose(columns(motion.at(middle))[3], (rise[1:] + rise[:-1]) / 2, rtol=0, atol=1e-8)


def test_errors() -> None:
    with pytest.raises(InputError, match=r"the pose 3 of the path is where the pose 2 is"):
        through([START, END, END, START], 0.05)
    with pytest.raises(InputError, match="no extent"):
        timed([straight(START, START)], Limits())
    with pytest.raises(InputError, match="no extent"):
        timed([CURVES["straight"], straight(END, END)], Limits())
    for duration in (0.5 * run("straight").duration, -1.0, 0.0):
        with pytest.raises(InputError, match=f"^duration: .*motion takes {run('straight').duration:.4g} s"):
            timed([CURVES["straight"]], Limits(), duration)
    for duration in (math.nan, math.inf, 1e9):
        with pytest.raises(InputError, match=r"^duration: .* at most 1e\+06 s"):
            timed([CURVES["straight"]], Limits(), duration)
    for limits in (Limits(speed=1e-300), Limits(1e300, 1e300, 1e300, 1e300, 1e300, 1e300)):
        with pytest.raises(InputError, match="orders of magnitude"):
            timed([CURVES["straight"]], limits)
    with pytest.raises(InputError, match="the pose 2 is too near to the pose 1"):
        through([zyz_frame((x, 0, 0), 0, 0, 0) for x in (0, 1e-9, 1e12)], 1e-6)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["speed", "acceleration", "jerk", "angular_speed", "angular_acceleration", "angular_jerk"])
def test_limits_must_be_limits(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"^{name.replace('_', ' ')}: .* is no limit"):
        Limits(**{name: value})


PATH = """
format = 1
corners = "stop"
duration = "2500 ms"
[limits]
speed = "80 mm/s"
acceleration = "0.5 m/s^2"
jerk = "20 m/s^3"
angular_speed = "30 deg/s"
angular_acceleration = "8 rad/s^2"
angular_jerk = "300 rad/s^3"
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]
[[poses]]
position = ["4 mm", "-0.2 cm", "0.13 m"]
azimuth = "30 deg"
tilt = "0.1 rad"
roll = "-5 deg"
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]
tilt = "5 deg"
"""


def test_path_files_have_units(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(PATH)
    path = read_path(tmp_path / "p.toml")
    limits = path.limits.limits()
    wanted = Limits(0.08, 0.5, 20.0, np.radians(30), 8.0, 300.0)
    for pair, theirs in zip(limits.pairs, wanted.pairs, strict=True):
        assert pair == pytest.approx(theirs, rel=1e-14)
    trajectory = path.trajectory(0.018)
    assert (trajectory.duration, len(trajectory.laws)) == (pytest.approx(2.5), 2)
    second = zyz_frame((0.004, -0.002, 0.13), math.radians(30), 0.1, math.radians(-5))
    found = trajectory.at(np.array([trajectory.laws[0].duration])).pose
    np.testing.assert_allclose([c[0] for v in found for c in v], [c for v in second for c in v], rtol=0, atol=1e-12)


def test_path_files_leave_most_open(tmp_path: Path) -> None:
    """Smooth, upright, as fast as the standard limits allow; one limit alone leaves the others as they are."""
    bare = '[limits]\nspeed = "50 mm/s"\n' + PATH[PATH.index("[[poses]]") :]
    (tmp_path / "p.toml").write_text(bare)
    path = read_path(tmp_path / "p.toml")
    assert path.limits.limits() == Limits(speed=0.05)
    trajectory, (last,) = path.trajectory(0.018), path.poses[2:]
    poses = [zyz_frame(p.position, p.azimuth, p.tilt, p.roll) for p in path.poses]
    assert (last.azimuth, last.roll) == (0.0, 0.0)
    own = timed([through(poses, 0.018)], Limits(speed=0.05))
    assert trajectory.duration == own.duration
    times = np.linspace(0, own.duration, 7)
    np.testing.assert_array_equal(trajectory.at(times).pose.origin, own.at(times).pose.origin)


WRONG = [
    ('"2500 ms"', '"2500 mm"', "duration"),
    ('"2500 ms"', "2.5", "duration"),
    ('"2500 ms"', '"0 s"', "duration"),
    ('"2500 ms"', '"1 ms"', "duration: 0.001 s is too short"),
    ("format = 1", "format = 2", "format"),
    ('"stop"', '"round"', "corners"),
    ("speed =", "sped =", "sped"),
    ('"80 mm/s"', '"80 mm"', "limits.speed"),
    ('"0.5 m/s^2"', '"-0.5 m/s^2"', "limits.acceleration"),
    ('"20 m/s^3"', '"20 m/s^2"', "limits.jerk"),
    ('"30 deg/s"', '"30 deg"', "limits.angular_speed"),
    ('"8 rad/s^2"', "[8]", "limits.angular_acceleration"),
    ('"300 rad/s^3"', '"nan rad/s^3"', "limits.angular_jerk"),
    ('"4 mm", ', "", "poses.2.position"),
    ('"4 mm"', '"4 N"', "poses.2.position.x: "),
    ('"30 deg"\ntilt', '"30 mm"\ntilt', "poses.2.azimuth"),
    ('"0.1 rad"', '"inf rad"', "poses.2.tilt"),
    ("roll =", "rol =", "rol"),
    ('position = ["0 mm", "0 mm", "125 mm"]\ntilt', "tilt", "poses.3.position"),
    ("[[poses]]", "[[pose]]", "poses: missing"),
    ("format = 1", "format = ", "is not TOML"),
]


@pytest.mark.parametrize(("old", "new", "key"), WRONG, ids=[f"{old} {new}" for old, new, _ in WRONG])
def test_faults_of_path_files_are_one_line_with_the_key(old: str, new: str, key: str, tmp_path: Path) -> None:
    assert old in PATH
    file = tmp_path / "p.toml"
    file.write_text(PATH.replace(old, new))
    with pytest.raises(InputError) as error:
        read_path(file).trajectory(0.018)
    assert key in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_path_files_with_one_pose_or_none(tmp_path: Path) -> None:
    file, head, poses = tmp_path / "p.toml", *PATH.split("[[poses]]", 1)
    for text, words in (
        (head, "poses: missing"),
        (head.replace("format", "poses = []\nformat"), "poses"),
        (head + "[[poses]]" + poses.split("[[poses]]")[0], "poses"),
        ("x" * 2_000_000, "larger than"),
    ):
        file.write_text(text)
        with pytest.raises(InputError, match=words) as error:
            read_path(file)
        assert str(error.value).startswith(str(file))
    for name in (tmp_path, tmp_path / "nowhere.toml"):
        with pytest.raises(InputError, match=r"a path file was expected|cannot be read"):
            read_path(name)
    second = PATH[PATH.index('["4 mm"') : PATH.index("[[poses]]", PATH.index('["4 mm"'))]
    file.write_text(PATH.replace(second, '["0 mm", "0 mm", "125 mm"]\n'))
    with pytest.raises(InputError, match=r"no extent|where the pose 1 is"):
        read_path(file).trajectory(0.018)
