"""Numbers and words as figures write them, with the sign of minus."""

from __future__ import annotations

import re

from trivet.model import quantity
from trivet.model.quantity import Quantity


def signs(words: str) -> str:
    """Words with the signs of units and numbers that files spell out."""
    return re.sub("-(?=[0-9])", "−", quantity.signs(words))


def told(kind: Quantity, si_value: float) -> str:
    """A number with its unit, four digits, in one piece."""
    return signs(kind.told(si_value, 4)).replace(" ", "\u00a0")
