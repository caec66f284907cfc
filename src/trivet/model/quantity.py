"""Quantities: text with a unit outside, a float in SI inside.  Units pass only this door.

The field types below (`Length`, `Stiffness`, …) are plain floats in SI to the rest of the program; pydantic reads them from
text such as "216 mm" and writes them back in the unit that the field prefers.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

NUMBER = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_QUANTITY = re.compile(rf"\s*([+-]?{NUMBER}|[+-]?(?:nan|inf(?:inity)?)(?![a-z]))\s*(.*?)\s*$", re.IGNORECASE)
# Names with one-digit powers, no more: pint would evaluate whole expressions.
_POWER = r"(?:(?:\^|\*\*)-?[1-9]|[²³⁴])?"
_UNIT = re.compile(rf"[^\W\d_]+{_POWER}(?:(?:\s*[*/]\s*|\s+)[^\W\d_]+{_POWER})*")
_LONGEST = 80
LARGEST, SMALLEST = 1e24, 1e-30
"""In SI: what no machine has, and what would run out of double precision when it is squared and multiplied."""
LARGEST_ANGLE = 1e3
"""rad: turns are lost in rounding beyond."""

_SIGNS = {
    r"N\^2/um\^2": "(N/µm)²", r"(?<=[0-9]) deg\b": "°", r"\bdeg\b": "°", r"\bu(?=(m|rad)\b)": "µ",
    r"\^2": "²", r"\^3": "³", r"\^4": "⁴",
}  # fmt: skip
"""What people write for what files spell out."""

TEMPERATURE_STEPS = {"K": Decimal(1), "mK": Decimal("1e-3"), "delta_degC": Decimal(1)}
"""Units of a change of temperature; "degC" is not among them, it says how warm something is."""

ANGLE_UNITS = {"deg", "degree", "degrees", "rad", "radian", "radians", "mrad", "urad", "arcmin", "arcsec", "turn"}


def signs(words: str) -> str:
    """Words for people, with the signs of units that files spell out: "3 N/um" as "3 N/µm", "5 deg" as "5°"."""
    for plain, sign in _SIGNS.items():
        words = re.sub(plain, sign, words)
    return words


@cache
def _registry() -> Any:
    import pint  # late: half a second

    # Decimal factors, so that "3 N/um" is exactly 3e6 and not 2999999.9999999995.
    return pint.UnitRegistry(non_int_type=Decimal, on_redefinition="ignore")


_COMMON = {
    ("mm", "m"): Decimal("1e-3"),
    ("m", "m"): Decimal(1),
    ("N/um", "N/m"): Decimal("1e6"),
    ("GPa", "Pa"): Decimal("1e9"),
    ("kg/m^3", "kg/m^3"): Decimal(1),
    ("N m/rad", "N m/rad"): Decimal(1),
    ("N^2/um^2", "N^2/m^2"): Decimal("1e12"),
    ("kg", "kg"): Decimal(1),
    ("deg", "rad"): Decimal("0.01745329251994329576923690768488612713"),
}
"""Factors which nearly every machine file needs, so that it is read without the half second in which pint starts."""


@cache
def _factor(unit: str, si: str) -> Decimal | None:
    """Decimal factor from a unit to the SI unit, or None when the dimensions differ or the unit is unknown."""
    if (unit, si) in _COMMON:
        return _COMMON[unit, si]
    registry = _registry()
    try:
        return Decimal(registry.Quantity(Decimal(1), registry.parse_units(unit)).to(si).magnitude)
    except Exception:  # pint raises a dozen kinds, among them tokenizer errors, for a unit it cannot read or convert
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
                return self._bounded(value)
            raise self._error("the unit is missing")
        match = _QUANTITY.match(value) if len(value) <= _LONGEST else None
        if match is None:
            raise self._error("expected a number and a unit" if self.si else "expected a number")
        number, unit = match.groups()
        if not unit and self.si:
            raise self._error("the unit is missing")
        factor = self._unit_factor(unit)
        if factor is None:
            raise self._error(f"'{unit}' is not a unit of {self.dimension}")
        return self._bounded(Decimal(number) * factor)

    def _unit_factor(self, unit: str) -> Decimal | None:
        if not self.si:
            return Decimal(1) if not unit else None
        if self.si == "K":
            return TEMPERATURE_STEPS.get(unit)
        if not (unit == self.si or _UNIT.fullmatch(unit)):
            return None
        if self.si == "rad" and unit not in ANGLE_UNITS:
            return None  # to pint an angle is a pure number, and so is a percentage
        if self.si == "Hz" and not unit.endswith(("Hz", "hertz")):
            return None  # nor does it tell turns, or radians, from cycles
        if self.si == "rad/s" and unit.endswith(("Hz", "hertz")):
            return None
        return _factor(unit, self.si)

    def _bounded(self, exact: float | Decimal) -> float:
        try:
            si_value = float(exact)
        except OverflowError:
            si_value = math.inf
        if not math.isfinite(si_value):
            raise self._error("expected a finite number")
        if abs(si_value) > (LARGEST_ANGLE if self.si == "rad" else LARGEST) or 0 < abs(si_value) < SMALLEST:
            raise self._error("beyond all reason")
        if self.positive and si_value <= 0:
            raise self._error("must be greater than zero")
        if self.at_least_zero and math.copysign(1, si_value) < 0:
            raise self._error("must not be negative")
        return si_value

    def _error(self, reason: str) -> PydanticCustomError:
        example = f'"{self.example}"' if self.si else self.example
        return PydanticCustomError("quantity", "{reason}; write for example {example}", {"reason": reason, "example": example})

    def in_unit(self, si_value: float) -> float:
        """The number in the preferred unit, rounded as it may be."""
        factor = self._unit_factor(self.written)
        assert factor is not None, self.written
        return float(si_value) / float(factor)

    def write(self, si_value: float) -> str | float:
        """Text in the preferred unit which reads back to the same float; in SI where the preferred unit would round."""
        if not self.si:
            return float(si_value)
        factor = self._unit_factor(self.written)
        assert factor is not None, self.written
        exact = Decimal(repr(float(si_value))) / factor
        for digits in (15, 16, 17):
            # The designer's "5 deg" before the 5.000000000000001 that reads back to the same float.
            number = _plain(float(f"{exact:.{digits}g}"))
            if float(Decimal(number) * factor) == si_value:
                return f"{number} {self.written}"
        return f"{float(si_value)!r} {self.si}"

    @property
    def symbol(self) -> str:
        """The preferred unit as people write it: "N/µm"."""
        return signs(self.written)

    def number(self, si_value: float, digits: int = 5) -> str:
        """A number in the preferred unit, for people, without the unit; a dash where there is none."""
        return f"{self.in_unit(si_value):.{digits}g}" if math.isfinite(si_value) else "-"

    def told(self, si_value: float, digits: int = 5) -> str:
        """A number with the preferred unit, for people; a dash where there is none."""
        number = self.number(si_value, digits)
        return number if number == "-" else signs(f"{number} {self.written}".rstrip())

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.parse, serialization=core_schema.plain_serializer_function_ser_schema(self.write)
        )

    def __get_pydantic_json_schema__(self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """What an editor can check without knowing every unit; "x-kind" is folded into the description later."""
        sign = r"\+?" if self.positive or self.at_least_zero else "[+-]?"
        if not self.si:
            text = {"type": "string", "pattern": rf"^\s*{sign}{NUMBER}\s*$"}
            number: dict[str, Any] = {"type": "number"} | ({"minimum": 0} if self.at_least_zero else {})
            kind = f"a pure number, such as {self.example}"
            return {"anyOf": [number, text], "examples": [float(self.example)], "x-kind": kind}
        unit = f"(?:{'|'.join(sorted(ANGLE_UNITS))})" if self.si == "rad" else r"[A-Za-z\u00b5\u03bc].*"
        if self.si.startswith("1/"):
            unit = rf"(?:1\s*/\s*)?{unit}"
        pattern = rf"^\s*{sign}{NUMBER}\s*{unit}\s*$"
        kind = f'{"an" if self.dimension[0] in "aeiou" else "a"} {self.dimension} with its unit, such as "{self.example}"'
        return {"type": "string", "pattern": pattern, "examples": [self.example], "x-kind": kind}


_EXAMPLES = {
    "": "0.29", "GPa": "205", "N m/rad": "300", "N m s/rad": "0.1", "N s/m": "50", "N/um": "3", "N^2/um^2": "0.35",
    "1/K": "1.2e-5", "K": "5", "N": "15", "N m": "0.2", "deg": "70", "N/mm^2": "600", "rpm": "6000",
    "kg": "0.5", "kg mm^2": "120", "kg/m^3": "7870", "mm": "216", "mm^2": "130", "mm^4": "4500",
}  # fmt: skip


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
Damping = Annotated[float, Quantity("damping", "N s/m", "N s/m", at_least_zero=True)]
RotationalDamping = Annotated[float, Quantity("rotational damping", "N m s/rad", "N m s/rad", at_least_zero=True)]
RotationalStiffness = Annotated[float, Quantity("rotational stiffness", "N m/rad", "N m/rad", positive=True)]
Friction = Annotated[float, Quantity("force", "N", "N", at_least_zero=True)]
RotationalFriction = Annotated[float, Quantity("torque", "N m", "N m", at_least_zero=True)]
Pressure = Annotated[float, Quantity("pressure", "Pa", "GPa", positive=True)]
SpecificForce = Annotated[float, Quantity("specific force", "Pa", "N/mm^2", positive=True)]
Density = Annotated[float, Quantity("density", "kg/m^3", "kg/m^3", positive=True)]
Expansion = Annotated[float, Quantity("thermal expansion", "1/K", "1/K")]
Mass = Annotated[float, Quantity("mass", "kg", "kg", at_least_zero=True)]
Inertia = Annotated[float, Quantity("moment of inertia", "kg m^2", "kg mm^2", at_least_zero=True)]
ProductOfInertia = Annotated[float, Quantity("product of inertia", "kg m^2", "kg mm^2")]
Area = Annotated[float, Quantity("area", "m^2", "mm^2", positive=True)]
SecondMoment = Annotated[float, Quantity("second moment of area", "m^4", "mm^4", positive=True)]
Ratio = Annotated[float, Quantity("ratio", "", "", at_least_zero=True)]
Duration = Annotated[float, Quantity("time", "s", "s", positive=True)]
Speed = Annotated[float, Quantity("speed", "m/s", "m/s", positive=True)]
Acceleration = Annotated[float, Quantity("acceleration", "m/s^2", "m/s^2", positive=True)]
Jerk = Annotated[float, Quantity("jerk", "m/s^3", "m/s^3", positive=True)]
AngularSpeed = Annotated[float, Quantity("angular speed", "rad/s", "rad/s", positive=True)]
AngularAcceleration = Annotated[float, Quantity("angular acceleration", "rad/s^2", "rad/s^2", positive=True)]
AngularJerk = Annotated[float, Quantity("angular jerk", "rad/s^3", "rad/s^3", positive=True)]
