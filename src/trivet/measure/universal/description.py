"""What a universal file says of its functions beside them: units, points, axes, names."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from trivet.measure.imported import Unused
from trivet.measure.universal.function import head
from trivet.measure.universal.parse import parse
from trivet.measure.universal.plain import Fields
from trivet.measure.universal.scan import Block, scan
from trivet.measure.universal.units import Declared, Scale, is_none, scale_of

_OTHER = {18: "coordinate systems", 55: "data at points that are no mode", 82: "trace lines", 2412: "elements"}


class Described(NamedTuple):
    """A universal file without its functions."""

    path: str
    datasets: list[tuple[Block, Fields]]
    """All but functions, as pyuff gives them."""
    scale: Scale | None
    """What dataset 164 says."""
    names: set[tuple[int, str]]
    """Points of functions with a number and a name of what they belong to."""
    unused: list[Unused]

    @property
    def source(self) -> str:
        """Name of the file, and what it says of itself."""
        words = [fields[key] for block, fields in self.datasets if block.kind == 151
                 for key in ("model_name", "description", "program")]  # fmt: skip
        told = ", ".join(dict.fromkeys(word for word in words if not is_none(word)))
        return Path(self.path).name + (f" ({told})" if told else "")


def describe(path: str, given: Declared) -> Described:
    """All of a file but its functions.

    Raises:
        InputError: with file, dataset, line, value, what was expected and the remedy.
    """
    datasets: list[tuple[Block, Fields]] = []
    names: set[tuple[int, str]] = set()
    unused = []
    for block in scan(path):
        if block.kind == 58:
            names |= set(_names(head(block)))
        elif (fields := parse(block)) is not None:
            datasets.append((block, fields))
        else:
            unused.append(Unused(path, block.number, block.kind, _OTHER.get(block.kind, f"dataset {block.kind}")))
    return Described(path, datasets, _scale(datasets, given), names, unused)


def _names(fields: Fields) -> Iterator[tuple[int, str]]:
    for side in ("rsp", "ref"):
        number, name = fields.get(f"{side}_node", 0), str(fields.get(f"{side}_ent_name", ""))
        if number and not is_none(name):
            yield number, name


def _scale(datasets: list[tuple[Block, Fields]], given: Declared) -> Scale | None:
    """What datasets 164 say, which has to be one thing."""
    own = [(block, scale_of(block, fields, given)) for block, fields in datasets if block.kind == 164]
    told = [(block, scale) for block, scale in own if scale is not None]
    for block, scale in told[1:]:
        if not np.allclose(scale, told[0][1], rtol=1e-6):
            raise block.error(f"other units than in dataset {told[0][0].number}; a file has one system of units")
    return told[0][1] if told else None
