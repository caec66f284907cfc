"""Frequency responses as they are shown: some entries in their units, their values at resonance, where they are greatest."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.study.frf import FrequencyResponse, Minimum, directions
from trivet.vibration.response import OUTPUTS

NOTHING = 1e-9
"""Share of the greatest response of its kind below which a response is rounding."""

END = 1e-6
"""Distance from an end of the range of frequencies, against it, up to which a minimum is said to lie there."""

_MOTION = {
    ("receptance", False): ("m", "µm", 1e6),
    ("receptance", True): ("rad", "µrad", 1e6),
    ("mobility", False): ("m/s", "mm/s", 1e3),
    ("mobility", True): ("rad/s", "mrad/s", 1e3),
    ("accelerance", False): ("m/s^2", "m/s²", 1.0),
    ("accelerance", True): ("rad/s^2", "rad/s²", 1.0),
}


class Unit(NamedTuple):
    """A unit."""

    si: str
    """"m/N"."""
    written: str
    """As users expect it, "µm/N"."""
    factor: float
    """From SI to that."""


def unit_of_stiffness(direction: str) -> Unit:
    """Unit of a dynamic stiffness along or about an axis."""
    return Unit("N m/rad", "N m/rad", 1.0) if direction.startswith("r") else Unit("N/m", "N/µm", 1e-6)


def unit_of_least(entry: str) -> Unit:
    """Unit of a least dynamic stiffness: of 1/|H| of any entry."""
    turned, moment = (direction.startswith("r") for direction in directions(entry))
    if turned != moment:
        return Unit("N", "N", 1.0) if moment else Unit("N/rad", "N/rad", 1.0)
    return unit_of_stiffness("rx" if turned else "x")


@dataclass(frozen=True)
class ShownResponse:
    """Entries of a frequency response, chosen to be shown."""

    whole: FrequencyResponse
    output: str = "receptance"
    """Or mobility, accelerance."""
    entries: tuple[str, ...] = ("xx", "yy", "zz")
    """Motion, then load: "xx", "x_ry"."""

    def unit(self, entry: str) -> Unit:
        """Unit of an entry."""
        motion, load = directions(entry)
        si, written, factor = _MOTION[self.output, motion.startswith("r")]
        per = "(N m)" if load.startswith("r") else "N"
        return Unit(f"{si}/{per}", f"{written}/{per}", factor)

    def values(self, entry: str) -> np.ndarray:
        """(n,) complex, SI."""
        return self.whole.entry(entry, self.output)

    def at_resonances(self, entry: str) -> np.ndarray:
        """(m,) complex, SI: values at the natural frequencies; zero where it is rounding beside others of its kind."""
        places = np.searchsorted(self.whole.frequency, self.whole.natural * (1 - 1e-12))
        own = self.values(entry)[places]
        rows, columns = (slice(3, 6) if direction.startswith("r") else slice(0, 3) for direction in directions(entry))
        kind = np.abs(self.whole.as_output(self.output)[places, rows, columns])
        found: np.ndarray = np.where(np.abs(own) > NOTHING * kind.max(axis=(1, 2), initial=0.0), own, 0.0)
        return found

    @cached_property
    def minima(self) -> list[Minimum]:
        """Minimum dynamic stiffness along and about x, y, z; none where motion and load are apart, or nothing is damped."""
        whole = self.whole
        return whole.minima if whole.response == whole.excitation and whole.is_bounded else []

    def is_at_end(self, minimum: Minimum) -> bool:
        """Whether a minimum lies at an end of the range of frequencies, beyond which there may be less."""
        ends = self.whole.frequency[[0, -1]]
        return bool(np.any(np.abs(minimum.frequency - ends) < END * ends))

    @property
    def marks(self) -> dict[str, Minimum]:
        """The minimum dynamic stiffness of every entry that has one."""
        found = {minimum.direction: minimum for minimum in self.minima}
        pairs = {entry: directions(entry) for entry in self.entries}
        return {entry: found[motion] for entry, (motion, load) in pairs.items() if motion == load and motion in found}


def check_entries(names: Iterable[str], output: str) -> tuple[str, ...]:
    """Names of entries without blanks around them.

    Raises:
        InputError: for a name that is none, one given twice, or an unknown output.
    """
    if output not in OUTPUTS:
        raise InputError(f"output '{output}' is not known{nearest(output, OUTPUTS)}")
    found = tuple(name.strip() for name in names)
    pairs = [directions(name) for name in found]
    for name, pair in zip(found, pairs, strict=True):
        if pairs.count(pair) > 1:
            raise InputError(f"response '{name}': given twice")
    return found
