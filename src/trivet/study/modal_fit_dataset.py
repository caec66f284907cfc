"""Modes of measured responses as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trivet.measure.channels import written
from trivet.measure.modal.model import CONFIDENCE, ModalFit
from trivet.results.netcdf import described

if TYPE_CHECKING:
    import xarray as xr

_RESIDUE = "the residue of a mode is shape times participation: H = sum of residue / (j omega - pole) and its mirror image"


def fit_dataset(result: ModalFit) -> xr.Dataset:
    """A modal fit: modes, measured and synthesised functions, poles of all orders; complex numbers along the axis "part"."""
    scaled, diagram = result.scaled_shapes(), result.diagram
    half = f"half width of the {100 * CONFIDENCE:g} % interval"
    over, along = ("response", "reference"), ("response", "reference", "frequency", "part")
    variables = {
        "frequency": (("frequency",), result.functions.frequency, "Hz", "of the band"),
        "natural_frequency": (("mode",), result.frequency, "Hz", "undamped"),
        "natural_frequency_interval": (("mode",), result.frequency_interval, "Hz", half),
        "damping": (("mode",), result.damping, "1", "ratio"),
        "damping_interval": (("mode",), result.damping_interval, "1", half),
        "pole": (("mode", "part"), _parts(result.poles), "rad/s", "exp(+i omega t): the real part is negative"),
        "pole_number": (("mode",), result.group, "1", "modes of one number are one pole; their shapes are any of a space"),
        "shape": (("response", "mode", "part"), _parts(result.shapes), "1", "the greatest component of each is 1"),
        "participation": (("reference", "mode", "part"), _parts(result.participation), "m rad/s/N", _RESIDUE),
        "collinearity": (("mode",), result.collinearity, "1", "modal phase collinearity"),
        "presence": (("mode",), result.presence, "1", "part of the upper half of the orders in which it is stable"),
        "upper_residual": ((*over, "part"), _parts(result.linear.upper), "m/N", "receptance of what lies above"),
        "lower_residual": (
            (*over, "part"), _parts(result.linear.lower), "m rad^2/s^2/N", "receptance of what lies below, times -omega^2",
        ),
        "motion": (over, result.motions, "1", "what the responses are; empty where nothing was measured"),
        "frac": (over, result.frac, "1", "frequency response assurance criterion; NaN where nothing was measured"),
        "noise": (over, result.noise_part, "1", "root mean square over that of the function"),
        "measured": (along, _parts(result.measured), "SI", "m, m/s or m/s^2 per load; NaN where nothing was"),
        "synthesised": (along, _parts(result.synthesis()), "SI", "the same of the modes and residuals"),
        "diagram_order": (("stabilisation",), diagram.order, "1", "order of the model"),
        "diagram_frequency": (("stabilisation",), diagram.frequency, "Hz", "of a pole of that order"),
        "diagram_damping": (("stabilisation",), diagram.damping, "1", "ratio"),
        "diagram_stable": (("stabilisation",), diagram.stable.astype(np.int8), "1", "1 where the order below has it too"),
    }  # fmt: skip
    if scaled is not None:
        variables["scaled_shape"] = (("response", "mode", "part"), _parts(scaled), "kg^-1/2", "of unit modal mass")
    coordinates = {
        "part": ("real", "imag"),
        "response": [written(channel) for channel in result.responses],
        "reference": [written(channel) for channel in result.references],
        "mode": range(1, len(result) + 1),
    }
    chosen = "by the program" if result.is_automatic else "by the user"
    return described(variables, coordinates, kind="trivet modal fit", source=result.functions.source, modes_chosen=chosen)


def _parts(values: np.ndarray) -> np.ndarray:
    return np.stack([values.real, values.imag], axis=-1)
