"""Modes that were fitted to measured responses, as far as they are compared with those of a machine, and their files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError
from trivet.measure.channels import written
from trivet.measure.checking import check_size
from trivet.measure.correlation import ModeSet
from trivet.measure.files.labelled_file import opened
from trivet.measure.functions import Channel, Functions

KIND = "trivet modal fit"
MOST_MODES = 1000
MOST_CHANNELS = 10_000
NEEDED = ("natural_frequency", "damping", "shape", "response")


class FittedModes(NamedTuple):
    """Modes as they were fitted to measured responses."""

    channels: tuple[Channel, ...]
    """(o,) where the shapes are known."""
    modes: ModeSet
    """With shapes (o, m) in displacement: m, and rad where channels turn."""

    def among(self, functions: Functions, length: float) -> FittedModes:
        """Those within the frequencies of some functions, at those of their channels which the fit has; where these turn in m,
        times a length.

        Raises:
            InputError: where the fit has none of them.
        """
        channels = tuple(dict.fromkeys(functions.responses))
        own = tuple(channel for channel in channels if channel in self.channels)
        if not own:
            known = ", ".join(str(channel) for channel in channels[:5])
            raise InputError(f"the fit has none of the channels of the functions ({known}, …); fit these functions")
        low, high = functions.frequency[0], functions.frequency[-1]
        order = np.argsort(self.modes.frequency)
        order = order[(self.modes.frequency[order] >= low) & (self.modes.frequency[order] <= high)]
        if not len(order):
            raise InputError(f"the fit has no mode between {low:g} and {high:g} Hz; fit these functions")
        rows = [self.channels.index(channel) for channel in own]
        shapes = units(own, length) * self.modes.shapes[rows][:, order]
        return FittedModes(own, ModeSet(self.modes.frequency[order], self.modes.damping[order], shapes))


def units(channels: Sequence[Channel], length: float) -> np.ndarray:
    """(o, 1) what makes displacements at channels comparable: a length (m) where they turn, else 1."""
    return np.array([length if channel.is_rotation else 1.0 for channel in channels])[:, None]


def read_fitted(path: str | os.PathLike[str]) -> FittedModes:
    """Modes of a modal fit that was saved as NetCDF.

    Raises:
        InputError: with the variable, what it is and what was expected.
    """
    check_size(path)
    with opened(path, KIND, NEEDED) as file:
        channels, modes = (file.array(name, (None,)).shape[0] for name in ("response", "natural_frequency"))
        if not (1 <= modes <= MOST_MODES and 1 <= channels <= MOST_CHANNELS):
            expected = f"expected 1 to {MOST_MODES} and 1 to {MOST_CHANNELS}"
            raise InputError(f"{file.name}: has {modes} modes at {channels} channels; {expected}")
        if file.unit("natural_frequency") != "Hz":
            raise InputError(f"{file.name}: natural_frequency: expected units Hz")
        frequency, damping = file.numbers("natural_frequency", (modes,)), file.numbers("damping", (modes,))
        shapes = file.complex("shape", (channels, modes))
        found = FittedModes(file.channels("response", channels), ModeSet(frequency, damping, shapes))
    check_fitted(found, os.fspath(path))
    return found


def check_fitted(found: FittedModes, where: str) -> None:
    """Refuse modes with a frequency or a damping that no mode has, a shape with no number, a channel named twice.

    Raises:
        InputError: naming the mode or the channel.
    """
    frequency, damping, shapes = found.modes
    for k, (own, ratio) in enumerate(zip(frequency, damping, strict=True)):
        if not (0 < own < np.inf and abs(ratio) < 1):
            raise InputError(f"{where}: mode {k + 1}: {own:g} Hz, damping ratio {ratio:g}; expected above 0 Hz, and below 1")
        if not np.isfinite(shapes[:, k]).all() or not shapes[:, k].any():
            raise InputError(f"{where}: mode {k + 1}: its shape has a component that is no number, or moves nowhere")
    for channel in found.channels:
        if found.channels.count(channel) > 1:
            raise InputError(f"{where}: response: {written(channel)} is given twice")
