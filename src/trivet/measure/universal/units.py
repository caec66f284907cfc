"""Units of functions in universal files: by labels beside the numbers, by dataset 164, or as declared; never guessed."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from pydantic_core import PydanticCustomError

from trivet.errors import InputError, shown
from trivet.measure.functions import MOTIONS, Motion
from trivet.measure.universal.plain import Fields
from trivet.measure.universal.scan import Block
from trivet.model.quantity import Quantity

MOTION_OF: dict[int, Motion] = {8: "displacement", 11: "velocity", 12: "acceleration"}
"""Specific data types that are motions."""
LOADS = (9, 13)
"""Those that are loads: reaction and excitation."""
UNKNOWN = (0, 1)
APART = 1e-3
"""Beyond which, against each other, two factors contradict: labels round, and pounds have many digits."""
EXAMPLE = 'say what they are, as in --units "m/s^2 per N"'

SI = {
    "displacement": ("m", "rad"),
    "velocity": ("m/s", "rad/s"),
    "acceleration": ("m/s^2", "rad/s^2"),
}
"""Units of motions and of turns."""
HERTZ = {"hz": 1.0, "khz": 1e3, "cps": 1.0, "rad/s": 0.5 / math.pi}
"""Units of frequencies as they are labelled, in any case; of 1/s, Bq and rpm nobody knows whether they are cycles."""
_POUND = 4.4482216152605
CODES = {
    1: ("m and N", 1.0, 1.0),
    2: ("feet and pounds", 0.3048, _POUND),
    3: ("m and kgf", 1.0, 9.80665),
    4: ("feet and poundals", 0.3048, 0.138254954376),
    5: ("mm and mN", 1e-3, 1e-3),
    6: ("cm and cN", 1e-2, 1e-2),
    7: ("inches and pounds", 0.0254, _POUND),
    8: ("mm and kgf", 1e-3, 9.80665),
    10: ("mm and N", 1e-3, 1.0),
}
"""Units by the codes of dataset 164: in words, m and N of one of each."""
_FREE_FALL = {"g", "gn", "g_n", "g's", "gees"}


class Scale(NamedTuple):
    """Units of a file by dataset 164."""

    length: float
    """m, of its unit of length."""
    force: float
    """N, of its unit of force."""


class Declared(NamedTuple):
    """Units that the user declares; None where the file is to tell."""

    response: str | None = None
    reference: str | None = None
    length: str | None = None


class Unit(NamedTuple):
    """What a function is, and its unit."""

    motion: Motion
    factor: float
    """SI of one of its unit."""
    words: str
    """As in "g per N"."""


def declared(text: str | None) -> Declared:
    """Units from text such as "m/s^2 per N", "mm", or "g per lbf, in": response per load, and the unit in which points lie.

    Raises:
        InputError: for text that is neither.
    """
    found = Declared()
    for part in [] if text is None else text.split(","):
        top, _, bottom = (side.strip() for side in part.partition(" per "))
        is_motion = any(_factor(si, top) for pair in SI.values() for si in pair)
        said = Declared()
        if bottom and is_motion and (_factor("N", bottom) or _factor("N m", bottom)):
            said = Declared(top, bottom)
        elif not bottom and _factor("m", top):
            said = Declared(length=top)
        again = any(one is not None and other is not None for one, other in zip(found, said, strict=True))
        if again or said == Declared():
            what = "is a second one of its kind" if again else "is no motion per load and no length"
            example = 'write for example "m/s^2 per N", or "g per lbf, mm" where points lie in mm'
            raise InputError(f'--units "{text}": {shown(part.strip())} {what}; {example}')
        found = Declared(*(new if old is None else old for old, new in zip(found, said, strict=True)))
    return found


def is_none(word: str) -> bool:
    """Whether a word of a file says nothing."""
    return word.strip().upper() in ("", "NONE")


def scale_of(block: Block, fields: Fields, given: Declared) -> Scale | None:
    """What a dataset 164 says, of which factors count; None where it contradicts itself and units are declared.

    Raises:
        InputError: where its code and its factors, which take SI to the units of the file, contradict each other.
    """
    found = Scale(1 / fields["length"], 1 / fields["force"])
    words, *sizes = CODES.get(fields["units_code"], ("", *found))
    if all(abs(own / size - 1) <= APART for own, size in zip(found, sizes, strict=True)):
        return found
    if given != Declared():
        return None
    what = f"code {fields['units_code']} says {words}, its factors {found.length:.6g} m and {found.force:.6g} N"
    raise block.error(f'contradiction: {what}; say what holds, as in --units "m/s^2 per N, mm"', 2)


def told_unit(block: Block, fields: Fields, turns: tuple[bool, bool], scale: Scale | None, given: Declared) -> Unit:
    """What a function is and its unit.

    Args:
        block: its dataset.
        fields: what pyuff made of it.
        turns: whether its response is a rotation, whether its reference is a moment.
        scale: what dataset 164 of its file says.
        given: what the user declares, which goes before what the file says.

    Raises:
        InputError: where the reference is no load or the response no motion, where nothing tells the unit, and where what the
            file says of it contradicts itself or what is declared.
    """
    motions = _motions(block, fields)
    _check_exponents(block, fields, turns)
    response, reference = _label(fields, "ordinate"), _label(fields, "orddenom")
    if given.response is not None:
        told = _told(given.response, given.reference, motions, turns)
        if told is None:
            what = f"{given.response} per {given.reference} is declared"
            raise block.error(f"{what}; its response is {_article(motions, turns)}")
        return told
    if response is None and reference is None:
        return _by_scale(block, fields, motions, turns, scale)
    known = _known(fields, turns, scale) if len(motions) == 1 else (None, None)
    told = _told(response, reference, motions, turns, known)
    if told is None:
        words = f"{response or 'none'} per {reference or 'none'}"
        raise block.error(f'units "{words}" are not those of {_article(motions, turns)} per load; {EXAMPLE}', 10)
    if scale is not None:
        top, bottom = _scaled(turns, scale)
        if abs(told.factor / (top / bottom) - 1) > APART:
            system = f"dataset 164 counts lengths in {scale.length:.6g} m and forces in {scale.force:.6g} N"
            raise block.error(f'contradiction: its labels say "{told.words}", {system}; {EXAMPLE}', 10)
    return told


def hertz(block: Block, fields: Fields) -> float:
    """Hz of one of the units of the abscissa."""
    kind, label = fields["abscissa_spec_data_type"], _label(fields, "abscissa")
    if kind not in (*UNKNOWN, 18):
        raise block.error(f"its abscissa is of type {kind}; expected 18, frequency", 9)
    if label is None:
        return 1.0
    found = HERTZ.get(label.lower().removeprefix("(").removesuffix(")").strip())
    if found is None:
        raise block.error(f"{shown(label)} is no unit of frequency; expected Hz, kHz, cps or rad/s", 9)
    return found


def metres(block: Block, scale: Scale | None, given: Declared) -> float:
    """m of one of the units in which points lie."""
    if given.length is not None:
        return _factor("m", given.length) or math.nan
    if scale is None:
        raise block.error('no dataset 164 tells in which unit points lie; say it, as in --units "mm"')
    return scale.length


def _motions(block: Block, fields: Fields) -> tuple[Motion, ...]:
    """What the response may be by its type; raises InputError where the reference is no load."""
    response, reference = fields["ordinate_spec_data_type"], fields["orddenom_spec_data_type"]
    if response not in (*MOTION_OF, *UNKNOWN):
        what = "a load" if response in LOADS else f"of type {response}"
        raise block.error(f"its response is {what}; expected 8 displacement, 11 velocity or 12 acceleration", 10)
    if reference not in (*LOADS, *UNKNOWN):
        what = f"a motion (type {reference})" if reference in MOTION_OF else f"of type {reference}"
        raise block.error(f"its reference is {what}; expected a load: 13, or 9", 11)
    return (MOTION_OF[response],) if response in MOTION_OF else MOTIONS


def _check_exponents(block: Block, fields: Fields, turns: tuple[bool, bool]) -> None:
    """Exponents of length and force may be left out; where they are not, they are those of a motion and of a load."""
    wanted = {"ordinate": (0 if turns[0] else 1, 0), "orddenom": (1 if turns[1] else 0, 1)}
    for side, record in (("ordinate", 10), ("orddenom", 11)):
        exponents = (fields[f"{side}_len_unit_exp"], fields[f"{side}_force_unit_exp"])
        if exponents not in ((0, 0), wanted[side]):
            word = "response" if side == "ordinate" else "reference"
            what = f"exponents of length and force of its {word} are {exponents[0]} and {exponents[1]}"
            raise block.error(f"contradiction: {what}, those of its kind {wanted[side][0]} and {wanted[side][1]}", record)


def _label(fields: Fields, side: str) -> str | None:
    text = str(fields.get(f"{side}_axis_units_lab", "")).strip()
    return None if is_none(text) else text


def _by_scale(block: Block, fields: Fields, motions: tuple[Motion, ...], turns: tuple[bool, bool], scale: Scale | None) -> Unit:
    """From dataset 164 alone, which needs to be told what the function is."""
    if len(motions) > 1 or fields["orddenom_spec_data_type"] in UNKNOWN:
        raise block.error(f"neither types nor labels say what its response and its reference are; {EXAMPLE}", 10)
    if scale is None:
        raise block.error(f"neither labels nor a dataset 164 tell its units; {EXAMPLE}", 10)
    top, bottom = _scaled(turns, scale)
    return Unit(motions[0], top / bottom, f"{_words(motions[0], turns, scale)} (dataset 164)")


def _words(motion: Motion, turns: tuple[bool, bool], scale: Scale) -> str:
    """Units of dataset 164: "0.001 m/s^2 per 0.001 N"."""
    top, bottom = _scaled(turns, scale)
    plain = [f"{'' if size == 1 else f'{size:.6g} '}" for size in (top, bottom)]
    return f"{plain[0]}{SI[motion][turns[0]]} per {plain[1]}{'N m' if turns[1] else 'N'}"


def _scaled(turns: tuple[bool, bool], scale: Scale) -> tuple[float, float]:
    """SI of the units of response and reference by dataset 164."""
    return 1.0 if turns[0] else scale.length, scale.force * (scale.length if turns[1] else 1.0)


def _known(fields: Fields, turns: tuple[bool, bool], scale: Scale | None) -> tuple[float | None, float | None]:
    """The same, where the types say what they are."""
    if scale is None:
        return None, None
    top, bottom = _scaled(turns, scale)
    return top, bottom if fields["orddenom_spec_data_type"] in LOADS else None


def _told(
    response: str | None,
    reference: str | None,
    motions: tuple[Motion, ...],
    turns: tuple[bool, bool],
    known: tuple[float | None, float | None] = (None, None),
) -> Unit | None:
    """From labels; one that is missing is as known otherwise. A label may hold both: "m/s^2/N"."""
    load = "N m" if turns[1] else "N"
    for motion in motions:
        si = SI[motion][turns[0]]
        if response is not None and reference is None:
            both = _factor(f"{si}/{load.replace(' ', '/')}", response)
            if both is not None:
                return Unit(motion, both, response)
        top = known[0] if response is None else _factor(si, response)
        bottom = known[1] if reference is None else _factor(load, reference)
        if top is not None and bottom is not None:
            words = f"{response or 'as dataset 164'} per {reference or 'as dataset 164'}"
            return Unit(motion, top / bottom, words)
    return None


def _article(motions: tuple[Motion, ...], turns: tuple[bool, bool]) -> str:
    if len(motions) > 1:
        return "a motion"
    word = f"{'angular ' if turns[0] else ''}{motions[0]}"
    return f"{'an' if word[0] == 'a' else 'a'} {word}"


def _factor(si: str, label: str) -> float | None:
    """SI of one of a unit as programs write it: "m/s2", "(m/s²)/N", "(1/N)*(m/s²)", "g", "LBF"; None where it is none."""
    text = re.sub(r"^\(1/([^()]+)\)\s*\*?\s*\(([^()]+)\)$", r"\2/\1", label.strip())
    text = re.sub(r"^\(([^()]+)\)(?=/|$)", r"\1", text)
    text = re.sub(r"(?<=[^\W\d_])([1-4])(?![\w.])", r"^\1", text)
    text = re.sub(r"[^\W\d_][\w']*", lambda word: "gravity" if word[0].lower() in _FREE_FALL else word[0], text)
    for spelled in dict.fromkeys((text, text.lower())):
        try:
            return Quantity("unit", si, si).parse(f"1 {spelled}")
        except PydanticCustomError:
            continue
    return None
