"""Units as figures write them."""

from __future__ import annotations

import re

from trivet.model.quantity import Quantity

_SIGNS = {r"\bum\b": "µm", r"\bdeg\b": "°", r"\^2": "²", r"\^3": "³", "-(?=[0-9])": "−"}


def signs(words: str) -> str:
    """Words with the signs of units and numbers that files spell out."""
    for plain, sign in _SIGNS.items():
        words = re.sub(plain, sign, words)
    return words


def unit(kind: Quantity) -> str:
    """The unit in which people read a quantity."""
    return signs(kind.written)


def told(kind: Quantity, si_value: float) -> str:
    """A number with its unit, four digits, in one piece."""
    return "\u00a0".join(filter(None, (signs(f"{kind.in_unit(si_value):.4g}"), unit(kind))))
