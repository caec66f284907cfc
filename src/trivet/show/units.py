"""Units as figures write them."""

from __future__ import annotations

from trivet.model.quantity import Quantity

_SIGNS = {"um": "µm", "deg": "°", "^2": "²", "^3": "³"}


def unit(kind: Quantity) -> str:
    """The unit in which people read a quantity."""
    written = kind.written
    for plain, sign in _SIGNS.items():
        written = written.replace(plain, sign)
    return written


def told(kind: Quantity, si_value: float) -> str:
    """A number with its unit, four digits."""
    return f"{kind.in_unit(si_value):.4g} {unit(kind)}".replace("-", "−").rstrip()
