"""Mode shapes in universal files: dataset 55."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from trivet.measure.universal.parse import Fields


@dataclass(frozen=True)
class MeasuredMode:
    """A mode that another program identified."""

    pole: complex
    """rad/s, with a positive imaginary part where it oscillates."""
    points: tuple[str, ...]
    """(p,)"""
    shape: np.ndarray
    """(p, 3) complex: translations in the axes of the measurement, of any size; (p, 6) with rotations."""
    title: str = ""

    @property
    def frequency(self) -> float:
        """Hz, |pole| / 2 pi."""
        return abs(self.pole) / (2 * math.pi)

    @property
    def damping(self) -> float:
        """Ratio, -Re pole / |pole|; zero at rest."""
        return -self.pole.real / abs(self.pole) if self.pole else 0.0


def mode_of(fields: Fields) -> MeasuredMode:
    """A mode from what pyuff makes of dataset 55; normal modes have the viscous damping ratio, or half the hysteretic one."""
    if fields["analysis_type"] == 2:
        ratio = fields["modal_damp_vis"] or fields["modal_damp_his"] / 2
        pole = 2 * math.pi * fields["freq"] * complex(-ratio, cmath.sqrt(1 - ratio**2).real)
    else:
        pole = complex(fields["eig"].real, abs(fields["eig"].imag))
    columns = [fields[f"r{k}"] for k in range(1, 7) if f"r{k}" in fields]
    shape = np.column_stack(columns).astype(complex)
    if fields["analysis_type"] != 2 and fields["eig"].imag < 0:
        shape = shape.conj()
    words = [str(fields[f"id{k}"]) for k in range(1, 6)]
    title = next((word for word in words if word.upper() not in ("", "NONE")), "")
    return MeasuredMode(pole, tuple(str(number) for number in fields["node_nums"]), shape, title)
