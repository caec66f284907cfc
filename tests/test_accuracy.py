"""Error budgets: what entries mean, statistics against samples, what is wrong with a tolerance file, tables and pictures."""

from __future__ import annotations

import dataclasses
import io
import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from machines import part
from rich.console import Console
from test_deviation import MACHINES, stood, table

import trivet
from trivet.errors import InputError, NoResultError
from trivet.kinematics.deviation import deviations
from trivet.model import Machine, load
from trivet.space.family import Family, along, in_block, over_hemisphere
from trivet.study.accuracy import FACETS, accuracy, apart
from trivet.study.inexactness import inexactness
from trivet.study.tolerance_file import Heat, Misalignment, Play, Positioning, Tolerance, Tolerances, read_tolerances
from trivet.views.accuracy import as_json, tables


@cache
def everything() -> Tolerances:
    return Tolerances(
        (Tolerance("link.length", plus_minus=2e-5), Tolerance("guide.radius", sigma="10 um", common=True)),
        (Misalignment("leg-2.hinge", about="x", plus_minus="1 arcmin"), Misalignment("slide", along="z", sigma=4e-6)),
        (Positioning("guide", plus_minus="5 um"), Positioning("slide", sigma=2e-6)),
        (
            Play("ball", radial="30 um"),
            Play("hinge", radial="20 um"),
            Play("slide", backlash=3e-6),
            Play("hinge", about="z", gap=1e-4),
        ),
        (Heat(("link", "slide"), warmer="5 K", plus_minus="1 K", expansion=1.17e-5), Heat(warmer="-1 K", expansion="2e-5 1/K")),
    )


@cache
def one_pose() -> Any:
    """A pose of the paper's machine with everything inexact, and its errors by row."""
    machine = load("azulay", {"platform.tool_tip": "3 mm, -2 mm, 40 mm"})
    found = accuracy(machine, everything(), at(0.002, 0.0, 0.124, 0.4, 0.5, 0.6), point="tool")
    ((_, rows),) = found.contributions()
    return found, rows[0]


def at(*pose: float) -> Family:
    """A family of two poses, the first as given."""
    return along("one pose", lambda s: np.array(pose) + s[:, None] * [0, 0, 1e-3, 0, 0, 0], 1.0, 2)


def drawn(found: Any, count: int) -> np.ndarray:
    """(count, r) factors of the rows, each amount by its law."""
    rng, inexact = np.random.default_rng(5), found.inexact
    factors = np.empty((count, len(inexact.rows)))
    for k in range(len(inexact.names)):
        own = np.flatnonzero(inexact.amount == k)
        factors[:, own] = rng.normal(size=(count, len(own)))
        if inexact.reach[k] == 1:  # bounded: anywhere in a line, disc or ball
            factors[:, own] *= (rng.uniform(size=count) ** (1 / len(own)) / np.linalg.norm(factors[:, own], axis=1))[:, None]
    return factors


def test_a_tool_that_is_warm_with_the_whole_machine() -> None:
    machine = load("azulay", {"platform.tool_tip": "3 mm, -2 mm, 40 mm"})
    found = accuracy(machine, everything(), at(0.002, 0.0, 0.124, 0.4, 0.5, 0.6), point="tool")
    tip = (0.002, 0.0, 0.124) + np.array((0.003, -0.002, 0.04)) @ table(part(found.places.frames(), 0))[1:]
    np.testing.assert_allclose(found.shifts[0, -1], np.r_[-2e-5 * tip, 0, 0, 0], atol=1e-13)


def test_variances_by_monte_carlo() -> None:
    found, rows = one_pose()
    errors = drawn(found, 200_000) @ rows
    expected = found.covariance[0]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(np.cov(errors.T) / scale, expected / scale, atol=0.012)
    np.testing.assert_allclose(found.deviation[0], np.sqrt(np.diag(expected)), rtol=1e-12)
    squares = ((errors + found.shift[0]) ** 2).reshape(-1, 2, 3).sum(axis=2).mean(axis=0)
    np.testing.assert_allclose(np.sqrt(squares), found.size[0], rtol=0.01)
    ellipsoid = np.sqrt(np.linalg.eigvalsh(np.cov(errors[:, :3].T))) * 3
    np.testing.assert_allclose(found.ellipsoids[0, 0], ellipsoid, rtol=0.02)


def test_the_worst_is_reached_and_never_exceeded() -> None:
    """Amounts at their worst along a direction, the direction turned to where that leads, again and again."""
    found, rows = one_pose()
    inexact, shift = found.inexact, found.shift[0]
    members = np.arange(len(inexact.names))[:, None] == inexact.amount
    for half in range(2):
        own, sure, best = rows[:, 3 * half : 3 * half + 3], shift[3 * half : 3 * half + 3], 0.0
        for direction in np.random.default_rng(6).normal(size=(30, 3)):
            for _ in range(40):
                along_ = own @ direction
                sizes = np.sqrt(members @ along_**2)
                reached = (along_ * ((inexact.reach / np.maximum(sizes, 1e-300)) @ members)) @ own
                direction = reached + sure * np.sign(sure @ direction)
            best = max(best, float(np.linalg.norm(direction)))
        assert best <= found.farthest[0, half] <= best / np.cos(apart(FACETS)) * (1 + 1e-12)
    bounded = inexact.reach == 1
    errors = (drawn(found, 20_000) * (bounded @ members)) @ rows + shift
    assert (np.abs(errors).max(axis=0) <= found.worst[0]).all()
    alone = accuracy("azulay", Tolerances((Tolerance("link.length", plus_minus=2e-5),)), at(0.002, 0, 0.124, 0.4, 0.5, 0.6))
    ((_, links),) = alone.contributions()
    np.testing.assert_allclose(alone.worst[0], np.abs(links[0]).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(alone.deviation[0], np.sqrt((links[0] ** 2).sum(axis=0) / 3), rtol=1e-12)


def off(machine: Machine, given: Tolerances) -> list[dict[str, float]]:
    """What deviates in every row, and by how much."""
    found, ways = inexactness(machine, given), deviations(machine)
    names = [f"{machine.legs[way.leg].name} {way.of} {way.way} {'xyz'[way.axis]}" for way in ways] + ["tip x", "tip y", "tip z"]
    rows = found.rows if len(found.rows) else found.known
    return [{names[k]: float(row[k]) for k in np.flatnonzero(row)} for row in rows]


def test_what_entries_mean() -> None:
    """Gaps are twice the way from the middle; what is told along a circle is an angle times its radius; one copy is one."""
    machine = load("azulay")

    def one(**given: Any) -> list[dict[str, float]]:
        return off(machine, Tolerances(**{kind: (entry,) for kind, entry in given.items()}))

    assert one(tolerance=Tolerance("leg-2.link.length", sigma="3 um")) == [{"leg-2 elements.link.length dimension x": 3e-6}]
    for size, angle in (("162 um", 1e-3), ("1 mrad", 1e-3), (1e-3, 1e-3)):
        (along_guide,) = one(positioning=Positioning("leg-1.guide", plus_minus=size))
        assert along_guide == {"leg-1 guide drive x": pytest.approx(angle)}
        (loose,) = one(play=Play("leg-1.guide", backlash=size))
        assert loose == {"leg-1 guide drive x": pytest.approx(angle / 2)}
    assert one(play=Play("leg-3.slide", backlash=4e-6)) == [{"leg-3 slide drive x": 2e-6}]
    assert one(play=Play("leg-3.hinge", about="y", gap="2 mrad")) == [{"leg-3 hinge about y": 1e-3}]
    ball = one(play=Play("leg-1.ball", radial="4 um"))
    assert ball == [{f"leg-1 ball along {axis}": 2e-6} for axis in "xyz"]
    for joint, freedom in (("guide", "y"), ("slide", "x"), ("hinge", "y")):
        rows = one(play=Play(f"leg-1.{joint}", radial="4 um"))
        assert [np.linalg.norm(list(row.values())) for row in rows] == pytest.approx([2e-6] * 2)
        assert not any(f"leg-1 {joint} along {freedom}" in row for row in rows)
    (longer,) = one(heat=Heat(("leg-1.link",), warmer="2 K", expansion=1e-5))
    assert longer == {"leg-1 elements.link.length dimension x": pytest.approx(0.216 * 2e-5)}
    hexapod = load("gough-stewart", {"platform.tool_tip": "0 mm, 0 mm, 40 mm"})
    warm = [off(hexapod, Tolerances(heat=(Heat((body,), warmer=1.0, expansion=1e-5),)))[0] for body in ("ground", "platform")]
    assert {name.split()[1] for name in warm[0]} == {"base.radius"}
    assert {name.split()[1] for name in warm[1]} == {"platform_joint.radius", "z"}
    assert warm[1]["tip z"] == pytest.approx(4e-7)


def test_what_is_only_warm_is_off_for_sure() -> None:
    warm = accuracy("azulay", Tolerances(heat=(Heat(warmer="3 K", expansion=1e-5),)), at(0.002, 0.0, 0.124, 0.4, 0.5, 0.6))
    distance = np.linalg.norm(warm.shift[0, :3])
    np.testing.assert_allclose(warm.size[0], [distance, 0], atol=1e-15)
    np.testing.assert_allclose(warm.worst[0], np.abs(warm.shift[0]), atol=1e-15)
    assert distance <= warm.farthest[0, 0] <= distance / np.cos(apart(FACETS)) * (1 + 1e-12)


def test_amounts_of_copies_add_up_to_what_is_common() -> None:
    machine, *_, errors, _ = stood("azulay")
    askew = [
        Misalignment(name, about="x", plus_minus=1e-4, common=name == "hinge")
        for name in ("hinge", *(f"leg-{k}.hinge" for k in (1, 2, 3)))
    ]
    for common, each in (
        (
            Tolerances((Tolerance("guide.radius", sigma=1e-5, common=True),)),
            Tolerances((Tolerance("guide.radius", sigma=1e-5),)),
        ),
        (Tolerances(misalignment=(askew[0],)), Tolerances(misalignment=tuple(askew[1:]))),
    ):
        one, many = (inexactness(machine, given).rows[:, :-3] @ errors for given in (common, each))
        assert (len(one), len(many)) == (1, 3)
        np.testing.assert_allclose(one[0], many.sum(axis=0), atol=1e-15)


@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_that_is_warm_all_over_is_a_larger_one(name: str) -> None:
    """Angles stay, also those of the drives; what a slide is extended by grows with it."""
    machine, pose, _, errors, _ = stood(name)
    warm = inexactness(machine, Tolerances(heat=(Heat(warmer="10 K", expansion="1e-5 1/K"),)))
    np.testing.assert_allclose(warm.known[0, :-3] @ errors, np.r_[1e-4 * table(pose)[0], 0, 0, 0], atol=1e-12)


def test_the_parts_that_warm_make_the_whole() -> None:
    machine, *_, errors, _ = stood("gough-stewart")
    bodies = [("ground",), ("platform",), ("left.strut", "right.strut")]

    def shifts(machine: Machine, *heat: Heat) -> np.ndarray:
        return inexactness(machine, Tolerances(heat=heat)).known[:, :-3] @ errors

    whole = shifts(machine, Heat(warmer="1 K", expansion=1e-5))
    parts = shifts(machine, *(Heat(own, warmer="1 delta_degC", expansion=1e-5) for own in bodies))
    assert np.abs(parts).max(axis=1).min() > 1e-7
    np.testing.assert_allclose(parts.sum(axis=0), whole[0], atol=1e-15)
    steel = dataclasses.replace(machine.materials["steel"], expansion=1e-5)
    of_steel = dataclasses.replace(machine, materials=machine.materials | {"steel": steel})
    np.testing.assert_allclose(shifts(of_steel, Heat(("strut",), warmer=1.0))[0], parts[2], atol=1e-15)


def test_over_a_hemisphere() -> None:
    """317 points are too many here; what is told of all is what is told of one, and the tool moves with the platform."""
    given = Tolerances((Tolerance("link.length", plus_minus="0.02 mm"),), play=(Play("ball", radial="5 um"),))
    machine = load("azulay", {"platform.tool_tip": "0 mm, 5 mm, 30 mm"})
    centre, tool = (
        accuracy(machine, given, over_hemisphere(0.121, 0.004, 3), roll=0.3, point=point) for point in ("platform", "tool")
    )
    assert centre.policy.startswith("17.")
    assert centre.used.sum() == len(centre.family) == 29
    poses, own = centre.places.frames(), np.array([0.0, 0.005, 0.03])
    for (rows, a), (_, b) in zip(centre.contributions(), tool.contributions(), strict=True):
        axes = np.array([[np.asarray(c)[rows] for c in axis] for axis in poses[1:]])
        arm = np.einsum("k,kcn->nc", own, axes)[:, None]
        np.testing.assert_allclose(b, np.concatenate([a[..., :3] + np.cross(a[..., 3:], arm), a[..., 3:]], axis=2), atol=1e-12)
    np.testing.assert_allclose(centre.shares().sum(axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose(centre.shares("x")[:, 0], centre.variances[:, 0, 0] / centre.covariance[:, 0, 0], rtol=1e-12)
    worst = centre.least_accurate
    assert centre.size[worst, 0] == centre.size[:, 0].max()
    beyond = accuracy(machine, given, in_block((0, 0, 0.07), (0, 0, 0.1), (1, 1, 1)), roll=0.0)
    assert beyond.used.tolist() == [False, True]
    assert np.isnan(beyond.farthest[0]).all()
    ((_, rows),) = beyond.contributions()
    assert np.isnan(rows).all(axis=(1, 2)).tolist() == [True, False]
    with pytest.raises(NoResultError, match="no pose of the block"):
        accuracy(machine, given, in_block((0, 0, 0.01), (0, 0, 0.01), (1, 1, 1)), roll=0.0)


def _of(kind: str, *lines: str) -> str:
    return "\n".join((f"[[{kind}]]", *lines))


_LENGTH, _HINGE, _BALL, _LINK = 'of = "link.length"', 'of = "hinge"', 'joint = "ball"', 'bodies = ["link"]'
WRONG = {
    _of("tolerance", 'of = "link.lenght"', 'sigma = "1 um"'): "tolerance 1: link.lenght: no such key in this machine; did you",
    _of("tolerance", 'of = "hinge.travel.1"', 'sigma = "1 deg"'): "hinge.travel.1: has no part in where the platform is",
    _of("tolerance", _LENGTH, 'sigma = "1 N"'): "sigma: \"1 N\": 'N' is not a unit of length; write for example",
    _of("tolerance", _LENGTH, "sigma = 0.02"): "the unit is missing; write for example",
    _of("tolerance", _LENGTH, 'sigma = "-1 um"'): "must be greater than zero",
    _of("tolerance", _LENGTH): "tolerance 1: needs either plus_minus or sigma, a length such as",
    _of("tolerance", _LENGTH, 'sigma = "1 um"', 'plus_minus = "1 um"'): "needs either plus_minus or sigma",
    _of("tolerance", _LENGTH, 'width = "1 um"'): "tolerance.1.width: unknown key",
    _of("misalignment", 'of = "henge"', 'about = "x"', 'sigma = "1 deg"'): "henge: azulay has no such joint or body; did",
    _of("misalignment", _HINGE, 'sigma = "1 deg"'): "needs either along or about, an axis of its own frame",
    _of("misalignment", _HINGE, 'about = "x"', 'sigma = "1 mm"'): "'mm' is not a unit of angle",
    _of("misalignment", _HINGE, 'about = "w"', 'sigma = "1 deg"'): "misalignment.1.about: \"w\" is not known; expected 'x',",
    _of("positioning", _HINGE, 'sigma = "1 deg"'): "hinge: nothing holds this joint where it is",
    _of("play", 'joint = "link"', 'radial = "1 um"'): "link: azulay has no such joint",
    _of("play", _BALL): "play 1: needs one of radial, backlash, and gap",
    _of("play", _BALL, 'radial = "1 um"', 'gap = "1 um"'): "play 1: needs one of radial, backlash, and gap",
    _of("play", _BALL, 'radial = "1 um"', 'along = "x"'): "radial: goes without along and about",
    _of("heat", 'bodies = ["hinge"]', 'warmer = "5 K"'): "bodies: hinge: no body of this name has a length that grows",
    _of("heat", _LINK, 'warmer = "5 degC"'): "'degC' is not a unit of change of temperature; write for example \"5 K\"",
    _of("heat", _LINK, 'warmer = "5 K"'): "leg-1.link: its material steel has no expansion; give it one, or give expansion",
    _of("heat", 'warmer = "5 K"'): "leg-1.guide: is of no material; name bodies, and give these an expansion",
    _of("heat", _LINK, 'expansion = "1e-5 1/K"'): "heat 1: needs warmer, plus_minus or sigma",
    "format = 1": "names nothing that is inexact; begin with [[tolerance]]",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_with_a_tolerance_file_is_said_in_one_line(text: str, tmp_path: Path) -> None:
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        accuracy("azulay", file)
    assert str(error.value).startswith(f"{file}: ")
    assert WRONG[text] in str(error.value)


def test_what_cannot_be_asked() -> None:
    given = Tolerances((Tolerance("link.length", plus_minus=1e-5),))
    with pytest.raises(InputError, match="point 'tip' is not known"):
        accuracy("azulay", given, point="tip")
    with pytest.raises(InputError, match=r"expected \(x, y, z, azimuth, tilt, roll\)"):
        accuracy("azulay", given, (0, 0, 0.125, 0, 0))
    with pytest.raises(InputError, match="has rolls of its own"):
        accuracy("azulay", given, at(0, 0, 0.125, 0, 0, 0), roll=0.0)
    with pytest.raises(InputError, match="9 actuators and 6 constraints"):
        accuracy(load("rmmt").with_free_drives(), given)
    with pytest.raises(InputError, match="nothing is said to be inexact"):
        accuracy("azulay", Tolerances())
    with pytest.raises(InputError, match="plus_minus: nan"):
        accuracy("azulay", Tolerances((Tolerance("link.length", plus_minus=float("nan")),)))


def test_tables_pictures_and_files(tmp_path: Path) -> None:
    """Of a hemisphere whose ring of singular poses first order says nothing of, and of a path."""
    given = Tolerances(
        (Tolerance("link.length", plus_minus="0.02 mm"),), heat=(Heat(("link",), warmer="5 K", expansion="1.2e-5 1/K"),)
    )
    found = accuracy("azulay", given, over_hemisphere(0.121, 0.004, 5), roll="-alpha")
    assert 0 < found.beyond.sum() < found.used.sum() == len(found.family)
    assert not found.beyond[found.least_accurate]
    console = Console(width=150, file=io.StringIO(), record=True)
    for one in tables(found):
        console.print(one)
    text = console.export_text()
    assert "81 of 81 points reached; platform centre, drives held" in text
    assert f"{found.beyond.sum()} points: the platform may turn by more than 3°, as near a singularity" in text
    assert re.search(r"tolerance +link.length +± 0.02 mm +3 +100.0 +100.0 +100.0 +100.0 +0\n", text)
    assert re.search(r"heat +link +5 K warmer +0 +0.0", text)
    document = json.loads(json.dumps(as_json(found), allow_nan=False))
    assert document["sources"][1] == {"kind": "heat", "of": "link", "size": "5 K warmer", "amounts": 0}
    np.testing.assert_array_equal(document["worst_m_rad"], found.worst)
    trivet.save(found, tmp_path / "errors.nc")
    with xr.open_dataset(tmp_path / "errors.nc", engine="h5netcdf") as kept:
        np.testing.assert_array_equal(kept["covariance"].sel(component="x", **{"with": "y"}), found.covariance[:, 0, 1])
        assert kept["of"].values.tolist() == ["link.length", "link"]
    trivet.figure(found, tmp_path / "errors.png")
    assert (tmp_path / "errors.png").read_bytes().startswith(b"\x89PNG")
    trivet.figure(found, tmp_path / "errors.html")
    page = (tmp_path / "errors.html").read_text()
    assert "near a singularity" in page
    assert "link.length \\u00b1 0.02 mm" in page
    path = accuracy("azulay", given, at(0, 0, 0.125, 0, 0.1, 0))
    trivet.figure(path, tmp_path / "path.png")
    trivet.figure(path, tmp_path / "path.html")


def test_the_file_of_the_page_is_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "accuracy.md").read_text(encoding="utf-8")
    file = tmp_path / "tolerances.toml"
    file.write_text(page.split("```toml tolerances\n")[1].split("```")[0], encoding="utf-8")
    found = inexactness(load("azulay"), read_tolerances(file))
    assert [source.kind for source in found.sources].count("play") == 3
    assert found.known[-1].any()
