"""Ways of machines and over paths that the others do not have: guides that turn far, meshes, large spheres, long moves."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trivet
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.report import joint_names, joint_states
from trivet.model import load
from trivet.reach.certificate import Demand, Patches, Prover
from trivet.reach.touch import Touch
from trivet.space.batches import in_batches
from trivet.study import roll_grid
from trivet.study.pathfile import PathFile, PathPose
from trivet.study.plan import Plan, plan_along, plans
from trivet.study.roll_grid import frames_of

COARSE: dict[str, Any] = {"step": math.radians(3), "rolls": 60}
TETRAHEDRON = [[[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
               [[0, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]]  # fmt: skip


def with_travel(low: float, high: float) -> Any:
    """azulay whose carriages have a travel on the circle (deg), each from its own azimuth."""
    guide: dict[str, Any] = {
        "chains.leg.base": {"azimuth": "0 deg"},
        "chains.leg.elements.guide.travel": [f"{low} deg", f"{high} deg"],
    }
    return load("azulay", guide)


def around(first: float, last: float, tilt: float = math.radians(20)) -> PathFile:
    """Level with a tilt that goes round from one azimuth to another (rad), on the sphere of azulay."""
    poses = []
    for azimuth in (first, last):
        normal = np.array([math.cos(azimuth) * math.sin(tilt), math.sin(azimuth) * math.sin(tilt), math.cos(tilt)])
        poses.append(PathPose(tuple(np.array([0, 0, 0.121]) + 0.004 * normal), azimuth, tilt, 0.0))
    return PathFile(poses)


def guides(plan: Plan) -> np.ndarray:
    """Angles of the carriages at the knots, deg."""
    assert plan.drives is not None
    return np.degrees(plan.drives.knots[:, plan.drives.is_angular])


def test_a_travel_may_lie_across_half_a_turn() -> None:
    """The arc tangent's cut is opposite of the middle of the travel, wherever that is."""
    plan = plan_along(with_travel(60, 300), around(0.0, math.radians(40)), bodies=False, start_roll=math.radians(165), **COARSE)
    assert plan.is_safe
    angles = guides(plan) % 360
    assert ((angles.min(axis=0) < 180) & (angles.max(axis=0) > 180)).any()
    assert plan.travel > 0.3


def test_travels_beyond_a_turn_are_refused_unless_limits_are_left_aside() -> None:
    machine = with_travel(-270, 270)
    with pytest.raises(trivet.InputError, match=r"azulay: leg-1.guide, leg-2.guide, leg-3.guide may turn beyond a turn"):
        trivet.plan(machine, 0.004, 0.110, **COARSE)
    assert trivet.plan(machine, 0.004, 0.110, mode="++ ++ -+", limits=False, **COARSE).is_safe
    prover = Prover(machine, np.ones((3, 2)), None, 0.004)
    line = Patches.along(np.array([[0.0] * 2, [0.0] * 2, [0.121] * 2, [0.0] * 2, [0.0, 0.1], [0.0] * 2]))
    with pytest.raises(trivet.InputError, match="proofs do not count turns"):
        prover.prove(line, Demand(), 1000)


def test_nothing_is_not_proven() -> None:
    prover = Prover(load("azulay"), np.ones((3, 2)), None, 0.004)
    with pytest.raises(trivet.InputError, match="no poses"):
        prover.prove(Patches.along(np.zeros((6, 1))), Demand(), 1000)


@pytest.mark.parametrize("is_watched", [False, True])
def test_meshes_are_asked_for_bounds_only_where_they_must_stay_apart(is_watched: bool, tmp_path: Path) -> None:
    """A mesh has no bounds; where it may touch all others it needs none."""
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners) + "endloop\nendfacet\n"
        for corners in TETRAHEDRON
    )
    (tmp_path / "table.stl").write_text(f"solid x\n{facets}endsolid x\n")
    touching = '[["table", "leg.slide"], ["table", "leg.link"], ["table", "platform"]]'
    text = (
        'variant_of = "azulay"\n[about]\nname = "m"\n[set]\n'
        '"fixtures.table" = [{ shape = "mesh", file = "table.stl", unit = "mm" }]\n'
        f'"interference.may_touch" = {touching if not is_watched else "[]"}\n'
    )
    (tmp_path / "m.toml").write_text(text)

    def asked(proof: bool) -> Plan:
        settings = {"mode": "++ ++ -+", "to": math.radians(10), "proof": proof}
        return trivet.plan(str(tmp_path / "m.toml"), 0.004, 0.110, **settings, **COARSE)

    if is_watched:
        with pytest.raises(trivet.InputError, match=r"bodies with meshes have no proofs; ask for none \(--no-proof\)"):
            asked(True)
        assert asked(False).verdict == "no proof asked for"
    else:
        assert asked(True).is_safe


def fastest_by_hand(plan: Plan) -> float:
    """The greatest rate of a sliding drive per rad that the platform turns (m), in small steps of the knots' line."""
    assert plan.knots is not None
    parts = np.linspace(0, len(plan.knots.tilt) - 1, 20_001)
    poses = frames_of(Touch(*(np.interp(parts, np.arange(len(c)), c) for c in plan.knots)), plan.rules.radius)
    states = in_batches(lambda part: joint_states(plan.machine, part, plan.rules.signs), poses)
    names = [name for name, joint in actuators(plan.machine) if not joint.is_angular]
    slides = states.coordinate[:, [joint_names(plan.machine).index(name) for name in names]]
    axes = np.array([list(axis) for axis in poses[1:]])
    turns = np.linalg.norm(np.diff(axes, axis=2), axis=(0, 1)) / math.sqrt(2)
    return float(np.abs(np.diff(slides, axis=0) / turns[:, None]).max())


@pytest.mark.parametrize(("radius", "height"), [(0.004, 0.121), (0.040, 0.080)])
def test_rates_of_drives_are_those_per_turn_on_small_and_large_spheres(radius: float, height: float) -> None:
    plan = trivet.plan("azulay", radius, height, to=math.radians(20), limits=False, bodies=False, proof=False, **COARSE)
    assert plan.drives is not None
    told = np.abs(plan.drives.rates[:, ~plan.drives.is_angular]).max()
    assert told == pytest.approx(fastest_by_hand(plan), rel=0.02)


def test_long_moves_have_as_many_samples_as_they_have_rows() -> None:
    """A metre is not a radian: moves are counted in sizes of the machine."""
    moved = PathFile([PathPose((0.0, 0.0, 0.090)), PathPose((0.0, 0.0, 0.150))])
    plan = plan_along("azulay", moved, limits=False, bodies=False, proof=False, **COARSE)
    assert plan.along is not None
    assert len(plan.along.rows) >= plan.grid.shape[0]


def test_frames_that_are_proven_are_those_that_are_sampled() -> None:
    rng = np.random.default_rng(0)
    touch = Touch(*rng.normal(size=(6, 1000)))
    for one, two in zip(touch.frame(0.004), frames_of(touch, 0.004), strict=True):
        for a, b in zip(one, two, strict=True):
            np.testing.assert_allclose(a, b, atol=1e-15)


def test_the_start_that_is_asked_for_is_the_one_told_of() -> None:
    """Other rolls may be allowed there."""
    plan = trivet.plan("gough-stewart", start_roll=math.pi, step=math.radians(10), rolls=24, proof=False)
    assert plan.stopped_by.startswith("at the start ")
    assert "roll 180 deg" in plan.stopped_by
    assert "demanded" not in plan.stopped_by


def test_a_refined_grid_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """A way that goes round and round would need a grid as wide as all its turns."""
    settings: dict[str, Any] = {"mode": "++ ++ -+", "proof": False, **COARSE}
    monkeypatch.setattr(roll_grid, "LARGEST_GRID", 2000)
    looked: list[int] = []
    field_of = roll_grid.field_of

    def counting(rules: Any, grid: Any, mask: Any = None) -> Any:
        looked.append(math.prod(grid.shape) if mask is not None else 0)
        return field_of(rules, grid, mask)

    monkeypatch.setattr(roll_grid, "field_of", counting)
    assert trivet.plan("azulay", 0.004, 0.110, **settings).is_possible
    assert max(looked) <= 2000


def test_small_tilts_need_no_step_of_their_own() -> None:
    assert trivet.plan("azulay", to=math.radians(0.5), rolls=24, proof=False).is_possible
    assert trivet.cone("azulay", math.radians(1.0), rolls=24, proof=False).is_possible


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--cone", "20 deg", "--path", "nosuch.toml"), "--cone: takes all directions; no --to, --azimuth, --path"),
        (("--mode", "all", "--mode", "++ ++ ++"), "--mode: all is all of them"),
        (("--sigma", "inf"), "above zero and finite"),
        (("--objective", "K_xx=5"), "unit"),
        (("--objective", "K_rx=5 N/um"), 'objective "K_rx=5 N/um": '),
    ],
)
def test_what_does_not_go_together_is_told(arguments: tuple[str, ...], message: str, trivet: Any) -> None:
    code, _, err = trivet("plan", "azulay", *arguments)
    assert code == 2
    assert message in err
    assert "expected a number above zero" not in err
    assert len(err.strip().splitlines()) == 1


def test_a_machine_without_six_drives_is_told_before_the_others_are_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: Any, **__: Any) -> Any:
        raise AssertionError("planned")

    monkeypatch.setattr("trivet.study.plan.plan", never)
    with pytest.raises(trivet.InputError, match="six of each are needed"):
        plans(["azulay", load("azulay", {"chains.leg.copies": "2"})])
