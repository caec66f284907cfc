"""Comparisons with measured responses as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.kinematics.mode import mode_text
from trivet.measure.channels import unit_of, written
from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.correlate import Correlation, ModesBeside

if TYPE_CHECKING:
    import xarray as xr

Variables = dict[str, tuple[Any, ...]]
_WORDS = np.dtype(object)


def correlation_dataset(result: Correlation) -> xr.Dataset:
    """Measured and computed responses with all criteria; real and imaginary part are the last axis."""
    measured, at = result.measured, result.placed
    over = ("function", "frequency")
    units = [unit_of(*one) for one in zip(measured.motions, measured.responses, measured.references, strict=True)]
    sites = list(at.sites.values())
    places = np.array([np.full(3, np.nan) if site.measured is None else site.measured for site in sites])
    variables: Variables = {
        "response": (("function",), np.array([written(c) for c in measured.responses], _WORDS), "1", "as measured"),
        "reference": (("function",), np.array([written(c) for c in measured.references], _WORDS), "1", "where the load is"),
        "motion": (("function",), np.array(measured.motions, _WORDS), "1", "what the response is"),
        "unit": (("function",), np.array(units, _WORDS), "1", "of the values"),
        "measured": ((*over, "part"), _parts(measured.values), "see unit", "motion per load, exp(+i omega t)"),
        "computed": ((*over, "part"), _parts(result.computed.values), "see unit", "the machine's at the same channels"),
        "frac": (("function",), result.frac, "1", "frequency response assurance criterion"),
        "faac": (("function",), result.faac, "1", "frequency amplitude assurance criterion"),
        "csac": (("frequency",), result.csac, "1", "cross signature assurance criterion, of displacements"),
        "csf": (("frequency",), result.csf, "1", "cross signature scale factor, of displacements"),
        "position": (("point", "axis"), np.array([site.at for site in sites]), "m", "of the point on the machine, in {O}"),
        "measured_position": (("point", "axis"), places, "m", "where it was measured, in {O}; NaN where that is not known"),
        "place": (("point",), np.array([site.on for site in sites], _WORDS), "1", "part of the machine on which it is"),
        "sensor_mass": (("point",), np.array([site.mass for site in sites]), "kg", "fixed there"),
    }
    coordinates: dict[str, Any] = {
        "frequency": measured.frequency,
        "part": ("real", "imag"),
        "axis": COMPONENTS[:3],
        "point": [site.point for site in sites],
    }
    if result.modes is not None:
        variables |= _of_modes(result.modes)
        coordinates["channel"] = [written(channel) for channel in result.modes.channels]
    made = labelled(
        at.machine, variables, coordinates, working_mode=mode_text(at.machine, at.signs), loss_factor=result.loss_factor,
        source=measured.source,
    )  # fmt: skip
    made.frequency.attrs.update({"units": "Hz", "long_name": "frequency"})
    return made


def _parts(values: np.ndarray) -> np.ndarray:
    return np.stack([values.real, values.imag], axis=-1)


def _of_modes(modes: ModesBeside) -> Variables:
    partner = np.zeros(len(modes.measured.frequency), dtype=int)
    for pair in modes.pairs:
        partner[pair.measured] = pair.computed + 1
    return {
        "measured_frequency": (("measured_mode",), modes.measured.frequency, "Hz", "of fitted modes"),
        "measured_damping": (("measured_mode",), modes.measured.damping, "1", "ratio"),
        "computed_frequency": (("computed_mode",), modes.computed.frequency, "Hz", "of the machine's modes"),
        "computed_damping": (("computed_mode",), modes.computed.damping, "1", "ratio"),
        "mac": (("measured_mode", "computed_mode"), modes.mac, "1", "of modes that coincide, of the spaces which they span"),
        "partner": (("measured_mode",), partner, "1", "number, from 1, of the computed mode that it is; 0 for none"),
        "comac": (("channel",), modes.comac, "1", "over the pairs"),
    }
