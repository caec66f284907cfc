"""Measured responses beside those of a machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from trivet.kinematics.mode import mode_text
from trivet.measure.correlation import mean
from trivet.measure.machine.setup import Placed, Site
from trivet.space.pose import zyz_angles
from trivet.study.correlate import Correlation, ModesBeside, ShownCorrelation, distances
from trivet.views.layout import more, table, where
from trivet.views.likeness import criteria, idle, means
from trivet.views.si import channel_keys, finite, functions_json, pose_keys

ROWS = 40
"""Rows of a table, at most."""
FAR_OFF = 0.3
"""Mean FRAC below which resonances do not coincide."""
NEAR = 1e-9
"""m, within which a point was measured where it lies."""


def tables(shown: ShownCorrelation) -> Iterator[Any]:
    """Where it was measured, how alike functions are, how alike all are over frequency, which modes are which."""
    result = shown.whole
    yield _setting(result)
    yield _points(result.placed)
    yield from idle(result.placed)
    yield _functions(result)
    if mean(result.frac) < FAR_OFF:
        yield (
            "machine and measurement are far apart: resonances do not coincide; fit modes (trivet measure fit), compare them "
            "(--fit), and correct numbers of the machine (trivet measure update)"
        )
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
    more(found, len(at.sites), ROWS)
    return found


def _functions(result: Correlation) -> Any:
    found = table("functions", "response / reference", "measured", "FRAC", "FAAC", left=2)
    both = result.frac, result.faac
    for k, label in enumerate(result.measured.labels[:ROWS]):
        found.add_row(label, result.measured.motions[k], *criteria(both, k))
    more(found, len(result.measured), ROWS)
    if len(result.measured) > 1:
        found.add_row("in the mean", "", *means(both))
    return found


def _signatures(result: Correlation) -> Any:
    found = table("all functions together", "", "in the mean", "least", "at Hz")
    for name, values in (("CSAC, of the shape", result.csac), ("CSF, with the size", result.csf)):
        if np.isfinite(values).any():
            least = int(np.nanargmin(values))
            found.add_row(name, *means([values]), *criteria([values], least), f"{result.measured.frequency[least]:g}")
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
        found.add_row(str(modes.channels[k]), *criteria([modes.comac], k))
    more(found, len(modes.channels), ROWS)
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
        "idle_points": list(result.placed.idle),
        "points": [_point(site) for site in at.sites.values()],
        "functions": [
            one | {"frac": finite(result.frac[k]), "faac": finite(result.faac[k])}
            for k, one in enumerate(functions_json(result.measured))
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
        "channels": [channel_keys(channel) | {"comac": finite(modes.comac[k])} for k, channel in enumerate(modes.channels)],
    }
