"""Parallel coordinates: an axis per number, a line per design."""

from __future__ import annotations

import html
import textwrap
from typing import Any, NamedTuple

import numpy as np

from trivet.design.laws import LogUniform
from trivet.design.variables import Variable
from trivet.model.quantity import Quantity
from trivet.show.names import broken
from trivet.show.palette import BLACK, GREY, VALUES
from trivet.show.shapes import Array
from trivet.show.units import signs

TICKS, MOST_WORDS = 5, 12
"""Numbers beside an axis, about, and choices at most."""
SAME = 1e-9
"""Values that differ by this part of their size only are one value."""
LETTER, SLANTED = 6.6, 26
"""Width of a letter of a name in pixels, and letters of a line of a name that is slanted."""
EDGE = 0.02
"""Room below and above the axes of a picture, a part of their height."""
NONE = "–"
"""What stands where a design has no such number."""
BELOW = 0.15
"""Of the axis: how far below the least number that stands."""
CLOSEST = 58
"""Pixels from one axis to the next, so that neither slanted names nor numbers meet."""


class Axis(NamedTuple):
    """One number of n designs, as people read it."""

    name: str
    unit: str
    values: Array
    """(n,) in the unit; of choices their numbers; NaN where a design has none, which some have."""
    choices: tuple[str, ...] = ()
    """In words; none of numbers."""
    is_log: bool = False

    @property
    def title(self) -> str:
        """The name with the unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name

    @property
    def words(self) -> list[str]:
        """The values as people read them."""
        return [self._word(value) if np.isfinite(value) else NONE for value in self.values]

    def _word(self, value: float) -> str:
        if self.choices:
            return self.choices[int(value)]
        gap = "" if self.unit == "°" else " "
        return signs(f"{value:.5g}{gap}{self.unit}".rstrip())

    @property
    def _has_all(self) -> bool:
        return bool(np.isfinite(self.values).all())

    @property
    def _numbers(self) -> Array:
        """(n,) where the values stand; NaN where there is none."""
        return np.log10(self.values) if self.is_log else self.values

    @property
    def places(self) -> Array:
        """(n,) where the values stand on the axis; at its foot where there is none."""
        return np.where(np.isfinite(self.values), self._numbers, self.ends[0])

    @property
    def _span(self) -> tuple[float, float]:
        """Of what there are numbers; a single value stands in the middle."""
        if self.choices:
            low, high = 0.0, len(self.choices) - 1.0
        else:
            low, high = float(np.nanmin(self._numbers)), float(np.nanmax(self._numbers))
        if high - low > SAME * max(abs(low), abs(high)):
            return low, high
        return low - 0.5 * (abs(low) or 1), low + 0.5 * (abs(low) or 1)

    @property
    def ends(self) -> tuple[float, float]:
        """Of the axis: those of the numbers, and below them a place for none, where it is needed."""
        low, high = self._span
        return (low if self._has_all else low - BELOW * (high - low)), high

    @property
    def heights(self) -> Array:
        """(n,) from 0 at the foot of the axis to 1 at its top."""
        low, high = self.ends
        return (self.places - low) / (high - low)

    @property
    def ticks(self) -> tuple[list[float], list[str]]:
        """Places on the axis, and what stands there."""
        places, words = self._ticks
        return (places, words) if self._has_all else ([self.ends[0], *places], [NONE, *words])

    @property
    def _ticks(self) -> tuple[list[float], list[str]]:
        low, high = self._span
        if self.choices:
            picked = np.unique(np.linspace(0, len(self.choices) - 1, min(len(self.choices), MOST_WORDS)).round())
            return [float(k) for k in picked], [self.choices[int(k)] for k in picked]
        if low < float(np.nanmin(self._numbers)):
            return [(low + high) / 2], [_short(float(np.nanmin(self.values)))]
        return _round_places(low, high, self.is_log)


def _round_places(low: float, high: float, is_log: bool) -> tuple[list[float], list[str]]:
    from matplotlib.ticker import LogLocator, MaxNLocator

    least, most = (10**low, 10**high) if is_log else (low, high)
    locator = LogLocator(numticks=3 * TICKS) if is_log and high - low > 2 else MaxNLocator(TICKS)
    found = np.asarray(locator.tick_values(least, most))
    room = SAME * (most - least)
    found = found[(found >= least - room) & (found <= most + room)]
    return (np.log10(found) if is_log else found).tolist(), [_short(float(value)) for value in found]


def _short(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("-", "−")


def of_variable(variable: Variable, values: Array) -> Axis:
    """The axis of a variable, of values (n,) SI."""
    if variable.is_discrete:
        return Axis(variable.name, "", values, tuple(signs(label) for label in variable.labels))
    return Axis(variable.name, *_in_unit(variable.kind, values), is_log=isinstance(variable.law, LogUniform))


def of_quantity(name: str, kind: Quantity, values: Array) -> Axis:
    """The axis of a quantity, of values (n,) SI."""
    return Axis(name, *_in_unit(kind, values))


def _in_unit(kind: Quantity, values: Array) -> tuple[str, Array]:
    return kind.symbol, values * kind.in_unit(1.0)


class Names(NamedTuple):
    """Names above axes, in lines, and by how much they are slanted (deg)."""

    lines: list[str]
    slant: int

    @property
    def height(self) -> float:
        """Pixels that they ask for above the axes."""
        lines = max(name.count("\n") + 1 for name in self.lines)
        longest = max(len(line) for name in self.lines for line in name.split("\n"))
        return 16.0 * lines + (0.71 * LETTER * longest if self.slant else 0.0)


def names(axes: list[Axis], spacing: float) -> Names:
    """Names of axes that are so many pixels apart: level in several lines where their words are short enough, else slanted."""
    width = int(0.94 * spacing / LETTER)
    if width >= max(len(word) for own in axes for word in own.title.split()):
        lines = ["\n".join(textwrap.wrap(own.title, width)) for own in axes]
        if max(name.count("\n") for name in lines) < 3:
            return Names(lines, 0)
    return Names([_wrapped(own.title, SLANTED, 2) for own in axes], 45)


def width_of(axes: list[Axis]) -> float:
    """Pixels that axes ask for side by side."""
    return CLOSEST * (len(axes) - 1.0)


def draw_lines(canvas: Any, box: tuple[float, float, float, float], axes: list[Axis], colour: Axis) -> Any:
    """Lines of designs on a figure of matplotlib; gives what they are drawn on.

    Args:
        canvas: the figure.
        box: left, bottom, width and height (parts of the figure) of the axes; names stand above it, a colour bar to the right.
        axes: one or more.
        colour: by which lines are coloured.
    """
    from matplotlib.collections import LineCollection

    heights = np.stack([own.heights for own in axes], axis=1)
    count = len(heights)
    order = np.argsort(colour.values)
    across = np.arange(len(axes), dtype=float)
    if len(axes) == 1:
        heights, across = np.repeat(heights, 2, axis=1), np.array([-0.4, 0.4])
    lines = np.stack([np.broadcast_to(across, heights.shape), heights], axis=2)[order]
    drawn = LineCollection(
        list(lines), cmap=VALUES, linewidths=1.0 if count > 60 else 1.6, alpha=float(np.clip(90 / count, 0.2, 0.9))
    )
    drawn.set_array(colour.values[order])
    drawn.set_clim(float(colour.values.min()), float(colour.values.max()))
    panel = canvas.add_axes(box)
    panel.add_collection(drawn)
    panel.set(xlim=(-0.02 * len(axes), 1.02 * len(axes) - 1) if len(axes) > 1 else (-0.5, 0.5), ylim=(-EDGE, 1 + EDGE))
    panel.axis("off")
    spacing = panel.get_window_extent().width / max(len(axes) - 0.96, 1)
    for k, own in enumerate(axes):
        _draw_axis(panel, k, own, spacing)
    _draw_names(panel, names(axes, spacing))
    _draw_bar(canvas, box, colour, drawn)
    return panel


def _draw_axis(panel: Any, across: int, own: Axis, spacing: float) -> None:
    from matplotlib.patheffects import withStroke

    panel.plot([across, across], [0, 1], color=BLACK, linewidth=1.0, zorder=3)
    low, high = own.ends
    letters = max(int((spacing - 8) / 6.4), 4)
    for place, word in zip(*own.ticks, strict=True):
        height = (place - low) / (high - low)
        panel.plot([across], [height], "_", color=BLACK, markersize=6, zorder=3)
        written = panel.annotate(
            _wrapped(word, letters, 3) if own.choices else word,
            (across, height),
            (5, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            zorder=4,
        )
        written.set_path_effects([withStroke(linewidth=2.5, foreground="white")])


def _wrapped(text: str, letters: int, most: int) -> str:
    """Text in so many lines at most, broken between words where they are short enough."""
    lines = textwrap.wrap(text, letters, break_long_words=False)
    fits = len(lines) <= most and max(map(len, lines), default=0) <= letters
    return "\n".join(lines) if fits else broken(text, letters, most)


def _draw_names(panel: Any, found: Names) -> None:
    turned = {"rotation": found.slant, "rotation_mode": "anchor", "ha": "left"} if found.slant else {"ha": "center"}
    for across, name in enumerate(found.lines):
        panel.annotate(name, (across, 1), (0, 8), textcoords="offset points", va="bottom", fontsize=9, **turned)


def _draw_bar(canvas: Any, box: tuple[float, float, float, float], colour: Axis, drawn: Any) -> None:
    """Colours that are seen as they are in the scale, whatever lies over each other in the lines."""
    from matplotlib.cm import ScalarMappable

    left, bottom, wide, high = box
    width = canvas.bbox.width
    seen = ScalarMappable(norm=drawn.norm, cmap=VALUES)
    room = (left + wide + 70 / width, bottom + EDGE * high / (1 + 2 * EDGE), 14 / width, high / (1 + 2 * EDGE))
    bar = canvas.colorbar(seen, cax=canvas.add_axes(room))
    bar.set_label(colour.title)


def brushed(axes: list[Axis], colour: Axis, spacing: float, high: tuple[float, float]) -> Any:
    """Lines of designs as a trace of plotly: ranges are marked on its axes with the mouse.

    Args:
        axes: two or more.
        colour: by which lines are coloured.
        spacing: pixels from one axis to the next, about.
        high: foot and top of the axes, parts of the page; names stand above them, a colour bar to the right.
    """
    import plotly.graph_objects as go

    found = names(axes, spacing)
    dimensions = []
    for own, name in zip(axes, found.lines, strict=True):
        places, words = own.ticks
        shown = {"range": list(own.ends), "tickvals": places, "ticktext": words}
        dimensions.append({"label": html.escape(name).replace("\n", "<br>"), "values": own.places, **shown})
    bar = {"title": {"text": html.escape(colour.title), "side": "right"}, "thickness": 12, "x": 1.0, "xpad": 0, "ypad": 0}
    bar |= {"y": high[0], "yanchor": "bottom", "len": high[1] - high[0]}
    line = {"color": colour.values, "colorscale": VALUES, "showscale": True, "colorbar": bar}
    return go.Parcoords(
        dimensions=dimensions, line=line, labelangle=-found.slant, labelfont={"size": 12}, tickfont={"size": 11},
        rangefont={"size": 1, "color": "rgba(0,0,0,0)"}, unselected={"line": {"color": GREY, "opacity": 0.06}},
        domain={"x": [0.02, 0.94], "y": list(high)},
    )  # fmt: skip
