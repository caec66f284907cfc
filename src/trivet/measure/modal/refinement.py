"""From the poles of a stabilisation diagram to modes of greatest likelihood: noise and modes in turn, and how many there are.

Whether a mode is there at all is decided by what it explains, against what noise alone would give to as many unknowns (Wilks,
Annals of Mathematical Statistics 9 (1938) 60).  A stricter rule, such as Schwarz's, leaves out modes that are there for certain
though hardly seen, and the poles beside them take the blame: by several of their standard deviations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from trivet.measure.modal.coincidence import joined
from trivet.measure.modal.maximum_likelihood import (
    Information,
    Refined,
    covariance,
    directions,
    information,
    leverage,
    projected,
    refine,
)
from trivet.measure.modal.noise import Noise, estimated
from trivet.measure.modal.residues import Band, Modes, synthesised
from trivet.measure.modal.stabilisation import HEAVY

ROUNDS, FEW = 12, 2
"""Of noise and modes in turn, at the end and while modes come and go."""
SETTLED = 0.01
"""Relative change of the weighted squares between rounds below which noise and modes agree."""
FIRST = 0.03
"""Noise that is taken to begin with: this part of the magnitude, and this part of the root mean square."""
FALSE = 1e-3
"""Chance of a mode that is none."""
UNKNOWN = 0.25
"""Standard deviation of a pole, as a part of its half bandwidth, from which it is not known."""
MOST_ADDED = 12
FAR = 8.0
"""Times the highest frequency, or part of the lowest, beyond which a mode outside the band is no more than its residual."""
CROWDED = 0.5
"""Distance of poles, as a part of the half bandwidth, within which no more can be told apart than there are references."""
STEPS = 8
"""In which a mode that is tried must show what it is worth."""
RATIOS = (0.002, 0.01, 0.04)
"""Damping ratios of the modes that are looked for in what is left."""
OWN = 0.01
"""Least part of a mode that is its own: beside it mean weights tell nothing."""
BLOCK = 256
"""Natural frequencies that are tried at once: they bound the memory."""


class Settled(NamedTuple):
    """Modes and noise that agree."""

    at: Refined
    noise: Noise
    leverage: np.ndarray
    """(o, i, n)"""


def settled(band: Band, modes: Modes, noise: Noise | None = None, rounds: int = ROUNDS) -> Settled:
    """Noise from what is left, weights from the noise, modes from the weights, until nothing changes.

    Weights are those of the synthesised magnitudes: measured ones would weigh lines the more the lower noise has made them.
    """
    size = np.abs(band.values) * band.motion_size
    if noise is None:
        noise = _first(size)
        at = projected(band, modes, _weight(band, size, noise))
    else:
        at = refine(band, modes, _weight(band, size, noise))
    for _ in range(rounds):
        size = np.abs(synthesised(band.omega, at.modes, at.shapes)) * band.motion_size
        along = directions(at.modes, at.shapes)
        taken = leverage(band, at, information(band, at, along), along)
        noise = estimated(at.rest * band.motion_size, size, taken, noise)
        before = at.weight
        at = refine(band, at.modes, _weight(band, size, noise))
        change = np.abs(np.log(at.weight[band.known] / before[band.known]))
        if np.median(change) < SETTLED:
            break
    return Settled(at, noise, taken)


def _first(size: np.ndarray) -> Noise:
    return Noise(FIRST**2 * np.mean(size**2, axis=-1), np.full(size.shape[:2], FIRST**2))


def _weight(band: Band, size: np.ndarray, noise: Noise) -> np.ndarray:
    """(o, i, n) 1 / variance of the receptances."""
    with np.errstate(divide="ignore", invalid="ignore"):
        weight = band.motion_size**2 / noise.variance(size)
    return np.where(band.known[:, :, None], weight, 0.0)


def penalty(band: Band) -> float:
    """What a mode must take off twice the weighted squares; noise alone does, somewhere in the band, in `FALSE` of the fits."""
    return float(chi2.isf(FALSE / len(band.omega), 2 * sum(band.known.shape)))


def gains(at: Refined, found: Information) -> np.ndarray:
    """(R,) twice what the weighted squares would grow by without the shape of each mode."""
    count = len(at.modes)
    total = np.zeros(count)
    for block, shape in zip(found.own, at.shapes.shapes, strict=True):
        size = np.sqrt(np.diag(block))
        scale = 1 / np.where(size > 0, size, 1)
        inverse = np.linalg.inv(block * scale[:, None] * scale + 1e-13 * np.eye(len(scale)))
        for r in range(count):
            own = [r, count + r]
            part = np.array([shape[r].real, shape[r].imag]) / scale[own]
            total[r] += 2 * part @ np.linalg.solve(inverse[np.ix_(own, own)], part)
    return total


def significant(band: Band, found: Settled) -> Settled:
    """Without modes that explain too little, are not damped, not known or not to be told apart: the least first, one by one."""
    while len(found.at.modes) > 1:
        at = found.at
        known = information(band, at, directions(at.modes, at.shapes))
        worth, half = gains(at, known), len(known.pull) // 2
        spread = np.diag(covariance(known))
        deviation = np.sqrt(np.maximum(spread[at.modes.group] + spread[half + at.modes.group], 0))
        worth[(deviation > -UNKNOWN * at.modes.poles.real) & _is_inside(band, at.modes)] = 0
        worth[~_is_near(band, at.modes)] = 0
        crowded = _is_crowded(band, at.modes)
        if crowded.any():
            worth[np.argmin(np.where(crowded, worth, np.inf))] = 0
        least = int(np.argmin(worth))
        if worth[least] >= penalty(band):
            return found
        found = settled(band, at.modes.only(np.delete(np.arange(len(worth)), least)), found.noise, FEW)
    return found


def completed(band: Band, found: Settled, is_open: bool = True) -> Settled:
    """With modes that stand out of what is left: such outside the band that reach into it, and the second of a close pair
    where the band is open to more."""
    for _ in range(MOST_ADDED):
        better = _with_one_more(band, found.at, is_open)
        if better is None:
            return found
        found = settled(band, better, found.noise, FEW)
    return found


def _with_one_more(band: Band, at: Refined, is_open: bool = True) -> Modes | None:
    """The modes with one that is worth it; the most promising is tried first."""
    starts = [projected(band, more, at.weight) for more in _missing(band, at, is_open)]
    for start in sorted(starts, key=lambda one: one.cost):
        tried = refine(band, start.modes, at.weight, STEPS)
        is_worth = 2 * (at.cost - tried.cost) >= penalty(band) and _is_plausible(band, tried.modes)
        if is_worth and (is_open or not _is_inside(band, tried.modes)[-1]):
            return tried.modes
    return None


def _is_plausible(band: Band, modes: Modes) -> bool:
    """Whether modes in the band are damped, not too much, and can be told apart; outside they may do as they like, not too far
    away."""
    damped = (modes.poles.real < 0) & (-modes.poles.real < HEAVY * np.abs(modes.poles))
    told = ~_is_crowded(band, modes)
    return bool(np.all(np.where(_is_inside(band, modes), damped & told, _is_near(band, modes))))


def _is_crowded(band: Band, modes: Modes) -> np.ndarray:
    """(R,) whether more poles than references lie about a pole of the band."""
    close = np.abs(modes.poles[:, None] - modes.poles) < CROWDED * np.abs(modes.poles.real)
    found: np.ndarray = (close.sum(axis=1) > band.values.shape[1]) & _is_inside(band, modes)
    return found


def _is_near(band: Band, modes: Modes) -> np.ndarray:
    size = np.abs(modes.poles)
    found: np.ndarray = (modes.poles.imag > 0) & (size > band.omega[0] / FAR) & (size < FAR * band.omega[-1])
    return found


def _is_inside(band: Band, modes: Modes) -> np.ndarray:
    size = np.abs(modes.poles)
    found: np.ndarray = (size >= band.omega[0]) & (size <= band.omega[-1])
    return found


def _missing(band: Band, at: Refined, is_open: bool = True) -> list[Modes]:
    """The modes with one more, which explains most of what is left: in the band, below it, above it, beside one of them."""
    beyond = np.geomspace(1.01, FAR / 2, 40)
    below, above = (_with_best(band, at, places) for places in (band.omega[0] / beyond, band.omega[-1] * beyond))
    if not is_open:
        return [below, above]
    return [_with_best(band, at, band.omega), below, above, _with_best(band, at, band.omega, is_beside=True)]


def _own_part(band: Band, at: Refined, shape: np.ndarray) -> np.ndarray:
    """(k,) part of shapes (n, k) that modes and residuals which are there do not follow, poles moving too; at mean weights."""
    weight = at.weight[band.known]
    root = np.sqrt(np.mean(weight / weight.sum(axis=-1, keepdims=True), axis=0))[:, None]
    direct = 1 / (1j * band.omega[:, None] - np.unique(at.modes.poles))
    there = np.concatenate([direct, direct**2, np.ones_like(root), 1 / band.omega[:, None] ** 2], axis=1)
    followed = np.linalg.qr(root * there)[0].conj().T @ (root * shape)
    found: np.ndarray = 1 - np.sum(np.abs(followed) ** 2, axis=0) / np.sum(np.abs(root * shape) ** 2, axis=0)
    return np.maximum(found, OWN)


def _tried(places: np.ndarray) -> Iterator[np.ndarray]:
    """Poles at natural frequencies with all `RATIOS`, in blocks; of those within half a half bandwidth one."""
    for ratio in RATIOS:
        some = places[np.unique(np.floor(np.log(places) / (ratio / 2)), return_index=True)[1]]
        for block in np.array_split(some, math.ceil(len(some) / BLOCK)):
            yield block * complex(-ratio, math.sqrt(1 - ratio**2))


def _with_best(band: Band, at: Refined, places: np.ndarray, is_beside: bool = False) -> Modes:
    """The modes with the best of those at some natural frequencies, as far as it can be told without moving the others.

    The second of a close pair is told beside the first, which has moved to follow both: by the part that is its own.
    """
    best: tuple[float, complex, np.ndarray] = (-1.0, 0j, np.zeros(0))
    for poles in _tried(places):
        shape = 1 / (1j * band.omega[:, None] - poles)
        pull = (at.weight * at.rest) @ shape.conj()
        held = at.weight @ np.abs(shape) ** 2
        if is_beside:
            held = held * _own_part(band, at, shape)
        residue = pull / np.where(held > 0, held, 1)
        gain = (np.abs(residue) ** 2 * held).sum(axis=(0, 1))
        k = int(np.argmax(gain))
        if gain[k] > best[0]:
            best = float(gain[k]), complex(poles[k]), np.linalg.svd(residue[:, :, k])[2][0]
    modes = at.modes
    return Modes.of(
        np.append(modes.poles, best[1]),
        np.column_stack([modes.participation, best[2]]),
        np.append(modes.group, modes.group.max() + 1),
    )


def most_likely(band: Band, modes: Modes, is_automatic: bool) -> Settled:
    """Modes and noise from a start; modes that are missing come, those in the band only where it is automatic, and such as are
    not there go."""
    found = settled(band, modes, rounds=FEW)
    found = significant(band, completed(band, significant(band, found))) if is_automatic else completed(band, found, False)
    found = settled(band, joined(band, found.at).modes, found.noise)
    return significant(band, found) if is_automatic else found
