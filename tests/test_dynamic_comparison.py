"""Comparison by dynamic stiffness: the exact path, the paper's Table 5, and every number that docs/vibration.md tells."""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest
from documents import Document, message_of, with_change, written

import trivet
from trivet.errors import InputError, NoResultError
from trivet.model import Machine, document_of, parse
from trivet.model.elements import Spherical
from trivet.study import dynamic_comparison as dc
from trivet.study.dynamic_comparison import AS_DESCRIBED, DynamicComparison, Ordering, compare_dynamics, variants
from trivet.study.frf import Minimum
from trivet.vibration.response import receptance

PAGE = (Path(__file__).parents[1] / "docs" / "vibration.md").read_text(encoding="utf-8")

TABLE_5 = {
    "azulay": (0.178, 0.161, 0.066),
    "eclipse": (0.044, 0.041, 0.567),
    "alizade": (0.047, 0.071, 2.08),
    "glozman": (0.015, 0.021, 0.005),
}
"""N/um."""
STIFF, PREMISE = "drives rigid, balls 300 N m/rad", "drives rigid, balls free"
REPEATED = ("balls clamped", "Euler-Bernoulli", "drives rigid, balls clamped")
"""Variants that are others again, since the files say clamped balls and Euler-Bernoulli."""


@pytest.fixture(scope="module")
def compared() -> DynamicComparison:
    return compare_dynamics()


def least(found: DynamicComparison, machine: str, variant: str, axis: str) -> float:
    """N/um."""
    minimum = found.of(machine, variant).along(axis)
    assert minimum is not None
    return minimum.stiffness / 1e6


def different(found: DynamicComparison, axis: str) -> list[Ordering]:
    return [o for o in found.orderings if o.axis == axis and o.variant not in REPEATED]


def variant(name: str) -> dc.Variant:
    return next(v for v in variants() if v.name == name)


# The numbers: against paths that share little with this one.


def test_the_exact_path_finds_the_same(compared: DynamicComparison) -> None:
    machine = trivet.load("azulay").with_spherical("free").with_rigid_drives()
    exact = trivet.minimum_dynamic_stiffness(trivet.pose(machine))
    found = compared.of("azulay", PREMISE).minima
    assert [m.direction for m in found] == ["x", "y", "z"]
    for ours, other in zip(found, exact, strict=False):
        assert ours.direction == other.direction
        assert ours.stiffness == pytest.approx(other.stiffness, rel=1e-9)
        assert ours.frequency == pytest.approx(other.frequency, rel=1e-6)


def test_parts_with_damping_of_their_own() -> None:
    """The same damping, told of the steel and of the rest, leads through the exact path; modes cannot have it."""
    document = with_change(written("azulay"), "materials/steel/loss_factor", 0.02)
    found = compare_dynamics(parse(document), sensitivity=["modal damping"])
    for ours, other in zip(
        found.described[0].minima, compare_dynamics("azulay", sensitivity=False).described[0].minima, strict=True
    ):
        assert ours.stiffness == pytest.approx(other.stiffness, rel=1e-9)
    modal = found.of("azulay", "modal damping")
    assert modal.minima == ()
    assert modal.status == "has parts with damping of their own, which couple the modes"


def test_modal_damping_is_that_of_the_modal_method(compared: DynamicComparison) -> None:
    at = trivet.pose("eclipse")
    for number, minimum in enumerate(compared.of("eclipse", "modal damping").minima):
        places = minimum.frequency * np.array([0.9999, 1.0, 1.0001])
        h = receptance(at.machine, at.frame, at.signs, places, method="modal", damping="modal", elements=dc.ELEMENTS)
        low, here, high = 1 / np.abs(h[:, number, number])
        assert minimum.stiffness == pytest.approx(here, rel=1e-6)
        assert here < min(low, high)


def test_natural_frequencies_are_those_of_modes(compared: DynamicComparison) -> None:
    for name in compared.names:
        found = trivet.modes(name, count=dc.FREQUENCIES).frequency
        np.testing.assert_allclose(compared.of(name).natural, found, rtol=1e-9)
    raised = trivet.modes("azulay", (0.0, 0.0, 0.120), count=dc.FREQUENCIES).frequency
    np.testing.assert_allclose(compared.of("azulay", "home -5 mm").natural, raised, rtol=1e-9)


def test_the_highest_of_several_near_peaks_is_taken() -> None:
    places = np.geomspace(10, 1000, 500)

    def size(f: float) -> np.ndarray:
        return np.array([1 + 5 * math.exp(-(((f - 100) / 3) ** 2)) + 5.2 * math.exp(-(((f - 500) / 9) ** 2)), 0.0, 0.0])

    values = np.array([size(f)[0] for f in places])
    values[np.argmin(abs(places - 100))] = 6.4  # what a coarse mesh would make the greatest
    brackets = dc._peaks(places, values)
    assert len(brackets) == 2
    found = dc._least("x", brackets, size)
    assert found.frequency == pytest.approx(500, abs=1e-3)
    assert found.stiffness == pytest.approx(1 / 6.2, rel=1e-9)


def test_a_peak_at_the_end_of_the_range_is_bracketed() -> None:
    assert dc._peaks(np.array([1.0, 2.0, 3.0, 4.0]), np.array([5.0, 3.0, 2.0, 4.9])) == [(1.0, 3.0), (2.0, 4.0)]
    narrow = compare_dynamics("azulay", low=5, high=100, sensitivity=False).described[0]
    assert [round(m.frequency) for m in narrow.minima] == [100, 100, 100], "below the first resonance"


# The paper.


def test_table_5_is_in_the_files(compared: DynamicComparison) -> None:
    rows = {(d.machine, d.quantity): d for d in compared.deviations}
    assert len(rows) == 12
    for name, values in TABLE_5.items():
        for axis, value in zip("xyz", values, strict=True):
            row = rows[name, f"D_{axis}{axis}"]
            assert row.source == "Azulay et al. 2014, Table 5"
            assert row.published == pytest.approx(1e6 * value, rel=1e-12)
            assert row.published == compared.published(name, axis)
            assert row.ours == 1e6 * least(compared, name, AS_DESCRIBED, axis)
            assert row.relative == pytest.approx(row.ours / row.published - 1)


def test_x_and_y_are_equal_here_and_not_there(compared: DynamicComparison) -> None:
    for found in compared.variants:
        if not found.status:
            x, y, _ = found.minima
            assert x.stiffness == pytest.approx(y.stiffness, rel=1e-6)
    apart = [abs(x - y) / (x + y) * 200 for x, y, _ in TABLE_5.values()]
    assert (round(min(apart)), round(max(apart))) == (7, 41)


def tables(page: str) -> list[list[list[str]]]:
    found = re.findall(r"(?:^\|.*\|$\n)+", page, re.MULTILINE)
    return [[[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()] for text in found]


def test_the_page_tells_the_table_of_variants(compared: DynamicComparison) -> None:
    (rows,) = (t for t in tables(PAGE) if t[0][0] == "variant")
    assert [row[0] for row in rows[2:]] == compared.variant_names
    for name, *cells in rows[2:]:
        for (machine, axis), cell in zip(itertools.product(compared.names, "xz"), cells, strict=True):
            minimum = compared.of(machine, name).along(axis)
            assert cell == ("–" if minimum is None else f"{minimum.stiffness / 1e6:.4f}"), (name, machine, axis)


def test_the_page_tells_table_5(compared: DynamicComparison) -> None:
    (rows,) = (t for t in tables(PAGE) if t[0][:2] == ["machine", "x here = y here"])
    for row in rows[2:]:
        name = row[0].strip("`")
        ours = [f"{least(compared, name, AS_DESCRIBED, axis):.3f}" for axis in "xz"]
        x, y, z = (f"{value:.3f}" for value in TABLE_5[name])
        assert row[1:] == [ours[0], x, y, ours[1], z]


def test_the_page_tells_the_link_lengths() -> None:
    (rows,) = (t for t in tables(PAGE) if t[0][0] == "setting")
    names = ("azulay-196", "azulay", "azulay-236")
    found = compare_dynamics(*names, sensitivity=[row[0] for row in rows[3:]])
    assert [row[0] for row in rows[2:]] == found.variant_names
    for setting, *cells in rows[2:]:
        for axis, cell in zip("xz", cells, strict=True):
            values = [least(found, name, setting, axis) for name in names]
            word = "falls" if values[0] > values[1] > values[2] else "**rises**" if values[0] < values[1] < values[2] else ""
            assert cell == ", ".join(f"{v:.4f}" for v in values) + f": {word}"


def test_the_page_tells_how_often_orderings_come_out(compared: DynamicComparison) -> None:
    assert len(compared.variant_names) == 26
    assert len(different(compared, "x")) == 23
    for repeated, other in zip(REPEATED, (AS_DESCRIBED, AS_DESCRIBED, "drives rigid"), strict=True):
        for name in compared.names:
            assert compared.of(name, repeated).minima == compared.of(name, other).minima
    for axis in "xy":
        own = different(compared, axis)
        assert own[0].published == ("azulay", "alizade", "eclipse", "glozman")
        assert sum(o.is_published is True for o in own) == 6
        assert [o.variant for o in own if o.machines[0] != "azulay"] == ["balls free", PREMISE]
        stiff = [o.variant for o in own if o.is_published]
        assert all(v.startswith("drives") for v in stiff)
        assert {v for v in compared.variant_names if v.startswith("drives rigid")} - set(stiff) == {
            PREMISE, "drives rigid, balls 100 N m/rad", "drives rigid, balls clamped"
        }  # fmt: skip
    own = different(compared, "z")
    assert own[0].published == ("alizade", "eclipse", "azulay", "glozman")
    assert not any(o.is_published for o in own)
    assert sum(o.agreeing == (5, 6) for o in own) == 14
    assert sum(o.machines[-1] == "glozman" for o in own) == 20


def test_the_page_tells_what_moves_the_values(compared: DynamicComparison) -> None:
    def against(names: list[str], axis: str) -> list[float]:
        """Greatest over least, by machine."""
        spans = []
        for machine in compared.names:
            own = [m.stiffness for v in names if (m := compared.of(machine, v).along(axis))]
            spans.append(max(own) / min(own))
        return spans

    joints = [v for v in compared.variant_names if v.startswith(("balls", "drives"))]
    assert (round(min(against(joints, "x"))), round(max(against(joints, "x")))) == (12, 562)
    assert (round(min(against(joints, "z"))), round(max(against(joints, "z")))) == (8, 62)
    for names, most in ((["home"], 0.24), (["platform", "Timoshenko", "modal"], 0.03)):
        few = [v for v in compared.variant_names if v.startswith(tuple(names))]
        moved = [
            abs(m.stiffness / 1e6 / least(compared, machine, AS_DESCRIBED, axis) - 1)
            for machine, v, axis in itertools.product(compared.names, few, "xyz")
            if (m := compared.of(machine, v).along(axis))
        ]
        assert most - 0.01 < max(moved) < most + 0.005
    for machine, axis in itertools.product(compared.names, "xyz"):
        half = least(compared, machine, "loss factor × 0.5", axis) / least(compared, machine, AS_DESCRIBED, axis)
        assert half == pytest.approx(0.5, rel=1e-3)


def test_the_page_tells_what_the_values_say(compared: DynamicComparison) -> None:
    outside = [(r.machine, r.axis) for r in compared.ranges if not r.covers]
    assert outside == [("glozman", "z")]
    assert round(next(r for r in compared.ranges if (r.machine, r.axis) == outside[0]).least / 1e6, 4) == 0.0060
    off = {}
    for name, values in TABLE_5.items():
        ratios = [least(compared, name, STIFF, axis) / value for axis, value in zip("xy", values[:2], strict=True)]
        off[name] = max(max(r, 1 / r) for r in ratios)
    assert max(off[name] for name in ("azulay", "eclipse", "alizade")) < 1.5
    assert round(off["glozman"], 1) == 3.2
    assert round(TABLE_5["alizade"][2] / TABLE_5["azulay"][2]) == 32
    z = {
        n: {v: m.stiffness / 1e6 for v in compared.variant_names if (m := compared.of(n, v).along("z"))} for n in compared.names
    }
    assert round(max(z["alizade"][v] / z["azulay"][v] for v in compared.variant_names), 1) == 3.3
    stiffer = [v for v in compared.variant_names if v.startswith("drives")]
    assert min(z["azulay"][v] for v in stiffer) > 0.26 > 0.14 > max(z["azulay"][v] for v in z["azulay"] if v not in stiffer)
    rigid = [v for v in stiffer if v.startswith("drives rigid")]
    assert min(z["alizade"][v] for v in rigid) > 2.08
    assert round(max(z["alizade"][v] for v in z["alizade"] if v not in rigid), 2) == 1.24
    assert max(z["alizade"], key=lambda v: 0 if v in rigid else z["alizade"][v]) == "drives × 10", "3 N/um times 10"


# How variants apply, and what has no result.


def test_home_that_is_not_reached_is_a_status(compared: DynamicComparison) -> None:
    found = compared.of("eclipse", "home +10 mm")
    assert found.status == "the pose is not reached: leg-1.column at 66 mm is above its limit of 65 mm"
    assert found.minima == ()
    assert found.along("x") is None
    assert len(found.natural) == 0
    for ordering in (o for o in compared.orderings if o.variant == "home +10 mm"):
        assert ordering.missing == ("eclipse",)
        assert ordering.is_published is None
        assert ordering.agreeing[1] == 3
    assert [d.variant for d in compared.variants if d.status] == ["home +10 mm"]


def test_a_machine_that_moves_freely_is_a_status() -> None:
    """With its second link level, Glozman's machine has nothing but its balls to hold the platform along z."""
    height = math.sqrt(130**2 - (162 - 18 - 130) ** 2)
    machine = trivet.load("glozman", {"home.position": f"0 mm, 0 mm, {height!r} mm"})
    found = compare_dynamics(machine, sensitivity=["drives rigid, balls free", "drives rigid, balls clamped"])
    assert "moves without resistance" in found.of("glozman", "drives rigid, balls free").status
    assert not found.of("glozman", "drives rigid, balls clamped").status
    assert not found.described[0].status
    with pytest.raises(NoResultError, match=r"glozman: .*moves without resistance"):
        compare_dynamics(machine.with_spherical("free").with_rigid_drives(), sensitivity=False)


def bare(document: Document, **platform: Any) -> Machine:
    return parse(with_change(document, "platform", platform))


def test_variants_apply_to_what_there_is() -> None:
    rigid = trivet.load("azulay").with_rigid_drives()
    for name in ("drives rigid", "drives × 3", STIFF):
        with pytest.raises(NoResultError, match="has no drive that yields"):
            variant(name).change(rigid)
    kinds = {
        e.rotation
        for c in variant(STIFF).change(trivet.load("azulay")).chains.values()
        for e in c.elements
        if isinstance(e, Spherical)
    }
    assert kinds == {"elastic"}
    chains = {n: dataclasses.replace(c, elements=c.elements[:-1]) for n, c in trivet.load("azulay").chains.items()}
    without = dataclasses.replace(trivet.load("azulay"), chains=chains)
    for name in ("balls free", STIFF):
        with pytest.raises(NoResultError, match="has no spherical joint"):
            variant(name).change(without)
    document = written("azulay")
    with pytest.raises(NoResultError, match="has a platform without mass"):
        variant("platform × 2").change(bare(document))
    weighed = variant("platform × 2").change(
        bare(document, mass="1 kg", inertia=["2 kg m^2"] * 3, products_of_inertia=["0.1 kg m^2"] * 3)
    )
    assert weighed.platform.mass == 2
    assert weighed.platform.inertia == (4, 4, 4)
    assert weighed.platform.products_of_inertia == (0.2, 0.2, 0.2)
    light = variant("platform × 0.5").change(bare(document, mass="1 kg"))
    assert (light.platform.mass, light.platform.inertia) == (0.5, None)
    thick = variant("platform × 2").change(trivet.load("azulay")).platform.disc
    assert thick is not None
    assert thick.thickness == 0.02


def test_stiffer_drives_are_stiffer_and_nothing_else() -> None:
    machine = trivet.load("glozman")
    before, after = (document_of(m)["chains"]["leg"]["elements"] for m in (machine, variant("drives × 3").change(machine)))
    changed = {e["name"]: (e, f) for e, f in zip(before, after, strict=True) if e != f}
    assert set(changed) == {"guide", "shoulder"}
    assert changed["guide"][1]["stiffness"] == "9 N/um"
    assert jax.tree.structure(variant("drives × 3").change(machine)) == jax.tree.structure(machine)


def test_every_variant_but_the_first_changes_something() -> None:
    machine = trivet.load("azulay").with_spherical(500.0)
    first, *others = variants()
    assert first.name == AS_DESCRIBED
    assert first.change(machine) is machine
    assert len({v.name for v in variants()}) == len(variants())
    for v in others:
        same = document_of(v.change(machine)) == document_of(machine)
        assert not same or v.raised or v.loss != 1 or v.damping == "modal" or v.name == "Euler-Bernoulli"


def test_other_machines_and_their_names() -> None:
    seen = []
    found = compare_dynamics(
        "azulay@link.length=206 mm", "tahmasebi", sensitivity=["balls free"], progress=lambda *words: seen.append(words)
    )
    assert found.names == ["azulay@link.length=206 mm", "tahmasebi"]
    assert seen == [(name, v) for v in (AS_DESCRIBED, "balls free") for name in found.names]
    assert found.deviations == [], "published values speak of the original"
    assert all(o.published == () and o.is_published is None and o.agreeing == (0, 0) for o in found.orderings)
    assert all(r.published is None and r.covers is None for r in found.ranges)


def test_without_variants() -> None:
    found = compare_dynamics("azulay", sensitivity=False)
    assert found.variants == ()
    assert found.variant_names == [AS_DESCRIBED]
    assert found.of("azulay") is found.described[0]
    assert [str(o) for o in found.orderings] == ["x: azulay", "y: azulay", "z: azulay"]
    for r in found.ranges:
        assert (
            (r.least, r.least_variant)
            == (r.greatest, r.greatest_variant)
            == (found.of("azulay").along(r.axis).stiffness, AS_DESCRIBED)
        )  # type: ignore[union-attr]


def test_orderings_and_ranges_by_hand() -> None:
    ordering = Ordering("v", "z", ("c", "a", "b"), (), ("a", "b", "c"))
    assert ordering.is_published is False
    assert ordering.agreeing == (1, 3)
    assert str(ordering) == "z: c > a > b"
    assert Ordering("v", "z", ("a", "b", "c"), (), ("a", "b", "c")).is_published is True
    assert Ordering("v", "z", ("c", "a"), ("b",), ("a", "b", "c")).agreeing == (0, 1)
    at = trivet.pose("azulay")

    def ranges(*values: float) -> list[dc.Range]:
        every = [
            dc.MinimumStiffness("azulay", name, tuple(Minimum(axis, value, 1.0) for axis in "xyz"), np.zeros(0))
            for name, value in zip((AS_DESCRIBED, "a", "b"), values, strict=True)
        ]
        return DynamicComparison((at,), (every[0],), tuple(every), 1.0, 2.0, 0.02).ranges

    x, y, z = ranges(2e5, 3e5, 1.7e5)
    assert (x.least, x.least_variant, x.greatest, x.greatest_variant, x.published) == (1.7e5, "b", 3e5, "a", 1.78e5)
    assert (x.covers, y.covers, z.covers) == (True, False, False), "published 0.178, 0.161, 0.066"
    assert [r.covers for r in ranges(1e5, 1.65e5, 0.1e5)] == [False, True, True]


@pytest.mark.parametrize(
    ("machines", "options", "fragments"),
    [
        (("azulay", "azulay"), {}, ("azulay: given twice", "azulay@link.length=200 mm")),
        (("azulay",), {"sensitivity": ["balls fre"]}, ("variant 'balls fre' is not known", "did you mean 'balls free'")),
        (("azulay",), {"sensitivity": False, "loss_factor": 0.0}, ("loss factor: 0", "above zero")),
        (("azulay",), {"sensitivity": False, "low": 10.0, "high": 5.0}, ("frequencies: 10 Hz to 5 Hz", "rises")),
    ],
)
def test_bad_input_is_refused(machines: tuple[str, ...], options: dict[str, Any], fragments: tuple[str, ...]) -> None:
    text = message_of(lambda: compare_dynamics(*machines, **options))
    for fragment in fragments:
        assert fragment in text


def test_home_as_described_must_be_reached() -> None:
    with pytest.raises(
        NoResultError, match=r"azulay: home\.position 0 mm, 0 mm, 300 mm: the pose is not reached: .*; with z at \d+ mm it is$"
    ):
        compare_dynamics(trivet.load("azulay", {"home.position": "0 mm, 0 mm, 300 mm"}))


def test_what_was_not_compared(compared: DynamicComparison) -> None:
    with pytest.raises(InputError, match=r"azuley, balls free: not compared; did you mean 'azulay'\?$"):
        compared.of("azuley", "balls free")
    with pytest.raises(InputError, match=r"azulay, ball free: not compared; did you mean 'balls free'"):
        compared.of("azulay", "ball free")


def test_published_dynamic_stiffness_is_read_and_written() -> None:
    machine = trivet.load("azulay")
    again = parse(document_of(machine))
    assert again.about.published_dynamic == machine.about.published_dynamic
    assert len(machine.about.published_dynamic) == 3
    assert machine.renamed("other").about.published_dynamic == ()
    assert trivet.load("azulay-196").about.published_dynamic == (), "Table 5 speaks of links of 216 mm"
    with pytest.raises(InputError, match=r"published_dynamic\.1\.quantity: \"K_xx\" is not known; expected 'D_xx'"):
        parse(with_change(written("azulay"), "about/published_dynamic/0/quantity", "K_xx"))
    with pytest.raises(InputError, match=r"published_dynamic\.1\.minimum: \"0.178\": the unit is missing"):
        parse(with_change(written("azulay"), "about/published_dynamic/0/minimum", "0.178"))
