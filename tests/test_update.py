"""Numbers corrected by measurements: predictions, slopes, what is found again, what is told, files, bad input.

The demonstration of a whole correction takes its measurement from solids in CalculiX on joints of another kind.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documents import numbers, traces
from machines import changed
from matplotlib.image import imread
from measured_machine import SENSORS, Joints, hammer_test, modes_of_solids
from rich.console import Console

from trivet.errors import InputError
from trivet.measure.correction.identifiability import told
from trivet.measure.correction.terms import Residuals, huber, scaled
from trivet.measure.correction.updating import functions_alike, lines_alike, robust_spread
from trivet.measure.correlation import ModeSet
from trivet.measure.files.by_suffix import save_functions
from trivet.measure.functions import Channel, Functions
from trivet.measure.machine.modes import ModelModes, modes_of, poles_of
from trivet.measure.machine.parameters import Free, Parameters, parameters
from trivet.measure.machine.predicted import Receptances, Slopes, predicted
from trivet.measure.machine.setup import Axes, Placed, Setup, Spot, placed, read_setup
from trivet.measure.modal.fitted import FittedModes
from trivet.measure.modal.fitting import fit_modes
from trivet.model import Machine, load, write
from trivet.show.figure import figure
from trivet.show.update import factors
from trivet.study.correlate import correlate
from trivet.study.update import Update, _divided, update
from trivet.views.likeness import idle
from trivet.views.update import as_json, tables

Run = Callable[..., tuple[int, str, str]]
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
POINTS = {"1": (0.018, 0.0, 0.13), "2": (-0.009, 0.0156, 0.125), "3": (-0.004, -0.012, 0.12)}
SETUP = Setup(points={"1": Spot(mass=0.005)}, others="platform")
FREE = [Free("ball.stiffness"), Free("slide.stiffness", 0.5), Free("loss_factor")]
TRUE = np.array([450.0, 2.2e6, 0.035])


def machine() -> Machine:
    return load("azulay").with_spherical(300.0)


LOADS = (Channel("1", Z), Channel("2", X))


def asked(frequency: np.ndarray, ends: list[tuple[Channel, Channel]] | None = None) -> Functions:
    """No values yet, at some channels."""
    pairs = ends or [(Channel(point, way), load) for load in LOADS for point in POINTS for way in (X, Y, Z)]
    values = np.zeros((len(pairs), len(frequency)), dtype=complex)
    return Functions(
        frequency, values, ("acceleration",) * len(pairs), tuple(a for a, _ in pairs), tuple(b for _, b in pairs), POINTS
    )


def measured(seed: int = 0, noise: float = 0.03) -> tuple[Functions, Placed]:
    """What the machine with `TRUE` numbers would answer, with noise; and the machine of the file with the points on it."""
    functions = asked(np.linspace(60, 1000, 160))
    at = placed(machine(), SETUP, functions)
    free = parameters(machine(), FREE, 0.02)
    true, loss = free.applied(machine(), 0.02, free.theta(TRUE))
    clean = predicted(dataclasses.replace(at, machine=true), functions, float(loss))
    random = np.random.default_rng(seed)
    error = random.normal(size=(2, *clean.values.shape))
    factor = 1 + noise * (error[0] + 1j * error[1]) / np.sqrt(2)
    return dataclasses.replace(clean, values=clean.values * factor, source="hammer test"), at


@pytest.fixture(scope="module")
def corrected() -> Update:
    functions, _ = measured()
    return update(machine(), SETUP, functions, FREE, hold=["3"])


def test_a_sensor_adds_its_mass() -> None:
    """D with the sensor is D without, less omega^2 m at its point (closed form)."""
    frequency = np.linspace(50, 900, 7)
    ends = [(Channel("1", a), Channel("1", b)) for a in (X, Y, Z) for b in (X, Y, Z)]
    functions = asked(frequency, ends)
    with_mass, without = (
        predicted(placed(machine(), s, functions), functions).receptance.T.reshape(-1, 3, 3)
        for s in (SETUP, Setup(others="platform"))
    )
    added = np.linalg.inv(with_mass) - np.linalg.inv(without)
    expected = -((2 * np.pi * frequency[:, None, None]) ** 2) * 0.005 * np.eye(3)
    np.testing.assert_allclose(added, expected, rtol=0, atol=1e-6 * np.abs(np.linalg.inv(without)).max())


def test_axes_of_the_measurement_are_anybodys_choice() -> None:
    """The same points and directions written in axes that are moved and turned: the same answers."""
    functions = asked(np.linspace(90, 800, 5))
    turn = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])  # columns: the axes of the measurement in {O}
    origin = np.array([0.1, -0.2, 0.05])

    def own(channel: Channel) -> Channel:
        x, y, z = turn.T @ np.array(channel.direction)
        return channel._replace(direction=(float(x), float(y), float(z)))

    written = dataclasses.replace(
        functions,
        responses=tuple(own(c) for c in functions.responses),
        references=tuple(own(c) for c in functions.references),
        points={name: tuple(turn.T @ (np.array(at) - origin)) for name, at in POINTS.items()},
    )
    axes = Axes((0.1, -0.2, 0.05), (0.0, 1.0, 0.0), (0.8, 0.0, -0.6))
    moved = dataclasses.replace(SETUP, axes=axes)
    np.testing.assert_allclose(axes.turn(), turn, atol=1e-15)
    found, expected = (predicted(placed(machine(), s, f), f).values for s, f in ((moved, written), (SETUP, functions)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_far_residuals_count_by_their_size() -> None:
    """Squares up to 1.5, then 1.5 (2 |r| - 1.5): Huber's loss; slopes against differences."""
    apart = np.array([-7.0, -1.6, -0.3, 0.0, 1.2, 4.0])
    value, slope = huber(apart)
    size = np.abs(apart)
    np.testing.assert_allclose(value**2, np.where(size <= 1.5, size**2, 1.5 * (2 * size - 1.5)))
    np.testing.assert_allclose(slope, (huber(apart + 1e-6)[0] - huber(apart - 1e-6)[0]) / 2e-6, rtol=1e-6)


def assert_slopes(found: np.ndarray, expected: np.ndarray, names: tuple[str, ...]) -> None:
    for one, other, name in zip(found, expected, names, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=2e-6 * np.abs(other).max(), err_msg=name)


def extrapolated(of: Callable[[np.ndarray], np.ndarray], theta: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """(p, ...) slopes by differences over two steps, extrapolated to none (Richardson)."""

    def quotient(away: np.ndarray) -> np.ndarray:
        slope: np.ndarray = (of(theta + away) - of(theta - away)) / (2 * np.linalg.norm(away))
        return slope

    return np.array([(4 * quotient(away / 2) - quotient(away)) / 3 for away in step * np.eye(len(theta))])


def slopes_at(lines: int, on: str = "platform") -> tuple[Receptances, Parameters]:
    """Receptances, and numbers of which each moves them in a way of its own."""
    ends = [(Channel(point, way), load) for load in LOADS for point, way in zip("123", (Z, X, Y), strict=True)]
    functions = asked(np.linspace(90, 800, lines), ends)
    at = placed(machine(), dataclasses.replace(SETUP, points={**SETUP.points, "3": Spot(on=on)}), functions)
    free = parameters(machine(), [*FREE, Free("home.position.3", 0.002), Free("platform.disc.radius")], 0.02)
    return Receptances.of(at, functions), free


def test_slopes_both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    """By JAX from the platform's receptance, by differences of the structure between all nodes; a sensor weighs."""
    own, free = slopes_at(4)
    theta = free.theta(free.start)
    exact = own.slopes(machine(), 0.02, free, theta)
    monkeypatch.setattr(Placed, "is_on_platform", False)
    structural = own.slopes(machine(), 0.02, free, theta)
    np.testing.assert_allclose(structural.values, exact.values, rtol=0, atol=1e-9 * np.abs(exact.values).max())
    assert_slopes(structural.slopes, exact.slopes, free.paths)


def test_slopes_at_a_point_on_a_leg() -> None:
    """Which goes where the leg goes: against differences over other steps."""
    own, free = slopes_at(2, "leg-2.link@0.5")
    theta = free.theta(free.start)
    expected = extrapolated(lambda t: own.values(*free.applied(machine(), 0.02, t)), theta, 1e-4)
    assert_slopes(own.slopes(machine(), 0.02, free, theta).slopes, expected, free.paths)


def test_slopes_of_poles() -> None:
    """Against differences of modes, where parts are damped unlike."""
    own = changed(machine(), {"ball": {"loss_factor": 0.1}})
    at = placed(own, SETUP, asked(np.array([100.0])))
    free = parameters(own, [*FREE, Free("platform.disc.radius"), Free("ball.loss_factor")], 0.02)
    theta, count = free.theta(free.start), 6

    def modes(theta: np.ndarray) -> ModelModes:
        machine, loss = free.applied(own, 0.02, theta)
        return modes_of(at, machine, float(loss), 900.0, [Channel("1", Z)])

    def log_poles(theta: np.ndarray) -> np.ndarray:
        found = modes(theta)
        return np.log(np.concatenate([found.frequency[:count], found.damping[:count]]))

    found = poles_of(at, own, 0.02, free, theta, modes(theta), np.arange(count))
    expected = extrapolated(log_poles, theta).T
    np.testing.assert_allclose(found.values, log_poles(theta), rtol=1e-12)
    np.testing.assert_allclose(found.slopes, expected, atol=1e-6)


def test_numbers_are_found_again(corrected: Update) -> None:
    """Within their standard deviations, which are small; functions that were held back agree."""
    apart = (corrected.after - TRUE) / corrected.deviation
    assert np.all(np.abs(apart) < 3)
    assert np.all(corrected.deviation < 0.01 * TRUE)
    assert corrected.found.spread == pytest.approx(0.03 / np.sqrt(2), rel=0.15)
    assert corrected.held is not None
    seen = np.abs(corrected.held.measured.receptance).max(axis=1)
    before, after = (values[seen > 1e-3 * seen.max()] for values in corrected.held.frac)
    assert np.all(before < 0.5)
    assert np.all(after > 0.99)


def test_what_is_held_back_is_not_fitted() -> None:
    """Neither a response at the point, nor a load there."""
    seen, held = _divided(asked(np.linspace(60, 1000, 20)), ["2"])
    assert held is not None
    assert len(seen) == 6
    assert len(held) == 12
    assert not any("2" in (a.point, b.point) for a, b in zip(seen.responses, seen.references, strict=True))


def test_deviations_are_right_over_draws() -> None:
    """Of 12 draws of noise, errors over their standard deviations have a mean square near 1."""
    squares = []
    for seed in range(12):
        functions, _ = measured(seed)
        found = update(machine(), SETUP, functions.only(range(9)), FREE)
        squares.append((found.found.theta - np.log(TRUE)) ** 2 / np.diag(found.covariance))
    assert 0.4 < np.mean(squares) < 2.0


@pytest.fixture(scope="module")
def pulled() -> Update:
    """From far off, with fitted modes."""
    functions, _ = measured()
    free = [Free("ball.stiffness"), Free("slide.stiffness"), Free("loss_factor")]
    return update(load("azulay").with_spherical(60.0), SETUP, functions, free, fit=fitted(functions))


def fitted(functions: Functions) -> FittedModes:
    found = fit_modes(functions)
    return FittedModes(found.responses, ModeSet(found.frequency, found.damping, found.shapes))


def test_poles_pull_resonances_together(pulled: Update) -> None:
    """Far off, ln|H| alone ends elsewhere; with fitted modes the numbers are found."""
    np.testing.assert_allclose(pulled.after, TRUE, rtol=0.02)
    assert pulled.modes is not None
    assert pulled.problem.poles is not None
    np.testing.assert_allclose(pulled.modes[1].frequency, pulled.problem.poles.modes.frequency, rtol=2e-3)
    # Where all is damped alike, a damping ratio is half the loss factor.
    np.testing.assert_allclose(pulled.modes[1].damping, pulled.after[2] / 2, rtol=1e-9)


def test_nothing_is_worked_out_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Slopes at the start and after every step, and at no other theta."""
    seen, slopes = [], Receptances.slopes

    def watched(own: Receptances, machine: Machine, loss_factor: float, free: Parameters, theta: np.ndarray) -> Slopes:
        seen.append(tuple(theta))
        return slopes(own, machine, loss_factor, free, theta)

    monkeypatch.setattr(Receptances, "slopes", watched)
    functions, _ = measured()
    told: list[int] = []
    found = update(machine(), SETUP, functions.only(range(9)), FREE, progress=told.append).found
    assert len(seen) == len(set(seen)) == found.steps + 1
    assert told[0] == 0
    assert told[-1] == found.steps


def test_criteria_are_those_of_a_comparison(corrected: Update) -> None:
    """In the motions that were measured, before and after."""
    assert corrected.held is not None
    for result in (corrected.fitted, corrected.held):
        before = correlate(machine(), SETUP, result.measured)
        after = correlate(
            corrected.problem.at(corrected.found.theta)[0], SETUP, result.measured, loss_factor=corrected.loss_factor
        )
        for whole, frac, faac in zip((before, after), result.frac, result.faac, strict=True):
            np.testing.assert_allclose(frac, whole.frac, rtol=1e-9)
            np.testing.assert_allclose(faac, whole.faac, rtol=1e-9)


def test_what_cannot_be_told_apart() -> None:
    """Two numbers of which only the sum is measured, and one of which nothing is."""
    free = parameters(machine(), [Free("ball.stiffness"), Free("slide.stiffness"), Free("guide.stiffness")], 0.02)
    row = np.array([100.0, 100.0, 0.0])
    information = np.outer(row, row)
    found = told(free, information, np.linalg.inv(information + np.diag(1 / free.spread**2)))
    assert [(a, b) for a, b, _ in found.inseparable] == [(0, 1)]
    assert found.inseparable[0][2] == pytest.approx(-1, abs=1e-3)
    assert [one.is_told for one in found.directions] == [True, False, False]
    np.testing.assert_allclose(np.abs(found.directions[0].shares), [np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-9)
    np.testing.assert_allclose(found.deviation[2], free.spread[2])


def test_next_points_tell_what_they_promise(corrected: Update) -> None:
    """The gain of the best place is that of its own slopes; nothing that was measured is offered again."""
    best = corrected.next_points[0]
    assert best.gain > 0.5
    assert best.gain == max(one.gain for one in corrected.next_points)
    assert np.all(best.deviation <= np.sqrt(np.diag(corrected.covariance)) * (1 + 1e-12))
    places = [site.at for site in corrected.problem.placed.sites.values()]
    # Once more with all lines, ln|H| by differences of predictions.
    problem, found = corrected.problem, corrected.found
    ends = [(Channel(best.site.point, {"x": X, "y": Y, "z": Z}[best.axis]), load) for load in LOADS]
    at = dataclasses.replace(problem.placed, sites={**problem.placed.sites, best.site.point: best.site})
    own = Receptances.of(at, asked(problem.functions.frequency, ends))
    columns = []
    for unit in 1e-4 * np.eye(len(found.theta)):
        sizes = [np.log(np.abs(own.values(*problem.at(found.theta + s * unit)))) for s in (1, -1)]
        columns.append((sizes[0] - sizes[1]).ravel() / 2e-4)
    more = np.array(columns) @ np.array(columns).T / (found.spread**2 * found.alike)
    whole = np.linalg.inv(corrected.covariance) + more
    expected = 0.5 * np.log2(np.linalg.det(whole) * np.linalg.det(corrected.covariance))
    assert best.gain == pytest.approx(expected, rel=0.15)
    assert all(np.linalg.norm(one.site.at - at) > 1e-9 for one in corrected.next_points for at in places)


def test_residuals_that_are_alike() -> None:
    """Of an autoregressive series with coefficient a, (1 + a) / (1 - a) lines (closed form); of white noise 1."""
    random = np.random.default_rng(3)
    white = random.normal(size=(40, 2000))
    assert lines_alike(white) == pytest.approx(1, abs=0.1)
    red = np.zeros_like(white)
    for k in range(1, white.shape[1]):
        red[:, k] = 0.8 * red[:, k - 1] + white[:, k]
    assert lines_alike(red) == pytest.approx(1.8 / 0.2, rel=0.15)
    assert robust_spread(white) == pytest.approx(1, rel=0.02)
    assert functions_alike(white, 1) == pytest.approx(1, abs=0.1)
    assert functions_alike(red, 9) == pytest.approx(1, abs=0.5)
    assert functions_alike(np.repeat(white[:5], 4, axis=0), 1) == pytest.approx(4, rel=0.05)
    assert functions_alike(np.repeat(red[:1], 6, axis=0), 9) == pytest.approx(6)


def test_finer_lines_say_no_more() -> None:
    """Every line four times, and residuals alike over four times as many: the same sum of squares, far residuals included."""
    apart = np.array([0.1, -0.2, 3.0, 0.05, -1.0])
    slopes = np.random.default_rng(2).normal(size=(5, 2))

    def coarse(theta: np.ndarray) -> Residuals:
        return Residuals(apart + slopes @ theta, slopes)

    def fine(theta: np.ndarray) -> Residuals:
        return Residuals(*(np.repeat(part, 4, axis=0) for part in coarse(theta)))

    for theta in np.random.default_rng(3).normal(size=(4, 2)):
        one, four = (scaled(term, 0.2, alike)(theta) for term, alike in ((coarse, 2.5), (fine, 10.0)))
        assert np.sum(four.values**2) == pytest.approx(np.sum(one.values**2))
        np.testing.assert_allclose(four.values @ four.slopes, one.values @ one.slopes)


def test_the_machine_file_tells_its_history(corrected: Update, tmp_path: Path) -> None:
    write(corrected.machine, tmp_path / "new.toml")
    again = load(str(tmp_path / "new.toml"))
    text = (tmp_path / "new.toml").read_text()
    assert 'status = "fitted"' in text
    assert "was 300 N m/rad" in text
    assert "hammer test" in again.about.description
    assert again.name == "azulay-corrected"
    assert "loss factor of the analysis 0.035" in again.about.description
    ball = again.chains["leg"].elements[-1]
    assert float(ball.stiffness) == pytest.approx(corrected.after[0], abs=0.02 * corrected.deviation[0])  # type: ignore[union-attr]


def seen(result: Update, further: bool = False) -> str:
    """The tables as people see them."""
    console = Console(width=200)
    with console.capture() as caught:
        for part in tables(result, further):
            console.print(part)
    return caught.get()


def test_tables_of_numbers_and_functions(corrected: Update) -> None:
    out = seen(corrected, further=True)
    found, told = corrected.found, corrected.told
    assert "azulay, hammer test: 12 functions at 160 frequencies, 60 to 1000 Hz" in out
    assert f"residuals of ln|H| scatter by {found.spread:.3f} and are alike over {found.lines_alike:.1f} lines and " in out
    assert f"and {found.functions_alike:.1f} functions; found in {found.steps} steps" in out
    assert f"give other commands --loss-factor {corrected.loss_factor:.4g}" in out
    after, deviation = corrected.after, corrected.deviation
    share = 100 * (1 - (told.deviation / corrected.problem.free.spread) ** 2)
    for k, (path, before, unit, scale, known) in enumerate((
        ("ball.stiffness", "300", "N m/rad", 1.0, 300 * math.log(3)),
        ("slide.stiffness", "3", "N/µm", 1e6, 3 * math.log(1.5)),
        ("loss_factor", "0.02", "", 1.0, 0.02 * math.log(3)),
    )):  # fmt: skip
        numbers = (
            f"{before} {unit}",
            f"{after[k] / scale:.6g} {unit}",
            f"{deviation[k] / scale:.2g} {unit}",
            f"{known:.2g} {unit}",
        )
        row = " +".join(re.escape(text.strip()) for text in (path, *numbers, f"{share[k]:.1f} %"))
        assert re.search(row, out), row
    assert corrected.held is not None
    for title, own in (("functions that were fitted", corrected.fitted), ("functions that were held back", corrected.held)):
        part = out[out.index(title) :]
        for k in (0, len(own.measured) - 1):
            numbers = [f"{values[k]:.4f}" for values in (*own.frac, *own.faac)]
            assert re.search(" +".join([re.escape(own.measured.labels[k]), *numbers]), part)
        numbers = [f"{values.mean():.4f}" for values in (*own.frac, *own.faac)]
        assert re.search(" +".join(["in the mean", *numbers]), part)
    best = corrected.next_points[0]
    assert re.search(rf"{re.escape(best.site.point)} +{best.axis} +{best.gain:.2f}\n", out)


def test_tables_of_poles(pulled: Update) -> None:
    assert pulled.modes is not None
    assert pulled.problem.poles is not None
    measured, (before, after) = pulled.problem.poles.modes, pulled.modes
    k = len(measured.frequency) - 1
    own = [measured.frequency[k], before.frequency[k], after.frequency[k]]
    row = [f"{own[0]:.2f}", f"{100 * measured.damping[k]:.3f}", f"{own[1]:.2f}", f"{own[2]:.2f}"]
    row += [f"{100 * (f / own[0] - 1):+.2f}" for f in own[1:]] + [f"{100 * one.damping[k]:.3f}" for one in (before, after)]
    assert re.search(" +".join(map(re.escape, row)), seen(pulled))
    found = as_json(pulled)["poles"][k]
    assert found["frequency_before_Hz"] == before.frequency[k] < found["frequency_after_Hz"] == after.frequency[k]
    assert found["damping_ratio_before"] == before.damping[k] != found["damping_ratio_after"] == after.damping[k]
    assert (found["frequency_Hz"], found["damping_ratio"]) == (measured.frequency[k], measured.damping[k])


def test_json_of_functions(corrected: Update) -> None:
    assert corrected.held is not None
    found = as_json(corrected)
    assert found["steps"] == corrected.found.steps
    for part, own in ((found["fitted"], corrected.fitted), (found["held_back"], corrected.held)):
        last = own.measured.responses[-1]
        assert part[-1]["response"] == {"point": last.point, "direction": list(last.direction), "is_rotation": False}
        assert part[-1]["reference"]["direction"] == [1, 0, 0]
        assert part[-1]["motion"] == "acceleration"
        for key, values in (("frac_before", own.frac[0]), ("frac_after", own.frac[1]), ("faac_after", own.faac[1])):
            np.testing.assert_allclose([one[key] for one in part], values)


def test_what_is_drawn(corrected: Update, tmp_path: Path) -> None:
    """The functions held back that respond most, then numbers with their bars, and how they hang together."""
    figure(corrected, tmp_path / "u.html")
    drawn = traces(tmp_path / "u.html")
    assert corrected.held is not None
    own = corrected.held
    size = np.abs(own.measured.receptance).max(axis=1)
    shown = np.argsort(-size)[:4]
    page = (tmp_path / "u.html").read_text(encoding="utf-8")
    for name, values in (("measured", own.measured), ("before", own.before), ("after", own.after)):
        curves = [trace for trace in drawn if trace.get("legendgroup") == name]
        assert len(curves) == 4
        for curve, k in zip(curves, shown, strict=True):
            np.testing.assert_allclose(numbers(curve["y"]), np.abs(values.values[k]), rtol=1e-9)
            np.testing.assert_allclose(numbers(curve["x"]), own.measured.frequency)
    for k in shown:
        label = own.measured.labels[k].replace("/", "\\u002f")
        words = f"{label}, held back: FRAC {own.frac[0][k]:.3f} before, {own.frac[1][k]:.3f} after"
        assert words in page
    free = corrected.problem.free
    change, after = (corrected.found.theta - free.theta(free.start)) / free.spread, corrected.told.deviation / free.spread
    known, new = (trace for trace in drawn if "error_x" in trace)
    assert known["y"] == new["y"] == list(corrected.paths)
    np.testing.assert_allclose(numbers(new["x"]), change)
    np.testing.assert_allclose(numbers(new["error_x"]["array"]), after)
    np.testing.assert_allclose(numbers(known["x"]), 0)
    np.testing.assert_allclose(numbers(known["error_x"]["array"]), 1)
    (together,) = (trace for trace in drawn if trace["type"] == "heatmap")
    np.testing.assert_allclose(numbers(together["z"]), corrected.told.correlation)


def test_the_picture(corrected: Update, tmp_path: Path) -> None:
    """Every panel has its three curves; numbers have moved along their bars, which are two deviations long."""
    figure(corrected, tmp_path / "u.png")
    picture = imread(tmp_path / "u.png")
    assert picture.shape[:2] == (1085, 1400)
    red, green, blue = (picture[..., k] for k in range(3))
    colours = {
        "measured": (red < 0.1) & (blue > 0.6),
        "before": (red > 0.85) & (green > 0.5) & (blue < 0.2),
        "after": (red > 0.8) & (green < 0.4) & (blue < 0.2),
    }
    for rows in (slice(130, 400), slice(440, 740)):
        for columns in (slice(0, 700), slice(700, 1400)):
            for name, own in colours.items():
                assert own[rows, columns].sum() > 150, (name, rows, columns)
    grey = np.all(np.abs(picture[..., :3] - 235 / 255) < 4e-3, axis=-1)[:, :900]
    rows = np.flatnonzero(grey[870:].sum(axis=1) > 200) + 870
    bars = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    for own, change in zip(bars, factors(corrected)[0], strict=True):
        low, high = np.flatnonzero(grey[own].mean(axis=0) > 0.5)[[0, -1]]
        mark = np.nonzero(colours["after"][own, :900])[1].mean()
        assert 2 * (mark - low) / (high - low) - 1 == pytest.approx(change, abs=0.02)


def test_a_model_that_does_not_explain_it_is_told(corrected: Update) -> None:
    words = "does not explain the measurement"
    bad = dataclasses.replace(corrected, found=dataclasses.replace(corrected.found, spread=0.9))
    assert any(words in part for part in tables(bad) if isinstance(part, str))
    assert not any(words in part for part in tables(corrected) if isinstance(part, str))
    reassurance = "every number is told by the measurements"
    assert not any(reassurance in part for part in tables(bad) if isinstance(part, str))
    assert any(reassurance in part for part in tables(corrected) if isinstance(part, str))
    assert [as_json(own)["explains_measurement"] for own in (bad, corrected)] == [False, True]


def test_surprises_are_told(corrected: Update) -> None:
    free = corrected.problem.free
    theta = free.theta(free.start) + np.array([0.0, -5.0, 0.0]) * free.spread
    odd = dataclasses.replace(corrected, found=dataclasses.replace(corrected.found, theta=theta))
    assert odd.surprises == [(odd.paths[1], pytest.approx(-5))]
    assert f"{odd.paths[1]} went -5.0 standard deviations from what was known before" in list(tables(odd))
    assert not corrected.surprises


def test_the_fit_of_another_measurement_is_refused() -> None:
    functions, _ = measured()
    own = fitted(functions)
    wrong = own._replace(modes=own.modes._replace(frequency=own.modes.frequency / 3))
    with pytest.raises(InputError, match="more than an octave away; give the fit of this measurement"):
        update(machine(), SETUP, functions, FREE, fit=wrong)
    with pytest.raises(InputError, match="the fit has no mode between 60 and"):
        own.among(functions.between(60, 70), 1.0)
    low = own.among(functions.between(60, float(own.modes.frequency[2])), 1.0)
    assert len(low.modes.frequency) == 2  # the third lies between two lines


def test_a_point_that_was_not_measured_is_told() -> None:
    functions, _ = measured()
    setup = dataclasses.replace(SETUP, points={**SETUP.points, "33": Spot(), "34": Spot(at=(0.0, 0.0, 0.0), mass=0.1)})
    at = placed(machine(), setup, functions)
    assert at.idle == ("33",)
    assert next(idle(at)) == "points.33 of the set-up: no function has this point; did you mean '3'?"


@pytest.mark.peer("CalculiX", program="ccx")
def test_a_machine_of_solids_on_other_joints(tmp_path: Path) -> None:
    """No inverse crime: solids, feet on springs in all directions, modal damping, sensors, noise, three references.

    Fitted and corrected on three points; poles and the functions of the other points come near what was measured.
    """
    functions = hammer_test(modes_of_solids(Joints(), tmp_path), lines=345)
    seen = functions.only([k for k in range(len(functions)) if not _is_held(functions, k)])
    bearing = {"z": "10 N/um", "rx": "1e5 N m/rad", "ry": "1e5 N m/rad", "rz": "1e5 N m/rad"}
    own = changed(load("azulay"), {"guide": {"bearing": bearing}}, home={"position": ["0 mm", "0 mm", "130 mm"]})
    own = own.with_theory("timoshenko").with_spherical(100.0)
    free = [Free(f"guide.{one}") for one in ("stiffness", "bearing.z", "bearing.rx", "bearing.ry", "bearing.rz")]
    free += [Free("ball.stiffness"), Free("slide.stiffness"), Free("loss_factor")]
    setup = Setup(points={point: Spot(mass=mass) for point, mass in SENSORS.items()}, others="platform")
    found = update(own, setup, functions, free, fit=fitted(seen), hold=["4", "5"])
    assert found.modes is not None
    poles = found.problem.poles.modes.frequency  # type: ignore[union-attr]
    before, after = (np.abs(one.frequency / poles - 1) for one in found.modes)
    assert before.max() > 0.2
    assert after.max() < 0.01
    assert found.held is not None
    frac = [values.mean() for values in found.held.frac]
    assert frac[0] < 0.05
    assert frac[1] > 0.95
    by_path = dict(zip(found.paths, found.after, strict=True))
    # Springs alike in all directions, as they were put in.
    assert by_path["chains.leg.elements.slide.stiffness"] == pytest.approx(Joints().foot, rel=0.1)
    assert by_path["chains.leg.elements.ball.stiffness"] == pytest.approx(Joints().ball, rel=0.1)


def _is_held(functions: Functions, number: int) -> bool:
    return {functions.responses[number].point, functions.references[number].point} & {"4", "5"} != set()


def test_the_command(trivet: Run, tmp_path: Path) -> None:
    functions, _ = measured()
    save_functions(functions.only(range(9)), tmp_path / "hammer.nc")
    (tmp_path / "setup.toml").write_text('others = "platform"\n[points.1]\nmass = "5 g"\n')
    options = ["hammer.nc", "azulay", "--spherical", "300 N m/rad", "--setup", "setup.toml", "--free", "ball.stiffness",
               "--free", "slide.stiffness=50 %", "--free", "loss_factor=0.02", "--hold", "3", "--to", "800 Hz"]  # fmt: skip
    code, out, err = trivet("measure", "update", *options, "--write", "new.toml", "--data", "u.nc", "--figure", "u.png")
    assert code == 0, err
    assert "every number is told" in out
    assert (tmp_path / "new.toml").exists()
    assert (tmp_path / "u.png").exists()
    code, out, _ = trivet("measure", "update", *options, "--next", "--json")
    found = json.loads(out)
    assert code == 0
    assert [one["unit"] for one in found["parameters"]] == ["N m/rad", "N/m", "1"]
    np.testing.assert_allclose([one["after"] for one in found["parameters"]], TRUE, rtol=0.03)
    assert found["next_points"][0]["gain_bits"] > 0
    code, _, err = trivet("measure", "update", *options[:6], "--free", "ball.stiffness=300")
    assert code == 2
    assert "after = stands how well the number is known" in err
    import xarray as xr

    with xr.open_dataset(tmp_path / "u.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.after, [one["after"] for one in found["parameters"]])
        assert list(data.is_fitted.values) == [1] * 6 + [0] * 3


BAD: list[tuple[list[Any], dict[str, Any], str]] = [
    ([], {}, "nothing is free"),
    ([Free("ball.stifness")], {}, "ball.stifness: no such key"),
    ([Free("guide.bearing.z")], {}, "guide.bearing.z: has no value in this machine; give it one to start from"),
    ([Free("guide.bearing.q")], {}, "did you mean 'guide.bearing."),
    ([Free("ball.stiffness"), Free("chains.leg.elements.ball.stiffness")], {}, "named twice"),
    ([Free("home.position.3")], {}, "no factor can change it"),
    ([Free("home.position")], {}, "home.position.1"),
    (FREE, {"loss_factor": -1.0}, "loss factor: -1; expected 0 or more, and below 2"),
    (FREE, {"loss_factor": 5.0}, "loss factor: 5; expected 0 or more, and below 2"),
    (FREE, {"loss_factor": math.nan}, "loss factor: nan; expected 0 or more, and below 2"),
    ([Free("ball.stiffness", low=400.0)], {}, "outside of its bounds"),
    ([Free("ball.stiffness", spread=-1.0)], {}, "expected above zero"),
    (FREE, {"hold": ["9"]}, "no function has the point 9"),
    (FREE, {"hold": ["1", "2", "3"]}, "all functions are held back"),
    (FREE, {"low": 2000.0}, "the range ends before it begins"),
    (FREE, {"low": 980.0}, "lines from 980 to 1000 Hz"),
]


@pytest.mark.parametrize(("free", "options", "words"), BAD)
def test_bad_input(free: list[Free], options: dict[str, Any], words: str) -> None:
    functions = dataclasses.replace(asked(np.linspace(60, 1000, 20)), values=np.ones((18, 20), dtype=complex))
    with pytest.raises(InputError, match=words):
        update(machine(), SETUP, functions, free, **options)


def test_measurements_that_are_none() -> None:
    """No functions, no frequencies, none above zero, and what has no logarithm."""
    functions = asked(np.linspace(60, 1000, 20))
    for none in (functions.only([]), functions.between(2000, 3000), asked(np.zeros(1))):
        with pytest.raises(InputError, match="there are none at frequencies above zero"):
            update(machine(), SETUP, none, FREE)
    with pytest.raises(InputError, match="measured responses: 360 of 360 have no logarithm; leave out what is nought or below"):
        update(machine(), SETUP, functions, FREE)
    unstable = ModeSet(np.array([300.0]), np.array([-0.01]), np.ones((1, 1)))
    functions.values[:] = 1
    with pytest.raises(InputError, match="frequencies and damping ratios of poles: 1 of 2 have no logarithm"):
        update(machine(), SETUP, functions, FREE, fit=FittedModes((Channel("1", Z),), unstable))


def test_setups_made_by_hand_are_checked() -> None:
    functions, _ = measured()
    for setup, words in (
        (Setup(axes=Axes(x=X, z=X), others="platform"), "are not square to each other"),
        (Setup(axes=Axes(x=(0.0, 0.0, 0.0)), others="platform"), "are not square to each other"),
        (Setup(points={"1": Spot(mass=-50.0)}, others="platform"), r"points\.1\.mass: -50 kg; expected 0 or more"),
    ):
        with pytest.raises(InputError, match=words):
            placed(machine(), setup, functions)


def test_what_was_measured_twice_counts_once() -> None:
    functions, _ = measured()
    twice = functions.only([*range(len(functions)), 0, 3])
    found = correlate(machine(), SETUP, twice)
    assert len(found.measured) == len(functions)


def test_setups_that_are_wrong(tmp_path: Path) -> None:
    functions = asked(np.linspace(60, 1000, 20))
    for text, words in (
        ("[points.1]\non = 3\n", "points.1.on"),
        ("[points.1]\nmas = '3 g'\n", "did you mean 'mass'"),
        ("[axes]\nx = [1, 0, 0]\nz = [1, 0, 0]\n", "not square"),
        ("[points.1]\nat = ['3', '0 mm', '0 mm']\n", "the unit is missing"),
    ):
        (tmp_path / "setup.toml").write_text(text)
        with pytest.raises(InputError, match=words):
            read_setup(tmp_path / "setup.toml")
    with pytest.raises(InputError, match="point 1: the set-up does not say where it is"):
        placed(machine(), Setup(), functions)
    with pytest.raises(InputError, match="leg-9"):
        placed(machine(), Setup(points={p: Spot(on="leg-9.link@0.5") for p in POINTS}), functions)
    nowhere = dataclasses.replace(functions, points={})
    with pytest.raises(InputError, match="without a position"):
        placed(machine(), SETUP, nowhere)
