"""Machines side by side."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.table import Table

from trivet.kinematics.mode import mode_words
from trivet.study.comparison import Comparison
from trivet.views.layout import table
from trivet.views.si import finite
from trivet.views.stiffness_map import points_table, statistics_json, statistics_table

DEVIATION = (
    "Deviation: ours less the published value, as a part of that. Sources leave numbers open, which our files fit or assume; "
    "docs/replication.md tells which, and what that does."
)

LEAST = 1e-300
"""Below it probabilities are not told by their digits."""


def tables(result: Comparison) -> Iterator[Any]:
    """Statistics, published values, tests, convergence, caveats."""
    maps = result.maps
    surfaces = "; ".join(
        f"{m.machine.name}: {hemisphere}, {mode_words(m.mode)}" for m, hemisphere in zip(maps, result.hemispheres, strict=True)
    )
    yield f"best roll for {maps[0].objective.name}. {surfaces}"
    yield from (f"No static comparison: {line}" for line in result.missing)
    yield statistics_table(maps)
    yield points_table(maps, result.hemispheres if len(set(result.hemispheres)) > 1 else [])
    for rows, view in ((result.deviations, _published), (result.tests, _tests), (result.convergence, _convergence)):
        if rows:
            yield view(result)
        if rows is result.deviations and rows:
            yield DEVIATION
    yield "\n".join(f"Mind: {caveat}" for caveat in result.caveats)


def _published(result: Comparison) -> Table:
    columns = ("machine", "source", "", "n", "published", "ours", "deviation", "variance published", "ours")
    found = table("beside published means, N/µm", *columns, left=3)
    used = {m.machine.name: str(int(m.used.sum())) for m in result.maps}
    for d in result.deviations:
        variance = "" if d.published_variance is None else f"{d.published_variance / 1e12:.3f}"
        means = (f"{d.published / 1e6:.3f}", f"{d.ours / 1e6:.3f}", f"{100 * d.relative:+.1f} %")
        found.add_row(d.machine, d.source, d.quantity, used[d.machine], *means, variance, f"{d.our_variance / 1e12:.4f}")
    return found


def _tests(result: Comparison) -> Table:
    columns = ("pair", "", "difference N/µm", "t", "p", "p Holm", "Hedges' g")
    found = table("Welch's two-tailed t test, p after Holm's correction over all rows", *columns, left=2)
    for t in result.tests:
        numbers = (f"{t.difference / 1e6:+.3f}", f"{t.t:.2f}", _probability(t.p), _probability(t.p_holm), f"{t.effect:+.2f}")
        found.add_row(f"{t.first} - {t.second}", t.quantity, *numbers)
    return found


def _probability(p: float) -> str:
    """Two digits; what is zero or nearly so in double precision as a bound."""
    return f"< {LEAST:g}" if p < LEAST else f"{p:.2g}"


def _convergence(result: Comparison) -> Table:
    columns = ("machine", "", "points", "mean N/µm", "finer points", "mean N/µm", "change")
    found = table("convergence: means on a finer lattice", *columns, left=2)
    for c in result.convergence:
        means = (str(c.points), f"{c.mean / 1e6:.4f}", str(c.finer_points), f"{c.finer_mean / 1e6:.4f}")
        found.add_row(c.machine, c.quantity, *means, f"{100 * c.relative:+.2f} %")
    return found


def as_json(result: Comparison) -> dict[str, Any]:
    """A comparison."""
    return {
        "machines": [statistics_json(m) for m in result.maps],
        "published": [
            {
                "machine": d.machine, "source": d.source, "quantity": d.quantity, "published_mean_N_per_m": d.published,
                "mean_N_per_m": d.ours, "relative_deviation": d.relative, "published_variance_N2_per_m2": d.published_variance,
                "variance_N2_per_m2": d.our_variance,
            }
            for d in result.deviations
        ],
        "tests": [
            {
                "first": t.first, "second": t.second, "quantity": t.quantity, "difference_N_per_m": finite(t.difference),
                "t": finite(t.t), "degrees_of_freedom": finite(t.freedom), "p": finite(t.p),
                "p_holm": finite(t.p_holm), "hedges_g": finite(t.effect),
            }
            for t in result.tests
        ],
        "convergence": [
            {
                "machine": c.machine, "quantity": c.quantity, "points": c.points, "mean_N_per_m": c.mean,
                "finer_points": c.finer_points, "finer_mean_N_per_m": c.finer_mean, "relative_change": c.relative,
            }
            for c in result.convergence
        ],
        "missing": list(result.missing),
        "caveats": list(result.caveats),
    }  # fmt: skip
