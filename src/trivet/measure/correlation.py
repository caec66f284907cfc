"""How alike measured and computed responses are, and measured and computed modes.

Every criterion lies between 0 and 1.  Along the frequencies of one function: FRAC, which no scale changes, and FAAC, which is 1
only where the scale is right too.  Over all functions at one frequency: CSAC and CSF, likewise.  Of shapes: MAC between modes,
CoMAC at one channel over all pairs of modes.

FRAC: W. Heylen and S. Lammens, FRAC: a consistent way of comparing frequency response functions, Proc. Int. Conf. on
Identification in Engineering Systems, Swansea, 1996, 48-57.  CSAC and CSF, here also along frequencies, which makes the FAAC:
H. Grafe, Model updating of large structural dynamics models using measured response functions, PhD thesis, Imperial College,
1998; C. Zang, H. Grafe and M. Imregun, Frequency-domain criteria for correlating and updating dynamic finite element models,
Mech. Syst. Signal Process. 15(1):139-155, 2001.  MAC: R. J. Allemang and D. L. Brown, A correlation coefficient for modal
vector analysis, Proc. 1st IMAC, 1982, 110-116.  CoMAC: N. A. J. Lieven and D. J. Ewins, Spatial correlation of mode shapes, the
coordinate modal assurance criterion (COMAC), Proc. 6th IMAC, 1988, 690-695.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

ALIKE = 2e-3
"""Relative distance of frequencies up to which modes of one set are compared as the space that they span: any mixture of modes
that coincide is one, and measured ones near each other are mixed by the least asymmetry."""
OCTAVE = 0.5
"""What an octave between frequencies counts in pairing, beside a MAC of 1: few channels hardly tell modes apart."""
LEAST = 0.3
"""MAC below which two modes are no pair."""
NOTHING = 1e-9
"""Of a space, what is so small against its greatest vector is none of its directions."""


class ModeSet(NamedTuple):
    """m modes at o channels."""

    frequency: np.ndarray
    """(m,) Hz, ascending."""
    damping: np.ndarray
    """(m,) ratios."""
    shapes: np.ndarray
    """(o, m) of any scale, complex or real."""


class Pair(NamedTuple):
    """A measured mode and the computed one that it is."""

    measured: int
    """Number of the mode, from 0."""
    computed: int
    mac: float
    """Of modes that coincide, that of the spaces which they span."""
    frequency: tuple[float, float]
    """Measured and computed, Hz."""
    damping: tuple[float, float]
    """Measured and computed ratios."""

    @property
    def frequency_difference(self) -> float:
        """Of the computed frequency, against the measured one."""
        return self.frequency[1] / self.frequency[0] - 1

    @property
    def damping_difference(self) -> float:
        """Of the computed damping ratio, against the measured one."""
        return self.damping[1] / self.damping[0] - 1 if self.damping[0] else float("nan")


def frac(measured: np.ndarray, computed: np.ndarray) -> np.ndarray:
    """(q,) frequency response assurance criterion of functions (q, n): |x^H a|^2 / (x^H x  a^H a) along frequencies.

    Frequencies at which one of the two is NaN do not count.  NaN where one of the functions is zero throughout, and at a single
    frequency, where there is no shape to compare.
    """
    if measured.shape[1] < 2:
        return np.full(len(measured), np.nan)
    return _shape(*_both(measured, computed), axis=1)


def faac(measured: np.ndarray, computed: np.ndarray) -> np.ndarray:
    """(q,) frequency amplitude assurance criterion of functions (q, n): 2 |x^H a| / (x^H x + a^H a); else as `frac`."""
    return _size(*_both(measured, computed), axis=1)


def csac(measured: np.ndarray, computed: np.ndarray) -> np.ndarray:
    """(n,) cross signature assurance criterion of functions (q, n) of one unit: as `frac`, but over the functions."""
    return _shape(*_both(measured, computed), axis=0)


def csf(measured: np.ndarray, computed: np.ndarray) -> np.ndarray:
    """(n,) cross signature scale factor of functions (q, n) of one unit: as `faac`, but over the functions."""
    return _size(*_both(measured, computed), axis=0)


def mean(values: np.ndarray) -> float:
    """Of a criterion where it is defined; NaN where it is nowhere."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def mac(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(m, k) modal assurance criterion of shapes (o, m) and (o, k), mode by mode; NaN where a shape is zero."""
    return _bounded(np.abs(_unit(first).conj().T @ _unit(second)) ** 2)


def mac_of_spaces(first: ModeSet, second: ModeSet) -> np.ndarray:
    """(m, k) MAC of modes; of those that coincide, of the spaces which they span.

    Of two spaces it is the mean square of the cosines of their principal angles, in as many directions as the smaller one has.
    """
    found = np.full((first.shapes.shape[1], second.shapes.shape[1]), np.nan)
    others = [(run, space(second.shapes[:, run])) for run in runs(second.frequency)]
    for run in runs(first.frequency):
        own = space(first.shapes[:, run])
        for other, base in others:
            smaller = min(own.shape[1], base.shape[1])
            if smaller:
                found[np.ix_(run, other)] = np.sum(np.abs(own.conj().T @ base) ** 2) / smaller
    return _bounded(found)


def pairs(measured: ModeSet, computed: ModeSet) -> list[Pair]:
    """Which computed mode every measured one is, one to one: so that MAC, less what frequencies differ, adds up to most.

    Modes without a partner, and such with one of a MAC below `LEAST`, are left out.
    """
    rows, columns, alike = assigned(measured, computed)
    return [
        Pair(
            int(row),
            int(column),
            float(alike[row, column]),
            (float(measured.frequency[row]), float(computed.frequency[column])),
            (float(measured.damping[row]), float(computed.damping[column])),
        )
        for row, column in zip(rows, columns, strict=True)
        if alike[row, column] >= LEAST
    ]


def assigned(measured: ModeSet, computed: ModeSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measured and computed modes, (p,) and (p,), one to one, however little they are alike; and the MAC of all (m, k)."""
    alike = mac_of_spaces(measured, computed)
    apart = np.abs(np.log2(computed.frequency[None, :] / measured.frequency[:, None]))
    rows, columns = linear_sum_assignment(1 - np.nan_to_num(alike) + OCTAVE * apart)
    for run in runs(computed.frequency):  # of modes that coincide the lower are taken first, by the lower
        own = np.isin(columns, run)
        columns[own] = run[: own.sum()]
    return rows, columns, alike


def matched(measured: ModeSet, computed: ModeSet, found: list[Pair]) -> tuple[np.ndarray, np.ndarray]:
    """(o, p) and (o, p): shapes of pairs, of norm 1 and in phase; of modes that coincide the mixture that is most alike."""
    ones, others = [], []
    of_measured, of_computed = ({k: run for run in runs(own.frequency) for k in run} for own in (measured, computed))
    for pair in found:
        one, other = measured.shapes[:, pair.measured], computed.shapes[:, pair.computed]
        if len(of_computed[pair.computed]) > 1:
            base = space(computed.shapes[:, of_computed[pair.computed]])
            other = base @ (base.conj().T @ one)
        elif len(of_measured[pair.measured]) > 1:
            base = space(measured.shapes[:, of_measured[pair.measured]])
            one = base @ (base.conj().T @ other)
        one, other = _unit(one[:, None])[:, 0], _unit(other[:, None])[:, 0]
        turn = np.vdot(one, other)
        ones.append(one * (turn / abs(turn) if abs(turn) > 0 else 1.0))
        others.append(other)
    first, second = (np.array(own, complex).reshape(len(found), len(measured.shapes)).T for own in (ones, others))
    return first, second


def comac(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(o,) coordinate MAC of matched shapes (o, p): (sum |x a|)^2 / (sum |x|^2  sum |a|^2) over pairs.

    NaN at a channel which does not move in one of the sets.
    """
    one, other = np.abs(first), np.abs(second)
    return _shape(one, other, axis=1)


def runs(frequency: np.ndarray) -> list[list[int]]:
    """Numbers of modes (m,), ascending in frequency, in runs of such as lie within `ALIKE` of each other."""
    apart = np.flatnonzero(np.diff(frequency) > ALIKE * frequency[1:]) + 1
    return [[int(k) for k in run] for run in np.split(np.arange(len(frequency)), apart) if len(run)]


def space(shapes: np.ndarray) -> np.ndarray:
    """(o, r) orthonormal: the directions of a space that shapes (o, m) of any scale span."""
    base, size, _ = np.linalg.svd(np.nan_to_num(_unit(shapes)), full_matrices=False)
    kept: np.ndarray = base[:, size > NOTHING * max(size[0], NOTHING)]
    return kept


def _unit(shapes: np.ndarray) -> np.ndarray:
    """Shapes (o, m) of norm 1; NaN where they are zero."""
    # The largest first, so that squares of very large and very small numbers stay numbers.
    largest = np.max(np.abs(shapes), axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = shapes / largest
        found: np.ndarray = scaled / np.linalg.norm(scaled, axis=0)
    return found


def _both(measured: np.ndarray, computed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both functions, zero where one of them is NaN."""
    known = np.isfinite(measured) & np.isfinite(computed)
    return np.where(known, measured, 0), np.where(known, computed, 0)


def _shape(one: np.ndarray, other: np.ndarray, axis: int) -> np.ndarray:
    sizes = (np.linalg.norm(values, axis=axis, keepdims=True) for values in (one, other))
    with np.errstate(divide="ignore", invalid="ignore"):
        units = [values / size for values, size in zip((one, other), sizes, strict=True)]
        return _bounded(np.abs(np.sum(units[0].conj() * units[1], axis=axis)) ** 2)


def _size(one: np.ndarray, other: np.ndarray, axis: int) -> np.ndarray:
    greatest = np.maximum(*(np.linalg.norm(values, axis=axis, keepdims=True) for values in (one, other)))
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = one / greatest, other / greatest
        squares = np.sum(np.abs(one) ** 2 + np.abs(other) ** 2, axis=axis)
        return _bounded(2 * np.abs(np.sum(one.conj() * other, axis=axis)) / squares)


def _bounded(values: np.ndarray) -> np.ndarray:
    """Without what rounding puts above 1; NaN stays."""
    return np.minimum(values, 1.0)
