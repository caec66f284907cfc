"""A fitted modal model: poles with intervals, shapes, participation, residuals, and how well it tells what was measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import sqrtm
from scipy.stats import t as student

from trivet.measure.correlation import frac
from trivet.measure.functions import MOTIONS, Channel, Functions
from trivet.measure.modal.noise import Noise
from trivet.measure.modal.residues import Band, Modes, Shapes, synthesised
from trivet.measure.modal.stabilisation import HEAVY, IN_FREQUENCY, Stabilisation

NOISY = 0.3
"""A function whose noise is a greater part of it says nothing of how good a fit is."""
CONFIDENCE = 0.95
ALONG = 1e-6
"""How far two directions may differ and be one."""


class Deviations(NamedTuple):
    """Standard deviations of modes."""

    frequency: np.ndarray
    """(R,) Hz"""
    damping: np.ndarray
    """(R,)"""
    freedom: float
    """Degrees of freedom of the noise that they were worked out with."""


@dataclass(frozen=True)
class ModalFit:
    """Modes of measured responses.

    Modes whose frequency lies outside the band help to tell what is inside; they take part in `synthesis`, and nowhere else.
    """

    functions: Functions
    """What was fitted, in the band, without zero frequency."""
    band: Band
    """The same as a matrix."""
    responses: tuple[Channel, ...]
    """(o,)"""
    references: tuple[Channel, ...]
    """(i,)"""
    whole: Modes
    """All modes, those outside the band too."""
    linear: Shapes
    """Their shapes, and what lies below and above."""
    deviations: Deviations
    """Of all modes."""
    noise: Noise
    """(o, i) of the functions as measured."""
    diagram: Stabilisation
    """Poles of all orders."""
    is_automatic: bool
    """Whether the modes were chosen by the program."""

    @cached_property
    def inside(self) -> np.ndarray:
        """(R,) numbers of the modes in the band, by frequency; what is damped as no mode is only fills in."""
        size = np.abs(self.whole.poles)
        is_mode = (size >= self.band.omega[0]) & (size <= self.band.omega[-1]) & (-self.whole.poles.real < HEAVY * size)
        order = np.argsort(size, kind="stable")
        return order[is_mode[order]]

    def __len__(self) -> int:
        return len(self.inside)

    @property
    def poles(self) -> np.ndarray:
        """(R,) rad/s, by frequency."""
        found: np.ndarray = self.whole.poles[self.inside]
        return found

    @property
    def frequency(self) -> np.ndarray:
        """(R,) Hz, undamped."""
        found: np.ndarray = np.abs(self.poles) / (2 * math.pi)
        return found

    @property
    def damping(self) -> np.ndarray:
        """(R,) ratios"""
        found: np.ndarray = -self.poles.real / np.abs(self.poles)
        return found

    @property
    def group(self) -> np.ndarray:
        """(R,) modes of one number are one pole of which there are several: their shapes are any of a space."""
        found: np.ndarray = self.whole.group[self.inside]
        return found

    @property
    def multiplicity(self) -> np.ndarray:
        """(R,) how many modes have the same pole."""
        return np.array([np.sum(self.group == own) for own in self.group], dtype=int)

    @property
    def frequency_interval(self) -> np.ndarray:
        """(R,) Hz: the frequency is known to plus or minus this, with `CONFIDENCE`."""
        found: np.ndarray = self._quantile * self.deviations.frequency[self.inside]
        return found

    @property
    def damping_interval(self) -> np.ndarray:
        """(R,) likewise of the damping ratio."""
        found: np.ndarray = self._quantile * self.deviations.damping[self.inside]
        return found

    @property
    def _quantile(self) -> float:
        return float(student.ppf(0.5 + CONFIDENCE / 2, self.deviations.freedom))

    @cached_property
    def _upright(self) -> tuple[np.ndarray, np.ndarray]:
        """Shapes (o, R) as real as they can be, the greatest component of each 1, and the participation (i, R) with them."""
        shapes, participation = np.array(self.linear.shapes), np.array(self.whole.participation)
        for members in self.whole.groups:
            own = shapes[:, members]
            real = np.linalg.svd(np.concatenate([own.real, own.imag], axis=1))[0][:, : len(members)]
            turn = np.linalg.lstsq(own, real.astype(complex), rcond=None)[0]
            turned = own @ turn
            turn = turn / turned[np.argmax(np.abs(turned), axis=0), np.arange(len(members))]
            shapes[:, members] = own @ turn
            participation[:, members] = np.linalg.solve(turn, participation[:, members].T).T
        return shapes[:, self.inside], participation[:, self.inside]

    @property
    def shapes(self) -> np.ndarray:
        """(o, R) complex, the greatest component of each 1; of modes with one pole a basis of their space."""
        return self._upright[0]

    @property
    def participation(self) -> np.ndarray:
        """(i, R) complex, m rad/s per N: the residue of a mode is the product of its shape and its participation."""
        return self._upright[1]

    @property
    def collinearity(self) -> np.ndarray:
        """(R,) modal phase collinearity: 1 where all points move in phase or against it, less where they do not.

        Vacher, Jacquier, Bucharles, "Extensions of the MAC criterion to complex modes", ISMA 2010.
        """
        real, imaginary = self.shapes.real, self.shapes.imag
        xx, yy, xy = (np.sum(a * b, axis=0) for a, b in ((real, real), (imaginary, imaginary), (real, imaginary)))
        found: np.ndarray = ((xx - yy) ** 2 + 4 * xy**2) / (xx + yy) ** 2
        return found

    @property
    def presence(self) -> np.ndarray:
        """(R,) part of the upper half of the orders in which the diagram has a stable pole there."""
        diagram = self.diagram
        upper = diagram.stable & (diagram.order > diagram.order.max(initial=0) / 2)
        levels = max(1, len(np.unique(diagram.order[diagram.order > diagram.order.max(initial=0) / 2])))
        apart = np.abs(diagram.frequency[None, :] - self.frequency[:, None])
        near = apart <= IN_FREQUENCY * self.frequency[:, None]
        return np.array([len(np.unique(diagram.order[upper & one])) / levels for one in near])

    def scaled_shapes(self) -> np.ndarray | None:
        """(o, R) of unit modal mass, kg^-1/2, as for light proportional damping; None where no reference is a response too.

        From all driving points: psi_d l_d / (s - lambda) has the residue phi_d^2 / (2 j omega_damped).
        """
        places = driving_points(self.responses, self.references)
        if not places:
            return None
        outputs, inputs, signs = (np.array(part) for part in zip(*places, strict=True))
        made = np.array(self.shapes)
        for own in np.unique(self.group):
            members = np.flatnonzero(self.group == own)
            if len(places) < len(members):
                return None
            at = signs[:, None] * self.shapes[outputs][:, members]
            theirs = self.participation[inputs][:, members] * 2j * self.poles[members[0]].imag
            mass = np.linalg.lstsq(at, theirs, rcond=None)[0]
            made[:, members] = self.shapes[:, members] @ sqrtm((mass + mass.T) / 2)
        return made

    def synthesis(self, frequency: Sequence[float] | np.ndarray | None = None) -> np.ndarray:
        """(o, i, n) as measured (m, m/s or m/s^2 per load), at frequencies in Hz above zero; those of the band by default."""
        omega = self.band.omega if frequency is None else 2 * math.pi * np.asarray(frequency, dtype=float)
        found: np.ndarray = synthesised(omega, self.whole, self.linear)
        return found * (1j * omega) ** self.band.derivatives[:, :, None]

    @property
    def motions(self) -> np.ndarray:
        """(o, i) words: what the responses are, empty where nothing was measured."""
        words = np.array(MOTIONS, dtype=object)[self.band.derivatives]
        return np.where(self.band.known, words, "")

    @property
    def measured(self) -> np.ndarray:
        """(o, i, n) as measured; NaN where nothing was."""
        found: np.ndarray = self.band.values * (1j * self.band.omega) ** self.band.derivatives[:, :, None]
        return np.where(self.band.known[:, :, None], found, np.nan)

    @cached_property
    def frac(self) -> np.ndarray:
        """(o, i) frequency response assurance criterion of what was measured and synthesised; NaN where nothing was."""
        shape = self.band.values.shape
        alike = frac(self.measured.reshape(-1, shape[-1]), self.synthesis().reshape(-1, shape[-1]))
        return np.where(self.band.known, alike.reshape(shape[:2]), np.nan)

    @property
    def noise_part(self) -> np.ndarray:
        """(o, i) root mean square of the noise over that of the function."""
        size = np.abs(self.synthesis())
        found: np.ndarray = np.sqrt(np.mean(self.noise.variance(size), axis=-1) / np.mean(size**2, axis=-1))
        return np.where(self.band.known, found, np.nan)

    @property
    def clear(self) -> np.ndarray:
        """(o, i) whether a function was measured and is more than noise: what is nought by symmetry is noise alone."""
        found: np.ndarray = self.band.known & (np.nan_to_num(self.noise_part, nan=np.inf) < NOISY)
        return found

    @property
    def mean_frac(self) -> float:
        """Of the clear functions; NaN where there are none."""
        return float(np.mean(self.frac[self.clear])) if np.any(self.clear) else math.nan

    @property
    def driving_residues(self) -> np.ndarray:
        """(d, R) of driving points, kg^-1: squares of shapes of unit modal mass, so above zero but for noise."""
        places = driving_points(self.responses, self.references)
        rows = [sign * self.shapes[o] * self.participation[i] for o, i, sign in places]
        return np.array(rows).reshape(len(places), len(self)) * 2j * self.poles.imag


def deviations(modes: Modes, covariance: np.ndarray, freedom: float) -> Deviations:
    """Of frequency and damping, from the covariance of the shared unknowns, whose first are the poles of the groups."""
    half, size = len(covariance) // 2, np.abs(modes.poles)
    real, imaginary = modes.group, half + modes.group
    both = np.array(
        [[covariance[real, real], covariance[real, imaginary]], [covariance[imaginary, real], covariance[imaginary, imaginary]]]
    )
    by_frequency = np.array([modes.poles.real, modes.poles.imag]) / size / (2 * math.pi)
    by_damping = np.array([-(modes.poles.imag**2), modes.poles.real * modes.poles.imag]) / size**3
    spread = [np.sqrt(np.maximum(np.einsum("ar,abr,br->r", slope, both, slope), 0)) for slope in (by_frequency, by_damping)]
    return Deviations(spread[0], spread[1], freedom)


def driving_points(responses: Sequence[Channel], references: Sequence[Channel]) -> list[tuple[int, int, float]]:
    """Responses and references at one point along one line, and 1, or -1 where they point against each other."""
    found = []
    for i, load in enumerate(references):
        for o, sensor in enumerate(responses):
            along = float(np.dot(sensor.direction, load.direction))
            if sensor.point == load.point and sensor.is_rotation == load.is_rotation and abs(along) > 1 - ALONG:
                found.append((o, i, math.copysign(1.0, along)))
    return found
