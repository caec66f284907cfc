"""What a user, an adversary and a physicist found in reach: edges where bodies decide, thin petals, bad meshes, ways home."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import trivet as t
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.reach.margins import side
from trivet.reach.tilt import Looked
from trivet.reach.workspace import Orientations, Region, found_region, grown, reached
from trivet.space.pose import zyz_frame
from trivet.study.tilt import TiltStudy
from trivet.views import tilt as view

VICE = {
    "ball.neutral": {"axis": "x"},
    "interference.clearance": "1 mm",
    "fixtures.vice": [{"shape": "box", "size": ["30 mm", "60 mm", "60 mm"], "centre": ["100 mm", "60 mm", "30 mm"]}],
}


def test_an_edge_where_bodies_decide_does_not_hang_on_the_grid_of_rolls() -> None:
    machine = load("azulay", VICE)
    settings: Any = {"azimuths": 6, "step": math.radians(5), "most": math.radians(60)}
    coarse, fine = (t.tilt(machine, 0.008, 0.1, rolls=rolls, **settings) for rolls in (36, 720))
    assert coarse.unbroken.min() < math.radians(50)  # the vice is in the way there, and nowhere else
    np.testing.assert_allclose(coarse.unbroken, fine.unbroken, rtol=0, atol=math.radians(0.02))
    worst = int(fine.unbroken.argmin())
    assert "vice" in fine.stops[worst]
    assert "1 mm is the least" in fine.stops[worst]
    assert fine.largest[worst] >= fine.unbroken[worst]


def test_what_ends_the_ways_from_home_is_told() -> None:
    report = t.tilt("azulay", 0.008, 0.1, neutral="radial", bodies=False, azimuths=3, most=math.radians(110))
    assert report.connected_stops == ["a Type 2 singularity"] * 3
    free = t.tilt("azulay", 0.008, 0.1, bodies=False, azimuths=3, most=math.radians(20))
    assert free.stops == free.connected_stops == ["nothing, up to 20 deg"] * 3


def test_a_home_that_is_not_reached_is_told() -> None:
    machine = load("azulay", {"home.position": "0 mm, 0 mm, 400 mm"})
    report = t.tilt(machine, 0.008, 0.1, azimuths=3, most=math.radians(30))
    assert report.apart.startswith("home itself is not reached, leg-1 cannot close")
    assert np.isnan(report.connected_tilt)
    wide = Console(width=300)
    with wide.capture() as shown:
        wide.print(*view.tables(TiltStudy((report,), ())))
    assert shown.get().count("cannot close") == 1


def test_a_region_grows_over_thin_petals() -> None:
    """Of a ball with three needles; and the workspace of azulay, whose petals reach farther than a coarse lattice sees."""

    def within(points: np.ndarray) -> np.ndarray:
        ball = np.linalg.norm(points, axis=1) < 0.3
        needles = [np.all(np.abs(np.delete(points, k, axis=1)) < 0.02, axis=1) & (points[:, k] < 0.8) for k in range(3)]
        found: np.ndarray = ball | (np.any(needles, axis=0) & (points > -0.1).all(axis=1))
        return found

    around = Region(np.full(3, -1.0), np.full(3, 1.0))
    rough = found_region(within, around, np.zeros(3))
    assert rough is not None
    region = grown(within, rough, around, 60)
    assert np.all(region.high >= 0.79)
    assert np.all(region.low <= -0.3)
    machine = load("azulay")
    report = t.workspace(machine, count=24)
    rng = np.random.default_rng(3)
    points = rng.uniform([-0.16, -0.16, 0.02], [0.16, 0.16, 0.26], (60_000, 3))
    looked = Looked(machine, parse_mode(machine), None, None)
    inside = points[reached(looked, points, "constant", Orientations.one(0.0, 0.0, 0.0))]
    free = t.workspace(machine, count=24, bodies=False)
    low, high = free.extent
    step = 1.5 * (free.columns.x[1] - free.columns.x[0])
    assert np.all(inside.min(axis=0) > low - step)
    assert np.all(inside.max(axis=0) < high + step)
    share = len(inside) / len(points) * 0.32 * 0.32 * 0.24
    assert free.volume == pytest.approx(share, abs=2 * free.error + 3 * share / math.sqrt(len(inside)))
    assert report.volume < free.volume


def test_a_long_slide_does_not_hide_the_workspace() -> None:
    report = t.workspace(load("azulay", {"slide.travel": "0 mm, 10 m"}), count=12)
    assert report.volume > t.workspace("azulay", count=12).volume


def test_what_hangs_together_with_home_ends_at_the_singular_cylinder() -> None:
    """Upright on circular guides det J_x vanishes where the axis of the guides lies on the circle of the platform joints."""
    machine = load("azulay")
    radius = 0.018
    for x, sign in ((radius - 1e-4, 1.0), (radius + 1e-4, -1.0)):
        pose = zyz_frame(np.array([[x, 0.0, 0.12]]), np.zeros(1), np.zeros(1), np.zeros(1))
        home = zyz_frame(np.array([[0.0, 0.0, 0.12]]), np.zeros(1), np.zeros(1), np.zeros(1))
        assert side(machine, pose, parse_mode(machine))[0] == sign * side(machine, home, parse_mode(machine))[0]
    report = t.workspace(machine, count=60, region=((-0.03, -0.03, 0.05), (0.03, 0.03, 0.21)))
    heights = report.columns.lengths
    x, y = np.meshgrid(report.columns.x, report.columns.y, indexing="ij")
    inner = np.where(np.hypot(x, y) < radius, heights, 0).sum() * report.columns.cell
    assert report.volume_from_home == pytest.approx(inner, rel=0.02)
    straight = t.workspace("ben-horin", count=20)
    assert straight.part_from_home == pytest.approx(1.0, abs=1e-3)
    assert math.isnan(t.workspace("azulay", "reachable", cone=0.2, step=0.2, count=6, bodies=False).part_from_home)


@pytest.mark.parametrize("arguments", [("tilt", "azulay", "--radius", "1 km", "--radius", "2 km"),
    ("workspace", "azulay", "alizade", "--columns", "4", "--region", "1 km,1 km,1 km;2 km,2 km,2 km")])  # fmt: skip
def test_no_result_at_all_is_no_success(arguments: tuple[str, ...], trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet(*arguments, "--figure", "z.png")
    assert code == 1
    assert not out
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "z.png").exists()


@pytest.mark.parametrize("name", ["platform", "workpiece"])
def test_reserved_names(name: str) -> None:
    with pytest.raises(t.InputError, match=rf'fixtures\.{name}: "{name}" is a body that every machine has'):
        load("azulay", {f"fixtures.{name}": [{"shape": "sphere", "radius": "5 mm"}]})


def test_unknown_bodies_are_refused_at_reading() -> None:
    with pytest.raises(t.InputError, match=r"interference\.may_touch: no body \"leg\.lnk\"; did you mean 'leg\.link'"):
        load("azulay", {"interference.may_touch": [["leg.lnk", "platform"]]})


def stl(triangles: Any) -> bytes:
    """A binary STL file."""
    body = b"".join(struct.pack("<12f", 0, 0, 0, *np.ravel(triangle).tolist()) + b"\0\0" for triangle in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


TETRAHEDRON = [[[0, 0, 0], [0, 10, 0], [10, 0, 0]], [[0, 0, 0], [10, 0, 0], [0, 0, 10]],
               [[0, 0, 0], [0, 0, 10], [0, 10, 0]], [[10, 0, 0], [0, 10, 0], [0, 0, 10]]]  # fmt: skip
PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 1\nproperty list int int vertex_indices\nend_header\n" + b"\0" * 48 + struct.pack("<i", 2_000_000_000)
)


@pytest.mark.peer("coal")
@pytest.mark.parametrize(
    ("suffix", "content", "words"),
    [
        ("stl", stl([*TETRAHEDRON, [[math.nan, 0, 0], [1, 0, 0], [0, 1, 0]]]), "not a number"),
        ("stl", stl([*TETRAHEDRON, [[1e38, 0, 0], [1, 0, 0], [0, 1, 0]]]), "farther than"),
        ("stl", stl(np.array(TETRAHEDRON) * 1e-38), "without a volume"),
        ("stl", stl(TETRAHEDRON[:1]), "without a volume"),
        ("stl", b"\0" * 80 + struct.pack("<I", 4_000_000_000) + b"\0" * 50, "cannot be read as a mesh"),
        ("ply", PLY, "cannot be read as a mesh"),
        ("obj", b"v 0 0 0\nf 1 2 9\n", "cannot be read as a mesh"),
    ],
)
def test_bad_meshes(suffix: str, content: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / f"tool.{suffix}").write_bytes(content)
    file = tmp_path / "m.toml"
    shape = f'{{ shape = "mesh", file = "tool.{suffix}", unit = "mm" }}'
    file.write_text(f'variant_of = "azulay"\n[about]\nname = "m"\n[set]\n"platform.shapes" = [{shape}]\n', encoding="utf-8")
    with pytest.raises(t.InputError, match=rf"shapes of platform: .*tool\.{suffix}: .*{words}"):
        t.pose(str(file)).clearances  # noqa: B018


def test_pose_says_at_once_what_touches(trivet: Any, tmp_path: Path) -> None:
    ball = '{ shape = "sphere", radius = "40 mm", centre = ["120 mm", "0 mm", "70 mm"] }'
    text = f'variant_of = "azulay"\n[about]\nname = "m"\n[set]\n"fixtures.ball" = [{ball}]\n'
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    code, out, _ = trivet("pose", "m.toml")
    assert code == 0
    assert "leg-1.link and ball TOUCH" in out.splitlines()[1]


def test_single_reports_are_drawn_and_saved(tmp_path: Path) -> None:
    tilt = t.tilt("azulay", 0.008, 0.1, azimuths=3, step=0.2, most=0.4, rolls=12, bodies=False)
    workspace = t.workspace("azulay", count=6, bodies=False)
    for k, report in enumerate((tilt, workspace)):
        t.figure(report, tmp_path / f"{k}.png")
        t.save(report, tmp_path / f"{k}.nc")
        assert (tmp_path / f"{k}.png").stat().st_size > 5000


def test_shapes_and_fixtures_are_drawn() -> None:
    from trivet.show.scene import scene

    machine = load("azulay", VICE | {"platform.shapes": [{"shape": "capsule", "start": ["0 mm", "0 mm", "0 mm"],
        "end": ["0 mm", "0 mm", "40 mm"], "radius": "6 mm"}]})  # fmt: skip
    drawn = {shape.name: shape for shape in scene(machine).shapes}
    rings = drawn["vice"].rings.reshape(-1, 3)
    np.testing.assert_allclose(rings.min(axis=0), [0.085, 0.03, 0.0], atol=1e-12)
    np.testing.assert_allclose(rings.max(axis=0), [0.115, 0.09, 0.06], atol=1e-12)
    tops = [shape.rings[..., 2].max() for shape in scene(machine).shapes if shape.name == "platform"]
    assert max(tops) == pytest.approx(float(machine.home.position[2]) + 0.046, abs=1e-6)
