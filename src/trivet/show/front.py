"""Fronts of optimisations: what is seen of them as plain values."""

from __future__ import annotations

import os
import string
import textwrap
from typing import NamedTuple

import numpy as np

from trivet.design.aims import Aim
from trivet.design.optimisation import Member, Optimisation
from trivet.files import replacing
from trivet.show.comparison import SERIES
from trivet.show.maps import check_suffix
from trivet.show.names import broken
from trivet.show.palette import GREY
from trivet.show.parallel import Axis, of_quantity, of_variable
from trivet.show.shapes import Array
from trivet.show.sketch import Sketches, sketches
from trivet.show.titles import HIGH, WIDE
from trivet.show.units import signs, told

OTHERS = "other machines"
MOST_SERIES = 10
"""Machines with a look of their own."""
MARKERS = (("o", "circle"), ("s", "square"), ("^", "triangle-up"), ("D", "diamond"), ("v", "triangle-down"), ("P", "cross"),
           ("X", "x"))  # fmt: skip
"""For matplotlib and for plotly."""
OF_EACH = 3
"""Designs of one machine that are drawn as machines: both ends of its part of the front, and the middle."""
LETTER, LINE, GAP = 7.0, 16, 14
"""Pixels of a letter of a caption, of a line, and between rows."""
LEAST, FLAT = 90, 0.75
"""Least height of a machine in pixels, and the greatest as a part of its width."""


class Series(NamedTuple):
    """The designs of one machine, or of several that have no look of their own."""

    name: str
    colour: str
    marker: tuple[str, str]
    members: list[int]
    """Which of the front."""
    alternatives: list[int]
    """Which of the alternatives."""


class Picked(NamedTuple):
    """A design that is drawn as a machine."""

    letter: str
    member: Member


class Cell(NamedTuple):
    """Where a machine is drawn, pixels from the upper left corner of the page."""

    left: int
    top: int
    width: int
    height: int
    """Of the picture; the caption stands below it."""
    caption: list[str]


class Panel(NamedTuple):
    """Machines side by side."""

    cells: list[Cell]
    drawn: Sketches


def draw_front(result: Optimisation, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw an optimisation (PNG or self-contained HTML): the front, and some of its designs as machines."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            from trivet.show.front_picture import write_picture as write_figure
        else:
            from trivet.show.front_page import write_page as write_figure
        write_figure(result, temporary)


def title(result: Optimisation, bar: float) -> list[str]:
    """The aims; how many designs there are, and the limits; what the machines are."""
    count, beside = len(result.members), len(result.alternatives)
    found = f"{count} design{'s' if count > 1 else ''} that no other dominates"
    found += f", {beside} dominated beside {'them' if count > 1 else 'it'}" if beside else ""
    found += ", not drawn" if beside and len(result.aims.goals) > 2 else ""
    limits = [limit.words for limit in result.aims.limits]
    missing = [reason.split(": ")[0] for reason in result.missing]
    lines = ["; ".join([found, *limits]), f"machines at home, all to one scale: the bars are {told_length(bar)} long"]
    if missing:
        lines.append(f"without a design: {', '.join(missing)}")
    return [", ".join(goal.words for goal in result.aims.goals), *(signs(line) for line in lines)]


def told_length(metres: float) -> str:
    """A length in mm."""
    return f"{1e3 * metres:g} mm"


def series(result: Optimisation) -> list[Series]:
    """Designs by machine, those with most on the front first; beyond ten machines the rest are of one look."""
    members, beside = ([one.place for one in own] for own in (result.members, result.alternatives))
    places = sorted(set(members) | set(beside), key=lambda place: (-members.count(place), -beside.count(place), place))
    found = []
    for k, place in enumerate(places[:MOST_SERIES]):
        own = ([i for i, one in enumerate(every) if one == place] for every in (members, beside))
        found.append(Series(result.study.names[place], SERIES[k % len(SERIES)], MARKERS[k % len(MARKERS)], *own))
    rest = places[MOST_SERIES:]
    if rest:
        own = ([i for i, one in enumerate(every) if one in rest] for every in (members, beside))
        found.append(Series(OTHERS, GREY, MARKERS[0], *own))
    return found


class Plan(NamedTuple):
    """How a figure is laid out: by the number of objectives."""

    most: int
    """Machines that are drawn."""
    columns: int
    box: tuple[int, int, int, int]
    """Of the machines: left, top, width and height in pixels."""
    front: tuple[int, int, int, int]
    """Of the front, axes and all; nothing of a single objective."""


def plan(result: Optimisation, top: int) -> Plan:
    """The layout below a title that is so many pixels high."""
    high = HIGH - top
    if len(result.aims.goals) == 1:
        return Plan(4, 4, (20, top, WIDE - 40, high), (0, top, 0, 0))
    if len(result.aims.goals) == 2:
        return Plan(12, 3, (740, top, 530, high), (0, top, 730, high))
    return Plan(6, 6, (20, HIGH - 270, WIDE - 40, 270), (0, top, WIDE, high - 280))


def goal_axis(goal: Aim) -> str:
    """What an axis of an objective is called."""
    name = ", ".join(filter(None, (goal.asked.name, goal.asked.kind.symbol)))
    return f"{name}  ({'greater' if goal.sign < 0 else 'less'} is better)"


def outwards(result: Optimisation) -> tuple[int, int]:
    """To which side of a front of two objectives nothing is, across and up: -1 or 1."""
    up, across = (1 if goal.sign < 0 else -1 for goal in result.aims.goals)
    return across, up


def goal_values(result: Optimisation, members: tuple[Member, ...], number: int) -> Array:
    """(n,) an objective as people read it."""
    goal = result.aims.goals[number]
    column = result.columns.index(goal.asked.name)
    return np.array([goal.asked.kind.in_unit(float(one.values[column])) for one in members])


def picked(result: Optimisation, most: int) -> list[Picked]:
    """Designs to be drawn as machines, by the first objective: of every machine both ends of its part of the front and the
    middle, as far as there is room; last the best of machines that are not on the front."""
    by_place: dict[int, list[int]] = {}
    for k, one in enumerate(result.members):
        by_place.setdefault(one.place, []).append(k)
    places = sorted(by_place, key=lambda place: -len(by_place[place]))[:most]
    each = max(1, min(OF_EACH, most // len(places)))
    chosen = sorted(k for place in places for k in _spread(by_place[place], each))
    found = [result.members[k] for k in chosen]
    first = result.objectives(result.alternatives)[:, 0] if result.alternatives else np.zeros(0)
    for k in np.argsort(first, kind="stable"):
        one = result.alternatives[k]
        if len(found) < most and one.place not in {own.place for own in found} | set(by_place):
            found.append(one)
    return [Picked(letter, one) for letter, one in zip(string.ascii_uppercase, found, strict=False)]


def _spread(members: list[int], count: int) -> list[int]:
    """Both ends and the middle, both ends, or the middle alone."""
    ends = {1: [len(members) // 2], 2: [0, -1], 3: [0, len(members) // 2, -1]}[count]
    return list(dict.fromkeys(members[k] for k in ends))


def facts(result: Optimisation, member: Member, *, goals_only: bool = False) -> list[str]:
    """What is told of a design: objectives, other quantities, variables that its machine has, and what holds it."""
    names = [goal.asked.name for goal in result.aims.goals]
    columns = [result.columns.index(name) for name in names]
    columns += [] if goals_only else [k for k, name in enumerate(result.columns) if name not in names]
    asked = result.study.quantities
    lines = [f"{asked[k].name} {told(asked[k].kind, float(member.values[k]))}" for k in columns]
    if goals_only:
        return lines
    for variable, value in zip(result.study.variables, member.design, strict=True):
        if variable.acts_on(member.place):
            lines.append(f"{variable.name} {signs(variable.written(float(value)))}")
    held = [signs(words) for words in (*member.active, *member.bounds)]
    return lines + ([f"held by {'; '.join(held)}"] if held else [])


def coordinates(result: Optimisation, most: int) -> list[Axis]:
    """Axes of the front: objectives, other quantities, the machine where there are several, variables that some of the
    machines have."""
    values = np.array([one.values for one in result.members])
    designs = np.array([one.design for one in result.members])
    names = [goal.asked.name for goal in result.aims.goals]
    order = [result.columns.index(name) for name in names]
    order += [k for k, name in enumerate(result.columns) if name not in names]
    asked, places = result.study.quantities, sorted({one.place for one in result.members})
    axes = [of_quantity(asked[k].name, asked[k].kind, values[:, k]) for k in order]
    if len(places) > 1:
        own = np.array([places.index(one.place) for one in result.members], dtype=float)
        axes.append(Axis("machine", "", own, tuple(result.study.names[place] for place in places)))
    for k, variable in enumerate(result.study.variables):
        acts = np.array([variable.acts_on(one.place) for one in result.members])
        if acts.any():
            axes.append(of_variable(variable, np.where(acts, designs[:, k], np.nan)))
    return axes[:most]


def lettered(result: Optimisation, chosen: list[Picked], axis: Axis) -> list[tuple[str, float]]:
    """Letters of those that are on the front, and how high they stand on an axis."""
    places = {id(member): k for k, member in enumerate(result.members)}
    return [(letter, float(axis.heights[places[id(own)]])) for letter, own in chosen if id(own) in places]


def panel(result: Optimisation, chosen: list[Picked], own: Plan) -> Panel:
    """Machines side by side with their captions, as few in a row as there is room for."""
    left, top, wide, high = own.box
    columns = min(own.columns, max(len(chosen), 1)) if wide > high else _columns(len(chosen))
    all_facts = len(result.aims.goals) == 1
    rows = -(-len(chosen) // columns)
    width, tall = wide // columns, high // rows
    captions = []
    for letter, member in chosen:
        lines = facts(result, member, goals_only=not all_facts)
        letters = int(width / LETTER)
        first, *rest = broken(result.study.names[member.place], letters - 4, 2).split("\n")
        written = [f"{letter}   {first}", *rest, *(part for line in lines for part in textwrap.wrap(line, letters))]
        most = (tall - GAP - LEAST) // LINE
        captions.append(written if len(written) <= most else [*written[: most - 1], "…"])
    room = min(tall - LINE * max(map(len, captions)) - GAP, int(FLAT * width))
    cells = [
        Cell(left + width * (k % columns), top + tall * (k // columns), width, room, caption)
        for k, caption in enumerate(captions)
    ]
    machines = [result.machine(member) for _, member in chosen]
    return Panel(cells, sketches(machines, result.study.given.poses.mode, width, room))


def _columns(count: int) -> int:
    """Of a box that is about as wide as high."""
    return 1 if count <= 3 else 2 if count <= 6 else 3
