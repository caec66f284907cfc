"""Numbers with their units, as people and programs read them."""

from __future__ import annotations

import math
import re

from trivet.model.quantity import Quantity

_SYMBOLS = {"N/um": "N/µm", "deg": "°", "mm^3": "mm³", "m^3": "m³", "kg/m^3": "kg/m³"}


def unit(kind: Quantity) -> str:
    """The unit in which people read it."""
    return _SYMBOLS.get(kind.written, kind.written)


def number(kind: Quantity, si_value: float, digits: int = 5) -> str:
    """The number in that unit; a dash where there is none."""
    return f"{kind.in_unit(si_value):.{digits}g}" if math.isfinite(si_value) else "-"


def key(name: str, kind: Quantity) -> str:
    """A key of JSON that ends with the SI unit: "mean K_xx" as "mean_K_xx_N_per_m"."""
    plain = re.sub(r"[^0-9A-Za-z_.-]+", "_", name.replace("1/C", "1_C")).strip("_")
    units = kind.si.replace("/", "_per_").replace("^", "").replace(" ", "_")
    return f"{plain}_{units}" if units else plain
