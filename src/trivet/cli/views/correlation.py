"""Measured responses beside those of a machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.cli.views.layout import table, where
from trivet.cli.views.si import finite, pose_keys
from trivet.kinematics.mode import mode_text
from trivet.measure.functions import Channel
from trivet.measure.machine.setup import Placed, Site
from trivet.space.pose import zyz_angles
from trivet.study.correlate import Correlation, ModesBeside, ShownCorrelation, distances

ROWS = 40
"""Rows of a table, at most."""
NEAR = 1e-9
"""m, within which a point was measured where it lies."""


def tables(shown: ShownCorrelation) -> Iterator[Any]:
    """Where it was measured, how alike functions are, how alike all are over frequency, which modes are which."""
    result = shown.whole
    yield _setting(result)
    yield _points(result.placed)
    yield _functions(result)
    yield _signatures(result)
    if result.modes is not None:
        yield _modes(result.modes)
        yield _channels(result.modes)


def _setting(result: Correlation) -> str:
    at, frequency = result.placed, result.measured.frequency
    far = distances(at)
    stand = where(at.machine.name, mode_text(at.machine, at.signs), at.centre.tolist(), _angles(at))
    source = f"{result.measured.source}: " if result.measured.source else ""
    lines = [stand, f"{source}{len(result.measured)} functions at {len(frequency)} frequencies, {_range(frequency)}"]
    if far.greatest > NEAR:
        lines.append(f"point {far.point} was measured farthest from where it lies on the machine: {far.greatest * 1e3:.3g} mm")
    lines.append(f"computed with loss factor {result.loss_factor:g}")
    return "\n".join(lines)


def _angles(at: Placed) -> list[float]:
    return [float(angle) for angle in zyz_angles(at.frame)]


def _range(frequency: np.ndarray) -> str:
    return f"{frequency[0]:g} to {frequency[-1]:g} Hz"


def _points(at: Placed) -> Any:
    found = table("measured points", "point", "on", "x mm", "y mm", "z mm", "measured mm away", "sensor g", left=2)
    for site in list(at.sites.values())[:ROWS]:
        away = "" if math.isnan(site.distance) else f"{site.distance * 1e3:.3f}"
        found.add_row(
            site.point, site.on, *(f"{c * 1e3:.3f}" for c in site.at), away, f"{site.mass * 1e3:g}" if site.mass else ""
        )
    _more(found, len(at.sites), 6)
    return found


def _more(found: Any, count: int, blanks: int) -> None:
    if count > ROWS:
        found.add_row(f"and {count - ROWS} more with --json", *[""] * blanks)


def _functions(result: Correlation) -> Any:
    found = table("functions", "response / reference", "measured", "FRAC", "FAAC", left=2)
    for k, label in enumerate(result.measured.labels[:ROWS]):
        found.add_row(label, result.measured.motions[k], _criterion(result.frac[k]), _criterion(result.faac[k]))
    _more(found, len(result.measured), 3)
    if len(result.measured) > 1:
        found.add_row("in the mean", "", *(_criterion(_mean(values)) for values in (result.frac, result.faac)))
    return found


def _criterion(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.4f}"


def _mean(values: np.ndarray) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else math.nan


def _signatures(result: Correlation) -> Any:
    found = table("all functions together", "", "in the mean", "least", "at Hz")
    for name, values in (("CSAC, of the shape", result.csac), ("CSF, with the size", result.csf)):
        if np.isfinite(values).any():
            least = int(np.nanargmin(values))
            found.add_row(
                name, _criterion(_mean(values)), _criterion(float(values[least])), f"{result.measured.frequency[least]:g}"
            )
    return found


def _modes(modes: ModesBeside) -> Any:
    found = table(
        "modes", "measured", "Hz", "damping %", "computed", "Hz", "damping %", "Hz by %", "damping by %", "MAC", left=0
    )
    partner = {pair.measured: pair for pair in modes.pairs}
    for k, (frequency, damping) in enumerate(zip(modes.measured.frequency, modes.measured.damping, strict=True)):
        row = [str(k + 1), f"{frequency:.2f}", f"{100 * damping:.3f}"]
        if (pair := partner.get(k)) is not None:
            apart = "" if math.isnan(pair.damping_difference) else f"{100 * pair.damping_difference:+.1f}"
            row += [str(pair.computed + 1), f"{pair.frequency[1]:.2f}", f"{100 * pair.damping[1]:.3f}"]
            row += [f"{100 * pair.frequency_difference:+.2f}", apart, f"{pair.mac:.4f}"]
        found.add_row(*row)
    return found


def _channels(modes: ModesBeside) -> Any:
    found = table("channels, the least alike first", "channel", "CoMAC over the pairs of modes")
    order = np.argsort(np.nan_to_num(modes.comac, nan=2.0), kind="stable")
    for k in order[:ROWS]:
        found.add_row(str(modes.channels[k]), _criterion(float(modes.comac[k])))
    _more(found, len(modes.channels), 1)
    return found


def as_json(shown: ShownCorrelation) -> dict[str, Any]:
    """All of it."""
    result, at = shown.whole, shown.whole.placed
    return {
        "machine": at.machine.name,
        "mode": mode_text(at.machine, at.signs),
        **pose_keys(at.centre.tolist(), _angles(at)),
        "source": result.measured.source,
        "loss_factor": result.loss_factor,
        "points": [_point(site) for site in at.sites.values()],
        "functions": [
            {
                "response": _channel(response),
                "reference": _channel(reference),
                "motion": motion,
                "frac": finite(result.frac[k]),
                "faac": finite(result.faac[k]),
            }
            for k, (response, reference, motion) in enumerate(
                zip(result.measured.responses, result.measured.references, result.measured.motions, strict=True)
            )
        ],
        "frequency_Hz": finite(result.measured.frequency),
        "csac": finite(result.csac),
        "csf": finite(result.csf),
        "modes": None if result.modes is None else _modes_json(result.modes),
    }


def _point(site: Site) -> dict[str, Any]:
    return {
        "point": site.point,
        "on": site.on,
        "position_m": finite(site.at),
        "measured_position_m": None if site.measured is None else finite(site.measured),
        "distance_m": finite(site.distance),
        "sensor_mass_kg": site.mass,
    }


def _channel(channel: Channel) -> dict[str, Any]:
    return {"point": channel.point, "direction": list(channel.direction), "is_rotation": channel.is_rotation}


def _modes_json(modes: ModesBeside) -> dict[str, Any]:
    return {
        "measured_frequency_Hz": finite(modes.measured.frequency),
        "measured_damping_ratio": finite(modes.measured.damping),
        "computed_frequency_Hz": finite(modes.computed.frequency),
        "computed_damping_ratio": finite(modes.computed.damping),
        "mac": finite(modes.mac),
        "pairs": [
            {
                "measured": pair.measured + 1,
                "computed": pair.computed + 1,
                "mac": pair.mac,
                "frequency_difference": pair.frequency_difference,
                "damping_difference": finite(pair.damping_difference),
            }
            for pair in modes.pairs
        ],
        "channels": [_channel(channel) | {"comac": finite(modes.comac[k])} for k, channel in enumerate(modes.channels)],
    }
