"""A modal fit of one reference against sdypy-EMA: poles of all orders, then residues of the same chosen poles."""

from __future__ import annotations

import contextlib
import io
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.kernels import Row
from benchmarks.pairs import paired
from benchmarks.vibration import faster
from tests.synthetic_modes import Truth, functions, noisy
from trivet.measure.modal.fitting import fit_modes, matrix_of
from trivet.measure.modal.least_squares_complex import estimate
from trivet.measure.modal.residues import Modes, shapes_of
from trivet.measure.modal.stabilisation import nearest, stabilisation

LOW, HIGH, ORDER, OUTPUTS, LINES = 20.0, 1000.0, 60, 30, 2001
TRUTH = Truth.of(
    (87, 150, 212, 300, 341, 450, 560, 700, 805, 930), (0.01, 0.02, 0.01, 0.012, 0.005, 0.01, 0.01, 0.01, 0.02, 0.01), OUTPUTS
)


class Setting:
    """One set of accelerances, and both fits of it."""

    def __init__(self) -> None:
        self.frequency = np.linspace(0.0, HIGH, LINES)
        self.values = noisy(TRUTH.matrix(self.frequency, 1, 2), "relative", 0.01, 1)
        self.measured = functions(self.frequency, self.values, 2)

    def theirs(self) -> Any:
        from sdypy import EMA

        with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            model = EMA.Model(
                self.values[:, 0], self.frequency, lower=LOW, upper=HIGH, pol_order_high=ORDER, frf_form="accelerance"
            )
            model.get_poles(show_progress=False)
            model.select_closest_poles(list(TRUTH.natural))
            model.get_constants()
        return model

    def ours(self) -> tuple[np.ndarray, np.ndarray]:
        """Poles (rad/s) and residues (o, R), unweighted, as sdypy takes them."""
        band, _, _ = matrix_of(self.measured.between(LOW, HIGH))
        found = estimate(band.omega, band.values * 1j * band.omega, ORDER)
        diagram = stabilisation(found, 2 * math.pi * LOW, 2 * math.pi * HIGH)
        poles = nearest(diagram, TRUTH.natural).poles
        modes = Modes(poles, np.ones((1, len(poles)), dtype=complex), np.arange(len(poles)))
        return poles, shapes_of(band, modes, band.motion_size**2)[0].shapes


def modal_fit() -> Iterator[Row]:
    """The same steps, and beside them what the whole fit of greatest likelihood takes."""
    setting = Setting()
    poles, residues = setting.ours()
    model = setting.theirs()
    size = np.abs(poles) / (2 * math.pi)
    worst = float(np.max(np.abs(size / np.array(TRUTH.natural) - 1)))
    theirs = float(np.max(np.abs(np.array(model.nat_freq) / np.array(TRUTH.natural) - 1)))
    assert worst < 2e-3, "the same modes"
    assert theirs < 2e-3, "the same modes"
    np.testing.assert_allclose(np.abs(residues), np.abs(np.array(model.A)), rtol=0.2, atol=0.05 * np.abs(residues).max())
    what = f"modal fit, {OUTPUTS} accelerances × {LINES:,} frequencies, one reference, orders up to {ORDER}"
    same = paired(setting.ours, setting.theirs, pairs=11, calls=2)
    yield f"{what}: ratio to sdypy-EMA, poles of all orders and residues of ten", faster(same), "≥ 0.83"
    whole = paired(lambda: fit_modes(setting.measured, LOW, HIGH, order=ORDER), setting.theirs, pairs=5, calls=1)
    yield f"{what}: ratio with modes and noise of greatest likelihood, intervals", faster(whole), ""
