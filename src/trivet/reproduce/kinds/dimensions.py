"""Dimensions: what the paper's tables say and what the machine files hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from trivet.errors import InputError
from trivet.model.section import STRICT
from trivet.reproduce.found import AS_DESCRIBED, Asked, Found, Ours, Progress
from trivet.reproduce.numbers import Unit


@dataclass(frozen=True)
class Dimensions:
    """Numbers of machine files by their key paths.

    A travel has two of them: "least slide.travel", "greatest slide.travel", "span slide.travel", "middle slide.travel"; the
    span of the angle on a full circle is a full turn where no travel is given, "turn guide.travel".
    """

    __pydantic_config__ = STRICT

    kind: Literal["dimensions"]

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """What the files hold."""
        from trivet.model import document_of
        from trivet.study.machines import choose

        documents = {name: document_of(choose(name)) for name in machines}
        rows = []
        for one in asked:
            unit = next(number.unit for number in one.paper.values() if number is not None)
            for name, of in one.of.items():
                rows.append(Ours(one.quantity, name, AS_DESCRIBED, _value(documents[name], of, unit), unit.name))
        return Found(tuple(rows))


def _value(document: dict[str, Any], of: str, unit: Unit) -> float | None:
    how, _, key = of.rpartition(" ")
    found = _given(document, key)
    if found is None:
        return 2 * math.pi if how == "turn" else None
    values = [unit.quantity.parse(text) for text in (found if isinstance(found, list) else [found])]
    least, greatest = values[0], values[-1]
    known = {"": least, "least": least, "greatest": greatest, "middle": (least + greatest) / 2}
    return known.get(how, greatest - least)


def _given(document: dict[str, Any], key: str) -> Any:
    """What a document has at a key path, without its source; None where it has nothing."""
    from trivet.model.paths import find, get

    try:
        found = get(document, find(document, key))
    except InputError:
        return None
    return found["value"] if isinstance(found, dict) else found
