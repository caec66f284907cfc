"""The commands: output, JSON, files, and every kind of bad input with its message and exit code."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from trivet.cli import output
from trivet.errors import InputError
from trivet.model import catalogue

COMMAND = [sys.executable, "-m", "trivet"]


def test_list(trivet: Any) -> None:
    code, out, _ = trivet("list")
    assert code == 0
    assert all(name in out for name in catalogue())
    code, out, _ = trivet("list", "--json")
    assert [m["name"] for m in json.loads(out)] == catalogue()


@pytest.mark.parametrize("name", catalogue())
def test_show_every_machine(trivet: Any, name: str, tmp_path: Path) -> None:
    code, out, _ = trivet("show", name, "--figure", "m.png", "--figure", "m.html")
    assert code == 0
    assert name in out
    assert (tmp_path / "m.png").stat().st_size > 10_000
    assert (tmp_path / "m.html").stat().st_size > 100_000
    code, out, _ = trivet("show", name, "--toml")
    (tmp_path / "again.toml").write_text(out)
    assert trivet("show", "again.toml", "--toml")[1] == out
    assert "dimensions_SI" in json.loads(trivet("show", name, "--json")[1])


def test_show_breaks_long_cells(trivet: Any) -> None:
    """Within 100 letters where there is no terminal; the words are all there."""
    out = trivet("show", "azulay")[1]
    assert max(map(len, out.splitlines())) <= 100
    told = " ".join(out.split())
    assert "the box which bodies must stay clear of" in told
    assert "beam section tube, material steel" in told


def test_pose_says_everything(trivet: Any) -> None:
    options = ("pose", "azulay", "--position", "1 mm, 2 mm, 12 cm", "--tilt", "20 deg", "--force", "10 N, 0 N, 0 N", "--weight")
    code, out, _ = trivet(*options)
    assert code == 0
    for words in ("leg-3.hinge", "compliance budget", "1/C_ii", "deflection under the load", "leg-1.slide drive"):
        assert words in out
    found = json.loads(trivet(*options, "--json")[1])
    assert found["reached"] is True
    assert found["position_m"] == [0.001, 0.002, 0.12]
    k = found["stiffness_SI"]
    assert found["diagonal"]["K_xx_N_per_m"] == k[0][0]
    assert sum(s["share"] for s in found["compliance_budget"]["y"]) == pytest.approx(1)
    assert found["masses_kg"]["leg-1.link"] == pytest.approx(7870 * 0.216 * 3.14159 / 4 * (0.019**2 - 0.014**2), rel=1e-5)


def test_map_and_compare_write_files(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet("map", "azulay", "--steps", "4", "--figure", "a.png", "--figure", "a.html", "--data", "a.nc")
    assert (code, err.count("wrote")) == (0, 3)
    assert "K_xx" in out
    assert "http" not in (tmp_path / "a.html").read_text().split("<script")[0]
    found = json.loads(trivet("map", "azulay", "--steps", "4", "--json")[1])
    assert len(found["by_point"]["K_xx_N_per_m"]) == found["points"] == 49
    static = ("compare", "azulay", "eclipse", "--steps", "4", "--static-only")
    code, out, _ = trivet(*static, "--figure", "c.png", "--figure", "c.html", "--data", "c.nc")
    assert code == 0
    assert "Welch" in out
    found = json.loads(trivet(*static, "--json")[1])
    assert len(found["tests"]) == 3
    assert found["machines"][0]["statistics"]["K_zz"]["mean_N_per_m"] == pytest.approx(5.4e6, rel=0.02)


def test_forward_lists_all_poses(trivet: Any, tmp_path: Path) -> None:
    code, out, _ = trivet("forward", "azulay", "--figure", "f.png", "--figure", "f.html")
    assert code == 0
    assert "16 of 16 complex solutions" in out
    assert (tmp_path / "f.html").stat().st_size > 100_000
    found = json.loads(trivet("forward", "azulay", "--json")[1])
    assert found["complete"] is True
    assert found["poses"][0]["home"] == "connected"
    assert found["poses"][found["poses"][0]["mirror"]]["position_m"][2] == pytest.approx(-0.125)
    moved = json.loads(trivet("forward", "azulay", "--drive", "leg-1.slide=33 mm", "--json")[1])
    assert moved["drives_m_or_rad"]["leg-1.slide"] == pytest.approx(0.033)
    code, out, _ = trivet("forward", "gough-stewart", "--tilt", "3 deg")
    assert (code, "may be other poses" in out) == (0, True)


def test_singularity_says_what_it_means(trivet: Any) -> None:
    found = json.loads(trivet("singularity", "azulay", "--tilt", "20 deg", "--json")[1])
    assert found["type"] == 0
    assert 0 < found["LTI"] < 1
    code, out, _ = trivet("singularity", "azulay", "--figure", "s.png")
    assert (code, "ITI" in out) == (0, True)
    found = json.loads(trivet("map", "azulay", "--quantity", "sigma_min", "--roll=-alpha", "--data", "s.nc", "--json")[1])
    ring = np.array(found["singular_curves"][0]["position_m"])
    away = np.hypot(ring[:, 0], ring[:, 1])
    assert 2.0e-3 < away.min() < away.max() < 2.5e-3
    assert found["singular_curves"][0]["closed"]


def test_export_writes_a_model(trivet: Any, tmp_path: Path) -> None:
    code, _, err = trivet("export", "rmmt", "m.xml", "--lock", "tangential=2 mm")
    assert (code, "wrote m.xml" in err) == (0, True)
    assert "leg-3.radial" in (tmp_path / "m.xml").read_text()
    code, _, err = trivet("export", "rmmt", "m.xml")
    assert (code, "exists already" in err) == (2, True)


def test_locks_choose_the_drives(trivet: Any) -> None:
    found = json.loads(trivet("pose", "rmmt", "--lock", "leg-1.tangential=1 mm", "--json")[1])
    assert "leg-1.guide" in found["actuators"]
    assert "leg-2.guide" not in found["actuators"]


def test_switches_change_the_model(trivet: Any) -> None:
    def stiffness(*options: str) -> float:
        return float(
            json.loads(trivet("pose", "azulay", "--tilt", "30 deg", "--json", *options)[1])["diagonal"]["1/C_xx_N_per_m"]
        )

    clamped, free, elastic = stiffness(), stiffness("--spherical", "free"), stiffness("--spherical", "300 N m/rad")
    assert free < elastic < clamped
    assert stiffness("--shear") < clamped
    assert stiffness("--guide", "rotation") != clamped
    assert stiffness("--mode", "+- ++ ++", "--anyway") != clamped
    assert stiffness("--set", "tube.outer_diameter=25 mm") > clamped


WRONG = [
    (("show", "azulai"), "did you mean 'azulay'"),
    (("show", "nowhere.toml"), "cannot be read"),
    (("pose", "azulay", "--set", "link.lenght=200 mm"), "link.length"),
    (("pose", "azulay", "--set", "link.length"), "expected KEY=VALUE"),
    (("pose", "azulay", "--set", "link.length=200"), "unit is missing"),
    (("pose", "azulay", "--set", "link.length=216 N"), "not a unit of length"),
    (("pose", "azulay", "--set", "link.length=-216 mm"), "greater than zero"),
    (("pose", "azulay", "--set", "link.length=0 mm"), "greater than zero"),
    (("pose", "azulay", "--set", "link.length=nan mm"), "finite number"),
    (("pose", "azulay", "--set", "tube.inner_diameter=19 mm"), "not smaller than the outer diameter"),
    (("pose", "azulay", "--position", "0 mm, 0 mm"), "three values"),
    (("pose", "azulay", "--position", "0, 0, 125 mm"), "unit is missing"),
    (("pose", "azulay", "--tilt", "20 mm"), "not a unit of angle"),
    (("pose", "azulay", "--tilt", "nan deg"), "finite"),
    (("pose", "azulay", "--force", "1 m, 0 N, 0 N"), "not a unit of force"),
    (("pose", "azulay", "--mode", "+"), 'the signs "++ ++ ++"'),
    (("pose", "azulay", "--spherical", "loose"), "free, clamped or a stiffness"),
    (("pose", "azulay", "--guide", "both"), "translation or rotation"),
    (("pose", "gough-stewart", "--mode", "++"), "no choice"),
    (("map", "azulay", "--steps", "0"), "without points"),
    (("map", "azulay", "--steps", "many"), "steps"),
    (("map", "azulay", "--radius", "-1 mm"), "radius"),
    (("map", "azulay", "--rolls", "1"), "rolls"),
    (("map", "azulay", "--objective", "K_xz"), "objective"),
    (("map", "azulay", "--steps", "2", "--figure", "a.gif"), ".png or .html"),
    (("map", "azulay", "--steps", "2", "--data", "/proc/nowhere/a.nc"), "cannot be written"),
    (("map", "gough-stewart", "--objective", "K_xz"), "objective"),
    (("compare", "azulay", "azulay"), "given twice"),
    (("compare", "--finer", "0"), "finer"),
    (("forward", "azulay", "--drives", "0 deg, 120 deg"), "2 values, but azulay has 6 drives"),
    (("forward", "azulay", "--drive", "leg-1.slid=30 mm"), "did you mean 'leg-1.slide'"),
    (("forward", "azulay", "--drive", "leg-1.slide=30 deg"), "not a unit of length"),
    (("forward", "azulay", "--drive", "leg-1.slide=300 mm"), "outside its travel"),
    (("forward", "rmmt", "--lock", "leg-1.guide=0 deg", "--lock", "leg-1.radial=30 mm"), "leg-1: has 5 freedoms"),
    (("forward", "rmmt", "--lock", "leg-1.gide=0 deg"), "did you mean"),
    (("forward", "rmmt", "--lock", "leg-1.guide=0 mm"), "not a unit of angle"),
    (("map", "azulay", "--quantity", "sigma"), "sigma_min"),
    (("map", "azulay", "--roll", "3 deg"), "another --quantity"),
    (("map", "azulay", "--quantity", "LTI", "--roll", "3"), "unit is missing"),
    (("export", "azulay", "m.sdf"), ".xml"),
    (("nonsense",), "nonsense"),
    (("map", "azulay", "--nonsense"), "nonsense"),
    (("map",), "MACHINE"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(a) for a, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(trivet: Any, arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments)
    assert code == 2
    assert out == ""
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


NOTHING = [
    (("pose", "azulay", "--position", "0 mm, 0 mm, 500 mm"), "leg-1 cannot close"),
    (("pose", "azulay", "--position", "0 mm, 0 mm, 50 mm"), "above its limit of 65 mm"),
    (("map", "azulay", "--height", "400 mm", "--steps", "2"), "no point of the hemisphere"),
    (("compare", "eclipse", "--height", "121 mm", "--steps", "2"), "eclipse: no point"),
]


@pytest.mark.parametrize(("arguments", "message"), NOTHING, ids=[" ".join(a) for a, _ in NOTHING])
def test_no_result_is_exit_code_1(trivet: Any, arguments: tuple[str, ...], message: str) -> None:
    code, out, err = trivet(*arguments)
    assert (code, out) == (1, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1


def test_files_are_not_overwritten_unasked(trivet: Any, tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("precious")
    code, _, err = trivet("map", "azulay", "--steps", "2", "--figure", "a.png")
    assert code == 2
    assert "exists already" in err
    assert (tmp_path / "a.png").read_text() == "precious"
    assert trivet("map", "azulay", "--steps", "2", "--figure", "a.png", "--overwrite")[0] == 0
    assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"


@pytest.mark.skipif(os.geteuid() == 0 and not Path("/proc").exists(), reason="needs a folder that nobody can write")
def test_a_file_that_fails_costs_no_numbers(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the disk is full at the end only."""

    def fail(*_: Any) -> None:
        raise InputError("no room")

    plain = trivet("map", "azulay", "--steps", "2", "--rolls", "36", "--json")[1]
    for name, options in (("draw", ("--figure", "a.png")), ("save", ("--data", "a.nc"))):
        with monkeypatch.context() as patch:
            patch.setattr(output, name, fail)
            code, out, err = trivet("map", "azulay", "--steps", "2", "--rolls", "36", "--json", *options)
        assert (code, err.strip()) == (2, "trivet: no room")
        assert out == plain


def test_an_unwritable_folder_is_told_before_the_work(trivet: Any) -> None:
    start = time.monotonic()
    code, _, err = trivet("map", "azulay", "--steps", "300", "--data", "/proc/a.nc")
    assert (code, time.monotonic() - start < 20) == (2, True)
    assert "/proc/a.nc" in err


def test_a_file_of_100_megabytes_is_refused(trivet: Any, tmp_path: Path) -> None:
    with (tmp_path / "big.toml").open("wb") as stream:
        stream.truncate(100_000_000)
    code, _, err = trivet("show", "big.toml")
    assert code == 2
    assert "larger than" in err


def test_interruption_leaves_nothing(tmp_path: Path) -> None:
    arguments = ["map", "azulay", "--steps", "900", "--data", "a.nc", "--figure", "a.png"]
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        # A shell that runs the tests in the background has its children ignore the signal.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    time.sleep(12)
    assert process.poll() is None, "still at work"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.strip().splitlines() == ["trivet: interrupted"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", [("show", "azulay"), ("list", "--json"), ("list", "--help")])
def test_output_into_a_closed_pipe_is_no_error(command: tuple[str, ...]) -> None:
    nobody, pipe = os.pipe()
    os.close(nobody)
    done = subprocess.run([*COMMAND, *command], stdout=pipe, stderr=subprocess.PIPE, text=True, check=False)
    os.close(pipe)
    assert (done.returncode, done.stderr) == (0, "")


def test_closed_streams_cost_nothing(tmp_path: Path) -> None:
    document = {
        "machines": ["azulay"], "quantities": ["mass"], "sweep": {"count": 2},
        "variables": [{"of": "link.length", "low": "205 mm", "high": "225 mm"}],
    }  # fmt: skip
    (tmp_path / "study.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    told = []
    for closed in ("", "2>&-", "2>&- <&-", ">&- 2>&-"):
        line = shlex.join([*COMMAND, "sweep", "study.toml", "--json", "--figure", f"{len(told)}.png"])
        done = subprocess.run(f"{line} {closed}", shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / f"{len(told)}.png").read_bytes().startswith(b"\x89PNG")
        told.append(done.stdout)
    assert json.loads(told[0])["statuses"]
    assert told[1:] == [told[0], told[0], ""]


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nsys.argv = ['trivet', '--help']\nfrom trivet.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print(*({'jax', 'numpy', 'pydantic', 'matplotlib', 'scipy', 'xarray', 'pint'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == ""
    assert "compare" in done.stdout


def test_lists_and_whole_numbers_can_be_set(trivet: Any) -> None:
    dimensions = json.loads(trivet("show", "azulay@home.position=1 mm,2 mm,120 mm,link.length=200 mm", "--json")[1])[
        "dimensions_SI"
    ]
    assert [dimensions[f"home.position.{k}"] for k in (1, 2, 3)] == [0.001, 0.002, 0.12]
    assert dimensions["chains.leg.elements.link.length"] == 0.2
    assert json.loads(trivet("show", "azulay", "--set", "copies=4", "--json")[1])["chains"]["leg"]["copies"] == 4


def test_a_terminated_run_leaves_nothing(tmp_path: Path) -> None:
    code = (
        "import sys, signal, os\nfrom trivet.cli import main\nimport trivet.cli.app as app\n"
        "from trivet.files import replacing\n"
        "def slow():\n"
        "    with replacing('x.nc'):\n        os.kill(os.getpid(), signal.SIGTERM)\n"
        "app.app = lambda standalone_mode: slow()\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + signal.SIGTERM
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_begun_goes_when_a_run_ends_within_an_import(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (tmp_path / "slow.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGTERM)\n")
    code = (
        f"import sys\nsys.path.append({str(tmp_path)!r})\nfrom trivet.cli import main\nimport trivet.cli.app as app\n"
        "def app_(standalone_mode):\n    from trivet.files import replacing\n"
        "    with replacing('x.png'):\n        import slow\napp.app = app_\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stderr == "trivet: interrupted\n"
    assert list(folder.iterdir()) == []


def test_a_terminated_run_is_not_interrupted_once_more(tmp_path: Path) -> None:
    """The alarm that makes sure of the end does not go off while the interpreter clears up."""
    code = (
        "import atexit, os, signal, time\nfrom trivet.cli import main\nimport trivet.cli.app as app\n"
        "atexit.register(time.sleep, 0.2)\n"
        "app.app = lambda standalone_mode: os.kill(os.getpid(), signal.SIGTERM)\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stderr == ""


def test_a_command_is_a_file() -> None:
    import pkgutil

    from trivet.cli import commands
    from trivet.cli.commands import measure

    assert sorted([*commands.NAMES, "measure"]) == sorted(module.name for module in pkgutil.iter_modules(commands.__path__))
    assert sorted(measure.COMMANDS.values()) == sorted(module.name for module in pkgutil.iter_modules(measure.__path__))


def test_output_that_finds_no_room_is_one_line() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*COMMAND, "list"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "trivet: the output cannot be written: No space left on device\n"
