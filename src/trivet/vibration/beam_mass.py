"""Consistent mass of the 12-dof beam element, with shear deflection and rotary inertia.

The shapes are those of the beam under loads at its ends, so that it fits the stiffness of `statics.beam_element`
(Friedman and Kosmatka, Computers & Structures 47:473, 1993, eqs 33-36); without shear it is the usual cubic element.
"""

from __future__ import annotations

import numpy as np

from trivet.statics.beam_element import PLANES, BeamElement


def local_mass(beam: BeamElement) -> np.ndarray:
    """Mass (12, 12) of a beam at one pose, in its local axes; order of dofs as in `statics.beam_element`."""
    length, made = float(beam.length), beam.made_of
    mass = np.zeros((12, 12))
    for place, inertia in ((0, made.mass), (3, made.polar)):
        ends = np.array([place, place + 6])
        mass[ends[:, None], ends] = inertia * length / 6 * np.array([[2, 1], [1, 2]])
    bending = ((made.flexural_z, made.shear_y, made.rotary_z), (made.flexural_y, made.shear_z, made.rotary_y))
    for (places, sign), (flexural, shear, rotary) in zip(PLANES, bending, strict=True):
        phi = 12 * flexural / (shear * length**2)
        signs = np.array([1, sign, 1, sign])
        plane = made.mass * length * _translation(phi, length) + rotary / length * _rotation(phi, length)
        mass[places[:, None], places] = plane * (signs[:, None] * signs)
    return mass


def _translation(phi: float, length: float) -> np.ndarray:
    a, b = 70 * phi**2 + 147 * phi + 78, (35 * phi**2 + 77 * phi + 44) * length / 4
    c, d = 35 * phi**2 + 63 * phi + 27, (35 * phi**2 + 63 * phi + 26) * length / 4
    e, f = (7 * phi**2 + 14 * phi + 8) * length**2 / 4, (7 * phi**2 + 14 * phi + 6) * length**2 / 4
    return np.array([[a, b, c, -d], [b, e, d, -f], [c, d, a, -b], [-d, -f, -b, e]]) / (210 * (1 + phi) ** 2)


def _rotation(phi: float, length: float) -> np.ndarray:
    a = (3 - 15 * phi) * length
    b, c = (10 * phi**2 + 5 * phi + 4) * length**2, (5 * phi**2 - 5 * phi - 1) * length**2
    return np.array([[36, a, -36, a], [a, b, -a, c], [-36, -a, 36, -a], [a, c, -a, b]]) / (30 * (1 + phi) ** 2)
