"""Unknowns: slopes against differences, Sobol indices of products in closed form, orderings counted by hand."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from documents import message_of, traces

from trivet.design.evaluation import Evaluation
from trivet.design.orderings import Share, orders, pairs
from trivet.design.sampling import Saltelli
from trivet.design.slopes import first_order
from trivet.design.sobol import indices
from trivet.design.study import Study, study_of
from trivet.design.study_file import GivenPoses, GivenSensitivity, GivenSweep, GivenVariable, StudyFile
from trivet.design.sweep import drawn
from trivet.design.uncertainty import Uncertainty, sensitivity
from trivet.errors import NoResultError
from trivet.model import load

pytestmark = pytest.mark.usefixtures("quick_kernels")

DENSITY = GivenVariable(of="steel.density", low="6000 kg/m^3", high="9000 kg/m^3")
LONG = GivenVariable(of="link.length", low="150 mm", high="400 mm")
LENGTH = GivenVariable(of="link.length", low="205 mm", high="225 mm")
TUBE = GivenVariable(
    of=["sections.tube.outer_diameter", "sections.tube.inner_diameter"], name="tube",
    choices=[["19 mm", "14 mm"], ["25 mm", "19 mm"]],
)  # fmt: skip
AREA = math.pi / 4 * (0.019**2 - 0.014**2)
"""Of the tube, m²."""


def unknown(quantities: Any, variables: Any, machines: Any = ("azulay",), count: int = 256, chunk: int | None = None) -> Study:
    given = StudyFile(
        machines=list(machines), variables=list(variables), quantities=list(quantities), poses=GivenPoses(steps=2, rolls=24),
        sweep=GivenSweep(chunk=chunk), sensitivity=GivenSensitivity(count=count),
    )  # fmt: skip
    return study_of(given, [load(name) for name in machines])


@pytest.fixture(scope="module")
def masses(quick_kernels: None, tmp_path_factory: pytest.TempPathFactory) -> Uncertainty:
    """A product of two unknowns: density times what grows straight with the length of links."""
    return sensitivity(unknown(["mass"], [DENSITY, LONG]), tmp_path_factory.mktemp("masses") / "m.zarr")[0]


def volume(length: float) -> tuple[float, float]:
    """Volume (m³) of the machine with links of a length, and what a metre more of it adds: three tubes."""
    plain = unknown(["mass"], [DENSITY, LONG])
    own = Evaluation(plain, 1)(np.array([[1000.0, length]])).values[0, 0] / 1000
    return own, 3 * AREA


def test_first_order_of_a_product(masses: Uncertainty) -> None:
    (found,) = masses.first
    whole, more = volume(0.216)
    np.testing.assert_allclose(found.design, [7870, 0.216])
    np.testing.assert_allclose(found.value, [7870 * whole], rtol=1e-12)
    np.testing.assert_allclose(found.slope, [[whole, 7870 * more]], rtol=1e-9)
    np.testing.assert_allclose(found.elasticities, [[1, 0.216 * more / whole]], rtol=1e-9)
    parts = np.array([whole * 3000, 7870 * more * 0.25]) / math.sqrt(12)
    np.testing.assert_allclose(found.deviations, [math.hypot(*parts)], rtol=1e-9)
    np.testing.assert_allclose(found.shares, [parts**2 / (parts @ parts)], rtol=1e-9)


def test_indices_of_a_product(masses: Uncertainty) -> None:
    """E and V of both factors are known, and V of the product is E₁²V₂ + V₁E₂² + V₁V₂."""
    middle, more = volume(0.275)
    means, variances = np.array([7500, middle]), np.array([3000**2, (more * 0.25) ** 2]) / 12
    alone = variances / means**2
    whole = alone.sum() + alone.prod()
    (index,), (spread,) = masses.indices, masses.spreads
    np.testing.assert_allclose(index.first, alone / whole, atol=0.02)
    np.testing.assert_allclose(index.total, (alone + alone.prod()) / whole, atol=0.02)
    assert (np.abs(index.first - alone / whole) <= index.first_margin).all()
    assert spread.mean == pytest.approx(means.prod(), rel=1e-3)
    assert spread.deviation == pytest.approx(means.prod() * math.sqrt(whole), rel=0.01)
    assert spread.samples == masses.samples == 512
    designs = drawn(masses.study, masses.sampling, 0, masses.sampling.count).reshape(256, 4, 2)[:, [0, 3]]
    values = designs[..., 0] * (middle + more * (designs[..., 1] - 0.275))
    np.testing.assert_allclose(spread.quantiles, np.quantile(values, [0.05, 0.5, 0.95]), rtol=1e-9)


def test_decades_go_by_the_logarithm() -> None:
    """To first order in its logarithm a factor over decades makes a deviation of the value times that of the logarithm."""
    wide = GivenVariable(scale="steel.density", low=0.01, high=100.0, law="log-uniform")
    found = first_order(unknown(["mass"], [wide]), 0)
    np.testing.assert_allclose(found.deviations, found.value * math.log(1e4) / math.sqrt(12), rtol=1e-12)


def test_as_described_is_the_machine_itself() -> None:
    """Also where its numbers are outside of the ranges, or other choices than the one in the middle; a foreign one is none."""
    low = GivenVariable(of="link.length", low="100 mm", high="200 mm")
    chosen = ["25 mm", "19 mm"], ["22 mm", "17 mm"], ["19 mm", "14 mm"]
    tubes = GivenVariable(of=TUBE.of, name="tube", choices=[list(own) for own in chosen])
    for tube, place in ((tubes, 2), (GivenVariable(of=TUBE.of, name="tube", choices=tubes.choices[:2]), 0)):
        found = first_order(unknown(["mass"], [low, tube]), 0)
        np.testing.assert_array_equal(found.design, [0.216, place])
        assert [one.name for one in unknown(["mass"], [low, tube]).replaced(0)] == (["tube"] if place == 0 else [])
    study = unknown(["mass", "home frequency"], [low, tubes])
    alone = first_order(study, 0)
    assert alone.value[0] == pytest.approx(carried("azulay"), rel=1e-12)
    assert np.isfinite(alone.slope[:, 0]).all(), "differences are taken about the machine, wherever the range is"


def carried(name: str) -> float:
    """Mass (kg) of a machine as described."""
    plain = unknown(["mass"], [LENGTH], [name])
    return float(Evaluation(plain, 1)(np.array([[0.216]])).values[0, 0])


def test_slopes_are_those_of_best_rolls() -> None:
    """Against differences of values with rolls that are sought anew; a choice has none, a number of another machine is none."""
    other = GivenVariable(of="shoulder.stiffness", low="20000 N m/rad", high="30000 N m/rad")
    asked = unknown(["mean K_yy", "home K_rx", "home frequency", "reached"], [LENGTH, TUBE, other], ["azulay", "glozman"])
    found = first_order(asked, 0)
    single = asked.of(0).climbing()
    steps = found.design + np.array([[-2e-5], [2e-5], [0.0]]) * [1, 0, 0]
    values = Evaluation(single, 3)(steps).values
    np.testing.assert_allclose(found.value, values[2], rtol=1e-9)
    np.testing.assert_allclose(found.slope[:3, 0], np.diff(values[:2], axis=0)[0, :3] / 4e-5, rtol=1e-5)
    assert np.isnan(found.slope[:, 1]).all()
    np.testing.assert_array_equal(found.slope[:3, 2], 0)
    assert np.isnan(found.slope[3]).all(), "the share of poses that are reached goes by steps"
    np.testing.assert_allclose(found.shares[:3, 0], 1)


def test_orderings_are_counted() -> None:
    values = np.array([[3, 2, 1], [1, 2, 3], [3, 1, 2], [5, 5, 1], [3, np.nan, 1], [3, 2, 0.5]], dtype=float)
    first, second, third = pairs(values)
    assert (first.first, first.second, first.greater, first.equal) == (0, 1, Share(3, 5), 1)
    assert (second.greater, second.equal) == (Share(5, 6), 0)
    assert third.greater == Share(3, 5)
    assert [(own.places, own.share) for own in orders(values, [0, 1, 2])] == [
        ((0, 1, 2), Share(2, 5)), ((0, 2, 1), Share(1, 5)), ((2, 1, 0), Share(1, 5)),
    ]  # fmt: skip


def test_machines_without_a_quantity_are_in_no_order_of_it() -> None:
    values = np.array([[3, np.nan, 1], [1, np.nan, 2], [4, np.nan, 3]])
    assert [(own.places, own.share) for own in orders(values, [0, 2])] == [((0, 2), Share(2, 3)), ((2, 0), Share(1, 3))]
    assert orders(values, [0]) == []


def test_intervals_are_those_of_wilson() -> None:
    """The shares p with (p − k/n)² = z² p (1 − p)/n."""
    for count, samples in ((3, 10), (0, 40), (40, 40)):
        for end in Share(count, samples).interval:
            distance = samples * (end - count / samples) ** 2
            assert distance == pytest.approx(1.959963985**2 * end * (1 - end), abs=1e-8)
    assert math.isnan(Share(0, 0).value)
    assert math.isnan(Share(0, 0).interval[0])


def test_intervals_of_orders_hold_in_sobol_sequences() -> None:
    """Of what changes once over the ranges of variables; where it is far nearer than independent samples are."""
    held, squares = 0, 0.0
    for seed in range(100):
        drawing = Saltelli(64, 5, seed)
        points = drawing.points(0, drawing.count).reshape(64, 7, 5)[:, [0, -1]].reshape(-1, 5)
        share = Share(int((points.sum(axis=1) > 2.5).sum()), len(points))
        low, high = share.interval
        held += low <= 0.5 <= high
        squares += (share.value - 0.5) ** 2 / 100
    assert held >= 98
    assert squares < 0.6 * 0.25 / 128


def test_alone_and_together() -> None:
    """Of (x − ½)(y − ½) neither variable does anything alone."""
    points = Saltelli(512, 2).points(0, 2048).reshape(512, 4, 2) - 0.5
    found = indices(points.prod(axis=-1))
    np.testing.assert_allclose(found.first, 0, atol=0.1)
    np.testing.assert_allclose(found.total, 1, atol=0.1)


def test_samples_without_a_value() -> None:
    """They are left out and counted; where they are most there are no indices, and neither of what does not vary."""
    points = Saltelli(512, 2).points(0, 2048).reshape(512, 4, 2)
    values = points[..., 0] + 2 * points[..., 1]
    whole = indices(values)
    np.testing.assert_allclose(whole.first, [0.2, 0.8], atol=0.03)
    values[:100, 1] = np.nan
    some = indices(values)
    assert (some.left_out, some.base, some.has_values) == (100, 512, True)
    np.testing.assert_allclose(some.first, [0.2, 0.8], atol=0.06)
    values[:300, 2] = np.nan
    assert indices(values)[4:] == (300, 512)
    assert not indices(values).has_values
    assert not indices(np.full((512, 4), 0.3) * (1 + 1e-15 * points[..., 0])).has_values


def test_slopes_tell_how_far_they_are(tmp_path: Path) -> None:
    """Rolls and slopes by JAX, what is counted, then a study and a difference of the one variable that the machine has."""
    other = GivenVariable(of="shoulder.stiffness", low="20000 N m/rad", high="30000 N m/rad")
    told: list[Any] = []
    asked = unknown(["mean K_yy", "reached", "home frequency"], [LENGTH, other], ["azulay", "glozman"], count=8)
    found = sensitivity(
        asked, tmp_path / "a.zarr", progress=lambda done, total, remaining: told.append("samples"),
        first=lambda machine, done, total: told.append((machine, done, total)),
    )[0]  # fmt: skip
    first = [one for one in told if one != "samples"]
    assert told[-len(first) :] == first, "they come last, when the store is known to be of this study"
    assert first == [("azulay", done, 10) for done in range(6)] + [("glozman", done, 10) for done in range(5, 11)]
    assert len(found.first) == 2


def test_interrupted_runs_go_on(tmp_path: Path, masses: Uncertainty) -> None:
    asked = unknown(["mass"], [DENSITY, LONG], chunk=128)

    def stop(done: int, total: int, remaining: float | None) -> None:
        if done >= 384:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sensitivity(asked, tmp_path / "m.zarr", progress=stop)
    started: list[int] = []
    found, outcome = sensitivity(asked, tmp_path / "m.zarr", progress=lambda done, total, remaining: started.append(done))
    assert outcome.done == outcome.total == 8
    assert started[0] >= 384
    assert found.spreads == masses.spreads
    ours, theirs = (one.swept.results.column("mass", 0, 1024) for one in (found, masses))
    np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(found.indices[0].total, masses.indices[0].total)


def test_what_cannot_be_uncertain(tmp_path: Path) -> None:
    single = GivenVariable(of="link.length", choices=["200 mm"])
    assert "none of them varies" in message_of(lambda: sensitivity(unknown(["mass"], [single]), tmp_path / "a.zarr"))
    none = dataclasses.replace(unknown(["mass"], [LENGTH]), quantities=())
    assert "say what is asked of every design" in message_of(lambda: sensitivity(none, tmp_path / "b.zarr"))
    assert not list(tmp_path.iterdir())
    thick = GivenVariable(of="sections.tube.inner_diameter", low="5 mm", high="100 mm")
    with pytest.raises(NoResultError, match=r"of 32 samples \d+ at most have a quantity"):
        sensitivity(unknown(["mass"], [thick], count=16), tmp_path / "c.zarr")


STUDY: dict[str, Any] = {
    "machines": ["azulay@link.length=300 mm", "glozman"],
    "quantities": ["mass"],
    "variables": [
        {"of": "steel.density", "law": "normal", "deviation": "50 kg/m^3"},
        {"of": "link.length", "name": "links", "low": "150 mm", "high": "350 mm"},
        {
            "of": ["sections.tube.outer_diameter", "sections.tube.inner_diameter"],
            "name": "tube",
            "choices": [["19 mm", "14 mm"], ["25 mm", "19 mm"]],
        },
    ],
    "sensitivity": {"count": 16},
}


def test_the_command(trivet: Any, tmp_path: Path) -> None:
    (tmp_path / "masses.toml").write_text(tomli_w.dumps(STUDY), encoding="utf-8")
    code, out, err = trivet("sensitivity", "masses.toml", "--figure", "m.png", "--figure", "m.html")
    assert (code, err.count("wrote")) == (0, 3)
    assert "azulay, glozman: 16 base samples, 80 designs, 80 worked out" in out
    assert "normal, deviation 50 kg/m³ about 7870 kg/m³" in out
    assert "to first order there is nothing of choices: tube" in out
    assert "its own is none of the choices" not in out
    assert (tmp_path / "m.png").stat().st_size > 10_000
    bars = [trace["y"] for trace in traces(tmp_path / "m.html")]
    assert ["azulay &gt; glozman"] in bars
    code, out, _ = trivet("sensitivity", "masses.toml", "--json")
    found = json.loads(out)
    assert (code, found["samples"], found["chunks"]["done"]) == (0, 32, found["chunks"]["of"])
    assert [own["name"] for own in found["variables"]] == ["steel.density", "links", "tube"]
    assert found["as_described"][0]["links_m"] == 0.3
    first, second = found["quantities"]
    assert (first["machine"], second["machine"]) == ("azulay@link.length=300 mm", "glozman")
    assert first["first_order"]["elasticities"]["steel.density"] == pytest.approx(1)
    assert first["first_order"]["slopes_SI"]["tube"] is None
    assert second["first_order"]["slopes_SI"]["links"] is None
    assert first["quantile_05_kg"] < first["mean_kg"] < first["quantile_95_kg"]
    (pair,) = found["pairs"]
    assert pair["count"] == sum(own["count"] for own in found["orders"] if own["order"][0] == first["machine"])
    assert pair["samples"] == 32


def test_commands_that_fail(trivet: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(tomli_w.dumps(STUDY | {"quantities": ["mas"]}), encoding="utf-8")
    code, out, err = trivet("sensitivity", "a.toml")
    assert (code, out) == (2, "")
    assert "did you mean 'mass'" in err
    (tmp_path / "b.toml").write_text(tomli_w.dumps(STUDY | {"sensitivity": {"count": 4}}), encoding="utf-8")
    code, _, err = trivet("sensitivity", "b.toml")
    assert code == 2
    assert "sensitivity.count" in err
    (tmp_path / "c.toml").write_text(tomli_w.dumps(STUDY | {"machines": ["azulay"]}), encoding="utf-8")
    code, out, _ = trivet("sensitivity", "c.toml", "--json", "--store", "c")
    assert (code, json.loads(out)["pairs"], json.loads(out)["orders"]) == (0, [], []), "a single machine has no orderings"
