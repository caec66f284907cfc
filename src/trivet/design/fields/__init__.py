"""What is asked of a machine at a pose, one file per kind; a quantity is made of a field by a reduction over poses.

A module has `NAMES`, examples of the names it knows, and `read`, which gives the `Field` of a name or None.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from trivet.design.looked import Looked
from trivet.model import Machine
from trivet.model.quantity import Quantity
from trivet.space.scalar import Scalar


def _nothing(machine: Machine) -> None:
    """All machines do."""


Lacks = Callable[[Machine], str | None]
"""Why machines of a kind have no such number, whatever their dimensions; None of one that has it."""


class Field(NamedTuple):
    """A number at every pose."""

    name: str
    kind: Quantity
    """Its units."""
    values: Callable[[Looked], Scalar]
    """(n,) at poses, SI, a kernel."""
    check: Callable[[Machine], None] = _nothing
    """Raises InputError for a machine whose description lacks what the number asks for."""
    lacks: Lacks = _nothing
