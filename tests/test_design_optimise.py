"""Machines optimised: optima in closed form, runs that go on, fronts looked at again, the command."""

from __future__ import annotations

import json
import math
import os
import re
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from made_designs import LENGTH, OUTER, seeking

from trivet.design import optimisation, writing
from trivet.design.aims import aims_of
from trivet.design.evaluation import Evaluation
from trivet.design.front.archive import is_best
from trivet.design.machine_problem import MachineProblem
from trivet.design.memo import kept
from trivet.design.optimisation import Member, Optimisation, optimise
from trivet.design.study_file import GivenAims, GivenLimit, GivenVariable
from trivet.design.writing import write_machines
from trivet.errors import InputError, NoResultError
from trivet.model import Machine, load


def hexapod() -> tuple[Machine, float]:
    """A hexapod of struts alone: rigid drives, free balls; and the horizontal distance of a strut's ends at home (m)."""
    machine = load("gough-stewart").with_rigid_drives().with_spherical("free")
    leg = machine.legs[0]
    ends = [np.array(frame.origin, dtype=float) for frame in (leg.base_frame(), leg.platform_frame())]
    return machine, float(np.hypot(*(ends[1] - ends[0])[:2]))


def axial(machine: Machine, outer: float, height: float, across: float) -> float:
    """K_zz of six struts under a level platform: 6 EA h^2 / L^3."""
    tube, steel = machine.sections["tube"], machine.materials["steel"]
    area = math.pi / 4 * (outer**2 - float(tube.inner_diameter) ** 2)
    return 6 * float(steel.youngs_modulus) * area * height**2 / math.hypot(height, across) ** 3


def test_the_best_height_of_a_hexapod_is_the_root_of_two_times_what_its_struts_go_across() -> None:
    machine, across = hexapod()
    best = math.sqrt(2) * across
    height = GivenVariable(of="home.position.3", low=f"{0.8 * best!r} m", high=f"{1.2 * best!r} m")
    found = optimise(seeking([height], GivenAims(maximise=["home K_zz"], evaluations=64, population=16), machine))
    (member,) = found.members
    assert member.design[0] == pytest.approx(best, rel=1e-6)
    outer = float(machine.sections["tube"].outer_diameter)
    assert member.values[0] == pytest.approx(axial(machine, outer, best, across), rel=1e-9)


def test_the_lightest_hexapod_of_a_stiffness_stands_at_that_height() -> None:
    machine, across = hexapod()
    best, outer = math.sqrt(2) * across, float(machine.sections["tube"].outer_diameter)
    height = GivenVariable(of="home.position.3", low=f"{0.8 * best!r} m", high=f"{1.25 * best!r} m")
    tube = GivenVariable(of="sections.tube.outer_diameter", low=f"{0.9 * outer!r} m", high=f"{2 * outer!r} m")
    wanted = axial(machine, 1.3 * outer, best, across)
    aims = GivenAims(
        minimise=["mass"], limits=[GivenLimit(quantity="home K_zz", at_least=f"{wanted!r} N/m")], evaluations=128, population=16
    )
    found = optimise(seeking([height, tube], aims, machine))
    (member,) = found.members
    assert member.design == pytest.approx([best, 1.3 * outer], rel=1e-6)
    assert [word.split(" at ")[0] for word in member.active] == ["home K_zz"]


def test_machines_are_searched_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(problem: MachineProblem, evolution: Any, polishing: Any, memo: Any, *others: Any) -> Any:
        known = sorted(memo)
        memo.update({b"design": np.array([problem.place])})
        raise NoResultError(f"knows {known}")

    monkeypatch.setattr(optimisation, "searched", searched)
    with pytest.raises(NoResultError, match=r"azulay: knows \[\]; eclipse: knows \[\]"):
        optimise(seeking([LENGTH], FRONT, load("azulay"), load("eclipse")))


FRONT = GivenAims(maximise=["mean K_xx"], minimise=["mass"], evaluations=96, population=16)


def test_a_front_of_machines_is_told_with_all_that_there_is_to_say() -> None:
    steps: list[tuple[str, str, int, int | None]] = []
    study = seeking([LENGTH, OUTER], FRONT, load("azulay"), load("eclipse"))
    found = optimise(study, points=6, progress=lambda machine, stage, done, of, _: steps.append((machine, stage, done, of)))
    own = {name: sum(study.names[one.place] == name for one in found.members) for name in study.names}
    stages = [stage for stage, _ in groupby(steps, key=lambda step: step[:2])]
    assert [stage for stage in stages if stage[1] not in ("evolution", "coarse polish", "polish")] == [
        *((name, "all quantities") for _ in ("front", "alternatives") for name in study.names),
        *((name, "check") for name, count in own.items() if count),
    ]
    assert all(next(done for *stage, done, _ in steps if tuple(stage) == one) == 0 for one in stages)
    assert [step for step in steps if step[1] == "check"] == [
        (name, "check", done, count) for name, count in own.items() if count for done in range(count + 1)
    ]
    objectives = found.objectives(found.members)
    assert is_best(objectives).all()
    assert np.all(np.diff(objectives[:, 0]) >= 0)
    assert {member.place for member in (*found.members, *found.alternatives)} == {0, 1}
    for member in found.members:
        assert member.structural < 1e-9
        assert member.again[found.columns.index("mass")] == pytest.approx(member.values[found.columns.index("mass")], rel=1e-12)
    assert found.machine(found.members[0]).name == found.study.names[found.members[0].place]


def test_a_machine_file_of_a_design_tells_where_its_numbers_come_from(tmp_path: Path) -> None:
    study = seeking([LENGTH, OUTER], FRONT)
    asked, aims = aims_of(study)
    member = Member(0, study.described_of(0), np.ones(len(asked.quantities)), True, (), (), np.zeros(0), np.nan)
    (path,) = write_machines(Optimisation(asked, aims, (member,), (), ()), tmp_path)
    notes = {note.path.rpartition("elements.")[2]: note for note in load(path).about.notes}
    assert notes["link.length"].source == "found by optimisation"
    assert notes["workpiece.height"].status == "fitted"


def test_a_run_that_was_killed_goes_on_to_the_same_front(tmp_path: Path) -> None:
    study = seeking([LENGTH, OUTER], FRONT)
    whole = optimise(study, store=tmp_path / "whole", points=6)
    data = (tmp_path / "whole").read_bytes()
    damaged: list[int] = []
    for k, cut in enumerate((len(data) // 3, len(data) - 5, 10)):
        path = tmp_path / f"cut-{k}"
        path.write_bytes(data[:cut] if k < 2 else data[: len(data) // 2] + b"x" + data[len(data) // 2 + 1 :])
        again = optimise(study, store=path, points=6, damaged=damaged.append)
        assert [m.design.tolist() for m in again.members] == [m.design.tolist() for m in whole.members]
        assert len(path.read_bytes()) == len(data)
        assert path.read_bytes() == data or k == 2  # what was worked out again is at the end
    assert len(damaged) == 3
    assert damaged[2] < len(data) / 10


def test_a_finished_run_is_told_again_without_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = seeking([LENGTH, OUTER], FRONT)
    whole = optimise(study, store=tmp_path / "whole", points=6)

    def work(*_: Any) -> Any:
        raise AssertionError("worked out again")

    for owner, name in ((optimisation, "checked"), (MachineProblem, "model"), (Evaluation, "__call__")):
        monkeypatch.setattr(owner, name, work)
    again = optimise(study, store=tmp_path / "whole", points=6)
    for one, other in zip(whole.members, again.members, strict=True):
        assert (one.active, one.bounds, one.structural) == (other.active, other.bounds, other.structural)
        assert np.array_equal(one.values, other.values)
        assert np.array_equal(one.again, other.again)


def test_files_of_other_studies_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "known"
    with kept(path, "one", lambda cut: None) as memo:
        memo[b"a"] = np.arange(3.0)
    with kept(path, "one", lambda cut: None) as memo:
        assert memo[b"a"].tolist() == [0, 1, 2]
        memo[b"b"] = np.ones((2, 3))
    with kept(path, "one", lambda cut: None) as memo:
        assert memo[b"b"].shape == (2, 3)
        with pytest.raises(InputError, match="another process"), kept(path, "one", lambda cut: None):
            pass
    with pytest.raises(InputError, match="of another study"), kept(path, "two", lambda cut: None):
        pass
    (tmp_path / "notes.txt").write_text("do not lose this")
    with pytest.raises(InputError, match="no file of an optimisation"), kept(tmp_path / "notes.txt", "one", lambda cut: None):
        pass
    assert (tmp_path / "notes.txt").read_text() == "do not lose this"


def test_a_flipped_byte_costs_one_record_at_most_and_nothing_of_another_study(tmp_path: Path) -> None:
    path = tmp_path / "known"
    own = {bytes([65 + k]) * (k + 1): np.arange(6.0 * k).reshape(k, 6) for k in range(4)}
    with kept(path, "one") as memo:
        memo.update(own)
    data = path.read_bytes()
    for place in range(len(data)):
        altered = data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :]
        path.write_bytes(altered)
        with pytest.raises(InputError, match=r"of another study|nothing tells that it is of this"), kept(path, "two"):
            pass
        assert path.read_bytes() == altered
        cut: list[int] = []
        with kept(path, "one", cut.append) as memo:
            assert len(memo) >= len(own) - 1
            assert all(np.array_equal(memo[key], own[key]) for key in memo)
            memo.update({key: values for key, values in own.items() if key not in memo})
        assert len(cut) == 1
        with kept(path, "one", cut.append) as memo:
            assert set(memo) == set(own)
        assert len(cut) == 1
        assert len(path.read_bytes()) == len(data)


def test_a_memo_is_a_regular_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/null")):
        with pytest.raises(InputError, match="is not a regular file"), kept(path, "one"):
            pass
    with pytest.raises(InputError, match="is a folder, as a sweep makes"), kept(tmp_path, "one"):
        pass


def test_fronts_without_points_or_time_are_refused() -> None:
    for points, seconds in ((1, 1.0), (2, 0.0), (2, math.nan)):
        with pytest.raises(InputError, match=f"points: {points}, seconds: {seconds}"):
            optimise(seeking([LENGTH], FRONT), points=points, seconds=seconds)


def test_limits_that_no_design_meets_are_named() -> None:
    aims = GivenAims(
        minimise=["mass"], limits=[GivenLimit(quantity="home K_zz", at_least="900 N/um")], evaluations=32, population=8
    )
    study = seeking([LENGTH], aims)
    with pytest.raises(NoResultError, match=r"misses 'home K_zz at least 900 N/µm', at [0-9.]+ N/µm, with") as told:
        optimise(study)
    asked, _ = aims_of(study)
    ends = Evaluation(asked.of(0).climbing())(np.array([[0.205], [0.225]])).values[
        :, [own.name for own in asked.quantities].index("home K_zz")
    ]
    assert float(re.search(r"at ([0-9.]+) N/µm", str(told.value))[1]) * 1e6 == pytest.approx(ends.max(), rel=1e-3)


def test_a_machine_that_can_have_no_such_number_is_told_and_left_out() -> None:
    """Glozman's drives all turn; what is sought and what limits are of count alike."""
    density = GivenVariable(scale="steel.density", name="density", low=0.5, high=1.5)
    aims = GivenAims(
        minimise=["mass"], limits=[GivenLimit(quantity="home drive force", at_most="900 N")], evaluations=8, population=4
    )
    found = optimise(seeking([density], aims, load("azulay"), load("glozman")))
    assert {member.place for member in (*found.members, *found.alternatives)} == {0}
    assert found.missing == ("glozman: has no home drive force: no drive of it slides",)


def test_the_command(trivet: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    document = {
        "machines": ["azulay"],
        "poses": {"steps": 2, "rolls": 36},
        "optimise": {"maximise": ["mean K_xx"], "minimise": ["mass"], "evaluations": 48, "population": 16},
        "variables": [
            {"of": "link.length", "low": "205 mm", "high": "225 mm"},
            {"of": "sections.tube.outer_diameter", "low": "18 mm", "high": "25 mm"},
        ],
    }
    Path("study.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    code, out, err = trivet("optimise", "study.toml", "--json", "--points", "4", "--machines", "best")
    assert code == 0, err
    found = json.loads(out)
    assert len(found["front"]) == len(list(Path("best").iterdir()))
    for path, member in zip(sorted(Path("best").iterdir()), found["front"], strict=True):
        machine = load(path)
        assert machine.chains["leg"].elements[3].length == pytest.approx(member["design"]["link.length_m"], rel=1e-12)
    code, _, err = trivet("optimise", "study.toml", "--points", "4", "--machines", "best")
    assert code == 2
    assert "is not empty" in err

    def full(*_: Any, **__: Any) -> Any:
        raise InputError("there: cannot be written: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(writing, "write", full)
        code, again, err = trivet("optimise", "study.toml", "--json", "--points", "4", "--machines", "there")
    assert (code, err) == (2, "trivet: there: cannot be written: No space left on device\n")
    assert again == out  # it costs no numbers
    Path("file").write_text("")
    for folder, said in (("file/best", "file is not a folder"), ("locked/a/best", "no permission in .*locked")):
        Path("locked").mkdir(exist_ok=True)
        with monkeypatch.context() as patch:
            patch.setattr(os, "access", lambda path, mode: not str(path).endswith("locked"))
            code, out, err = trivet("optimise", "study.toml", "--machines", folder)
        assert code == 2
        assert re.search(said, err)
