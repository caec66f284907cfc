"""What is inexact about a machine, as rows of deviations: one row per independent amount and direction.

A row says by how much each deviation of `study.deviating` is off when the amount is at its limit, or at one standard deviation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from trivet.errors import InputError, nearest, shown
from trivet.model import Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Joint, Revolute
from trivet.model.quantity import Quantity
from trivet.study.deviating import AXES, Deviating, Named, across
from trivet.study.tolerance_file import Heat, Misalignment, Play, Positioning, Size, Tolerance, Tolerances

Array = NDArray[Any]

LENGTH, ANGLE = Quantity("length", "m", "mm", positive=True), Quantity("angle", "rad", "deg", positive=True)
STEP, CHANGE = Quantity("change of temperature", "K", "K", positive=True), Quantity("change of temperature", "K", "K")
EXPANSION = Quantity("thermal expansion", "1/K", "1/K")
WORST = 3.0
"""Standard deviations that count as the worst of a normal distribution, which has no bound."""


class Source(NamedTuple):
    """An entry of a tolerance file."""

    kind: str
    """"tolerance", "misalignment", "positioning", "play" or "heat"."""
    name: str
    """Of what: "link.length", "hinge about x", "ball"."""
    size: str
    """In words: "± 0.02 mm", "sigma 0.01 mm", "radial 5 um", "5 K warmer"."""
    amounts: int
    """How many independent ones: one per copy, unless all copies are off by the same."""


class Amount(NamedTuple):
    """What one random number makes deviate; or one random vector, of two or three rows."""

    name: str
    rows: Array
    """(k, d + 3)."""
    variance: float
    """Of the factor of every row: 1 of a normal distribution; else, all places in a line, disc or ball of radius 1 being
    equally likely, 1/(k + 2)."""
    reach: float
    """Greatest length of the factors as a vector."""


@dataclass(frozen=True)
class Inexactness:
    """s sources of v amounts, which are r rows over d deviations of the chains and three of the tool tip."""

    sources: tuple[Source, ...]
    names: tuple[str, ...]
    """(v,) of the amounts."""
    source: Array
    """(v,) which source each amount is of."""
    rows: Array
    """(r, d + 3)."""
    amount: Array
    """(r,) which amount each row is of."""
    variance: Array
    """(v,) as `Amount.variance`."""
    reach: Array
    """(v,) as `Amount.reach`."""
    known: Array
    """(s, d + 3) deviations that are there for sure."""


class _Read(NamedTuple):
    name: str
    size: str
    amounts: list[Amount]
    known: Array | None = None


def inexactness(machine: Machine, given: Tolerances) -> Inexactness:
    """What is inexact, looked up in a machine.

    Raises:
        InputError: with the entry, the key, the value and what was expected.
    """
    reader = Deviating(machine)
    sources, amounts, owners, known = list[Source](), list[Amount](), list[int](), list[Array]()
    for kind, read in _READERS.items():
        for place, entry in enumerate(getattr(given, kind), 1):
            try:
                found = read(reader, entry)
            except InputError as error:
                raise InputError(f"{kind} {place}: {error}") from None
            owners += [len(sources)] * len(found.amounts)
            sources.append(Source(kind, found.name, found.size, len(found.amounts)))
            amounts += found.amounts
            known.append(reader.nothing if found.known is None else found.known)
    if not sources:
        raise InputError(f"nothing is said to be inexact; name a {', a '.join(_READERS)}")
    return Inexactness(
        tuple(sources),
        tuple(one.name for one in amounts),
        np.array(owners, dtype=int),
        np.concatenate([one.rows for one in amounts]) if amounts else reader.nothing[None][:0],
        np.repeat(np.arange(len(amounts)), [len(one.rows) for one in amounts]),
        np.array([one.variance for one in amounts]),
        np.array([one.reach for one in amounts]),
        np.array(known),
    )


def _tolerance(reader: Deviating, given: Tolerance) -> _Read:
    parts, kind = reader.dimension(given.of)
    size, law = _spread(given, Quantity(kind.dimension, kind.si, kind.written, positive=True))
    return _Read(given.of, law.words, law.amounts(given.of, _times(parts, size), given.common))


def _misalignment(reader: Deviating, given: Misalignment) -> _Read:
    way, axis = _axis(given)
    size, law = _spread(given, LENGTH if way == "along" else ANGLE)
    end = f" {way} {AXES[axis]}"
    found = reader.elements(given.of, Element, "joint or body")
    parts = [Named(reader.name(k, e.name) + end, reader.row(k, way, e.name, axis)) for k, e in found]
    return _Read(given.of + end, law.words, law.amounts(given.of + end, _times(parts, size), given.common))


def _positioning(reader: Deviating, given: Positioning) -> _Read:
    parts = []
    for k, joint in reader.held(given.of):
        size, law = _spread(given, _coordinate(joint, given.plus_minus, given.sigma))
        lever = _lever(joint, given.plus_minus, given.sigma)
        parts.append(Named(reader.name(k, joint.name), reader.row(k, "drive", joint.name, size=size / lever)))
    return _Read(given.of, law.words, law.amounts(given.of, parts, given.common))


_ALL: tuple[Literal["along"], None] = "along", None
"""Of a clearance across a joint."""


def _play(reader: Deviating, given: Play) -> _Read:
    sizes = {key: value for key in ("radial", "backlash", "gap") if (value := getattr(given, key)) is not None}
    if len(sizes) != 1:
        raise InputError("needs one of radial, backlash, and gap with along or about")
    ((key, size),) = sizes.items()
    if key != "gap" and (given.along or given.about):
        raise InputError(f"{key}: goes without along and about, which say where a gap is")
    end, amounts, kind = "", list[Amount](), LENGTH
    if key == "backlash":
        for k, joint in reader.held(given.joint):
            kind = _coordinate(joint, size)
            half = _read(key, size, kind) / 2 / _lever(joint, size)
            amounts.append(_BOUNDED.amount(reader.name(k, joint.name), reader.row(k, "drive", joint.name, size=half)[None]))
    else:
        way, axis = _axis(given) if key == "gap" else _ALL
        kind, end = (LENGTH if way == "along" else ANGLE), ("" if axis is None else f" {way} {AXES[axis]}")
        half = _read(key, size, kind) / 2
        for k, element in reader.elements(given.joint, Joint, "joint"):
            rows = np.array([reader.row(k, way, element.name, number, half) for number in range(len(AXES))])
            own = across(element) @ rows if axis is None else rows[axis : axis + 1]
            amounts.append(_BOUNDED.amount(reader.name(k, element.name) + end, own))
    return _Read(given.joint + end, f"{key} {_written(size, kind)}", amounts)


def _heat(reader: Deviating, given: Heat) -> _Read:
    name = ", ".join(given.bodies) or "all bodies"
    is_spread = given.plus_minus is not None or given.sigma is not None
    if given.warmer is None and not is_spread:
        raise InputError(f'needs warmer, plus_minus or sigma, a {STEP.dimension} such as "{STEP.example}"')
    words, amounts, sure = list[str](), list[Amount](), 0.0
    if given.warmer is not None:
        sure = _read("warmer", given.warmer, CHANGE)
        words.append(f"{_written(given.warmer, CHANGE)} warmer")
    size, law = _spread(given, STEP) if is_spread else (0.0, _BOUNDED)
    row = _grown(reader, given)
    if is_spread:
        words.append(law.words)
        amounts = [law.amount(name, row[None] * size)]
    return _Read(name, " ".join(words), amounts, row * sure)


def _grown(reader: Deviating, given: Heat) -> Array:
    """(d + 3,) deviations where bodies are warmer by 1 K."""
    expansion = None if given.expansion is None else _read("expansion", given.expansion, EXPANSION)
    growths = list(reader.growths())
    known = {own for body in growths for own in body.names}
    for body in given.bodies:
        if body not in known:
            raise InputError(f"bodies: {body}: no body of this name has a length that grows{nearest(body, known)}")
    row = reader.nothing
    for growth in growths:
        if not given.bodies or set(given.bodies) & set(growth.names):
            own = _expansion(reader.machine, growth.names[-1], growth.material) if expansion is None else expansion
            row += own * growth.row
    return row


_READERS: dict[str, Callable[[Deviating, Any], _Read]] = {
    "tolerance": _tolerance,
    "misalignment": _misalignment,
    "positioning": _positioning,
    "play": _play,
    "heat": _heat,
}


def _expansion(machine: Machine, body: str, material: str | None) -> float:
    if material is None:
        raise InputError(f"{body}: is of no material; name bodies, and give these an expansion such as {EXPANSION.example}")
    found = machine.materials[material].expansion
    if found is None:
        raise InputError(f"{body}: its material {material} has no expansion; give it one, or give expansion here")
    return float(found)


class _Law(NamedTuple):
    """How an amount is spread."""

    is_normal: bool
    words: str = ""

    def amount(self, name: str, rows: Array) -> Amount:
        return Amount(name, rows, 1.0, WORST) if self.is_normal else Amount(name, rows, 1 / (len(rows) + 2), 1.0)

    def amounts(self, name: str, parts: list[Named], common: bool) -> list[Amount]:
        """One for all, or one for each."""
        if common:
            return [self.amount(name, np.sum([part.row for part in parts], axis=0)[None])]
        return [self.amount(part.name, part.row[None]) for part in parts]


_BOUNDED = _Law(False)


def _times(parts: list[Named], size: float) -> list[Named]:
    return [Named(part.name, part.row * size) for part in parts]


_Spreading: TypeAlias = Tolerance | Misalignment | Positioning | Heat


def _spread(given: _Spreading, kind: Quantity) -> tuple[float, _Law]:
    if (given.plus_minus is None) == (given.sigma is None):
        raise InputError(f'needs either plus_minus or sigma, a {kind.dimension} such as "{kind.example}"')
    if given.plus_minus is not None:
        return _read("plus_minus", given.plus_minus, kind), _Law(False, f"± {_written(given.plus_minus, kind)}")
    assert given.sigma is not None
    return _read("sigma", given.sigma, kind), _Law(True, f"sigma {_written(given.sigma, kind)}")


def _axis(given: Misalignment | Play) -> tuple[Literal["along", "about"], int]:
    if (given.along is None) == (given.about is None):
        raise InputError("needs either along or about, an axis of its own frame")
    if given.along is not None:
        return "along", AXES.index(given.along)
    return "about", AXES.index(str(given.about))


def _coordinate(joint: Drivable, *sizes: Size | None) -> Quantity:
    """Of what kind a deviation of a drive's coordinate is."""
    if isinstance(joint, Curvilinear):
        return LENGTH if any(_is_length(size) for size in sizes) else ANGLE
    return ANGLE if isinstance(joint, Revolute) else LENGTH


def _lever(joint: Drivable, *sizes: Size | None) -> float:
    """Length along the guide per unit of the coordinate, where the size is told along the guide."""
    return float(joint.radius) if isinstance(joint, Curvilinear) and any(_is_length(size) for size in sizes) else 1.0


def _is_length(size: Size | None) -> bool:
    try:
        LENGTH.parse(size)
    except PydanticCustomError:
        return False
    return True


def _read(key: str, size: Size, kind: Quantity) -> float:
    """A size in SI; numbers are in SI."""
    try:
        return kind.parse(size if isinstance(size, str) else f"{float(size)!r} {kind.si}")
    except PydanticCustomError as error:
        raise InputError(f"{key}: {shown(size)}: {error.message()}") from None


def _written(size: Size, kind: Quantity) -> str:
    """A size as it was written."""
    return size if isinstance(size, str) else str(kind.write(float(size)))
