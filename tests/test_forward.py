"""Forward kinematics: all assembly modes of every machine, single solutions, tracking, aspects."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machines import drives_of, part, random_stands, unlocked

import trivet
from trivet.errors import InputError, NoResultError
from trivet.kinematics.approach import approach, drive_coordinates
from trivet.kinematics.aspect import connected
from trivet.kinematics.circles import Status, solve
from trivet.kinematics.forward import assembly_modes, match_modes
from trivet.kinematics.locked import circles_of, frames_at, mirror_plane
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.standing import home_pose
from trivet.kinematics.tracking import hinge_angles, track
from trivet.model import Machine, catalogue, load
from trivet.space.frame import Frame
from trivet.space.pose import moved, zyz_frame
from trivet.space.vector import Vec

_ALL = json.loads((Path(__file__).parent / "data" / "kinematics.json").read_text())["cases"]
CASES = [case for case in _ALL if case["kind"] != "inverse_dynamics"]  # those are for tests/test_dynamics.py
NAMES = {"proposed": "azulay", "benhorin": "ben-horin"}
LOCKS: dict[str, dict[str, float]] = {
    "rmmt radial": {"radial": 0.0395},
    "rmmt tangential": {"tangential": 0.003},
    "rmmt mixed": {"leg-1.guide": 0.1, "leg-2.tangential": 0.002, "leg-3.radial": 0.0395},
}
COPLANAR = {"azulay", "azulay-196", "azulay-236", "alizade", "behi", "ben-horin", "tahmasebi", "rmmt", *LOCKS}
CIRCLES = [name for name in catalogue() if name != "gough-stewart"] + list(LOCKS)
POSES = 800


def machine(name: str) -> Machine:
    return load("rmmt").with_locks(LOCKS[name]) if name in LOCKS else load(name)


def apart(one: Frame, other: Frame) -> Any:
    """Greatest difference of positions (m) and of axes."""
    differences = [
        np.abs(np.asarray(a) - np.asarray(b)) for v, w in zip(one, other, strict=True) for a, b in zip(v, w, strict=True)
    ]
    return np.max(np.broadcast_arrays(*differences), axis=0)


@pytest.mark.parametrize("name", CIRCLES)
def test_inverse_then_forward_comes_back(name: str) -> None:
    """Random poses in random working modes: the pose is among the assembly modes, whose number is proved."""
    tested = machine(name)
    poses, signs = random_stands(tested, POSES, seed=3)
    values = drives_of(tested, poses, signs)
    circles = circles_of(tested, values)
    found = solve(circles)
    assert np.all(found.status == Status.COMPLETE)
    assert np.all(found.expected == 16)
    assert np.all(found.found == 16)
    real = np.sum(found.multiplicity * found.real, axis=1)
    assert np.all(real % 2 == 0)
    assert real.min() >= 2
    frames = frames_at(tested, values, np.where(found.real[..., None], np.real(found.angle), np.nan))
    planted = Frame(*(Vec(*(np.asarray(c)[:, None] for c in v)) for v in poses))
    off = np.nanmin(apart(frames, planted), axis=1)
    # An error of the angles moves the platform that much; near singularities it grows.
    bound = np.nanmax(np.where(found.real, found.error, np.nan), axis=1)
    simple = found.multiplicity.max(axis=1) == 1
    assert np.all(off[simple] < 1e-10 + 100 * bound[simple])
    # A pose so near a singularity that two assembly modes cannot be told apart by rounding is found as their double root.
    assert np.count_nonzero(~simple) <= POSES // 200
    assert np.all(off[~simple] < 1e-4)
    assert np.median(off) < 1e-12
    assert (mirror_plane(type(circles)(*(a[:1] for a in circles))) is not None) == (name in COPLANAR)


@pytest.mark.parametrize("name", CIRCLES)
def test_modes_are_recognised(name: str) -> None:
    tested = machine(name)
    poses, signs = random_stands(tested, 50, seed=4)
    values = drives_of(tested, poses, signs)
    found, deviation = match_modes(tested, poses, values)
    assert deviation.max() < 1e-11
    planted = [mode_text(tested, signs[..., k]) for k in range(50)]
    assert [mode_text(tested, s) for s in found] == planted


def reference_machine(case: dict[str, Any]) -> tuple[Machine, np.ndarray]:
    """The machine of a case of kinematics.json, and its drives in the order of Q."""
    p, joints = case["parameters"], np.array(case["joints_chainwise"])
    name = NAMES.get(case["mechanism"], case["mechanism"])
    keys = {"Rp_mm": "platform_joint.radius", "L_mm": "link.length", "L1_mm": "link-1.length", "L2_mm": "link-2.length"}
    keys["Rb_mm"] = "base.radius" if name == "behi" else "guide.radius"
    has = trivet.dimensions(load(name))
    tested = load(name, {k: f"{p[m]!r} mm" for m, k in keys.items() if m in p and any(path.endswith(f".{k}") for path in has)})
    turned = 2 * np.pi / 3 * np.arange(3)
    first, second = joints[:, 0], joints[:, 1]
    if name == "rmmt":  # its angles are counted from each chain's own base, its radial stage from the carriage
        locks = {f"leg-{k + 1}.guide": math.remainder(first[k] - turned[k], 2 * np.pi) for k in range(3)}
        return tested.with_locks(locks), np.r_[second, joints[:, 2] - p["Rb_mm"]] * 1e-3
    if name == "tahmasebi":  # feet in {O}; ours in the axes of each chain's base
        foot = (first + 1j * second) * np.exp(-1j * turned)
        return tested, np.r_[foot.real, foot.imag] * 1e-3
    if name == "ben-horin":
        return tested, np.r_[second, first] * 1e-3
    if name == "behi":
        return tested, np.r_[first, second] * 1e-3
    if name == "glozman":
        return tested, np.r_[first, second]
    return tested, np.r_[first, (second - (p["Rb_mm"] if name == "azulay" else 0)) * 1e-3]


@pytest.mark.parametrize("case", CASES, ids=[f"{c['id']} {c['mechanism']}" for c in CASES])
def test_reference_cases(case: dict[str, Any]) -> None:
    tested, values = reference_machine(case)
    found = trivet.forward(tested, list(values), anyway=True)
    assert found.complete
    assert found.found == case["n_complex"]
    assert len(found.modes) == case["n_real"] == len(case["fk_all_real_poses"])
    for expected in case["fk_all_real_poses"]:
        turn = np.reshape(expected["R_rowmajor"], (3, 3))
        off = [
            max(np.abs(np.array(m.position) * 1e3 - expected["p_mm"]).max(), np.abs(np.array(m.frame.matrix()) - turn).max())
            for m in found.modes
        ]
        assert min(off) < 1e-7


def test_mirror_twins_mirror_each_other() -> None:
    found = trivet.forward("azulay").modes
    for k, mode in enumerate(found):
        assert mode.mirror is not None
        twin = found[mode.mirror]
        assert twin.mirror == k
        assert np.allclose(twin.position, np.array(mode.position) * (1, 1, -1), rtol=0, atol=1e-12)
    assert all(
        mode.mirror is None for mode in trivet.forward("straight-elbow", start=zyz_frame((0, 0, 0.165), 0.3, 0.4, 0.5)).modes
    )


def test_equal_heights_have_a_mirror_plane_at_that_height() -> None:
    """Eclipse at home: z -> 2 h - z."""
    found = trivet.forward("eclipse")
    height = found.drives["leg-1.column"]
    for mode in found.modes:
        assert mode.mirror is not None
        assert math.isclose(found.modes[mode.mirror].position[2], 2 * height - mode.position[2], rel_tol=0, abs_tol=1e-12)


def test_parallel_axes_have_twelve_solutions() -> None:
    """Three equal chains with all hinges along one direction: turned bases, the same azimuth for all planes."""
    tested = load("behi", {"guide.travel": ["-1 m", "1 m"]})  # type: ignore[dict-item]
    circles = circles_of(tested, drives_of(tested, *_stand_one(tested)))
    # The circles of one chain, moved sideways: parallel planes.
    moved_circles = type(circles)(
        centre=np.array([[[0.16, 0.0, 0.0], [0.15, 0.03, 0.01], [0.17, -0.02, 0.02]]]),
        cosine=np.broadcast_to(circles.cosine[:, :1], (1, 3, 3)),
        sine=np.broadcast_to(circles.sine[:, :1], (1, 3, 3)),
        distance=circles.distance,
    )
    found = solve(moved_circles)
    assert found.expected[0] == 12
    assert found.status[0] == Status.COMPLETE


def _stand_one(tested: Machine) -> tuple[Frame, np.ndarray]:
    home = home_pose(tested)
    return Frame(*(Vec(*(np.array([float(c)]) for c in v)) for v in home)), parse_mode(tested)[..., None]


@pytest.mark.parametrize("name", [*CIRCLES, "gough-stewart"])
def test_a_starting_pose_leads_to_its_neighbour(name: str) -> None:
    tested = machine(name)
    poses, signs = random_stands(tested, 4, seed=5)
    for k in range(4):
        pose, sign = part(poses, k), signs[..., k]
        start = moved(pose, np.random.default_rng(k).uniform(-1, 1, 6) * [1e-4, 1e-4, 1e-4, 2e-3, 2e-3, 2e-3])
        values = np.array(list(drive_coordinates(tested, pose, sign).values()))
        found = approach(tested, values, start, sign)
        assert found.gap < 1e-12
        assert found.residual < 1e-11
        assert apart(found.frame, pose) < 1e-9


def test_any_chain_is_solved_from_a_starting_pose() -> None:
    """A chain which no closed form knows: a telescope whose hinge is oblique."""
    document = trivet.model.document_of(load("alizade"))
    document["chains"]["leg"]["elements"][1]["axis"] = [0.1, 1.0, 0.0]
    del document["chains"]["leg"]["elements"][1]["measure"], document["chains"]["leg"]["elements"][1]["travel"]
    tested = trivet.parse(document)
    assert parse_mode(tested) is None
    pose = moved(home_pose(tested), np.array([1e-4, -2e-4, 1e-4, 1e-3, 2e-3, -1e-3]))
    values = np.array(list(drive_coordinates(tested, pose, None).values()))
    found = approach(tested, values, home_pose(tested), None)
    assert found.gap < 1e-11
    assert apart(found.frame, pose) < 1e-9


@pytest.mark.parametrize("name", CIRCLES)
def test_tracking_follows(name: str) -> None:
    tested = machine(name)
    poses, signs = random_stands(tested, 200, seed=6)
    values = drives_of(tested, poses, signs)
    angles = hinge_angles(tested, poses, signs)
    rng = np.random.default_rng(0)
    found = track(tested, values, angles + rng.uniform(-1e-5, 1e-5, angles.shape))
    residual = np.asarray(found.residual)
    # A residual that is not small says that the way was lost; with a small one the pose is right, unless the start lay beyond
    # a singularity that was nearer than the step.
    assert np.mean(residual < 1e-13) > 0.98
    assert np.mean(apart(found.frame, poses)[residual < 1e-13] < 1e-9) > 0.97
    with pytest.raises(InputError, match="expected"):
        track(tested, values[0], angles)


def test_home_is_connected_to_home_and_the_other_side_of_the_ring_is_not() -> None:
    """Without roll, the tilt of the paper's machine crosses a Type 2 singularity about 2 mm from the pole (Fig 4)."""
    tested = load("azulay")
    signs, home = parse_mode(tested), home_pose(tested)

    def touching(tilt: float) -> Frame:
        return zyz_frame((4e-3 * math.sin(tilt), 0.0, 0.121 + 4e-3 * math.cos(tilt)), 0.0, tilt, 0.0)

    assert connected(tested, home, touching(0.05), signs) == "connected"
    assert connected(tested, home, touching(1.2), signs) == "apart"
    assert connected(tested, home, zyz_frame((0.0, 0.0, 0.21), 0.0, 0.0, 0.0), signs) == "apart"  # outside travel


def test_home_among_its_own_assembly_modes() -> None:
    for name in ("azulay", "tahmasebi", "rmmt"):
        found = trivet.forward(name)
        assert found.modes[0].home == "connected"
        assert apart(found.modes[0].frame, home_pose(found.machine)) < 1e-12
        assert found.modes[0].miss is None


def test_another_working_mode_is_apart_from_home() -> None:
    """Whatever solves the machine: with one chain of another kind it is solved from a starting pose."""
    document = trivet.model.document_of(load("azulay").with_locks({"leg-1.guide": 0.0}))
    for chain in document["chains"].values():
        for element in chain["elements"]:
            element.pop("locked", None)
            element.pop("travel", None)
    del document["chains"]["leg-1"]["elements"][1]["axis"]
    document["chains"]["leg-1"]["elements"][1]["axis"] = "z"
    tested = trivet.parse(document)
    home = trivet.forward(tested).modes[0]
    assert home.home == "connected"
    other = trivet.forward(tested, mode="+- ++ ++").modes
    assert all(mode.home == "apart" for mode in other if mode.mode == "+- ++ ++")


def test_feet_keep_their_branch_through_a_right_angle_of_tilt() -> None:
    """A branch is continuous where det J_x is not zero: the drives move by little from 89.9 to 90.1 deg."""
    tested, signs = load("tahmasebi"), parse_mode(load("tahmasebi"))
    before, after = (
        np.array(
            list(
                drive_coordinates(
                    tested, zyz_frame((0.0431, 0.0073, 0.0729), math.radians(-179), tilt, math.pi), signs
                ).values()
            )
        )
        for tilt in (math.radians(89.9), math.radians(90.1))
    )
    assert np.abs(before - after).max() < 1e-3


def test_machines_with_other_numbers_of_drives_are_refused() -> None:
    document = trivet.model.document_of(load("azulay"))
    document["chains"]["leg"]["copies"] = 2
    with pytest.raises(InputError, match="has 4 drives, but the platform six freedoms; drive 2 more"):
        trivet.forward(trivet.parse(document))
    with pytest.raises(NoResultError, match="two platform joints coincide"):
        trivet.forward(load("azulay", {"platform_joint.radius": "1e-9 m"}))
    with pytest.raises(InputError, match=r"locked: 999 deg is outside its travel"):
        load("rmmt", {"chains.leg.elements.guide.locked": "999 deg"})


def test_degenerate_inputs_are_said() -> None:
    with pytest.raises(NoResultError, match="no pose has these drive coordinates"):
        trivet.forward("alizade", {"leg-1.telescope": 0.02, "leg-2.telescope": 0.02}, anyway=True)
    with pytest.raises(NoResultError, match="degenerate"):
        trivet.forward("alizade", {f"leg-{k}.telescope": 0.0 for k in (1, 2, 3)}, anyway=True)
    with pytest.raises(NoResultError, match="all hinges have one axis"):
        trivet.forward(
            "azulay", {f"leg-{k}.{e}": v for k in (1, 2, 3) for e, v in (("guide", 0.3), ("slide", 0.01))}, anyway=True
        )


@pytest.mark.parametrize(
    ("name", "drives", "message"),
    [
        ("azulay", [0.1, 0.2], "2 drive coordinates, but it has 6 drives"),
        ("azulay", {"leg-1.slid": 0.01}, "did you mean 'leg-1.slide'"),
        ("azulay", {"leg-1.slide": 0.3}, "300 mm is outside its travel, 0 to 65 mm"),
        ("azulay", {"leg-1.slide": math.nan}, "expected a number below"),
    ],
)
def test_wrong_drives(name: str, drives: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        trivet.forward(name, drives)


def test_locks_that_leave_not_six_freedoms() -> None:
    with pytest.raises(InputError, match=r"leg-1: has 7 freedoms, 1 more than the platform; lock 1 of its drives"):
        trivet.forward(unlocked())
    with pytest.raises(InputError, match=r"leg-2: has 5 freedoms"):
        trivet.forward(load("rmmt").with_locks({"leg-2.guide": 0.0, "leg-2.radial": 0.03}))
    with pytest.raises(InputError, match="no such joint"):
        load("rmmt").with_locks({"leg-9.guide": 0.0})


def test_the_assembly_modes_of_a_hexapod_are_not_claimed() -> None:
    found = trivet.forward("gough-stewart")
    assert found.expected is None
    assert not found.complete
    assert "may be other poses" in found.remark
    with pytest.raises(InputError, match="starting pose"):
        assembly_modes(load("gough-stewart"), np.zeros(6))
