"""What is found of a table or a figure, before anything is said of it; plain numbers, which go to a file and come back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Literal, NamedTuple

from trivet.reproduce.numbers import Number

if TYPE_CHECKING:
    from pydantic import TypeAdapter

AS_DESCRIBED = "as described"
"""The setting in which machines are as their files say."""

Progress = Callable[[int, int], None]
"""Called with how much of how much is done."""


class Asked(NamedTuple):
    """What the paper tells of one quantity."""

    quantity: str
    paper: dict[str, Number | None]
    """By machine."""
    of: dict[str, str]
    """By machine, where in the machine file it stands; empty where it is computed."""
    ordered_by: str
    """Quantity of ours that puts the machines in order; another one where a single sphere, say, is not fair to them."""
    is_fitted: bool = False
    """Whether something that the paper does not give was fitted to these very numbers."""

    @property
    def is_input(self) -> bool:
        """Whether our machine files took it from the paper."""
        return bool(self.of)


class Ours(NamedTuple):
    """One number of ours."""

    quantity: str
    machine: str
    setting: str
    """What of the open was chosen how; the first setting of a quantity is the one that is set beside the paper."""
    value: float | None
    """SI; None where there is none, as where a pose is not reached."""
    unit: str


class Series(NamedTuple):
    """One curve of a chart."""

    name: str
    x: Sequence[float]
    y: Sequence[float | None]
    style: Literal["line", "dashed", "points"] = "line"
    like: str = ""
    """Name of the curve whose colour it shares."""


class Chart(NamedTuple):
    """A chart; those with one title stand side by side."""

    title: str
    panel: str
    x: str
    """What is along x, with its unit."""
    y: str
    series: list[Series]
    logarithmic: Literal["", "x", "y", "xy"] = ""
    """Which axes are: x, y or xy."""
    is_square: bool = False
    """Whether a length is as long along x as along y."""


@dataclass(frozen=True)
class Found:
    """All that is found of a table or a figure."""

    ours: tuple[Ours, ...]
    charts: tuple[Chart, ...] = ()
    notes: tuple[str, ...] = ()
    """What else came out, in sentences."""


@cache
def adapter() -> TypeAdapter[Found]:
    """Reads and writes what is found."""
    from pydantic import TypeAdapter

    return TypeAdapter(Found)


def rounded(values: Iterable[float], digits: int = 6) -> list[float]:
    """Numbers of a curve to so many digits: a picture shows no more, and files stay small."""
    return [float(f"{value:.{digits}g}") for value in values]
