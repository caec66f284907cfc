"""Figures of sweeps and fronts: what is on them, as Matplotlib and plotly were told it."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from documents import traces
from made_designs import member, optimised, study, swept

from trivet.design.optimisation import Optimisation
from trivet.design.study import NOT_REACHED, PARTLY, WORKED_OUT
from trivet.design.study_file import GivenVariable
from trivet.model import load
from trivet.show import front, titles
from trivet.show.figure import figure
from trivet.show.palette import GREY
from trivet.show.parallel import Axis, names
from trivet.show.sketch import sketches
from trivet.show.sweep import MOST_AXES, seen, title

STIFF, LIGHT = "mean K_xx", "mass"


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that Matplotlib has written."""
    from matplotlib.figure import Figure

    found: list[Any] = []
    save = Figure.savefig

    def kept(self: Any, *arguments: Any, **options: Any) -> None:
        save(self, *arguments, **options)
        found.append(self)

    monkeypatch.setattr(Figure, "savefig", kept)
    return found


def numbers(value: Any) -> np.ndarray:
    """Numbers as plotly writes them."""
    if isinstance(value, dict):
        import base64

        return np.frombuffer(base64.b64decode(value["bdata"]), dtype=value["dtype"]).astype(float)
    return np.array(value, dtype=float)


def layout(path: Path) -> dict[str, Any]:
    """The layout of a page."""
    import json

    text = path.read_text(encoding="utf-8")
    start = text.index('{"template"', text.rindex("Plotly.newPlot("))
    found: dict[str, Any] = json.JSONDecoder().raw_decode(text, start)[0]
    return found


def values(designs: np.ndarray) -> np.ndarray:
    """Made up: stiffness grows with the length, mass with the choice."""
    return np.stack([1e6 * (3 + 50 * (designs[:, 0] - 0.2)), 0.5 + 0.1 * designs[:, 1]], axis=1)


# Sweeps.


def test_axes_are_in_units_and_words(tmp_path: Path) -> None:
    result = swept(study(), tmp_path / "s", values)
    found = seen(result)
    assert [axis.title for axis in found.axes] == [
        "link.length, mm",
        "tube",
        "size of the platform",
        "mean K_xx, N/µm",
        "mass, kg",
    ]
    length, tube, size, stiffness, mass = found.axes
    assert 205 <= length.values.min() < length.values.max() <= 225
    np.testing.assert_allclose(stiffness.values, 3 + 50 * (length.values / 1e3 - 0.2))
    np.testing.assert_allclose(mass.values, 0.5 + 0.1 * tube.values)
    assert tube.ticks == ([0, 1, 2], ["19 mm × 14 mm", "25 mm × 19 mm", "30 mm × 22 mm"])
    assert tube.words[0] == tube.ticks[1][int(tube.values[0])]
    assert size.is_log
    for axis in found.axes:
        places, words = axis.ticks
        assert len(places) == len(words) > 1
        assert min(axis.ends) <= min(places) <= max(places) <= max(axis.ends)
        if not axis.choices:
            told = [float(word) for word in words]
            np.testing.assert_allclose(np.log10(told) if axis.is_log else told, places)


def test_designs_without_a_number_are_left_out_and_counted(tmp_path: Path) -> None:
    def gaps(designs: np.ndarray) -> np.ndarray:
        found = np.column_stack([values(designs), np.full(len(designs), np.nan)])
        found[5:12, 1] = np.nan
        return found

    status = np.where(np.arange(50) < 3, NOT_REACHED, np.where(np.arange(50) < 8, PARTLY, WORKED_OUT))
    result = swept(study((STIFF, LIGHT, "least clearance")), tmp_path / "s", gaps, status)
    found = seen(result)
    assert found.size == 50 - 3 - 7
    assert all(np.isfinite(axis.values).all() for axis in found.axes)
    first, second = title(result, found)
    assert "azulay: 50 designs" in first
    assert "42 worked out; 5 worked out but for check points" in first
    assert second.startswith("40 designs drawn, coloured by mean K_xx")
    assert "7 of 47 designs lack a number" in second
    assert "no design has least clearance" in second


def test_more_axes_than_are_legible_are_told(tmp_path: Path) -> None:
    asked = [f"mean K({k},1,0)" for k in range(1, 60)]
    result = swept(study(asked), tmp_path / "s", lambda designs: np.tile(designs[:, :1], (1, 59)))
    found = seen(result)
    assert len(found.axes) == MOST_AXES
    assert found.notes == [f"of 59 quantities the first {MOST_AXES - 3} are drawn"]


@pytest.mark.parametrize("value", [0.0, -2.5, 1e9])
def test_one_value_stands_in_the_middle_of_its_axis(value: float) -> None:
    axis = Axis("x", "mm", np.full(4, value))
    np.testing.assert_allclose(axis.heights, 0.5)
    (place,), (word,) = axis.ticks
    assert place == pytest.approx(value)
    assert float(word.replace("−", "-")) == value


def test_what_a_design_lacks_stands_below_the_others() -> None:
    axis = Axis("x", "mm", np.array([10.0, np.nan, 1000.0]), is_log=True)
    assert axis.words == ["10 mm", "–", "1000 mm"]
    assert axis.heights[1] == 0
    assert 0.1 < axis.heights[0] < axis.heights[2] == 1
    assert axis.ticks[1][0] == "–"
    assert axis.ticks[0][0] == axis.ends[0] < 1 < axis.ticks[0][1]
    one, choice = Axis("x", "°", np.array([np.nan, 5.0])), Axis("c", "", np.array([np.nan, 1.0]), ("thin", "thick"))
    assert (one.words, one.ticks[1], choice.words) == (["–", "5°"], ["–", "5"], ["–", "thick"])
    assert choice.ticks[1] == ["–", "thin", "thick"]


def test_variables_that_no_machine_of_a_front_has_are_not_drawn() -> None:
    asked = study((), (LINK, SECOND), [load("azulay"), load("glozman")], maximise=[STIFF], minimise=[LIGHT])
    result = optimised(asked, [member(0, (1.0, 1.1), (1e6 * k, k, 1.0)) for k in (1, 2)])
    assert [axis.name for axis in front.coordinates(result, 20)] == [STIFF, LIGHT, "reached", "link"]


def test_picture_has_a_line_per_design_coloured_by_the_first_quantity(tmp_path: Path, drawn: list[Any]) -> None:
    result = swept(study(), tmp_path / "s", values)
    figure(result, tmp_path / "s.png")
    panel, bar = drawn[0].axes
    assert bar.get_ylabel() == "mean K_xx, N/µm"
    (lines,) = panel.collections
    heights = np.array([path.vertices for path in lines.get_paths()])[:, :, 1]
    assert heights.shape == (50, 5)
    assert (heights >= 0).all()
    assert (heights <= 1).all()
    colours = lines.get_array()
    np.testing.assert_allclose(heights[:, 3], (colours - colours.min()) / np.ptp(colours))
    assert tuple(drawn[0].bbox.size) == (1280, 800)


def placed(figure: Any) -> list[Any]:
    """Names above the axes of a picture, from left to right."""
    own = [text for text in figure.axes[0].texts if text.xy[1] == 1 and text.get_va() == "bottom"]
    return sorted(own, key=lambda text: text.xy[0])


@pytest.mark.parametrize("count", [2, 17])
def test_names_of_axes_are_apart_and_on_the_page(count: int, tmp_path: Path, drawn: list[Any]) -> None:
    some = [STIFF, LIGHT, *(f"deviation K({k}.23456,10.34567,99.45678)" for k in range(1, 16))][:count]
    result = swept(study(some), tmp_path / "s", lambda designs: np.tile(values(designs)[:, :1], (1, count)))
    figure(result, tmp_path / "s.png")
    found = placed(drawn[0])
    assert len(found) == count + 3
    boxes = [text.get_window_extent() for text in found]
    assert all(drawn[0].bbox.x0 <= box.x0 and box.x1 <= drawn[0].bbox.x1 and box.y1 < 800 - 60 for box in boxes)
    if not found[0].get_rotation():
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
    else:
        feet = drawn[0].axes[0].transData.transform([text.xy for text in found])[:, 0]
        lines = max(text.get_text().count("\n") + 1 for text in found)
        assert np.diff(feet).min() * np.sin(np.radians(found[0].get_rotation())) > lines * 9 * 100 / 72 * 1.2


def test_names_are_slanted_only_where_they_have_no_room() -> None:
    axes = [Axis("greatest outer radius", "mm", np.arange(3.0))] * 4
    assert names(axes, 200).slant == 0
    assert names(axes, 60).slant == 45


def test_page_can_be_brushed_and_has_every_quantity_over_every_variable(tmp_path: Path) -> None:
    result = swept(study(), tmp_path / "s", values)
    figure(result, tmp_path / "s.html")
    lines, *dots = traces(tmp_path / "s.html")
    found = seen(result)
    assert lines["type"] == "parcoords"
    assert [one["label"] for one in lines["dimensions"]] == [axis.title for axis in found.axes]
    for one, axis in zip(lines["dimensions"], found.axes, strict=True):
        np.testing.assert_allclose(numbers(one["values"]), axis.places)
        assert one["range"] == pytest.approx(axis.ends)
    np.testing.assert_allclose(numbers(lines["line"]["color"]), found.quantities[0].values)
    assert len(dots) == 3 * 2
    np.testing.assert_allclose(numbers(dots[-1]["x"]), found.variables[-1].places)
    np.testing.assert_allclose(numbers(dots[-1]["y"]), found.quantities[-1].values)


def test_sweep_without_a_design_says_so(tmp_path: Path, drawn: list[Any]) -> None:
    result = swept(study(), tmp_path / "s", values, np.full(50, NOT_REACHED))
    for suffix in ("png", "html"):
        figure(result, tmp_path / f"s.{suffix}")
    assert "nothing to be drawn" in [text.get_text() for text in drawn[0].texts]
    assert traces(tmp_path / "s.html") == []
    assert "nothing to be drawn" in layout(tmp_path / "s.html")["title"]["text"]


def test_sweep_of_one_design_is_drawn(tmp_path: Path, drawn: list[Any]) -> None:
    result = swept(study(count=1), tmp_path / "s", values)
    for suffix in ("png", "html"):
        figure(result, tmp_path / f"s.{suffix}")
    assert "1 design drawn, coloured by mean K_xx" in [text.get_text() for text in drawn[0].texts]
    assert len(traces(tmp_path / "s.html")) == 1 + 6


# Fronts.

LINK = GivenVariable(scale=["link.length"], name="link", low=0.9, high=1.3)
SECOND = GivenVariable(scale=["link-2.length"], name="link-2", low=0.9, high=1.3)


@cache
def found(maximise: tuple[str, ...] = (STIFF,), minimise: tuple[str, ...] = (LIGHT,), count: int = 7) -> Optimisation:
    """A front of two machines, the stiffer part of the second one; each member with a dominated design of a third beside it."""
    machines = [load("azulay"), load("glozman"), load("azulay").renamed("another")]
    asked = study((), (LINK, SECOND), machines, maximise=list(maximise), minimise=list(minimise))
    own = {STIFF: 1e6, LIGHT: 1.0, "greatest outer radius": 0.2, "reached": 0.0}
    columns = [*maximise, *minimise, *(() if maximise + minimise == (LIGHT,) else ("reached",))]
    members, beside = [], []
    for t in np.linspace(2, 1, count):
        some = [own[name] * t**0.5 if name == STIFF else own[name] * t for name in columns]
        held = {"active": ("least K_zz at least 2 N/um",), "bounds": ("link at its greatest",)}
        members.append(member(int(t > 1.6), (0.8 + 0.25 * t, 1.1), some, **held))
        beside.append(member(2, (1.0, 1.0), [0.9 * v if name == STIFF else v for name, v in zip(columns, some, strict=True)]))
    return optimised(asked, members, beside)


def test_series_are_the_machines_each_with_its_look() -> None:
    result = found()
    own = front.series(result)
    assert [one.name for one in own] == ["azulay", "glozman", "another"]
    assert sorted(k for one in own for k in one.members) == list(range(7))
    assert [len(one.alternatives) for one in own] == [0, 0, 7]
    assert len({one.colour for one in own}) == len({one.marker for one in own}) == 3


def test_machines_beyond_ten_share_a_look() -> None:
    machines = [load("azulay").renamed(f"machine-{k}") for k in range(13)]
    asked = study((), (LINK,), machines, maximise=[STIFF], minimise=[LIGHT])
    members = [member(k, (1.0,), (1e6 * (20 - k), 20.0 - k, 1.0)) for k in range(13)]
    result = optimised(asked, members)
    *own, rest = front.series(result)
    assert len(own) == front.MOST_SERIES == len({(one.colour, one.marker) for one in own})
    assert (rest.name, rest.colour, len(rest.members)) == (front.OTHERS, GREY, 3)
    assert len(front.picked(result, 12)) == 12


def test_both_ends_and_the_middle_of_every_machine_are_drawn() -> None:
    result = found()
    chosen = front.picked(result, 12)
    assert [one.letter for one in chosen] == list("ABCDEFG")
    own = [k for k, one in enumerate(result.members) if any(one is picked.member for picked in chosen)]
    first = [k for k, one in enumerate(result.members) if one.place == 0]
    assert {first[0], first[-1]} <= set(own)
    assert [one.member.place for one in chosen].count(0) == 3
    best = chosen[-1].member
    assert best.place == 2
    assert best.values[0] == max(one.values[0] for one in result.alternatives)


def test_designs_are_told_with_what_holds_them_and_without_what_they_do_not_have() -> None:
    result = found()
    first, second = (front.facts(result, next(one for one in result.members if one.place == place)) for place in (0, 1))
    assert first[0].replace("\u00a0", " ").startswith("mean K_xx 1.2")
    assert first[0].endswith("N/µm")
    assert first[-1] == "held by least K_zz at least 2 N/µm; link at its greatest"
    assert any(line.startswith("link ") for line in first)
    assert not any(line.startswith("link-2 ") for line in first)
    assert not any(line.startswith("link ") for line in second)
    assert front.facts(result, result.members[0], goals_only=True) == front.facts(result, result.members[0])[:2]


def test_picture_of_two_objectives_bounds_what_is_dominated(tmp_path: Path, drawn: list[Any]) -> None:
    result = found()
    figure(result, tmp_path / "f.png")
    (axes,) = drawn[0].axes
    assert axes.get_ylabel() == "mean K_xx, N/µm  (greater is better)"
    assert axes.get_xlabel() == "mass, kg  (less is better)"
    steps = axes.lines[0]
    assert steps.get_drawstyle() == "steps-post"
    x, y = np.array(steps.get_data())
    np.testing.assert_allclose(x, sorted(one.values[1] for one in result.members))
    np.testing.assert_allclose(y, sorted(one.values[0] / 1e6 for one in result.members))
    for one in result.alternatives:
        assert one.values[0] / 1e6 < y[x <= one.values[1]].max()
    faint = np.concatenate([np.array(line.get_data()).T for line in axes.lines if line.get_alpha() == 0.3])
    np.testing.assert_allclose(faint, [(one.values[1], one.values[0] / 1e6) for one in result.alternatives])
    listed = [text.get_text() for text in axes.get_legend().get_texts()]
    assert listed == ["azulay", "glozman", "another", "faint: dominated"]
    assert [text.get_text() for text in axes.texts] == list("ABCDEFG")
    assert len(drawn[0].images) == 7
    words = "\n".join(text.get_text() for text in drawn[0].texts)
    assert "7 designs that no other dominates, 7 dominated beside them" in words
    assert "A   glozman" in words
    for text in drawn[0].texts:
        box = text.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= 1280
        assert box.y0 >= 0
    assert axes.get_legend().get_window_extent().y0 >= 0


def test_page_of_two_objectives_tells_every_design_and_holds_its_machines(tmp_path: Path) -> None:
    result = found()
    figure(result, tmp_path / "f.html")
    line, *dots = traces(tmp_path / "f.html")
    assert line["line"]["shape"] == "hv"
    assert {one["name"] for one in dots} == {"azulay", "glozman", "another, dominated"}
    assert sum(len(one["text"]) for one in dots) == 14
    for one in dots:
        if "dominated" not in one["name"]:
            assert all("held by least K_zz at least 2 N/µm" in text for text in one["text"])
            assert one["marker"].get("opacity", 1) == 1
        else:
            assert one["marker"]["opacity"] < 0.5
    page = layout(tmp_path / "f.html")
    assert len(page["images"]) == 7
    assert all(image["source"].startswith("data:image/png;base64,") for image in page["images"])
    assert len({(image["sizex"], image["sizey"]) for image in page["images"]}) == 1  # else they are of unlike scales
    assert sum(bool(re.fullmatch("<b>[A-G]</b>", one["text"])) for one in page["annotations"]) == 7


@pytest.mark.parametrize("better", ["greater", "less"])
def test_steps_keep_to_the_side_of_what_is_dominated(better: str, tmp_path: Path, drawn: list[Any]) -> None:
    aims = {"maximise": [STIFF, LIGHT]} if better == "greater" else {"minimise": [STIFF, LIGHT]}
    asked = study((), (LINK,), maximise=aims.get("maximise", []), minimise=aims.get("minimise", []))
    result = optimised(asked, [member(0, (1.0,), (1e6 * y, x, 1.0)) for x, y in ((1.0, 3.0), (2.0, 2.0), (3.0, 1.0))])
    figure(result, tmp_path / "f.png")
    assert drawn[0].axes[0].lines[0].get_drawstyle() == ("steps-pre" if better == "greater" else "steps-post")
    assert front.outwards(result) == ((1, 1) if better == "greater" else (-1, -1))


def test_many_objectives_are_parallel_coordinates(tmp_path: Path, drawn: list[Any]) -> None:
    result = found((STIFF,), (LIGHT, "greatest outer radius"), 5)
    figure(result, tmp_path / "f.html")
    (lines,) = traces(tmp_path / "f.html")
    labels = [one["label"].replace("<br>", " ") for one in lines["dimensions"]]
    assert labels == ["mean K_xx, N/µm", "mass, kg", "greatest outer radius, mm", "reached", "machine", "link", "link-2"]
    assert lines["dimensions"][4]["ticktext"] == ["azulay", "glozman"]
    for dimension, place in zip(lines["dimensions"][5:], (0, 1), strict=True):
        lacks = np.array([one.place != place for one in result.members])
        assert dimension["ticktext"][0] == "–", "what a machine has no number of stands at the foot"
        assert dimension["tickvals"][0] == dimension["range"][0]
        np.testing.assert_array_equal(numbers(dimension["values"]) == dimension["range"][0], lacks)
    np.testing.assert_allclose(numbers(lines["dimensions"][0]["values"]), [one.values[0] / 1e6 for one in result.members])
    figure(result, tmp_path / "f.png")
    panel, bar = drawn[-1].axes
    assert bar.get_ylabel() == "mean K_xx, N/µm"
    assert len(panel.collections[0].get_paths()) == 5
    assert "not drawn" in "".join(text.get_text() for text in drawn[-1].texts)


def test_one_objective_is_the_best_of_every_machine_with_all_its_numbers(tmp_path: Path, drawn: list[Any]) -> None:
    result = found((STIFF,), (), 1)
    figure(result, tmp_path / "f.png")
    assert not drawn[0].axes
    assert len(drawn[0].images) == 2
    words = [text.get_text() for text in drawn[0].texts]
    assert "maximise mean K_xx" in words
    assert {"A   glozman", "B   another", "link-2 1.1", "link 1"} <= {word.removesuffix(".0") for word in words}
    figure(result, tmp_path / "f.html")
    assert traces(tmp_path / "f.html") == []
    assert len(layout(tmp_path / "f.html")["images"]) == 2


# Machines.


def spans(picture: np.ndarray) -> tuple[np.ndarray, int]:
    """Width and height of a machine in pixels, and the length of the bar below it."""
    rows, columns = np.nonzero(picture[:-14, :, 3] > 0.5)
    return np.array([np.ptp(columns), np.ptp(rows)]), int((picture[-9, :, 3] > 0.5).sum())


def test_machines_are_drawn_to_one_scale() -> None:
    machine = load("azulay")
    asked = study((), (GivenVariable(scale=["link.length"], name="link", low=1.0, high=1.5),), minimise=[LIGHT])
    wide = asked.machine(0, [1.25])
    alone, together = sketches([machine], None, 200, 150), sketches([machine, wide], None, 200, 150)
    (first,), (small, large) = alone.pictures, together.pictures
    assert first is not None
    assert small is not None
    assert large is not None
    (size, bar), (smaller, shorter), (larger, same) = map(spans, (first, small, large))
    assert same == shorter
    assert (larger > smaller).any()
    np.testing.assert_allclose(smaller / size, (shorter / together.bar) / (bar / alone.bar), rtol=0.06)
    assert (smaller < size).all()


def test_machine_that_does_not_reach_home_is_named(tmp_path: Path, drawn: list[Any]) -> None:
    asked = study(
        (), (GivenVariable(scale=["link.length"], name="link", low=0.1, high=1.5),), maximise=[STIFF], minimise=[LIGHT]
    )
    result = optimised(asked, [member(0, (1.0,), (2e6, 2.0, 1.0)), member(0, (0.2,), (1e6, 1.0, 1.0))])
    figure(result, tmp_path / "f.png")
    assert len(drawn[0].images) == 1
    assert [text.get_text() for text in drawn[0].texts].count("home is not reached") == 1
    figure(result, tmp_path / "f.html")
    assert len(layout(tmp_path / "f.html")["images"]) == 1


def test_long_titles_are_broken_and_nothing_is_lost() -> None:
    words = "; ".join(f"greatest outer radius at most {k} mm" for k in range(12))
    lines = titles.wrapped(["short", words])
    assert lines[0] == ("short", True)
    assert len(lines) > 3
    assert " ".join(line for line, _ in lines[1:]) == words
