"""Numbers of a machine, looked up by their key paths."""

from __future__ import annotations

from typing import NamedTuple

from trivet.errors import InputError, nearest
from trivet.model.elements import KEYS
from trivet.model.kinds import kinds
from trivet.model.machine import Machine
from trivet.model.paths import dimensions, find, join, leaves
from trivet.model.quantity import Quantity
from trivet.model.writing import document_of


class Number(NamedTuple):
    """A number of a machine."""

    path: str
    """Key path in full."""
    leaf: int
    """Which leaf of the machine it is."""
    kind: Quantity
    value: float
    """SI."""

    @property
    def is_unsigned(self) -> bool:
        """Whether it is never below zero."""
        return self.kind.positive or self.kind.at_least_zero


def number(machine: Machine, path: str) -> Number:
    """A number of a machine by its key path or an abbreviation.

    Members of lists without names, such as the three coordinates of a position, are counted from 1: "home.position.3".

    Raises:
        InputError: for a path that the machine does not have, or that is no number.
    """
    document, known = document_of(machine), dimensions(machine)
    head, _, last = path.rpartition(".")
    is_member = bool(head) and last.isdigit()
    keys = find(document, head if is_member else path, KEYS)
    whole = join(document, keys) + (f".{last}" if is_member else "")
    if whole not in known:
        if not is_member and not any(leaf[: len(keys)] == keys for leaf in leaves(document)):
            within = sorted(f"{path}.{k.rsplit(f'.{path}.', 1)[-1]}" for k in known if f".{path}." in k)
            if within:
                raise InputError(f"{path}: is no number but holds some; name one of {', '.join(within)}")
            if not head:
                raise InputError(f"{path}: no such key in this machine{nearest(path, known)}")
            raise InputError(f"{path}: has no value in this machine; give it one to start from in its file")
        beside = [k for k in known if k.startswith(whole + ".")]
        hint = f"; name one of {', '.join(beside)}" if beside else nearest(path, known)
        raise InputError(f"{path}: is no number of this machine that could change{hint}")
    return Number(whole, list(known).index(whole), kinds(machine)[whole], float(known[whole]))
