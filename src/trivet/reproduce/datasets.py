"""Everything that was found as one NetCDF file, a group per table or figure, in SI."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.model import to_text
from trivet.reproduce.numbers import unit_named
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.run import Reproduction
from trivet.results.netcdf import described, write_groups
from trivet.study.machines import choose

if TYPE_CHECKING:
    import xarray as xr


def write_datasets(result: Reproduction, folder: Path) -> list[Path]:
    """Write reproduction.nc."""
    path = folder / "reproduction.nc"
    write_groups({outcome.item.name: dataset(outcome) for outcome in result.outcomes}, path, overwrite=True)
    return [path]


def dataset(outcome: Outcome) -> xr.Dataset:
    """One item: what is set beside the paper (row), every number in every setting (entry), statements, curves (point)."""
    item = outcome.item
    variables = _rows(outcome) | _entries(outcome) | _statements(outcome) | _curves(outcome)
    words = {"where": item.where, "title": item.title, "setting": item.setting, "command": item.command}
    files = "\n".join(f"# {name}\n{to_text(choose(name))}" for name in item.machines)
    return described(variables, {}, **words, machine_files=files, notes="\n".join(outcome.found.notes))


def _rows(outcome: Outcome) -> dict[str, tuple[Any, ...]]:
    rows, mixed = outcome.rows, "as the variable unit tells"
    return {
        "quantity": _words("row", (r.quantity for r in rows), "what is told"),
        "machine": _words("row", (r.machine for r in rows), "of which machine"),
        "unit": _words("row", (r.unit.quantity.si for r in rows), "SI unit of paper, ours, least and greatest"),
        "paper": _numbers("row", (r.paper and r.paper.value for r in rows), mixed, "the paper's number"),
        "half_digit": _numbers("row", (r.paper and r.paper.half for r in rows), mixed, "half a unit of its last digit"),
        "ours": _numbers("row", (r.ours for r in rows), mixed, "ours"),
        "deviation": _numbers("row", (r.deviation for r in rows), "1", "of ours from the paper's, relative to that"),
        "least": _numbers("row", (r.least for r in rows), mixed, "least over all settings"),
        "greatest": _numbers("row", (r.greatest for r in rows), mixed, "greatest over all settings"),
        "verdict": _words("row", (r.verdict.kind for r in rows), "what is said of it"),
        "verdict_words": _words("row", (r.verdict.sentence for r in rows), "the same in words, with the reason"),
    }


def _entries(outcome: Outcome) -> dict[str, tuple[Any, ...]]:
    own = outcome.found.ours
    units = [unit_named(one.unit).quantity.si for one in own]
    return {
        "entry_quantity": _words("entry", (one.quantity for one in own), "what is told"),
        "entry_machine": _words("entry", (one.machine for one in own), "of which machine"),
        "entry_setting": _words("entry", (one.setting for one in own), "in which setting"),
        "entry_unit": _words("entry", units, "SI unit"),
        "entry_value": _numbers("entry", (one.value for one in own), "as entry_unit tells", "ours; NaN where there is none"),
    }


def _statements(outcome: Outcome) -> dict[str, tuple[Any, ...]]:
    own = outcome.statements
    return {
        "statement": _words("statement_number", (one.text for one in own), "what the paper says"),
        "statement_quantity": _words("statement_number", (one.quantity for one in own), "of what"),
        "statement_holding": _numbers("statement_number", (one.holding for one in own), "1", "settings in which it holds"),
        "statement_settings": _numbers("statement_number", (one.settings for one in own), "1", "settings that tell"),
        "statement_left_out": _numbers("statement_number", (one.left_out for one in own), "1", "settings that do not tell"),
        "statement_verdict": _words("statement_number", (one.verdict.sentence for one in own), "what is said of it"),
    }


def _curves(outcome: Outcome) -> dict[str, tuple[Any, ...]]:
    own = [(chart, series) for chart in outcome.found.charts for series in chart.series]
    lengths = [len(series.x) for _, series in own]
    x = [value for _, series in own for value in series.x]
    y = [value for _, series in own for value in series.y]
    titles = (": ".join(part for part in (chart.title, chart.panel) if part) for chart, _ in own)
    return {
        "series_name": _words("series", (series.name for _, series in own), "name of the curve"),
        "series_chart": _words("series", titles, "chart in which it is"),
        "series_x": _words("series", (chart.x for chart, _ in own), "what is along x, with its unit"),
        "series_y": _words("series", (chart.y for chart, _ in own), "what is along y, with its unit"),
        "point_series": (("point",), np.repeat(np.arange(len(own)), lengths), "1", "number of the curve"),
        "point_x": _numbers("point", x, "as series_x tells", "points of the curves, curve after curve"),
        "point_y": _numbers("point", y, "as series_y tells", "the same"),
    }


def _words(along: str, values: Iterable[str], meaning: str) -> tuple[Any, ...]:
    return (along,), np.array(list(values), dtype=object), "1", meaning


def _numbers(along: str, values: Iterable[float | None] | Sequence[float], unit: str, meaning: str) -> tuple[Any, ...]:
    return (along,), np.array([math.nan if v is None else float(v) for v in values]), unit, meaning
