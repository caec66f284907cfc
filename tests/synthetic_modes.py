"""Responses of modes that are known, noise on them, and how a fit is compared with the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from trivet.measure.functions import MOTIONS, Channel, Functions
from trivet.measure.modal.fitting import matrix_of
from trivet.measure.modal.residues import Band, Modes

Kind = Literal["relative", "added"]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Truth:
    """Modes of unit modal mass with light proportional damping."""

    natural: tuple[float, ...]
    """Hz"""
    damping: tuple[float, ...]
    shapes: np.ndarray
    """(o, R) kg^-1/2; the references are the first responses."""

    @classmethod
    def of(cls, natural: Any, damping: Any, outputs: int, seed: int = 0) -> Truth:
        shapes = np.random.default_rng(seed).normal(size=(outputs, len(natural)))
        return cls(tuple(natural), tuple(damping), shapes)

    @property
    def poles(self) -> np.ndarray:
        omega, ratio = 2 * math.pi * np.array(self.natural), np.array(self.damping)
        found: np.ndarray = omega * (-ratio + 1j * np.sqrt(1 - ratio**2))
        return found

    def residues(self, references: int) -> np.ndarray:
        """(o, i, R)"""
        found: np.ndarray = self.shapes[:, None, :] * self.shapes[:references] / (2j * self.poles.imag)
        return found

    def matrix(self, frequency: np.ndarray, references: int, derivatives: int = 0) -> np.ndarray:
        """(o, i, n) in closed form: phi_o phi_i / (omega_r^2 - omega^2 + 2 i zeta_r omega_r omega)."""
        omega, own = 2 * math.pi * frequency, 2 * math.pi * np.array(self.natural)[:, None]
        each = 1 / (own**2 - omega**2 + 2j * np.array(self.damping)[:, None] * own * omega)
        whole: np.ndarray = np.einsum("or,ir,rn->oin", self.shapes, self.shapes[:references], each)
        return whole * (1j * omega) ** derivatives


def noisy(values: np.ndarray, kind: Kind, level: float, seed: int) -> np.ndarray:
    """With complex normal errors: a part of each value, or of the root mean square of its function."""
    rng = np.random.default_rng(seed)
    errors = (rng.normal(size=values.shape) + 1j * rng.normal(size=values.shape)) / math.sqrt(2)
    size = np.abs(values) if kind == "relative" else np.sqrt(np.mean(np.abs(values) ** 2, axis=-1, keepdims=True))
    found: np.ndarray = values + level * size * errors
    return found


def functions(frequency: np.ndarray, values: np.ndarray, derivatives: int = 0) -> Functions:
    """A matrix (o, i, n) as measured functions; three axes at every point."""
    channels = [Channel(str(1 + k // 3), AXES[k % 3]) for k in range(values.shape[0])]
    pairs = [(o, i) for o in range(values.shape[0]) for i in range(values.shape[1])]
    return Functions(
        frequency,
        values.reshape(-1, len(frequency)),
        (MOTIONS[derivatives],) * len(pairs),
        tuple(channels[o] for o, _ in pairs),
        tuple(channels[i] for _, i in pairs),
        source="synthetic",
    )


def matched(poles: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Numbers of the poles that are those of the truth, one to one."""
    rows, columns = linear_sum_assignment(np.abs(poles[:, None] - truth) / np.abs(truth))
    found: np.ndarray = rows[np.argsort(columns)]
    return found


LINES = np.linspace(20.0, 600.0, 581)
PAIRS = Truth.of((100, 100, 150, 300, 301, 450), (0.01, 0.01, 0.02, 0.01, 0.012, 0.005), 6)
"""A pair that coincides, one that is close."""
SMALL = Truth.of((100, 100, 180), (0.01, 0.01, 0.02), 3, seed=2)


def band_of(truth: Truth, lines: np.ndarray, references: int, derivatives: int = 0) -> Band:
    values = truth.matrix(lines, references, derivatives)
    return matrix_of(functions(lines, values, derivatives))[0]


def modes_of(truth: Truth, references: int, group: Any = None) -> Modes:
    return Modes.of(truth.poles, truth.shapes[:references].astype(complex), None if group is None else np.array(group))
