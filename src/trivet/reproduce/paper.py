"""The paper's tables and figures as a file describes them: `paper.toml`."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from itertools import pairwise
from typing import Annotated, NamedTuple

from pydantic import Field, TypeAdapter, ValidationError

from trivet.errors import InputError, nearest
from trivet.model.complaint import one_complaint
from trivet.model.section import STRICT
from trivet.model.toml import parse_toml
from trivet.reproduce.found import Asked
from trivet.reproduce.kinds import AnyWork
from trivet.reproduce.numbers import Number

FILE = "paper.toml"
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9-]{0,39}$")]


class Pair(NamedTuple):
    """One machine that is said to be above another."""

    above: str
    below: str


@dataclass(frozen=True)
class Values:
    """What the paper tells of one quantity."""

    __pydantic_config__ = STRICT

    quantity: str
    paper: tuple[Number | None, ...]
    """In the order of the machines."""
    of: tuple[str, ...] = ()
    """In the order of the machines: where in the machine file it stands; see `kinds.dimensions`."""
    ordered_by: str = ""
    """Quantity of ours that puts the machines in order; this one when not given."""
    fitted: bool = False
    """Whether something that the paper does not give was fitted to these very numbers."""


@dataclass(frozen=True)
class Claim:
    """What the paper says in words."""

    __pydantic_config__ = STRICT

    text: str
    quantities: tuple[str, ...] = ()
    """Of which quantities it says so."""
    order: str = ""
    """"a > b, c": the greater first; every machine of one group is above every one of the next."""
    at_least: Number | None = None
    """What machines are said to reach."""
    about: Number | None = None
    """About what they are said to be."""
    machines: tuple[str, ...] = ()
    """Which are said to; all that have a number when none is named."""
    significance: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Level of the test by which means are said to differ."""
    reason: str = ""
    """Why it does not hold, or cannot be looked at."""

    @property
    def pairs(self) -> list[Pair]:
        """Every two machines of which it tells the order."""
        groups = [[name.strip() for name in group.split(",")] for group in self.order.split(">")] if self.order else []
        return [Pair(a, b) for one, other in pairwise(groups) for a in one for b in other]

    @property
    def named(self) -> tuple[str, ...]:
        """The machines that it is about; none where it is about all that have a number."""
        return tuple(dict.fromkeys(name for pair in self.pairs for name in pair)) or self.machines

    @property
    def number(self) -> Number | None:
        """What it sets machines beside, where that is no other machine."""
        return self.at_least or self.about


@dataclass(frozen=True)
class Reason:
    """Why something does not come out."""

    __pydantic_config__ = STRICT

    text: str
    quantities: tuple[str, ...] = ()
    """Of what; of all when none is named."""
    machines: tuple[str, ...] = ()
    """Of which; of all when none is named."""

    def applies(self, quantity: str, machine: str) -> bool:
        """Whether it is about that."""
        return (not self.quantities or quantity in self.quantities) and (not self.machines or machine in self.machines)


@dataclass(frozen=True)
class Item:
    """A table or a figure: what the paper has there, and how it is worked out."""

    __pydantic_config__ = STRICT

    name: Name
    where: str
    """In the paper."""
    title: str
    setting: str
    """With what it is worked out, in words; what the paper does not give is called fitted or assumed."""
    command: str
    """What gives the same numbers one by one."""
    machines: Annotated[tuple[str, ...], Field(min_length=1)]
    work: AnyWork
    values: tuple[Values, ...] = ()
    values_of: str = ""
    """Name of the item which has the values of this one as well."""
    claims: tuple[Claim, ...] = ()
    reasons: tuple[Reason, ...] = ()
    """The first that applies is told."""
    remark: str = ""
    """What else is to be said."""

    @property
    def asked(self) -> tuple[Asked, ...]:
        """What the paper tells, by machine."""
        return tuple(
            Asked(
                own.quantity,
                dict(zip(self.machines, own.paper, strict=True)),
                dict(zip(self.machines, own.of, strict=True)) if own.of else {},
                own.ordered_by or own.quantity,
                own.fitted,
            )
            for own in self.values
        )

    def reason(self, quantity: str, machine: str) -> str:
        """Why a number does not come out; empty where nobody knows."""
        return next((reason.text for reason in self.reasons if reason.applies(quantity, machine)), "")


@dataclass(frozen=True)
class Paper:
    """All of them, in the order of the paper."""

    __pydantic_config__ = STRICT

    citation: str
    items: tuple[Item, ...]

    def chosen(self, names: Collection[str]) -> tuple[Item, ...]:
        """Items by name, in the order of the paper; all when none is named.

        Raises:
            InputError: for a name that is none of them.
        """
        known = {item.name: item for item in self.items}
        for name in names:
            if name not in known:
                raise InputError(f"--only {name}: is no table or figure of the paper{nearest(name, known)}")
        return tuple(item for name, item in known.items() if not names or name in names)


@cache
def default_paper() -> Paper:
    """The paper from which the project started; nothing else names its file."""
    return read_paper(resources.files("trivet.reproduce").joinpath(FILE).read_bytes(), FILE)


def read_paper(data: bytes, name: str) -> Paper:
    """The description in a file.

    Raises:
        InputError: with the key, the value and what was expected.
    """
    document = parse_toml(name, data, "a description of tables and figures")
    try:
        found = TypeAdapter(Paper).validate_python(document)
    except ValidationError as error:
        raise InputError(f"{name}: {one_complaint(error, document, Paper)}") from None
    try:
        return replace(found, items=tuple(_whole(item, found.items) for item in found.items))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def _whole(item: Item, items: tuple[Item, ...]) -> Item:
    """An item with the values that another one holds for it; its lists are as long as they have to be."""
    if item.values_of:
        others = {other.name: other.values for other in items}
        if item.values_of not in others:
            raise InputError(f"{item.name}: values_of: {item.values_of} is no item{nearest(item.values_of, others)}")
        item = replace(item, values=others[item.values_of])
    for own in item.values:
        if len(own.paper) != len(item.machines) or len(own.of) not in (0, len(item.machines)):
            raise InputError(
                f"{item.name}: {own.quantity}: expected as many entries as there are machines, {len(item.machines)}"
            )
    for name in (name for claim in item.claims for pair in claim.pairs for name in pair):
        if name not in item.machines:
            raise InputError(f"{item.name}: a claim names {name}{nearest(name, item.machines)}")
    return item
