"""Modes of measured responses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.measure.modal.model import CONFIDENCE, ModalFit
from trivet.views.layout import more, table
from trivet.views.si import channel_keys, finite, function_keys

FUNCTIONS = 12
"""Of the table of functions, the worst first."""
REFERENCES = 6
"""Columns of participation, at most."""
COMPONENTS = 5
"""Of a shape, the greatest."""


def tables(result: ModalFit) -> Iterator[Any]:
    """Modes, what is one pole, how well functions are told."""
    yield _setting(result)
    yield _modes(result)
    yield from _notes(result)
    yield _shapes(result)
    yield _alike(result)
    yield _functions(result)


def _setting(result: ModalFit) -> str:
    functions, diagram = result.functions, result.diagram
    chosen = "stable poles" if result.is_automatic else "poles that were asked for"
    outside = len(result.whole) - len(result)
    beyond = f", {outside} more of modes outside the band that reach into it" if outside else ""
    return (
        f"{functions.source or 'measured responses'}: {len(result.responses)} responses, {len(result.references)} references, "
        f"{len(functions.frequency)} frequencies from {functions.frequency[0]:g} to {functions.frequency[-1]:g} Hz\n"
        f"{chosen} of orders up to {diagram.order.max(initial=0)}, refined to greatest likelihood{beyond}; "
        f"± is the {100 * CONFIDENCE:g} % interval"
    )


def _modes(result: ModalFit) -> Any:
    references = result.references[:REFERENCES]
    seen = [f"seen from {reference}" for reference in references]
    found = table("modes", "", "Hz", "± Hz", "damping %", "± %", "in phase", "stable %", *seen)
    part = np.abs(result.participation) / np.linalg.norm(result.participation, axis=0)
    double = result.multiplicity > 1
    for k in range(len(result)):
        found.add_row(
            f"{k + 1}{'*' if double[k] else ''}",
            _rounded(result.frequency[k], result.frequency_interval[k]),
            f"{result.frequency_interval[k]:.2g}",
            _rounded(100 * result.damping[k], 100 * result.damping_interval[k]),
            f"{100 * result.damping_interval[k]:.2g}",
            f"{result.collinearity[k]:.3f}",
            f"{100 * result.presence[k]:.0f}",
            *(f"{value:.3f}" for value in part[: len(references), k]),
        )
    return found


def _rounded(value: float, interval: float) -> str:
    """As many decimals as the interval bears, six at most."""
    decimals = 6 if not interval > 0 else min(6, max(0, 1 - math.floor(math.log10(interval))))
    return f"{value:.{decimals}f}"


def _notes(result: ModalFit) -> Iterator[str]:
    numbers = np.arange(1, len(result) + 1)
    pairs = [numbers[result.group == own] for own in np.unique(result.group) if np.sum(result.group == own) > 1]
    for members in pairs:
        yield (
            f"* {' and '.join(map(str, members))} are one pole {len(members)} times, as far as can be told: "
            "the interval is that of the pole, and the shapes are a basis of their space"
        )
    if len(result.references) == 1:
        yield "one reference: modes that coincide come out as one; a machine with equal legs has such pairs"
    real = np.sum(result.driving_residues.real, axis=0)
    if turned := [str(k + 1) for k in range(len(result)) if real[k] < -np.abs(result.driving_residues[:, k]).sum() / 2]:
        yield (
            f"at driving points modes {', '.join(turned)} answer against the load: "
            "the sign of a sensor or of the hammer is wrong, or one of them points the other way"
        )


def _shapes(result: ModalFit) -> Any:
    """Where every mode moves most."""
    found = table("shapes: where modes move most", "", "Hz", "the greatest components, against the greatest of all")
    for k in range(len(result)):
        shape = result.shapes[:, k]
        most = np.argsort(-np.abs(shape), kind="stable")[:COMPONENTS]
        found.add_row(
            str(k + 1),
            _rounded(result.frequency[k], result.frequency_interval[k]),
            ", ".join(f"{result.responses[o]} {shape[o].real:.2f}" for o in most),
        )
    return found


def _alike(result: ModalFit) -> str:
    known, clear = int(result.band.known.sum()), int(result.clear.sum())
    rest = f"; {known - clear} of {known} functions are mostly noise and do not count" if clear < known else ""
    return f"measured beside synthesised functions: FRAC {result.mean_frac:.4f} in the mean{rest}"


def _functions(result: ModalFit) -> Any:
    places = np.argwhere(result.band.known)
    places = places[np.argsort(result.frac[result.band.known], kind="stable")]
    found = table("the least alike first", "response / reference", "FRAC", "noise %")
    for o, i in places[:FUNCTIONS]:
        found.add_row(
            f"{result.responses[o]} / {result.references[i]}",
            f"{result.frac[o, i]:.4f}",
            f"{100 * result.noise_part[o, i]:.2g}",
        )
    more(found, len(places), FUNCTIONS)
    return found


def as_json(result: ModalFit) -> dict[str, Any]:
    """All numbers; complex ones as pairs of real and imaginary part."""
    scaled = result.scaled_shapes()
    return {
        "source": result.functions.source,
        "band_Hz": [float(result.functions.frequency[0]), float(result.functions.frequency[-1])],
        "frequencies": len(result.functions.frequency),
        "highest_order": int(result.diagram.order.max(initial=0)),
        "modes_chosen": "by the program" if result.is_automatic else "by the user",
        "confidence": CONFIDENCE,
        "responses": [channel_keys(channel) for channel in result.responses],
        "references": [channel_keys(channel) for channel in result.references],
        "modes": [
            {
                "frequency_Hz": float(result.frequency[k]),
                "frequency_interval_Hz": float(result.frequency_interval[k]),
                "damping_ratio": float(result.damping[k]),
                "damping_ratio_interval": float(result.damping_interval[k]),
                "pole_rad_per_s": _pair(result.poles[k]),
                "pole_number": int(result.group[k]) + 1,
                "collinearity": float(result.collinearity[k]),
                "presence": float(result.presence[k]),
                "shape": _pairs(result.shapes[:, k]),
                "participation_m_rad_per_s_N": _pairs(result.participation[:, k]),
                "scaled_shape_per_sqrt_kg": None if scaled is None else _pairs(scaled[:, k]),
            }
            for k in range(len(result))
        ],
        "functions": [
            {
                **function_keys(result.responses[o], result.references[i], result.motions[o, i]),
                "frac": finite(float(result.frac[o, i])),
                "noise": finite(float(result.noise_part[o, i])),
                "upper_residual_m_per_N": _pair(result.linear.upper[o, i]),
                "lower_residual_m_rad2_per_s2_N": _pair(result.linear.lower[o, i]),
            }
            for o, i in np.argwhere(result.band.known)
        ],
    }


def _pair(value: complex) -> list[float]:
    return [float(value.real), float(value.imag)]


def _pairs(values: np.ndarray) -> list[list[float]]:
    return [_pair(value) for value in values]
