"""Are beams good enough: a machine with some of its beams as solid bodies, side by side with the machine of beams."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.solids.ends import ENDS, Ends
from trivet.solids.pairing import BEYOND, Shapes, divided_alike, pairs, shapes
from trivet.solids.parts import Solid, Wanted, put_in, solids, wanted
from trivet.statics.assembly import PLATFORM, Structure, assemble
from trivet.statics.objective import AXES
from trivet.study.frf import (
    AROUND,
    MOST_FREQUENCIES,
    Minimum,
    check_range,
    minimum_dynamic_stiffness,
    natural_frequencies,
)
from trivet.study.machines import MachineLike
from trivet.study.pose import PoseReport, pose
from trivet.vibration import spectral
from trivet.vibration.damping import check_loss_factor, least_damping
from trivet.vibration.mesh import Mesh, mesh
from trivet.vibration.resonance import greatest
from trivet.vibration.response import FINE
from trivet.vibration.ritz import ritz

COARSER = 1.5
"""Elements of the mesh that tells how far the mesh matters, against those of the mesh itself."""
LEAST_FINENESS, MOST_FINENESS = 0.5, 4.0


class Side(NamedTuple):
    """What a machine does at the platform centre."""

    natural: np.ndarray
    """(m,) natural frequencies, of modes that are in the range by beams, Hz."""
    receptance: np.ndarray
    """(n, 6, 6) in {O}: m/N, rad/N, rad/(N m)."""
    minima: tuple[Minimum, ...]
    """Minimum dynamic stiffness along and about x, y and z; none without damping."""


@dataclass(frozen=True)
class SolidCheck:
    """A machine of beams and the same with solids in their place; in SI and {O}, structural damping."""

    at: PoseReport
    parts: tuple[Solid, ...]
    ends: Ends
    fineness: float
    loss_factor: float
    frequency: np.ndarray
    """(n,) Hz."""
    beams: Side
    solids: Side
    """Its natural frequencies are those of the modes most like those of the beams."""
    mac: np.ndarray
    """(m,) modal assurance criterion of both, see `solids.pairing`."""
    coarser: np.ndarray
    """(m,) natural frequencies with solids of larger elements, by `COARSER`, Hz."""
    coarser_elements: tuple[int, ...]
    """How many, part by part."""

    @property
    def difference(self) -> np.ndarray:
        """(m,): natural frequencies of solids over those of beams, less one."""
        found: np.ndarray = self.solids.natural / self.beams.natural - 1
        return found

    @property
    def mesh_error(self) -> np.ndarray:
        """(m,): natural frequencies with larger elements over those of the mesh, less one; the error of the mesh is smaller."""
        found: np.ndarray = self.coarser / self.solids.natural - 1
        return found


def solid_check(
    machine: MachineLike,
    parts: Sequence[str] | None = None,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
    *,
    mode: str | None = None,
    anyway: bool = False,
    low: float = 5.0,
    high: float = 3000.0,
    points: int = 1000,
    loss_factor: float = 0.02,
    fineness: float = 1.0,
    ends: Ends = "plane",
    whole: bool = False,
) -> SolidCheck:
    """A machine with beams, and with some of them as solids: natural frequencies, receptance, minimum dynamic stiffness.

    Args:
        machine, position, azimuth, tilt, roll, mode, anyway: as for `pose`.
        parts: which beams are to be solids: "leg.link" (all copies) or "leg-1.link", made from its section, or from a STEP file
            as in "leg.link=part.step"; all beams when None.  A part in a file has its axis along +x, from (0, 0, 0), the end
            nearer to the ground, to (length, 0, 0), and flat faces across it at both ends.
        low, high: range of frequencies, Hz.
        points: equally spaced frequencies of the receptances; around the resonances of beams and of solids more are added.
        loss_factor: eta of all that has no loss factor of its own.
        fineness: of the meshes, 1, or more for smaller elements.
        ends: how the ends of solids follow the machine: "plane", their sections stay plane as those of beams do and are
            otherwise free; "rigid"; or "mean", only their mean motion follows.
        whole: whether the beams that `parts` does not name become solids too, from their sections.

    Raises:
        InputError: for an unknown part, one that is no beam, a section without a shape, a file that is no such part, a number
            out of range, or without scikit-fem or (for files) gmsh.
        NoResultError: the pose is not reached, or the machine moves there without resistance.
    """
    _check(low, high, points, loss_factor, fineness, ends)
    at = pose(machine, position, azimuth, tilt, roll, mode=mode, anyway=anyway)
    structure = assemble(at.machine, at.frame, at.signs)
    chosen = wanted(at.machine, structure, parts, whole)
    of_beams = natural_frequencies(at, 0.0, high)
    fine, coarse = (_made(at, structure, chosen, high, f, ends, len(of_beams)) for f in (fineness, fineness / COARSER))
    known = _paired(at, structure, of_beams, fine.shapes, coarse.shapes, high)
    inside = of_beams[known.first] >= low
    natural = of_beams[known.first[inside]], fine.shapes.frequency[known.second[inside]], known.rough[inside]
    small = ritz(at.machine.name, fine.mesh, fine.mesh.rows(PLATFORM), high)
    least = least_damping(at.machine, loss_factor)
    around = (np.r_[natural[:2]].ravel()[:, None] * (1 + max(least, 1e-6) / 2 * AROUND)).ravel()
    frequency = np.unique(np.r_[np.linspace(low, high, points), around[(around > low) & (around < high)]])

    def answer(f: np.ndarray) -> np.ndarray:
        return np.abs(np.diagonal(small.receptance(f, loss_factor), axis1=1, axis2=2))

    peaks = greatest(answer, low, high, least) if least > 0 else []
    minima = tuple(Minimum(axis, 1 / peak.size, peak.frequency) for axis, peak in zip(AXES, peaks, strict=False))
    exact = spectral.receptance(at.machine, at.frame, at.signs, frequency, loss_factor)
    least_of_beams = tuple(minimum_dynamic_stiffness(at, low, high, loss_factor)) if least > 0 else ()
    return SolidCheck(
        at,
        fine.solids,
        ends,
        fineness,
        loss_factor,
        frequency,
        Side(natural[0], np.asarray(exact), least_of_beams),
        Side(natural[1], small.receptance(frequency, loss_factor), minima),
        known.mac[inside],
        natural[2],
        tuple(solid.reduced.grid.elements for solid in coarse.solids),
    )


class _Made(NamedTuple):
    """A machine with solids."""

    solids: tuple[Solid, ...]
    mesh: Mesh
    shapes: Shapes


class _Known(NamedTuple):
    """Modes (p,) that beams, solids and solids of larger elements have in common."""

    first: np.ndarray
    """Numbers of those of beams."""
    second: np.ndarray
    """Numbers of those of solids."""
    mac: np.ndarray
    """Of both."""
    rough: np.ndarray
    """Frequencies with larger elements, Hz."""


def _made(
    at: PoseReport, structure: Structure, chosen: Sequence[Wanted], high: float, fineness: float, ends: Ends, count: int
) -> _Made:
    """The machine with solids of a fineness, and some more modes than beams have."""
    made = solids(at.machine, structure, chosen, high, fineness, ends)
    rest, bodies = put_in(at.machine, structure, made)
    own = mesh(rest, divided_alike(rest, 2 * math.pi * high, FINE), bodies)
    return _Made(made, own, shapes(at.machine.name, structure, own, count + BEYOND, made))


def _paired(at: PoseReport, structure: Structure, of_beams: np.ndarray, fine: Shapes, rough: Shapes, high: float) -> _Known:
    """Modes by their MAC: those of beams with those of solids, and these with those of larger elements."""
    if not len(of_beams):
        return _Known(*(np.zeros(0, dtype=int),) * 2, *(np.zeros(0),) * 2)
    whole = mesh(structure, divided_alike(structure, 2 * math.pi * high, FINE))
    found = pairs(structure, shapes(at.machine.name, structure, whole, len(of_beams)), fine)
    again = pairs(structure, fine, rough)
    there = np.isin(found.second, again.first)
    frequencies = dict(zip(again.first.tolist(), rough.frequency[again.second], strict=True))
    coarser = np.array([frequencies[k] for k in found.second[there].tolist()])
    return _Known(found.first[there], found.second[there], found.mac[there], coarser)


def _check(low: float, high: float, points: int, loss_factor: float, fineness: float, ends: str) -> None:
    if ends not in ENDS:
        raise InputError(f"ends '{ends}' is not known{nearest(ends, ENDS)}")
    check_range(low, high)
    if not 2 <= points <= MOST_FREQUENCIES:
        raise InputError(f"points: {points}; expected 2 to {MOST_FREQUENCIES} frequencies")
    check_loss_factor(loss_factor)
    if not LEAST_FINENESS <= fineness <= MOST_FINENESS:
        raise InputError(f"fineness: {fineness:g}; expected {LEAST_FINENESS:g} to {MOST_FINENESS:g}")
