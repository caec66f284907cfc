"""The exact path against the general one, the mesh, the statics and its own laws."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from machines import VIBRATION_CASES, changed, part, random_stands, vibrating_machine, vibrating_stand
from numpy.typing import NDArray

from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose
from trivet.model import Machine, catalogue, document_of, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import PLATFORM, assemble
from trivet.statics.compliance import platform_stiffness
from trivet.statics.objective import AXES
from trivet.statics.structure import structural_stiffness
from trivet.study.frf import minimum_dynamic_stiffness
from trivet.study.pose import pose as pose_report
from trivet.vibration import spectral, spectral_machine
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.mesh import mesh
from trivet.vibration.response import direct_receptance, exact_receptance, receptance
from trivet.vibration.spectral_machine import standing

# Compiling takes longer than computing here.
QUICK = {"xla_backend_optimization_level": 0}
STILL, LOSS = 1e-6, 0.02
SPREAD = np.array([3.0, 70.0, 410.0, 1600.0, 4700.0])


def home_of(kernel: str) -> Any:
    """The module through which it is called."""
    return spectral_machine if kernel == "_between" else spectral


def compiled(options: dict[str, int] | None) -> dict[str, Any]:
    """The kernels by name, compiled with options; with None they may stand inside what is compiled as a whole."""
    kernels = {
        "sampled": "effort",
        "_between": ("power", "finish"),
        "at_nodes": "finish",
        "arguments": None,
    }
    plain = {name: getattr(home_of(name), name).__wrapped__ for name in kernels}
    return {name: jax.jit(plain[name], static_argnames=static, compiler_options=options) for name, static in kernels.items()}


@pytest.fixture(autouse=True, scope="module")
def _quickly() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name, kernel in compiled(QUICK).items():
            patch.setattr(home_of(name), name, kernel)
        yield


def general(machine: Machine, pose: Frame, signs: Any, frequency: Any, loss: float = LOSS) -> NDArray[Any]:
    """Receptance at the platform centre, from all nodes of the structure."""
    chosen = exact_mesh(assemble(machine, pose, signs), 2 * math.pi * float(np.max(frequency)))
    rows = chosen.rows(PLATFORM)
    return exact_receptance(ExactStructure(chosen), rows, rows, np.asarray(frequency), loss)


def meshed(machine: Machine, pose: Frame, signs: Any, frequency: Any, elements: int, loss: float = LOSS) -> NDArray[Any]:
    chosen = mesh(assemble(machine, pose, signs), elements)
    rows = chosen.rows(PLATFORM)
    return direct_receptance(chosen, rows, rows, np.asarray(frequency), loss)


def condensed(machine: Machine, pose: Frame, signs: Any) -> NDArray[Any]:
    """Static stiffness from the condensed path, (6, 6), without compiling it for one pose."""
    with jax.disable_jit():
        return np.array(platform_stiffness(machine.mechanism, pose, signs)[0].full(), dtype=float)


def apart(machine: Machine, found: Any, expected: Any, stiffness: bool = False) -> NDArray[Any]:
    """Greatest difference (...) of receptances (or stiffnesses), against the greatest entry, rotations made lengths."""
    length = float(machine.characteristic_length) ** (-1 if stiffness else 1)
    weight = np.outer(*[np.r_[np.ones(3), np.full(3, length)]] * 2)
    return np.abs((found - expected) * weight).max(axis=(-2, -1)) / np.abs(expected * weight).max(axis=(-2, -1))


# Every machine in a variant of its own; between them they have all that the statics can be asked for.
VARIANTS: dict[str, Any] = {
    "azulay": lambda m: m.with_spherical(300.0).with_theory("timoshenko"),
    "eclipse": lambda m: m.with_spherical("clamped").with_guide("rotation"),
    "alizade": lambda m: m.with_spherical("free").with_rigid_drives(),
    "glozman": lambda m: m.with_spherical(300.0).with_rigid_drives().with_theory("timoshenko"),
    "straight-column": lambda m: m.with_spherical("clamped").with_theory("timoshenko"),
}
KINDS = sorted({*catalogue()} - {"azulay-196", "azulay-236"})


def stands(machine: Machine, count: int, seed: int) -> list[tuple[Frame, Any]]:
    """Poses, each with a working mode: random ones, or the pose of our choice of a machine that is closed numerically."""
    if parse_mode(machine) is None:
        return [(zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3), None)]
    poses, signs = random_stands(machine, count, seed)
    return [(part(poses, k), signs[..., k]) for k in range(count)]


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_chain(name: str) -> None:
    machine = VARIANTS.get(name, lambda m: m)(load(name))
    frequency = np.r_[STILL, SPREAD]
    for pose, signs in stands(machine, 2, seed=11):
        # At rest it is the stiffness of the statics.
        still = np.asarray(spectral.dynamic_stiffness(machine, pose, signs, frequency, 0.0))[0]
        static = structural_stiffness(machine, pose, None) if signs is None else condensed(machine, pose, signs)
        assert apart(machine, still, static, stiffness=True) < (1e-9 if signs is None else 1e-10)
        # In motion it is the structure with exact beams between all nodes,
        stiffness = np.asarray(spectral.dynamic_stiffness(machine, pose, signs, frequency, LOSS))
        found = np.linalg.inv(stiffness)
        expected = general(machine, pose, signs, SPREAD)
        assert np.all(apart(machine, found[1:], expected) < 1e-8)
        assert np.all(apart(machine, expected.swapaxes(1, 2), expected) < 1e-8)
        # which a mesh comes near to.
        coarse, fine = (meshed(machine, pose, signs, SPREAD[:4], elements) for elements in (12, 24))
        errors = apart(machine, coarse, found[1:5]), apart(machine, fine, found[1:5])
        assert np.all(errors[1] < np.maximum(0.35 * errors[0], 2e-6))
        assert errors[1][:3].max() < 1e-3


@pytest.mark.parametrize("case", VIBRATION_CASES, ids=lambda case: case["name"])
def test_reference(case: dict[str, Any]) -> None:
    machine, pose, signs = vibrating_stand(case)
    frequency = np.array(case["freqs"])
    found = np.asarray(spectral.receptance(machine, pose, signs, frequency, LOSS))
    entries = {"xx": (0, 0), "zz": (2, 2), "x_ry": (0, 4), "rzrz": (5, 5)}
    for name, pairs in case["H_struct_exact"].items():
        np.testing.assert_allclose(found[:, *entries[name]], np.array(pairs) @ [1, 1j], rtol=1e-7)
    # With three chains alike at home no direction in the plane is different from another.
    sizes = np.abs(found).max(axis=0)
    for (i, j), (k, m), sign in (((0, 0), (1, 1), 1), ((3, 3), (4, 4), 1), ((0, 4), (1, 3), -1)):
        np.testing.assert_allclose(found[:, i, j], sign * found[:, k, m], rtol=1e-9)
    for i, j in ((0, 1), (0, 2), (0, 5), (2, 4), (3, 4), (3, 5)):
        assert np.abs(found[:, i, j]).max() < 1e-9 * np.sqrt(sizes[i, i] * sizes[j, j])
    check_least_dynamic_stiffness(case)


def check_least_dynamic_stiffness(case: dict[str, Any]) -> None:
    """Nowhere nearby, and nowhere on a grid, a response is greater; structural and modal damping lead to nearly the same."""
    machine, pose, signs = vibrating_stand(case)
    at = pose_report(machine, position=[float(c) for c in pose.origin], anyway=True)
    np.testing.assert_array_equal(at.signs, signs)
    found = minimum_dynamic_stiffness(at, 20.0, 3000.0, LOSS)
    assert [m.direction for m in found] == list(AXES)
    grid = np.asarray(spectral.receptance(machine, pose, signs, np.linspace(20.0, 3000.0, 300), LOSS))
    for k, minimum in enumerate(found):
        near = minimum.frequency * np.array([1 - 1e-4, 1, 1 + 1e-4])
        low, there, high = 1 / np.abs(general(machine, pose, signs, near)[:, k, k])
        np.testing.assert_allclose(minimum.stiffness, there, rtol=1e-8)
        if minimum.frequency < 2999:  # not at the end of the range
            assert low > there < high
        assert 1 / minimum.stiffness >= np.abs(grid[:, k, k]).max() * (1 - 1e-9)  # interpolated between other nodes
    for minimum, (stiffness, frequency) in zip(found, list(case["mesh"]["min_dyn_N_per_um"].values())[:2], strict=False):
        np.testing.assert_allclose(minimum.stiffness, stiffness * 1e6, rtol=2e-3)
        np.testing.assert_allclose(minimum.frequency, frequency, rtol=2e-4)


def test_between_the_nodes() -> None:
    """Thousands of frequencies, in any order, are interpolated; two dozen are not."""
    machine = load("glozman").with_spherical("free")
    pose, signs = stands(machine, 1, seed=3)[0]
    frequency = np.random.default_rng(5).permutation(np.r_[np.linspace(5.0, 20000.0, 700), np.geomspace(5.0, 100.0, 60)])
    some = np.argsort(frequency)[:: len(frequency) // 20]
    for loss, tolerance in ((0.02, 1e-9), (0.001, 1e-8)):
        answer = spectral.prepared(machine, pose, signs, 20000.0, loss)
        found, expected = np.asarray(answer(frequency))[some], np.asarray(answer(frequency[some]))
        assert np.all(apart(machine, found, expected) < tolerance)
    # Up to there waves run up and down the links several times: the states were renewed between pieces.
    assert np.all(apart(machine, expected, general(machine, pose, signs, frequency[some], loss)) < 1e-8)


def test_frequencies_that_are_alike() -> None:
    """However many of them: nothing lies between."""
    machine, pose, signs = load("azulay"), home_pose(load("azulay")), parse_mode(load("azulay"))
    once = np.asarray(spectral.receptance(machine, pose, signs, [100.0]))
    for frequency in (np.full(30, 100.0), 100.0 * (1 + 1e-15 * np.arange(30))):
        many = np.asarray(spectral.receptance(machine, pose, signs, frequency))
        np.testing.assert_allclose(many, np.broadcast_to(once, many.shape), rtol=1e-9, atol=1e-9 * np.abs(once).max())


def test_short_waves() -> None:
    """A telescope of many pieces."""
    machine = load("alizade").with_theory("timoshenko")
    pose, signs = stands(machine, 1, seed=4)[0]
    frequency = np.array([20000.0, 90000.0])
    assert spectral.plan(machine, batch(pose), standing(machine, pose, signs), 2 * math.pi * 9e4).effort.segments > 3
    found = np.asarray(spectral.receptance(machine, pose, signs, frequency))
    assert np.all(apart(machine, found, general(machine, pose, signs, frequency)) < 1e-8)


def batch(pose: Frame) -> Frame:
    return jax.tree.map(lambda c: np.atleast_1d(np.asarray(c, dtype=float)), pose)


def test_many_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch is its poses, however many are worked on at once; out of reach there is nothing.

    A slide without length is no exception, nor one that is run backwards.
    """
    machine = load("azulay").with_spherical("free")
    level = math.sqrt(0.216**2 - 0.144**2)
    positions = np.array([[0.0, 0.0, level], [0.0, 0.0, 0.5], [0.002, 0.001, level + 0.02], [0.0, 0.0, level - 0.02]])
    poses = zyz_frame(positions, np.zeros(4), np.array([0.0, 0.0, 0.3, 0.0]), np.zeros(4))
    signs, frequency = parse_mode(machine), np.r_[STILL, SPREAD]
    monkeypatch.setattr(spectral, "CHUNK", 2)
    still = np.asarray(spectral.dynamic_stiffness(machine, poses, signs, frequency, 0.0))[:, 0]
    together = np.asarray(spectral.receptance(machine, poses, signs, frequency))
    assert together.shape == (4, len(frequency), 6, 6)
    assert np.all(np.isnan(together[1]))
    for k in (0, 2, 3):
        alone = np.asarray(spectral.receptance(machine, part(poses, k), signs, frequency))
        assert np.all(apart(machine, together[k], alone) < 1e-12)
        assert apart(machine, still[k], condensed(machine, part(poses, k), signs), stiffness=True) < 1e-10
    for k in (2, 3):
        assert np.all(apart(machine, together[k, 1:], general(machine, part(poses, k), signs, SPREAD)) < 1e-8)


def test_short_slides_do_not_drown_the_rest() -> None:
    """On the general path and on a mesh too: where a slide stands almost on its carriage, the rest of the machine is heard."""
    machine = load("azulay").with_spherical("free")
    signs, frequency = parse_mode(machine), SPREAD[:3]
    for gap in (1e-3, 1e-5, 1e-8, 0.0):
        pose = zyz_frame((0.0, 0.0, math.sqrt(0.216**2 - (0.144 + gap) ** 2)), 0.0, 0.0, 0.0)
        expected = np.asarray(spectral.receptance(machine, pose, signs, frequency))
        assert np.all(apart(machine, general(machine, pose, signs, frequency), expected) < 1e-6)
        assert np.all(apart(machine, meshed(machine, pose, signs, frequency, 8), expected) < 1e-3)


LUMP = {"mass": "0.4 kg", "centre_of_mass": ["10 mm", "-5 mm", "8 mm"], "inertia": ["90 kg mm^2", "120 kg mm^2", "60 kg mm^2"]}
HEAVY = {
    "mass": "0.6 kg",
    "inertia": ["700 kg mm^2", "900 kg mm^2", "800 kg mm^2"],
    "products_of_inertia": ["50 kg mm^2", "-80 kg mm^2", "30 kg mm^2"],
    "centre_of_mass": ["4 mm", "-3 mm", "11 mm"],
}


def generous_case() -> Machine:
    """A case like those of frf.json, in which everything yields and weighs."""
    given: dict[str, Any] = {
        "k_act": 4e6, "k_act2": 5e6, "k_rev": 40.0, "k_sph": 25.0, "k_rev_par": 2e4, "k_sph_tr": 3e7, "m_C": 0.15,
        "az0": 0.3, "od1_mm": 24.0, "id1_mm": 20.0, "plat_com_z_mm": 6.0, "m_plat": 0.3,
    }  # fmt: skip
    case = VIBRATION_CASES[0]
    own = {"m_plat_kg": 0.3, "J_plat_kgm2": [2e-5, 3e-5, 4e-5]}
    return vibrating_machine(case | own | {"params": case["params"] | given})


def damped_elbow() -> Machine:
    """Glozman's machine with all kinds of damping: structural of joints and beams, viscous beside springs and without any."""
    steel = {"youngs_modulus": "205 GPa", "poisson_ratio": 0.29, "density": "7870 kg/m^3"}
    return changed(
        load("glozman").with_spherical("free"),
        {
            "guide": {"damping": "80 N s/m", "loss_factor": 0.05, "bearing": {"x": "90 N/um", "rz": "4e4 N m/rad"}} | LUMP,
            "shoulder": {"damping": "900 N m s/rad"} | LUMP,
            "hinge": {"damping": "0.3 N m s/rad", "bearing": {"rx": "5e3 N m/rad", "y": "40 N/um"}} | LUMP,
            "link-2": {"material": "damped"},
            "ball": {"mass": "0.05 kg", "loss_factor": 0.2, "bearing": {"z": "30 N/um"}},
        },
        platform=HEAVY,
        rotary_inertia=False,
        materials={"steel": steel, "damped": steel | {"youngs_modulus": "70 GPa", "loss_factor": 0.08}},
    )


def locked_stages() -> Machine:
    """The redundant prototype with other joints locked in each chain, dashpots, and a rigid bracket that weighs."""
    machine = changed(load("rmmt"), {"hinge": {"damping": "0.2 N m s/rad"}, "radial": {"damping": "5000 N s/m"} | LUMP})
    return machine.with_locks({"leg-1.guide": 0.1, "leg-2.tangential": 0.002, "leg-3.radial": 0.0395})


def closed_numerically() -> Machine:
    """Struts that no closed form solves, on crosses that weigh, with damped drives."""
    strut = {"damping": "4000 N s/m", "loss_factor": 0.1} | LUMP
    ball = {"rotation": "elastic", "stiffness": "50 N m/rad", "mass": "0.1 kg"}
    return changed(load("gough-stewart"), {"cross": LUMP, "strut": strut, "ball": ball})


def balls_below() -> Machine:
    """A ball at the foot, and what it weighs."""
    return changed(load("tahmasebi"), {"ball": LUMP, "slide-y": LUMP})


@pytest.mark.parametrize("made", [generous_case, damped_elbow, locked_stages, closed_numerically, balls_below])
def test_all_that_yields_weighs_and_damps(made: Any) -> None:
    machine = made()
    ((pose, signs),) = stands(machine, 1, seed=8)
    many = np.linspace(3.0, 4700.0, 60)
    answer = spectral.prepared(machine, pose, signs, 4700.0)
    expected = general(machine, pose, signs, many[::12])
    assert np.all(apart(machine, np.asarray(answer(many[::12])), expected) < 1e-8)
    assert np.all(apart(machine, np.asarray(answer(many))[::12], expected) < 1e-8)
    assert np.all(apart(machine, meshed(machine, pose, signs, many[:24:12], 24), expected[:2]) < 1e-3)


def test_a_mass_beyond_a_slack_slide_moves_with_the_platform() -> None:
    """The last joint may be a slide: its mass feels the slide's own motion, with or without any inertia."""
    slide = {"type": "prismatic", "axis": [1, 0, 1], "mass": "0.2 kg"}
    last = load("tahmasebi").chains["leg"].elements[-1].name
    keys = dict.fromkeys(("axis", "travel", "actuated", "measure"))
    machine = changed(load("tahmasebi"), {last: keys | slide})
    pose = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3)
    found = np.asarray(spectral.receptance(machine, pose, None, SPREAD))
    assert np.all(apart(machine, found, general(machine, pose, None, SPREAD)) < 1e-8)


def test_panels_of_a_plan_may_be_divided_beforehand(monkeypatch: pytest.MonkeyPatch) -> None:
    """As they must be where JAX traces the machine and nobody looks at a denominator."""
    machine = balls_below()
    ((pose, signs),) = stands(machine, 1, seed=8)
    poses, stand, omega = batch(pose), standing(machine, pose, signs), 2 * math.pi * np.linspace(3.0, 4700.0, 60)
    chosen = spectral.plan(machine, poses, stand, float(omega[-1]))
    finish = spectral.Matrices(inverted=True, alone=True)
    better = spectral.divided(machine, poses, stand, omega, LOSS, chosen, finish)
    assert len(better.edges) > len(chosen.edges)
    expected = general(machine, pose, signs, omega[::12] / (2 * math.pi))
    monkeypatch.setattr(spectral, "LEAST", 0.0)

    def worst(plan: spectral.Plan) -> float:
        found = spectral.kernel(machine, poses, stand, omega, LOSS, plan, finish)
        return float(apart(machine, np.asarray(found)[::12], expected).max())

    assert worst(better) < 1e-8
    assert worst(chosen) > 1e-5


def test_a_lump_on_a_free_ball_turns_with_the_platform() -> None:
    """What stands beyond the last joint is a part of the platform: the platform weighs what both weigh."""
    machine = load("azulay").with_spherical("free")
    pose, signs = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3), parse_mode(machine)
    carried = changed(machine, {"ball": LUMP}, platform={"mass": "0.3 kg"})
    # In {E} the frames beyond the balls are turned by 0, 120 and 240 degrees.
    mass, centre, inertia = 0.3, np.zeros(3), np.zeros((3, 3))
    for k in range(3):
        c, s = math.cos(2 * math.pi * k / 3), math.sin(2 * math.pi * k / 3)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        at = turn @ ([28e-3, -5e-3, 8e-3])
        inertia += turn @ np.diag([90e-6, 120e-6, 60e-6]) @ turn.T + 0.4 * (at @ at * np.eye(3) - np.outer(at, at))
        centre += 0.4 * at
        mass += 0.4
    centre /= mass
    inertia -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    whole = changed(
        machine,
        {},
        platform={
            "mass": f"{mass!r} kg",
            "centre_of_mass": [f"{float(c)!r} m" for c in centre],
            "inertia": [f"{float(inertia[i, i])!r} kg m^2" for i in range(3)],
            "products_of_inertia": [f"{float(inertia[i, j])!r} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
        },
    )
    expected = general(whole, pose, signs, SPREAD)
    assert np.all(apart(machine, general(carried, pose, signs, SPREAD), expected) < 1e-8)
    assert np.all(apart(machine, np.asarray(spectral.receptance(carried, pose, signs, SPREAD)), expected) < 1e-8)


def test_loss_factors_of_parts() -> None:
    """All parts with a loss factor of their own are a machine with that of the analysis."""
    machine = load("azulay").with_spherical(300.0)
    pose, signs = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3), parse_mode(machine)
    steel = {"youngs_modulus": "205 GPa", "poisson_ratio": 0.29, "density": "7870 kg/m^3"}
    joints = {name: {"loss_factor": 0.07} for name in ("guide", "slide", "ball")}
    all_own = changed(machine, joints, materials={"steel": steel | {"loss_factor": 0.07}})
    expected = general(machine, pose, signs, SPREAD, 0.07)
    assert apart(machine, meshed(all_own, pose, signs, SPREAD[:3], 24, 0.5), expected[:3]).max() < 1e-4
    assert apart(machine, general(all_own, pose, signs, SPREAD, 0.5), expected).max() < 1e-9
    # One part alone takes its share.
    beams = changed(machine, {}, materials={"steel": steel | {"loss_factor": 0.07}})
    drives = changed(machine, joints)
    first = expected - general(machine, pose, signs, SPREAD, 0.0)
    parts = [general(m, pose, signs, SPREAD[:1], 0.0) - general(machine, pose, signs, SPREAD[:1], 0.0) for m in (beams, drives)]
    assert apart(machine, parts[0] + parts[1], first[:1]).max() < 0.02
    assert min(np.abs(p).max() for p in parts) > 0.05 * np.abs(first[0]).max()


@pytest.mark.parametrize(
    ("keys", "rate"),
    [
        ({"guide": {"damping": "300 N s/m"}}, 3e6),
        ({"guide": {"damping": "300 N s/m", "yields": "rotation"}}, 3e6),
        ({"slide": {"damping": "250 N s/m"}}, 3e6),
        ({"hinge": {"damping": "2 N m s/rad", "stiffness": "900 N m/rad"}}, 900.0),
    ],
    ids=["along", "around", "slide", "hinge"],
)
def test_at_one_frequency_a_dashpot_is_a_loss_factor(keys: dict[str, Any], rate: float) -> None:
    """k + i omega c = k (1 + i eta) with eta = omega c / k."""
    machine = load("azulay").with_spherical("free")
    pose, signs = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3), parse_mode(machine)
    frequency = np.array([230.0])
    ((joint, own),) = keys.items()
    damping = float(own["damping"].split()[0])
    eta = 2 * math.pi * float(frequency[0]) * damping / rate
    viscous = changed(machine, {joint: own | {"loss_factor": 0.0}})
    lossy = changed(machine, {joint: own | {"loss_factor": eta, "damping": None}})
    expected = general(lossy, pose, signs, frequency)
    assert apart(machine, general(viscous, pose, signs, frequency), expected).max() < 1e-9
    assert apart(machine, meshed(viscous, pose, signs, frequency, 8), meshed(lossy, pose, signs, frequency, 8)).max() < 1e-9
    none = changed(machine, {joint: own | {"loss_factor": 0.0, "damping": None}})
    assert apart(machine, general(none, pose, signs, frequency), expected).max() > 1e-4


def test_a_dashpot_in_a_slack_hinge() -> None:
    """It resists as a spring with a rate of i omega c does: a stiff one holds the hinge, a weak one is not felt."""
    machine = load("azulay").with_spherical("free")
    pose, signs = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3), parse_mode(machine)

    def with_hinge(**keys: Any) -> NDArray[Any]:
        return general(changed(machine, {"hinge": keys}), pose, signs, np.array([150.0]))

    free, held = with_hinge(), with_hinge(stiffness="1e9 N m/rad")
    assert apart(machine, with_hinge(damping="1e-9 N m s/rad"), free).max() < 1e-6
    assert apart(machine, with_hinge(damping="1e7 N m s/rad"), held).max() < 1e-4
    assert apart(machine, free, held).max() > 1e-2
    # A slight spring with the loss of the dashpot is the dashpot.
    turning = 2 * math.pi * 150.0 * 0.4
    found = with_hinge(damping="0.4 N m s/rad")
    assert apart(machine, with_hinge(stiffness="1e-7 N m/rad", loss_factor=turning / 1e-7), found).max() < 1e-8


@pytest.mark.parametrize(
    ("joint", "key", "origin", "axis"),
    [
        # A lone chain at azimuth zero: carriage on the circle, hinge 25 mm further out, ball at (0, 0, h) + 18 mm along x.
        ("guide", "x", (0.162, 0.0, 0.0), (1, 0, 0, 0, 0, 0)),
        ("guide", "rx", (0.162, 0.0, 0.0), (0, 0, 0, 1, 0, 0)),
        ("slide", "z", (0.162, 0.0, 0.0), (0, 0, 1, 0, 0, 0)),
        ("slide", "ry", (0.162, 0.0, 0.0), (0, 0, 0, 0, 1, 0)),
        ("hinge", "y", (0.187, 0.0, 0.0), (0, 1, 0, 0, 0, 0)),
        ("hinge", "rz", (0.187, 0.0, 0.0), (0, 0, 0, 0, 0, 1)),
    ],
)
def test_bearings_add_their_compliance(joint: str, key: str, origin: Any, axis: Any) -> None:
    """C' = C + s s^T / k at the platform, with s the twist of the platform as the bearing yields."""
    reach = 0.169
    machine = changed(load("azulay"), {"hinge": {"actuated": True, "travel": None}})
    chains = document_of(machine)["chains"]
    chains["leg"]["copies"] = 1
    lone = changed(machine, {}, chains=chains)
    pose, signs = zyz_frame((0.0, 0.0, math.sqrt(0.216**2 - reach**2)), 0.0, 0.0, 0.0), parse_mode(lone)
    unit, rate = ("N m/rad", 7e3) if key.startswith("r") else ("N/m", 2e6)
    yielding = changed(lone, {joint: {"bearing": {key: f"{rate} {unit}"}}})
    arm = np.array([0.0, 0.0, float(pose.origin.z)]) - origin
    screw = np.r_[np.array(axis[:3]) + np.cross(axis[3:], arm), axis[3:]]
    expected = np.outer(screw, screw) / rate
    for path in (structural_stiffness, condensed):
        soft, hard = (np.linalg.inv(path(m, pose, signs)) for m in (yielding, lone))
        np.testing.assert_allclose(soft - hard, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("backward", [True, False], ids=["azulay-backward", "glozman-forward"])
def test_derivatives_with_respect_to_every_dimension(backward: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load("azulay").with_theory("timoshenko") if backward else damped_elbow()
    signs = parse_mode(machine)
    pose = zyz_frame(np.add(machine.home.position, (0.003, 0.001, 0.002)), 0.4, 0.15, -0.3)
    stand, poses, omega = standing(machine, pose, signs), batch(pose), np.array([2 * math.pi * 180.0])
    chosen = spectral.plan(machine, poses, stand, 1.2 * omega[0])
    dimensions, rest = eqx.partition(machine, lambda leaf: isinstance(leaf, float))
    values, build = ravel_pytree(dimensions)
    for name, kernel in compiled(None).items():
        monkeypatch.setattr(home_of(name), name, kernel)

    def size(values: Any) -> Any:
        own = eqx.combine(build(values), rest)
        return jnp.abs(
            spectral.kernel(own, poses, stand, omega, LOSS, chosen, spectral.Matrices(inverted=True, alone=False))[0, 0, 2, 2]
        )

    unit = np.eye(len(values))
    if backward:
        both = jax.jit(jax.value_and_grad(size), compiler_options=QUICK)
        slope = np.asarray(both(values)[1])
    else:
        along = jax.jit(lambda values, step: jax.jvp(size, (values,), (step,)), compiler_options=QUICK)
        slope = np.array([float(along(values, step)[1]) for step in unit])

    def value(values: Any) -> float:
        return float(both(values)[0] if backward else along(values, unit[0])[0])

    steps = 1e-5 * np.maximum(np.abs(values), 1e-3)
    found = np.array([value(values + s) - value(values - s) for s in np.diag(steps)]) / (2 * steps)
    assert np.all(np.isfinite(slope))
    scale = np.abs(found * steps).max()
    np.testing.assert_allclose(slope * steps, found * steps, rtol=1e-5, atol=1e-7 * scale)
    assert np.sum(slope != 0) > 10


def test_a_link_that_spins_has_inertia_all_the_same() -> None:
    """Between two balls: no result for the statics, none of its business for vibration."""
    ball = {"type": "spherical"} | dict.fromkeys(("axis", "measure", "travel", "actuated"))
    machine = changed(load("azulay").with_spherical("free"), {"hinge": ball})
    pose = home_pose(machine)
    found = np.asarray(spectral.receptance(machine, pose, None, SPREAD))
    assert np.all(apart(machine, found, general(machine, pose, None, SPREAD)) < 1e-8)


def test_from_place_to_place_through_the_platform() -> None:
    """The fast path between platform and tool is the general one."""
    machine = changed(load("azulay"), {}, platform={"mass": "0.2 kg", "tool_tip": ["10 mm", "5 mm", "40 mm"]})
    pose, signs = home_pose(machine), parse_mode(machine)
    fast = receptance(machine, pose, signs, SPREAD, response="tool", excitation="platform")
    slow = receptance(machine, pose, signs, SPREAD, response="tool", excitation="platform", method="direct", elements=32)
    assert apart(machine, slow[:4], fast[:4]).max() < 1e-4
