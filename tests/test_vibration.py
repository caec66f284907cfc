"""Modes and frequency responses: reference cases, laws of modal analysis, places, peaks, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from machines import VIBRATION_CASES, changed, vibrating_elements, vibrating_stand
from numpy.typing import NDArray

from trivet.errors import InputError, NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose
from trivet.model import Machine, load
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.statics.assembly import PLATFORM, assemble
from trivet.statics.load import masses
from trivet.statics.objective import AXES
from trivet.statics.structure import carry, structural_stiffness
from trivet.study.frf import directions, frf, natural_frequencies
from trivet.study.modes import modes as modes_report
from trivet.study.pose import pose as pose_report
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.mesh import mesh
from trivet.vibration.modes import ELEMENTS, Modes, eigenmodes, exact_frequencies, modes
from trivet.vibration.places import place_of
from trivet.vibration.resonance import greatest, grid
from trivet.vibration.response import (
    direct_receptance,
    exact_receptance,
    modal_receptance,
    per,
    receptance,
)

CASES = pytest.mark.parametrize("case", VIBRATION_CASES, ids=lambda case: case["name"])
ENTRIES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "x_ry": (0, 4), "rzrz": (5, 5)}
ZETA = 0.01


def every_mode(case: dict[str, Any], factor: int = 1, count: int | None = None) -> Modes:
    """All modes (or the lowest) of a case of frf.json on its mesh, or a finer one."""
    machine, pose, signs = vibrating_stand(case)
    structure = assemble(machine, pose, signs)
    fine = mesh(structure, {beam: factor * number for beam, number in vibrating_elements(case).items()})
    return Modes(structure, fine, *eigenmodes(fine, fine.mass.shape[0] if count is None else count))


def at_platform(found: Modes, frequency: Any, corrected: bool = True) -> NDArray[Any]:
    """Receptance with modal damping."""
    rows = found.mesh.rows(PLATFORM)
    return modal_receptance(found, rows, rows, np.asarray(frequency), 2 * ZETA, "modal", corrected)


def agree(found: NDArray[Any], case: dict[str, Any], key: str, tolerance: float) -> None:
    for name, pairs in case[key].items():
        expected = np.array(pairs) @ [1, 1j]
        np.testing.assert_allclose(found[:, *ENTRIES[name]], expected, rtol=tolerance, err_msg=name)


@CASES
def test_reference_on_its_mesh(case: dict[str, Any]) -> None:
    found = every_mode(case)
    np.testing.assert_allclose(found.mesh_frequency[:10], case["mesh"]["f10"], rtol=1e-6)
    agree(at_platform(found, case["freqs"]), case, "H_modal_mesh", 1e-4)
    peaks = greatest(lambda f: np.abs(at_platform(found, f)[:, range(3), range(3)]), 1.0, 20000.0, 2 * ZETA)
    for peak, (stiffness, frequency) in zip(peaks, case["mesh"]["min_dyn_N_per_um"].values(), strict=True):
        np.testing.assert_allclose(1e-6 / peak.size, stiffness, rtol=1e-6)
        np.testing.assert_allclose(peak.frequency, frequency, rtol=1e-6)


@CASES
def test_reference_without_a_mesh(case: dict[str, Any]) -> None:
    machine, pose, signs = vibrating_stand(case)
    structure, frequency = assemble(machine, pose, signs), np.array(case["freqs"])
    near, _ = eigenmodes(mesh(structure, ELEMENTS), 10)
    np.testing.assert_allclose(exact_frequencies(structure, near), case["exact_f10"], rtol=1e-8)
    chosen = exact_mesh(structure, 2 * math.pi * float(frequency.max()))
    rows = chosen.rows(PLATFORM)
    agree(exact_receptance(ExactStructure(chosen), rows, rows, frequency, 2 * ZETA), case, "H_struct_exact", 1e-7)
    static = np.linalg.inv(structural_stiffness(machine, pose, signs))
    np.testing.assert_allclose(np.diag(static), case["static_C_diag_m_per_N"], rtol=1e-8)
    np.testing.assert_allclose(static[0, 4], case["static_C_x_ry"], rtol=1e-8)


@CASES
def test_reference_on_finer_meshes(case: dict[str, Any]) -> None:
    """Richardson's extrapolation of two finer meshes is what the case was extrapolated to, within its stated error."""
    found, finer = (every_mode(case, factor, 60) for factor in (1, 2))
    frequency = np.array(case["freqs"])
    # Truncated modes lack their static part, which both meshes have alike.
    once, twice = (at_platform(one, frequency) for one in (found, finer))
    better = twice + (twice - once) / 3
    for name, pairs in case["H_modal_conv"].items():
        expected = np.array(pairs) @ [1, 1j]
        error = np.abs(better[:, *ENTRIES[name]] / expected - 1).max()
        assert error < max(2 * case["H_modal_conv_err"][name], 1e-4)
        assert error < np.abs(once[:, *ENTRIES[name]] / expected - 1).max()


def stand(name: str = "azulay", rotation: Any = "free") -> tuple[Machine, Frame, Any]:
    """A machine at a pose that has no symmetry."""
    machine = load(name).with_spherical(rotation)
    pose = zyz_frame(np.add(machine.home.position, (0.002, 0.003, -0.001)), 0.3, 0.2, 0.2)
    return machine, pose, parse_mode(machine)


def test_modes_are_orthogonal() -> None:
    found = modes(*stand(), count=20)
    mass = found.shapes.T @ found.mesh.mass @ found.shapes
    stiffness = found.shapes.T @ found.mesh.stiffness @ found.shapes
    np.testing.assert_allclose(mass, np.eye(20), atol=1e-8)
    squares = (2 * math.pi * found.mesh_frequency) ** 2
    np.testing.assert_allclose(stiffness, np.diag(squares), atol=1e-8 * squares[-1])
    assert np.all(np.diff(found.mesh_frequency) >= 0)
    assert found.displacements.shape == (len(found.mesh.structure.nodes), 6, 20)
    np.testing.assert_array_equal(found.platform, found.displacements[PLATFORM])
    # Exact frequencies lie below those of a mesh, which is too stiff, and nearer to those of a finer one.
    finer = modes(*stand(), count=20, elements=16).mesh_frequency
    assert np.all(found.frequency < finer)
    assert np.all(finer < found.mesh_frequency)
    np.testing.assert_allclose(found.frequency, finer, rtol=5e-3)


def test_double_modes_are_both_found() -> None:
    machine = load("azulay")
    found = modes(machine, home_pose(machine), parse_mode(machine), 12)
    pairs = np.abs(np.diff(found.frequency)) < 1e-8 * found.frequency[1:]
    assert 3 <= pairs.sum() <= 6
    assert not np.any(pairs[1:] & pairs[:-1])


def test_strain_energy_has_its_places() -> None:
    machine, pose, signs = stand()
    found = modes(machine, pose, signs, 12)
    shares = found.strain_shares
    np.testing.assert_allclose(sum(shares.values()), 1, rtol=1e-12)
    assert {name.partition(".")[2] for name in shares} == {"guide", "slide", "link"}
    assert all(np.all(share > -1e-9) for share in shares.values())
    # A drive made a little stiffer raises a frequency by half of its share.
    step = 1e-4
    stiffer = changed(machine, {"guide": {"stiffness": f"{3 * (1 + step)} N/um"}})
    rise = modes(stiffer, pose, signs, 12).mesh_frequency / found.mesh_frequency - 1
    guides = sum(share for name, share in shares.items() if name.endswith("guide"))
    np.testing.assert_allclose(rise, step / 2 * guides, rtol=1e-2, atol=1e-9)


def test_all_modes_together_move_everything_but_what_stands_on_the_ground() -> None:
    machine, pose, signs = stand()
    total = sum(masses(machine, pose, signs).values()) - sum(float(rod.mass) for rod in assemble(machine, pose, signs).sheathed)
    lack = []
    for elements in (4, 8):
        found = modes(machine, pose, signs, 10_000, elements)
        together = found.effective_mass.sum(axis=1)
        # All drives yield in the plane, so nothing stands still there; upward the slides stand on their carriages.
        np.testing.assert_allclose(together[:2], total, rtol=1e-9)
        lack.append(1 - together[2] / total)
        assert np.all(np.cumsum(found.effective_mass, axis=1)[:, 10] < together * (1 + 1e-9))
    assert 0 < lack[1] < lack[0] < 0.05


def test_effective_mass_of_a_rigid_platform() -> None:
    """On soft drives a heavy platform takes its whole mass and its inertia about the axis into the lowest modes."""
    machine = changed(
        load("azulay").with_spherical("clamped"),
        {"guide": {"stiffness": "1 N/mm"}, "slide": {"stiffness": "1 N/mm"}},
        platform={"mass": "2000 kg", "inertia": ["20 kg m^2", "20 kg m^2", "40 kg m^2"]},
    )
    found = modes(machine, home_pose(machine), parse_mode(machine), 3)
    np.testing.assert_allclose(found.effective_mass[:2].sum(axis=1), 2000, rtol=2e-3)
    np.testing.assert_allclose(found.effective_mass[5].sum(), 40, rtol=2e-3)
    # Seen from {O}, what is moved along x and y turns about y and x, with the height as its arm.
    np.testing.assert_allclose(found.effective_mass[3:5].sum(axis=1), 2000 * 0.125**2, rtol=2e-2)


@pytest.mark.parametrize("damping", ["structural", "modal"])
def test_static_part_of_the_modes_left_out(damping: Any) -> None:
    structure = assemble(*stand())
    fine = mesh(structure, 6)
    rows, frequency = fine.rows(PLATFORM), np.array([1.0, 200.0, 900.0])
    whole = Modes(structure, fine, *eigenmodes(fine, fine.mass.shape[0]))
    expected = modal_receptance(whole, rows, rows, frequency, 0.02, damping)
    if damping == "structural":
        direct = direct_receptance(fine, rows, rows, frequency, 0.02)
        np.testing.assert_allclose(expected, direct, rtol=0, atol=1e-8 * np.abs(direct).max())
    few = Modes(structure, fine, *eigenmodes(fine, 20))
    errors = [
        np.abs(modal_receptance(few, rows, rows, frequency, 0.02, damping, corrected) - expected).max(axis=(1, 2))
        / np.abs(expected).max(axis=(1, 2))
        for corrected in (True, False)
    ]
    assert np.all(errors[0] < 5e-3)
    assert errors[0][0] < 1e-6 < 1e-4 < errors[1][0]


def test_methods_agree() -> None:
    machine, pose, signs = stand()
    frequency = np.array([30.0, 450.0, 1200.0])
    for response, excitation in (
        ("platform", "leg-2.slide"),
        ("leg-1.link@0.3", "leg-3.ball"),
        ("leg-1.slide@1", "leg-1.slide@1"),
    ):
        exact, direct, modal, turned = (
            receptance(machine, pose, signs, frequency, response=a, excitation=b, method=method, elements=24)  # type: ignore[arg-type]
            for method, a, b in (
                ("exact", response, excitation),
                ("direct", response, excitation),
                ("modal", response, excitation),
                ("exact", excitation, response),
            )
        )
        size = np.abs(exact).max(axis=(1, 2), keepdims=True)
        assert np.abs((direct - exact) / size).max() < 3e-5
        assert np.abs((modal - exact) / size).max() < 1e-2
        # Maxwell and Betti: what excites and what is excited may change places.
        np.testing.assert_allclose(turned.swapaxes(1, 2), exact, rtol=0, atol=1e-9 * np.abs(exact).max())


def test_places_on_one_body_move_with_it() -> None:
    machine, pose, signs = stand()
    machine = changed(machine, platform={"mass": "0.2 kg", "tool_tip": ["10 mm", "5 mm", "40 mm"]})
    frequency = np.array([100.0, 700.0])

    def between(response: str, excitation: str, method: Any = "direct") -> NDArray[Any]:
        return receptance(machine, pose, signs, frequency, response=response, excitation=excitation, method=method)

    tip = np.array([float(c) for c in pose.shift((0.01, 0.005, 0.04)).origin])
    shift = carry(tip - np.array([float(c) for c in pose.origin]))
    centre = between("platform", "platform")
    close: Any = {"rtol": 0, "atol": 1e-12 * np.abs(centre).max()}
    np.testing.assert_allclose(between("tool", "platform"), shift @ centre, **close)
    np.testing.assert_allclose(between("tool", "tool"), shift @ centre @ shift.T, **close)
    # A ball stands on the platform, a beam ends in the node of the next joint.
    legs = {leg.name: leg for leg in machine.legs}
    ball = np.array([float(c) for c in pose.shift(legs["leg-2"].platform_frame().origin).origin])
    shift = carry(ball - np.array([float(c) for c in pose.origin]))
    np.testing.assert_allclose(between("leg-2.ball", "platform"), shift @ centre, **close)
    # On either side of the ball the point moves alike.
    np.testing.assert_allclose(between("leg-2.link@1", "platform")[:, :3], (shift @ centre)[:, :3], **close)
    np.testing.assert_allclose(between("leg-2.link@0", "platform"), between("leg-2.hinge", "platform"), **close)
    np.testing.assert_allclose(
        between("leg-2.link@1.0", "leg-2.link@0.0").swapaxes(1, 2), between("leg-2.link@0", "leg-2.link@1"), **close
    )


def test_a_share_counts_from_the_ground() -> None:
    machine, pose, signs = stand()
    structure = assemble(machine, pose, signs)
    (beam,) = (beam for beam in structure.beams if beam.name == "leg-2.link")
    first, second = structure.nodes[beam.first], structure.nodes[beam.second]
    once = place_of(machine, pose, structure, "leg-2.link@0.25")
    twice = place_of(machine, pose, once.structure, "leg-2.link@0.75")
    for place, share in ((once, 0.25), (twice, 0.75)):
        np.testing.assert_allclose(place.at, (1 - share) * first + share * second, atol=1e-15)
        np.testing.assert_array_equal(twice.structure.nodes[place.node], place.at)
    pieces = [piece for piece in twice.structure.beams if piece.name == "leg-2.link"]
    np.testing.assert_allclose([float(piece.length) for piece in pieces], np.array([0.25, 0.5, 0.25]) * 0.216, rtol=1e-12)
    assert place_of(machine, pose, structure, "leg-2.link@1.0").node == beam.second
    assert place_of(machine, pose, structure, "leg-2.link@0").node == beam.first


@pytest.mark.parametrize("share", [0.9, 0.5, 0.1])
def test_a_cut_changes_nothing(share: float) -> None:
    """A node where somebody looks divides a beam into pieces of different length; up to high frequencies nobody feels it."""
    machine, pose, signs = stand()
    frequency, loss = np.array([100.0, 700.0, 19000.0]), 0.02
    structure = assemble(machine, pose, signs)
    answers = []
    for own in (structure, place_of(machine, pose, structure, f"leg-2.link@{share}").structure):
        chosen = exact_mesh(own, 2 * math.pi * float(frequency.max()))
        rows = chosen.rows(PLATFORM)
        answers.append(exact_receptance(ExactStructure(chosen), rows, rows, frequency, loss))
    sizes = np.abs(answers[0]).max(axis=(1, 2), keepdims=True)
    assert np.abs((answers[1] - answers[0]) / sizes).max() < 1e-6


def test_outputs() -> None:
    frequency = np.array([1.0, 50.0])
    found = np.array([[1 + 2j], [3 - 1j]])
    omega = 2 * math.pi * frequency[:, None]
    np.testing.assert_array_equal(per("receptance", found, frequency), found)
    np.testing.assert_allclose(per("mobility", found, frequency), 1j * omega * found)
    np.testing.assert_allclose(per("accelerance", found, frequency), -(omega**2) * found)


def oscillator(natural: float, stiffness: float, loss: float, damping: str = "structural") -> Any:
    """|H| of a mass on a spring at frequencies (Hz)."""

    def size(frequency: NDArray[Any]) -> NDArray[Any]:
        ratio = frequency / natural
        below = 1 - ratio**2 + 1j * loss * (1 if damping == "structural" else ratio)
        return np.abs(1 / (stiffness * below))

    return size


def alone(size: Any) -> Any:
    """One response as a column."""
    return lambda frequency: size(frequency)[:, None]


@pytest.mark.parametrize("natural", [1.37, 123.456, 19876.5])
@pytest.mark.parametrize("loss", [1e-3, 0.02, 0.3])
def test_peak_of_an_oscillator(natural: float, loss: float) -> None:
    """Structural damping: 1/|H| = k eta at the natural frequency; modal: 2 zeta k sqrt(1 - zeta^2), a little below it."""
    zeta = loss / 2
    for damping, stiffness, frequency in (
        ("structural", 5e6 * loss, natural),
        ("modal", 5e6 * loss * math.sqrt(1 - zeta**2), natural * math.sqrt(1 - 2 * zeta**2)),
    ):
        size = oscillator(natural, 5e6, loss, damping)
        (peak,) = greatest(alone(size), 1.0, 20000.0, loss)
        np.testing.assert_allclose(1 / peak.size, stiffness, rtol=1e-12)
        np.testing.assert_allclose(peak.frequency, frequency, rtol=1e-6)


def test_the_greatest_of_many_peaks() -> None:
    """Of a close pair and far rivals, each response finds its own; neighbours on the grid hide nothing."""
    loss = 0.002
    first, second, third = (oscillator(f, k, loss) for f, k in ((100.0, 1.0), (100.05, 1.001), (3000.0, 0.9995)))

    def size(frequency: NDArray[Any]) -> NDArray[Any]:
        return np.stack([first(frequency), second(frequency), np.maximum(first(frequency), third(frequency))], axis=1)

    peaks = greatest(size, 1.0, 20000.0, loss)
    np.testing.assert_allclose([p.frequency for p in peaks], [100.0, 100.05, 3000.0], rtol=1e-6)
    np.testing.assert_allclose([p.size * loss for p in peaks], [1.0, 1 / 1.001, 1 / 0.9995], rtol=1e-12)


def test_slight_damping_and_flat_responses() -> None:
    """A grid has its limits: narrower peaks are found by their flanks, and what is flat is not searched peak by peak."""
    size = oscillator(500.0, 1.0, 1e-8)
    (peak,) = greatest(alone(size), 1.0, 20000.0, 1e-8)
    np.testing.assert_allclose([peak.frequency, 1 / peak.size], [500.0, 1e-8], rtol=0.2)
    # On the grid its flank is lower than the broad peak beside it, which is not the greatest all the same.
    broad, narrow = oscillator(500.0, 1.0, 0.02), oscillator(900.0, 1e3, 1e-8)
    (peak,) = greatest(alone(lambda f: broad(f) + narrow(f)), 1.0, 20000.0, 1e-8)
    assert abs(peak.frequency - 900) < 0.1
    calls: list[int] = []

    def flat(frequency: Any) -> Any:
        calls.append(len(frequency))
        return 1 + 1e-16 * np.cos(1e5 * frequency)[:, None]

    greatest(flat, 1e-9, 1.0, 0.02)
    assert len(calls) < 2000


def test_peaks_at_the_ends_and_none() -> None:
    size = oscillator(500.0, 1.0, 0.02)
    (low,) = greatest(alone(size), 600.0, 900.0, 0.02)
    (high,) = greatest(alone(size), 100.0, 400.0, 0.02)
    assert (low.frequency, high.frequency) == (600.0, 400.0)
    (nothing,) = greatest(lambda f: np.full((len(f), 1), np.nan), 1.0, 10.0, 0.02)
    assert math.isnan(nothing.size)


def test_no_resonance_hides_between_frequencies() -> None:
    frequency = grid(5.0, 3000.0, 0.02)
    assert frequency[0] == 5.0
    np.testing.assert_allclose(frequency[-1], 3000.0, rtol=1e-12)
    assert np.all(np.diff(frequency) / frequency[:-1] < 0.02 / 4 * 1.01)


@pytest.mark.parametrize(
    ("low", "high", "loss", "message"),
    [
        (0.0, 10.0, 0.02, "rises from above 0 Hz"),
        (-1.0, 10.0, 0.02, "rises from above 0 Hz"),
        (10.0, 5.0, 0.02, "rises from above 0 Hz"),
        (10.0, 10.0, 0.02, "rises from above 0 Hz"),
        (1.0, 10.0, 0.0, "only with damping above zero"),
        (1.0, 10.0, -0.1, "only with damping above zero"),
    ],
)
def test_no_such_range(low: float, high: float, loss: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        greatest(lambda f: f[:, None], low, high, loss)


def test_report_of_modes() -> None:
    machine = load("azulay").with_spherical("free")
    report = modes_report(machine, count=6)
    assert report.frequency.shape == (6,)
    assert report.platform.shape == report.effective_mass.shape == (6, 6)
    for shares in report.shares:
        sizes = [share.share for share in shares]
        assert sizes == sorted(sizes, reverse=True)
        np.testing.assert_allclose(sum(sizes), 1)
    np.testing.assert_array_equal(report.frequency, modes(machine, home_pose(machine), parse_mode(machine), 6).frequency)


def test_response_report() -> None:
    machine = load("azulay").with_spherical("free")
    report = frf(machine, low=20.0, high=900.0, points=50, method="modal", damping="modal", loss_factor=0.02)
    assert np.all(np.diff(report.frequency) > 0)
    assert report.frequency[0] == 20.0
    assert report.frequency[-1] == 900.0
    # Every resonance is looked at from nearby.
    natural = modes(machine, home_pose(machine), parse_mode(machine), 12).frequency
    np.testing.assert_allclose(report.natural, natural[(natural > 20) & (natural < 900)], rtol=1e-8)
    for f in report.natural:
        assert np.abs(report.frequency / f - 1).min() < 1e-12
        assert np.sum(np.abs(report.frequency / f - 1) < 0.02 * 1.55) >= 20
    np.testing.assert_array_equal(report.entry("x_ry"), report.receptance[:, 0, 4])
    np.testing.assert_array_equal(report.entry("zz", "mobility"), per("mobility", report.receptance, report.frequency)[:, 2, 2])
    np.testing.assert_allclose(
        report.dynamic_stiffness @ report.receptance, np.broadcast_to(np.eye(6), report.receptance.shape), atol=1e-9
    )
    assert [m.direction for m in report.minima] == list(AXES)
    sizes = np.abs(report.receptance[:, range(6), range(6)])
    for minimum, own in zip(report.minima, sizes.T, strict=True):
        assert minimum.stiffness <= 1 / own.max() * (1 + 1e-12)
        np.testing.assert_allclose(minimum.stiffness, 1 / own.max(), rtol=2e-3)
        assert np.abs(report.natural / minimum.frequency - 1).min() < 1e-3


def test_natural_frequencies_up_to_a_limit() -> None:
    machine = load("azulay").with_spherical("free")
    at = pose_report(machine)
    found = natural_frequencies(at, 300.0, 3000.0)
    expected = modes(machine, at.frame, at.signs, 20).frequency
    np.testing.assert_allclose(found, expected[(expected > 300) & (expected < 3000)], rtol=1e-9)
    assert len(natural_frequencies(at, 1.0, 2.0)) == 0
    many = natural_frequencies(at, 1.0, 20000.0)
    assert len(many) > 40
    structure = assemble(machine, at.frame, at.signs)
    np.testing.assert_allclose(many, exact_frequencies(structure, many), rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("xx", ("x", "x")), ("xz", ("x", "z")), ("x_ry", ("x", "ry")), ("rzrz", ("rz", "rz")), ("rz_x", ("rz", "x"))],
)
def test_directions(name: str, expected: tuple[str, str]) -> None:
    assert directions(name) == expected


@pytest.mark.parametrize("name", ["", "x", "xq", "x_", "x_ry_z", "rxy"])
def test_no_such_directions(name: str) -> None:
    with pytest.raises(InputError, match="expected two of x, y, z"):
        directions(name)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"low": 0.0}, "rises from above 0 Hz"),
        ({"low": 20.0, "high": 10.0}, "rises from above 0 Hz"),
        ({"high": math.inf}, "rises from above 0 Hz"),
        ({"low": math.nan}, "rises from above 0 Hz"),
        ({"points": 1}, "points: 1; expected 2 to"),
        ({"loss_factor": -0.01}, "loss factor: -0.01; expected 0 or more"),
        ({"loss_factor": math.nan}, "loss factor: nan; expected 0 or more"),
        ({"method": "modl"}, "method 'modl' is not known; did you mean 'modal'"),
        ({"damping": "structual"}, "damping 'structual' is not known; did you mean 'structural'"),
        ({"damping": "modal"}, "modal damping needs modes"),
        ({"response": "leg-1.lnk"}, "place leg-1.lnk: not known"),
        ({"excitation": "leg-1.link@1.5", "method": "direct"}, "place leg-1.link@1.5: not known"),
    ],
)
def test_what_a_response_is_not_asked(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        frf("azulay", **{"low": 5.0, "high": 100.0, "points": 3} | settings)


def test_output_is_named() -> None:
    report = frf("azulay", low=5.0, high=10.0, points=2, method="direct")
    with pytest.raises(InputError, match="output 'mobilty' is not known; did you mean 'mobility'"):
        report.as_output("mobilty")


def test_own_damping_couples_the_modes() -> None:
    machine, pose, signs = stand()
    damped = changed(machine, {"slide": {"loss_factor": 0.1}})
    with pytest.raises(InputError, match="couple the modes; use exact or direct"):
        receptance(damped, pose, signs, np.array([10.0]), method="modal")


def test_a_slide_without_a_drive_is_named() -> None:
    machine, pose, signs = stand()
    loose = changed(machine, {"slide": {"actuated": None, "stiffness": None}})
    with pytest.raises(NoResultError, match=r"^azulay: .*without resistance.*leg-\d\.slide"):
        modes(loose, pose, signs)


@pytest.mark.parametrize("above", [0.0, 5e-6])
def test_a_singular_pose_is_named(above: float) -> None:
    """Where the second links of Glozman's machine lie level, nothing holds the platform up; next to it hardly anything."""
    machine = load("glozman").with_spherical("free").with_rigid_drives()
    level = zyz_frame((0.0, 0.0, math.sqrt(0.13**2 - 0.014**2) + above), 0.0, 0.0, 0.0)
    with pytest.raises(NoResultError, match=r"^glozman: .*without resistance.*leg-\d\.hinge"):
        modes(machine, level, parse_mode(machine))


def test_out_of_reach() -> None:
    machine = load("azulay")
    with pytest.raises(NoResultError, match="chain leg-1 does not reach"):
        modes(machine, zyz_frame((0.0, 0.0, 0.5), 0.0, 0.0, 0.0), parse_mode(machine))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"count": 0}, "count: 0; expected at least 1 mode"),
        ({"elements": 0}, "elements: 0 for leg-1.slide; expected 1 to"),
        ({"elements": {"link": 1000}}, "elements: 1000 for leg-1.link; expected 1 to"),
        ({"elements": {"linc": 3}}, "no beam is called linc"),
    ],
)
def test_what_modes_are_not_asked(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        modes_report("azulay", **settings)


def test_a_damping_below_zero_is_refused() -> None:
    for keys in ({"slide": {"damping": "-1 N s/m"}}, {"hinge": {"damping": "-1 N m s/rad"}}, {"guide": {"loss_factor": -0.1}}):
        with pytest.raises(InputError, match="must not be negative"):
            changed(load("azulay"), keys)


def test_a_drive_series_has_no_mass_between() -> None:
    """Two slides in one line, each with a drive: the body between them weighs nothing and takes no part in the frequencies."""
    machine = load("rmmt").with_guide("translation")
    pose, signs = home_pose(machine), parse_mode(machine)
    found = modes(machine, pose, signs, 6)
    np.testing.assert_allclose(found.frequency, found.mesh_frequency, rtol=1e-4)
