"""Frequency responses of a machine at a pose, and its minimum dynamic stiffness (paper sections 3.3.2 and 4.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.statics.assembly import assemble
from trivet.statics.objective import AXES
from trivet.study.machines import MachineLike
from trivet.study.pose import PoseReport, pose
from trivet.vibration import spectral
from trivet.vibration.damping import check_loss_factor, least_damping, own_damping
from trivet.vibration.exact import pieces
from trivet.vibration.mesh import mesh
from trivet.vibration.modes import exact_frequencies, held_modes
from trivet.vibration.resonance import Peak, greatest
from trivet.vibration.response import METHODS, OUTPUTS, Damping, Method, per, receptance

MOST_FREQUENCIES = 1_000_000
HIGHEST = 1e5
"""Hz; there the wavelength in a beam comes near its thickness, and beams are beams no more."""
BATCH = 40
"""Modes that are asked for at first."""
POLISHED = 100
"""Natural frequencies that are freed of the error of the mesh, one by one."""
AROUND = np.linspace(-3, 3, 25)
"""Where, in half-power widths from a resonance, a response is looked at besides its regular frequencies."""


class Minimum(NamedTuple):
    """Minimum of the dynamic stiffness 1/|H_jj| over frequency."""

    direction: str
    """x, y, z, rx, ry or rz."""
    stiffness: float
    """N/m, or N m/rad."""
    frequency: float
    """Hz."""


@dataclass(frozen=True)
class FrequencyResponse:
    """Response of one place of a machine to loads at another; in SI and {O}, exp(+i omega t)."""

    at: PoseReport
    frequency: np.ndarray
    """(n,) Hz."""
    receptance: np.ndarray
    """(n, 6, 6): [u; w] at the response = H [F; M] at the excitation, m/N, rad/N, rad/(N m)."""
    response: str
    excitation: str
    method: Method
    damping: Damping
    loss_factor: float
    natural: np.ndarray
    """Natural frequencies within the range, Hz."""

    def entry(self, name: str, output: str = "receptance") -> np.ndarray:
        """(n,) one response: "xx", "x_ry" (motion, then load)."""
        first, second = directions(name)
        return self.as_output(output)[:, AXES.index(first), AXES.index(second)]

    def as_output(self, output: str) -> np.ndarray:
        """(n, 6, 6) as receptance (m/N), mobility (m/s/N) or accelerance (m/s^2/N)."""
        if output not in OUTPUTS:
            raise InputError(f"output '{output}' is not known{nearest(output, OUTPUTS)}")
        return per(output, self.receptance, self.frequency)

    @cached_property
    def dynamic_stiffness(self) -> np.ndarray:
        """(n, 6, 6) inverse of the receptance: its diagonal holds all other displacements, 1/|H_jj| leaves them free."""
        return np.linalg.inv(self.receptance)

    @property
    def has_own_damping(self) -> bool:
        """Whether some parts have a loss factor of their own, or a dashpot."""
        return bool(own_damping(self.at.machine))

    @property
    def is_bounded(self) -> bool:
        """Whether anything is damped: without, a response has no bound at a natural frequency."""
        return least_damping(self.at.machine, self.loss_factor) > 0

    @cached_property
    def minima(self) -> list[Minimum]:
        """Minimum dynamic stiffness along and about x, y and z within the range of frequencies."""
        diagonal = range(6)
        peaks = greatest(
            lambda f: np.abs(self._evaluated(f)[:, diagonal, diagonal]),
            float(self.frequency[0]),
            float(self.frequency[-1]),
            least_damping(self.at.machine, self.loss_factor),
        )
        return [_minimum(axis, peak) for axis, peak in zip(AXES, peaks, strict=True)]

    def _evaluated(self, frequency: np.ndarray) -> np.ndarray:
        machine, frame, signs = self.at.machine, self.at.frame, self.at.signs
        if self.method == "exact" and self.response == self.excitation == "platform":
            answer = spectral.prepared(machine, frame, signs, float(self.frequency[-1]), self.loss_factor)
            return np.asarray(answer(frequency))
        return receptance(
            machine,
            frame,
            signs,
            frequency,
            response=self.response,
            excitation=self.excitation,
            method=self.method,
            loss_factor=self.loss_factor,
            damping=self.damping,
        )


def frf(
    machine: MachineLike,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    mode: str | None = None,
    anyway: bool = False,
    low: float = 5.0,
    high: float = 3000.0,
    points: int = 2000,
    response: str = "platform",
    excitation: str = "platform",
    method: Method = "exact",
    damping: Damping = "structural",
    loss_factor: float = 0.02,
) -> FrequencyResponse:
    """Frequency responses of a machine at a pose.

    Args:
        machine, position, azimuth, tilt, roll, mode, anyway: as for `pose`.
        low, high: range of frequencies, Hz.
        points: equally spaced frequencies; around every resonance more are added.
        response, excitation: places: "platform" (its centre), "tool" (its tip), a joint ("leg-1.hinge"), a share of a beam
            ("leg-1.link@0.5").
        method: "exact" (no mesh), "direct" (a mesh, solved at every frequency) or "modal" (its modes).
        damping: "structural", K (1 + i eta); or "modal", zeta = eta / 2, with the method "modal".
        loss_factor: eta of all that has no loss factor of its own; 0.02 is the paper's damping ratio of 1 %.

    Raises:
        InputError: for a range that does not rise from above zero, a negative loss factor, an unknown place or method.
        NoResultError: the pose is not reached, or the machine moves there without resistance.
    """
    if method not in METHODS:
        raise InputError(f"method '{method}' is not known{nearest(method, METHODS)}")
    if damping not in ("structural", "modal"):
        raise InputError(f"damping '{damping}' is not known{nearest(damping, ('structural', 'modal'))}")
    check_range(low, high)
    if not 2 <= points <= MOST_FREQUENCIES:
        raise InputError(f"points: {points}; expected 2 to {MOST_FREQUENCIES} frequencies")
    check_loss_factor(loss_factor)
    at = pose(machine, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    natural = natural_frequencies(at, low, high)
    width = natural[:, None] * max(least_damping(at.machine, loss_factor), 1e-6) / 2
    around = (natural[:, None] + width * AROUND).ravel()
    frequency = np.unique(np.r_[np.linspace(low, high, points), around[(around > low) & (around < high)]])
    answer = receptance(
        at.machine,
        at.frame,
        at.signs,
        frequency,
        response=response,
        excitation=excitation,
        method=method,
        loss_factor=loss_factor,
        damping=damping,
    )
    return FrequencyResponse(at, frequency, answer, response, excitation, method, damping, loss_factor, natural)


def check_range(low: float, high: float) -> None:
    """Refuse frequencies (Hz) that are no range to look at."""
    if not 0 < low < high <= HIGHEST:
        expected = f"expected a range that rises from above 0 Hz, up to {HIGHEST:g} Hz"
        raise InputError(f"frequencies: {low:g} Hz to {high:g} Hz; {expected}")


def minimum_dynamic_stiffness(
    at: PoseReport, low: float = 1.0, high: float = 20000.0, loss_factor: float = 0.02
) -> list[Minimum]:
    """Minimum over frequency of 1/|H_jj| at the platform centre along and about x, y and z, structural damping.

    It takes the place of the paper's Eq 38, see docs/vibration.md.

    Raises:
        InputError: for a range that does not rise from above zero, or no damping.
    """
    answer = spectral.prepared(at.machine, at.frame, at.signs, high, loss_factor)
    diagonal = range(6)
    peaks = greatest(
        lambda f: np.abs(np.asarray(answer(f))[:, diagonal, diagonal]), low, high, least_damping(at.machine, loss_factor)
    )
    return [_minimum(axis, peak) for axis, peak in zip(AXES, peaks, strict=True)]


def natural_frequencies(at: PoseReport, low: float, high: float) -> np.ndarray:
    """Natural frequencies within a range, Hz: exact ones; those of a mesh, to some 2e-3, if there are more than `POLISHED`."""
    structure = assemble(at.machine, at.frame, at.signs)
    chosen = mesh(structure, pieces(structure, 2 * math.pi * 1.05 * high, 0.5))
    count = BATCH
    while True:
        found, _ = held_modes(at.machine.name, chosen, count)
        if found[-1] > 1.05 * high or len(found) < count:
            break
        count *= 2
    near = found[found < 1.05 * high]
    exact = exact_frequencies(structure, near) if 0 < len(near) <= POLISHED else near
    inside: np.ndarray = exact[(exact >= low) & (exact <= high)]
    return inside


def directions(name: str) -> tuple[str, str]:
    """Directions of the motion and of the load in the name of a response: "xx", "zz", "x_ry", "rz_rz"."""
    first, _, second = name.partition("_") if "_" in name else (name[: len(name) // 2], "", name[len(name) // 2 :])
    if first not in AXES or second not in AXES:
        raise InputError(f"response '{name}': expected two of {', '.join(AXES)}, as in xx or x_ry")
    return first, second


def _minimum(axis: str, peak: Peak) -> Minimum:
    return Minimum(axis, 1 / peak.size, peak.frequency)
