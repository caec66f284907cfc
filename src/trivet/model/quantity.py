"""Quantities: text with a unit outside, a float in SI inside.  Units pass only this door.

The field types below (`Length`, `Stiffness`, …) are plain floats in SI to the rest of the program; pydantic reads them from
text such as "216 mm" and writes them back in the unit that the field prefers.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from functools import cache
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?|[+-]?(?:nan|inf(?:inity)?)(?![a-z]))\s*(.*?)\s*$", re.I)
_LONGEST = 80

ANGLE_UNITS = {"deg", "degree", "degrees", "rad", "radian", "radians", "mrad", "urad", "arcmin", "arcsec", "turn"}


@cache
def _registry() -> Any:
    import pint  # late: half a second

    # Decimal factors, so that "3 N/um" is exactly 3e6 and not 2999999.9999999995.
    return pint.UnitRegistry(non_int_type=Decimal, on_redefinition="ignore")


@cache
def _factor(unit: str, si: str) -> Decimal | None:
    """Decimal factor from a unit to the SI unit, or None when the dimensions differ or the unit is unknown."""
    registry = _registry()
    try:
        found, wanted = registry.parse_units(unit.replace("µ", "u")), registry.parse_units(si)
        if found.dimensionality != wanted.dimensionality:
            return None
        return Decimal(registry.Quantity(Decimal(1), found).to(wanted).magnitude)
    except Exception:  # pint raises a dozen kinds, among them tokenizer errors, for a unit it cannot read
        return None


@dataclass(frozen=True)
class Quantity:
    """How a field is read and written: a dimension, its SI unit, the unit preferred in files, and bounds on the value."""

    dimension: str
    si: str
    written: str
    positive: bool = False
    at_least_zero: bool = False

    @property
    def example(self) -> str:
        """A text that this quantity reads."""
        return f"{_EXAMPLES.get(self.written, '1')} {self.written}".strip()

    def parse(self, value: Any) -> float:
        """Read text with a unit; raises PydanticCustomError with the reason and the remedy."""
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise self._error(f"expected a {self.dimension} as text")
        if isinstance(value, (int, float)):
            if not self.si:
                return self._bounded(float(value), value)
            raise self._error("the unit is missing")
        match = _NUMBER.match(value) if len(value) <= _LONGEST else None
        if match is None:
            raise self._error("expected a number and a unit" if self.si else "expected a number")
        number, unit = match.groups()
        if not unit and self.si:
            raise self._error("the unit is missing")
        factor = self._unit_factor(unit)
        if factor is None:
            raise self._error(f"'{unit}' is not a unit of {self.dimension}")
        try:
            return self._bounded(float(Decimal(number) * factor), value)
        except (InvalidOperation, OverflowError):
            raise self._error("expected a finite number") from None

    def _unit_factor(self, unit: str) -> Decimal | None:
        if not self.si:
            return Decimal(1) if not unit else None
        if self.si == "rad" and unit not in ANGLE_UNITS:
            return None  # to pint an angle is a pure number, and so is a percentage
        return _factor(unit, self.si)

    def _bounded(self, si_value: float, given: Any) -> float:
        if not abs(si_value) < float("inf"):
            raise self._error("expected a finite number")
        if self.positive and si_value <= 0:
            raise self._error("must be greater than zero")
        if self.at_least_zero and si_value < 0:
            raise self._error("must not be negative")
        return si_value

    def _error(self, reason: str) -> PydanticCustomError:
        return PydanticCustomError("quantity", "{reason}; write for example {example}", {"reason": reason, "example": f'"{self.example}"'})

    def write(self, si_value: float) -> str | float:
        """Text in the preferred unit which reads back to the same float; in SI where the preferred unit would round."""
        if not self.si:
            return float(si_value)
        factor = self._unit_factor(self.written)
        assert factor is not None, self.written
        text = f"{_plain(float(Decimal(repr(float(si_value))) / factor))} {self.written}"
        return text if self.parse(text) == si_value else f"{float(si_value)!r} {self.si}"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(self.write)
        )

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        about = f"{self.dimension}" + (f", with its unit ({self.si} inside)" if self.si else "")
        plain: dict[str, Any] = {"type": "string", "pattern": r"^\s*[+-]?[0-9.]"} if self.si else {"type": ["number", "string"]}
        noted = {
            "type": "object",
            "properties": {"value": plain, "source": {"type": "string"}, "status": {"enum": ["given", "fitted", "assumed"]}},
            "required": ["value"],
            "additionalProperties": False,
        }
        return {"description": about, "examples": [self.example], "anyOf": [plain, noted]}


_EXAMPLES = {"mm": "216", "deg": "70", "N/um": "3", "N^2/um^2": "0.35", "N m/rad": "300", "GPa": "205", "kg/m^3": "7870", "kg": "0.5",
             "kg mm^2": "120", "mm^2": "130", "mm^4": "4500", "": "0.29"}  # fmt: skip


def _plain(number: float) -> str:
    """Shortest text of a float, without a trailing '.0'."""
    text = repr(number)
    return text[:-2] if text.endswith(".0") else text


Length = Annotated[float, Quantity("length", "m", "mm")]
PositiveLength = Annotated[float, Quantity("length", "m", "mm", positive=True)]
LengthOrZero = Annotated[float, Quantity("length", "m", "mm", at_least_zero=True)]
AngleValue = Annotated[float, Quantity("angle", "rad", "deg")]
Stiffness = Annotated[float, Quantity("stiffness", "N/m", "N/um", positive=True)]
StiffnessVariance = Annotated[float, Quantity("variance of a stiffness", "N^2/m^2", "N^2/um^2", at_least_zero=True)]
RotationalStiffness = Annotated[float, Quantity("rotational stiffness", "N m/rad", "N m/rad", positive=True)]
Pressure = Annotated[float, Quantity("pressure", "Pa", "GPa", positive=True)]
Density = Annotated[float, Quantity("density", "kg/m^3", "kg/m^3", positive=True)]
Mass = Annotated[float, Quantity("mass", "kg", "kg", at_least_zero=True)]
Inertia = Annotated[float, Quantity("moment of inertia", "kg m^2", "kg mm^2", at_least_zero=True)]
Area = Annotated[float, Quantity("area", "m^2", "mm^2", positive=True)]
SecondMoment = Annotated[float, Quantity("second moment of area", "m^4", "mm^4", positive=True)]
Ratio = Annotated[float, Quantity("ratio", "", "", at_least_zero=True)]
