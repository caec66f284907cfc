"""Tables and numbers as people read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table

from trivet.kinematics.mode import mode_words
from trivet.kinematics.report import Shortfall


def table(title: str, *columns: str, left: int = 1) -> Table:
    """An empty table; the first `left` columns are words."""
    made = Table(
        title=title, title_justify="left", title_style="bold", header_style="", box=None, pad_edge=False, padding=(0, 2, 0, 0)
    )
    for k, column in enumerate(columns):
        made.add_column(column, justify="left" if k < left else "right", no_wrap=k < left)
    return made


def wrapping(made: Table, column: int = -1) -> Table:
    """The same table, a column of it, the last, broken into lines where the terminal is too narrow for it."""
    made.columns[column].no_wrap = False
    made.columns[column].overflow = "fold"
    return made


def more(rows: Table, count: int, shown: int) -> None:
    """A last row that tells of those which are not shown, where there are any."""
    if count > shown:
        rows.add_row(rest(count, shown))


def rest(count: int, shown: int) -> str:
    """Of those which are not shown, nothing where there are none."""
    return f"and {count - shown} more with --json" if count > shown else ""


def where(name: str, mode: str, position: Sequence[float], angles: Sequence[float]) -> str:
    """A machine and how it stands, from SI."""
    x, y, z = (f"{1e3 * float(v) + 0.0:g}" for v in position)
    alpha, beta, gamma = (f"{math.degrees(v):.6g}" for v in angles)
    return f"{name}, {mode_words(mode)}, centre ({x}, {y}, {z}) mm, alpha {alpha}°, beta {beta}°, gamma {gamma}°"


def reached(miss: Shortfall | None) -> str:
    """Whether a pose is reached."""
    return "reached, all joints inside their travel" if miss is None else f"NOT inside travel: {miss.reason}"


def decimals(value: float) -> str:
    """Four decimals, without a negative zero."""
    return f"{round(value, 4) + 0.0:.4f}"


def plain_number(value: float) -> str:
    """Six digits, without what is rounding beside a unit."""
    return f"{round(value, 9) + 0.0:.6g}"


def beside(value: float, greatest: float, digits: int = 5) -> str:
    """A number; zero where it is rounding beside the greatest of its kind."""
    return f"{value if abs(value) > 1e-12 * greatest else 0.0:.{digits}g}"


def fixed(value: float, decimals: int) -> str:
    """So many decimals, without a negative zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"
