"""Channels and units of measured responses as files have them: "12:+z", "3:-rx", "m/s^2/N"."""

from __future__ import annotations

import math
import re

from pydantic_core import PydanticCustomError

from trivet.errors import InputError, shown
from trivet.measure.functions import Channel, Motion
from trivet.model.quantity import ANGLE_UNITS, Quantity

LONGEST_NAME = 80
"""Letters in the name of a point."""
UNIT_LENGTH = 1e-3
"""How far the length of a direction may be from 1 until it counts as no unit vector."""
_AXIS = re.compile(r"([+-])(r?)([xyz])")
_OBLIQUE = re.compile(r"(r?)\(([^,()]+),([^,()]+),([^,()]+)\)")
_EXAMPLES = 'expected a point and a direction, such as "12:+z", "3:-rx" or "7:(0.6, 0, 0.8)"'


def channel_of(text: str) -> Channel:
    """A channel as `Channel` writes it: the name of a point, a colon, and an axis with its sign or three components.

    Raises:
        InputError: for another text, an empty or long name, or a direction that is no unit vector.
    """
    point, _, way = text.strip().rpartition(":")
    if not is_name(point):
        raise InputError(f"channel {shown(text)}: {_EXAMPLES}")
    if along := _AXIS.fullmatch(way):
        sign, turn, axis = along.groups()
        value = -1.0 if sign == "-" else 1.0
        x, y, z = (value if axis == letter else 0.0 for letter in "xyz")
        return Channel(point, (x, y, z), bool(turn))
    if oblique := _OBLIQUE.fullmatch(way):
        turn, *components = oblique.groups()
        try:
            return Channel(point, _unit_vector([float(c) for c in components]), bool(turn))
        except ValueError as error:
            raise InputError(f"channel {shown(text)}: {error}") from None
    raise InputError(f"channel {shown(text)}: {_EXAMPLES}")


def is_name(point: str) -> bool:
    """Whether a text can name a point."""
    return 0 < len(point) <= LONGEST_NAME and point.isprintable() and point == point.strip()


def written(channel: Channel) -> str:
    """A channel in full, so that `channel_of` gives it back to the last digit."""
    size = [abs(c) for c in channel.direction]
    if sorted(size) == [0.0, 0.0, 1.0]:
        return str(channel)
    components = ", ".join(repr(float(c)) for c in channel.direction)
    return f"{channel.point}:{'r' if channel.is_rotation else ''}({components})"


def _unit_vector(components: list[float]) -> tuple[float, float, float]:
    length = math.hypot(*components)
    if not abs(length - 1) <= UNIT_LENGTH:  # a NaN is none either
        raise ValueError(f"the direction has length {length:g}; expected a unit vector")
    x, y, z = components if abs(length - 1) < 1e-12 else [c / length for c in components]
    return x, y, z


def unit_of(motion: Motion, response: Channel, reference: Channel) -> str:
    """The SI unit of a function, "m/s^2/N"; of rotations "rad" for "m", of moments "(N m)" for "N"."""
    along = "rad" if response.is_rotation else "m"
    per = {"displacement": along, "velocity": f"{along}/s", "acceleration": f"{along}/s^2"}[motion]
    return f"{per}/{'(N m)' if reference.is_rotation else 'N'}"


def factor_of(unit: str, motion: Motion, response: Channel, reference: Channel) -> float:
    """SI value of one unit of a function; the g of an acceleration is that of free fall, 9.80665 m/s^2.

    Raises:
        InputError: for a text that is no unit of this motion per load.
    """
    si = unit_of(motion, response, reference)
    # An angle is a pure number to units, so that "mm/N/m" would pass for "rad/N": the first name has to say it.
    starts_with_angle = bool((first := re.match(r"\s*([^\W\d_]+)", unit)) and first[1] in ANGLE_UNITS)
    # Else g is the gram, which no motion has.
    given = re.sub(r"^\s*g\b", "gravity", _plain(unit)) if motion == "acceleration" else _plain(unit)
    try:
        if starts_with_angle != response.is_rotation:
            raise ValueError
        return Quantity(f"{motion} per load", _plain(si), _plain(si)).parse(f"1 {given}")
    except (ValueError, PydanticCustomError):
        raise InputError(f"unit {shown(unit)}: is no unit of {motion} per load; expected one such as {si}") from None


def _plain(unit: str) -> str:
    """Without brackets, as units are read."""
    return unit.replace("/(N m)", "/N/m")
