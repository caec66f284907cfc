"""Machines for other programs: MuJoCo models that hold themselves, URDF trees, rods as meshes."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documents import message_of
from machines import changed, drives_of
from scipy.spatial.transform import Rotation
from test_dynamics import variant
from test_mujoco import Model

import trivet as t
from trivet.interop.rod_mesh import AROUND, Mesh, rod_mesh
from trivet.interop.urdf import open_loops
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose, stand
from trivet.model import Machine, load
from trivet.model.elements import Beam, Curvilinear, Drivable, Joint, Prismatic, Revolute, Spherical, Universal
from trivet.space.frame import Frame
from trivet.space.vector import Vec

mujoco_peer = pytest.mark.peer("mujoco")
pinocchio_peer = pytest.mark.peer("pin", module="pinocchio")


@cache
def text_of(name: str) -> str:
    return t.to_mjcf(name)


@cache
def tree_of(name: str) -> str:
    return t.to_urdf(name)


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """By the divergence theorem: a sixth of the determinants of all triangles."""
    return float(np.linalg.det(vertices[faces]).sum() / 6)


def polygon(diameter: float) -> float:
    """Area of as many corners as meshes have, on a circle."""
    return AROUND / 2 * (diameter / 2) ** 2 * math.sin(2 * math.pi / AROUND)


def area(machine: Machine, section: str) -> float:
    """Of the drawn section, from its own keys."""
    own = machine.sections[section]
    if own.shape == "tube":
        return polygon(own.outer_diameter) - polygon(own.inner_diameter)
    return polygon(own.diameter) if own.shape == "rod" else float(own.width * own.height)


def numbers(text: str) -> np.ndarray:
    return np.array(text.split(), dtype=float)


@mujoco_peer
@pytest.mark.parametrize("name", t.catalogue())
def test_models_hold_themselves(name: str) -> None:
    """With the forces of the keyframe nothing moves for 0.1 s; without them the platform falls."""
    model = Model(text_of(name))
    start = model.d.body("platform").xpos.copy()

    def farthest() -> float:
        worst = 0.0
        for _ in range(round(0.1 / model.m.opt.timestep)):
            model.engine.mj_step(model.m, model.d)
            worst = max(worst, np.abs(model.d.body("platform").xpos - start).max())
        return worst

    assert farthest() < 1e-7
    model.engine.mj_resetDataKeyframe(model.m, model.d, 0)
    model.d.ctrl[:] = 0
    assert farthest() > 1e-2


@mujoco_peer
def test_the_keyframe_holds_what_the_drives_must_give() -> None:
    model, report = Model(text_of("azulay")), t.dynamics_report("azulay")
    np.testing.assert_allclose(model.m.key_ctrl[0], report.drives.force, rtol=1e-12)


def test_models_of_machines_without_six_drives_hold_nothing() -> None:
    """The file says why, and has no forces in its keyframe."""
    text = t.to_mjcf(changed(load("azulay"), {"guide": {"actuated": None}}))
    assert "No holding forces: azulay: 3 drives for the platform's six freedoms" in text
    key = ET.fromstring(text).find("keyframe/key")
    assert key is not None
    assert "ctrl" not in key.attrib
    assert "No holding forces" not in text_of("azulay")


@mujoco_peer
@pytest.mark.parametrize("name", ["azulay", "gough-stewart", "glozman"])
def test_joints_resist_as_the_machine_file_says(name: str) -> None:
    """What is told along the path of a carriage counts per radian: friction times the radius, the others times its square."""
    machine = variant(name, True)
    model = Model(t.to_mjcf(machine))
    told = 0
    for leg in machine.legs:
        for element in leg.chain.elements:
            if not isinstance(element, Joint) or (isinstance(element, Spherical) and element is leg.chain.elements[-1]):
                continue
            lever = element.radius if isinstance(element, Curvilinear) else 1.0
            motor = element.reflected_inertia if isinstance(element, Drivable) and element.actuated else None
            for number in (".1", ".2") if isinstance(element, Universal) else ("",):
                joint = model.m.joint(f"{leg.name}.{element.name}{number}")
                np.testing.assert_allclose(joint.frictionloss, element.friction * lever, rtol=1e-12)
                np.testing.assert_allclose(joint.damping[:1], element.damping * lever**2, rtol=1e-12)
                np.testing.assert_allclose(joint.armature, (motor or 0.0) * lever**2, rtol=1e-12)
                told += 1
    assert told == (12 if name == "gough-stewart" else 6) + (6 if name == "gough-stewart" else 3)
    plain = Model(text_of(name)).m
    for found in (plain.dof_frictionloss, plain.dof_damping, plain.dof_armature):
        np.testing.assert_array_equal(found, 0)


@pytest.mark.parametrize("name", t.catalogue())
def test_meshes_are_as_large_as_rods(name: str) -> None:
    machine, root = load(name), ET.fromstring(text_of(name))
    rods = {f"{leg.name}.{e.name}": e.rod for leg in machine.legs for e in leg.chain.elements if e.rod is not None}
    meshes = root.findall("asset/mesh")
    assert len(root.findall(".//geom[@type='mesh']")) == len(rods) > 0
    for mesh in meshes:
        rod = rods[mesh.attrib["name"]]
        vertices = numbers(mesh.attrib["vertex"]).reshape(-1, 3)
        faces = numbers(mesh.attrib["face"]).astype(int).reshape(-1, 3)
        length = float(rod.high - rod.low)
        assert volume(vertices, faces) == pytest.approx(area(machine, rod.profile.section) * length, rel=1e-12)
        np.testing.assert_allclose((vertices[:, 0].min(), vertices[:, 0].max()), (rod.low, rod.high), atol=1e-15)


@mujoco_peer
@pytest.mark.parametrize("name", ["azulay", "eclipse", "glozman", "gough-stewart", "tahmasebi"])
def test_meshes_are_where_rods_are(name: str) -> None:
    """The links between two joints fill the line from one to the other, as wide as their section, and nothing beyond."""
    machine, model = load(name), Model(text_of(name))
    geoms = {}
    for geom in ET.fromstring(text_of(name)).iter("body"):
        geoms[geom.attrib["name"]] = [child.attrib["mesh"] for child in geom.findall("geom[@type='mesh']")]
    place = {}
    for k in range(model.m.ngeom):
        if model.m.geom_dataid[k] < 0:
            continue
        mesh = model.m.geom_dataid[k]
        first, count = model.m.mesh_vertadr[mesh], model.m.mesh_vertnum[mesh]
        points = model.m.mesh_vert[first : first + count] @ model.d.geom_xmat[k].reshape(3, 3).T + model.d.geom_xpos[k]
        place.setdefault(model.m.body(model.m.geom_bodyid[k]).name, []).append(points)
    tested = 0
    for leg, _, steps in stand(machine, home_pose(machine), parse_mode(machine)):
        body, after = f"ground/{leg.name}", [frame for _, frame, _ in steps[1:]]
        for (element, before, _), beyond in zip(steps[:-1], after, strict=True):
            body = f"{leg.name}.{element.name}" if element.unknowns else body
            if element.rod is None:
                continue
            axis = np.array(beyond.direction(element.rod.axis), dtype=float)
            ends = np.array(beyond.origin, dtype=float) + np.outer([float(element.rod.low), float(element.rod.high)], axis)
            if isinstance(element, Beam):
                np.testing.assert_allclose(sorted(map(tuple, ends)), sorted([before.origin, beyond.origin]), rtol=0, atol=1e-12)
            points = place[body].pop(0)
            along = (points - ends[0]) @ axis
            length = float(element.rod.high - element.rod.low)
            np.testing.assert_allclose((along.min(), along.max()), (0, length), rtol=0, atol=1e-7)
            across = np.linalg.norm(points - ends[0] - np.outer(along, axis), axis=1)
            outer = machine.sections[element.rod.profile.section].outer_diameter
            assert across.max() == pytest.approx(float(outer) / 2, rel=1e-5)
            tested += 1
    assert tested == sum(len(names) for names in geoms.values())
    assert not any(place.values())


SECTIONS = {
    "tube": {"shape": "tube", "outer_diameter": "19 mm", "inner_diameter": "14 mm"},
    "rod": {"shape": "rod", "diameter": "12 mm"},
    "bar": {"shape": "rectangle", "width": "10 mm", "height": "20 mm"},
    "full": {"shape": "tube", "outer_diameter": "19 mm", "inner_diameter": "0 mm"},
}


@pytest.mark.parametrize("name", SECTIONS)
def test_meshes_are_closed_surfaces(name: str) -> None:
    """Every edge belongs to two triangles, which run along it in opposite ways; outside is where they turn left."""
    machine = changed(load("azulay"), sections=SECTIONS, chains=load_chains())
    mesh: Mesh = rod_mesh(machine.sections[name], -0.1, 0.25)
    edges = Counter((int(face[k]), int(face[(k + 1) % 3])) for face in mesh.faces for k in range(3))
    assert set(edges.values()) == {1}
    assert {(b, a) for a, b in edges} == set(edges)
    assert set(np.unique(mesh.faces)) == set(range(len(mesh.vertices)))
    wide = polygon(0.019) if name == "full" else area(machine, name)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(0.35 * wide, rel=1e-12)
    size = mesh.vertices.max(axis=0) - mesh.vertices.min(axis=0)
    outer = {"bar": (0.01, 0.02), "rod": (0.012, 0.012)}.get(name, (0.019, 0.019))
    np.testing.assert_allclose(size, (0.35, *outer), rtol=1e-12)


def load_chains() -> Any:
    from trivet.model import document_of

    return document_of(load("azulay"))["chains"]


@pytest.mark.parametrize("name", t.catalogue())
def test_trees_are_trees(name: str) -> None:
    """One root; every link but that has one joint that leads to it; joints and limits are the machine's."""
    machine, root = load(name), ET.fromstring(tree_of(name))
    links = [link.attrib["name"] for link in root.findall("link")]
    children = [joint.find("child").attrib["link"] for joint in root.findall("joint")]  # type: ignore[union-attr]
    assert len(set(links)) == len(links) == len(children) + 1
    assert set(links) - set(children) == {"ground"}
    assert set(children) <= set(links)
    joints = {joint.attrib["name"]: joint for joint in root.findall("joint")}
    for place, leg in enumerate(machine.legs):
        for element in leg.chain.elements[: None if place == 0 else -1]:
            if isinstance(element, (Prismatic, Curvilinear, Revolute)) and element.locked is None:
                joint = joints.pop(f"{leg.name}.{element.name}")
                limited = element.travel is not None and not (isinstance(element, Revolute) and element.measure == "elevation")
                turning = "revolute" if limited else "continuous"
                assert joint.attrib["type"] == ("prismatic" if isinstance(element, Prismatic) else turning)
                if limited:
                    limit = joint.find("limit")
                    assert limit is not None
                    np.testing.assert_allclose([float(limit.attrib[key]) for key in ("lower", "upper")], element.travel)
            elif isinstance(element, (Universal, Spherical)):
                for number in range(1, 3 + isinstance(element, Spherical)):
                    assert joints.pop(f"{leg.name}.{element.name}.{number}").attrib["type"] == "continuous"
    assert list(joints) == ["platform-centre"]
    lost = [f"{leg.name}.{leg.chain.elements[-1].name}" for leg in machine.legs[1:]]
    assert open_loops(machine) == lost
    assert f"Joints that are missing: {', '.join(lost)}." in tree_of(name)


@pytest.mark.parametrize(
    ("name", "link", "axis", "middle"),
    [
        ("azulay", "leg-1.hinge", (1, 0, 0), (-0.108, 0, 0)),
        ("tahmasebi", "leg-2.ball.3", (0, 0, 1), (0, 0, 0.075)),
    ],
)
def test_trees_draw_rods_where_they_are(name: str, link: str, axis: Any, middle: Any) -> None:
    """A cylinder lies along z of its own frame, which is turned about the fixed axes x, y and z in succession."""
    origin = ET.fromstring(tree_of(name)).find(f"link[@name='{link}']/visual/origin")
    assert origin is not None
    turn = Rotation.from_euler("xyz", numbers(origin.attrib["rpy"])).as_matrix()
    np.testing.assert_allclose(np.abs(turn[:, 2]), axis, rtol=0, atol=1e-12)
    np.testing.assert_allclose(numbers(origin.attrib["xyz"]), middle, rtol=0, atol=1e-12)


def test_trees_say_where_home_is() -> None:
    at = home_pose(load("azulay"))
    home = Frame(*(Vec(*(np.array([float(c)]) for c in v)) for v in at))
    (coordinates,) = drives_of(load("azulay"), home, np.ones((3, 2, 1)))
    said = tree_of("azulay").split("At home: ")[1].split(" -->")[0]
    values = dict(pair.split(" = ") for pair in said.split(", "))
    for joint, value in zip([f"leg-{k}.{j}" for j in ("guide", "slide") for k in (1, 2, 3)], coordinates, strict=True):
        assert float(values[joint]) == pytest.approx(value, abs=1e-15)


@pinocchio_peer
@pytest.mark.parametrize("name", [*t.catalogue(), "azulay that rubs"])
def test_trees_stand_at_home(name: str) -> None:
    """At the home values of the joints the platform stands at home; all masses are there."""
    import pinocchio as pin

    machine = variant("azulay", True) if name == "azulay that rubs" else load(name)
    model = pin.buildModelFromXML(t.to_urdf(machine))
    data, q, home = model.createData(), pin.neutral(model), home_pose(machine)
    stands = stand(machine, home, parse_mode(machine))
    for one in stands:
        for element, coordinate in zip(one.leg.chain.elements, one.posture.coordinates, strict=True):
            parts = coordinate if isinstance(element, Universal) else (coordinate,)
            for number, part in enumerate(parts, 1):
                joint = f"{one.leg.name}.{element.name}" + (f".{number}" if isinstance(element, Universal) else "")
                if not model.existJointName(joint) or part is None:
                    continue
                own = model.joints[model.getJointId(joint)]
                if isinstance(element, Prismatic):
                    q[own.idx_q] = float(part)
                elif own.nq == 2:
                    q[own.idx_q : own.idx_q + 2] = float(part.cos), float(part.sin)
                else:
                    q[own.idx_q] = math.atan2(part.sin, part.cos)
    leg, steps = stands[0].leg, stands[0].steps
    seat = home.place(leg.platform_frame())
    # A ball does not say how it stands: its three hinges take what turns the body beyond it home.
    beyond = [frame for _, frame, _ in steps[1:]] + [seat]
    for (element, _, _), frame in zip(steps, beyond, strict=True):
        if isinstance(element, Spherical):
            _turn_ball(pin, model, data, q, f"{leg.name}.{element.name}", np.array(frame.matrix(), dtype=float))
    pin.framesForwardKinematics(model, data, q)
    for link, frame in (("platform", seat), ("platform-centre", home)):
        at = data.oMf[model.getFrameId(link, pin.FrameType.BODY)]
        np.testing.assert_allclose(at.translation, np.array(frame.origin, dtype=float), rtol=0, atol=1e-12)
        np.testing.assert_allclose(at.rotation, np.array(frame.matrix(), dtype=float), rtol=0, atol=1e-12)
    assert sum(i.mass for i in model.inertias) == pytest.approx(sum(t.pose(machine).masses.values()), rel=1e-12)


def _turn_ball(pin: Any, model: Any, data: Any, q: np.ndarray, name: str, wanted: np.ndarray) -> None:
    """Set the three hinges of a ball about x, y and z in succession so that the link beyond stands as wanted."""
    pin.framesForwardKinematics(model, data, q)
    before = data.oMi[model.parents[model.getJointId(f"{name}.1")]] * model.jointPlacements[model.getJointId(f"{name}.1")]
    angles = Rotation.from_matrix(before.rotation.T @ wanted).as_euler("XYZ")
    for number, angle in enumerate(angles, 1):
        own = model.joints[model.getJointId(f"{name}.{number}")]
        q[own.idx_q : own.idx_q + own.nq] = (math.cos(angle), math.sin(angle)) if own.nq == 2 else angle


def test_trees_resist_as_the_machine_file_says() -> None:
    machine = variant("azulay", True)
    root = ET.fromstring(t.to_urdf(machine))
    guide = machine.legs[0].chain.elements[0]
    assert isinstance(guide, Curvilinear)
    own = root.find("joint[@name='leg-1.guide']/dynamics")
    assert own is not None
    assert float(own.attrib["damping"]) == pytest.approx(guide.damping * 0.162**2, rel=1e-12)
    assert float(own.attrib["friction"]) == pytest.approx(guide.friction * 0.162, rel=1e-12)
    assert ET.fromstring(tree_of("azulay")).find(".//dynamics") is None


def test_rods_without_travel_refuse(tmp_path: Path) -> None:
    endless = changed(load("azulay"), {"slide": {"travel": None}})
    for export, write, ending in ((t.to_urdf, t.write_urdf, "urdf"), (t.to_mjcf, t.write_mjcf, "xml")):
        for call in (lambda own=export: own(endless), lambda own=write, end=ending: own(endless, tmp_path / f"m.{end}")):
            with pytest.raises(t.InputError, match=r"chains\.leg-1\.elements\.slide\.travel: missing, and the rod is as long"):
                call()
    assert list(tmp_path.iterdir()) == []


def test_files_say_what_is_lost(trivet: Any, tmp_path: Path) -> None:
    code, out, err = trivet("export", "azulay", "m.urdf")
    assert (code, out) == (0, "")
    assert err.splitlines() == [
        "wrote m.urdf",
        "trivet: warning: URDF cannot close loops: leg-2.ball, leg-3.ball are not in the file",
    ]
    written = (tmp_path / "m.urdf").read_text(encoding="utf-8")
    assert written == tree_of("azulay")
    assert "leg-2.ball, leg-3.ball" in written
    assert trivet("export", "azulay", "m.urdf")[0] == 2
    assert trivet("export", "azulay", "m.urdf", "--mode", "++ ++ ++", "--overwrite")[0] == 2
    assert trivet("export", "azulay", "m.sdf")[0] == 2
    assert trivet("export", "azulay", "m.urdf", "--overwrite")[0] == 0


@pytest.mark.parametrize("form", ["mjcf", "urdf"])
def test_a_joint_without_counterpart_is_refused(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """No joint is taken for another: here the export has never heard of hinges."""
    monkeypatch.setattr(f"trivet.interop.{form}.Revolute", type("NoJoint", (), {}))
    words = f"leg-1.hinge: a joint of type 'revolute' has no counterpart in the {form.upper()} export; leave the machine out"
    assert message_of(lambda: getattr(t, f"to_{form}")("azulay")) == words
