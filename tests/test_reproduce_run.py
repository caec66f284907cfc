"""The reproduction as a command: it goes on where it was interrupted, and its files say the same."""

from __future__ import annotations

import csv
import dataclasses
import importlib.metadata
import importlib.util
import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import trivet as public
from trivet.errors import InputError
from trivet.model import Machine
from trivet.model import load as load_machine
from trivet.reproduce import store
from trivet.reproduce.files import write_all
from trivet.reproduce.fitting import misfit
from trivet.reproduce.found import Asked, Chart, Found, Ours, Progress, Series, adapter
from trivet.reproduce.kinds.dimensions import Dimensions
from trivet.reproduce.kinds.dynamic import Dynamic
from trivet.reproduce.kinds.leaning import Lean, Leaning, Sphere, _last, best_sphere
from trivet.reproduce.kinds.nearest_tilt import NearestTilt
from trivet.reproduce.kinds.prototype import Prototype, Standing
from trivet.reproduce.kinds.ring import Ring
from trivet.reproduce.kinds.static import Static
from trivet.reproduce.kinds.tilt import Tilt
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.paper import Item, Paper, default_paper
from trivet.reproduce.run import Reproduction, reproduce

Run = Callable[..., tuple[int, str, str]]
CHEAP = ["table-1", "table-3"]


@pytest.fixture
def asked_for(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Machines of the tables of dimensions that are worked out, table after table."""
    calls: list[tuple[str, ...]] = []
    real = Dimensions.found

    def found(self: Dimensions, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        calls.append(machines)
        return real(self, machines, asked, progress)

    monkeypatch.setattr(Dimensions, "found", found)
    return calls


def again(folder: Path, names: list[str] = CHEAP) -> tuple[Reproduction, list[str]]:
    """A run, and what it tells."""
    words: list[str] = []
    return reproduce(default_paper(), folder, names, tell=words.append), words


def chosen(names: list[str]) -> tuple[Item, ...]:
    return default_paper().chosen(names)


def test_what_is_done_is_not_done_again(tmp_path: Path, asked_for: list[tuple[str, ...]]) -> None:
    first, _ = again(tmp_path)
    second, words = again(tmp_path)
    assert [len(machines) for machines in asked_for] == [1, 4]
    assert first == second
    assert all("taken from" in line for line in words)


def test_an_interrupted_run_goes_on(tmp_path: Path, asked_for: list[tuple[str, ...]], monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the middle of an item: those before it are kept, and nothing is left of it."""
    with monkeypatch.context() as patch:
        patch.setattr(Static, "found", interrupt)
        with pytest.raises(KeyboardInterrupt):
            again(tmp_path, ["table-1", "table-2", "table-3"])
    assert sorted(path.name for path in (tmp_path / "items").iterdir()) == [store.MARK, "table-1.json"]
    _, words = again(tmp_path)
    assert [len(machines) for machines in asked_for] == [1, 4]
    assert "table-1: taken" in words[0]
    assert "table-3: worked out (" in words[1]


def test_a_folder_of_somebody_else_is_not_written_over(tmp_path: Path) -> None:
    (tmp_path / "items").mkdir()
    (tmp_path / "items" / "table-1.json").write_text("mine")
    (tmp_path / "report.html").write_text("mine")
    with pytest.raises(InputError, match="holds other files"):
        again(tmp_path, ["table-1"])
    assert (tmp_path / "items" / "table-1.json").read_text() == (tmp_path / "report.html").read_text() == "mine"


def interrupt(*_: object) -> Found:
    raise KeyboardInterrupt


KILLED = """
import json, os, signal, sys
from pathlib import Path
from trivet.reproduce.paper import default_paper
from trivet.reproduce.run import reproduce

def dying(self, text, encoding=None):
    half = text.encode()[: len(text) // 2]
    if "table-3" in self.name:
        self.write_bytes(half)
        os.kill(os.getpid(), signal.SIGKILL)
    return self.write_bytes(text.encode())

Path.write_text = dying
reproduce(default_paper(), Path(sys.argv[1]), ["table-1", "table-3"])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL there")
def test_a_killed_run_goes_on(tmp_path: Path, asked_for: list[tuple[str, ...]]) -> None:
    """SIGKILL with half an item written."""
    dead = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert dead.returncode == -signal.SIGKILL
    assert not (tmp_path / "items" / "table-3.json").exists()
    _, words = again(tmp_path)
    assert [len(machines) for machines in asked_for] == [4]
    assert "table-1: taken" in words[0]


@pytest.mark.parametrize("part", [0.0, 0.3, 0.9, 1.0])
def test_a_damaged_item_is_done_again(tmp_path: Path, part: float) -> None:
    """Cut off anywhere, or with one digit changed."""
    whole, _ = again(tmp_path, ["table-1"])
    (path,) = (tmp_path / "items").glob("*.json")
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: int(part * len(text))] if part < 1 else text.replace("0.216", "0.217"), encoding="utf-8")
    found, words = again(tmp_path, ["table-1"])
    assert found == whole
    assert words[0].startswith(f"table-1: worked out again, since {path} is damaged")
    assert path.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    "text", ["[]", "null", '{"found": 1, "inputs": 2, "hash": 3}', '{"found": "{}"}', "\xff", "[" * 100_000]
)
def test_what_is_no_item_is_done_again(tmp_path: Path, text: str) -> None:
    whole, _ = again(tmp_path, ["table-1"])
    (path,) = (tmp_path / "items").glob("*.json")
    path.write_bytes(text.encode("latin-1"))
    assert again(tmp_path, ["table-1"])[0] == whole


def forged(folder: Path, item: Item, found: Found) -> None:
    """A file that is whole and of the same inputs."""
    store.keep(folder, item, found)
    assert json.loads(store.path_of(folder, item).read_text(encoding="utf-8"))["inputs"] == store.inputs(item)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda own: (), "holds no numbers"),
        (lambda own: own[1:], "holds no base radius R_b"),
        (lambda own: (own[0]._replace(unit="wombat"), *own[1:]), 'in a unit that is none: "wombat"'),
        (lambda own: (own[0]._replace(unit="deg"), *own[1:]), "tells base radius R_b in units of several kinds"),
        (lambda own: (own[0]._replace(machine="eclipse"), *own[1:]), "tells base radius R_b of other machines"),
        (lambda own: (own[0], *own), "tells base radius R_b of one machine twice"),
    ],
)
def test_an_item_of_something_else_is_done_again(
    tmp_path: Path, change: Callable[[tuple[Ours, ...]], tuple[Ours, ...]], told: str
) -> None:
    whole, _ = again(tmp_path, ["table-1"])
    (outcome,) = whole.outcomes
    forged(tmp_path, outcome.item, Found(change(outcome.found.ours)))
    found, words = again(tmp_path, ["table-1"])
    assert found == whole
    assert told in words[0]
    assert "worked out again" in words[0]


def test_no_number_is_infinite() -> None:
    (own,) = chosen(["table-1"])
    text = json.dumps({"ours": [["base radius R_b", "azulay", "as described", float("inf"), "mm"]]})
    assert misfit(own, adapter().validate_json(text)) == "tells inf for base radius R_b of azulay"


def test_a_curve_of_points_that_are_no_pairs_is_done_again(tmp_path: Path) -> None:
    whole, _ = again(tmp_path, ["table-1"])
    (outcome,) = whole.outcomes
    odd = Chart("c", "", "x", "y", [Series("a", [1.0, 2.0], [3.0])])
    forged(tmp_path, outcome.item, Found(outcome.found.ours, (odd,)))
    assert again(tmp_path, ["table-1"])[0] == whole


def test_all_that_a_folder_holds_is_told(tmp_path: Path, asked_for: list[tuple[str, ...]]) -> None:
    """One item of a whole run is made again, and the others stay; what is stale is left out, and named."""
    whole, _ = again(tmp_path)
    store.path_of(tmp_path, whole.of("table-1").item).unlink()
    found, words = again(tmp_path, ["table-1"])
    assert found == whole
    assert [len(machines) for machines in asked_for] == [1, 4, 1]
    assert words[1].startswith("table-3: taken from")
    path = store.path_of(tmp_path, whole.of("table-3").item)
    path.write_text("{}")
    found, words = again(tmp_path, ["table-1"])
    assert [outcome.item.name for outcome in found.outcomes] == ["table-1"]
    assert words[1] == f"table-3: left out, since {path} is damaged; --only table-3 makes it again"
    assert [len(machines) for machines in asked_for] == [1, 4, 1], "nobody asked for it"
    assert [outcome.item.name for outcome in whole.only(["table-3"]).outcomes] == ["table-3"]


def test_a_second_paper_has_a_folder_and_a_report_of_its_own(tmp_path: Path) -> None:
    """A paper is a value: another one with items of the same names is reproduced alike, and none is taken for the other's."""
    (own,) = chosen(["table-1"])
    other = Paper("Somebody else (1999)", (dataclasses.replace(own, values=own.values[:2]),))
    found = reproduce(other, tmp_path / "other")
    write_all(found, tmp_path / "other", "python")
    page = (tmp_path / "other" / "report.html").read_text(encoding="utf-8")
    assert "Somebody else (1999)" in page
    assert "Azulay et al." not in page
    assert store.kept(tmp_path / "other", own).reason == "is of another setting"


def test_a_changed_machine_setting_or_version_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    again(tmp_path)

    def other(name: str, *_: object) -> Machine:
        return load_machine(name, {"platform_joint.radius": "19 mm"} if name == "eclipse" else None)

    with monkeypatch.context() as patch:
        patch.setattr("trivet.study.machines.load", other)
        _, words = again(tmp_path)
        assert "table-1: taken" in words[0]
        assert "is of another machine eclipse (" in words[1]
    (own,) = chosen(["table-1"])
    assert isinstance(own.work, Dimensions)
    assert store.kept(tmp_path, with_values(own, 3)).reason == "is of another setting"
    with monkeypatch.context() as patch:
        patch.setattr(store, "_code", lambda: "other")
        assert store.kept(tmp_path, own).reason == f"is of another {store.CODE}"
    assert len(store._code()) == 64
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "0.0.1")
    assert store.kept(tmp_path, own).reason == f"is of another {store.VERSION}"


def with_values(item: Item, count: int) -> Item:
    return dataclasses.replace(item, values=item.values[:count])


def made_up() -> Reproduction:
    """Two items of which nothing had to be worked out."""
    table, figure = chosen(["table-5", "fig-12"])
    rows = [
        Ours(f"D_{axis}{axis}", name, setting, None if (name, setting) == ("eclipse", "other") else size * k, "N/um")
        for setting, size in (("as described", 1e4), ("other", 9e3))
        for axis in "xyz"
        for k, name in enumerate(table.machines, 3)
    ]
    charts = (
        Chart(
            "home", "along x", "frequency, Hz", "|H|, µm/N", [Series("a", [1.5, 2.0], [3.0, None]), Series("b", [4.0], [5.0])]
        ),
        Chart("home", "along z", "frequency, Hz", "|H|, µm/N", [Series("a", [1.0], [2.0], "points", "a")], "y"),
    )
    figures = Found((Ours("peak along x", "model", "as described", 2e-6, "um/N"),), charts, ("A note.",))
    return Reproduction(default_paper(), (Outcome(table, Found(tuple(rows))), Outcome(figure, figures)))


def test_found_goes_to_a_file_and_comes_back(tmp_path: Path) -> None:
    store.prepare(tmp_path)
    for outcome in made_up().outcomes:
        store.keep(tmp_path, outcome.item, outcome.found)
        assert Outcome(outcome.item, found_in(tmp_path, outcome.item)).rows == outcome.rows
        assert found_in(tmp_path, outcome.item).notes == outcome.found.notes
        assert found_in(tmp_path, outcome.item).charts == outcome.found.charts


def found_in(folder: Path, item: Item) -> Found:
    found, reason = store.kept(folder, item)
    assert found is not None, reason
    return found


def test_all_files_say_the_same(tmp_path: Path) -> None:
    result = made_up()
    (tmp_path / "report.pdf").touch()  # of another run
    written = write_all(result, tmp_path, "trivet reproduce")
    assert sorted(path.name for path in written) == sorted(path.name for path in tmp_path.iterdir())
    rows = [row for outcome in result.outcomes for row in outcome.rows]
    with (tmp_path / "values.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [(line["quantity"], line["machine"], line["words"]) for line in table] == [
        (row.quantity, row.machine, row.verdict.words) for row in rows
    ]
    for line, row in zip(table, rows, strict=True):
        assert row.ours is not None
        assert float(line["ours"]) * row.unit.factor == pytest.approx(row.ours, rel=1e-15)
        assert line["paper"] == ("" if row.paper is None else row.paper.text)
    with xr.open_dataset(tmp_path / "reproduction.nc", group="table-5", engine="h5netcdf") as data:
        own = result.of("table-5")
        np.testing.assert_array_equal(data["ours"], [row.ours for row in own.rows])
        np.testing.assert_array_equal(data["paper"], [row.paper.value for row in own.rows if row.paper])
        assert list(data["verdict"].values) == [row.verdict.kind for row in own.rows]
        assert int(np.isnan(data["entry_value"]).sum()) == 3
        assert 'name = "eclipse"' in data.attrs["machine_files"]
        assert data.attrs["trivet_version"] == importlib.metadata.version("trivet")
    with xr.open_dataset(tmp_path / "reproduction.nc", group="fig-12", engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["point_x"], [1.5, 2, 4, 1])
        np.testing.assert_array_equal(data["point_y"], [3, np.nan, 5, 2])
        np.testing.assert_array_equal(data["point_series"], [0, 0, 1, 2])
        assert list(data["series_name"].values) == ["a", "b", "a"]
    page = re.sub(r"<script.*?</script>", "", (tmp_path / "report.html").read_text(encoding="utf-8"), flags=re.DOTALL)
    assert re.search(r"""(src|href)=["']?(https?:)?//""", page) is None, "needs no network"
    for row in rows:
        assert row.unit.text(row.ours) in page
        assert row.verdict.words in page or row.paper is None


def test_the_command(trivet: Run, tmp_path: Path) -> None:
    """Whatever the verdicts, what is done is done; a second time all is taken."""
    code, out, err = trivet("reproduce", "--only", "table-1", "--only", "table-3", "-o", "own/folder", "--json")
    assert (code, "table-1: worked out" in err) == (0, True)
    items = json.loads(out)["items"]
    assert [item["name"] for item in items] == CHEAP
    assert items[0]["numbers"][0] | {"reason": "", "least_SI": None} == {
        "quantity": "base radius R_b", "machine": "azulay", "SI_unit": "m", "paper_SI": 0.162, "ours_SI": 0.162,
        "relative_deviation": 0.0, "setting": "as described", "least_SI": None, "greatest_SI": None, "verdict": "input",
        "words": "as put in", "reason": "",
    }  # fmt: skip
    code, out, err = trivet("reproduce", "--only", "table-1", "-o", "own/folder")
    assert (code, "table-1: taken from" in err, "9 of 9 inputs as put in" in out) == (0, True, True)
    assert "table-3: taken from" in err
    assert "Table 3" not in out, "on the screen is what was asked for"
    assert "Table 3: " in Path("own/folder/report.html").read_text(encoding="utf-8"), (
        "the files tell of all that the folder holds"
    )
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--only", "fig4"), "--only fig4: is no table or figure of the paper; did you mean 'fig-4'"),
        (("--only", "tables"), "--only tables: is no table or figure of the paper; did you mean 'table-"),
        (("--only", "table-6"), "--only table-6: is no table or figure of the paper; did you mean 'table-"),
        (("--output", "file", "--only", "table-1"), "file: is a file; the name of a folder was expected"),
        (("--output", "file/below", "--only", "table-1"), "file/below: cannot be made or read"),
        (("--output", "full", "--only", "table-1"), "full: holds other files; choose an empty or a new folder"),
    ],
)
def test_wrong_input(trivet: Run, tmp_path: Path, options: tuple[str, ...], told: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "diary.txt").touch()
    code, out, err = trivet("reproduce", *options)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"trivet: {told}")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["diary.txt", "file", "full"]


def test_a_pdf_needs_a_browser_before_the_work(trivet: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    code, _, err = trivet("reproduce", "--only", "table-1", "--pdf")
    assert code == 1
    assert "neither Chromium" in err
    assert not Path("reproduction").exists()


def nothing(done: int, total: int) -> None:
    assert 0 < done <= total


def value(found: Found, quantity: str, machine: str, setting: str) -> float | None:
    (own,) = (o.value for o in found.ours if (o.quantity, o.machine, o.setting) == (quantity, machine, setting))
    return own


def test_static_is_what_compare_says() -> None:
    found = Static("static", steps=2, balls=("as described", "free")).found(("azulay", "eclipse"), (), nothing)
    samples = public.compare("azulay", "eclipse", steps=2, finer=1).samples()
    for name, own in samples.items():
        assert value(found, "mean K_zz", name, "as described") == own["K_zz"].mean
        assert value(found, "variance K_xx", name, "as described") == own["K_xx"].variance
        assert value(found, "points", name, "as described") == own["K_xx"].n
        free = value(found, "mean K_xx", name, "balls free")
        assert free is not None
        assert free < own["K_xx"].mean, "a free ball resists less"


def test_dynamic_is_what_compare_and_frf_say() -> None:
    rigid = "drives rigid, balls 300 N m/rad"
    work = Dynamic(
        "dynamic", variants=(rigid, "balls clamped"), premise=rigid, curves=(rigid,), low=100.0, high=2000.0, points=50
    )
    (table,) = chosen(["table-5"])
    found = work.found(("azulay",), table.asked, nothing)
    settings = list(dict.fromkeys(own.setting for own in found.ours))
    assert settings == [rigid, "as described"], "the premise first, and not what repeats another: the files clamp balls"
    compared = public.compare_dynamics("azulay", sensitivity=[rigid])
    for setting in ("as described", rigid):
        least = compared.of("azulay", setting).along("z")
        assert least is not None
        assert value(found, "D_zz", "azulay", setting) == least.stiffness
    machine = load_machine("azulay").with_rigid_drives().with_spherical(300.0)
    response = public.frf(machine, low=100, high=2000, points=50)
    chart = next(chart for chart in found.charts if chart.panel == "xx")
    curve = next(series for series in chart.series if series.name == "azulay")
    np.testing.assert_allclose(curve.x, response.frequency, rtol=1e-5)
    np.testing.assert_allclose(np.array(curve.y, float), 1e6 * abs(response.entry("xx")), rtol=1e-5)
    mark = next(series for series in chart.series if series.like == "azulay")
    assert mark.y == [pytest.approx(1 / 0.178, rel=1e-5)], "Table 5 as a peak"


def test_tilts_are_what_tilt_says() -> None:
    """Every sphere once, None where the machine reaches nothing, and from home no farther than from upright."""
    work = Tilt("tilt", "radial", 0.1, 0.008, (0.008, 0.016), (0.1, 0.17), bodies=False, step=10.0)
    found = work.found(("azulay",), (), nothing)
    report = public.tilt("azulay", 0.008, 0.1, neutral="radial", azimuths=3, step=np.radians(10), bodies=False)
    own = str(Sphere("radial", 0.1, 0.008))
    assert value(found, "tilt", "azulay", own) == pytest.approx(report.tilt, abs=1e-9), "one azimuth stands for all"
    assert value(found, "tilt", "azulay", str(Sphere("radial", 0.17, 0.008))) is None
    assert found.ours[0].setting == own == "radial, z0 100 mm, radius 8 mm", "what is set beside the paper comes first"
    one_sided = value(found, "tilt, no singularity crossed", "azulay", own)
    assert one_sided is not None
    assert one_sided == pytest.approx(report.connected_tilt)
    assert found.notes == (
        f"azulay, {own}: {np.degrees(report.tilt):.1f}°; every way from upright beyond {np.degrees(one_sided):.0f}° crosses a "
        "Type 2 singularity.",
    )


def test_ways_without_a_singularity_on_the_way() -> None:
    """Sides all alike bar nothing; a row of another sign bars what lies beyond, with every roll; a gap in it opens the way."""
    sides = np.ones((1, 6, 8))
    assert _last(sides) == [5]
    sides[0, 3] = -1
    assert _last(sides) == [2]
    sides[0, 3, 5] = 1
    assert _last(sides) == [5]
    sides[0, 0] = 0
    assert _last(sides) == [0]


@pytest.mark.parametrize(
    ("degrees", "told"),
    [
        ((94, 93, 93), "94.0°; a way from upright crosses no singularity."),
        ((94, 31, 93), "94.0°; every way from upright beyond 31° crosses a Type 2 singularity."),
        (
            (94, 31, 60),
            "94.0°; every way from upright beyond 31° crosses a Type 2 singularity, and beyond 60° the poses of the grid "
            "do not hang together with upright.",
        ),
        ((33, 29, 30), "33.0°; beyond 30° the poses of the grid do not hang together with upright."),
    ],
)
def test_what_bars_the_way_is_told_in_words(degrees: tuple[float, ...], told: str) -> None:
    tilt, one_sided, crossing = np.radians(degrees)
    lean = Lean(Sphere("radial", 0.1, 0.00825), tilt, one_sided, crossing, np.radians(1.0))
    assert lean.words("azulay") == f"azulay, radial, z0 100 mm, radius 8.25 mm: {told}"


def test_machines_that_are_not_round_are_seen_from_all_sides() -> None:
    held: dict[str, Any] = {"chains.leg.base": {"azimuth": "0 deg"}, "guide.travel": ["-60 deg", "60 deg"]}

    def azimuths(name: str, settings: dict[str, Any] | None = None) -> int:
        return Leaning(load_machine(name, settings), "radial", False, 1.0).azimuths

    assert (azimuths("azulay"), azimuths("ben-horin")) == (1, 36)
    assert azimuths("azulay", held) == 36


def test_how_far_machines_come_on_all_spheres_of_the_grid() -> None:
    """Of one sphere, the most over all axes; what is nearest there is greatest as well, and told once."""
    (row,) = chosen(["table-3-tilt"])
    found = NearestTilt("nearest tilt", "radial", "radial", (0.1,), (0.008,), step=10.0).found(("azulay",), row.asked, nothing)
    own = [one.value for one in found.ours if one.quantity == "tilt, no singularity crossed" and one.value is not None]
    assert len(own) == 4
    assert f"without crossing a singularity: azulay {np.degrees(max(own)):.0f}°." in found.notes[-2]
    assert len(found.notes) == 4 + 2


@given(st.floats(0.05, 0.15), st.floats(1.0, 17.0), st.sampled_from([0.3, 1.0]))
def test_the_best_sphere_lies_between_those_of_the_grid(height: float, radius: float, weight: float) -> None:
    """Of a smooth valley, whose bottom may lie outside; never worse than the grid, and between its ends."""
    heights, radii = (0.06, 0.08, 0.1, 0.12, 0.14), (0.002, 0.004, 0.008, 0.016)

    def tilt(sphere: Sphere) -> float | None:
        apart = (weight * (sphere.height - height) / 0.01) ** 2 + (1e3 * sphere.radius - radius) ** 2 / 4
        return 1.0 - 0.02 * apart if sphere.height < 0.2 else None

    def miss(value: float) -> float:
        return 1.0 - value

    best = best_sphere(tilt, 1.0, "radial", heights, radii)
    assert best is not None
    found = tilt(best)
    assert found is not None
    on_grid = min(miss(own) for h in heights for r in radii if (own := tilt(Sphere("radial", h, r))) is not None)
    assert miss(found) <= on_grid
    bottom = Sphere("radial", min(max(height, heights[0]), heights[-1]), min(max(radius / 1e3, radii[0]), radii[-1]))
    lowest = tilt(bottom)
    assert lowest is not None
    assert miss(found) < miss(lowest) + 0.0005, "steps of a small part of the grid's"
    assert heights[0] <= best.height <= heights[-1]
    assert radii[0] <= best.radius <= radii[-1]
    assert best_sphere(lambda sphere: None, 1.0, "radial", heights, radii) is None


@given(st.floats(0.061, 0.079), st.floats(0.2, 2.0), st.booleans())
def test_the_best_sphere_lies_next_to_a_jump(height: float, slope: float, is_turned: bool) -> None:
    """Up to a jump, slantwise over heights and radii, the tilt rises with the radius; beyond, it is far too great."""
    heights, radii = (0.06, 0.08, 0.1, 0.12, 0.14), (0.002, 0.008, 0.014, 0.02)

    def tilt(sphere: Sphere) -> float:
        up = sphere.height - height - slope * (sphere.radius - 0.002)
        return 3.0 if (up <= 0 if is_turned else up >= 0) else 1.0 + 10 * sphere.radius - abs(up)

    best = best_sphere(tilt, 1.25, "radial", heights, radii)
    assert best is not None
    assert best.radius == 0.02
    assert abs(tilt(best) - 1.2) < 1e-4, "at the foot of the jump, on the greatest sphere"


def test_the_nearest_sphere_and_that_of_the_greatest_tilt(monkeypatch: pytest.MonkeyPatch) -> None:
    """On spheres of 2 to 8 mm about z0 = 100 mm azulay turns over, and its tilt passes the published one between them."""
    monkeypatch.setattr("trivet.reproduce.kinds.leaning.HALVINGS", 2)
    (row,) = chosen(["table-3-tilt"])
    near = NearestTilt("nearest tilt", "radial", "elevation", (0.1, 0.17), (0.002, 0.008), step=10.0).found(
        ("azulay",), row.asked, nothing
    )
    ends = [
        public.tilt("azulay", r, 0.1, neutral="radial", azimuths=3, step=np.radians(10), bodies=False).tilt
        for r in (0.002, 0.008)
    ]
    assert ends[0] > np.radians(94) > ends[1]
    assert value(near, "greatest tilt", "azulay", "radial, sphere of the greatest tilt") == pytest.approx(max(ends))
    nearest = value(near, "tilt", "azulay", "radial, nearest sphere")
    assert nearest is not None
    assert abs(nearest - np.radians(94)) < min(abs(end - np.radians(94)) for end in ends), "between the spheres of the grid"
    assert next(own.setting for own in near.ours if own.quantity == "tilt") == "radial, nearest sphere"
    assert next(own.setting for own in near.ours if own.quantity == "greatest tilt") == "elevation, sphere of the greatest tilt"
    for quantity in ("tilt", "greatest tilt"):
        settings = {own.setting for own in near.ours if own.quantity == quantity}
        assert {setting.partition(",")[0] for setting in settings} == {"radial", "home", "normal", "elevation"}
    assert any("reached at their pole by all 1 machines" in note for note in near.notes)


def test_the_ring_is_that_of_the_map() -> None:
    work = Ring("ring", rolls=(0.0, np.radians(60)), heights=(0.1,), circle=0.002)
    found = work.found(("azulay",), chosen(["fig-4"])[0].asked, nothing)
    (curve,) = public.singularity_map("azulay", roll=0.0).curves
    away = np.hypot(*curve.surface.position[:, :2].T)
    assert value(found, "least radius", "azulay", "roll 0 deg") == away.min()
    assert value(found, "greatest radius", "azulay", "roll 0 deg") == away.max()
    mean = value(found, "mean radius", "azulay", "roll 0 deg")
    assert mean == pytest.approx(curve.length / (2 * np.pi), rel=1e-3), "with one roll it is a circle"
    least = value(found, "least radius", "azulay", "roll 60 deg")
    assert least is not None
    assert least > away.max(), "the ring widens with the roll"
    over, above = found.charts
    highest = max(
        (y, x) for series in over.series for x, y in zip(series.x, series.y, strict=True) if y is not None and x > 0.1
    )
    assert 1 < highest[1] < 3, "mm; the Jacobian breaks down near the ring"
    circle = next(series for series in above.series if series.style == "dashed")
    np.testing.assert_allclose(np.hypot(circle.x, np.array(circle.y, float)), 2.0, rtol=1e-5)


def test_the_prototype_is_beside_its_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without noise, and corrected to the very truth, the responses are the measured ones; those of the model are not."""
    truth = Standing("420 N m/rad", 0.03, changes={"radial.stiffness": "2.4 N/um"})
    none: dict[str, object] = {"paths": (), "before": (), "after": (), "deviation": ()}
    free = SimpleNamespace(free=SimpleNamespace(kinds=()))

    def corrected(*_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(machine=truth.machine("rmmt"), loss_factor=0.03, problem=free, **none)

    monkeypatch.setattr("trivet.study.update.update", corrected)
    work = Prototype("prototype", Standing("300 N m/rad", 0.02), truth, {"ball.stiffness": 1.0}, lines=60, noise=0.0)
    found = work.found(("rmmt",), (), nothing)
    for axis in "xz":
        for quantity in (f"resonance along {axis}", f"peak along {axis}"):
            values = [
                value(found, quantity, case, "as described") for case in ("measured (stand-in)", "model, corrected", "model")
            ]
            assert values[0] == values[1] != values[2]
        assert value(found, f"FAAC along {axis}", "model, corrected", "as described") == pytest.approx(1, abs=1e-12)
        before = value(found, f"FAAC along {axis}", "model", "as described")
        assert before is not None
        assert before < 0.95
    assert [chart.panel for chart in found.charts] == ["along x", "along z"]


DOCS = Path(__file__).parents[1] / "docs"


def make_replication() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_replication", DOCS / "make_replication.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(tmp_path: Path) -> None:
    """Number by number what is worked out in seconds; of the rest what is said of it."""
    module = make_replication()
    text = module.PAGE.read_text(encoding="utf-8")
    hint = "run: python docs/make_replication.py"
    result, _ = again(tmp_path, ["table-1", "table-2", "table-3", "fig-4"])
    for outcome in result.outcomes:
        assert module.item_text(outcome) in text, hint
        assert f"| {outcome.item.where} | {outcome.item.title} | {outcome.summary} |" in text, hint
    assert module.rules_text() in text, hint
    for own in chosen([]):
        assert f"### {own.where}: {own.title}\n\n{own.setting}" in text, hint
        assert own.remark in text, hint
