"""Aims of a plan, as they are written: "sigma_min", "K_xx", "sigma_min=0.1", "K_xx=5 N/um"."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches

from pydantic_core import PydanticCustomError

from trivet.errors import InputError, nearest
from trivet.model.quantity import Quantity
from trivet.statics.objective import objective
from trivet.study.roll_grid import Aim

SIGMA = Aim("sigma_min", None, 1.0)
"""How far a pose is from a Type 2 singularity."""
LEAST = 1e-30
_STIFFNESS = Quantity("stiffness", "N/m", "N/um", positive=True)
_ROTATIONAL = Quantity("rotational stiffness", "N m/rad", "N m/rad", positive=True)


def read_aims(written: Sequence[Aim | str]) -> tuple[Aim, ...]:
    """Read aims; those that are read already stay as they are.

    Args:
        written: names, each with what counts as one; that is 1 in SI when it is not given, which serves a single aim only.

    Raises:
        InputError: for unknown names, and for several aims without what counts as one.
    """
    if isinstance(written, (str, Aim)):  # of both Python would take the parts
        written = (written,)
    found = []
    for text in written:
        if isinstance(text, Aim):
            found.append(text)
            continue
        name, sign, one = (part.strip() for part in text.partition("="))
        if not sign and len(written) > 1:
            raise InputError(
                f'objective "{text}": several objectives need what counts as one, as in sigma_min=0.1, K_xx="5 N/um"'
            )
        if name != "sigma_min" and get_close_matches(name, ["sigma_min"], cutoff=0.6):
            raise InputError(f"objective '{name}' is not known{nearest(name, ['sigma_min'])}")
        scalar = None if name == "sigma_min" else objective(name)
        found.append(Aim(name, scalar, _unit(text, scalar, one) if sign else 1.0))
    return tuple(found)


def _unit(text: str, scalar: object, one: str) -> float:
    try:
        if scalar is None:
            value = float(one)
            if not LEAST <= value <= 1 / LEAST:
                raise ValueError
            return value
        return (_ROTATIONAL if getattr(scalar, "is_rotational", False) else _STIFFNESS).parse(one)
    except PydanticCustomError as error:  # a ValueError too
        raise InputError(f'objective "{text}": {error.message()}') from None
    except ValueError:
        raise InputError(f'objective "{text}": expected a number above zero, from {LEAST:g} to {1 / LEAST:g}') from None
