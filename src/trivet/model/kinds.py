"""What kind of quantity every dimension of a machine is: its units, and whether it may be zero or negative."""

from __future__ import annotations

import typing
from functools import lru_cache
from typing import Any

import jax

from trivet.model.paths import dimensions
from trivet.model.quantity import Quantity


def kinds(machine: Any) -> dict[str, Quantity]:
    """The quantity of every dimension of a machine, by its key path as in `dimensions`; values have no part in it."""
    return dict(_kinds(jax.tree.structure(machine)))


@lru_cache(maxsize=64)
def _kinds(structure: Any) -> dict[str, Quantity]:
    machine = jax.tree.unflatten(structure, [0.0] * structure.num_leaves)
    found = []
    for keys, _ in jax.tree_util.tree_flatten_with_path(machine)[0]:
        here, hint = machine, None
        for key in keys:
            entry = getattr(key, "name", None)
            if entry is not None:
                hint = typing.get_type_hints(type(here), include_extras=True)[entry]
                here = getattr(here, entry)
            else:
                here = here[key.key if hasattr(key, "key") else key.idx]
        found.append(_quantity(hint))
    return dict(zip(dimensions(machine), found, strict=True))


def _quantity(hint: Any) -> Quantity:
    """The first quantity within a type: of the members of tuples and dicts all are alike."""
    for own in getattr(hint, "__metadata__", ()):
        if isinstance(own, Quantity):
            return own
    for inner in typing.get_args(hint):
        if inner is not type(None):
            try:
                return _quantity(inner)
            except TypeError:
                continue
    raise TypeError(f"no quantity in {hint}")
