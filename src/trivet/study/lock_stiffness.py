"""What a machine so locked is along x, y and z, beside what its drives were locked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trivet.study.lock_measures import upper_piece
from trivet.study.lock_values import Holding, Poses, split


def axis_stiffness(holding: Holding, poses: Poses) -> dict[str, float]:
    """K_xx, 1/C_xx, ... along three axes (N/m), each the least over poses, whose rolls are those of the holding."""
    whole = np.sum(list(_pieces(holding, poses)), axis=0)
    stiffness = np.empty((len(whole), 6, 6))
    rows, columns = np.triu_indices(6)
    stiffness[:, rows, columns] = stiffness[:, columns, rows] = whole
    compliance = np.linalg.inv(stiffness)
    found = {}
    for k, axis in enumerate("xyz"):
        found[f"K_{axis}{axis}"] = float(stiffness[:, k, k].min())
        found[f"1/C_{axis}{axis}"] = float((1 / compliance[:, k, k]).min())
    return found


def _pieces(holding: Holding, poses: Poses) -> Iterator[np.ndarray]:
    for way, own in zip(holding.ways, split(holding.ways, holding.values), strict=True):
        yield way.rows(upper_piece, np.tile(own, (len(poses), 1)), poses.frames, holding.rolls)[0]
