"""An atlas along a path file and in a block, and its responses in a file."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import trivet as t
from trivet import files
from trivet.errors import InputError
from trivet.show import atlas as drawn

PATH = """
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]
[[poses]]
position = ["3 mm", "0 mm", "125 mm"]
tilt = "15 deg"
azimuth = "20 deg"
roll = "-20 deg"
[[poses]]
position = ["3 mm", "0.5 mm", "125 mm"]
tilt = "16 deg"
azimuth = "20 deg"
roll = "-19 deg"
"""
RANGE = ("map", "azulay", "--quantity", "dynamic-stiffness", "--entries", "xx", "--from", "50 Hz", "--to", "700 Hz")


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "path.toml"
    path.write_text(PATH)
    return str(path)


def test_poses_along_a_path_file(file: str) -> None:
    family = t.along_path("azulay", file, 6)
    grid = family.coordinates[:, 0]
    assert {1.0, 2.0, 3.0} <= set(grid)
    assert 6 <= len(grid) - 1 <= 7
    # Steps of about the same size: most of them lead to the second pose, which is farther.
    assert (grid < 2).sum() > (grid > 2).sum()
    there = family.places(np.array([[1.0], [1.5], [2.0], [3.0], [3.1], [0.9]]))
    assert there.roll is not None
    np.testing.assert_allclose(there.position[:4, 0], [0, 0.0015, 0.003, 0.003])
    np.testing.assert_allclose(np.degrees(there.tilt[:4]), [0, 7.5, 15, 16])
    np.testing.assert_allclose(np.degrees(there.azimuth + there.roll)[:4], [0, 0, 0, 1], atol=1e-9)
    assert np.isnan(there.position[4:]).all()
    np.testing.assert_allclose(family.spacing, np.diff(grid).max())


def test_a_path_by_steps_that_cannot_be(file: str) -> None:
    with pytest.raises(InputError, match="steps: 0 along a path; expected 1 to"):
        t.along_path("azulay", file, 0)


def test_rolls_that_the_path_has(file: str) -> None:
    with pytest.raises(InputError, match="has rolls of its own"):
        t.atlas("azulay", t.along_path("azulay", file, 2), roll="best K_xx", low=50, high=700)


@pytest.mark.parametrize(
    ("size", "labels", "count"),
    [
        ((0.004, 0.0, 0.0), ("x, mm",), 3),
        ((0.0, 0.004, 0.002), ("y, mm", "z, mm"), 9),
        ((0.004, 0.002, 0.002), ("x, mm", "y, mm"), 9),
    ],
)
def test_figures_of_blocks(tmp_path: Path, size: Any, labels: tuple[str, ...], count: int) -> None:
    """Along the axes that are open; of three the last is gone over."""
    found = t.atlas(
        "azulay", t.in_block((0, 0, 0.125), size, (2, 2, 2)), roll=0.0, entries=("xx",), low=300, high=700, points=5
    )
    panel = drawn._Panel.of(found, 0)
    assert panel.labels == labels
    assert len(panel.values) == count
    assert panel.values.min() * 1e6 == pytest.approx(found.stiffness.min())
    assert (panel.y is None) == (len(labels) == 1)
    assert panel.star == pytest.approx([1e3 * found.worst[0].position["xyz".index(label[0])] for label in labels])
    t.figure(found, tmp_path / "block.png")
    t.figure(found, tmp_path / "block.html")


@cache
def small() -> t.Atlas:
    return t.atlas("azulay", t.in_block((0, 0, 0.125), (0.004, 0, 0), (4, 1, 1)), roll=0.0, low=50, high=700, points=40)


def test_responses_in_a_file(tmp_path: Path) -> None:
    told = list[tuple[int, int]]()
    t.save_responses(small(), tmp_path / "atlas.nc", progress=lambda done, total: told.append((done, total)))
    with xr.open_dataset(tmp_path / "atlas.nc", engine="h5netcdf") as saved:
        found = saved["receptance"].sel(part="real").values + 1j * saved["receptance"].sel(part="imag").values
        assert saved["receptance"].dims == ("point", "entry", "frequency", "part")
        np.testing.assert_array_equal(found, np.concatenate([values for _, values in small().receptances()]))
        np.testing.assert_allclose(np.abs(found).max(axis=0), saved["greatest_receptance"], rtol=1e-12)
        np.testing.assert_allclose(saved["worst_stiffness"].sel(entry="yy"), small().worst[1].stiffness)
    assert told[-1] == (5, 5)
    with pytest.raises(InputError, match="exists already"):
        t.save_responses(small(), tmp_path / "atlas.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["atlas.nc"]


def test_a_disk_without_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Full:
        free = 1000

    monkeypatch.setattr(files.shutil, "disk_usage", lambda path: Full)
    for write in (t.save_responses, t.save):
        with pytest.raises(InputError, match=r"atlas\.nc: takes 0\.2\d* MB, the disk has room for 0\.001 MB"):
            write(small(), tmp_path / "atlas.nc")
    assert not list(tmp_path.iterdir())


def test_path_from_the_command_line(trivet: Any, file: str, tmp_path: Path) -> None:
    data = str(tmp_path / "atlas.nc")
    code, out, _ = trivet(*RANGE, "--path", file, "--steps", "4", "--json", "--data", data, "--responses")
    found = json.loads(out)
    assert code == 0
    assert (found["family"], found["roll_policy"]) == ("path of 3 poses", "as given")
    np.testing.assert_allclose(found["position_m"][-1], [0.003, 0.0005, 0.125])
    with xr.open_dataset(data, engine="h5netcdf") as saved:
        assert saved["receptance"].shape == (found["points"], 1, 2000, 2)


def test_block_from_the_command_line(trivet: Any) -> None:
    given = ("--block", "4mm,0mm,2mm", "--centre", "0mm,1mm,124mm", "--tilt", "10deg", "--azimuth", "90deg", "--steps", "2")
    code, out, _ = trivet(*RANGE, *given, "--roll", "0 deg")
    assert code == 0
    assert "block of 4 × 0 × 2 mm, roll 0 deg: 9 of 9 points reached" in out
    found = json.loads(trivet(*RANGE, *given, "--roll", "0 deg", "--json")[1])
    position = np.array(found["position_m"])
    np.testing.assert_allclose(position.mean(axis=0), [0, 0.001, 0.124], atol=1e-12)
    np.testing.assert_allclose(np.ptp(position, axis=0), [0.004, 0, 0.002], atol=1e-12)
    np.testing.assert_allclose(np.degrees([found["tilt_rad"][0], found["azimuth_rad"][0]]), [10, 90])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("map", "azulay", "--path", "x.toml"), "--path: only with --quantity dynamic-stiffness"),
        ((*RANGE, "--path", "x.toml", "--block", "1mm,1mm,1mm"), "one or the other"),
        ((*RANGE, "--block", "1mm,1mm,1mm", "--radius", "4 mm"), "of the hemisphere"),
        ((*RANGE, "--tilt", "10 deg"), "give --block as well"),
        ((*RANGE, "--block", "1mm,1mm"), "expected three values"),
        ((*RANGE, "--path", "missing.toml"), "missing.toml"),
        ((*RANGE, "--responses"), "--data"),
        ((*RANGE, "--block", "0mm,0mm,0mm"), "0 mm along all axes"),
        ((*RANGE, "--path", "x.toml", "--objective", "D_xx"), "leave them out with --path"),
        ((*RANGE, "--path", "x.toml", "--rolls", "36"), "leave them out with --path"),
        ((*RANGE, "--entries", "xx, xx"), "given twice"),
        ((*RANGE, "--objective", "D_q"), "q"),
    ],
)
def test_wrong_input(trivet: Any, options: tuple[str, ...], words: str) -> None:
    code, _, complaint = trivet(*options)
    assert code == 2
    assert words in complaint
    assert "Traceback" not in complaint
