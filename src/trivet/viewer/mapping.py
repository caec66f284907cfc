"""Quantities over the workpiece hemisphere, as a page maps them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.model import Machine
from trivet.space.surface import Surface
from trivet.statics.objective import AXES
from trivet.study.atlas import atlas
from trivet.study.families import hemisphere_of
from trivet.study.response_summary import unit_of_least
from trivet.study.singularity_map import QUANTITIES as CONDITIONS
from trivet.study.singularity_map import singularity_map
from trivet.study.stiffness_map import stiffness_map, surface_of

STIFFNESSES = tuple(f"{kind}_{axis}{axis if len(axis) == 1 else ''}" for kind in ("K", "1/C") for axis in AXES)
DYNAMIC = tuple(f"D_{axis}{axis}" for axis in AXES[:3])
QUANTITIES = (*STIFFNESSES, *DYNAMIC, *CONDITIONS)
ROLLS = ("best K_xx", "best K_zz", "-alpha", "0 deg")
"""How the roll is chosen."""
MOST_STEPS = 30
_ANGULAR = ("1/det J^-1",)
"""Of rates of the angles, which are none at zero tilt (paper Eq 24)."""
_SIGNED = tuple(name for name in CONDITIONS if "det" in name)


class Mapped(NamedTuple):
    """A quantity over check points."""

    surface: Surface
    roll: Any
    """(n,) rad; NaN where the pose is not reached."""
    values: Any
    """(n,) in the unit of the label; NaN where the pose is not reached."""
    label: str
    """The quantity with its unit."""
    limits: tuple[float, float]
    """Values at the ends of the colours."""
    is_signed: bool
    """Whether the colours lie about zero."""
    curves: tuple[Any, ...]
    """Type 2 singularities: (k, 3) points of the surface each, m."""
    is_angular: bool = False
    """Whether it belongs to the rates of the angles."""


def mapped(machine: Machine, mode: str, quantity: str, steps: int, roll: str, progress: Callable[[int], None]) -> Mapped:
    """A quantity over the machine's own hemisphere.

    Args:
        machine, mode: the machine and its working mode as written.
        quantity: one of QUANTITIES.
        steps: lattice steps from the pole to the rim, 1 to MOST_STEPS.
        roll: one of ROLLS; of stiffnesses a best one.
        progress: called with the number of points done.

    Raises:
        InputError: for another quantity, roll or number of steps, or a machine without a hemisphere or closed form.
        NoResultError: when no point is reached.
    """
    for what, given, known in (("quantity", quantity, QUANTITIES), ("roll", roll, ROLLS)):
        if given not in known:
            raise InputError(f'{what} "{given}": is not known{nearest(given, known)}')
    if not 1 <= steps <= MOST_STEPS:
        raise InputError(f"steps: {steps}; expected 1 to {MOST_STEPS}")
    policy: str | float = 0.0 if roll == "0 deg" else roll
    chosen = mode or None
    if quantity in CONDITIONS:
        near = singularity_map(
            machine, surface_of(machine, steps), quantity=quantity, roll=policy, mode=chosen, progress=progress
        )
        unit = near.unit()
        factor = 1e3 ** int(unit[2:]) if unit.startswith("m^") else 1.0
        label = f"{quantity}, m{unit}" if unit.startswith("m^") else quantity
        curves = tuple(curve.surface.position for curve in near.curves)
        made = _scaled(near.surface, near.roll, factor * near.values, label, quantity in _SIGNED, curves)
        return made._replace(is_angular=quantity in _ANGULAR)
    if quantity in DYNAMIC:
        entry = quantity.removeprefix("D_")
        found = atlas(machine, hemisphere_of(machine, steps), entries=[entry], roll=policy, mode=chosen, search=False)
        own = unit_of_least(entry)
        surface, values = found.places.surface(found.family.name), np.where(found.used, found.stiffness[:, 0], np.nan)
        return _scaled(surface, found.places.roll, own.factor * values, f"{quantity}, {own.written}")
    if not roll.startswith("best"):
        raise InputError(f'roll "{roll}": {quantity} is mapped with the best roll; choose "best K_xx" or another quantity')
    stiff = stiffness_map(
        machine, surface_of(machine, steps), objective=roll.removeprefix("best "), mode=chosen, progress=progress
    )
    scale, unit = (1e-6, "N/µm") if quantity[-1] == quantity[-2] else (1.0, "N m/rad")
    return _scaled(stiff.surface, stiff.best.roll, scale * stiff.diagonal(quantity), f"{quantity}, {unit}")


def _scaled(
    surface: Surface, roll: Any, values: Any, label: str, is_signed: bool = False, curves: tuple[Any, ...] = ()
) -> Mapped:
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    if is_signed:
        high = float(np.quantile(np.abs(finite), 0.9)) if len(finite) else 1.0
        low = -high
    return Mapped(surface, roll, values, label, (low, high if high > low else low + 1.0), is_signed, curves)
