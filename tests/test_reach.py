"""Travel margins, collisions, tilt and workspace: against plain NumPy, another engine, closed forms and finer grids."""

from __future__ import annotations

import math
import tomllib
from collections import deque
from typing import Any

import numpy as np
import pytest
from machines import part

import trivet as t
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.report import joint_names, joint_state_once, travel_margins
from trivet.kinematics.standing import stand
from trivet.model import Machine, catalogue, document_of, load, parse, to_text
from trivet.model.elements import Beam, Prismatic
from trivet.reach.margins import clearance, nearest_bodies, side, travel_margin, travel_margin_on_grid
from trivet.reach.neutral import REFERENCES, with_neutral
from trivet.reach.scene import Ball, scene_of
from trivet.reach.tilt import Grid, Looked, best_rolls, hanging_together, inside, sides_of
from trivet.reach.workspace import Orientations, Region, columns, reached
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

COMMON = {"platform": {"mass": "1 kg"}, "format": 1}


def random_poses(count: int, seed: int, tilt: float = 1.6) -> Any:
    rng = np.random.default_rng(seed)
    place = np.array([0, 0, 0.12]) + rng.normal(0, 8e-3, (count, 3))
    return zyz_frame(place, rng.uniform(0, 6.3, count), rng.uniform(0, tilt, count), rng.uniform(0, 6.3, count))


# Plain NumPy, written for this machine alone, after physics.md.


def plain_azulay(poses: Any, length: float = 0.216) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether the limits of Table 1 are kept with the ball's axis radial, the cosines of the balls, and the sign of S."""
    p = np.stack(list(poses.origin), axis=-1)
    x, y = np.stack(list(poses.x), axis=-1), np.stack(list(poses.y), axis=-1)
    good, cosines, joints, moves = np.ones(len(p), dtype=bool), [], [], []
    for k in range(3):
        a = 2 * np.pi * k / 3
        out = np.cos(a) * x + np.sin(a) * y
        joint = p + 0.018 * out
        rho = np.hypot(joint[:, 0], joint[:, 1])
        e_r = np.stack([joint[:, 0] / rho, joint[:, 1] / rho, 0 * rho], axis=-1)
        sine = joint[:, 2] / length
        cosine = np.sqrt(1 - sine**2)
        good &= (rho + length * cosine >= 0.162) & (rho + length * cosine <= 0.162 + 0.065)
        good &= (sine >= np.sin(np.radians(5))) & (sine <= np.sin(np.radians(70)))
        towards_foot = cosine[:, None] * e_r - np.stack([0 * sine, 0 * sine, sine], axis=-1)
        cosines.append(np.sum(towards_foot * out, axis=1))
        joints.append(joint)
        moves.append(np.stack([sine * e_r[:, 0], sine * e_r[:, 1], cosine], axis=-1))  # w = du/dphi
    pairs = [(0, 1), (1, 2), (2, 0)]
    e = [joints[j] - joints[i] for i, j in pairs]
    one = [np.sum(e[k] * moves[i], axis=1) for k, (i, _) in enumerate(pairs)]
    two = [np.sum(e[k] * moves[j], axis=1) for k, (_, j) in enumerate(pairs)]
    s = one[0] * one[1] * one[2] - two[0] * two[1] * two[2]
    good &= np.all(np.stack(cosines) >= np.cos(np.radians(70)), axis=0)
    return good, np.stack(cosines, axis=-1), np.sign(s)


def test_limits_and_sides_against_plain_numpy() -> None:
    machine = with_neutral(load("azulay"), "radial")
    signs, poses = parse_mode(machine), random_poses(5000, 1)
    good, cosines, s = plain_azulay(poses)
    margin = travel_margin(machine, poses, signs)
    np.testing.assert_array_equal(margin >= 0, good)
    assert 0.02 < good.mean() < 0.9
    found = side(machine, poses, signs)
    assert set(found) == {-1.0, 1.0}
    # det J_x = -S where rows are chain by chain.
    np.testing.assert_array_equal(found, -s)
    names = joint_names(machine)
    for k in range(5):
        one = part(poses, k)
        state = joint_state_once(machine, one, signs)
        for chain in range(3):
            row = names.index(f"leg-{chain + 1}.ball")
            assert state.gauge[0, row] == pytest.approx(np.arccos(cosines[k, chain]), abs=1e-12)


@pytest.mark.parametrize("body", ["before", "beyond"])
@pytest.mark.parametrize("measure", ["deviation", "elevation"])
def test_a_neutral_axis_in_either_body(body: str, measure: str) -> None:
    """The angle is the same, whichever of its two directions is called the axis."""
    neutral = f'{{ axis = "x", stem = "x", body = "{body}", measure = "{measure}" }}'
    machine = with_ball(f"neutral = {neutral}")
    poses = random_poses(20, 2, 0.3)
    _, cosines, _ = plain_azulay(poses)
    expected = np.arccos(cosines) if measure == "deviation" else np.arcsin(cosines)
    rows = [joint_names(machine).index(f"leg-{k}.ball") for k in (1, 2, 3)]
    for k in range(20):
        state = joint_state_once(machine, part(poses, k), parse_mode(machine))
        np.testing.assert_allclose(state.gauge[0, rows], expected[k], rtol=0, atol=1e-12)
        np.testing.assert_allclose(travel_margins(state)[0, rows], np.radians(70) - np.abs(expected[k]), rtol=0, atol=1e-12)


def with_ball(line: str, cone: str = "70 deg") -> Machine:
    text = to_text(load("azulay")).replace('cone = "70 deg"', f'cone = "{cone}"\n{line}')
    return parse(tomllib.loads(text))


def test_a_cross_joint_has_a_cone() -> None:
    text = to_text(load("gough-stewart"))
    first = text.index('type = "universal"')
    text = text[:first] + 'cone = "10 deg"\nneutral = { axis = "z", body = "before" }\n' + text[first:]
    machine = parse(tomllib.loads(text))
    report = t.pose(machine, anyway=True)
    (name, *_) = [row.name for row in report.joints if row.unit == "rad"]
    (one,) = [s for s in stand(machine, report.frame, report.signs) if name.startswith(s.leg.name)]
    base, foot = one.leg.base_frame(), report.frame.shift(one.leg.platform_frame().origin).origin
    along = np.subtract(foot, base.origin)
    expected = math.acos(float(np.dot(along, base.z) / np.linalg.norm(along)))
    (row,) = [row for row in report.joints if row.name == name]
    assert row.limited == pytest.approx(expected, abs=1e-12)
    assert row.inside == (expected <= np.radians(10))


def test_margin_is_continuous_and_agrees_with_the_joints() -> None:
    machine = with_neutral(load("azulay"), "radial")
    signs, poses = parse_mode(machine), random_poses(200, 3, 0.8)
    margin = travel_margin(machine, poses, signs)
    for k in range(200):
        least = travel_margins(joint_state_once(machine, part(poses, k), signs)).min()
        assert np.sign(least) == np.sign(margin[k])
    grid = travel_margin_on_grid(
        machine, zyz_frame(np.tile([0, 0, 0.12], (70, 1)), np.full(70, 0.1), np.full(70, 0.2), 0.0), np.arange(4.0), signs
    )
    for k in range(4):
        pose = zyz_frame(np.array([[0, 0, 0.12]]), np.array([0.1]), np.array([0.2]), np.array([float(k)]))
        np.testing.assert_allclose(grid[:, k], travel_margin(machine, pose, signs)[0], rtol=0, atol=1e-14)


# Bodies.


@pytest.mark.peer("coal")
@pytest.mark.parametrize("name", ["azulay", "eclipse", "glozman", "gough-stewart", "behi"])
def test_clearance_against_coal(name: str) -> None:
    """Bodies put into place joint by joint, chain by chain, all pairs that no joint connects."""
    import coal

    machine = load(name)
    signs, rng = parse_mode(machine), np.random.default_rng(4)
    scene = scene_of(machine, with_workpiece=True)
    home = np.array(machine.home.position, dtype=float)
    place = home + rng.uniform(-0.004, 0.004, (12, 3))
    poses = zyz_frame(place, rng.uniform(0, 6.3, 12), rng.uniform(0, 0.2, 12), rng.uniform(-0.1, 0.1, 12))
    workpiece = Ball(Vec(0.0, 0.0, 0.03), 0.02)
    names, gaps = nearest_bodies(machine, scene, poses, signs, workpiece)
    np.testing.assert_allclose(clearance(machine, scene, poses, signs, workpiece), gaps, rtol=0, atol=1e-15)
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = 1e-10
    for k in range(12):
        pose, bodies = part(poses, k), {}
        for one in stand(machine, pose, signs):
            for (element, frame, _), (_, beyond, _) in zip(one.steps[:-1], one.steps[1:], strict=True):
                profile = element.profile if isinstance(element, Beam) else getattr(element, "beam", None)
                if profile is None or not isinstance(element, Beam | Prismatic):
                    continue
                start, end = (np.array(f.origin, dtype=float) for f in (frame, beyond))
                width = float(machine.sections[profile.section].outline.width)
                bodies[f"{one.leg.name}.{element.name}"] = capsule(coal, start, end, width / 2)
        bodies["workpiece"] = capsule(coal, np.array([0, 0, 0.03]), np.array([0, 0, 0.03]), 0.02)
        disc = machine.platform.disc
        if disc is not None:
            size = 2 * float(disc.radius), 2 * float(disc.radius), float(disc.thickness)
            turn = np.array(pose.matrix(), dtype=float)
            bodies["platform"] = coal.Box(*size), coal.Transform3s(turn, np.array(pose.origin, dtype=float))
        found = {}
        for one_name, other in scene.names():
            result = coal.DistanceResult()
            coal.distance(*bodies[one_name], *bodies[other], request, result)
            found[one_name, other] = result.min_distance
        assert gaps[k] == pytest.approx(min(found.values()), abs=1e-8)
        assert found[names[k]] == pytest.approx(min(found.values()), abs=1e-8)


def capsule(coal: Any, start: np.ndarray, end: np.ndarray, radius: float) -> Any:
    along = end - start
    length = float(np.linalg.norm(along))
    z = along / length if length > 0 else np.array([0.0, 0, 1])
    x = np.cross(z, [1.0, 0, 0] if abs(z[0]) < 0.9 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(z, x), z], axis=1)
    return coal.Capsule(radius, length), coal.Transform3s(turn, (start + end) / 2)


def test_pairs_which_may_touch() -> None:
    machine = load("azulay")
    names = scene_of(machine, with_workpiece=True).names()
    assert ("leg-1.link", "leg-2.link") in names
    assert ("leg-1.slide", "leg-1.link") not in names  # a hinge between them
    assert ("leg-1.link", "platform") not in names  # a ball
    assert ("leg-1.slide", "platform") in names
    assert not any("workpiece" in pair and "platform" in pair for pair in names)
    document = document_of(machine) | {"interference": {"may_touch": [["leg.link", "leg.link"], ["leg-1.slide", "platform"]]}}
    fewer = scene_of(parse(document), with_workpiece=True).names()
    assert set(names) - set(fewer) == {
        ("leg-1.link", "leg-2.link"), ("leg-1.link", "leg-3.link"), ("leg-2.link", "leg-3.link"), ("leg-1.slide", "platform"),
    }  # fmt: skip


def test_shapes_of_the_file_take_the_place_of_beams() -> None:
    """A ball on the carriage, a box on the platform, a wall: told by hand at home."""
    text = to_text(load("azulay"))
    text = text.replace('name = "hinge"', 'name = "hinge"\nshapes = [{ shape = "sphere", radius = "20 mm" }]')
    text = text.replace('name = "link"', 'name = "link"\nshapes = []').replace('name = "slide"', 'name = "slide"\nshapes = []')
    text += '\n[[fixtures.wall]]\nshape = "box"\nsize = ["10 mm", "1 m", "1 m"]\ncentre = ["300 mm", "0 mm", "0 mm"]\n'
    machine = parse(tomllib.loads(text))
    report = t.pose(machine)
    scene = scene_of(machine, with_workpiece=False)
    assert set(scene.names()) == {
        ("leg-1.hinge", "leg-2.hinge"), ("leg-1.hinge", "leg-3.hinge"), ("leg-2.hinge", "leg-3.hinge"),
        ("leg-1.hinge", "wall"), ("leg-2.hinge", "wall"), ("leg-3.hinge", "wall"), ("platform", "wall"),
    }  # fmt: skip
    home = zyz_frame(np.array([report.position]), *(np.zeros(1) for _ in range(3)))
    (name,), (gap,) = nearest_bodies(machine, scene, home, report.signs)
    reach = 0.162 + report.joints[1].coordinate
    assert name == ("leg-1.hinge", "wall")
    assert gap == pytest.approx(0.295 - reach - 0.020, abs=1e-12)


# Tilt.


@pytest.mark.parametrize(("length", "expected"), [(196, 94.68), (206, 93.755), (216, 93.05), (226, 92.50)])
def test_tilts_which_an_independent_study_found(length: int, expected: float) -> None:
    """physics.md 8: 94/93/92/91 degrees with the in-plane radial axis, z0 = 100 mm, radius 8 mm.

    The rolls of that study were steps; with every roll there is the plain NumPy of this file finds the tilts expected here.
    """
    machine = load("azulay", {"link.length": f"{length} mm"})
    report = t.tilt(machine, 0.008, 0.1, neutral="radial", bodies=False, azimuths=6, most=math.radians(110))
    assert math.degrees(report.tilt) == pytest.approx(expected, abs=0.01)
    np.testing.assert_allclose(report.unbroken, report.tilt, rtol=0, atol=1e-4)  # circular guides: all azimuths alike
    rolls = np.radians(np.arange(0, 120, 0.02))
    for change, there in ((-2e-4, True), (2e-4, False)):
        tilt = report.tilt + change
        place = np.array([0.008 * math.sin(tilt), 0.0, 0.1 + 0.008 * math.cos(tilt)])
        poses = zyz_frame(np.tile(place, (len(rolls), 1)), 0.0, tilt, rolls)
        assert np.any(plain_azulay(poses, length / 1e3)[0]) == there


def test_refined_tilt_does_not_hang_on_the_rolls_of_the_grid() -> None:
    settings: Any = {"neutral": "radial", "bodies": False, "step": math.radians(0.05), "most": math.radians(93.3)}
    coarse, fine = (t.tilt("azulay", 0.008, 0.1, azimuths=7, rolls=rolls, **settings) for rolls in (7, 357))
    assert coarse.largest[0] < fine.largest[0]  # which is all that the grid tells
    np.testing.assert_allclose(coarse.unbroken, fine.unbroken, rtol=0, atol=2e-5)


def walked(sides: np.ndarray, start: int) -> np.ndarray:
    """A breadth-first walk from pose to pose."""
    a, b, c = sides.shape
    seen, todo = {(0, 0, start)}, deque([(0, 0, start)])
    while todo:
        i, j, k = todo.popleft()
        steps = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
        near = [((i + p) % a, j + q, (k + r) % c) for p, q, r in steps]
        if j == 0:  # the same pose under another azimuth
            near += [(other, 0, (k + (i - other) * c // a) % c) for other in range(a)]
        for one in near:
            if 0 <= one[1] < b and one not in seen and sides[one] == sides[0, 0, start]:
                seen.add(one)
                todo.append(one)
    found = np.zeros(sides.shape, dtype=bool)
    found[tuple(np.array(sorted(seen)).T)] = True
    return found


def test_what_hangs_together_of_random_grids() -> None:
    """Sparse, so that seams and the pole alone connect many of the pieces."""
    rng = np.random.default_rng(12)
    for _ in range(200):
        sides = rng.choice([-1.0, 0.0, 1.0], (4, 5, 12), p=[0.15, 0.4, 0.45])
        sides[0, 0, 3] = 1.0
        sides[:, 0] = [np.roll(sides[0, 0], -3 * i) for i in range(4)]  # at the pole they are the same poses
        np.testing.assert_array_equal(hanging_together(sides, 3), walked(sides, 3))
    sides[0, 0, 3] = 0.0
    assert not np.any(hanging_together(sides, 3))


def test_connected_as_a_walk_from_pose_to_pose() -> None:
    """The same poses by a breadth-first walk over plain NumPy's limits and signs."""
    machine = with_neutral(load("azulay"), "radial")
    grid = Grid.of((0.0, 0.0, 0.1), 0.008, 12, math.radians(3), math.radians(99), 36)
    looked = Looked(machine, parse_mode(machine), None, None)
    found = hanging_together(sides_of(looked, grid, inside(looked, grid).inside), 0)
    a, b, c = found.shape
    azimuth, tilt, roll = np.meshgrid(grid.azimuths, grid.tilts, grid.rolls, indexing="ij")
    frames = grid.frames(azimuth.ravel(), tilt.ravel())
    poses = zyz_frame(np.stack(list(frames.origin), axis=-1), azimuth.ravel(), tilt.ravel(), roll.ravel())
    good, _, s = (v.reshape(*(a, b, c), *v.shape[1:]) for v in plain_azulay(poses))
    expected = walked(np.where(good, s, 0), 0)
    np.testing.assert_array_equal(found, expected)
    assert 0 < expected.sum() < good.sum()


def test_no_way_leads_over_the_singular_ring_in_the_papers_mode() -> None:
    """physics.md 5: pose by pose the machine tilts beyond 90 degrees, from home it does not."""
    report = t.tilt("azulay", neutral="radial", bodies=False, azimuths=12)
    assert math.degrees(report.tilt) > 90
    assert 25 < math.degrees(report.connected_tilt) < 40
    assert report.apart == ""


def test_best_rolls_are_those_of_the_whole_grid() -> None:
    """Looked at lazily or all of them: the same rolls."""
    machine = load("azulay")
    looked = Looked(machine, parse_mode(machine), scene_of(machine, with_workpiece=True), Ball(Vec(0.0, 0.0, 0.121), 0.004))
    grid = Grid.of((0.0, 0.0, 0.121), 0.004, 4, math.radians(4), math.radians(120), 60)
    whole = inside(looked, grid)
    for i, azimuth in enumerate(grid.azimuths):
        frames = grid.frames(np.full(len(grid.tilts), azimuth), grid.tilts)
        rolls, _ = best_rolls(looked, frames, grid.rolls)
        np.testing.assert_array_equal(rolls >= 0, whole.roll[i] >= 0)
        assert np.all(whole.inside[i, rolls >= 0, rolls[rolls >= 0]])
    assert not np.all(whole.inside == inside(looked._replace(scene=None), grid).inside)


@pytest.mark.parametrize("reference", sorted(REFERENCES))
def test_references_of_neutral_axes(reference: Any) -> None:
    machine = with_neutral(load("azulay"), reference)
    rows = [row for row in t.pose(machine, anyway=True).joints if row.name.endswith("ball")]
    if reference == "as-described":
        assert not rows
    elif reference == "home":
        assert all(abs(row.limited) < 1e-7 for row in rows)
    elif reference == "elevation":
        assert all(row.low == -row.high for row in rows)


# Workspace.


def shell_machine() -> Machine:
    """Six struts whose feet lie as their platform joints do: at one orientation all are as long as the platform is away."""
    joint = [{"name": "cross", "type": "universal", "axes": ["x", "y"]}]
    strut = {"name": "strut", "type": "prismatic", "axis": "z", "actuated": True, "travel": ["400 mm", "500 mm"]}
    chains = {
        f"leg{k}": {
            "base": {"azimuth": f"{60 * k} deg", "radius": "100 mm"},
            "platform_joint": {"azimuth": f"{60 * k} deg", "radius": "100 mm"},
            "elements": [*joint, strut, {"name": "ball", "type": "spherical"}],
        }
        for k in range(6)
    }
    home = {"position": ["0 mm", "0 mm", "450 mm"]}
    return parse({**COMMON, "about": {"name": "shell"}, "home": home, "chains": chains})


def test_volume_of_a_shell() -> None:
    """Closed form: 4 pi / 3 (R^3 - r^3); the estimate of the error holds, and falls as the columns get finer."""
    exact, errors = 4 * math.pi / 3 * (0.5**3 - 0.4**3), []
    for count in (24, 48, 96):
        report = t.workspace(shell_machine(), count=count)
        assert abs(report.volume - exact) < 2 * report.error
        errors.append(report.error / exact)
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 2e-3
    distances = np.linalg.norm(report.boundary, axis=1)
    np.testing.assert_allclose(np.minimum(abs(distances - 0.4), abs(distances - 0.5)), 0, atol=2e-6)


@pytest.mark.parametrize("name", ["azulay", "alizade", "tahmasebi"])
def test_volume_against_ten_times_finer(name: str) -> None:
    coarse = t.workspace(name, count=16, bodies=False)
    fine = t.workspace(name, count=160, bodies=False)
    assert abs(coarse.volume - fine.volume) < 2 * (coarse.error + fine.error)
    assert fine.error < 0.01 * fine.volume
    assert abs(coarse.volume / fine.volume - 1) < 0.1


def test_all_some_and_one_orientation() -> None:
    """What is reached with all orientations is reached with one of them, and that with some."""
    machine = load("azulay")
    looked = Looked(machine, parse_mode(machine), None, None)
    points = np.random.default_rng(7).uniform([-0.1, -0.1, 0.05], [0.1, 0.1, 0.2], (3000, 3))
    cone = Orientations.cone(math.radians(20), math.radians(10), np.radians(np.arange(0, 360, 30)))
    every = reached(looked, points, "total", cone.one_by_one())
    total, some = (reached(looked, points, kind, cone) for kind in ("total", "reachable"))
    one = reached(looked, points, "constant", Orientations.one(0.0, 0.0, 0.0))
    for less, more in ((every, total), (total, some), (one, some), (every, one)):
        assert not np.any(less & ~more)
    assert 0 < total.sum() < some.sum()


def test_columns_with_gaps() -> None:
    """Two balls above each other: every span is found."""

    def within(points: np.ndarray) -> np.ndarray:
        away = [np.linalg.norm(points - [0, 0, z], axis=1) for z in (-0.5, 0.5)]
        found: np.ndarray = np.minimum(*away) < 0.3
        return found

    own = columns(within, Region(np.full(3, -0.93), np.full(3, 1.07)), 60)
    assert own.volume == pytest.approx(2 * 4 / 3 * math.pi * 0.3**3, rel=5e-3)
    assert max(len(low) for low, _ in own.spans) == 2


def test_a_region_cuts_a_workspace_off() -> None:
    region = Region(np.array([-0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.9]))
    for count in (5, 8):
        own = columns(lambda points: np.ones(len(points), dtype=bool), region, count)
        assert own.volume == pytest.approx(0.5 * 0.3 * 0.6, rel=1e-4)
        assert own.error < 1e-6


def test_what_does_not_close_has_no_margin() -> None:
    far = zyz_frame(np.array([[0.0, 0.0, 5.0]]), np.zeros(1), np.zeros(1), np.zeros(1))
    assert np.isneginf(travel_margin(load("azulay"), far, parse_mode(load("azulay"))))


def test_a_wide_cone_has_no_elevation() -> None:
    with pytest.raises(t.InputError, match="an elevation lies between"):
        with_neutral(load("azulay", {"ball.cone": "120 deg"}), "elevation")


def test_orientations_at_a_place() -> None:
    report = t.orientation_workspace(shell_machine(), bodies=False, count=24)
    assert 0 < report.solid_angle < 4 * math.pi
    assert 0 < report.part_of_all < report.solid_angle / (4 * math.pi)
    everywhere = t.orientation_workspace("eclipse", bodies=False, count=12)
    assert everywhere.solid_angle <= 4 * math.pi


@pytest.mark.parametrize("name", catalogue())
def test_every_machine_is_clear_at_home(name: str) -> None:
    machine = load(name)
    if parse_mode(machine) is None:
        pytest.skip("no closed form")
    scene = scene_of(machine, with_workpiece=False)
    home = zyz_frame(np.array([machine.home.position]), *(np.array([a]) for a in home_angles(machine)))
    _, (gap,) = nearest_bodies(machine, scene, home, parse_mode(machine))
    assert gap > 0


def home_angles(machine: Machine) -> tuple[float, float, float]:
    home = machine.home
    return float(home.azimuth), float(home.tilt), float(home.roll)


# Meshes.


def write_box(path: Any, half: tuple[float, float, float], scale: float) -> None:
    """A box as an ASCII STL file."""
    from scipy.spatial import ConvexHull

    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(half) * scale
    lines = ["solid box"]
    for triangle in corners[ConvexHull(corners).simplices]:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid box"]), encoding="utf-8")


@pytest.mark.peer("coal")
def test_a_box_as_a_mesh_is_a_box(tmp_path: Any) -> None:
    """On the platform and as a fixture, beside bodies of every other kind; the file lies beside the machine file."""
    write_box(tmp_path / "tool.stl", (0.02, 0.01, 0.03), 1e3)
    mesh = 'shape = "mesh", file = "tool.stl", unit = "mm"'
    box = 'shape = "box", size = ["40 mm", "20 mm", "60 mm"]'
    found = []
    for shape in (mesh, box):
        place = 'centre = ["0 mm", "5 mm", "30 mm"]'
        path = tmp_path / f"{len(found)}.toml"
        path.write_text(
            'variant_of = "azulay"\n[about]\nname = "m"\n[set]\n'
            f'"platform.shapes" = [{{ {shape}, {place} }}]\n'
            f'"fixtures.wall" = [{{ {shape}, centre = ["80 mm", "0 mm", "120 mm"] }}]\n',
            encoding="utf-8",
        )
        machine = load(path)
        scene, signs = scene_of(machine, with_workpiece=False), parse_mode(machine)
        poses = random_poses(8, 11, 0.4)
        gaps = clearance(machine, scene, poses, signs)
        names, nearest = nearest_bodies(machine, scene, poses, signs)
        np.testing.assert_allclose(gaps, nearest, rtol=0, atol=1e-12)
        found.append((gaps, names))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-7)
    assert found[0][1] == found[1][1]
    assert len(set(found[0][1])) > 1


@pytest.mark.peer("coal")
@pytest.mark.parametrize("content", [None, "hello", ""])
def test_a_mesh_that_is_none(content: str | None, tmp_path: Any) -> None:
    if content is not None:
        (tmp_path / "tool.stl").write_text(content, encoding="utf-8")
    path = tmp_path / "m.toml"
    path.write_text(
        'variant_of = "azulay"\n[about]\nname = "m"\n[set]\n'
        '"platform.shapes" = [{ shape = "mesh", file = "tool.stl", unit = "mm" }]\n',
        encoding="utf-8",
    )
    with pytest.raises(t.InputError, match=r"tool\.stl: cannot be read"):
        t.tilt(path)
