"""Machines as MuJoCo models: what MuJoCo makes of an exported file, by its own kinematics, against ours."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from machines import bracketed, changed, part

import trivet
from trivet.interop.mjcf import to_mjcf, write_mjcf
from trivet.kinematics.inverse import inverse
from trivet.kinematics.jacobian import actuator_names, inverse_jacobian
from trivet.kinematics.mode import mode_text
from trivet.kinematics.report import joint_elements, joint_names
from trivet.kinematics.standing import stand
from trivet.model import Machine, document_of, load, parse
from trivet.model.elements import Drivable, Prismatic, Revolute, Spherical, Universal
from trivet.space.frame import Angle, Frame
from trivet.space.pose import zyz_frame
from trivet.statics.load import load_case

mujoco_peer = pytest.mark.peer("mujoco")

POSES = 3
MIXED = {"leg-1.guide": 0.1, "leg-2.tangential": 0.002, "leg-3.radial": 0.0395}
MACHINES = (*trivet.catalogue(), "rmmt with mixed locks", "azulay with lumps")
FALLING = 0.05
"""Time (s) for which machines fall."""


@cache
def machine_of(name: str) -> Machine:
    if name == "rmmt with mixed locks":
        return load("rmmt").with_locks(MIXED)
    return lumped() if name == "azulay with lumps" else load(name)


def lumped() -> Machine:
    """A bracket on the carriage, a platform off balance, a mass on every joint, a slide of rectangular section."""
    document = document_of(bracketed())
    document["sections"]["bar"] = {"shape": "rectangle", "width": "10 mm", "height": "20 mm"}
    document["platform"]["inertia"] = ["300 kg mm^2", "400 kg mm^2", "500 kg mm^2"]
    for element in document["chains"]["leg"]["elements"]:
        if element["type"] not in ("beam", "offset"):
            element["mass"] = "0.1 kg"
        if element["name"] == "slide":
            element["beam"]["section"] = "bar"
    return parse(document)


class Stand(NamedTuple):
    pose: Frame
    signs: np.ndarray
    mode: str


@cache
def stands(name: str) -> tuple[Stand, ...]:
    """Reachable poses, tilted up to 40 degrees, in random working modes."""
    machine, most = machine_of(name), 400
    rng = np.random.default_rng(sum(map(ord, name)))
    reach = 0.3 * float(machine.characteristic_length)
    position = np.array(machine.home.position) + rng.uniform(-reach, reach, (most, 3))
    azimuth, tilt, roll = (
        rng.uniform(-np.pi, np.pi, most),
        rng.uniform(0, np.radians(40), most),
        rng.uniform(-np.pi, np.pi, most),
    )
    pose = zyz_frame(position, azimuth, tilt, roll)
    signs = rng.choice([-1.0, 1.0], (len(machine.legs), 2, most))
    clear = [np.asarray(inverse(leg, pose, s).reach) for leg, s in zip(machine.legs, signs, strict=True)]
    keep = np.flatnonzero(np.all(np.stack(clear) > 1e-5, axis=0))[:POSES]
    assert len(keep) == POSES, "too few of the random poses are reachable"
    return tuple(Stand(part(pose, k), signs[..., k], mode_text(machine, signs[..., k])) for k in keep)


class Model:
    """An exported machine in MuJoCo, at the pose of its keyframe."""

    def __init__(self, text: str) -> None:
        import mujoco

        self.engine = mujoco
        self.m = mujoco.MjModel.from_xml_string(text)
        self.m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.d = mujoco.MjData(self.m)
        mujoco.mj_resetDataKeyframe(self.m, self.d, 0)
        mujoco.mj_forward(self.m, self.d)

    def loops(self) -> tuple[np.ndarray, np.ndarray]:
        """Gaps of all loops (m, rad) and their Jacobian (n, nv)."""
        rows = self.d.efc_type == self.engine.mjtConstraint.mjCNSTR_EQUALITY
        return self.d.efc_pos[rows], self.d.efc_J.reshape(-1, self.m.nv)[rows]

    def motions(self) -> np.ndarray:
        """Velocities (nv, freedoms) which the loops allow."""
        _, values, rows = np.linalg.svd(self.loops()[1])
        return rows[np.sum(values > 1e-9 * values[0]) :].T

    def rows_of(self, names: list[str]) -> np.ndarray:
        """What picks the velocities of joints out of qvel (n, nv)."""
        return np.eye(self.m.nv)[[self.m.joint(name).dofadr[0] for name in names]]

    def behind(self, goal: dict[str, float]) -> np.ndarray:
        """How far joints are from a goal (m, rad)."""
        found = []
        for name, value in goal.items():
            joint = self.m.joint(name)
            apart = self.d.qpos[joint.qposadr[0]] - value
            is_hinge = joint.type[0] == self.engine.mjtJoint.mjJNT_HINGE
            found.append(math.remainder(apart, 2 * math.pi) if is_hinge else apart)
        return np.array(found)

    def twist(self) -> np.ndarray:
        """Twist of the platform centre, linear part first, in {O}, per qvel (6, nv)."""
        linear, angular = np.zeros((3, self.m.nv)), np.zeros((3, self.m.nv))
        self.engine.mj_jacBody(self.m, self.d, linear, angular, self.m.body("platform").id)
        return np.concatenate([linear, angular])

    def drive(self, goal: dict[str, float]) -> None:
        """Move joints to a goal, and everything else so that the loops stay closed (Newton)."""
        for _ in range(12):
            gap, slopes = self.loops()
            rest = np.concatenate([gap, self.behind(goal)])
            step = np.linalg.lstsq(np.concatenate([slopes, self.rows_of(list(goal))]), -rest, rcond=None)[0]
            self.engine.mj_integratePos(self.m, self.d.qpos, step, 1.0)
            self.engine.mj_forward(self.m, self.d)
        assert np.abs(rest).max() < 1e-12

    def assert_coordinates(self, ours: dict[str, float], tolerance: float) -> None:
        np.testing.assert_allclose(self.behind(ours), 0, rtol=0, atol=tolerance, err_msg=", ".join(ours))

    def assert_platform_at(self, pose: Frame, tolerance: float) -> None:
        body = self.d.body("platform")
        np.testing.assert_allclose(body.xpos, np.array(pose.origin, dtype=float), rtol=0, atol=tolerance)
        np.testing.assert_allclose(body.xmat.reshape(3, 3), np.array(pose.matrix(), dtype=float), rtol=0, atol=tolerance)


def coordinates_of(machine: Machine, pose: Frame, signs: np.ndarray) -> dict[str, float]:
    """Our coordinates of the joints that move, by their names in the file; balls apart."""
    found = {}
    for leg, _, steps in stand(machine, pose, signs):
        for element, _, coordinate in steps:
            name = f"{leg.name}.{element.name}"
            if isinstance(element, Prismatic) and element.locked is None:
                found[name] = float(coordinate)
            elif isinstance(element, Drivable) and element.locked is None:
                found[name] = math.atan2(coordinate.sin, coordinate.cos)
            elif isinstance(element, Universal):
                found |= {f"{name}.{k}": math.atan2(angle.sin, angle.cos) for k, angle in enumerate(coordinate, 1)}
    return found


def moving(machine: Machine) -> dict[str, Drivable]:
    """The joints of one freedom that are not locked."""
    pairs = zip(joint_names(machine), joint_elements(machine), strict=True)
    return {name: element for name, element in pairs if element.locked is None}


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_file_stands_at_home(name: str, tmp_path: Path) -> None:
    machine, file = machine_of(name), tmp_path / "machine.xml"
    write_mjcf(machine, file)
    model, home = Model(file.read_text(encoding="utf-8")), trivet.pose(machine, anyway=True)
    assert model.m.key(0).name == "home"
    np.testing.assert_allclose(model.m.key_qpos[0], model.m.qpos0, rtol=0, atol=1e-15)
    balls = [isinstance(leg.chain.elements[-1], Spherical) for leg in machine.legs]
    gaps, _ = model.loops()
    assert gaps.size == sum(3 if ball else 6 for ball in balls)
    assert np.abs(gaps).max() < 1e-9
    model.assert_platform_at(home.frame, 1e-12)
    assert model.m.body_mass.sum() == pytest.approx(sum(home.masses.values()), rel=1e-9)
    assert [model.m.actuator(k).name for k in range(model.m.nu)] == actuator_names(machine)
    assert model.d.ncon == 0


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_joints(name: str) -> None:
    machine = machine_of(name)
    for pose, signs, mode in stands(name):
        model = Model(to_mjcf(machine, pose, mode))
        assert np.abs(model.loops()[0]).max() < 1e-12
        model.assert_coordinates(coordinates_of(machine, pose, signs), 1e-12)
        theirs = {model.m.joint(k).name for k in range(model.m.njnt)}
        assert theirs & set(joint_names(machine)) == set(moving(machine))
        for joint, element in moving(machine).items():
            entry = model.m.joint(joint)
            by_elevation = isinstance(element, Revolute) and element.measure == "elevation"
            limited = element.travel is not None and not by_elevation
            assert bool(model.m.jnt_limited[entry.id]) == limited
            if limited:
                np.testing.assert_allclose(entry.range, element.travel, rtol=1e-15)


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_inverse_jacobian(name: str) -> None:
    machine = machine_of(name)
    for pose, signs, mode in stands(name):
        model = Model(to_mjcf(machine, pose, mode))
        free = model.motions()
        assert free.shape[1] == 6
        theirs = model.rows_of(actuator_names(machine)) @ free @ np.linalg.inv(model.twist() @ free)
        ours = np.asarray(inverse_jacobian(machine, pose, signs))
        # Row by row: rad/s and m/s differ in size.
        np.testing.assert_array_less(np.linalg.norm(theirs - ours, axis=1), 1e-10 * np.linalg.norm(ours, axis=1))


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_drives_lead_to_the_pose(name: str) -> None:
    machine = machine_of(name)
    names = actuator_names(machine)
    step = 0.02 * float(machine.characteristic_length)
    for pose, signs, mode in stands(name):
        goal = pose.shift((step, -step, step)).turn((0.0, 0.6, 0.8), Angle(math.cos(0.02), math.sin(0.02)))
        ours = coordinates_of(machine, goal, signs)
        model = Model(to_mjcf(machine, pose, mode))
        model.drive({joint: ours[joint] for joint in names})
        model.assert_platform_at(goal, 1e-8)
        model.assert_coordinates(ours, 1e-8)


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_drives_carry_the_weight(name: str) -> None:
    """Where the masses are, by what they put on the drives; our statics do not know MuJoCo's bodies."""
    # Random poses are outside travels; a rod must be long enough for what is out.
    wide = {"travel": ["-0.7 m", "0.7 m"]}
    machine = changed(machine_of(name), dict.fromkeys(("slide", "column", "telescope", "strut"), wide))
    machine = machine.with_spherical("free").with_guide("rotation")
    pose, signs, mode = stands(name)[0]
    model = Model(to_mjcf(machine, pose, mode))
    free, names = model.motions(), actuator_names(machine)
    # At rest MuJoCo's bias is the weight with the other sign; virtual power on the motions that the loops allow.
    theirs = np.linalg.solve((model.rows_of(names) @ free).T, free.T @ -model.d.qfrc_bias)
    drives = load_case(machine, pose, signs, gravity=tuple(model.m.opt.gravity)).drives
    ours = np.array([drives[n].load for n in names])
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-10 * np.abs(ours).max())


@mujoco_peer
def test_moments_of_inertia() -> None:
    """Handbook formulas of tube, plate, two points and bar; the tube is thin along itself."""
    model = Model(to_mjcf(load("azulay")))
    outer, inner, length = 0.0095, 0.007, 0.216
    link, plate = model.m.body("leg-1.hinge"), model.m.body("platform")
    about, across = (outer**2 + inner**2) / 2, (3 * (outer**2 + inner**2) + length**2) / 12
    np.testing.assert_allclose(np.sort(link.inertia / link.mass), [about, across, across], rtol=1e-9)
    about, across = 0.018**2 / 2, (3 * 0.018**2 + 0.010**2) / 12
    np.testing.assert_allclose(np.sort(plate.inertia / plate.mass), [across, across, about], rtol=1e-9)
    thin = model.d.body("leg-1.hinge").ximat.reshape(3, 3)[:, np.argmin(link.inertia)]
    run = model.d.site("leg-1.ball").xpos - model.d.body("leg-1.hinge").xpos
    assert abs(thin @ run) == pytest.approx(length, rel=1e-12)
    # 0.1 kg of the carriage and half of the bracket's 0.2 kg at one end, the other half at the other.
    model = Model(to_mjcf(lumped()))
    carriage, bracket = model.m.body("leg-1.guide"), np.array([0.005, 0, 0.003])
    np.testing.assert_allclose(carriage.ipos, bracket / 3, rtol=1e-9, atol=1e-15)
    across = 0.2 * 0.1 / 0.3 * (bracket @ bracket)
    np.testing.assert_allclose(np.sort(carriage.inertia), [0, across, across], rtol=1e-6, atol=1e-12)
    # A bar along x, 10 mm wide along y and 20 mm high along z.
    slide, axes = model.m.body("leg-1.slide"), model.d.body("leg-1.slide").ximat.reshape(3, 3)
    about = np.diag(axes @ np.diag(slide.inertia) @ axes.T)
    bar = 7870 * 0.010 * 0.020 * 0.065  # its whole travel
    np.testing.assert_allclose(about[1] - about[2], bar * (0.020**2 - 0.010**2) / 12, rtol=1e-6)


@mujoco_peer
def test_welded_platform_weighs_as_much() -> None:
    """A platform on three hinges, which the export divides among itself and the bodies beyond the hinges."""
    document = document_of(load("tahmasebi"))
    moments, centre = [3e-4, 4e-4, 5e-4], (0.003, -0.002, 0.02)
    document["platform"] = {"mass": "0.6 kg", "inertia": [f"{i} kg m^2" for i in moments]}
    document["platform"]["centre_of_mass"] = [f"{c} m" for c in centre]
    pose, _, mode = stands("tahmasebi")[0]
    model = Model(to_mjcf(parse(document), pose, mode))
    mass, total = 0.0, np.zeros((3, 3))
    for name in ("platform", "leg-1.hinge", "leg-2.hinge", "leg-3.hinge"):
        own, body = model.m.body(name), model.d.body(name)
        axes = body.ximat.reshape(3, 3)
        np.testing.assert_allclose(body.xipos, np.array(pose.shift(centre).origin, dtype=float), rtol=0, atol=1e-12)
        mass, total = mass + own.mass[0], total + axes @ np.diag(own.inertia) @ axes.T
    turn = np.array(pose.matrix(), dtype=float)
    assert mass == pytest.approx(0.6, rel=1e-12)
    np.testing.assert_allclose(turn.T @ total @ turn, np.diag(moments), rtol=0, atol=1e-14)


@mujoco_peer
def test_chains_without_closed_form() -> None:
    """A hexapod upside down: balls on the ground, universal joints on the platform, closed numerically and welded."""
    document = document_of(load("gough-stewart"))
    for chain in document["chains"].values():
        chain["elements"].reverse()
    machine, pose = parse(document), zyz_frame((0.01, 0.02, 0.34), 0.3, 0.2, -0.25)
    model = Model(to_mjcf(machine, pose))
    assert np.abs(model.loops()[0]).max() < 1e-12
    model.assert_platform_at(pose, 1e-12)
    free, names = model.motions(), actuator_names(machine)
    assert free.shape[1] == 6
    theirs = model.rows_of(names) @ free @ np.linalg.inv(model.twist() @ free)
    np.testing.assert_allclose(theirs, np.asarray(inverse_jacobian(machine, pose, None)), rtol=0, atol=1e-10)


@mujoco_peer
@pytest.mark.parametrize("name", MACHINES)
def test_loops_hold_in_simulation(name: str) -> None:
    model = Model(to_mjcf(machine_of(name)))
    model.d.ctrl[:] = 0  # what would hold it
    height, worst = model.d.body("platform").xpos[2], 0.0
    for _ in range(round(FALLING / model.m.opt.timestep)):
        model.engine.mj_step(model.m, model.d)
        worst = max(worst, np.abs(model.loops()[0]).max())
    assert model.d.body("platform").xpos[2] < height - 1e-3
    assert worst < 1e-6


@mujoco_peer
def test_angle_counts_in_the_turn_of_its_travel() -> None:
    document = document_of(load("straight-elbow"))
    shoulder = next(e for e in document["chains"]["leg"]["elements"] if e["name"] == "shoulder")
    shoulder["travel"] = ["360 deg", "450 deg"]
    model = Model(to_mjcf(parse(document)))
    low, high = model.m.joint("leg-1.shoulder").range
    assert low < model.m.joint("leg-1.shoulder").qpos0[0] < high


def test_errors(tmp_path: Path) -> None:
    file = tmp_path / "machine.xml"
    write_mjcf(load("azulay"), file)
    with pytest.raises(trivet.InputError, match="exists already"):
        write_mjcf(load("azulay"), file)
    write_mjcf(load("azulay"), file, mode="++ ++ +-", overwrite=True)
    with pytest.raises(trivet.InputError, match="mode"):
        to_mjcf(load("azulay"), mode="+ + +")
    with pytest.raises(trivet.NoResultError, match="does not reach"):
        to_mjcf(load("azulay"), zyz_frame((0, 0, 1.0), 0, 0, 0))
