"""The command locks: the sets, advice and drives as tables, JSON, NetCDF and figures, and wrong input."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from test_locks import fewer, sets, to_and_fro

import trivet as t
from trivet.model.elements import Drivable
from trivet.show import locks as drawn
from trivet.study import lock_advice, redundant
from trivet.views import locks as view

PATH = """
[[poses]]
position = ["0 mm", "4 mm", "125 mm"]
roll = "0.3 rad"

[[poses]]
position = ["0 mm", "-4 mm", "125 mm"]
roll = "-0.3 rad"
"""


RANGE = "--from", "20 Hz", "--to", "2 kHz", "--loss-factor", "0.1"


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    """A machine with seven drives, and a path."""
    machine, path = tmp_path / "fewer.toml", tmp_path / "path.toml"
    t.write(fewer("leg-1").with_locks({"leg-1.guide": 0.2, "leg-2.guide": 0.02, "leg-3.guide": -0.03}), machine)
    path.write_text(PATH, encoding="utf-8")
    return str(machine), str(path)


def test_lock_sets_as_a_table_and_as_json(trivet: Any) -> None:
    code, out, _ = trivet("locks", "rmmt")
    assert code == 0
    assert "rmmt: 9 drives, 3 to spare" in out
    assert "84 sets of 3 to lock; 27 leave six freedoms, 11 of them different by the machine's turns about z" in out
    assert "19 of these are singular at the machine's home" in out
    told = "4: leg-1 takes 2 freedoms of the platform; leg-2 moves by itself; leg-3 moves by itself"
    assert f"leg-1 guide tangential radial 3 4 {told}" in " ".join(out.split())
    found = view.as_json(sets())
    assert len(found["lock_sets"]) == 84
    assert sum(one["leaves_six_freedoms"] for one in found["lock_sets"]) == 27
    assert found["spare_drives"] == found["symmetry"] == 3
    assert sum(one["platform_freedoms_at_home"] == 6 for one in found["lock_sets"]) == 8


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What the studies give to the command."""
    seen: list[Any] = []

    def watched(study: Any) -> Any:
        def call(*given: Any, **named: Any) -> Any:
            seen.append(study(*given, **named))
            return seen[-1]

        return call

    monkeypatch.setattr(lock_advice, "advise_locks", watched(lock_advice.advise_locks))
    monkeypatch.setattr(redundant, "redundant_path", watched(redundant.redundant_path))
    return seen


def test_advice_as_json_figures_and_data(trivet: Any, results: list[Any], files: tuple[str, str], tmp_path: Path) -> None:
    machine, path = files
    kept, picture, page = (str(tmp_path / name) for name in ("locks.nc", "locks.png", "locks.html"))
    outputs = "--data", kept, "--figure", picture, "--figure", page
    code, out, _ = trivet("locks", machine, "--path", path, "--steps", "4", "--objective", "K_zz", "--json", *outputs)
    assert code == 0
    found = json.loads(out)
    (own,) = results
    best, *rest = found["advice"]
    assert best["least_N_per_m"] == pytest.approx(own.best.value, rel=1e-9)
    assert best["locks"][0]["joint"] == "leg-1.guide"
    assert best["locks"][0]["coordinate_rad"] == pytest.approx(own.best.coordinates["leg-1.guide"], abs=1e-9)
    assert best["worst_pose"]["roll_rad"] == pytest.approx(math.copysign(0.3, best["worst_pose"]["position_m"][1]))
    assert [one["reached"] for one in rest] == [False, False]
    assert all("limit" in one["reason"] or "close" in one["reason"] for one in rest)
    with xr.open_dataset(kept, engine="h5netcdf") as data:
        assert data["least"].values[0] == pytest.approx(own.best.value, rel=1e-9)
        assert data["least"].attrs["units"] == "N/m"
        assert data["drive_rate"].values[0] == pytest.approx(own.best.rate, rel=1e-9)
        assert np.isnan(data["drive_rate"].values[1:]).all()
        locked = data["locked_coordinate"].sel(lock_set="leg-1.guide")
        assert np.isfinite(locked).sum() == 1
        assert np.isnan(data["value"].values[1:]).all()
        assert data["value"].values[0].min() == pytest.approx(own.best.value, rel=1e-9)
        assert data.attrs["objective_name"] == "K_zz"
        assert data["chosen_roll"].values[0] == pytest.approx(data["roll"].values)
        assert data["roll"].values[[0, -1]] == pytest.approx([0.3, -0.3])
    assert Path(picture).read_bytes()[:4] == b"\x89PNG"
    assert "which drives to lock" in Path(page).read_text(encoding="utf-8")
    shown = drawn.points(own)
    assert shown.names == ["leg-1.guide"]
    assert shown.least[0] == pytest.approx(own.best.value / 1e6)
    assert shown.least[0] <= shown.most[0]
    assert best["drive_rate"] == pytest.approx(own.best.rate, rel=1e-9)
    assert best["travel_margin"] == pytest.approx(own.best.margin, abs=1e-9)
    assert shown.words[0].endswith(f", drive rate {own.best.rate:.3g}")
    assert found["stiffness_N_per_m"]["K_zz"] >= own.best.value * (1 - 1e-9)  # between the poses it may be less
    assert found["stiffness_as_the_file_locks_N_per_m"]["K_zz"] >= own.as_is * (1 - 1e-9)
    assert found["sets_equal"] == 1
    assert found["as_the_file_locks_N_per_m"] == pytest.approx(own.as_is, rel=1e-9)
    assert shown.as_is == pytest.approx(own.as_is / 1e6)


def test_all_drives_as_tables_figures_and_data(trivet: Any, results: list[Any], files: tuple[str, str], tmp_path: Path) -> None:
    machine, path = files
    kept, picture, page = (str(tmp_path / name) for name in ("drives.nc", "drives.png", "drives.html"))
    outputs = "--data", kept, "--figure", picture, "--figure", page
    task = "--path", path, "--steps", "4", "--objective", "K_zz", "--redundant"
    code, out, _ = trivet("locks", machine, *task, *outputs)
    assert code == 0
    (own,) = results
    assert f"{own.least / 1e6:.5g} N/µm" in out
    assert re.search(rf"^best locks +{own.locked_least / 1e6:.5g} N/µm +guide \S+ / - / -", out, re.MULTILINE)
    with xr.open_dataset(kept, engine="h5netcdf") as data:
        assert data["joint_coordinate"].shape == (17, 7) == (len(own.along), len(own.drives))
        assert np.allclose(data["value"], own.value, rtol=1e-9)
        assert float(data["value"].min()) == pytest.approx(own.least)
        assert data["joint_coordinate"].sel(drive="leg-1.guide").values == pytest.approx(own.coordinates[:, 0], abs=1e-9)
    assert Path(picture).read_bytes()[:4] == b"\x89PNG"
    assert "all drives at work" in Path(page).read_text(encoding="utf-8")
    curves = {curve.name: curve for curve in drawn.drive_curves(own)}
    assert list(curves) == list(own.drives)
    travel = math.radians(40)
    assert curves["leg-1.guide"].values == pytest.approx((own.coordinates[:, 0] + travel / 2) / travel)
    alone, work, locks = drawn.value_curves(own)
    assert alone.values == pytest.approx(own.alone[::2] / 1e6)
    assert alone.at == pytest.approx(own.along[::2])
    assert np.all(work.values[::2] <= alone.values * (1 + 1e-9))
    assert locks.values.min() <= work.values.min()


class Seen(Exception):
    """What the studies are asked for."""


@pytest.fixture
def asked(trivet: Any, files: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> Any:
    """Calls the command, and gives the arguments of the study that it calls."""

    def seen(*given: Any, **named: Any) -> None:
        raise Seen(*given, named)

    monkeypatch.setattr(lock_advice, "advise_locks", seen)
    monkeypatch.setattr(redundant, "redundant_path", seen)

    def call(*arguments: str) -> tuple[Any, ...]:
        with pytest.raises(Seen) as caught:
            trivet("locks", files[0], *({"PATH": files[1]}.get(word, word) for word in arguments))
        return caught.value.args

    return call


def test_a_task_reaches_the_studies_as_it_was_given(asked: Any) -> None:
    machine, family, goal, named = asked("--path", "PATH", "--modes", "own", "--drives", "rigid")
    assert (len(family.coordinates), named["modes"], named["roll"], goal) == (13, "own", None, t.Goal())
    drives = [e for leg in machine.legs for e in leg.chain.elements if isinstance(e, Drivable) and e.actuated]
    assert {e.stiffness for e in drives} == {None}
    _, family, goal, named = asked("--hemisphere", "--radius", "4 mm", "--height", "121 mm", "--roll", "10 deg")
    heights = family.places(family.coordinates).position[:, 2]
    assert (heights.min(), heights.max()) == pytest.approx((0.121, 0.125))
    assert (named["roll"], named["modes"]) == (pytest.approx(math.radians(10)), "all")
    assert [asked("--hemisphere", *roll)[3]["roll"] for roll in ((), ("--roll", "best"), ("--roll=-alpha",))] == [
        None, "best", "-alpha"
    ]  # fmt: skip
    (pose,), goal = asked("--tilt", "5 deg", "--roll", "8 deg", "--objective", "D_zz", *RANGE)[1:3]
    assert pose == pytest.approx((0.0, 0.0, 0.125, 0.0, math.radians(5), math.radians(8)))
    assert goal == t.Goal("D_zz", 20.0, 2000.0, 0.1)
    assert asked("--path", "PATH", "--steps", "3", "--redundant", "--rate", "0.5")[3]["rate"] == 0.5


def test_where_drives_are_locked_is_written_as_it_is_read() -> None:
    where = view.where_locked(fewer("leg-1"), {"leg-1.guide": math.radians(5), "leg-2.radial": 0.0442})
    assert where == "leg-1.guide=5 deg, leg-2.radial=44.2 mm"


def test_a_pose_with_travel_in_words(trivet: Any, files: tuple[str, str]) -> None:
    code, out, _ = trivet("locks", files[0], "--tilt", "5 deg", "--objective", "travel")
    assert code == 0
    assert "fewer: one pose, roll given, all working modes" in out
    assert "least travel by lock set" in out


REDUNDANT = "--path", "PATH", "--redundant"
DYNAMIC = "MACHINE", "--tilt", "1 deg", "--objective", "D_zz"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("azulay",), 2, "azulay: has 6 drives, none to spare"),
        (("MACHINE", "--tilt", "1 deg", "--objective", "K_xy"), 2, "objective 'K_xy' is not known; did you mean"),
        (("MACHINE", "--position", "0.2 m, 0 m, 0.125 m", "--objective", "travel"), 1, "no lock set reaches all of the task"),
        (("MACHINE", "--redundant"), 2, "--redundant: all drives are chosen along a path; give --path"),
        (("MACHINE", "--rate", "2"), 2, "--rate: is of all drives at work"),
        (("MACHINE", *REDUNDANT, "--rate", "0"), 2, "rate: 0 travels"),
        (("MACHINE", "--path", "PATH", "--hemisphere"), 2, "one task at a time"),
        (("MACHINE", "--path", "PATH", "--roll", "0 deg"), 2, "one task at a time"),
        (("MACHINE", "--steps", "3"), 2, "--steps: of a path or a hemisphere"),
        (("MACHINE", "--radius", "3 mm"), 2, "--radius, --height: of the hemisphere"),
        (("MACHINE", "--figure", "a.png"), 2, "--figure: of advice for a task; give --path, --hemisphere or a pose"),
        (
            ("MACHINE", "--objective", "banana", "--modes", "some", "--loss-factor", "-3"),
            2,
            "--objective, --modes, --loss-factor: of advice for a task",
        ),
        (("MACHINE", "--from", "1 Hz"), 2, "--from: of advice for a task"),
        (
            ("MACHINE", "--tilt", "1 deg", "--loss-factor", "0"),
            2,
            "--loss-factor: of a dynamic stiffness; choose an --objective",
        ),
        ((*DYNAMIC, "--loss-factor", "-1"), 2, "loss factor: -1; expected 0 or more, and below 2"),
        ((*DYNAMIC, "--loss-factor", "nan"), 2, "loss factor: nan; expected 0 or more, and below 2"),
        ((*DYNAMIC, "--loss-factor", "0"), 2, "loss factor: 0; expected 1e-08 or more"),
        ((*DYNAMIC, "--from", "1 kHz", "--to", "5 Hz"), 2, "frequencies: 1000 Hz to 5 Hz; expected a range that rises"),
        (("MACHINE", "--path", "absent.toml"), 2, "absent.toml"),
        (("MACHINE", "--hemisphere", "--objective", "D_xx"), 2, "wants rolls that are known"),
        (("MACHINE", "--hemisphere", "--roll", "half"), 2, '--roll "half"'),
        (("MACHINE", "--tilt", "1 deg", "--modes", "some"), 2, "modes 'some': expected all, or own"),
    ],
)
def test_wrong_input_is_one_line(
    trivet: Any, files: tuple[str, str], arguments: tuple[str, ...], code: int, words: str
) -> None:
    given = [{"MACHINE": files[0], "PATH": files[1]}.get(word, word) for word in arguments]
    found, out, err = trivet("locks", *given)
    assert (found, out) == (code, "")
    assert words in err
    assert err.count("\n") == 1


def test_the_path_of_the_tests_is_that_of_the_file(files: tuple[str, str]) -> None:
    ours, theirs = to_and_fro(), t.along_path(files[0], files[1], 4)
    assert np.allclose(ours.places(ours.coordinates).position, theirs.places(theirs.coordinates).position)
