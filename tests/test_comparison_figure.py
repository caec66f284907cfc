"""What figures of comparisons and maps show: whole names, no empty place, and what is not reached as such."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from trivet import compare, stiffness_map
from trivet.show import comparison as show
from trivet.show.maps import NOT_REACHED, draw_map
from trivet.show.names import broken
from trivet.space.surface import hemisphere
from trivet.study.comparison import Comparison
from trivet.study.stiffness_map import StiffnessMap
from trivet.views import comparison as view

LONG = "azulay@link.length=236 mm,home.position=0 mm,0 mm,130 mm"


@cache
def one() -> StiffnessMap:
    """A map of few points, some of which are not reached."""
    return stiffness_map("azulay", hemisphere(0.1, 0.04, 3), rolls=24)


def of(*names: str) -> Comparison:
    """That map under several names."""
    return Comparison(tuple(replace(one(), machine=one().machine.renamed(name)) for name in names), ())


def drawn(result: Comparison) -> Any:
    figure = Figure(figsize=show.size(result))
    FigureCanvasAgg(figure)
    show.plot(figure, result)
    figure.canvas.draw()
    return figure


def boxes(texts: list[Any]) -> list[Any]:
    return [text.get_window_extent() for text in texts if text.get_text()]


@pytest.mark.parametrize("names", [("azulay",), ("azulay", LONG), tuple(f"{LONG},{k}" for k in range(5))])
def test_names_are_whole_and_apart(names: tuple[str, ...]) -> None:
    figure = drawn(of(*names))
    below, titles = figure.axes[:3], [axes.title for axes in figure.axes[3:-1]]
    assert len(titles) == len(names)
    for name, title in zip(names, titles, strict=True):
        assert title.get_text().replace("\n", "").replace(" ", "").startswith(name.replace(" ", ""))
    rows = [boxes(titles), *(boxes(axes.get_xticklabels()) for axes in below)]
    for row in rows:
        assert len(row) == len(names)
        for box in row:
            assert 0 <= box.x0 < box.x1 <= figure.bbox.width
        assert all(left.x1 < right.x0 for left, right in pairwise(sorted(row, key=lambda box: box.x0)))
    assert max(box.y1 for box in rows[0]) < min(box.y0 for row in rows[1:] for box in row)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_maps_fill_the_width(count: int) -> None:
    *maps, bar = drawn(of(*(f"machine-{k}" for k in range(count)))).axes[3:]
    cells = [axes.get_subplotspec().get_position(axes.figure) for axes in maps]
    assert len(maps) == count
    places = [0.0, *(x for cell in cells for x in (cell.x0, cell.x1)), bar.get_subplotspec().get_position(bar.figure).x0]
    assert max(np.diff(places)[::2]) < 0.1


def test_a_published_mean_above_all_is_seen() -> None:
    figure = drawn(of("azulay"))
    for axes, quantity in zip(figure.axes, ("K_xx", "K_yy", "K_zz"), strict=False):
        top = np.nanmax(one().diagonal(quantity)) / 1e6
        assert top < axes.get_ylim()[1] < 1.5 * max(top, 5.7)


@pytest.mark.parametrize("width", [8, 14, 30])
def test_broken_names_lose_nothing(width: int) -> None:
    lines = broken(LONG, width, most=99).split("\n")
    assert max(map(len, lines)) <= width
    assert "".join(lines).replace(" ", "") == LONG.replace(" ", "")
    assert len(broken(LONG, 8, most=3).split("\n")) == 3
    assert broken(LONG, 8, most=3).endswith("…")


def test_not_reached_is_listed(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert 0 < one().used.sum() < len(one().surface)
    texts = [text.get_text() for axes in drawn(of("azulay")).axes for text in getattr(axes.get_legend(), "texts", [])]
    assert NOT_REACHED in texts
    draw_map(one(), tmp_path / "map.html")
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    assert page.count(f'"name":"{NOT_REACHED}"') == 4
    assert "null" not in page[page.rindex('"marker":{"color"') :].split("customdata")[0]


def test_unlike_hemispheres_are_told() -> None:
    machines = ("azulay", "azulay@workpiece.radius=6 mm")
    alike = compare(*machines, steps=1, rolls=24, finer=1, radius=0.004)
    unlike = compare(*machines, steps=1, rolls=24, finer=1)
    assert [len(c.caveats) for c in (alike, unlike)] == [2, 3]
    columns = [
        [str(column.header) for table in view.tables(c) if hasattr(table, "columns") for column in table.columns]
        for c in (alike, unlike)
    ]
    assert ["over" in found for found in columns] == [False, True]
    assert len(show.layout(unlike).titles[0].split("\n")) == len(show.layout(alike).titles[0].split("\n")) + 1
