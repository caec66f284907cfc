"""Tables and JSON of sweeps, fronts and unknowns: readable in narrow terminals, silent on what a machine does not have."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from made_designs import member, optimised, study, swept
from rich.console import Console

from trivet.design.engine import Outcome
from trivet.design.front.front import Bound
from trivet.design.optimisation import Optimisation, _ends
from trivet.design.study import PARTLY, WORKED_OUT
from trivet.design.study_file import GivenLimit, GivenVariable
from trivet.model import load
from trivet.views import optimisation, sweep
from trivet.views.fitted import Fitted
from trivet.views.layout import table

STIFF, LIGHT = "mean K_xx", "mass"
LINK = GivenVariable(scale=["link.length"], name="link", low=0.5, high=1.5)
SECOND = GivenVariable(scale=["link-2.length"], name="link-2", low=0.5, high=1.5)
TUBE = GivenVariable(of="link-2.length", name="tube", choices=["100 mm", "120 mm"])
MANY = [GivenVariable(scale=["steel.density"], name=f"factor-{k}", low=0.5, high=1.5) for k in range(12)]


def shown(parts: Iterable[Any], width: int) -> list[str]:
    """The lines of a terminal."""
    console = Console(width=width, file=io.StringIO(), highlight=False)
    for part in parts:
        console.print(part)
    assert isinstance(console.file, io.StringIO)
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def front(*variables: GivenVariable, count: int = 4) -> Optimisation:
    """Designs of azulay and glozman in turn; the values of their variables are 0.601, 0.602 and so on."""
    asked = study((), variables, [load("azulay"), load("glozman")], maximise=[STIFF], minimise=[LIGHT, "greatest outer radius"])
    members = []
    for k in range(count):
        design = [float(j % 2) if one.choices else 0.601 + 0.001 * j for j, one in enumerate(variables)]
        values = [1e6 * (9 - k), 2.5 - k / 10, 0.2, 1.0]
        members.append(member(k % 2, design, values, again=np.array(values), active=("reached at least 1",), structural=1e-12))
    return optimised(asked, members)


def test_a_front_is_silent_on_variables_that_its_machines_lack() -> None:
    result = front(LINK, SECOND)
    _, rows, *_ = optimisation.tables(result)
    text = shown([rows], 200)
    assert text[3].split()[-2:] == ["0.601", "-"], "azulay has no second link"
    assert text[4].split()[-2:] == ["-", "0.602"], "glozman has no link of that name"
    first, second = (one["design"] for one in optimisation.as_json(result)["front"][:2])
    assert first == {"link": 0.601, "link-2": None}
    assert second == {"link": None, "link-2": 0.602}
    choice = optimisation.as_json(front(LINK, TUBE))["front"]
    assert [one["design"]["tube"] for one in choice[:2]] == [None, "120 mm"]


def test_limits_that_do_not_hold_between_the_check_points_are_told() -> None:
    """Two designs of three miss the margin which they have at the check points, one by all of it; a hair counts as kept."""
    limits = [GivenLimit("least travel margin", at_least=0.15), GivenLimit("mass", at_most="1 kg")]
    asked = study((), [LINK], [load("azulay")], maximise=[STIFF], limits=limits)
    agains = [[1e6, margin, mass, 1.0] for margin, mass in ((0.1499, 1.0), (0.0, 1.0001), (0.1, 0.5))]
    result = optimised(asked, [member(0, [1.0], [1e6, 0.15, 1.0, 1.0], again=np.array(again)) for again in agains])
    text = shown(optimisation.tables(result), 200)
    (told,) = [line for line in text if line.startswith("there")]
    assert told.startswith(
        "there 2 of 3 designs miss 'least travel margin at least 0.15', at 0 at the worst; take a finer lattice"
    )
    told = [one["missed_over_finer"] for one in optimisation.as_json(result)["front"]]
    assert told == [[], ["least travel margin at least 0.15"], ["least travel margin at least 0.15"]]


def test_ends_of_what_a_machine_lacks_hold_nothing() -> None:
    asked, bounds = front(LINK, SECOND).study, (Bound("link", True), Bound("link-2", False))
    assert _ends(asked, 0, bounds) == ("link at its greatest",)
    assert _ends(asked, 1, bounds) == ("link-2 at its least",)


def test_a_front_of_many_variables_is_read_at_80_columns() -> None:
    result = front(LINK, SECOND, *MANY, count=9)
    whole = shown(optimisation.tables(result), 400)
    assert sum("factor-11" in line for line in whole) == 1, "where there is room it is one table"
    text = shown(optimisation.tables(result), 80)
    assert max(map(len, text)) <= 80
    assert not any("…" in line for line in text)
    quantities = text.index("designs that no other dominates")
    assert text[quantities + 3].split() == ["1", "azulay", "9", "2.5", "200", "1"]
    turned = text[text.index("their variables") + 1 : text.index("what holds them")]
    heads = [word for line in turned for word in line.split() if word.isdecimal() and line.split()[0].isdecimal()]
    assert heads == [str(k + 1) for k in range(9)]
    rows = {name: [word for line in turned if line.startswith(f"{name} ") for word in line.split()[1:]]
            for name in ("factor-11", "link-2")}  # fmt: skip
    assert rows == {"factor-11": ["0.614"] * 9, "link-2": ["-", "0.602"] * 4 + ["-"]}


def test_more_quantities_than_fit_are_turned_too() -> None:
    made = table("many", "", "machine", *(f"quantity {k}\nmm" for k in range(9)), "link", left=2)
    for k in range(3):
        made.add_row(str(k), "azulay", *(f"{k}.{j}" for j in range(9)), f"{k} mm")
    text = shown([Fitted(made, names=2, first=9, rest="variables", note="and more")], 60)
    assert text[0] == "many"
    assert "variables" not in text
    assert text[3].split() == ["quantity", "0,", "mm", "0.0", "1.0", "2.0"]
    assert text[-2].split() == ["link", "0", "mm", "1", "mm", "2", "mm"]
    assert text[-1] == "and more"
    alone = shown([Fitted(made, names=2)], 20)
    assert sum(line.startswith("link") for line in alone) == 3, "at least one at a time"


def test_a_sweep_is_silent_on_variables_that_the_machine_of_a_quantity_lacks(tmp_path: Path) -> None:
    asked = study((LIGHT,), (LINK, SECOND), [load("azulay"), load("glozman")])
    result = swept(asked, tmp_path / "s", lambda designs: designs)
    text = shown(sweep.tables(result, Outcome(1, 1, (), ())), 200)
    at = text.index("designs at the ends")
    assert [line.split()[-2:].index("-") for line in text[at + 2 : at + 6]] == [1, 1, 0, 0]
    first, second = sweep.as_json(result, Outcome(1, 1, (), ()))["quantities"]
    assert first["least_at"] == {"design": first["least_at"]["design"], "link": first["least"], "link-2": None}
    assert second["greatest_at"]["link"] is None


def test_a_sweep_says_how_many_designs_miss_check_points(tmp_path: Path) -> None:
    asked = study((STIFF,), (LINK,), [load("azulay")])
    part = np.where(np.arange(50) < 7, PARTLY, WORKED_OUT)
    text = shown(sweep.tables(swept(asked, tmp_path / "part", lambda designs: designs, part), Outcome(1, 1, (), ())), 200)
    assert text[0] == "azulay: 50 designs, 43 worked out; 7 worked out but for check points out of reach"
    assert text[-1] == sweep.REACHED_ALONE
    text = shown(sweep.tables(swept(asked, tmp_path / "whole", lambda designs: designs), Outcome(1, 1, (), ())), 200)
    assert sweep.REACHED_ALONE not in text


def test_a_sweep_in_which_nothing_changes_has_no_designs_at_the_ends(tmp_path: Path) -> None:
    result = swept(study((LIGHT,), (LINK,), [load("azulay")]), tmp_path / "s", np.ones_like)
    text = shown(sweep.tables(result, Outcome(1, 1, (), ())), 200)
    assert "quantities over the designs" in text
    assert "designs at the ends" not in text


def test_commands_keep_to_the_width_there_is(trivet: Any, tmp_path: Path) -> None:
    scales = [{"scale": "steel.density", "name": f"factor-{k}", "low": 0.9, "high": 1.1, "steps": 1} for k in range(9)]
    document = {
        "machines": ["azulay", "glozman"], "quantities": ["mass"], "sweep": {"method": "grid"},
        "sensitivity": {"count": 8}, "variables": [{**scales[0], "steps": 2}, *scales[1:]],
    }  # fmt: skip
    (tmp_path / "study.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    for command in ("sweep", "sensitivity"):
        code, out, err = trivet(command, "study.toml")
        assert code == 0, err
        assert max(map(len, out.splitlines())) <= 100
        assert "…" not in out
        assert any(line.startswith("factor-8 ") for line in out.splitlines())
        assert trivet(command, "study.toml", "--json")[0] == 0


def test_names_are_no_markup(trivet: Any, tmp_path: Path) -> None:
    names = ("[/x]", "[red]y[/red]", ":smile:", "$\\frac{$")
    variables = [{"scale": "steel.density", "name": name, "low": 0.9, "high": 1.1} for name in names]
    document = {"machines": ["azulay"], "quantities": ["mass"], "sweep": {"count": 4}, "variables": variables}
    document["sensitivity"] = {"count": 8}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    for command, store in (("sweep", "study.zarr"), ("sensitivity", "study.sensitivity.zarr")):
        code, out, err = trivet(command, "study.toml", "--figure", f"[red] [{command}].png")
        assert (code, err) == (0, f"wrote {store}\nwrote [red] [{command}].png\n")
        assert all(name in out for name in names)


def test_unknowns_as_described_are_those_of_the_machine(trivet: Any, tmp_path: Path) -> None:
    document = {
        "machines": ["azulay", "glozman"], "quantities": ["mass"], "sensitivity": {"count": 8},
        "variables": [{"of": path, "low": "50 mm", "high": "300 mm"} for path in ("link.length", "link-2.length")],
    }  # fmt: skip
    (tmp_path / "study.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    found = json.loads(trivet("sensitivity", "study.toml", "--json")[1])
    lacks = [[False, True], [True, False]]
    assert [[value is None for value in own.values()] for own in found["as_described"]] == lacks
    assert [[v is None for v in own["sobol"]["first"].values()] for own in found["quantities"]] == lacks
    assert [[v is None for v in own["first_order"]["slopes_SI"].values()] for own in found["quantities"]] == lacks
    rows = [line.split() for line in trivet("sensitivity", "study.toml")[1].splitlines() if "mass of " in line]
    assert sum(row[2] == "azulay" and row[-1] == "-" for row in rows) == 4
    assert sum(row[2:4] == ["glozman", "-"] for row in rows) == 4
