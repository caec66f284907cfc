"""Quantities: text with a unit is read to the nearest float, and every float is written so that it reads back."""

from __future__ import annotations

import math
import struct
from fractions import Fraction
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic_core import PydanticCustomError

from trivet.model import quantity
from trivet.model.quantity import LARGEST, LARGEST_ANGLE, SMALLEST, Quantity

KINDS: dict[str, Quantity] = {
    name: get_args(kind)[1]
    for name, kind in vars(quantity).items()
    if get_args(kind) and len(get_args(kind)) == 2 and isinstance(get_args(kind)[1], Quantity)
}
LENGTH, ANGLE, STIFFNESS = KINDS["Length"], KINDS["AngleValue"], KINDS["Stiffness"]

# Exact factors to SI, from the definitions of the units.
EXACT: list[tuple[Quantity, str, Fraction]] = [
    (LENGTH, "m", Fraction(1)),
    (LENGTH, "mm", Fraction(1, 10**3)),
    (LENGTH, "um", Fraction(1, 10**6)),
    (LENGTH, "\N{MICRO SIGN}m", Fraction(1, 10**6)),
    (LENGTH, "\N{GREEK SMALL LETTER MU}m", Fraction(1, 10**6)),
    (LENGTH, "in", Fraction(254, 10**4)),
    (LENGTH, "ft", Fraction(3048, 10**4)),
    (STIFFNESS, "N/um", Fraction(10**6)),
    (STIFFNESS, "kN / mm", Fraction(10**6)),
    (KINDS["StiffnessVariance"], "N^2/um^2", Fraction(10**12)),
    (KINDS["StiffnessVariance"], "N**2/um**2", Fraction(10**12)),
    (KINDS["StiffnessVariance"], "N²/um²", Fraction(10**12)),
    (KINDS["RotationalStiffness"], "N mm/mrad", Fraction(1)),
    (KINDS["Pressure"], "GPa", Fraction(10**9)),
    (KINDS["Pressure"], "N/mm^2", Fraction(10**6)),
    (KINDS["Density"], "g/cm^3", Fraction(10**3)),
    (KINDS["Mass"], "g", Fraction(1, 10**3)),
    (KINDS["Inertia"], "kg mm^2", Fraction(1, 10**6)),
    (KINDS["Area"], "mm^2", Fraction(1, 10**6)),
    (KINDS["SecondMoment"], "mm^4", Fraction(1, 10**12)),
    (ANGLE, "rad", Fraction(1)),
    (ANGLE, "mrad", Fraction(1, 10**3)),
]


@pytest.mark.parametrize(("words", "told"), [
    ("3 N/um", "3 N/µm"), ("-5 deg", "-5°"), ("deg", "°"), ("N^2/um^2", "(N/µm)²"), ("2 urad", "2 µrad"), ("kg mm^2", "kg mm²"),
    ("mm^4", "mm⁴"), ("m/s^3", "m/s³"), ("degree of a sum, drum", "degree of a sum, drum"),
])  # fmt: skip
def test_units_have_the_signs_that_people_write(words: str, told: str) -> None:
    assert quantity.signs(words) == told


def test_numbers_are_told_in_the_preferred_unit() -> None:
    assert STIFFNESS.told(3.1234567e6) == "3.1235 N/µm"
    assert STIFFNESS.told(3.1234567e6, 3) == "3.12 N/µm"
    assert ANGLE.told(math.radians(30)) == "30°"
    assert KINDS["Ratio"].told(0.25) == "0.25"
    assert (STIFFNESS.symbol, STIFFNESS.number(2e6)) == ("N/µm", "2")
    for none in (math.nan, math.inf):
        assert STIFFNESS.told(none) == STIFFNESS.number(none) == "-"


def largest(kind: Quantity) -> float:
    return LARGEST_ANGLE if kind.si == "rad" else LARGEST


def test_what_is_beyond_all_reason() -> None:
    for kind, text in (
        (LENGTH, "1e25 m"),
        (LENGTH, "-1e25 m"),
        (LENGTH, "1e-31 m"),
        (ANGLE, "1001 rad"),
        (STIFFNESS, "1e300 N/m"),
    ):
        with pytest.raises(ValueError, match="beyond all reason"):
            kind.parse(text)


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=300)
@given(value=st.floats(min_value=-1e24, max_value=1e24))
def test_writing_and_reading_gives_the_same_bits(name: str, value: float) -> None:
    kind = KINDS[name]
    value = 0.0 if abs(value) < SMALLEST else math.remainder(value, largest(kind))
    if (kind.positive and value <= 0) or (kind.at_least_zero and math.copysign(1, value) < 0):
        value = abs(value) or 1.0
    assert bits(kind.parse(kind.write(value))) == bits(value)


@pytest.mark.parametrize(("kind", "unit", "factor"), EXACT, ids=[f"{kind.dimension} in {unit}" for kind, unit, _ in EXACT])
@settings(max_examples=100)
@given(value=st.floats(min_value=1e-12, max_value=999.0))
def test_reading_is_exact(kind: Quantity, unit: str, factor: Fraction, value: float) -> None:
    assert kind.parse(f"{value!r} {unit}") == float(Fraction(repr(value)) * factor)


@pytest.mark.parametrize(
    ("kind", "text", "expected"),
    [
        (STIFFNESS, "3 N/um", 3e6),
        (LENGTH, "216 mm", 0.216),
        (LENGTH, "  .5e+1cm ", 0.05),
        (LENGTH, "-7. mm", -0.007),
        (LENGTH, "\N{NO-BREAK SPACE}216\N{NO-BREAK SPACE}mm", 0.216),
        (ANGLE, "180 deg", math.pi),
        (ANGLE, "-90 deg", -math.pi / 2),
        (ANGLE, "1 turn", 2 * math.pi),
        (KINDS["Ratio"], 0.29, 0.29),
        (KINDS["Ratio"], "0.29", 0.29),
    ],
)
def test_known_values(kind: Quantity, text: Any, expected: float) -> None:
    assert bits(kind.parse(text)) == bits(expected)


@pytest.mark.parametrize(
    ("kind", "si_value", "text"),
    [
        (LENGTH, 0.216, "216 mm"),
        (LENGTH, 0.0, "0 mm"),
        (LENGTH, -0.0, "-0 mm"),
        (LENGTH, 1.7e308, "1.7e+308 m"),
        (STIFFNESS, 3e6, "3 N/um"),
        (ANGLE, math.pi, "180 deg"),
        (KINDS["Ratio"], 0.29, 0.29),
    ],
)
def test_written_as_people_write(kind: Quantity, si_value: float, text: Any) -> None:
    assert kind.write(si_value) == text


@pytest.mark.parametrize("name", KINDS)
def test_the_example_in_every_message_is_right(name: str) -> None:
    kind = KINDS[name]
    with pytest.raises(PydanticCustomError, match="write for example ") as caught:
        kind.parse([])
    assert str(caught.value).endswith(f'"{kind.example}"' if kind.si else kind.example)
    assert kind.parse(kind.example) > 0


@pytest.mark.parametrize(
    "text",
    [
        "1",
        "mm",
        "",
        "1 mm 2",
        "1e1000 mm",
        "1 mm^12",
        "1 (m)",
        "1 m/s",
        "0x10 mm",
        "1_000 mm",
        "1,5 mm",
        "٣ mm",
        "--1 mm",
        "1 m" + " " * 99,
    ],
)
def test_what_is_no_length(text: str) -> None:
    with pytest.raises(PydanticCustomError):
        LENGTH.parse(text)


def test_an_angle_has_a_unit_of_angle() -> None:
    for text in ("1", "1 %", "1 m/m", "1 Hz s", "1 sr"):
        with pytest.raises(PydanticCustomError):
            ANGLE.parse(text)
