"""Quantities of designs against the same asked of each machine by itself, by other ways."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from trivet.design import studied
from trivet.design.aims import aims_of
from trivet.design.evaluation import Evaluation
from trivet.design.machine_problem import MachineProblem
from trivet.design.quantities import ALONE, FIELDS, REDUCTIONS, Quantity, names, quantity, reduced
from trivet.design.slopes import first_order
from trivet.design.study import CONTRADICTION, NO_RESULT, NOT_REACHED, PARTLY, WORKED_OUT, Study, study_of
from trivet.design.study_file import GivenAims, GivenLimit, GivenLoad, GivenPoses, GivenVariable, StudyFile
from trivet.dynamics.batch import Case, drive_motion
from trivet.dynamics.equations import REST, State
from trivet.errors import InputError, NoResultError
from trivet.kinematics.jacobian import actuators
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.standing import bodies, home_pose
from trivet.kinematics.transmission import transmissions
from trivet.model import Machine, load
from trivet.model.check import check
from trivet.model.rules import kept
from trivet.reach import margins
from trivet.reach.scene import scene_of
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.screw import Wrench
from trivet.space.vector import Vec
from trivet.statics.objective import AXES, objective
from trivet.statics.stiffness import stiffness
from trivet.study.frf import Minimum
from trivet.study.stiffness_map import surface_of

STEPS, ROLLS = 2, 24
FORCE, MOMENT, GRAVITY = (30.0, -20.0, 50.0), (0.4, -0.3, 0.2), (0.0, 0.0, -9.80665)
QUANTITIES = (
    "mean K_xx", "least 1/C_zz", "deviation K_yy", "greatest K(1,0,1)", "mass", "reached", "least travel margin",
    "least clearance", "least singularity margin", "mean transmission", "greatest drive force", "greatest drive torque",
    "greatest outer radius", "greatest top height", "home K_rx",
)  # fmt: skip
LENGTH = {"azulay": ("link.length", 0.207, 0.222), "glozman": ("link-2.length", 0.105, 0.12)}


def study(name: str, quantities: tuple[str, ...] = QUANTITIES) -> Study:
    """A machine of which a length and a whole section vary."""
    path, low, high = LENGTH[name]
    length = GivenVariable(of=path, low=f"{low} m", high=f"{high} m")
    tube = GivenVariable(
        of=["sections.tube.outer_diameter", "sections.tube.inner_diameter"], name="tube",
        choices=[["19 mm", "14 mm"], ["25 mm", "20 mm"], ["14 mm", "19 mm"]],
    )  # fmt: skip
    size = GivenVariable(scale=["guide.stiffness"], name="drives", low=0.5, high=2.0)
    given = StudyFile(
        machines=[name], variables=[length, tube, size], quantities=list(quantities),
        poses=GivenPoses(steps=STEPS, rolls=ROLLS), load=GivenLoad(force=FORCE, moment=MOMENT),
    )  # fmt: skip
    return study_of(given, [load(name)])


def plainly(machine: Machine, name: str) -> float:
    """One quantity of one machine, by NumPy over the batches that other studies call."""
    if name == "mass":
        return _mass(machine)
    signs = closed_form_signs(machine, None)
    poses, reached = (_home(machine), np.ones(1, dtype=bool)) if name.startswith("home") else _best(machine, signs)
    if name == "reached":
        return float(reached.mean())
    reduction, field = name.split(" ", 1)
    values = _field(machine, poses, signs, field)[reached]
    return float(
        {"mean": np.mean, "least": np.min, "greatest": np.max, "deviation": np.std, "home": np.mean}[reduction](values)
    )


def _home(machine: Machine) -> Frame:
    return jax.tree.map(lambda c: np.array([float(c)]), home_pose(machine))


def _best(machine: Machine, signs: Any) -> tuple[Frame, np.ndarray]:
    surface = surface_of(machine, STEPS)
    roll = 2 * math.pi / ROLLS * np.arange(ROLLS)
    index = np.repeat(np.arange(len(surface)), ROLLS)
    poses = zyz_frame(surface.position[index], surface.azimuth[index], surface.tilt[index], np.tile(roll, len(surface)))
    matrix, inside = stiffness(machine, poses, signs)
    value = np.where(inside, matrix[:, 0, 0], -np.inf).reshape(len(surface), ROLLS)
    best = value.max(axis=1, keepdims=True)
    column = (value >= best * (1 - 1e-9)).argmax(axis=1)
    picked = np.arange(len(surface)) * ROLLS + column
    chosen = jax.tree.map(lambda c: np.asarray(c)[picked], poses)
    return chosen, np.isfinite(value.max(axis=1))


def _mass(machine: Machine) -> float:
    total = float(machine.platform.disc.radius**2 * math.pi * machine.platform.disc.thickness) * 7870.0
    for leg in machine.legs:
        for element in leg.chain.elements:
            profile = getattr(element, "profile", None) or getattr(element, "beam", None)
            if profile is not None:
                length = getattr(element, "length", None)
                own = machine.sections[profile.section].properties(0.29).area * 7870.0
                total += float(own * (element.travel[1] if length is None else length))
    return total


def _field(machine: Machine, poses: Frame, signs: Any, field: str) -> np.ndarray:
    if field.startswith(("K", "1/C")):
        along = objective(field)
        matrix = stiffness(machine, poses, signs)[0]
        direction = np.array(along.direction)
        return np.array(
            [direction @ m @ direction if along.held else 1 / (direction @ np.linalg.inv(m) @ direction) for m in matrix]
        )
    if field in ("drive force", "drive torque"):
        case, one = Case(machine, signs, GRAVITY), np.ones(len(poses.origin.x))
        load = Wrench(*(Vec(*(c * one for c in part)) for part in (FORCE, MOMENT)))
        forces = np.abs(drive_motion(case, State(poses, REST), REST, load).force)
        return forces[:, [joint.is_angular == (field == "drive torque") for _, joint in actuators(machine)]].max(axis=1)
    if field in ("outer radius", "top height"):
        found = []
        for k in range(len(poses.origin.x)):
            one = jax.tree.map(lambda c, k=k: float(c[k]), poses)
            places = bodies(machine, one, signs).frames[:, 0]
            found.append(np.hypot(places[:, 0], places[:, 1]).max() if field == "outer radius" else places[:, 2].max())
        return np.array(found)
    return {
        "travel margin": lambda: margins.travel_margin(machine, poses, signs),
        "clearance": lambda: margins.clearance(machine, scene_of(machine, with_workpiece=False), poses, signs),
        "singularity margin": lambda: margins.control(machine, poses, signs).sigma_min,
        "transmission": lambda: transmissions(machine, poses, signs).local,
    }[field]()


DESIGNS = {
    "azulay": np.array([[0.207, 0, 1.0], [0.216, 1, 0.7], [0.2215, 0, 1.9]]),
    "glozman": np.array([[0.107, 0, 1.0], [0.114, 1, 0.6], [0.118, 0, 1.4]]),
}


def changed(name: str, design: np.ndarray) -> Machine:
    """The machine of a design, by its file."""
    tube = [("19 mm", "14 mm"), ("25 mm", "20 mm"), ("14 mm", "19 mm")][int(design[1])]
    path, length, stiffer = LENGTH[name][0], float(design[0]), 3 * float(design[2])
    own = {"sections.tube.outer_diameter": tube[0], "sections.tube.inner_diameter": tube[1]}
    return load(name, own | {path: f"{length!r} m", "guide.stiffness": f"{stiffer!r} N/um"})


@pytest.mark.parametrize("name", DESIGNS)
def test_every_quantity_is_that_of_the_machine_by_itself(name: str) -> None:
    quantities = tuple(q for q in QUANTITIES if not (name == "glozman" and q == "greatest drive force"))
    asked = study(name, quantities)
    found = Evaluation(asked)(DESIGNS[name])
    assert list(found.status) == [WORKED_OUT] * 3
    for design, row in zip(DESIGNS[name], found.values, strict=True):
        machine = changed(name, design)
        for own, value in zip(quantities, row, strict=True):
            assert value == pytest.approx(plainly(machine, own), rel=1e-9), (own, design)


def test_only_poses_that_are_reached_count() -> None:
    values, reached = np.array([np.nan, 3.0, -1.0, -9.0, 4.0]), np.array([False, True, True, False, True])
    found = {own: float(reduced(values, reached, own)) for own in REDUCTIONS}
    assert found == pytest.approx({"mean": 2, "least": -1, "greatest": 4, "deviation": math.sqrt(14 / 3), "home": 2})
    assert all(np.isnan(reduced(values, np.zeros(5, dtype=bool), own)) for own in REDUCTIONS)


def test_quantities_know_whether_they_ask_for_the_check_points() -> None:
    asked = [quantity(name) for name in ("mean K_xx", "reached", "home K_xx", "mass")]
    assert [own.is_over_points for own in asked if isinstance(own, Quantity)] == [True, True, False, False]


def test_a_design_is_the_machine_of_the_changed_file() -> None:
    asked = study("azulay")
    made, read = asked.machine(0, DESIGNS["azulay"][1]), changed("azulay", DESIGNS["azulay"][1])
    assert jax.tree.leaves(made) == pytest.approx(jax.tree.leaves(read), rel=1e-15)


def test_contradictions_and_places_out_of_reach_are_told_apart() -> None:
    asked = study("azulay", ("mean K_xx", "mass", "reached"))
    designs = np.array([[0.216, 2, 1.0], [0.05, 0, 1.0], [0.195, 0, 1.0], [0.216, 0, 1.0]])
    found = Evaluation(asked)(designs)
    # The mass, and that nothing is reached, are there all the same.
    assert list(found.status) == [CONTRADICTION, NOT_REACHED, PARTLY, WORKED_OUT]
    assert np.isnan(found.values[0]).all()
    assert np.isnan(found.values[1, 0])
    assert found.values[1, 2] == 0
    assert 0 < found.values[2, 2] < 1
    assert np.isfinite(found.values[2:]).all()
    # Known without asking for it; home, where no check point is asked for; nothing asks a mass for a pose.
    cases = {
        ("mean K_xx",): [NOT_REACHED, PARTLY], ("home K_xx", "mass"): [NOT_REACHED, WORKED_OUT], ("mass",): [WORKED_OUT] * 2,
    }  # fmt: skip
    for own, expected in cases.items():
        assert list(Evaluation(asked.asking(own))(designs).status) == [CONTRADICTION, *expected, WORKED_OUT], own


def test_of_several_machines_the_one_that_comes_off_worst_decides() -> None:
    given = StudyFile(
        machines=["azulay", "glozman"], quantities=["mean K_xx", "mass"], poses=GivenPoses(steps=STEPS, rolls=ROLLS),
        variables=[
            GivenVariable(of="link.length", low="50 mm", high="250 mm"),
            GivenVariable(of="link-2.length", low="10 mm", high="250 mm"),
        ],
    )  # fmt: skip
    found = Evaluation(study_of(given, [load(name) for name in given.machines]))(
        np.array([[0.05, 0.114], [0.195, 0.114], [0.216, 0.01], [0.195, 0.01], [0.216, 0.114]])
    )
    assert list(found.status) == [NOT_REACHED, PARTLY, NOT_REACHED, NOT_REACHED, WORKED_OUT]


def test_studies_of_their_own_tell_of_no_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(at: Any) -> list[Minimum]:
        raise NoResultError("the machine collides")

    monkeypatch.setattr("trivet.study.frf.minimum_dynamic_stiffness", none)
    asked, designs = study("azulay", ("home D_xx", "mass")), np.array([[0.216, 2, 1.0], [0.216, 0, 1.0]])
    assert list(Evaluation(asked)(designs).status) == [CONTRADICTION, NO_RESULT]
    assert list(Evaluation(asked.asking(["home D_xx", "home K_xx"]))(designs).status) == [CONTRADICTION, WORKED_OUT]


def test_values_do_not_depend_on_what_else_is_worked_out() -> None:
    asked = study("azulay", ("mean K_xx", "home K_rx"))
    designs = np.column_stack([np.linspace(0.207, 0.222, 20), np.arange(20) % 2, np.linspace(0.5, 2, 20)])
    whole = Evaluation(asked)(designs).values
    parts = np.concatenate([Evaluation(asked)(designs[:7]).values, Evaluation(asked)(designs[7:]).values])
    assert np.array_equal(whole, parts)


def test_rules_hold_of_many_machines_as_of_each() -> None:
    base = load("azulay", {"ball.rotation": "elastic", "ball.stiffness": "100 N m/rad"})
    numbers, structure = jax.tree.flatten(base)
    generator = np.random.default_rng(3)
    many = [np.where(generator.random(40) < 0.05, -v, v * generator.choice([0.3, 0.9, 1.1, 3.0], 40)) for v in numbers]
    together = kept(jax.tree.unflatten(structure, many))
    assert 5 < together.sum() < 35
    for k, whole in enumerate(together):
        one = jax.tree.unflatten(structure, [float(v[k]) for v in many])
        assert whole == _passes(one)


def _passes(machine: Machine) -> bool:
    """Whether the file of a machine is read."""
    from trivet.model import parse
    from trivet.model.toml import parse_toml
    from trivet.model.writing import to_text

    try:
        check(machine)
        parse(parse_toml("m", to_text(machine).encode(), "a machine file"))
    except InputError:
        return False
    return True


def test_a_machine_that_can_have_no_such_number_has_none_beside_others() -> None:
    """Glozman's drives all turn."""
    both = StudyFile(
        machines=["azulay", "glozman"], quantities=["greatest drive force", "mass"], poses=GivenPoses(steps=1, rolls=12),
        variables=[GivenVariable(scale="steel.density", name="density", low=0.5, high=1.5)],
    )  # fmt: skip
    asked = study_of(both, [load(name) for name in both.machines])
    found = Evaluation(asked)(np.ones((1, 1)))
    assert list(np.isfinite(found.values[0])) == [True, False, True, True]
    alone = asked.asking(["greatest drive force"])
    single = Evaluation(alone)(np.ones((1, 1)))
    assert single.status[0] == WORKED_OUT
    assert single.values[0, 0] == pytest.approx(found.values[0, 0])
    first = [first_order(alone, place) for place in (0, 1)]
    assert np.isfinite(first[0].slope).all()
    assert np.isnan([first[1].value[0], first[1].slope[0, 0], first[1].deviations[0]]).all()
    with pytest.raises(InputError, match="glozman: greatest drive force: no drive of it slides"):
        asked.of(1).asking(["greatest drive force"])


def test_one_study_tells_several_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    worked: list[Any] = []

    def minima(at: Any) -> list[Minimum]:
        worked.append(at)
        return [Minimum(axis, 1e6 * (k + float(at.machine.stock.sections["tube"].outer_diameter)), 50.0)
                for k, axis in enumerate(AXES)]  # fmt: skip

    monkeypatch.setattr("trivet.study.frf.minimum_dynamic_stiffness", minima)
    given = StudyFile(
        machines=["azulay"], quantities=["home D_xx", "home D_yy", "home D_rz"],
        variables=[
            GivenVariable(of="sections.tube.outer_diameter", low="18 mm", high="25 mm"),
            GivenVariable(of="link.length", low="200 mm", high="230 mm"),
        ],
        optimise=GivenAims(maximise=["home D_yy", "home D_xx"], limits=[GivenLimit(quantity="home D_yy", at_least="1 N/um")]),
    )  # fmt: skip
    asked = study_of(given, [load("azulay")])
    found = Evaluation(asked)(np.array([[0.02, 0.21], [0.022, 0.21]]))
    np.testing.assert_allclose(found.values, 1e6 * np.array([[0.02, 1.02, 5.02], [0.022, 1.022, 5.022]]))
    assert len(worked) == 2
    worked.clear()
    first = first_order(asked, 0)
    np.testing.assert_allclose(first.slope, [[1e6, 0]] * 3, rtol=1e-6)
    assert len(worked) == 1 + 2 * 2
    study, aims = aims_of(asked)
    model = MachineProblem(study, 0, aims).model(np.array([0.02, 0.21]))
    worked.clear()
    np.testing.assert_allclose(model.rows(np.array([0.02, 0.21])), [-1.02e6, -0.02e6, -0.02])
    assert len(worked) == 1
    np.testing.assert_allclose(model.slopes(np.array([0.02, 0.21])), [[-1e6, 0], [-1e6, 0], [-1, 0]], rtol=1e-6, atol=1e-6)
    assert len(worked) == 1 + 2 * 2


def test_the_documentation_tells_of_every_quantity() -> None:
    told = set(re.findall(r"`([^`\n]+)`", (Path(__file__).parents[1] / "docs" / "studies.md").read_text()))
    names = [*ALONE, *studied.NAMES, *(name for module in FIELDS for name in module.NAMES)]
    first = [name for name in names if not re.search(r"_(?:yy|zz|r.)$", name)]  # one of six stands for all
    assert set(first) <= told


def test_unknown_quantities_are_answered_by_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'mean K_xx'"):
        quantity("mean Kxx")
    with pytest.raises(InputError, match="quantities: 'median K_xx' is no quantity that is known"):
        quantity("median K_xx")
    with pytest.raises(InputError, match="direction needs three numbers"):
        quantity("mean K(0,0,0)")
    for name in names():
        assert quantity(name).name == name
    with pytest.raises(InputError, match="no drive of it slides"):
        study("glozman", ("greatest drive force",))
