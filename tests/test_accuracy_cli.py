"""The command accuracy: tables, JSON, NetCDF and figures at one pose and over the hemisphere, and wrong input."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from documents import numbers, traces

import trivet as t
from trivet.study import accuracy as study

GOOD = """
[[tolerance]]
of = "link.length"
plus_minus = "0.02 mm"

[[play]]
joint = "ball"
radial = "5 um"

[[heat]]
bodies = ["link"]
warmer = "5 K"
expansion = "1.2e-5 1/K"
"""
PATH = '[[poses]]\nposition = ["0 mm", "0 mm", "125 mm"]\n[[poses]]\nposition = ["2 mm", "0 mm", "125 mm"]\nroll = "10 deg"\n'
TIPPED = "azulay@platform.tool_tip=3 mm,-2 mm,40 mm"
POSE = "--position", "2 mm, 0 mm, 124 mm", "--azimuth", "25 deg", "--tilt", "20 deg", "--roll", "35 deg"


@pytest.fixture
def given(tmp_path: Path) -> Path:
    """A tolerance file and a path file in the folder of the command."""
    (tmp_path / "good.toml").write_text(GOOD, encoding="utf-8")
    (tmp_path / "path.toml").write_text(PATH, encoding="utf-8")
    return tmp_path


def test_one_pose(trivet: Any, given: Path) -> None:
    """Of the tool tip; what the library finds at this pose is printed, drawn and kept."""
    outputs = "--figure", "a.png", "--figure", "a.html", "--data", "a.nc"
    code, out, err = trivet("accuracy", TIPPED, "good.toml", *POSE, "--point", "tool", *outputs)
    assert (code, re.findall(r"wrote (.*)", err)) == (0, ["a.png", "a.html", "a.nc"])
    pose = (0.002, 0.0, 0.124, *np.radians((25, 20, 35)))
    found = t.accuracy(TIPPED, given / "good.toml", pose, point="tool")
    assert "centre (2, 0, 124) mm, azimuth 25°, tilt 20°, roll 35°; tool tip, drives held" in out
    for what, values in (("root mean square", found.size), ("at worst", found.farthest)):
        for half, (kind, unit) in enumerate((("position", "µm"), ("rotation", "µrad"))):
            assert re.search(rf"{kind}, {what} +{re.escape(f'{1e6 * values[0, half]:.4g}')} +{unit}\n", out)
    assert re.search(rf"standard deviation( +{re.escape(f'{1e6 * found.deviation[0, 0]:.4g}')})", out)
    share, turned = (100 * found.shares(what)[0, 0] for what in ("position", "rotation"))
    assert re.search(rf"tolerance +link.length +± 0.02 mm +3 +{share:.1f} +{turned:.1f} +0\n", out)
    document = json.loads(trivet("accuracy", TIPPED, "good.toml", *POSE, "--point", "tool", "--json")[1])
    assert (document["family"], document["point"], document["points"], document["used"]) == ("pose", "tool", 1, 1)
    assert document["worst_distance_m"] == [found.farthest[0, 0]]
    assert document["roll_rad"] == [pytest.approx(math.radians(35))]
    with xr.open_dataset(given / "a.nc", engine="h5netcdf") as kept:
        np.testing.assert_array_equal(kept["worst"].values, found.worst)
    assert (given / "a.png").read_bytes()[:4] == b"\x89PNG"
    upright = [trace for trace in traces(given / "a.html") if "orientation" not in trace]
    bars = {(trace["name"], tuple(trace["x"])): numbers(trace["y"]) for trace in upright}
    np.testing.assert_allclose(bars["at worst", ("rx", "ry", "rz")], 1e6 * found.worst[0, 3:])
    np.testing.assert_allclose(bars["for sure", ("x", "y", "z")], 1e6 * found.shift[0, :3])


def test_over_the_hemisphere(trivet: Any, given: Path) -> None:
    options = "--steps", "2", "--height", "121 mm", "--radius", "3 mm", "--roll=-alpha"
    code, out, err = trivet("accuracy", "azulay", "good.toml", *options, "--figure", "a.png")
    assert (code, err) == (0, "wrote a.png\n")
    assert "hemisphere of 3 mm, roll -alpha: 13 of 13 points reached; platform centre, drives held" in out
    found = t.accuracy("azulay", given / "good.toml", t.over_hemisphere(0.121, 0.003, 2), roll="-alpha")
    place = ", ".join(f"{1e3 * v + 0.0:.4g}" for v in found.places.position[found.least_accurate])
    assert f"least accurate point: centre ({place}) mm" in out
    document = json.loads(trivet("accuracy", "azulay", "good.toml", *options, "--json")[1])
    assert document["rms_distance_m"] == found.size[:, 0].tolist()
    assert document["least_accurate_point"] == found.least_accurate
    np.testing.assert_allclose(document["roll_rad"], -np.array(document["azimuth_rad"]))


def test_how_far_it_is_is_told(given: Path) -> None:
    calls: list[tuple[str, int, int]] = []
    places = t.over_hemisphere(0.121, 0.004, 2)
    t.accuracy("azulay", given / "good.toml", places, rolls=24, progress=lambda *told: calls.append(told))
    assert {(what, total) for what, _, total in calls} == {("best rolls", 13), ("errors", 13)}
    for stage in ("best rolls", "errors"):
        own = [done for what, done, _ in calls if what == stage]
        assert (own, own[-1]) == (sorted(own), 13)


class Seen(Exception):
    """What the study is asked for."""


@pytest.fixture
def asked(trivet: Any, given: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Calls the command, and gives the arguments of the study that it calls."""

    def seen(*arguments: Any, **named: Any) -> None:
        raise Seen(*arguments, named)

    monkeypatch.setattr(study, "accuracy", seen)

    def call(*arguments: str) -> tuple[Any, ...]:
        with pytest.raises(Seen) as caught:
            trivet("accuracy", "azulay", "good.toml", *arguments)
        return caught.value.args

    return call


def test_options_reach_the_study_as_they_were_given(asked: Any) -> None:
    machine, file, family, named = asked()
    assert (machine.name, file, len(family), family.name) == ("azulay", "good.toml", 317, "hemisphere of 4 mm")
    assert [named[key] for key in ("point", "roll", "mode", "rolls")] == ["platform", None, None, None]
    family, named = asked("--path", "path.toml")[2:]
    assert (len(family), family.name, named["roll"]) == (25, "path of 2 poses", None)
    assert len(asked("--path", "path.toml", "--steps", "3")[2]) == 4
    rolls = {"-alpha": "-alpha", "best": "best", "best K_zz": "best K_zz", "10 deg": pytest.approx(math.radians(10))}
    for text, policy in rolls.items():
        assert asked(f"--roll={text}")[3]["roll"] == policy
    assert asked("--roll", "best 1/C_zz", "--rolls", "48")[3]["rolls"] == 48
    machine, _, pose, named = asked("--set", "home.roll=3 deg", "--tilt", "5 deg", "--mode", "++ ++ -+", "--point", "tool")
    assert pose == pytest.approx((0, 0, 0.125, 0, math.radians(5), math.radians(3)))
    assert [named[key] for key in ("point", "roll", "mode")] == ["tool", None, "++ ++ -+"]


def test_what_is_not_reached_is_told(trivet: Any, given: Path) -> None:
    for position, reason in (
        ("0 mm, 0 mm, 50 mm", "leg-1.slide at 66.13 mm is above"),
        ("0 m, 0 m, 1 m", "leg-1 cannot close"),
    ):
        code, out, err = trivet("accuracy", "azulay", "good.toml", "--position", position, "--json")
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert f"azulay: the pose is not reached: {reason}" in err


def test_files_are_not_overwritten_unasked(trivet: Any, given: Path) -> None:
    """That is said before the work, which would find nothing."""
    (given / "a.nc").write_text("precious")
    code, out, err = trivet("accuracy", "azulay", "good.toml", "--position", "0 m, 0 m, 1 m", "--data", "a.nc")
    assert (code, out) == (2, "")
    assert "a.nc: exists already" in err
    assert (given / "a.nc").read_text() == "precious"
    assert trivet("accuracy", "azulay", "good.toml", *POSE, "--data", "a.nc", "--overwrite")[0] == 0
    assert (given / "a.nc").read_bytes() != b"precious"


WRONG = [
    (("nosuch.toml",), "nosuch.toml: cannot be read: No such file"),
    ((), "Missing argument 'TOLERANCES.toml'"),
    (("good.toml", "--tilt", "20"), '--tilt "20": the unit is missing'),
    (("good.toml", "--radius", "3 kg"), "--radius \"3 kg\": 'kg' is not a unit of length"),
    (("good.toml", "--roll", "half"), '--roll "half": expected a number and a unit'),
    (("good.toml", "--roll", "best K_xy"), "objective 'K_xy' is not known; did you mean"),
    (("good.toml", "--point", "tip"), "point 'tip' is not known; platform or tool"),
    (("good.toml", "--point", "tool"), "point tool: azulay has no platform.tool_tip; give one, or write platform"),
    (("good.toml", "--mode", "+"), "mode"),
    (("good.toml", "--steps", "0"), "steps: 0"),
    (("good.toml", "--path", "nosuch.toml"), "nosuch.toml: cannot be read"),
    (("good.toml", "--path", "path.toml", "--tilt", "1 deg"), "--path: goes without --position, --azimuth, --tilt"),
    (("good.toml", "--path", "path.toml", "--roll", "1 deg"), "--roll, --rolls: the path file has rolls of its own"),
    (("good.toml", "--path", "path.toml", "--rolls", "36"), "--roll, --rolls: the path file has rolls of its own"),
    (("good.toml", "--path", "path.toml", "--height", "1 mm"), "--radius, --height: of the hemisphere"),
    (("good.toml", "--tilt", "1 deg", "--radius", "1 mm"), "--radius, --height: of the hemisphere"),
    (("good.toml", "--tilt", "1 deg", "--steps", "3"), "--steps: of the hemisphere or of a path"),
    (("good.toml", "--tilt", "1 deg", "--rolls", "36"), "--rolls: of the search for the best roll"),
    (("good.toml", "--roll=-alpha", "--rolls", "36"), "--rolls: of the search for the best roll"),
    (("good.toml", "--figure", "a.svg"), "a.svg: a figure ends in .png or .html"),
]


@pytest.mark.parametrize(("arguments", "words"), WRONG, ids=[" ".join(own) or "no file" for own, _ in WRONG])
def test_wrong_input_is_one_line(trivet: Any, given: Path, arguments: tuple[str, ...], words: str) -> None:
    code, out, err = trivet("accuracy", "azulay", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("trivet: ")
    assert words in err


FAULTS = {
    ("0.02 mm", "0.02 kg"): "bad.toml: tolerance 1: plus_minus: \"0.02 kg\": 'kg' is not a unit of length",
    ('"0.02 mm"', "0.02"): "bad.toml: tolerance.1.plus_minus: 0.02: the unit is missing",
    ("radial", "radius"): "bad.toml: play.1.radius: unknown key",
    ('"ball"', '"bal"'): "bad.toml: play 1: bal: azulay has no such joint; did you mean 'ball'?",
    ("link.length", "link.lenght"): "bad.toml: tolerance 1: link.lenght: no such key in this machine; did you mean",
    ("[[tolerance]]", "[tolerance"): "bad.toml: ",
}


@pytest.mark.parametrize("change", FAULTS, ids=[" ".join(own) for own in FAULTS])
def test_what_is_wrong_with_the_file_is_one_line(trivet: Any, given: Path, change: tuple[str, str]) -> None:
    (given / "bad.toml").write_text(GOOD.replace(*change), encoding="utf-8")
    code, out, err = trivet("accuracy", "azulay", "bad.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"trivet: {FAULTS[change]}")


def test_machines_with_drives_to_spare_are_refused(trivet: Any, given: Path) -> None:
    (given / "bare.toml").write_text('[[play]]\njoint = "ball"\nradial = "5 um"\n', encoding="utf-8")
    t.write(t.load("rmmt").with_free_drives(), given / "free.toml")
    code, out, err = trivet("accuracy", "free.toml", "bare.toml", "--json")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "9 actuators" in err


def test_a_pose_near_a_singularity_says_so(trivet: Any, given: Path) -> None:
    """The worst of a hemisphere, alone."""
    document = json.loads(trivet("accuracy", "azulay", "good.toml", "--steps", "5", "--roll=-alpha", "--json")[1])
    worst = int(np.nanargmax(document["worst_angle_rad"]))
    x, y, z = (f"{v!r} m" for v in document["position_m"][worst])
    angles = [f"{document[key][worst]!r} rad" for key in ("azimuth_rad", "tilt_rad", "roll_rad")]
    options = [f"--{name}={angle}" for name, angle in zip(("azimuth", "tilt", "roll"), angles, strict=True)]
    code, out, _ = trivet("accuracy", "azulay", "good.toml", f"--position={x}, {y}, {z}", *options)
    assert code == 0
    assert "the platform may turn by more than 3°, as near a singularity; first order is no measure there" in out
    assert "other points" not in out
