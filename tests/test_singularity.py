"""Singularities: built exactly or found as roots, what they mean, transmission indices, maps and their curves."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from test_jacobian import coordinates, exponential, machine_of, part, stands, turned

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.kinematics.singularity import SINGULAR, conditions, singularity
from trivet.kinematics.transmission import Transmission, transmissions
from trivet.model import document_of, load, parse
from trivet.show.figure import figure
from trivet.show.scene import scene
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.surface import Surface, hemisphere
from trivet.space.vector import Vec
from trivet.study.singularity import SHIFTS, singularity_report
from trivet.study.singularity_map import QUANTITIES, SingularityMap, singularity_map
from trivet.study.zero_set import zero_set
from trivet.views.singularity import tables


def one(pose: Frame) -> Frame:
    """A pose as a batch of one."""
    return Frame(*(Vec(*(np.array([float(c)]) for c in v)) for v in pose))


# Type 1


def test_a_carriage_whose_platform_joint_is_on_the_axis() -> None:
    machine = load("azulay")
    found = singularity(machine, zyz_frame((-0.018 + 1e-8, 0, 0.12), 0, 0, 0))
    assert found.type == 1
    assert [drive.name for drive in found.faults] == ["leg-1.guide"]
    assert found.faults[0].lever == pytest.approx(1e-8, rel=1e-6)
    assert found.faults[0].unit == "m"
    assert "leg-1.guide" in found.meaning[0]
    assert "1e-05 mm" in found.meaning[0]
    assert math.isnan(found.distance.length), "the carriage flips to the other side: no derivative"


def test_a_slide_across_its_link() -> None:
    """The link of leg 1 upright: the slide moves its foot along a tangent of the circle about P."""
    machine = load("azulay")
    tilt = math.radians(10)
    high = 0.216 * (1 - 1e-14)
    found = singularity(machine, zyz_frame((0.004, 0.001, high - 0.018 * math.sin(tilt)), math.pi, tilt, math.pi))
    assert found.type == 1
    assert [drive.name for drive in found.faults] == ["leg-1.slide"]
    assert found.faults[0].lever < SINGULAR
    assert "stands across its slide" in found.meaning[0]


def test_two_links_in_line() -> None:
    """Leg 1 of Glozman's machine stretched from its shoulder to P."""
    machine = load("glozman")
    reach, high = 0.26 * (1 - 1e-14), 0.17
    radius = 0.162 - math.sqrt(reach * reach - high * high)
    found = singularity(machine, zyz_frame((radius - 0.018, 0, high), 0, 0, 0), "-+ ++ ++")
    assert found.type == 1
    assert [drive.name for drive in found.faults] == ["leg-1.shoulder"]
    assert "the links are in line" in found.meaning[0]


def test_levers_are_what_a_designer_measures() -> None:
    machine = load("azulay")
    found = singularity(machine, zyz_frame((0.002, 0.001, 0.12), 0.1, 0.2, 0.3))
    rows, _ = coordinates(machine, one(found.frame), np.ones((1, 3, 2)))
    place = np.array(found.frame.origin) + 0.018 * np.array(found.frame.x)
    assert next(d.lever for d in found.drives if d.name == "leg-1.guide") == pytest.approx(math.hypot(*place[:2]), rel=1e-12)
    elevation = math.asin(place[2] / 0.216)
    assert next(d.lever for d in found.drives if d.name == "leg-1.slide") == pytest.approx(math.cos(elevation), rel=1e-12)
    assert rows[0, 0] == pytest.approx(math.atan2(place[1], place[0]), rel=1e-12)
    assert found.type == 0
    assert found.meaning == []


# Type 2

TYPE_2 = ("azulay", "eclipse", "alizade", "glozman", "behi", "ben-horin", "straight-elbow", "tahmasebi", "gough-stewart",
          "rmmt, one of each")  # fmt: skip


@cache
def type_2(name: str) -> tuple[Frame, np.ndarray]:
    """A pose with det J_x = 0 to rounding, on the way between two poses in one working mode, and its signs."""
    machine = machine_of(name)
    rng = np.random.default_rng(5)
    for signs, _ in stands(name):
        count, home = 80, np.array(machine.home.position)
        first = np.hstack([home + rng.uniform(-0.01, 0.01, (count, 3)), rng.uniform(-1.2, 1.2, (count, 3))])
        last = np.hstack([home + rng.uniform(-0.01, 0.01, (count, 3)), rng.uniform(-1.2, 1.2, (count, 3))])

        def at(share: np.ndarray, first: np.ndarray = first, last: np.ndarray = last) -> Frame:
            x = first + share[:, None] * (last - first)
            return zyz_frame(x[:, :3], *x[:, 3:].T)

        low, high = np.zeros(count), np.ones(count)
        start, end = (conditions(machine, at(share), signs).determinants.j_x for share in (low, high))
        for _ in range(60):
            middle = (low + high) / 2
            value = conditions(machine, at(middle), signs).determinants.j_x
            low, high = np.where(value * start > 0, middle, low), np.where(value * start > 0, high, middle)
        length = float(machine.characteristic_length)
        good = (start * end < 0) & (np.abs(value) < 1e-13 * length**3)
        good &= np.min(np.abs(conditions(machine, at(low), signs).determinants.j_q)[None], axis=0) > 0
        if good.any():
            return part(at(low), int(np.flatnonzero(good)[0])), signs
    raise AssertionError(f"{name}: no Type 2 singularity on the way")


@pytest.mark.parametrize("name", TYPE_2)
def test_at_type_2_the_platform_moves_while_the_drives_rest(name: str) -> None:
    machine = machine_of(name)
    pose, signs = type_2(name)
    found = singularity(machine, pose, mode_text(machine, signs) or None)
    assert found.type == 2
    assert found.sigma_min < 1e-9
    assert "with all drives held the platform" in found.meaning[-1]
    twist = np.r_[found.motion.linear, found.motion.angular]
    rows = conditions(machine, one(pose), signs).rows
    length = float(machine.characteristic_length)
    assert np.max(np.abs(rows.j_x[0] @ twist)) < 1e-9 * length
    # The same by finite displacements: the coordinates of the drives change with the square of the displacement.
    screw = (
        np.cross(found.motion.angular, np.array(pose.origin) - found.motion.point) + found.motion.pitch * found.motion.angular
    )
    assert np.allclose(screw, found.motion.linear, rtol=0, atol=1e-12)
    moved = []
    for angle in (1e-3, 1e-4):
        displaced = [turned(exponential(s * angle * found.motion.angular), one(pose), s * angle * twist[:3]) for s in (1, -1)]
        q = [coordinates(machine, p, signs[None])[0][0] for p in (displaced[0], one(pose), displaced[1])]
        moved.append(np.max(np.abs(np.arctan2(np.sin(q[0] - q[1]), np.cos(q[0] - q[1])))))
    assert moved[0] / moved[1] == pytest.approx(100, rel=0.1)


@pytest.mark.parametrize("name", ["azulay", "glozman", "tahmasebi", "gough-stewart"])
def test_output_transmission_vanishes_at_type_2_only(name: str) -> None:
    machine = machine_of(name)
    pose, signs = type_2(name)
    found = transmissions(machine, one(pose), signs)
    assert np.min(found.output) < 1e-9
    assert np.min(found.input) > 1e-3
    for signs, poses in stands(name)[::9]:
        indices = transmissions(machine, poses, signs)
        for part_of in indices:
            assert np.all(part_of > 0)
            assert np.all(part_of < 1 + 1e-12)
        assert np.all(np.asarray(indices.local) == np.minimum(indices.input.min(axis=1), indices.output.min(axis=1)))


def test_input_transmission_is_the_cosine_of_the_pressure_angle() -> None:
    """Of the paper's slide cos(phi), of its carriage and of a telescope 1, of a driven shoulder the sine between the links."""
    found: Transmission = transmissions(load("azulay"), one(zyz_frame((0, 0, 0.12), 0, 0, 0)), np.ones((3, 2)))
    assert np.allclose(found.input[0], [1, 1, 1, *[math.cos(math.asin(0.12 / 0.216))] * 3], rtol=1e-12)
    found = transmissions(load("alizade"), one(zyz_frame((0, 0, 0.16), 0.1, 0.2, 0.3)), np.ones((3, 2)))
    assert np.allclose(found.input, 1, rtol=1e-12)
    machine = load("glozman")
    pose = one(zyz_frame((0, 0, 0.17), 0, 0, 0))
    found = transmissions(machine, pose, np.ones((3, 2)))
    half = math.hypot(0.162 - 0.018, 0.17) / 2  # two links of 130 mm
    assert np.allclose(found.input[0, 3:], math.sin(2 * math.asin(half / 0.13)), rtol=1e-9)


@pytest.mark.parametrize("name", ["azulay", "behi", "gough-stewart"])
def test_distance_leads_to_the_singularity(name: str) -> None:
    """Going there and measuring again leaves less than a hundredth of the determinant when it was near."""
    machine = machine_of(name)
    pose, signs = type_2(name)
    mode = mode_text(machine, signs) or None
    axis = np.linalg.svd(np.array(pose.z)[None])[2][1]
    near = turned(exponential(1e-4 * axis), one(pose), np.full(3, 1e-4 * machine.characteristic_length))
    found = singularity(machine, part(near, 0), mode)
    assert found.type == 0
    assert found.distance.length == pytest.approx(np.linalg.norm(found.distance.shift))
    assert found.distance.angle == pytest.approx(np.linalg.norm(found.distance.tilt))
    assert abs(found.distance.tilt @ np.array(found.frame.z)) < 1e-12
    for rotation, shift in ((np.eye(3), found.distance.shift), (exponential(found.distance.tilt), np.zeros(3))):
        there = conditions(machine, turned(rotation, near, shift), signs).determinants.j_x[0]
        assert abs(there) < 1e-2 * abs(found.determinants.j_x)


def test_machines_and_poses_of_which_nothing_can_be_told() -> None:
    document = document_of(load("rmmt"))
    for element in document["chains"]["leg"]["elements"]:
        element.pop("locked", None)
    with pytest.raises(InputError, match="lock 1 of its drives"):
        singularity(parse(document), zyz_frame((0, 0, 0.125), 0, 0, 0))
    with pytest.raises(NoResultError, match="does not reach the pose"):
        singularity(load("azulay"), zyz_frame((0, 0, 0.3), 0, 0, 0))


def test_chains_that_are_closed_numerically() -> None:
    """A passive slide out of the plane of its leg: no working mode; the rows are still unit forces at right angles."""
    document = document_of(load("ben-horin"))
    slide, hinge = document["chains"]["leg"]["elements"][1:3]
    slide |= {"axis": [0.36, 0.48, 0.8], "actuated": False}
    for key in ("travel", "stiffness"):
        slide.pop(key)
    hinge |= {"actuated": True, "travel": ["-80 deg", "80 deg"]}
    machine = parse(document)
    assert parse_mode(machine) is None
    pose = zyz_frame((0.002, 0.001, 0.12), 0.1, 0.2, 0.3)
    forces = conditions(machine, one(pose), None).rows.j_x[0, :, :3].reshape(3, 2, 3)
    assert np.allclose(forces @ np.swapaxes(forces, 1, 2), np.eye(2), rtol=0, atol=1e-12)
    found = singularity(machine, pose)
    assert found.mode == ""
    assert found.distance.length > 1e3, "the forces keep their directions wherever the centre goes"
    assert 0 < found.distance.angle < 2


# Maps


@cache
def ring(roll: str | float, height: float = 0.121) -> SingularityMap:
    machine = load("azulay", {"slide.travel": ["-60 mm", "120 mm"]} if height > 0.13 else {})
    return singularity_map(machine, hemisphere(height, 0.004), roll=roll)


@pytest.mark.parametrize(
    ("height", "roll", "low", "high"),
    [
        (0.080, "-alpha", 1.40, 1.60), (0.121, "best K_xx", 2.1, 2.41), (0.121, "-alpha", 2.1, 2.41), (0.121, 0.0, 2.1, 2.2),
        (0.121, 0.5, 2.1, 2.41), (0.121, 1.0, 2.1, 2.41), (0.140, "-alpha", 2.4, 2.81),
    ],
)  # fmt: skip
def test_the_ring_of_figure_4(height: float, roll: str | float, low: float, high: float) -> None:
    """One closed curve about the pole, across which the determinant changes its sign, whatever the roll does."""
    found = ring(roll, height)
    assert found.used.all()
    assert found.jumps == 0
    (curve,) = found.curves
    assert curve.is_closed
    assert np.array_equal(curve.surface.position[0], curve.surface.position[-1])
    points = 1e3 * curve.surface.position
    radius = np.hypot(points[:, 0], points[:, 1])
    assert low < radius.min()
    assert radius.max() < high
    assert np.allclose(np.hypot(radius, points[:, 2] - 1e3 * height), 4, rtol=0, atol=1e-9), "on the hemisphere"
    assert np.abs(np.diff(np.unwrap(np.arctan2(points[:, 1], points[:, 0]))).sum()) == pytest.approx(2 * math.pi)
    det = found.fields["det J_x"]
    from_pole = 1e3 * np.hypot(*found.surface.position[:, :2].T)
    assert len(set(np.sign(det[from_pole < radius.min() - 1e-9]))) == 1
    assert np.all(det[from_pole < radius.min() - 1e-9] * det[0] < 0)
    on_curve = zyz_frame(curve.surface.position, curve.surface.azimuth, curve.surface.tilt, curve.roll)
    exact = 1e-11 if not str(roll).startswith("best") else 1e-6  # a best roll is known to the root of the rounding error
    assert np.max(np.abs(conditions(found.machine, on_curve, parse_mode(found.machine)).determinants.j_x)) < exact * 0.018**3


def test_the_ring_without_spin_is_made_of_those_with_fixed_rolls() -> None:
    """On circular guides the machine knows only roll and tilt: where -alpha passes a fixed roll both rings agree."""
    curve, fixed = ring("-alpha").curves[0], ring(0.0).curves[0]
    radius = np.hypot(*curve.surface.position[:, :2].T)
    assert radius.min() == pytest.approx(np.hypot(*fixed.surface.position[0, :2]), rel=1e-3)


def test_another_working_mode_passes() -> None:
    """With links that reach over the axis the hemisphere has poses of one sign only, or another curve: not this ring."""
    found = singularity_map(
        load("azulay", {"slide.travel": ["-400 mm", "400 mm"]}), hemisphere(0.121, 0.004, 5), roll=0.0, mode="-+ ++ ++"
    )
    assert all(not (c.is_closed and np.ptp(np.hypot(*c.surface.position[:, :2].T)) < 3e-4) for c in found.curves)


def test_fields_and_units() -> None:
    assert np.array_equal(ring("-alpha").roll, -ring("-alpha").surface.azimuth)
    found = ring(0.5)
    assert np.array_equal(found.roll, np.full(len(found.surface), 0.5))
    assert set(found.fields) == set(QUANTITIES)
    det = found.condition.determinants
    assert np.allclose(found.fields["1/det J_G^-1"], det.j_q / det.j_x, rtol=1e-12, atol=0)
    off = found.surface.tilt > 0
    ratio = found.fields["1/det J^-1"][off] / found.fields["1/det J_G^-1"][off]
    assert np.allclose(ratio, -1 / np.sin(found.surface.tilt[off]), rtol=1e-9)
    assert [found.unit(q) for q in ("sigma_min", "det J_x", "1/det J^-1", "LTI")] == ["", "m^3", "", ""]
    assert np.array_equal(found.values, found.fields["sigma_min"])
    cut = singularity_map(load("azulay"), hemisphere(0.140, 0.004, 5), roll=1.0)
    assert 0 < cut.used.sum() < len(cut.surface)
    assert all(np.array_equal(np.isnan(values), ~cut.used) for name, values in cut.fields.items() if "det J^-1" not in name)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"quantity": "sigma_max"}, "'sigma_max' is not known"),
        ({"roll": "beta"}, 'roll "beta" is not known'),
        ({"roll": math.inf}, "finite angle"),
        ({"roll": "best K_xy"}, "objective 'K_xy' is not known"),
    ],
)
def test_wrong_questions(call: dict, message: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match=message):
        singularity_map("azulay", hemisphere(0.121, 0.004, 2), **call)


def test_zero_sets_lie_on_the_surface() -> None:
    """Circles on a sphere, from a lattice as coarse as five steps; open lines where the surface ends; jumps are told apart."""
    surface = hemisphere(0.1, 0.004, 5)
    circle = zero_set(surface, surface.position[:, 2] - 0.1023, lambda s: s.position[:, 2] - 0.1023)
    ((points, closed),) = circle.curves
    assert closed
    assert np.allclose(points.position[:, 2], 0.1023, rtol=0, atol=1e-14)
    assert np.allclose(np.hypot(*points.position[:, :2].T), math.sqrt(0.004**2 - 0.0023**2), rtol=0, atol=1e-14)
    line = zero_set(surface, surface.position[:, 0] - 1e-4, lambda s: s.position[:, 0] - 1e-4)
    ((points, closed),) = line.curves
    assert not closed
    assert np.ptp(points.position[:, 1]) > 0.007
    step = zero_set(surface, np.sign(surface.position[:, 0] - 1e-4), lambda s: np.sign(s.position[:, 0] - 1e-4))
    assert step.curves == []
    assert step.jumps > 5
    flat = Surface("row", np.c_[np.arange(4), np.zeros((4, 2))], np.zeros(4), np.zeros(4))
    with pytest.raises(InputError, match="lie on a line"):
        zero_set(flat, np.arange(4.0), lambda s: s.position[:, 0])


@pytest.mark.parametrize("suffix", [".png", ".html"])
def test_figures(tmp_path: Path, suffix: str) -> None:
    """Of a map, and of a pose on its curve."""
    found = ring("-alpha")
    on_curve = found.curves[0]
    points = on_curve.surface
    pose = zyz_frame(points.position[5], points.azimuth[5], points.tilt[5], on_curve.roll[5])
    for name, result in (("map", found), ("pose", singularity_report(found.machine, pose))):
        path = tmp_path / f"{name}{suffix}"
        figure(result, path)
        assert path.stat().st_size > 10_000


def test_the_arrow_lies_on_the_axis() -> None:
    machine = machine_of("azulay")
    pose, signs = type_2("azulay")
    motion = singularity(machine, pose, mode_text(machine, signs)).motion
    arrow = [s for s in scene(machine, pose, mode_text(machine, signs), motion).shapes if s.role == "motion"]
    assert len(arrow) == 3, "a bar and the two heads of a turn"
    for shape in arrow:
        for end in (shape.start, shape.end):
            assert np.linalg.norm(np.cross(end - motion.point, motion.direction)) < 1e-12
    assert not any(s.role == "motion" for s in scene(machine).shapes)


def test_the_tilt_margin_leads_to_a_singularity() -> None:
    """Tilted by the margin the determinant vanishes; a little less and it has kept its sign in every direction."""
    report = singularity_report("azulay")
    margin = report.tilt_margin
    size = abs(report.singularity.determinants.j_x)
    at = np.array([[margin.azimuth]])
    assert abs(report._tilted(at, np.array([[margin.angle]]))[0, 0]) < 1e-9 * size
    every = np.linspace(0, 2 * np.pi, 25)[:-1, None]
    less = report._tilted(every, np.array([margin.angle - math.radians(1)])) * report.singularity.determinants.j_x
    assert np.all(less > 0)


@pytest.mark.parametrize("name", ["azulay", "alizade"])
def test_the_shift_margin_is_the_radius_of_the_platform_joints(name: str) -> None:
    """Of these machines, level and in the middle: as far as the centre is from the axis, the three planes of the chains have a
    line in common when it is as far as the joints are from the centre.  No slope tells of it."""
    report = singularity_report(name)
    margin, size = report.shift_margin, report.singularity.determinants.j_x
    assert margin.length == pytest.approx(0.018, abs=1e-9)
    along = np.array([margin.direction])
    assert abs(report._shifted(along, np.array([[margin.length]]))[0, 0]) < 1e-9 * abs(size)
    assert np.all(report._shifted(SHIFTS, np.array(0.99 * margin.length)) * size > 0)
    assert report.singularity.distance.length > 2 * margin.length


@pytest.mark.parametrize("name", ["azulay", "eclipse", "gough-stewart"])
def test_the_shift_margin_of_a_leaning_platform_is_told_in_the_base_frame(name: str) -> None:
    """Moved by it in {O} the machine is singular: so says the singular value, which the search does not look at."""
    machine, angles = load(name), (0.5, 0.3, -0.2)
    centre = np.array(machine.home.position, dtype=float)
    margin = singularity_report(machine, zyz_frame(centre, *angles)).shift_margin
    there = centre + margin.length * np.array(margin.direction)
    assert singularity(machine, zyz_frame(there, *angles)).sigma_min < 1e-6
    assert singularity(machine, zyz_frame(centre, *angles)).sigma_min > 0.01


@pytest.mark.parametrize("at", [(0, 0, 0.125), (-0.018 + 1e-8, 0, 0.12)], ids=["no slope along it", "no slope"])
def test_no_slope_is_no_proof(at: tuple[float, float, float]) -> None:
    """On an axis of symmetry, and where a carriage flips, first order tells neither how near one is nor that there is none."""
    report = singularity_report("azulay", zyz_frame(at, 0, 0, 0))
    (told,) = (table for table in tables(report) if getattr(table, "title", "") == "how near")
    said = dict(zip(*(list(column.cells) for column in told.columns), strict=True))
    flips = report.singularity.type == 1
    words = "no estimate: " + ("det J_x has no slope here" if flips else "the slope of det J_x is about zero")
    assert said["tilting about the centre, to a Type 2 singularity to first order"] == words
    assert flips or report.tilt_margin.angle < math.radians(33), "there is one all the same"
