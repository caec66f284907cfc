"""Numbers as the paper prints them: with a unit, and no more digits than there are."""

from __future__ import annotations

from decimal import Decimal, InvalidOperation
from functools import cache
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError, core_schema

from trivet.errors import InputError, nearest
from trivet.model.quantity import Quantity

NONE = "–"
"""What stands in a table of the paper where there is no number."""


class Unit(NamedTuple):
    """A unit of the paper, or of what is told beside it."""

    name: str
    """As it is read."""
    shown: str
    """As people write it."""
    quantity: Quantity

    @property
    def factor(self) -> float:
        """Of the unit in SI."""
        return self.quantity.parse(f"1 {self.name}") if self.quantity.si else 1.0

    def text(self, value: float | None, digits: int = 4) -> str:
        """A value from SI, to so many digits."""
        return NONE if value is None else f"{value / self.factor:#.{digits}g}".removesuffix(".")


UNITS = {
    name: Unit(name, shown, Quantity(dimension, si, name))
    for name, shown, dimension, si in (
        ("mm", "mm", "length", "m"),
        ("deg", "°", "angle", "rad"),
        ("Hz", "Hz", "frequency", "Hz"),
        ("N/um", "N/µm", "stiffness", "N/m"),
        ("N^2/um^2", "(N/µm)²", "variance of a stiffness", "N^2/m^2"),
        ("um/N", "µm/N", "receptance", "m/N"),
        ("", "", "pure number", ""),
    )
}


class Number(NamedTuple):
    """A number of the paper; it stands for all that are rounded to it."""

    value: float
    """SI."""
    half: float
    """Half a unit of its last digit, SI."""
    unit: Unit
    text: str
    """As it is printed, without the unit."""

    def rounds_to(self, value: float) -> bool:
        """Whether a value (SI) is this number to all its digits; rounding of the float itself does not count."""
        return abs(value - self.value) <= self.half * (1 + 1e-9)

    def is_above(self, other: Number) -> bool:
        """Whether all that round to it are above those that round to the other; the ends of both may touch."""
        return self.value - other.value >= (self.half + other.half) * (1 - 1e-9)

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(number)


def number(text: Any) -> Number | None:
    """A number with its unit, "5.74 N/um"; none where the paper has none, "–".

    Raises:
        PydanticCustomError: with the reason and what was expected.
    """
    if text == NONE:
        return None
    if not isinstance(text, str):
        raise _error("expected a number with its unit as text")
    digits, _, name = text.strip().partition(" ")
    if not name:
        raise _error("the unit is missing")
    try:
        exact, unit = Decimal(digits), unit_named(name)
    except InvalidOperation:
        raise _error(f"'{digits}' is no number") from None
    except InputError as error:
        raise _error(str(error)) from None
    exponent = exact.as_tuple().exponent
    if not isinstance(exponent, int):  # infinite, or none
        raise _error(f"'{digits}' is no number")
    return Number(unit.quantity.parse(text), float(Decimal((0, (5,), exponent - 1))) * unit.factor, unit, digits)


@cache
def unit_named(name: str) -> Unit:
    """A unit; raises InputError for one that is not known."""
    if name not in UNITS:
        raise InputError(f"'{name}' is not a unit that is known here{nearest(name, UNITS)}")
    return UNITS[name]


def _error(reason: str) -> PydanticCustomError:
    return PydanticCustomError("number", "{reason}; write for example 5.74 N/um, or –", {"reason": reason})
