"""The command measure import: tables, JSON, files, figures, wrong input."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trivet as t
from trivet.measure.files.by_suffix import read_functions
from trivet.measure.files.several import import_files
from trivet.measure.functions import Channel, Functions
from trivet.measure.imported import MeasuredMode
from trivet.measure.universal.reading import read_universal
from trivet.measure.universal.writing import write_universal
from trivet.show import measured as drawn

AXES = np.eye(3).tolist()
POLES = 2 * np.pi * np.array([40.0, 90.0, 170.0]) * (-0.01 + 1j)


def plate(count: int, lines: int = 200, step: float = 1.5) -> Functions:
    """Accelerances of a few modes along x, y, z of some points; coherence is low at antiresonances."""
    rng = np.random.default_rng(5)
    shapes = rng.normal(size=(3, count + 1))
    f = step * np.arange(1, lines + 1)
    s = 2j * np.pi * f
    values = sum(
        np.outer(phi[1:] * phi[0], s**2 / ((s - p) * (s - p.conjugate()))) for phi, p in zip(shapes, POLES, strict=True)
    )
    coherence = 1 / (1 + 2e-3 * np.abs(values).max() / np.abs(values))
    ends = tuple(Channel(str(k // 3 + 1), tuple(AXES[k % 3])) for k in range(count))
    points = {str(k + 1): (0.1 * k, 0.05, 0.0) for k in range((count + 2) // 3)}
    return Functions(
        f, values, ("acceleration",) * count, ends, (Channel("1", (0.0, 0.0, 1.0)),) * count, points, coherence, "plate"
    )


MODE = MeasuredMode(POLES[1], ("1", "2"), np.array([[1, 0, 0], [0, 2j, 0]]), "bending")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    write_universal(plate(4), tmp_path / "plate.unv", [MODE])
    return tmp_path


def rows(out: str, title: str) -> list[list[str]]:
    """Cells of the table under a title."""
    (body,) = re.findall(rf"^{title} *\n.*\n((?:.+\n)+)", out, re.MULTILINE)
    return [re.split(r"\s{2,}", line.strip()) for line in body.splitlines()]


def test_tables(trivet: Any, files: Path) -> None:
    code, out, err = trivet("measure", "import", "plate.unv")
    assert (code, err) == (0, "")
    assert "4 functions, 4 responses to 1 references; 200 lines from 1.5 to 300 Hz" in out
    source = plate(4)
    assert source.coherence is not None
    (first, *_, last) = rows(out, "functions")
    peak = int(np.argmax(np.abs(source.values[0])))
    assert first[:4] == ["1:+x", "1:+z", "acceleration", "m/s^2 per N"]
    assert first[4:6] == [f"{abs(source.values[0, peak]):.4g}", f"{source.frequency[peak]:.6g}"]
    assert first[6:] == [f"{source.coherence[0].min():.3f}", str((source.coherence[0] < 0.8).sum())]
    assert last[0] == "2:+x"
    assert rows(out, "points") == [["1", "0.000", "50.000", "0.000", "3", "1"], ["2", "100.000", "50.000", "0.000", "1"]]
    ((_, frequency, *rest),) = rows(out, "modes")
    assert float(frequency) == pytest.approx(abs(POLES[1]) / (2 * np.pi), abs=2e-4)
    assert rest == ["1.0000", "2", "bending"]
    assert f"coherence is below 0.8 at {(source.coherence < 0.8).sum()} lines" in out
    assert max(map(len, out[: out.index("points")].splitlines())) <= 100
    assert "below" not in trivet("measure", "import", "plate.unv", "--least-coherence", "0")[1]


def test_json(trivet: Any, files: Path) -> None:
    found = json.loads(trivet("measure", "import", "plate.unv", "--least-coherence", "0.9", "--json")[1])
    source = plate(4)
    assert source.coherence is not None
    np.testing.assert_array_equal(found["frequency_Hz"], source.frequency)
    assert [one["response"]["direction"] for one in found["functions"]] == [list(end.direction) for end in source.responses]
    assert found["functions"][3]["reference"] == {"point": "1", "direction": [0, 0, 1], "is_rotation": False}
    assert [one["lines_in_doubt"] for one in found["functions"]] == (source.coherence < 0.9).sum(axis=1).tolist()
    np.testing.assert_allclose([one["lowest_coherence"] for one in found["functions"]], source.coherence.min(axis=1), rtol=1e-9)
    assert found["points"][1] == {"name": "2", "position_m": [0.1, 0.05, 0.0]}
    (mode,) = found["modes"]
    assert mode["damping_ratio"] == pytest.approx(0.01, rel=1e-4)
    assert mode["shape_imaginary"][1] == [0, 2, 0]
    assert (found["least_coherence"], found["lines"], found["not_used"]) == (0.9, 200, [])


def test_files_are_written(trivet: Any, files: Path) -> None:
    options = ("--data", "all.nc", "--write", "out.unv", "--binary")
    code, _, err = trivet("measure", "import", "plate.unv", *options)
    assert (code, err) == (0, "wrote out.unv\nwrote all.nc\n")
    source = read_universal("plate.unv").functions
    for path in ("all.nc", "out.unv"):
        found = read_functions(path)
        np.testing.assert_array_equal(found.values, source.values)
        np.testing.assert_array_equal(found.coherence, source.coherence)
        assert (found.responses, found.points) == (source.responses, source.points)
    assert len(read_universal("out.unv").modes) == 1
    assert trivet("measure", "import", "plate.unv", *options)[0] == 2
    assert trivet("measure", "import", "plate.unv", "all.nc", *options, "--overwrite")[0] == 0
    assert len(read_functions("all.nc")) == 4


def test_what_is_not_used_is_listed(trivet: Any, files: Path) -> None:
    more = "".join(f"    -1\n{kind:6d}\nwords\n    -1\n" for kind in (82, 2412, 2412))
    with (files / "plate.unv").open("a") as file:
        file.write(more)
    out = trivet("measure", "import", "plate.unv")[1]
    assert rows(out, "not used") == [["plate.unv", "82", "trace lines", "13"], ["plate.unv", "2412", "elements", "14, 15"]]


def test_many_functions_are_cut_in_tables(trivet: Any, tmp_path: Path) -> None:
    write_universal(plate(60, lines=5, step=30.0), tmp_path / "many.unv")
    out = trivet("measure", "import", "many.unv")[1]
    table = rows(out, "functions")
    assert len(table) == 41
    assert table[-1] == ["and 20 more with --json"]


def test_what_is_drawn() -> None:
    """Columns of maps hold the greatest magnitude of their lines, the phase there, the least coherence."""
    source = plate(300, lines=5000, step=0.06)
    whole = drawn.Imported(source, ("",) * 300, least_coherence=0.8)
    seen = drawn.seen(whole)
    columns = len(seen.frequency)
    assert columns == 2000
    starts = np.unique(np.linspace(0, 5000, columns, endpoint=False).astype(int))
    for column in (0, 17, columns - 1):
        part = slice(starts[column], starts[column + 1] if column + 1 < columns else 5000)
        k = int(np.argmax(np.abs(source.values[7, part])))
        assert seen.magnitude[7, column] == np.abs(source.values[7, part]).max()
        assert seen.phase[7, column] == pytest.approx(np.degrees(np.angle(source.values[7, part][k])))
        assert source.coherence is not None
        assert seen.coherence is not None
        assert seen.coherence[7, column] == source.coherence[7, part].min()
        assert seen.doubtful[7, column] == (source.coherence[7, part] < 0.8).any()
    level = drawn.below_peak(seen.magnitude)
    np.testing.assert_allclose(level.max(axis=1), 0)
    assert level.min() >= drawn.DEEP
    assert drawn.unit(whole) == "m/s^2/N"
    assert "300 functions, 5000 lines" in drawn.title(whole)[1]


@pytest.mark.parametrize("count", [2, 40])
def test_pictures_and_pages(tmp_path: Path, count: int) -> None:
    from matplotlib.image import imread

    write_universal(plate(count), tmp_path / "a.unv")
    found = import_files([tmp_path / "a.unv"], least_coherence=0.8)
    t.figure(found, tmp_path / "a.png")
    picture = imread(tmp_path / "a.png")[..., :3]
    assert picture.shape[:2] == (900, 1200)
    vermillion = np.abs(picture - np.array([0xD5, 0x5E, 0x00]) / 255).max(axis=2) < 0.08
    curves = slice(130, 530) if count == 2 else slice(700, 840)
    assert vermillion[curves].sum() > 50, "lines in doubt are marked"
    t.figure(found, tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert re.search(r"<(?:script|link)[^>]+(?:src|href)=", text) is None, "needs no network"
    (start,) = (match.end() for match in re.finditer(r"Plotly\.newPlot\(\s*\"[^\"]+\",\s*", text))
    traces, _ = json.JSONDecoder(parse_constant=pytest.fail).raw_decode(text, start)
    source = found.functions
    if count == 2:
        np.testing.assert_allclose(traces[0]["y"], np.abs(source.values[0]), rtol=1e-4)
        np.testing.assert_allclose(traces[1]["y"], np.degrees(np.angle(source.values[0])), rtol=1e-3, atol=1e-2)
    else:
        maps = [trace for trace in traces if trace["type"] == "heatmap"]
        np.testing.assert_allclose(maps[1]["z"], np.degrees(np.angle(source.values)), rtol=1e-3, atol=0.1)
        np.testing.assert_allclose(maps[2]["z"], source.coherence, rtol=1e-3, atol=1e-4)


WRONG = [
    (("none.unv",), "none.unv: cannot be read"),
    (("plate.txt",), "a file of measured responses ends in"),
    (("plate.unv", "--units", "kg"), '--units "kg": "kg" is no motion per load and no length'),
    (("plate.unv", "--units", "mm/s per N"), "mm/s per N is declared; its response is an acceleration"),
    (("plate.unv", "--least-coherence", "2"), "--least-coherence 2: expected 0 to 1"),
    (("plate.unv", "--binary"), "--binary: is for the file of --write"),
    (("plate.unv", "--write", "out.txt"), "a universal file ends in .unv, .uff"),
    (("plate.unv", "--data", "out.csv"), "a NetCDF file ends in .nc"),
    (("plate.unv", "--write", "plate.unv"), "exists already"),
    (("plate.unv", "--figure", "a.pdf"), ".png or .html"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_told_and_exit_code_2(trivet: Any, files: Path, arguments: tuple[str, ...], message: str) -> None:
    code, out, err = trivet("measure", "import", *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert [path.name for path in files.iterdir()] == ["plate.unv"]
