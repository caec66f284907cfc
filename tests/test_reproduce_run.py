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

import numpy as np
import pytest
import xarray as xr

import trivet as public
from trivet.errors import InputError
from trivet.model import Machine
from trivet.model import load as load_machine
from trivet.reproduce import store
from trivet.reproduce.files import write_all
from trivet.reproduce.found import Asked, Chart, Found, Ours, Progress, Series
from trivet.reproduce.kinds.dimensions import Dimensions
from trivet.reproduce.kinds.dynamic import Dynamic
from trivet.reproduce.kinds.nearest_tilt import NearestTilt
from trivet.reproduce.kinds.prototype import Prototype, Standing
from trivet.reproduce.kinds.ring import Ring
from trivet.reproduce.kinds.static import Static
from trivet.reproduce.kinds.tilt import Sphere, Tilt
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.paper import Item, chosen
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
    return reproduce(chosen(names), folder, tell=words.append), words


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
from trivet.reproduce.paper import chosen
from trivet.reproduce.run import reproduce

def dying(self, text, encoding=None):
    half = text.encode()[: len(text) // 2]
    if "table-3" in self.name:
        self.write_bytes(half)
        os.kill(os.getpid(), signal.SIGKILL)
    return self.write_bytes(text.encode())

Path.write_text = dying
reproduce(chosen(["table-1", "table-3"]), Path(sys.argv[1]))
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
    return Reproduction((Outcome(table, Found(tuple(rows))), Outcome(figure, figures)))


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
        "relative_deviation": 0.0, "setting": "as described", "least_SI": None, "greatest_SI": None, "verdict": "reproduced",
        "words": "reproduced to its digits", "reason": "",
    }  # fmt: skip
    assert "not reproducible" in {number["verdict"] for number in items[1]["numbers"]}
    code, out, err = trivet("reproduce", "--only", "table-1", "-o", "own/folder")
    assert (code, "table-1: taken from" in err, "9 of 9 numbers reproduced" in out) == (0, True, True)
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize(
    ("options", "told"),
    [
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
    work = Dynamic("dynamic", variants=(rigid,), curves=(rigid,), low=100.0, high=2000.0, points=50)
    (table,) = chosen(["table-5"])
    found = work.found(("azulay",), table.asked, nothing)
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
    """Every sphere once, None where the machine reaches nothing; the nearest is the nearest."""
    work = Tilt("tilt", "radial", 0.1, 0.008, (0.008, 0.016), (0.1, 0.17), bodies=False, step=10.0)
    found = work.found(("azulay",), (), nothing)
    report = public.tilt("azulay", 0.008, 0.1, neutral="radial", azimuths=3, step=np.radians(10), bodies=False)
    assert value(found, "tilt", "azulay", str(Sphere("radial", 0.1, 0.008))) == report.tilt
    assert value(found, "tilt", "azulay", str(Sphere("radial", 0.17, 0.008))) is None
    assert found.ours[0].setting == "radial, z0 100 mm, radius 8 mm", "what is set beside the paper comes first"
    (row,) = chosen(["table-3-tilt"])
    near = NearestTilt("nearest tilt", "radial", (0.1, 0.17), (0.002, 0.008), step=10.0).found(("azulay",), row.asked, nothing)
    tilts = {radius: public.tilt("azulay", radius, 0.1, neutral="radial", azimuths=3, step=np.radians(10), bodies=False).tilt
             for radius in (0.002, 0.008)}  # fmt: skip
    assert tilts[0.002] > tilts[0.008] > np.radians(86), "the nearest is not the greatest"
    best = min(tilts.values(), key=lambda t: abs(t - np.radians(94)))
    assert value(near, "tilt", "azulay", "radial, nearest sphere") == best
    assert any("reached at their pole by all 1 machines" in note for note in near.notes)


def test_the_ring_is_that_of_the_map() -> None:
    found = Ring("ring", rolls=(0.0, np.radians(60)), heights=(0.1,)).found(("azulay",), chosen(["fig-4"])[0].asked, nothing)
    (curve,) = public.singularity_map("azulay", roll=0.0).curves
    away = np.hypot(*curve.surface.position[:, :2].T)
    assert value(found, "least radius", "azulay", "roll 0 deg") == away.min()
    assert value(found, "greatest radius", "azulay", "roll 0 deg") == away.max()
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
