"""What a store holds: columns of numbers, one for each design, and what tells the study from others."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from typing import Any, NamedTuple

from numpy.typing import NDArray

Array = NDArray[Any]
Attribute = str | int | float

FORMAT = "trivet study 1"
"""Of the folder."""
DESIGN, CHUNK = "design", "chunk"
"""Dimensions."""
STATUS, DIGEST = "status", "digest"
"""Arrays beside the columns."""
ROOT = "zarr.json"
"""The file that tells what the group is."""
NOT_YET = "not yet worked out"
"""What a status of 0 means."""
LONGEST = 200
"""Bytes of the name of an array, which is that of a folder."""
OWN = ("Conventions", "format", "trivet_version", "designs", "designs_per_chunk", "statuses", "columns", "fingerprint")
"""Attributes of the group that are not the study's."""


class Column(NamedTuple):
    """A number that each design has: a variable or a quantity."""

    name: str
    unit: str
    meaning: str


class Chunk(NamedTuple):
    """What is found of consecutive designs."""

    columns: Array
    """(columns, designs), NaN where there is none."""
    status: Array
    """(designs,) 1 and above, as the layout has their names."""


@dataclass(frozen=True)
class Layout:
    """What a store holds."""

    columns: tuple[Column, ...]
    count: int
    """Designs."""
    chunk: int
    """Designs that are worked out and written together."""
    attributes: Mapping[str, Attribute]
    """What else makes the study: its text, its seed.  Where one of them differs it is another study."""
    statuses: tuple[str, ...] = ("done",)
    """What statuses of 1, 2, … mean."""
    version: str = field(default_factory=lambda: version("trivet"))
    """Of the trivet that works them out."""

    @property
    def chunks(self) -> int:
        """How many there are."""
        return -(-self.count // self.chunk)

    def designs(self, k: int) -> tuple[int, int]:
        """The first design of a chunk, and the first that is not of it."""
        return k * self.chunk, min((k + 1) * self.chunk, self.count)

    @cached_property
    def arrays(self) -> tuple[str, ...]:
        """Names of the arrays of the columns: theirs, "_" for what no folder is called, a number where two would be one."""
        taken = {STATUS, DIGEST, ROOT}
        return tuple(_array(column.name, taken) for column in self.columns)

    @cached_property
    def document(self) -> dict[str, Any]:
        """Attributes of the group."""
        columns = [
            {"array": array, "name": column.name, "units": column.unit, "meaning": column.meaning}
            for array, column in zip(self.arrays, self.columns, strict=True)
        ]
        own = {"Conventions": "CF-1.11", "format": FORMAT, "trivet_version": self.version}
        shape = {"designs": self.count, "designs_per_chunk": self.chunk, "statuses": list(self.statuses)}
        document = own | dict(self.attributes) | shape | {"columns": json.dumps(columns)}
        return document | {"fingerprint": fingerprint_of(document)}

    @property
    def fingerprint(self) -> str:
        """What tells the study from others."""
        return str(self.document["fingerprint"])


def layout_of(document: Mapping[str, Any]) -> Layout | None:
    """The layout that a group's attributes tell of; None where they are not what was once written."""
    try:
        columns = tuple(Column(one["name"], one["units"], one["meaning"]) for one in json.loads(document["columns"]))
        attributes = {name: value for name, value in document.items() if name not in OWN}
        layout = Layout(
            columns, document["designs"], document["designs_per_chunk"], attributes, tuple(document["statuses"]),
            document["trivet_version"],
        )  # fmt: skip
        return layout if dict(document) == layout.document else None
    except (KeyError, TypeError, ValueError, AttributeError, ZeroDivisionError, RecursionError):
        return None


def fingerprint_of(document: Mapping[str, Any]) -> str:
    """A hash of attributes, but for the hash itself."""
    rest = {name: value for name, value in document.items() if name != "fingerprint"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


def _array(name: str, taken: set[str]) -> str:
    plain = "".join("_" if one in "/\\" or not one.isprintable() else one for one in name)
    plain = re.sub(r"^(__|\.+|$)", "_", plain).encode()[:LONGEST].decode(errors="ignore")
    numbered = (f"{plain}_{k}" for k in range(2, len(taken) + 3))
    found = plain if plain not in taken else next(one for one in numbered if one not in taken)
    taken.add(found)
    return found
