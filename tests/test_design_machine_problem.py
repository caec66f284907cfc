"""A machine as optimisations take it: limits by their bounds, models and their slopes, rolls that follow, ends of reach."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest
from made_designs import LENGTH, OUTER, seeking

from trivet.design import quantities, studied
from trivet.design.aims import Aims, aims_of
from trivet.design.looked import Looked
from trivet.design.machine_problem import MachineProblem
from trivet.design.quantities import Quantity
from trivet.design.slopes import first_order
from trivet.design.study_file import GivenAims, GivenLimit, GivenVariable
from trivet.model import Machine, load

CIRCLE = GivenVariable(of="guide.radius", low="150 mm", high="170 mm")
PROBLEM = GivenAims(
    maximise=["mean K_xx"], minimise=["mass"],
    limits=[
        GivenLimit(quantity="least K_zz", at_least="1 N/um"),
        GivenLimit(quantity="greatest outer radius", at_most="250 mm"),
        GivenLimit(quantity="least travel margin", at_least=-1),
        GivenLimit(quantity="deviation K_yy", at_most="5 N/um"),
    ],
)  # fmt: skip


def problem() -> tuple[MachineProblem, Aims]:
    study, aims = aims_of(seeking([LENGTH, CIRCLE, OUTER], PROBLEM))
    return MachineProblem(study, 0, aims), aims


def test_a_model_is_the_problem_at_its_design_and_has_its_slopes() -> None:
    own, aims = problem()
    design = np.array([0.2133, 0.1602, 0.0207])
    model = own.model(design)
    rows = np.full(len(aims.all), -np.inf)
    np.maximum.at(rows, model.owner, model.rows(design))
    values = own.values(design[None])
    objectives, constraints = values.objectives[0], values.constraints[0]
    reached = own.constraints.index("reached at least 1")
    assert rows[:2] == pytest.approx(objectives, rel=1e-9)
    assert np.delete(rows[2:], reached) == pytest.approx(np.delete(constraints, reached), rel=1e-8, abs=1e-9)
    assert -1 <= rows[2 + reached] <= 0  # all are reached, by the least of their margins
    slopes = model.slopes(design)
    for k, width in enumerate(own.high - own.low):
        step = np.eye(3)[k] * 1e-6 * width
        differences = (model.rows(design + step) - model.rows(design - step)) / (2 * step[k])
        size = np.abs(slopes[:, k]).max()
        assert differences == pytest.approx(slopes[:, k], rel=1e-5, abs=1e-7 * size)


def test_numbers_of_all_check_points_together_follow_designs_as_reductions_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """The range of a field is its greatest less its least: in values, in slopes, and in that all points are to be reached."""
    field = quantities.quantity("mean K_zz").field
    assert field is not None

    def whole(looked: Looked) -> Any:
        values = field.values(looked)
        return jnp.where(looked.reached, values, -jnp.inf).max() - jnp.where(looked.reached, values, jnp.inf).min()

    spread = Quantity("range", field.kind, whole=whole)
    monkeypatch.setitem(quantities.ALONE, "range", spread)
    study, aims = aims_of(seeking([LENGTH, CIRCLE], GivenAims(maximise=["range", "greatest K_zz"], minimise=["least K_zz"])))
    assert [limit.words for limit in aims.limits] == ["reached at least 1"]
    own, design = MachineProblem(study, 0, aims), np.array([0.2133, 0.1602])
    across, greatest, least = own.values(design[None]).objectives[0] * [-1, -1, 1]
    assert across == pytest.approx(greatest - least, rel=1e-12)
    model = own.model(design)
    rows, slopes = model.rows(design), model.slopes(design)
    single, most, some = (np.flatnonzero(model.owner == k) for k in range(3))
    assert rows[[single[0], most[0], some[0]]] == pytest.approx([-across, -greatest, least], rel=1e-9)
    assert slopes[single[0]] == pytest.approx(slopes[most[0]] + slopes[some[0]], rel=1e-9)
    first = dict(zip((own.name for own in study.quantities), first_order(study, 0).slope, strict=True))
    assert first["range"] == pytest.approx(first["greatest K_zz"] - first["least K_zz"], rel=1e-9)


def test_limits_are_measured_by_their_bounds() -> None:
    _, aims = aims_of(seeking([LENGTH], PROBLEM))
    far = {limit.words: limit.of(0.5 * limit.bound) for limit in aims.limits}
    assert far == pytest.approx({
        "least K_zz at least 1 N/µm": 0.5, "greatest outer radius at most 250 mm": -0.5,
        "least travel margin at least -1": -0.5, "deviation K_yy at most 5 N/µm": -0.5, "reached at least 1": 0.5,
    })  # fmt: skip
    _, others = aims_of(seeking([LENGTH], GivenAims(minimise=["mass"], limits=[GivenLimit("home K_zz", "1 N/um")])))
    assert [limit.words for limit in others.limits] == ["home K_zz at least 1 N/µm"]


def test_limits_that_differ_have_words_that_differ() -> None:
    for name, bounds in (("reached", (0.8, 0.8000001, 1)), ("mass", ("1 kg", "1.0000001 kg", "1.000000100000001 kg"))):
        limits = [GivenLimit(name, at_least=bound) for bound in bounds]
        _, aims = aims_of(seeking([LENGTH], GivenAims(minimise=["mass"], limits=limits)))
        assert len({limit.words for limit in aims.limits}) == 3, aims.limits


def test_what_only_a_study_knows_has_slopes_by_differences(monkeypatch: pytest.MonkeyPatch) -> None:
    def modes(machine: Machine, *others: Any) -> SimpleNamespace:
        return SimpleNamespace(frequency=[machine.chains["leg"].elements[3].length ** 2])

    monkeypatch.setattr(studied, "_modes", modes)
    tube = GivenVariable(of="sections.tube.outer_diameter", choices=["18 mm", "19 mm"])
    aims = GivenAims(maximise=["home frequency"], limits=[GivenLimit("home frequency", at_most="0.04 Hz")])
    study, sought = aims_of(seeking([LENGTH, tube], aims))
    own = MachineProblem(study, 0, sought)
    assert own.discrete == (None, (0.0, 1.0))
    for length in (0.21, 0.205, 0.225):  # within the range, and at its ends
        design = np.array([length, 1.0])
        values, model = own.values(design[None]), own.model(design)
        expected = [-(length**2), (length**2 - 0.04) / 0.04]
        assert [*values.objectives[0], *values.constraints[0]] == pytest.approx(expected, rel=1e-12)
        assert model.rows(design) == pytest.approx(expected, rel=1e-12)
        assert model.slopes(design) == pytest.approx(np.array([[-2 * length, 0], [2 * length / 0.04, 0]]), rel=1e-4)


def test_rolls_follow_the_design() -> None:
    """The true mean changes as the model says, to first order: so it would not if rolls were held."""
    own, _ = problem()
    design = np.array([0.2133, 0.1602, 0.0207])
    model = own.model(design)
    for k, width in enumerate(own.high - own.low):
        step = np.eye(3)[k] * 1e-5 * width
        ends = own.values(np.array([design - step, design + step]))
        row = int(np.argmax(model.owner == 0))
        true = np.diff(ends.objectives[:, 0])[0] / (2 * step[k])
        assert true == pytest.approx(model.slopes(design)[row, k], rel=2e-3), own.variables[k]
        deviation = own.constraints.index("deviation K_yy at most 5 N/µm")
        row = int(np.argmax(model.owner == 2 + deviation))
        true = np.diff(ends.constraints[:, deviation])[0] / (2 * step[k])
        assert true == pytest.approx(model.slopes(design)[row, k], rel=2e-2, abs=1e-3), own.variables[k]


def stretching() -> tuple[MachineProblem, np.ndarray, np.ndarray]:
    """Elbows of Glozman's machine, and designs by height and circle: one that reaches all points, one too high."""
    height = GivenVariable(of="workpiece.height", low="150 mm", high="260 mm")
    study, aims = aims_of(seeking([height, CIRCLE], GivenAims(maximise=["mean K_xx"]), load("glozman")))
    return MachineProblem(study, 0, aims), np.array([0.16, 0.162]), np.array([0.26, 0.162])


def test_a_model_knows_how_near_stretched_elbows_are_to_being_out_of_reach() -> None:
    """Joints without travel limits: what ends the reach is that chains do not close."""
    own, low, high = stretching()
    for _ in range(40):  # the greatest height at which all points are reached
        middle = (low + high) / 2
        is_reached = own.values(middle[None]).constraints[0, 0] <= 0
        low, high = (middle, high) if is_reached else (low, middle)
    model, before = own.model(low), low - [1e-4, 0.0]
    reached = model.owner == 1
    assert model.rows(low)[reached].max() == pytest.approx(0.0, abs=1e-9)
    row, slope = own.model(before).rows(before)[reached], own.model(before).slopes(before)[reached, 0]
    assert row.max() < -1e-3
    assert (row + 1e-4 * slope).max() == pytest.approx(0.0, abs=1e-2 * abs(row.max()))


@pytest.mark.parametrize("height", [0.21, 0.25])
def test_a_model_leads_back_into_reach(height: float) -> None:
    """Where some check points are reached, and where none are, rows of those that are not have slopes."""
    own, design, _ = stretching()
    design[0] = height
    for _ in range(3):  # chains come into reach by squares of lengths
        model, reached = own.model(design), own.model(design).owner == 1
        row, slope = model.rows(design)[reached], model.slopes(design)[reached, 0]
        assert row.max() > 0
        design = design - [1.01 * (row[row > 0] / slope[row > 0]).max(), 0.0]
        if own.values(design[None]).constraints[0, 0] <= 0:
            break
    assert own.values(design[None]).constraints[0, 0] <= 0
    assert design[0] > 0.19


def test_a_model_knows_of_shares_that_are_to_be_reached() -> None:
    height = GivenVariable(of="workpiece.height", low="150 mm", high="260 mm")
    share = GivenLimit("reached", at_least=0.6)
    study, aims = aims_of(seeking([height], GivenAims(maximise=["mean K_xx"], limits=[share]), load("glozman")))
    own, found = MachineProblem(study, 0, aims), set()
    for design in np.linspace(0.195, 0.215, 21)[:, None]:
        violation = own.values(design[None]).constraints[0, 0]
        model = own.model(design)
        assert (model.rows(design)[model.owner == 1].max() <= 0) == (violation <= 0)
        found.add(round(0.6 - violation, 3))
    assert len(found & {1.0, 0.692, 0.385, 0.077}) >= 3  # of 13 points, before and beyond the limit


@pytest.mark.parametrize("height", [0.195, 0.2])
def test_rolls_follow_the_ends_of_reach(height: float) -> None:
    """Where the best rolls stretch elbows, stiffness has slopes a thousand times too large with rolls that are held."""
    own, design, _ = stretching()
    design[0] = height
    slopes = own.model(design).slopes(design)[0]
    for k in range(2):
        step = np.eye(2)[k] * 3e-5  # m; at smaller ones rolls are not found exactly enough: the hills are half a mrad wide
        true = np.diff(own.values(np.array([design - step, design + step])).objectives[:, 0])[0] / (2 * step[k])
        assert true == pytest.approx(slopes[k], rel=2e-2), own.variables[k]


def test_rolls_follow_tops_just_before_the_ends_of_reach() -> None:
    """The best rolls of elbows on straight guides lie some 30 microradians before those that stretch them."""
    height = GivenVariable(of="workpiece.height", low="150 mm", high="260 mm")
    straight = GivenVariable(of="base.radius", low="130 mm", high="180 mm")
    study, aims = aims_of(seeking([height, straight], GivenAims(maximise=["mean K_yy"]), load("straight-elbow")))
    own, design = MachineProblem(study, 0, aims), np.array([0.1835, 0.1634])
    slopes = own.model(design).slopes(design)[0]
    for k in range(2):
        step = np.eye(2)[k] * 1e-5  # m
        true = np.diff(own.values(np.array([design - step, design + step])).objectives[:, 0])[0] / (2 * step[k])
        assert true == pytest.approx(slopes[k], rel=2e-2), own.variables[k]
