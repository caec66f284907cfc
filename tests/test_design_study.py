"""Study files: what is read, what is refused and with which words, and what a worker on another machine makes of a study."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from documents import message_of
from scipy.stats import kstest

from trivet.design.aims import aims_of
from trivet.design.evaluation import Evaluation
from trivet.design.laws import Choices, Law, LogUniform, Normal, Uniform
from trivet.design.sampling import Sobol
from trivet.design.study import Study, read_study, unpacked
from trivet.design.sweep import SweepTask, check, chunk_of, drawn, layout_of, sampling_of
from trivet.model import load, to_text

LENGTH = {"of": "link.length", "low": "205 mm", "high": "225 mm"}
WHOLE: dict[str, Any] = {
    "machines": ["azulay"],
    "quantities": ["mean K_xx", "mass"],
    "variables": [LENGTH],
    "sweep": {"count": 100},
}


def study(tmp_path: Path, needing: Any = lambda study: None, **changes: Any) -> Study:
    """A study file with some tables changed, read."""
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(WHOLE | changes), encoding="utf-8")
    return read_study(path, needing)


def refused(tmp_path: Path, **changes: Any) -> str:
    """What is said of it."""

    def whole() -> None:
        study(tmp_path, **changes, needing=aims_of if "optimise" in changes else check)

    told = message_of(whole)
    assert told.startswith(f"{tmp_path / 'study.toml'}: ")
    return told


VARIABLE = {
    "an empty range": ({**LENGTH, "low": "225 mm"}, "runs from 225 mm to 225 mm; low must be below high"),
    "a range upside down": ({**LENGTH, "low": "1 m"}, "low must be below high"),
    "no range": ({"of": "link.length", "low": "1 mm"}, "needs low and high, or choices"),
    "no unit": ({**LENGTH, "low": 0.2}, "variables.1.low: \"0.2\": the unit is missing"),
    "another unit": ({**LENGTH, "low": "2 kg"}, "'kg' is not a unit of length"),
    "below zero": ({**LENGTH, "low": "-2 mm"}, "must be greater than zero"),
    "an unknown number": ({**LENGTH, "of": "lnk.length"}, "did you mean 'link.length'"),
    "a word": ({**LENGTH, "of": "link.section"}, "is no number of this machine"),
    "a table": ({**LENGTH, "of": "link"}, "link: is no number but holds some; name one of link.length"),
    "a key that nothing has": ({**LENGTH, "of": "links"}, "links: no such key in this machine; "),
    "neither": ({"low": "1 mm", "high": "2 mm"}, "give either of"),
    "both": ({**LENGTH, "scale": "link.length"}, "give either of"),
    "an unknown key": ({**LENGTH, "hihg": "1 mm"}, "did you mean 'high'"),
    "an unknown law": ({**LENGTH, "law": "gauss"}, "law"),
    "a logarithm of zero": ({"of": "home.position.1", "low": "0 mm", "high": "1 mm", "law": "log-uniform"}, "above zero"),
    "a normal one with ends": ({**LENGTH, "law": "normal", "deviation": "1 mm"}, "give deviation, no low or high"),
    "a normal one without width": ({"of": "link.length", "law": "normal"}, "give deviation"),
    "a deviation alone": ({**LENGTH, "deviation": "1 mm"}, 'goes with law = "normal"'),
    "unlike kinds": ({**LENGTH, "of": ["link.length", "guide.stiffness"]}, "are of unlike kinds"),
    "no such choice": ({"of": "link.length", "choices": ["200 mm", "two"]}, "two"),
    "one choice twice": ({"of": "link.length", "choices": ["200 mm", "0.2 m"]}, "the same choice is given twice"),
    "choices of another width": (
        {"of": ["link.length", "guide.radius"], "choices": [["1 mm", "2 mm", "3 mm"]]},
        "variables.1.choices.1: [1 mm, 2 mm, 3 mm]: 3 given, 2 needed",
    ),
    "a choice that lacks a value": (
        {"of": ["link.length", "guide.radius"], "name": "size", "choices": [["1 mm", "2 mm"], ["3 mm"]]},
        "variables.size.choices.2: [3 mm]: 1 given, 2 needed; a value that all are to have stands without brackets",
    ),
    "more factors than one": (
        {"scale": ["link.length", "guide.radius"], "choices": [[0.9, 1.1]]},
        "variables.1.choices.1: [0.9, 1.1]: 2 given, 1 needed",
    ),
    "choices and a range": ({**LENGTH, "choices": ["200 mm"]}, "go without"),
}  # fmt: skip


@pytest.mark.parametrize("case", VARIABLE)
def test_variables_that_cannot_be(case: str, tmp_path: Path) -> None:
    variable, words = VARIABLE[case]
    assert words in refused(tmp_path, variables=[variable])


FILES: dict[str, tuple[dict[str, Any], str]] = {
    "an unknown machine": ({"machines": ["azulai"]}, "did you mean 'azulay'"),
    "a machine twice": ({"machines": ["azulay", "azulay"]}, "azulay is given twice"),
    "a number twice": ({"variables": [LENGTH, {**LENGTH, "name": "other"}]}, "'link.length' and 'other' set the same number"),
    "a name twice": ({"variables": [LENGTH, LENGTH]}, "two are called 'link.length'"),
    "a name of a quantity": ({"variables": [{**LENGTH, "name": "mean K_xx"}]}, "'mean K_xx' is the name of a quantity"),
    "a name that cannot be shown": ({"variables": [{**LENGTH, "name": "a\x1b[31m"}]}, "must be letters that can be read"),
    "a blank name": ({"variables": [{**LENGTH, "name": " "}]}, "variables.1.name"),
    "no variables": ({"variables": []}, "variables"),
    "an unknown quantity": ({"quantities": ["mean K_xy"]}, "or 'mean K_xx'?"),
    "no quantity": ({"quantities": []}, "say what is asked of every design"),
    "a quantity that it lacks": ({"machines": ["glozman"], "quantities": ["least drive force"], "variables": [
        {"of": "link-1.length", "low": "1 mm", "high": "2 mm"}]}, "no drive of it slides"),
    "a count of a grid": ({"sweep": {"method": "grid", "count": 3}}, "follows from the steps"),
    "a grid without steps": ({"sweep": {"method": "grid"}}, "variables.link.length: needs steps"),
    "no count": ({"sweep": {}}, "sweep.count: missing"),
    "too many": ({"sweep": {"count": 10**12}}, "sweep.count"),
    "an unknown objective": ({"poses": {"objective": "Kxx"}}, "objective 'Kxx' is not known"),
    "an unknown mode": ({"poses": {"mode": "++ ++"}}, "mode"),
    "another format": ({"format": 2}, "format"),
    "nothing sought": ({"optimise": {"limits": []}}, "optimise: seeks nothing"),
    "something unknown sought": ({"optimise": {"minimise": ["masss"]}}, "optimise.minimise: 'masss' is no quantity"),
    "a limit on something unknown": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "masss", "at_least": 1}]}},
        "optimise.limits: 'masss' is no quantity that is known; did you mean 'mass'"),
    "a share that is sought": ({"optimise": {"maximise": ["reached"]}}, "'reached' is a share of the check points"),
    "a share at most": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "reached", "at_most": 0.5}]}},
        "of this only at_least can be asked"),
    "a quantity like no other": ({"quantities": ["weight"]}, "known are mass, reached"),
    "sought twice": ({"optimise": {"maximise": ["mass"], "minimise": ["mass"]}}, "'mass' is sought twice"),
    "limits that exclude each other": ({"optimise": {"minimise": ["mass"], "limits": [
        {"quantity": "mean K_xx", "at_least": "5 N/um"}, {"quantity": "mean K_xx", "at_most": "4 N/um"}]}},
        "mean K_xx at least 5 N/µm, yet mean K_xx at most 4 N/µm: no design can be both"),
    "a limit without a bound": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "mass"}]}}, "has no bound"),
    "a limit of another unit": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "mass", "at_most": "5 N"}]}},
        "'N' is not a unit of mass"),
    "more than all points": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "reached", "at_least": 1.5}]}},
        "it is a share, 1 at most"),
    "fewer than no points": ({"optimise": {"minimise": ["mass"], "limits": [{"quantity": "reached", "at_most": -0.5}]}},
        "reached at most -0.5; of this only at_least can be asked"),
}  # fmt: skip


@pytest.mark.parametrize("case", FILES)
def test_studies_that_cannot_be(case: str, tmp_path: Path) -> None:
    changes, words = FILES[case]
    assert words in refused(tmp_path, **changes)


def test_files_lie_beside_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "below"
    folder.mkdir()
    (folder / "own.toml").write_text(to_text(load("azulay").renamed("own")), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (folder / "study.toml").write_text(tomli_w.dumps(WHOLE | {"machines": ["own.toml"]}), encoding="utf-8")
    assert read_study("below/study.toml").names == ["own"]


def test_files_beside_the_study_take_settings(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(to_text(load("azulay").renamed("own")), encoding="utf-8")
    (machine,) = study(tmp_path, machines=["own.toml@link.length=211 mm"]).machines
    assert machine.chains["leg"].elements[3].length == pytest.approx(0.211, rel=1e-15)


def test_check_points_need_a_hemisphere(tmp_path: Path) -> None:
    bare = replace(load("azulay"), workpiece=None)
    (tmp_path / "own.toml").write_text(to_text(bare.renamed("own")), encoding="utf-8")
    assert "own: has no [workpiece]" in refused(tmp_path, machines=["own.toml"])
    assert study(tmp_path, machines=["own.toml"], quantities=["mass", "home K_xx"]).names == ["own"]
    placed = {"radius": "5 mm", "height": "160 mm"}
    assert study(tmp_path, machines=["own.toml"], poses=placed).names == ["own"]


def test_factors_multiply_what_other_variables_set(tmp_path: Path) -> None:
    size = {"scale": ["link.length", "guide.radius"], "choices": [0.9, 1.1], "name": "size"}
    made = study(tmp_path, variables=[size, LENGTH]).machine(0, [1, 0.21])
    guide, own = made.chains["leg"].elements[0], load("azulay").chains["leg"].elements[0]
    assert made.chains["leg"].elements[3].length == pytest.approx(1.1 * 0.21, rel=1e-15)
    assert guide.radius == pytest.approx(1.1 * float(own.radius), rel=1e-15)


def test_a_choice_without_brackets_is_of_all_dimensions(tmp_path: Path) -> None:
    both = {"of": ["link.length", "guide.radius"], "choices": ["150 mm", ["200 mm", "160 mm"]]}
    assert study(tmp_path, variables=[both]).variables[0].choices == ((0.15, 0.15), (0.2, 0.16))


def test_a_machine_as_described_is_a_design_wherever_ranges_are(tmp_path: Path) -> None:
    own = float(load("azulay").chains["leg"].elements[3].length)
    higher = {**LENGTH, "low": f"{own + 0.01!r} m", "high": f"{own + 0.02!r} m"}
    size = {"scale": "guide.radius", "low": 0.8, "high": 1.3}
    tube = {"of": "sections.tube.outer_diameter", "choices": ["18 mm", "19 mm", "20 mm"]}
    assert study(tmp_path, variables=[LENGTH, size, tube]).described_of(0) == pytest.approx([own, 1, 1], rel=1e-15)
    assert study(tmp_path, variables=[higher, size, tube]).described_of(0) == pytest.approx([own, 1, 1], rel=1e-15)


def test_the_study_of_one_machine_has_its_designs(tmp_path: Path) -> None:
    joint = {"of": "platform_joint.radius", "low": "16 mm", "high": "20 mm"}
    made = study(tmp_path, machines=["glozman", "azulay"], variables=[joint, LENGTH])
    for place in (0, 1):
        assert made.of(place).machine(0, [0.017, 0.21]) == made.machine(place, [0.017, 0.21])
    assert made.of(1).machine(0, [0.017, 0.21]).chains["leg"].elements[3].length == 0.21


def test_a_sweep_is_a_sobol_sequence_unless_told_otherwise(tmp_path: Path) -> None:
    assert sampling_of(study(tmp_path)) == Sobol(100, 1, 0)


def test_a_worker_makes_the_same_study_of_its_text(tmp_path: Path) -> None:
    made = study(
        tmp_path,
        machines=["azulay@ball.rotation=free", "eclipse"],
        variables=[LENGTH, {"scale": ["guide.radius"], "low": 0.8, "high": 1.1, "name": "size"}],
        load={"force": ["10 N", "0 N", "0 N"]},
    )
    again = unpacked(made.packed)
    assert again.packed == made.packed
    assert again.fingerprint() == made.fingerprint()
    assert again.names == ["azulay@ball.rotation=free", "eclipse"]
    task = SweepTask(made.packed, sampling_of(made), 16)
    assert np.array_equal(drawn(made, task.sampling, 3, 9), drawn(again, task.sampling, 0, 100)[3:9])


def test_what_decides_results_makes_another_store(tmp_path: Path) -> None:
    def fingerprint(**changes: Any) -> str:
        made = study(tmp_path, **changes)
        drawing = sampling_of(made)
        return layout_of(made, drawing, chunk_of(made, drawing.count)).fingerprint

    first = fingerprint()
    assert fingerprint(optimise={"minimise": ["mass"]}) == first
    others = [
        {"sweep": {"count": 100, "seed": 1}}, {"sweep": {"count": 101}}, {"poses": {"steps": 4}}, {"quantities": ["mass"]},
        {"machines": ["azulay-196"]}, {"variables": [{**LENGTH, "low": "206 mm"}]}, {"load": {"gravity": ["0 m/s^2"] * 3}},
    ]  # fmt: skip
    assert len({fingerprint(**change) for change in others} | {first}) == len(others) + 1


@pytest.mark.parametrize(
    ("quantity", "count", "chunk"),
    [
        ("mean K_xx", 20, 4), ("mean K_xx", 200, 8), ("mean K_xx", 5000, 128), ("mean K_xx", 100_000, 1024),
        ("mean K_xx", 10_000_000, 1024), ("home frequency", 200, 4), ("home K_xx", 200, 65_536), ("home K_xx", 10**7, 65_536),
    ],
)  # fmt: skip
def test_a_sweep_has_chunks_to_keep_where_they_are_worth_their_writing(
    tmp_path: Path, quantity: str, count: int, chunk: int
) -> None:
    made = study(tmp_path, quantities=[quantity], poses={"steps": 10, "rolls": 360})
    assert chunk_of(made, count) == chunk


def test_values_do_not_depend_on_chunks(tmp_path: Path) -> None:
    made = study(tmp_path, quantities=["mean K_xx"], poses={"steps": 10, "rolls": 360}, sweep={"count": 64})
    small, large = (SweepTask(made.packed, sampling_of(made), chunk).prepared() for chunk in (4, 128))
    parts, whole = [small(k) for k in range(16)], large(0)
    assert np.array_equal(np.concatenate([own.columns for own in parts], axis=1), whole.columns)
    assert np.array_equal(np.concatenate([own.status for own in parts]), whole.status)


def test_a_small_chunk_is_not_filled_up_to_a_great_call(tmp_path: Path) -> None:
    made = study(tmp_path, quantities=["mean K_xx"], poses={"steps": 10, "rolls": 360})
    usual = Evaluation(made)
    assert Evaluation(made, most=2).piece == min(2 * usual.tile, usual.piece)
    assert Evaluation(made, most=1000).piece == usual.piece


def test_an_optimisation_knows_its_study_by_what_decides_results(tmp_path: Path) -> None:
    first = study(tmp_path).fingerprint()
    assert study(tmp_path, sweep={"count": 3}).fingerprint() == first
    others = [
        {"poses": {"steps": 4}}, {"quantities": ["mass"]}, {"machines": ["azulay-196"]}, {"load": {"gravity": ["0 m/s^2"] * 3}},
        {"variables": [{**LENGTH, "low": "206 mm"}]},
    ]  # fmt: skip
    found = {study(tmp_path, **change).fingerprint() for change in others} | {first, study(tmp_path).fingerprint("more")}
    assert len(found) == len(others) + 2


@pytest.mark.parametrize("law", [Uniform(2.0, 5.0), LogUniform(0.1, 30.0), Normal(3.0, 0.5)])
def test_laws_are_what_they_say(law: Law) -> None:
    values = law.values((np.arange(20_001) + 0.5) / 20_001)
    assert np.all(np.diff(values) > 0)
    assert np.median(values) == pytest.approx(law.middle, rel=1e-3)
    assert values.std() == pytest.approx(law.deviation, rel=2e-3)
    assert law.low <= values.min() < values.max() <= law.high
    uniform = {Uniform: lambda v: (v - 2) / 3, LogUniform: lambda v: np.log(v / 0.1) / np.log(300)}.get(type(law))
    if uniform is not None:
        assert kstest(uniform(values), "uniform").statistic < 1e-3


def test_a_variable_has_the_law_that_it_is_given(tmp_path: Path) -> None:
    own, unbounded = float(load("azulay").chains["leg"].elements[3].length), {"of": "link.length", "law": "normal"}
    given = [LENGTH, {**LENGTH, "law": "log-uniform"}, {**unbounded, "deviation": "2 mm"}]
    laws = [study(tmp_path, variables=[one]).variables[0].law for one in given]
    assert laws == [Uniform(0.205, 0.225), LogUniform(0.205, 0.225), Normal(own, 0.002)]
    factor = {"scale": "link.length", "law": "normal", "deviation": 0.1}
    assert study(tmp_path, variables=[factor]).variables[0].law == Normal(1.0, 0.1)


def test_choices_are_equally_likely() -> None:
    values = Choices(3).values(np.linspace(0, 1, 3001))
    assert sorted(set(values)) == [0, 1, 2]
    assert np.all(np.abs(np.bincount(values.astype(int)) - 1000) <= 1)


def test_the_sweep_command_says_what_it_did(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    small = {"poses": {"steps": 1, "rolls": 12}, "sweep": {"method": "grid"}, "variables": [{**LENGTH, "steps": 3}]}
    study(tmp_path, **small)
    code, out, err = trivet("sweep", "study.toml", "--json")
    assert code == 0, err
    found = json.loads(out)
    assert found["designs"] == 3
    assert found["statuses"] == {"worked out": 3}
    assert found["quantities"][1]["greatest_at"]["link.length_m"] == 0.225
    before = {path: path.read_bytes() for path in (tmp_path / "study.zarr").rglob("*") if path.is_file()}
    code, out, err = trivet("sweep", "study.toml")
    assert code == 0, err
    assert "3 designs, 3 worked out" in out
    assert before == {path: path.read_bytes() for path in (tmp_path / "study.zarr").rglob("*") if path.is_file()}
    study(tmp_path, **small, quantities=["mass"])
    code, out, err = trivet("sweep", "study.toml")
    assert code == 2
    assert "quantities" in err
    assert "Traceback" not in err


def test_a_store_is_read_by_anyone(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    xarray = pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    study(tmp_path, poses={"steps": 1, "rolls": 12}, sweep={"count": 5})
    assert trivet("sweep", "study.toml", "--json")[0] == 0
    data = xarray.open_zarr("study.zarr", consolidated=False)
    assert data["mean K_xx"].attrs["units"] == "N/m"
    assert data["link.length"].attrs["units"] == "m"
    assert bool((data["status"] == 1).all())
