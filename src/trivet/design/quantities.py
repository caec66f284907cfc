"""Quantities: numbers that are asked of every design, by the names that study files give them.

mean K_xx            a reduction over the check points of a field, each point with its best roll
least clearance      mean, least, greatest, or deviation (of the population, as in the paper's tables)
home 1/C_zz          a field at home
mass                 a number of the machine itself
reached              a number of all check points together
tilt, home D_xx      a study of its own, machine by machine (`studied.py`)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType

import jax.numpy as jnp

from trivet.design import studied
from trivet.design.fields import Field, Lacks, drives, envelope, margins, stiffness, transmission
from trivet.design.looked import Looked, Stand
from trivet.design.studied import Studied
from trivet.dynamics.bodies import carried_mass, require_masses
from trivet.errors import InputError, nearest
from trivet.model import Machine
from trivet.model.quantity import Quantity as Kind
from trivet.space.scalar import Scalar

FIELDS: tuple[ModuleType, ...] = (stiffness, margins, transmission, drives, envelope)

MEAN, LEAST, GREATEST, DEVIATION, HOME = "mean", "least", "greatest", "deviation", "home"
REDUCTIONS = (MEAN, LEAST, GREATEST, DEVIATION, HOME)

MASS, REACHED = "mass", "reached"


def _nothing(machine: Machine) -> None:
    """No machine lacks anything."""


@dataclass(frozen=True)
class Quantity:
    """A number that a kernel works out of a machine as it stands: `own`, `whole`, or a field reduced over poses."""

    name: str
    kind: Kind
    """Its units."""
    own: Callable[[Machine], Scalar] | None = None
    """Of the machine itself."""
    whole: Callable[[Looked], Scalar] | None = None
    """Of all check points together."""
    field: Field | None = None
    reduction: str = ""
    """Of the field, over poses."""
    check: Callable[[Machine], None] = _nothing
    """Raises InputError for a machine whose description lacks what the number asks for."""
    lacks: Lacks = _nothing
    """Why machines of a kind have no such number."""

    @property
    def is_over_points(self) -> bool:
        """Whether it asks for the check points, rather than home or no pose at all."""
        return self.own is None and self.reduction != HOME

    def value(self, stand: Stand, points: Callable[[], Looked] | None = None) -> Scalar:
        """The number of a machine; over `points` in the place of its check points with their best rolls."""
        if self.own is not None:
            return self.own(stand.machine)
        looked = stand.home if self.reduction == HOME else stand.surface if points is None else points()
        if self.field is None:
            assert self.whole is not None
            return self.whole(looked)
        return reduced(self.field.values(looked), looked.reached, self.reduction)

    def rows(self, stand: Stand, points: Callable[[], Looked], sign: float) -> Scalar:
        """(n,) numbers, the greatest of which, times the sign, is this one times the sign."""
        if self.field is not None and self.reduction == (GREATEST if sign > 0 else LEAST):
            return self.field.values(points())
        return jnp.atleast_1d(self.value(stand, points))


Asked = Quantity | Studied


def quantity(name: str, key: str = "quantities") -> Asked:
    """The quantity of a name, given under a key of a study file.

    Raises:
        InputError: for a name that is not known, with the nearest that are.
    """
    text = " ".join(name.split())
    found = ALONE.get(text) or studied.read(text)
    if found is not None:
        return found
    reduction, _, rest = text.partition(" ")
    field = next((f for module in FIELDS if (f := module.read(rest)) is not None), None) if reduction in REDUCTIONS else None
    if field is None:
        raise InputError(f"{key}: '{text}' is no quantity that is known{_hint(text)}")
    return Quantity(text, field.kind, field=field, reduction=reduction, check=field.check, lacks=field.lacks)


def require(asked: Asked, machines: Sequence[Machine]) -> None:
    """Raise InputError where no machine has a quantity, or where a description lacks what it asks for.

    A machine of a kind that has no such number is no error beside others that have it: its number is NaN.
    """
    reasons = [asked.lacks(machine) for machine in machines]
    if None not in reasons:
        raise InputError(f"{machines[0].name}: {asked.name}: {reasons[0]}")
    for machine, reason in zip(machines, reasons, strict=True):
        if reason is None:
            asked.check(machine)


def names() -> list[str]:
    """Names of quantities; those of stiffness along any direction, "mean K(1,0,1)", are known too."""
    some = [name for module in FIELDS for name in module.NAMES]
    return [*ALONE, *studied.NAMES, *(f"{reduction} {name}" for reduction in REDUCTIONS for name in some)]


def _hint(text: str) -> str:
    near = nearest(text, names())
    if "did you mean" in near:
        return near
    fields = ", ".join(name for module in FIELDS for name in module.NAMES)
    return f"; known are {', '.join((*ALONE, *studied.NAMES))}, and {', '.join(REDUCTIONS)} of {fields}"


def reduced(values: Scalar, reached: Scalar, reduction: str) -> Scalar:
    """Values (n,) over the poses that are reached as one number; NaN where none is."""
    count = reached.sum()
    if reduction == LEAST:
        found = jnp.where(reached, values, jnp.inf).min()
    elif reduction == GREATEST:
        found = jnp.where(reached, values, -jnp.inf).max()
    else:
        found = jnp.where(reached, values, 0.0).sum() / count
        if reduction == DEVIATION:
            found = jnp.sqrt(jnp.where(reached, (values - found) ** 2, 0.0).sum() / count)
    return jnp.where(count > 0, found, jnp.nan)


def _mass(machine: Machine) -> Scalar:
    """Of the platform and of all bodies of the chains, rods as long as their travel asks for (kg)."""
    stock, legs = machine.stock, machine.legs
    total = carried_mass(machine.platform, legs, stock).mass
    for leg in legs:
        for element in leg.chain.elements[:-1]:
            total = total + element.weigh(stock).mass
    return jnp.asarray(total, dtype=float)


ALONE = {
    own.name: own
    for own in (
        Quantity(MASS, Kind("mass", "kg", "kg"), own=_mass, check=require_masses),
        Quantity(REACHED, Kind("share", "", ""), whole=lambda looked: looked.reached.mean()),
    )
}
"""Those that are no reduction of a field."""
