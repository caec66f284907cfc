"""Numbers as the paper prints them: with a unit, and no more digits than there are."""

from __future__ import annotations

from decimal import Decimal, InvalidOperation
from functools import cache
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError, core_schema

from trivet.errors import InputError, shown
from trivet.model.quantity import Quantity, signs

NONE = "–"
"""What stands in a table of the paper where there is no number."""
ABOUT = 0.25
"""What is about a number is no farther from it than this part of it: no nearer than the one digit of "about 2" could tell."""


QUANTITIES = (
    Quantity("length", "m", "mm"),
    Quantity("angle", "rad", "deg"),
    Quantity("frequency", "Hz", "Hz"),
    Quantity("stiffness", "N/m", "N/um"),
    Quantity("variance of a stiffness", "N^2/m^2", "N^2/um^2"),
    Quantity("receptance", "m/N", "um/N"),
    Quantity("pure number", "", ""),
)
"""What numbers are of; each has every unit that machine files may use for it."""


class Unit(NamedTuple):
    """A unit of the paper, or of what is told beside it."""

    name: str
    """As it is read."""
    quantity: Quantity
    factor: float
    """Of the unit in SI."""

    @property
    def shown(self) -> str:
        """As people write it."""
        return signs(self.name)

    def text(self, value: float | None, digits: int = 4) -> str:
        """A value from SI, to so many digits."""
        return NONE if value is None else f"{value / self.factor:#.{digits}g}".removesuffix(".")


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

    def is_about(self, value: float) -> bool:
        """Whether a value (SI) is about this number."""
        return abs(value - self.value) <= ABOUT * abs(self.value) * (1 + 1e-9)

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
    """A unit; raises InputError for one of nothing that numbers are of."""
    for quantity in QUANTITIES:
        try:
            return Unit(name, quantity, quantity.parse(f"1 {name}"))
        except PydanticCustomError:
            continue
    kinds = ", ".join(f"{quantity.dimension} ({quantity.written})" for quantity in QUANTITIES if quantity.si)
    raise InputError(f"{shown(name)} is not a unit of any of these: {kinds}")


def _error(reason: str) -> PydanticCustomError:
    return PydanticCustomError("number", "{reason}; write for example 5.74 N/um, or –", {"reason": reason})
