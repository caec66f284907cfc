"""Drawings: the files that appear, and the geometry of what they show."""

from __future__ import annotations

import math
import os
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from machines import PAPER, random_stands, unlocked

import trivet.show.page
from trivet.errors import InputError, NoResultError
from trivet.files import replacing
from trivet.kinematics.closure import close_machine
from trivet.kinematics.inverse import inverse
from trivet.kinematics.mode import all_modes, parse_mode
from trivet.model import Machine, load
from trivet.model.elements import Beam, Curvilinear, Prismatic, Revolute
from trivet.show.drawing import draw, heading
from trivet.show.palette import COLOURS, LEGEND, MARKED, paint
from trivet.show.raster import Facets, render
from trivet.show.scene import Scene, home_pose, scene
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

MACHINES = (*PAPER, "tahmasebi", "rmmt", "gough-stewart")


def _pose(machine: Machine) -> Frame:
    shift = np.array((0.004, -0.003, 0.002))
    return zyz_frame(np.array(machine.home.position) + shift, 0.4, 0.15, -0.3)


def _links(seen: Scene) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {s.name: (s.start, s.end) for s in seen.shapes if s.role == "link"}


def _platform_joints(machine: Machine, pose: Frame) -> dict[str, np.ndarray]:
    """From the description alone: P_i = p + R (R_p cos a, R_p sin a, height)."""
    turn = np.array([[float(c) for c in row] for row in pose.matrix()])
    found = {}
    for leg in machine.legs:
        joint, angle = leg.chain.platform_joint, leg.chain.platform_joint.azimuth + leg.rotation
        place = np.array((joint.radius * math.cos(angle), joint.radius * math.sin(angle), joint.height or 0.0))
        found[leg.name] = np.array([float(c) for c in pose.origin]) + turn @ place
    return found


@pytest.mark.parametrize("name", MACHINES)
def test_links_have_their_length_and_end_at_the_platform(name: str) -> None:
    machine = load(name)
    pose = _pose(machine)
    seen = scene(machine, pose)
    links, joints = _links(seen), _platform_joints(machine, pose)
    drawn = 0
    for leg in machine.legs:
        bodies = [e for e in leg.chain.elements if e.axis_of_body is not None]
        for element in (e for e in bodies if isinstance(e, Beam)):
            start, end = links[f"{leg.name}.{element.name}"]
            assert abs(np.linalg.norm(end - start) - element.length) < 1e-12
            drawn += 1
        _, last = links[f"{leg.name}.{bodies[-1].name}"]
        assert np.linalg.norm(last - joints[leg.name]) < 1e-12
    assert drawn == {"alizade": 0, "glozman": 6, "gough-stewart": 0}.get(name, 3)
    telescopes = {"alizade": "telescope", "gough-stewart": "strut"}
    if name in telescopes:
        assert len(links) == len(machine.legs)


@pytest.mark.parametrize("name", MACHINES)
def test_chains_hang_together(name: str) -> None:
    """From the first body on, every link starts where the one before it ended."""
    machine = load(name)
    links = _links(scene(machine, _pose(machine)))
    for leg in machine.legs:
        own = [links[f"{leg.name}.{e.name}"] for e in leg.chain.elements if f"{leg.name}.{e.name}" in links]
        for (_, end), (start, _) in pairwise(own):
            assert np.linalg.norm(end - start) < 1e-12


@pytest.mark.parametrize("name", ["azulay", "eclipse", "alizade"])
def test_closed_form_and_closure_draw_alike(name: str) -> None:
    """The joints of a scene stand where the numerically closed chain has them, where the travels leave one mode only."""
    machine = load(name)
    pose = home_pose(machine)
    seen = {s.name: s for s in scene(machine, pose).shapes if s.role.endswith("joint")}
    for leg, closure in zip(machine.legs, close_machine(machine, pose), strict=True):
        frame = leg.base_frame()
        for element, coordinate in zip(leg.chain.elements, closure.coordinates, strict=True):
            beyond = element.advance(frame, coordinate)
            if isinstance(element, (Curvilinear, Revolute)) or (isinstance(element, Prismatic) and name != "alizade"):
                place = np.array([float(c) for c in beyond.origin])
                np.testing.assert_allclose(seen[f"{leg.name}.{element.name}"].start, place, atol=1e-9)
            frame = beyond


def test_locked_joints_are_seen() -> None:
    roles = {s.name.partition(".")[2]: s.role for s in scene(load("rmmt")).shapes if s.role.endswith("joint")}
    drives = {"guide": "locked joint", "tangential": "actuated joint", "radial": "actuated joint"}
    assert roles == {**drives, "hinge": "passive joint", "ball": "passive joint"}


def test_other_modes_draw_other_links() -> None:
    machine = load("azulay")
    pose = home_pose(machine)
    for mode in all_modes(machine)[::9]:
        seen = scene(machine, pose, mode)
        assert seen.mode == mode
        signs = parse_mode(machine, mode)
        for leg, sign in zip(machine.legs, signs, strict=True):
            d = float(inverse(leg, pose, sign).coordinates[1])
            start, end = _links(seen)[f"{leg.name}.slide"]
            assert math.dist(start, end) == pytest.approx(abs(d), abs=1e-12)


def test_random_poses_and_modes() -> None:
    machine = load("eclipse")
    poses, signs = random_stands(machine, 5, seed=2)
    for index in range(5):
        pose = Frame(*(Vec(*(float(c[index]) for c in v)) for v in poses))
        mode = " ".join("".join("+" if s > 0 else "-" for s in leg[:, index]) for leg in signs)
        links, joints = _links(scene(machine, pose, mode)), _platform_joints(machine, pose)
        for leg in machine.legs:
            assert np.linalg.norm(links[f"{leg.name}.link"][1] - joints[leg.name]) < 1e-12


def test_outline_of_a_link_is_its_section() -> None:
    seen = scene(load("azulay"))
    link = next(s for s in seen.shapes if s.name == "leg-1.link")
    assert np.linalg.norm(link.rings[0] - link.start, axis=1) == pytest.approx(0.019 / 2, abs=1e-12)
    assert (link.rings[0] - link.start) @ (link.end - link.start) == pytest.approx(0, abs=1e-12)


def test_guide_is_drawn_once_and_on_its_circle() -> None:
    guides = [s for s in scene(load("azulay")).shapes if s.name.endswith(".guide") and s.role == "guide"]
    assert len(guides) == 1
    assert np.linalg.norm(guides[0].rings.mean(axis=1), axis=1) == pytest.approx(0.162, abs=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_skins_face_outwards(name: str) -> None:
    """The volume inside every closed skin is positive, and light falls on what faces it."""
    for shape in scene(load(name)).shapes:
        vertices, faces = shape.mesh()
        a, b, c = np.moveaxis(vertices[faces] - vertices.mean(axis=0), 1, 0)
        assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0, shape.name


def test_front_hides_back_and_shows_through() -> None:
    """Two triangles, the nearer one small: its colour in the middle, the other's around; half of each where it is clear."""
    large = np.array([[[0.0, 0, 1], [40, 0, 1], [20, 40, 1]]])
    small = np.array([[[15.0, 5, 0], [25, 5, 0], [20, 15, 0]]])
    red, blue = np.array([[1.0, 0, 0]]), np.array([[0, 0, 1.0]])
    for bodies in ([Facets(large, red, 1.0), Facets(small, blue, 1.0)], [Facets(small, blue, 1.0), Facets(large, red, 1.0)]):
        picture = render(bodies, 40, 40)[::-1]
        np.testing.assert_allclose(picture[8, 20], (0, 0, 1, 1))
        np.testing.assert_allclose(picture[25, 20], (1, 0, 0, 1))
        np.testing.assert_allclose(picture[39, 0], (0, 0, 0, 0))
    picture = render([Facets(large, red, 1.0), Facets(small, blue, 0.5)], 40, 40)[::-1]
    np.testing.assert_allclose(picture[8, 20], (0.5, 0, 0.5, 1))
    hidden = render([Facets(small, red, 1.0), Facets(large, blue, 0.5)], 40, 40)[::-1]
    np.testing.assert_allclose(hidden[8, 20], (1, 0, 0, 1))


def test_picture(tmp_path: Path) -> None:
    from matplotlib.image import imread

    draw(load("azulay"), path=tmp_path / "machine.png")
    picture = imread(tmp_path / "machine.png")
    assert picture.shape[:2] == (900, 1200)
    blue = (np.abs(picture[..., 2] - picture[..., 0]) > 0.3) & (picture[..., 2] > picture[..., 0])
    assert 0.01 < blue.mean() < 0.2  # the links


def test_page_needs_no_network(tmp_path: Path) -> None:
    draw(load("azulay"), path=tmp_path / "machine.html", status="leg-1.hinge <above>")
    text = (tmp_path / "machine.html").read_text(encoding="utf-8")
    assert not re.search(r"<(script|link|img|iframe)[^>]*(src|href)\s*=", text)
    assert "Plotly.newPlot" in text
    assert len(text) > 1_000_000  # plotly itself is inside
    assert re.search(r"leg-1\.hinge (&|\\u0026)lt;above", text)  # plotly reads tags in titles


def test_not_overwritten_unasked(tmp_path: Path) -> None:
    path = tmp_path / "machine.html"
    path.write_text("mine")
    with pytest.raises(InputError, match="exists already") as caught:
        draw(load("azulay"), path=path)
    assert caught.value.exit_code == 2
    assert path.read_text() == "mine"
    draw(load("azulay"), path=path, overwrite=True)
    assert path.read_text(encoding="utf-8") != "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["machine.html"]


@pytest.mark.parametrize("name", ["machine.pdf", "machine", "machine.pngg"])
def test_bad_suffix(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png or \.html"):
        draw(load("azulay"), path=tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_unwritable_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot be written: No such file or directory$"):
        draw(load("azulay"), path=tmp_path / "missing" / "machine.html")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"cannot be written: Not a directory$"):
        draw(load("azulay"), path=tmp_path / "file" / "machine.html")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        draw(load("azulay"), path=tmp_path / "folder.png")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="Permission denied"):
            draw(load("azulay"), path=tmp_path / "machine.html")
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_nothing_is_left_of_a_failed_drawing(
    error: type[BaseException], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(painted: object, seen: object, lines: object, path: Path) -> None:
        path.write_text("half")
        raise error

    monkeypatch.setattr(trivet.show.page, "write_page", fail)
    (tmp_path / "machine.html").write_text("mine")
    with pytest.raises(error):
        draw(load("azulay"), path=tmp_path / "machine.html", overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["machine.html"]
    assert (tmp_path / "machine.html").read_text() == "mine"


def test_full_disk_is_told_and_other_files_are_not_blamed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"result: cannot be written: No space left"), replacing(tmp_path / "result"):
        raise OSError(28, "No space left on device")
    with pytest.raises(FileNotFoundError), replacing(tmp_path / "result"):
        (tmp_path / "another").read_text()
    assert list(tmp_path.iterdir()) == []


def test_written_files_have_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    with replacing(tmp_path / "result") as temporary:
        temporary.write_text("")
    assert (tmp_path / "result").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_status_marks_the_joint_it_names() -> None:
    seen = scene(load("azulay"))
    painted = paint(seen.shapes, "leg-2.hinge elevation at 72 deg is above its limit of 70 deg")
    assert {p.shape.name for p in painted if p.is_marked} == {"leg-2.hinge"}
    assert {p.colour for p in painted if p.is_marked} == {MARKED}
    shown = {label.text for label in seen.labelled({"leg-2.hinge"})}
    assert shown == {"leg-1.guide", "leg-1.slide", "leg-1.hinge", "leg-1.ball", "leg-2.hinge"}
    assert MARKED not in {p.colour for p in paint(seen.shapes)}
    assert heading(load("azulay"), seen, "leg-2.hinge")[2] == "leg-2.hinge"


def test_colours_are_told_apart() -> None:
    """Of a machine, and of measured points on a machine that is grey."""
    mapped = ["machine", "measured point", "point on the machine", "response", "load"]
    for listed in ([COLOURS[role] for role in LEGEND if role not in mapped] + [MARKED], [COLOURS[role] for role in mapped]):
        assert len(set(listed)) == len(listed)


def test_heading_tells_mode_and_pose() -> None:
    machine = load("azulay")
    angles = (math.radians(30), math.radians(20), math.radians(-50))
    pose = zyz_frame((0.001, -0.002, 0.12), *angles)
    lines = heading(machine, scene(machine, pose, "+- ++ ++"))
    assert lines[0].startswith("azulay")
    assert lines[1] == "mode +− ++ ++   pose x 1, y −2, z 120 mm, α 30, β 20, γ −50 deg"
    level = heading(machine, scene(machine, zyz_frame((0.0, 0.0, 0.12), 0.2, 0.0, 0.1)))[1]
    assert "α 0, β 0, γ 17.19 deg" in level


def test_what_cannot_be_drawn(tmp_path: Path) -> None:
    with pytest.raises(NoResultError, match=r"chain leg-1 does not reach"):
        draw(load("azulay"), zyz_frame((0.0, 0.0, 0.3), 0.0, 0.0, 0.0), path=tmp_path / "machine.png")
    with pytest.raises(InputError, match="signs"):
        draw(load("azulay"), mode="+", path=tmp_path / "machine.png")
    with pytest.raises(InputError):
        draw(unlocked(), mode="++ ++ ++", path=tmp_path / "machine.png")
    assert list(tmp_path.iterdir()) == []


def test_home_is_the_default_pose() -> None:
    machine = load("azulay")
    first, second = scene(machine), scene(machine, home_pose(machine))
    assert [s.name for s in first.shapes] == [s.name for s in second.shapes]
    assert all(np.array_equal(a.rings, b.rings) for a, b in zip(first.shapes, second.shapes, strict=True))
    assert first.pose.origin.z == pytest.approx(0.125, abs=1e-15)
