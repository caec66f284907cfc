"""A solid check as a labelled dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.solid_check import COARSER, SolidCheck

if TYPE_CHECKING:
    import xarray as xr

_RECEPTANCE = "m/N (translation, force), m/(N m) (translation, moment), rad/N (rotation, force), rad/(N m) (rotation, moment)"
SIDES = ("beams", "solids")


def solid_dataset(check: SolidCheck) -> xr.Dataset:
    """Both machines, and what the solids are; NetCDF has no complex numbers, so real and imaginary part are the last axis."""
    at, sides = check.at, (check.beams, check.solids)
    receptance = np.array([np.stack([side.receptance.real, side.receptance.imag], axis=-1) for side in sides])
    azimuth, tilt, roll = at.angles
    least: dict[str, tuple[Any, ...]] = {}
    if check.solids.minima:
        least = {
            "minimum_dynamic_stiffness": (
                ("side", "component"), [[m.stiffness for m in side.minima] for side in sides],
                "N/m along x, y, z; N m/rad about rx, ry, rz", "minimum over frequency of 1/|H_jj|",
            ),
            "frequency_of_minimum": (
                ("side", "component"), [[m.frequency for m in side.minima] for side in sides], "Hz", "where it is",
            ),
        }  # fmt: skip
    own = [solid.reduced for solid in check.parts]
    return labelled(
        at.machine,
        {
            "position": (("axis",), at.position, "m", "platform centre in {O}"),
            "azimuth": ((), azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
            "tilt": ((), tilt, "rad", "beta"),
            "roll": ((), roll, "rad", "gamma"),
            "frequency": (("frequency",), check.frequency, "Hz", "frequency, exp(+i omega t)"),
            "receptance": (("side", "frequency", "motion", "load", "part"), receptance, _RECEPTANCE, "at the platform centre"),
            "natural_frequency": (
                ("side", "natural"), [side.natural for side in sides], "Hz", "natural frequencies without damping",
            ),
            "mac": (("natural",), check.mac, "1", "modal assurance criterion of the modes of beams and of solids"),
            "natural_frequency_coarser": (
                ("natural",), check.coarser, "Hz", f"of solids with elements {COARSER:g} times as large",
            ),
            "length": (("solid",), [solid.length for solid in check.parts], "m", "length of a solid"),
            "mass": (("solid",), [one.weight for one in own], "kg", "mass of a solid"),
            "beam_mass": (("solid",), [solid.beam_mass for solid in check.parts], "kg", "mass of the beam"),
            "elements": (("solid",), [one.grid.elements for one in own], "1", "finite elements of a solid"),
            "element_size": (("solid",), [one.grid.size for one in own], "m", "their edge as it was asked for"),
            "fixed_interface_modes": (("solid",), [len(one.modes) for one in own], "1", "internal coordinates of a solid"),
            "cut_off": (("solid",), [one.cut_off for one in own], "Hz", "up to which there are fixed-interface modes"),
        }
        | least,
        {
            "axis": COMPONENTS[:3], "motion": COMPONENTS, "load": COMPONENTS, "part": ("real", "imag"), "side": SIDES,
            "solid": [", ".join(solid.names) for solid in check.parts],
        }
        | ({"component": COMPONENTS} if least else {}),
        working_mode=at.mode,
        ends=check.ends,
        fineness=check.fineness,
        loss_factor=check.loss_factor,
    )  # fmt: skip
