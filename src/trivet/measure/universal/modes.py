"""Mode shapes in universal files: dataset 55."""

from __future__ import annotations

import cmath
import math

import numpy as np

from trivet.measure.imported import MeasuredMode
from trivet.measure.universal.plain import Fields
from trivet.measure.universal.points import Geometry
from trivet.measure.universal.scan import Block
from trivet.measure.universal.units import is_none


def mode_of(block: Block, fields: Fields, place: Geometry) -> MeasuredMode:
    """A mode from what pyuff makes of dataset 55, turned from the axes along which its points move into those of the part.

    Normal modes have the viscous damping ratio, or half the hysteretic one.

    Raises:
        InputError: for a point that moves along axes which nothing defines.
    """
    if fields["analysis_type"] == 2:
        ratio = fields["modal_damp_vis"] or fields["modal_damp_his"] / 2
        pole = 2 * math.pi * fields["freq"] * complex(-ratio, cmath.sqrt(1 - ratio**2).real)
    else:
        pole = complex(fields["eig"].real, abs(fields["eig"].imag))
    columns = [fields[f"r{k}"] for k in range(1, 7) if f"r{k}" in fields]
    numbers = [int(number) for number in fields["node_nums"]]
    shape = np.column_stack(columns).astype(complex)
    for row, number in zip(shape, numbers, strict=True):
        row[:] = (place.axes(block, number) @ row.reshape(-1, 3).T).T.ravel()
    if fields["analysis_type"] != 2 and fields["eig"].imag < 0:
        shape = shape.conj()
    title = next((word for k in range(1, 6) if not is_none(word := str(fields[f"id{k}"]))), "")
    return MeasuredMode(pole, tuple(str(number) for number in numbers), shape, title)
