"""Numbers for programs: SI throughout, the unit at the end of every key that has one, null where there is no number."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from trivet.measure.functions import Channel, Functions
    from trivet.model.quantity import Quantity
    from trivet.study.frf import Minimum


def finite(value: Any) -> Any:
    """Numbers and arrays as JSON can hold them: NaN and infinities become null."""
    if isinstance(value, np.ndarray):
        return [finite(v) for v in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def key(name: str, kind: Quantity) -> str:
    """A key of JSON that ends with the SI unit: "mean K_xx" as "mean_K_xx_N_per_m"."""
    plain = re.sub(r"[^0-9A-Za-z_.-]+", "_", name.replace("1/C", "1_C")).strip("_")
    units = kind.si.replace("/", "_per_").replace("^", "").replace(" ", "_")
    return f"{plain}_{units}" if units else plain


def diagonal_key(name: str) -> str:
    """ "K_xx" as "K_xx_N_per_m", a rotational one as "K_rx_N_m_per_rad"."""
    return f"{name}_{'N_m_per_rad' if '_r' in name else 'N_per_m'}"


def pose_keys(position: Sequence[float], angles: Sequence[float]) -> dict[str, Any]:
    """A pose."""
    azimuth, tilt, roll = angles
    return {"position_m": [float(c) for c in position], "azimuth_rad": azimuth, "tilt_rad": tilt, "roll_rad": roll}


def channel_keys(channel: Channel) -> dict[str, Any]:
    """A sensor or an exciter."""
    return {"point": channel.point, "direction": list(channel.direction), "is_rotation": channel.is_rotation}


def function_keys(response: Channel, reference: Channel, motion: str) -> dict[str, Any]:
    """Which measured function it is."""
    return {"response": channel_keys(response), "reference": channel_keys(reference), "motion": str(motion)}


def functions_json(functions: Functions) -> list[dict[str, Any]]:
    """Which each is."""
    return [function_keys(*one) for one in zip(functions.responses, functions.references, functions.motions, strict=True)]


def minima_json(minima: Iterable[Minimum]) -> list[dict[str, Any]]:
    """Minima of the dynamic stiffness, with their units."""
    return [
        {
            "direction": m.direction,
            f"stiffness_{'N_m_per_rad' if m.direction.startswith('r') else 'N_per_m'}": finite(m.stiffness),
            "frequency_Hz": finite(m.frequency),
        }
        for m in minima
    ]
