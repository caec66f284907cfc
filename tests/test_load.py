"""Load cases: closed forms of the cantilever, self-weight, superposition, reactions, drive loads, masses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from machines import PAPER, bracketed, changed

from trivet.errors import InputError
from trivet.kinematics.jacobian import actuator_names, inverse_jacobian
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import stand as stand_all
from trivet.model import Machine, document_of, load, parse
from trivet.space.frame import IDENTITY, Frame
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import PLATFORM, Structure, assemble, assemble_standing
from trivet.statics.load import load_case, masses, weight
from trivet.statics.structure import carry, solve

LENGTH, WIDTH, HEIGHT = 0.4, 0.02, 0.03
YOUNG, NU, DENSITY = 205e9, 0.29, 7870.0
THEORIES = ("euler-bernoulli", "timoshenko")


def cantilever(theory: str, parts: int = 1) -> Structure:
    """A level beam of a rectangular section along x, held on the left; the platform is its right end."""
    section = {"shape": "rectangle", "width": f"{WIDTH} m", "height": f"{HEIGHT} m"}
    material = {"youngs_modulus": f"{YOUNG} Pa", "poisson_ratio": NU, "density": f"{DENSITY} kg/m^3"}
    beam = {"type": "beam", "axis": "x", "length": f"{LENGTH / parts} m", "section": "bar", "material": "steel"}
    machine = parse({
        "format": 1,
        "about": {"name": "cantilever"},
        "theory": theory,
        "platform": {},
        "home": {"position": [f"{LENGTH} m", "0 m", "0 m"]},
        "sections": {"bar": section},
        "materials": {"steel": material},
        "chains": {
            "arm": {
                "base": {"azimuth": "0 deg"},
                "platform_joint": {"radius": "0 mm"},
                "elements": [
                    {"name": "root", "type": "prismatic", "axis": "x", "actuated": True},
                    *({"name": f"beam-{i}", **beam} for i in range(parts)),
                    {"name": "end", "type": "spherical", "rotation": "clamped"},
                ],
            }
        },
    })  # fmt: skip
    pose = IDENTITY._replace(origin=IDENTITY.origin._replace(x=LENGTH))
    return assemble_standing(machine, pose, [(0.0, *(None for _ in range(parts)), None)])


def tip(structure: Structure, loads: np.ndarray) -> np.ndarray:
    return solve(structure, loads[..., None]).displacements[PLATFORM, :, 0]


def shear_flexibility(theory: str) -> float:
    """1 / (G A_s), Cowper's shear coefficient; zero for Euler-Bernoulli."""
    kappa = 10 * (1 + NU) / (12 + 11 * NU)
    return 0.0 if theory == "euler-bernoulli" else 2 * (1 + NU) / (YOUNG * kappa * WIDTH * HEIGHT)


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("theory", THEORIES)
def test_cantilever_under_an_end_load(theory: str, parts: int) -> None:
    """F L^3 / 3 E I + F L / G A_s across, and the slopes with their signs."""
    structure = cantilever(theory, parts)
    stiff_y, stiff_z = YOUNG * HEIGHT * WIDTH**3 / 12, YOUNG * WIDTH * HEIGHT**3 / 12  # loads along y, along z
    loads = np.zeros((len(structure.nodes), 6))
    loads[PLATFORM, :3] = 5.0, 7.0, -11.0
    shear = shear_flexibility(theory)
    expected = [
        5 * LENGTH / (YOUNG * WIDTH * HEIGHT),
        7 * (LENGTH**3 / (3 * stiff_y) + LENGTH * shear),
        -11 * (LENGTH**3 / (3 * stiff_z) + LENGTH * shear),
        0.0,
        11 * LENGTH**2 / (2 * stiff_z),
        7 * LENGTH**2 / (2 * stiff_y),
    ]
    np.testing.assert_allclose(tip(structure, loads), expected, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("theory", THEORIES)
def test_cantilever_under_its_own_weight(theory: str, parts: int) -> None:
    """q L^4 / 8 E I + q L^2 / 2 G A_s, slope q L^3 / 6 E I; exact with one element."""
    structure = cantilever(theory, parts)
    q = DENSITY * WIDTH * HEIGHT * 9.81
    stiff = YOUNG * WIDTH * HEIGHT**3 / 12
    moved = tip(structure, weight(structure, np.array([0.0, 0.0, -9.81])))
    drop = q * LENGTH**4 / (8 * stiff) + q * LENGTH**2 / 2 * shear_flexibility(theory)
    np.testing.assert_allclose(moved, [0, 0, -drop, 0, q * LENGTH**3 / (6 * stiff), 0], rtol=1e-9, atol=1e-18)
    stretched = tip(structure, weight(structure, np.array([9.81, 0.0, 0.0])))
    assert stretched[0] == pytest.approx(q * LENGTH**2 / (2 * YOUNG * WIDTH * HEIGHT), rel=1e-9)


def stand(name: str, rotation: Any = "free", settings: Any = None) -> tuple[Machine, Frame, Any]:
    """A machine with some lumped masses, at a pose that has no symmetry."""
    lumps = {"chains.leg.elements.guide.mass": "0.3 kg", "chains.leg.elements.ball.mass": "0.05 kg"}
    machine = load(name, lumps | (settings or {})).with_spherical(rotation)
    pose = zyz_frame(np.add(machine.home.position, (0.002, 0.003, -0.001)), 0.3, 0.35, 0.2)
    return machine, pose, parse_mode(machine)


FORCE, MOMENT, GRAVITY = (30.0, -20.0, 50.0), (0.4, 0.3, -0.2), (0.5, -1.0, -9.7)


@pytest.mark.parametrize("name", PAPER)
def test_loads_superpose(name: str) -> None:
    at = stand(name)
    both = load_case(*at, FORCE, MOMENT, GRAVITY)
    parts = [load_case(*at, force=FORCE), load_case(*at, moment=MOMENT), load_case(*at, gravity=GRAVITY)]
    np.testing.assert_allclose(both.tool_tip, sum(p.tool_tip for p in parts), rtol=1e-8)
    for drive, carried in both.drives.items():
        assert carried.load == pytest.approx(sum(p.drives[drive].load for p in parts), rel=1e-8)


@pytest.mark.parametrize("rotation", ["free", "clamped", 300.0])
@pytest.mark.parametrize("name", PAPER)
def test_reactions_balance_the_load(name: str, rotation: Any) -> None:
    machine, pose, signs = stand(name, rotation)
    result = load_case(machine, pose, signs, FORCE, MOMENT, GRAVITY)
    mass = sum(masses(machine, pose, signs).values())
    np.testing.assert_allclose(result.applied[:3], FORCE + mass * np.array(GRAVITY), rtol=1e-12)
    assert list(result.reactions) == ["leg-1", "leg-2", "leg-3"]
    np.testing.assert_allclose(sum(result.reactions.values()), result.applied, rtol=0, atol=1e-8)


def test_the_load_acts_at_the_tool_tip() -> None:
    machine, pose, signs = stand("azulay")
    tool = [0.01, -0.02, 0.07]
    tipped = load("azulay", {"platform.tool_tip": [f"{c} m" for c in tool]}).with_spherical("free")
    arm = np.array([float(c) for c in pose.direction(tuple(tool))])
    at_tip = load_case(tipped, pose, signs, FORCE, MOMENT)
    at_centre = load_case(machine, pose, signs, FORCE, np.add(MOMENT, np.cross(arm, FORCE)))
    np.testing.assert_allclose(at_tip.platform_centre, at_centre.platform_centre, rtol=1e-9)
    moved, turned = at_centre.platform_centre[:3], at_centre.platform_centre[3:]
    np.testing.assert_allclose(at_tip.tool_tip, [*(moved + np.cross(turned, arm)), *turned], rtol=1e-9)
    np.testing.assert_allclose(at_tip.applied[3:], MOMENT + np.cross([float(c) for c in pose.origin] + arm, FORCE), rtol=1e-12)


@pytest.mark.parametrize("name", PAPER)
def test_drives_carry_what_the_jacobian_says(name: str) -> None:
    """Balls free and carriages on their circle, the machine is statically determinate: F = J_G^T tau (paper Eq 32)."""
    machine, pose, signs = stand(name, settings={"guide.yields": "rotation"})
    result = load_case(machine, pose, signs, FORCE, MOMENT)
    tau = np.array([result.drives[drive].load for drive in actuator_names(machine)])
    jacobian = np.asarray(inverse_jacobian(machine, pose, signs))
    np.testing.assert_allclose(jacobian.T @ tau, [*FORCE, *MOMENT], rtol=1e-8)
    assert result.drives["leg-1.guide"].unit == "N m"
    assert result.drives[actuator_names(machine)[3]].unit == ("N m" if name == "glozman" else "N")


@pytest.mark.parametrize("name", PAPER)
def test_drives_carry_what_their_springs_do(name: str) -> None:
    machine, pose, signs = stand(name, "clamped")
    structure = assemble(machine, pose, signs)
    loads = np.zeros((len(structure.nodes), 6, 1))
    loads[PLATFORM, :, 0] = *FORCE, *MOMENT
    eta = iter(solve(structure, loads).deflections[:, 0])
    drives = load_case(machine, pose, signs, FORCE, MOMENT).drives
    for tie in structure.connections:
        yielded = [next(eta) for _ in tie.rates]
        if tie.drive is not None:
            assert drives[tie.name].load == pytest.approx(tie.rates[0] * yielded[0], rel=1e-9)
    assert drives["leg-1.guide"].unit == "N"  # it yields straight, though it travels on a circle


def test_a_stiff_drive_carries_the_same_load_as_a_soft_one() -> None:
    """Rigid drives have no spring to read the load from; it is that of the tie."""
    machine, pose, signs = stand("azulay")
    document = load("azulay", {"slide.stiffness": "1 N/um"}).with_spherical("free")
    for drive, carried in load_case(machine, pose, signs, FORCE).drives.items():
        assert load_case(document, pose, signs, FORCE).drives[drive].load == pytest.approx(carried.load, rel=1e-8)


def test_masses() -> None:
    machine, pose, signs = stand("azulay")
    found = masses(machine, pose, signs)
    area = np.pi / 4 * (0.019**2 - 0.014**2)
    assert found["leg-1.link"] == pytest.approx(7870 * area * 0.216, rel=1e-12)
    assert found["leg-2.guide"] == 0.3
    assert found["leg-3.hinge"] == 0
    assert found["platform"] == pytest.approx(np.pi * 0.018**2 * 0.010 * 7870, rel=1e-12)
    assert found["leg-1.slide"] == pytest.approx(7870 * area * 0.065, rel=1e-12)  # the whole rod, out or in
    # Without a travel nobody knows more than what is out.
    theta = np.arctan2(*(float(c) for c in pose.shift((0.018, 0, 0)).origin[1::-1]))
    end = np.array([float(c) for c in pose.shift((0.018, 0, 0)).origin])
    slide = end @ [np.cos(theta), np.sin(theta), 0] + np.sqrt(0.216**2 - end[2] ** 2) - 0.162
    found = masses(changed(machine, {"slide": {"travel": None}}), pose, signs)
    assert found["leg-1.slide"] == pytest.approx(7870 * area * slide, rel=1e-9)


@pytest.mark.parametrize("travel", [(0.0, 0.2), (-0.05, 0.2), (-0.3, -0.1)])
def test_a_rod_weighs_as_a_whole(travel: tuple[float, float]) -> None:
    """Its moment about {O} is that of one uniform rod, wherever the slide stands in its travel."""
    machine, pose, signs = stand("azulay")
    low, high = travel
    machine = changed(machine, {"slide": {"travel": [f"{low} m", f"{high} m"]}})
    rod = 7870 * np.pi / 4 * (0.019**2 - 0.014**2)
    for out in np.linspace(low, high, 4):
        chains = [(one.posture.coordinates[0], out, *one.posture.coordinates[2:]) for one in stand_all(machine, pose, signs)]
        structure = assemble_standing(machine, pose, chains)
        pull = weight(structure, np.array([0.0, 0.0, -1.0]))
        links = tuple(beam for beam in structure.beams if beam.name.endswith("link"))
        own = pull - weight(replace(structure, sheathed=(), beams=links), np.array([0.0, 0.0, -1.0]))
        total = sum(carry(at).T @ f for at, f in zip(structure.nodes, own, strict=True))
        spans = [(out - max(high, 0.0), out - min(low, 0.0))] * 3
        expected = np.zeros(6)
        for (start, end), (guide, *_) in zip(spans, chains, strict=True):
            middle = (0.162 + (start + end) / 2) * np.array([float(guide.cos), float(guide.sin), 0.0])
            force = np.array([0.0, 0.0, -rod * (end - start)])
            expected += np.concatenate([force, np.cross(middle, force)])
        np.testing.assert_allclose(total, expected, rtol=0, atol=1e-12)


def test_lumps_pull_where_they_are() -> None:
    """Without beams' weight: balls at the platform joints, brackets half at either end, the platform at its centre of mass."""
    machine = bracketed()
    document = document_of(machine)
    document["chains"]["leg"]["elements"][-1]["mass"] = "0.05 kg"
    for material in document["materials"].values():
        material["density"] = "1e-9 kg/m^3"
    machine = parse(document)
    _, pose, signs = stand("azulay")
    expected = np.zeros(3)
    centre = np.array([float(c) for c in pose.shift((0.003, -0.002, 0.020)).origin])
    expected += 0.5 * np.cross(centre, GRAVITY)
    for azimuth in np.radians([0, 120, 240]):
        ball = np.array([float(c) for c in pose.shift((0.018 * np.cos(azimuth), 0.018 * np.sin(azimuth), 0.0)).origin])
        out = ball * [1, 1, 0] / np.hypot(*ball[:2])
        expected += 0.05 * np.cross(ball, GRAVITY)
        for end in (0.162 * out, 0.167 * out + [0, 0, 0.003]):
            expected += 0.1 * np.cross(end, GRAVITY)
    result = load_case(machine, pose, signs, gravity=GRAVITY)
    np.testing.assert_allclose(result.applied, [*(1.25 * np.array(GRAVITY)), *expected], rtol=1e-8, atol=1e-9)
    assert masses(machine, pose, signs)["leg-2.bracket"] == pytest.approx(0.2)


@pytest.mark.parametrize("force", [(1.0, 2.0), (1.0, 2.0, np.nan), (1.0, 2.0, np.inf)])
def test_loads_are_three_finite_numbers(force: Any) -> None:
    with pytest.raises(InputError, match="force: expected three finite numbers"):
        load_case(*stand("azulay"), force=force)
