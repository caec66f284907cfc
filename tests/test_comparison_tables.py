"""The last table of a comparison: it ranks what can be told apart, and tells of what is there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from rich.console import Console
from rich.table import Table

from trivet import pose, stiffness_map
from trivet.space.surface import hemisphere
from trivet.study.comparison import Comparison
from trivet.study.dynamic_comparison import AS_DESCRIBED, DynamicComparison, MinimumStiffness
from trivet.study.frf import Minimum
from trivet.study.stiffness_map import StiffnessMap
from trivet.study.whole_comparison import WholeComparison
from trivet.views import comparison
from trivet.views.whole_comparison import SIGNIFICANT, tables


@cache
def one() -> StiffnessMap:
    return stiffness_map("azulay", hemisphere(0.1, 0.02, 3), rolls=24)


def means(**factors: float) -> Comparison:
    """Machines that are so many times as stiff as one."""
    return Comparison(
        tuple(replace(one(), machine=one().machine.renamed(name), matrix=one().matrix * by) for name, by in factors.items()), ()
    )


def minima(**stiffnesses: float) -> DynamicComparison:
    described = [
        MinimumStiffness(name, AS_DESCRIBED, tuple(Minimum(axis, value, 1.0) for axis in "xyz"), np.zeros(0))
        for name, value in stiffnesses.items()
    ]
    at = pose("azulay")
    poses = tuple(replace(at, machine=at.machine.renamed(name)) for name in stiffnesses)
    return DynamicComparison(poses, tuple(described), (), 1.0, 2.0, 0.02)


def cells(found: Table) -> list[tuple[str, ...]]:
    return list(zip(*(column.cells for column in found.columns), strict=True))


def last(result: WholeComparison) -> tuple[Table, dict[str, str], str]:
    """The last table, its rows, and what is said below it."""
    *_, table, words = tables(result)
    return table, dict(cells(table)), words  # type: ignore[arg-type]


def test_what_the_test_does_not_tell_apart_is_not_ranked() -> None:
    static = means(a=1.0, b=1.001, c=2.0)
    p = {(t.first, t.second): t.p_holm for t in static.tests if t.quantity == "K_xx"}
    assert p["a", "b"] > SIGNIFICANT > p["a", "c"]
    _, rows, words = last(WholeComparison(static, None))
    for quantity, row in rows.items():
        a, b, c = (f"{own[quantity].mean / 1e6:.3f}" for own in static.samples().values())
        assert row == f"c {c} > b {b} ≈ a {a}"
    assert "Welch" in words
    assert "≈" not in last(WholeComparison(means(a=1.0, c=2.0), None))[2]


def test_the_digits_are_those_of_the_tables_above() -> None:
    static = means(a=4.72e6 / float(one().diagonal("K_xx")[one().used].mean()))
    dynamic = minima(a=0.111e6)
    whole = WholeComparison(static, dynamic)
    _, rows, _ = last(whole)
    assert (rows["K_xx"], rows["D_xx"]) == ("a 4.720", "a 0.1110")
    above = [cell for made in tables(whole) if isinstance(made, Table) for row in cells(made) for cell in row]
    assert {"4.720", "0.1110"} <= set(above)


def test_only_what_is_there_is_told() -> None:
    dynamic = minima(a=1e5, b=2e5)
    _, rows, words = last(WholeComparison(means(a=1.0), dynamic, machines=("a", "b", "c")))
    assert rows["K_xx"].endswith(", b –, c –")
    assert rows["D_xx"] == "b 0.2000 > a 0.1000, c –"
    assert "dynamic" in words
    _, rows, words = last(WholeComparison(means(a=1.0), None, machines=("a",)))
    assert list(rows) == ["K_xx", "K_yy", "K_zz"]
    assert "–" not in "".join(rows.values())
    assert "dynamic" not in words


def test_alike_in_all_digits_is_not_ranked() -> None:
    _, rows, words = last(WholeComparison(means(a=1.0), minima(a=1e5, b=1e5 + 1)))
    assert rows["D_zz"] == "b 0.1000 ≈ a 0.1000"
    assert "≈" in words


def test_the_title_is_no_wider_than_the_table() -> None:
    table, _, _ = last(WholeComparison(means(a=1.0), None))
    wide = Console(width=200)
    assert len(str(table.title)) <= table.__rich_measure__(wide, wide.options).maximum


def test_no_probability_is_nought() -> None:
    """Constants have one of exactly zero."""
    constant = means(a=1.0, b=1.0)
    maps = tuple(replace(m, matrix=m.matrix * 0 + k) for k, m in enumerate(constant.maps, start=1))
    for result, expected in ((Comparison(maps, ()), "< 1e-300"), (constant, "1")):
        (found,) = (m for m in comparison.tables(result) if isinstance(m, Table) and "Welch" in str(m.title))
        assert {row[4:6] for row in cells(found)} == {(expected, expected)}
