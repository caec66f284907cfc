"""Charts as plots of a document."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from typing import Any

from trivet.report.document import Plot
from trivet.reproduce.found import Chart, Series
from trivet.show.palette import BLACK, BLUE, GREEN, GRID, ORANGE, PURPLE, SKY, VERMILLION

COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILLION, BLACK)
COLUMNS = 3
"""Panels side by side, at most."""
HEIGHT = 470
"""Of a row of panels, pixels."""


def plots(charts: Iterable[Chart], where: str) -> list[Plot]:
    """A plot per title, its panels side by side."""
    return [_plot(title, list(own), where) for title, own in groupby(charts, key=lambda chart: chart.title)]


def _plot(title: str, charts: list[Chart], where: str) -> Plot:
    from plotly.subplots import make_subplots

    rows = -(-len(charts) // COLUMNS)
    columns = -(-len(charts) // rows)
    figure = make_subplots(rows=rows, cols=columns, subplot_titles=[chart.panel for chart in charts], horizontal_spacing=0.07)
    colours = _colours(charts)
    shown: set[str] = set()
    for number, chart in enumerate(charts):
        row, column = number // columns + 1, number % columns + 1
        for series in chart.series:
            trace = _trace(series, colours[series.like or series.name])
            trace.showlegend = series.name not in shown
            shown.add(series.name)
            figure.add_trace(trace, row=row, col=column)
        _axes(figure, chart, row, column, is_first=column == 1)
    figure.update_layout(
        height=HEIGHT * rows, plot_bgcolor="white", margin={"t": 40, "r": 20}, legend={"orientation": "h", "y": -0.18 / rows}
    )
    names = ", ".join(dict.fromkeys(series.name for chart in charts for series in chart.series))
    panels = "; ".join(f"{chart.panel + ': ' if chart.panel else ''}{chart.y} over {chart.x}" for chart in charts)
    return Plot(f"{where}, ours: {title}.", f"{where}, {title}. {panels}. Curves: {names}.", figure)


def _colours(charts: list[Chart]) -> dict[str, str]:
    names = dict.fromkeys(series.like or series.name for chart in charts for series in chart.series)
    return {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(names)}


def _trace(series: Series, colour: str) -> Any:
    import plotly.graph_objects as go

    look: dict[str, Any] = {"line": {"color": colour, "width": 2, "dash": "dash" if series.style == "dashed" else "solid"}}
    if series.style == "points":
        marker = "diamond" if series.like else "circle"
        look = {"marker": {"color": colour, "size": 9 if series.like else 5, "symbol": marker}, "mode": "markers"}
    return go.Scatter(
        x=list(series.x), y=list(series.y), **({"mode": "lines"} | look), name=series.name, legendgroup=series.name
    )


def _axes(figure: Any, chart: Chart, row: int, column: int, is_first: bool) -> None:
    own = {"row": row, "col": column, "showgrid": True, "gridcolor": GRID, "zeroline": False, "linecolor": BLACK}
    kinds = {axis: "log" if axis in chart.logarithmic else "linear" for axis in "xy"}
    figure.update_xaxes(title_text=chart.x, type=kinds["x"], **own)
    figure.update_yaxes(title_text=chart.y if is_first else "", type=kinds["y"], exponentformat="power", **own)
    if chart.is_square:
        figure.update_yaxes(scaleanchor="x", row=row, col=column)
