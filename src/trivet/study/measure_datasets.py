"""Comparisons with measured responses as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.kinematics.mode import mode_text
from trivet.measure.channels import unit_of, written
from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.correlate import Correlation, ModesBeside
from trivet.study.update import Update

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


def update_dataset(result: Update) -> xr.Dataset:
    """Numbers before and after with what is sure of them, and functions as measured, before and after; the corrected machine is
    the one inside."""
    free, told = result.problem.free, result.told
    compared = [result.fitted] if result.held is None else [result.fitted, result.held]

    def over(kind: str) -> np.ndarray:
        return _parts(np.concatenate([getattr(one, kind).values for one in compared]))

    responses, references = (
        [c for one in compared for c in getattr(one.measured, kind)] for kind in ("responses", "references")
    )
    fitted = np.concatenate([np.full(len(one.measured), one is result.fitted) for one in compared])
    words = {"response": (responses, "as measured"), "reference": (references, "where the load is")}
    dimensions = ("function", "frequency", "part")
    variables: Variables = {
        "before": (("parameter",), free.start, "see unit", "in the machine file"),
        "after": (("parameter",), result.after, "see unit", "most probable"),
        "standard_deviation": (("parameter",), result.deviation, "see unit", "afterwards"),
        "unit": (("parameter",), np.array([kind.si or "1" for kind in free.kinds], _WORDS), "1", "of the number"),
        "is_logarithmic": (("parameter",), np.array(free.is_log, dtype=np.int8), "1", "1 where theta is the logarithm"),
        "theta": (("parameter",), result.found.theta, "1", "of the numbers, logarithms or themselves in SI"),
        "spread": (("parameter",), free.spread, "1", "standard deviation of theta beforehand"),
        "covariance": (("parameter", "other"), result.covariance, "1", "of theta afterwards"),
        "correlation": (("parameter", "other"), told.correlation, "1", "afterwards"),
        "is_fitted": (("function",), fitted.astype(np.int8), "1", "0 where a function was held back"),
        "measured": (dimensions, over("measured"), "SI", "motion per load, exp(+i omega t)"),
        "computed_before": (dimensions, over("before"), "SI", "the machine's at the same channels"),
        "computed_after": (dimensions, over("after"), "SI", "the corrected machine's"),
    } | {k: (("function",), np.array([written(c) for c in own], _WORDS), "1", text) for k, (own, text) in words.items()}
    paths = list(free.paths)
    made = labelled(
        result.machine, variables,
        {"parameter": paths, "other": paths, "frequency": result.fitted.measured.frequency, "part": ("real", "imag")},
        loss_factor=result.loss_factor, source=result.fitted.measured.source,
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
