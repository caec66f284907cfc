"""Measured responses beside a machine: the study against identities, the command with its tables, files and figures."""

from __future__ import annotations

import dataclasses
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from documents import numbers, traces

import trivet as t
from trivet.errors import InputError
from trivet.measure import correlation as alike
from trivet.measure.channels import written
from trivet.measure.correlation import ModeSet
from trivet.measure.files.by_suffix import save_functions
from trivet.measure.functions import Channel, Functions
from trivet.measure.machine.predicted import predicted
from trivet.measure.machine.setup import Axes, Setup, Spot, placed, read_setup
from trivet.measure.modal.fitted import FittedModes
from trivet.show import correlation as drawn
from trivet.show.measured_points import draw_points, points_scene
from trivet.study.correlate import Correlation, MappedPoints, ShownCorrelation, correlate, distances
from trivet.study.machines import choose

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
"""From the axes of the measurement into {O}."""
SETUP = """
others = "platform"

[axes]
origin = ["0 mm", "0 mm", "125 mm"]
x = [0, 1, 0]

[points.h]
on = "leg-1.hinge"
"""


def setup() -> Setup:
    return Setup({"h": Spot("leg-1.hinge")}, "platform", Axes((0.0, 0.0, 0.125), Y))


def template(lines: int = 60) -> Functions:
    responses = [Channel(point, way) for point in ("1", "2", "h") for way in (X, Y, Z)] + [Channel("2", Z, True)]
    pairs = [(response, reference) for reference in (Channel("1", (0.0, 0.0, -1.0)), Channel("2", X)) for response in responses]
    points = {"1": (0.003, -0.02, 0.01), "2": (0.01, 0.01, 0.0), "h": (0.02, -0.15, -0.12)}
    return Functions(
        np.linspace(0, 800, lines), np.zeros((len(pairs), lines), complex), ("acceleration",) * len(pairs),
        tuple(a for a, _ in pairs), tuple(b for _, b in pairs), points, source="made up",
    )  # fmt: skip


@cache
def measured() -> Functions:
    """Of a machine with longer links, more damping, and noise."""
    functions = predicted(placed(choose("azulay@link.length=212 mm"), setup(), template()), template(), 0.03)
    rng = np.random.default_rng(1)
    noise = 1 + 0.02 * (rng.normal(size=functions.values.shape) + 1j * rng.normal(size=functions.values.shape))
    return dataclasses.replace(functions, values=functions.values * noise, source="made up")


@cache
def own_modes() -> tuple[t.ModesReport, np.ndarray]:
    """Modes of the machine, and their shapes (10, 12) at the channels, by the twists of the nodes they are rigid with."""
    report = t.modes("azulay")
    structure, moves = report.modes.mesh.structure, report.modes.displacements
    hinge = next(tie.second for tie in structure.connections if tie.name == "leg-1.hinge")
    rows = []
    for channel in dict.fromkeys(template().responses):
        node = hinge if channel.point == "h" else 1
        arm = np.zeros(3) if node != 1 else TURN @ np.array(template().points[channel.point])
        way = TURN @ np.array(channel.direction)
        if channel.is_rotation:
            rows.append(way @ moves[node, 3:])
        else:
            rows.append(way @ (moves[node, :3] + np.cross(moves[node, 3:].T, arm).T))
    return report, np.array(rows)


@cache
def fit(count: int = 4) -> FittedModes:
    """The machine's own modes as a fit might give them: complex, of any scale and mixture, frequencies 2 % too low."""
    report, shapes = own_modes()
    mixed = shapes[:, :count] * np.array([2.0, 1j, -3.0, 1e3])[:count]
    mixed[:, :2] = mixed[:, :2] @ np.array([[0.6, 0.8], [-0.8, 0.6]])
    return FittedModes(
        tuple(dict.fromkeys(template().responses)), ModeSet(report.frequency[:count] / 1.02, np.full(count, 0.02), mixed)
    )


@cache
def result() -> Correlation:
    return correlate("azulay", setup(), measured(), fit())


def test_a_machine_is_as_it_is() -> None:
    own = predicted(placed(choose("azulay"), setup(), template()), template(), 0.02)
    found = correlate("azulay", setup(), own)
    for values in (found.frac, found.faac, found.csac[1:], found.csf[1:]):
        np.testing.assert_allclose(values, 1, rtol=1e-9)
    assert np.isnan([found.csac[0], found.csf[0]]).all(), "an acceleration at 0 Hz says nothing of displacements"
    assert found.modes is None
    half = correlate("azulay", setup(), dataclasses.replace(own, values=own.values * -0.5j))
    for shape, size in ((half.frac, half.faac), (half.csac[1:], half.csf[1:])):
        np.testing.assert_allclose(shape, 1, rtol=1e-9)
        np.testing.assert_allclose(size, 2 * 0.5 / (1 + 0.25), rtol=1e-9)


def test_criteria_over_functions_know_units() -> None:
    """What was measured as velocities counts no less; angles count with a length."""
    whole = result()
    kept = measured().between(1, 1e9)
    slower = dataclasses.replace(kept, motions=tuple("velocity" if k % 2 else m for k, m in enumerate(kept.motions)))
    slower.values[1::2] /= 1j * kept.omega
    mixed = correlate("azulay", setup(), slower)
    np.testing.assert_allclose(mixed.csac, whole.csac[1:], rtol=1e-9)
    np.testing.assert_allclose(mixed.csf, whole.csf[1:], rtol=1e-9)
    assert np.abs(mixed.frac - whole.frac)[1::2].max() > 0.01
    length = float(choose("azulay").characteristic_length)
    turns = np.array([length if c.is_rotation else 1.0 for c in measured().responses])[:, None]
    assert turns.min() < 1
    expected = alike.csac(turns * measured().values, turns * whole.computed.values)
    np.testing.assert_allclose(whole.csac[1:], expected[1:], rtol=1e-9)


def test_modes_find_those_of_the_machine() -> None:
    """Shapes at turned axes, on the platform and on a chain, beside those worked out from the twists of nodes."""
    modes = result().modes
    assert modes is not None
    np.testing.assert_allclose(modes.computed.frequency[:4], own_modes()[0].frequency[:4], rtol=1e-3)
    assert [(p.measured, p.computed) for p in modes.pairs] == [(0, 0), (1, 1), (2, 2), (3, 3)]
    for pair in modes.pairs:
        assert pair.mac == pytest.approx(1, abs=1e-4)
        assert pair.frequency_difference == pytest.approx(0.02, abs=1e-3)
        assert pair.damping_difference == pytest.approx(-0.5, abs=1e-2)
    np.testing.assert_allclose(modes.comac, 1, atol=1e-3)
    lengths = np.r_[np.ones(9), float(choose("azulay").characteristic_length)][:, None]
    np.testing.assert_allclose(modes.measured.shapes, lengths * fit().modes.shapes)
    np.testing.assert_allclose(modes.computed.damping, 0.01, rtol=1e-6)
    bad = fit()._replace(modes=fit().modes._replace(shapes=fit().modes.shapes * np.r_[np.ones(9), -1][:, None]))
    wrong = correlate("azulay", setup(), measured(), bad).modes
    assert wrong is not None
    assert min(p.mac for p in wrong.pairs) < 0.99


def test_a_fit_at_other_channels() -> None:
    some = fit()._replace(channels=(*fit().channels[:-1], Channel("99", X)))
    found = correlate("azulay", setup(), measured(), some).modes
    assert found is not None
    assert found.channels == fit().channels[:-1]
    with pytest.raises(InputError, match="the fit has none of the channels of the functions"):
        correlate("azulay", setup(), measured(), fit()._replace(channels=tuple(Channel(f"{k}", X) for k in range(50, 60))))


def test_distances() -> None:
    at = result().placed
    hinge = next(tie for tie in own_modes()[0].modes.structure.connections if tie.name == "leg-1.hinge")
    expected = np.linalg.norm(hinge.at - (TURN @ np.array(template().points["h"]) + [0, 0, 0.125]))
    assert distances(at) == (pytest.approx(expected), "h", 0)
    nowhere = dataclasses.replace(template(), points={"1": (0.0, 0.0, 0.0), "2": (0.0, 0.0, 0.1)})
    assert distances(placed(choose("azulay"), setup(), nowhere)) == (0, "1", 1)


@pytest.fixture
def files(tmp_path: Path) -> Path:
    save_functions(measured(), tmp_path / "m.nc")
    (tmp_path / "setup.toml").write_text(SETUP)
    assert read_setup(tmp_path / "setup.toml") == setup()
    return tmp_path


COMMAND = ("measure", "correlate", "m.nc", "azulay", "--setup", "setup.toml")


def test_tables(trivet: Any, files: Path) -> None:
    code, out, err = trivet(*COMMAND)
    assert (code, err) == (0, "")
    whole = result()
    assert "made up: 20 functions at 60 frequencies, 0 to 800 Hz" in out
    far = distances(whole.placed)
    assert f"point h was measured farthest from where it lies on the machine: {far.greatest * 1e3:.3g} mm" in out
    for k in (0, 19):
        assert re.search(rf"{re.escape(measured().labels[k])} +acceleration +{whole.frac[k]:.4f} +{whole.faac[k]:.4f}", out)
    assert re.search(rf"in the mean +{whole.frac.mean():.4f} +{whole.faac.mean():.4f}", out)
    worst = int(np.nanargmin(whole.csac))
    pattern = rf"CSAC, of the shape +{np.nanmean(whole.csac):.4f} +{whole.csac[worst]:.4f} +{measured().frequency[worst]:g}"
    assert re.search(pattern, out)
    assert re.search(r"1 +platform +20.000 +3.000 +135.000 +0.000", out)


def test_a_range_of_frequencies(trivet: Any, files: Path) -> None:
    out = trivet(*COMMAND, "--from", "100 Hz", "--to", "0.3 kHz", "--loss-factor", "0.03", "--json")[1]
    found = json.loads(out)
    kept = measured().between(100, 300)
    assert found["frequency_Hz"] == kept.frequency.tolist()
    expected = correlate("azulay", setup(), kept, loss_factor=0.03)
    np.testing.assert_allclose([one["frac"] for one in found["functions"]], expected.frac, rtol=1e-9)
    np.testing.assert_allclose(found["csf"], expected.csf, rtol=1e-9)
    assert found["loss_factor"] == 0.03


def test_json(trivet: Any, files: Path) -> None:
    found, whole = json.loads(trivet(*COMMAND, "--json")[1]), result()
    np.testing.assert_allclose([one["faac"] for one in found["functions"]], whole.faac, rtol=1e-9)
    assert found["functions"][0]["reference"] == {"point": "1", "direction": [0, 0, -1], "is_rotation": False}
    assert found["csac"][0] is None
    np.testing.assert_allclose(found["csac"][1:], whole.csac[1:], rtol=1e-9)
    assert (found["machine"], found["mode"], found["source"]) == ("azulay", "++ ++ ++", "made up")
    point = found["points"][2]
    assert (point["point"], point["on"]) == ("h", "leg-1.hinge")
    assert point["distance_m"] == pytest.approx(distances(whole.placed).greatest)
    assert found["modes"] is None


def test_modes_in_tables_and_json() -> None:
    from rich.console import Console

    from trivet.views import correlation as view

    console = Console(width=160)
    with console.capture() as caught:
        for part in view.tables(ShownCorrelation(result())):
            console.print(part)
    out, modes = caught.get(), result().modes
    assert modes is not None
    first = modes.pairs[0]
    measured_, computed = (
        rf"1 +{frequency:.2f} +{share}" for frequency, share in zip(first.frequency, ("2.000", "1.000"), strict=True)
    )
    row = rf"{measured_} +{computed} +\+{100 * first.frequency_difference:.2f} +-50.0 +1.0000"
    assert re.search(row, out)
    assert re.search(r"CoMAC over the pairs of modes", out)
    found = view.as_json(ShownCorrelation(result()))["modes"]
    json.dumps(found, allow_nan=False)
    assert [(p["measured"], p["computed"]) for p in found["pairs"]] == [(1, 1), (2, 2), (3, 3), (4, 4)]
    shapes = modes.measured.shapes * np.linspace(1, 2, 10)[:, None] ** [0, 1, 0, 2]
    unlike = dataclasses.replace(modes, measured=modes.measured._replace(shapes=shapes))
    channels = view.as_json(ShownCorrelation(dataclasses.replace(result(), modes=unlike)))["modes"]["channels"]
    assert np.ptp(unlike.comac) > 0.01
    np.testing.assert_allclose([c["comac"] for c in channels], unlike.comac)
    np.testing.assert_allclose(found["mac"], modes.mac)


def test_a_fit_from_its_file(trivet: Any, files: Path) -> None:
    with h5py.File(files / "fit.nc", "w") as file:
        file["response"] = np.array([written(channel) for channel in fit().channels], dtype=h5py.string_dtype())
        file["natural_frequency"], file["damping"] = fit().modes.frequency, fit().modes.damping
        file["natural_frequency"].attrs["units"] = "Hz"
        file["shape"] = np.stack([fit().modes.shapes.real, fit().modes.shapes.imag], axis=-1)
    code, out, _ = trivet(*COMMAND, "--fit", "fit.nc", "--from", "1 Hz")
    assert code == 0
    assert re.search(r"2:\+rz +1.0000", out)
    found = json.loads(trivet(*COMMAND, "--fit", "fit.nc", "--json")[1])["modes"]
    assert [(p["measured"], p["computed"]) for p in found["pairs"]] == [(1, 1), (2, 2), (3, 3), (4, 4)]
    np.testing.assert_allclose(found["measured_frequency_Hz"], fit().modes.frequency)
    np.testing.assert_allclose([p["frequency_difference"] for p in found["pairs"]], 0.02, atol=1e-3)
    code, out, err = trivet(*COMMAND, "--fit", "m.nc")
    assert (code, out) == (2, "")
    assert "m.nc: holds measured responses, not a modal fit" in err


def test_netcdf(trivet: Any, files: Path) -> None:
    assert trivet(*COMMAND, "--data", "c.nc")[0] == 0
    with xr.open_dataset(files / "c.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.frac, result().frac, rtol=1e-9)
        np.testing.assert_allclose(data.csf, result().csf, rtol=1e-9)
        values = data.computed.sel(part="real") + 1j * data.computed.sel(part="imag")
        np.testing.assert_allclose(values, result().computed.values, rtol=1e-9)
        np.testing.assert_array_equal(data.measured.sel(part="imag"), measured().values.imag)
        assert data.unit.values.tolist()[8:10] == ["m/s^2/N", "rad/s^2/N"]
        assert data.response.values[9] == "2:+rz"
        assert data.frequency.attrs["units"] == "Hz"
        np.testing.assert_allclose(data.measured_position.sel(point="1"), TURN @ [0.003, -0.02, 0.01] + [0, 0, 0.125])
        assert "format = 1" in data.attrs["machine_file"]
    t.save(result(), files / "d.nc")
    with xr.open_dataset(files / "d.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.mac, result().modes.mac)  # type: ignore[union-attr]
        assert data.partner.values.tolist() == [1, 2, 3, 4]
        assert data.channel.values[-1] == "2:+rz"


def test_what_is_drawn(trivet: Any, files: Path) -> None:
    code, _, err = trivet(
        *COMMAND, "--figure", "o.png", "--figure", "o.html", "--entry", "2:+x/2:+x", "--setup-figure", "p.html"
    )
    assert code == 0
    assert [line for line in err.splitlines() if line.startswith("wrote")] == [
        f"wrote {n}" for n in ("p.html", "o.png", "o.html")
    ]
    number = measured().labels.index("2:+x / 2:+x")
    curves = traces(files / "o.html")
    for name, values in (("measured", measured().values), ("computed", result().computed.values)):
        size, phase = (trace for trace in curves if trace["name"] == name)
        np.testing.assert_allclose(numbers(size["y"])[1:], np.abs(values[number])[1:], rtol=1e-9)
        shown = numbers(phase["y"])
        assert np.nanmax(np.abs(shown - np.degrees(np.angle(values[number])))) < 1e-9
    (csac,) = (trace for trace in curves if trace["name"] == "CSAC")
    np.testing.assert_allclose(numbers(csac["y"]), result().csac, rtol=1e-9)
    assert f"FRAC {result().frac[number]:.3f}" in (files / "o.html").read_text(encoding="utf-8")


def test_the_figure_with_modes(tmp_path: Path) -> None:
    from matplotlib.image import imread

    t.figure(result(), tmp_path / "o.png")
    picture = imread(tmp_path / "o.png")
    assert picture.shape[:2] == (1540, 1400)
    blue = (picture[..., 2] > picture[..., 0] + 0.4) & (picture[..., 2] > picture[..., 1] + 0.15)
    orange = (picture[..., 0] > 0.8) & (picture[..., 2] < 0.3) & (picture[..., 1] > 0.5) & (picture[..., 1] < 0.7)
    panels = [
        (slice(150 + 360 * row, 450 + 360 * row), slice(700 * column, 700 * column + 700))
        for row in range(3)
        for column in (0, 1)
    ]
    for rows, columns in panels:
        assert blue[rows, columns].sum() > 300
        assert orange[rows, columns].sum() > 200
    t.figure(result(), tmp_path / "o.html")
    (mac,) = (trace for trace in traces(tmp_path / "o.html") if trace["type"] == "heatmap")
    modes = result().modes
    assert modes is not None
    np.testing.assert_allclose([numbers(row) for row in mac["z"]], modes.mac)
    (pairs,) = (trace for trace in traces(tmp_path / "o.html") if trace.get("name") == "pairs")
    assert pairs["y"] == [f"{k + 1}: {f:.2f} Hz" for k, f in enumerate(modes.measured.frequency)]


def test_the_functions_that_respond_most_are_drawn() -> None:
    lively = np.linalg.norm(
        measured().receptance[:, 1:] * np.where([c.is_rotation for c in measured().responses], 0.0, 1)[:, None], axis=1
    )
    assert set(result().greatest(6)) <= set(np.argsort(-lively)[:7].tolist())
    assert result().greatest(100) == list(range(20))
    one = drawn.panel(result(), 9)
    assert one.axis == "accelerance, rad/s^2/N"
    assert one.title.startswith("2:+rz / 1:-z:  FRAC 0.")
    nought = dataclasses.replace(
        result(), computed=dataclasses.replace(result().computed, values=result().computed.values * 1e-9)
    )
    assert np.isnan(drawn.panel(nought, 2).magnitude[1]).all()


def test_points_on_the_machine(tmp_path: Path) -> None:
    """Where a point was measured and where it lies, the distance told; arrows along responses, and onto points along loads."""
    mapped = MappedPoints(result().placed, measured())
    seen = points_scene(*mapped)
    at = TURN @ np.array(template().points["2"]) + [0, 0, 0.125]
    own = {
        role: [s for s in seen.shapes if s.role == role]
        for role in ("response", "load", "measured point", "point on the machine")
    }
    assert len(own["point on the machine"]) == 3
    np.testing.assert_allclose(next(s.end for s in own["point on the machine"] if s.name.startswith("2 ")), at)
    assert {s.name[:1] for s in own["measured point"]} == {"h"}, "the others were measured where they are"
    np.testing.assert_allclose(own["measured point"][0].end, TURN @ np.array(template().points["h"]) + [0, 0, 0.125])
    (head,) = (s for s in own["response"] if s.name == "2:+x" and np.allclose(s.rings[-1], s.end))
    np.testing.assert_allclose(np.cross(head.end - at, [0, 1, 0]), 0, atol=1e-12)
    assert (head.end - at)[1] > 0, "+x of the measurement is y of {O}"
    assert len([s for s in own["response"] if s.name == "2:+rz"]) == 3, "a turn has two heads"
    hammer = [s for s in own["load"] if s.name == "1:-z"]
    assert max(s.start[2] for s in hammer) > max(s.end[2] for s in hammer) > at[2] + 0.01, "it comes from above"
    t.figure(mapped, tmp_path / "p.html")
    text = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert f"h: {distances(result().placed).greatest * 1e3:.3g} mm" in text
    assert "3 measured points; the farthest was measured" in text
    nowhere = dataclasses.replace(measured(), points={"1": (0.0, 0.0, 0.0), "2": (0.0, 0.0, 0.1)})
    draw_points(MappedPoints(placed(choose("azulay"), setup(), nowhere), nowhere), tmp_path / "p.png")
    from matplotlib.image import imread

    assert imread(tmp_path / "p.png").shape[:2] == (900, 1200)


WRONG = [
    ((*COMMAND[:2], "n.nc", *COMMAND[3:]), "n.nc: cannot be read"),
    ((*COMMAND[:2], "setup.toml", *COMMAND[3:]), "a file of measured responses ends in"),
    ((*COMMAND[:4], "--setup", "nowhere.toml"), "nowhere.toml"),
    (COMMAND[:4], "--setup"),
    ((*COMMAND, "--from", "100"), "the unit is missing"),
    ((*COMMAND, "--from", "2 kHz"), "there are none at frequencies above zero; widen the range"),
    ((*COMMAND, "--to", "0 Hz"), "must be greater than zero"),
    ((*COMMAND, "--from=-5 Hz"), "must be greater than zero"),
    ((*COMMAND, "--loss-factor", "-1"), "loss factor: -1; expected 0 or more"),
    ((*COMMAND, "--figure", "o.png", "--entry", "2:+y/1:+z"), "function 2:+y/1:+z: was not measured; did you mean"),
    ((*COMMAND, "--entry", "2:+x/2:+x"), "--entry: chooses what is drawn; give --figure as well"),
    ((*COMMAND, "--figure", "o.pdf"), ".png or .html"),
    ((*COMMAND, "--setup-figure", "o.pdf"), ".png or .html"),
    ((*COMMAND, "--setup-figure", "o.png", "--figure", "./o.png"), "o.png: given twice"),
    ((*COMMAND, "--data", "c.csv"), "ends in .nc"),
    ((*COMMAND, "--setup-figure", "old.png"), "old.png: exists already"),
    ((*COMMAND[:3], "azulai", *COMMAND[4:]), "azulay"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_wrong_input_is_told_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, files: Path) -> None:
    (files / "old.png").write_text("old")
    before = sorted(path.name for path in files.iterdir())
    code, out, err = trivet(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert sorted(path.name for path in files.iterdir()) == before


def test_points_that_are_not_placed(trivet: Any, files: Path) -> None:
    (files / "setup.toml").write_text(SETUP.replace('others = "platform"', ""))
    code, _, err = trivet(*COMMAND)
    assert code == 2
    assert "point 1: the set-up does not say where it is; add [points.1]" in err
    (files / "setup.toml").write_text(SETUP + '\n[pose]\nposition = ["0 mm", "0 mm", "50 mm"]\n')
    code, _, err = trivet(*COMMAND)
    assert code == 1
    assert "the pose of the set-up is not reached" in err
