"""What is inexact about a machine: tolerances, misalignments, drives, play and warm bodies (TOML, with units).

Sizes are text with a unit, or numbers in SI where they are given in Python: which unit it is depends on what deviates, so they
are read against the machine (`inexactness`).
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool, StringConstraints
from pydantic_core import PydanticCustomError

from trivet.errors import InputError
from trivet.model.checked import read_checked
from trivet.model.section import STRICT

MOST = 1000
"""Entries of one kind."""


def _text(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        raise PydanticCustomError("quantity", 'the unit is missing; write for example "0.02 mm"')
    return value


Text = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=200)]
Size = Annotated[Text | float, BeforeValidator(_text)]
"""Text with a unit; in Python also a number in SI."""
AxisName = Literal["x", "y", "z"]


@dataclass(frozen=True)
class Tolerance:
    """A number of the machine file that is off."""

    __pydantic_config__ = STRICT

    of: Text
    """Its key path, as for settings: "link.length" of every copy of the chain, "leg-2.link.length" of one."""
    plus_minus: Size | None = None
    """It is off by no more than this, all that equally likely."""
    sigma: Size | None = None
    """Or normally distributed with this standard deviation."""
    common: StrictBool = False
    """Whether all copies are off by the same; each on its own when not given."""


@dataclass(frozen=True)
class Misalignment:
    """A joint or a body that stands askew or aside, for which the machine file has no number."""

    __pydantic_config__ = STRICT

    of: Text
    """The joint or body: "hinge" in every chain that has it, "leg-2.hinge" in one."""
    along: AxisName | None = None
    """Axis of its own frame along which it is off, by a length."""
    about: AxisName | None = None
    """Or about which it is turned, by an angle."""
    plus_minus: Size | None = None
    sigma: Size | None = None
    common: StrictBool = False


@dataclass(frozen=True)
class Positioning:
    """A drive, or a joint that is locked, which does not stand where it is said to stand."""

    __pydantic_config__ = STRICT

    of: Text
    """The joint."""
    plus_minus: Size | None = None
    """A length; of a hinge an angle; of a carriage on a circle either, the length along its guide."""
    sigma: Size | None = None
    common: StrictBool = False


@dataclass(frozen=True)
class Play:
    """A joint that is loose; sizes are the whole way from stop to stop."""

    __pydantic_config__ = STRICT

    joint: Text
    radial: Size | None = None
    """Clearance across the joint's freedom: of balls and crosses in all directions, of hinges and slides in two."""
    backlash: Size | None = None
    """Of a drive, along its own coordinate."""
    along: AxisName | None = None
    """Axis of its own frame for `gap`, a length."""
    about: AxisName | None = None
    """Or about which `gap` is an angle."""
    gap: Size | None = None


@dataclass(frozen=True)
class Heat:
    """Bodies that are warmer than when they were measured; all lengths of a body grow."""

    __pydantic_config__ = STRICT

    bodies: Annotated[tuple[Text, ...], Field(max_length=MOST)] = ()
    """Joints and bodies by name, "platform", "ground"; all of them when not given.  They are equally warm."""
    warmer: Size | None = None
    """By how much for sure, "5 K"; none when not given."""
    plus_minus: Size | None = None
    """By how much more or less."""
    sigma: Size | None = None
    expansion: Size | None = None
    """Of these bodies; that of their materials when not given."""


@dataclass(frozen=True)
class Tolerances:
    """All that is inexact about a machine."""

    __pydantic_config__ = STRICT

    tolerance: Annotated[tuple[Tolerance, ...], Field(max_length=MOST)] = ()
    misalignment: Annotated[tuple[Misalignment, ...], Field(max_length=MOST)] = ()
    positioning: Annotated[tuple[Positioning, ...], Field(max_length=MOST)] = ()
    play: Annotated[tuple[Play, ...], Field(max_length=MOST)] = ()
    heat: Annotated[tuple[Heat, ...], Field(max_length=MOST)] = ()
    format: Literal[1] = 1
    """Version of the file format."""


def read_tolerances(path: str | os.PathLike[str]) -> Tolerances:
    """Read a tolerance file.

    Raises:
        InputError: with the file, the key, the value and what was expected; for a file that names nothing.
    """
    found = read_checked(path, Tolerances, "a tolerance file")
    if not (found.tolerance or found.misalignment or found.positioning or found.play or found.heat):
        raise InputError(f"{os.fspath(path)}: names nothing that is inexact; begin with [[tolerance]], of and plus_minus")
    return found
