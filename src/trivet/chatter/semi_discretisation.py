"""Stability of milling in time, by semi-discretisation (Insperger and Stepan, Int. J. Numer. Meth. Engng 61:117, 2004).

The modes of the tool point under a K_t D(t) (u(t) - u(t - T)) are a linear equation with a delay, periodic in T.  A period is
cut into p intervals; in each D is its mean there, and the delayed displacement is linear between those at the ends of the
interval (their updated method, of first order), so that the state at its end follows exactly.  One period leads from the state
and the displacements of the last period to the next ones; the cut is stable if no eigenvalue of that map, a Floquet multiplier,
is longer than 1.  All harmonics of the forces count, so that this is the check of the zero-order approach; what it has instead
are modes, see `modal`.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from trivet.chatter.cut import Cut
from trivet.chatter.modal import ModalModel

FEWEST = 60
"""Intervals of a period."""
PER_WAVE, PER_SHORTEST = 60, 24
"""Intervals of a wave of the mode that is most flexible at resonance, and of the highest."""
MOST = 600
"""Intervals at most; slower cutters have less of them per wave."""
LARGEST_DENSE = 200
"""Size of the map up to which all multipliers are found; above, the greatest by Arnoldi iterations."""
LEADING, ARNOLDI = 6, 60
"""Multipliers that are sought at once, and vectors for them."""
STEP = 1.25
"""How much deeper a cut is than the one tried before, on the way to the first unstable one."""
DEEPEST = 1e3
"""Depth against the first guess up to which an unstable one is sought, or down to which a stable one."""
CLOSE = 1e-3
"""How closely, against it, the limit is told."""


def multiplier(cut: Cut, model: ModalModel, speed: float, depth: float, intervals: int | None = None) -> float:
    """Length of the greatest Floquet multiplier; the cut is stable below 1.

    Args:
        cut: the cut.
        model: the tool point.
        speed: spindle speed, rad/s.
        depth: of the cut, along the tool, m.
        intervals: of the time between teeth; as many as the highest mode asks for when not given.
    """
    delay = cut.pitch / speed
    if intervals is None:
        softest = model.omega[np.argmax(model.flexibility)]
        wanted = max(PER_WAVE * float(softest), PER_SHORTEST * float(model.omega.max())) * delay / (2 * math.pi)
        intervals = min(MOST, max(FEWEST, math.ceil(wanted)))
    ends = np.arange(intervals + 1) / intervals
    forces = np.array([cut.averaged(cut.pitch * a, cut.pitch * b) for a, b in itertools.pairwise(ends)])
    return _multiplier(model, depth * cut.tangential * forces, delay / intervals)


def _multiplier(model: ModalModel, forces: np.ndarray, step: float) -> float:
    """Of forces (p, 2, 2) per displacement, N/m, in intervals of a step (s)."""
    count, modes, intervals = 2, len(model.omega), len(forces)
    # States are omega q and dq/dt, which are of one size.
    omega = np.diag(model.omega)
    free = np.block([[np.zeros((modes, modes)), omega], [-omega, -np.diag(2 * model.damping * model.omega)]])
    seen = np.hstack([model.shapes / model.omega, np.zeros((count, modes))])
    pushed = np.vstack([np.zeros((modes, count)), model.shapes.T])
    is_cut = np.any(forces != 0, axis=(1, 2))
    idle = scipy.linalg.expm(free * step)
    # The state, then the delayed displacement and its rate, which is constant: all of one interval by one exponential.
    size = 2 * modes
    driven = np.zeros((int(is_cut.sum()), size + 2 * count, size + 2 * count))
    delayed = pushed @ forces[is_cut]
    driven[:, :size, :size] = free * step + step * delayed @ seen
    driven[:, :size, size : size + count] = -step * delayed
    driven[:, size : size + count, size + count :] = np.eye(count)
    made = scipy.linalg.expm(driven)[:, :size]
    # Of the displacements in the last period only those at the ends of intervals with a tooth in the material have a part.
    needed = np.flatnonzero(np.r_[is_cut, False] | np.r_[False, is_cut])
    place = {int(end): size + count * k for k, end in enumerate(needed)}
    width = size + count * len(needed)
    state = np.eye(size, width)
    last = np.zeros((count * len(needed), width))
    cuts = iter(made)
    for k in range(intervals + 1):
        if k in place:
            rows = place[k] - size
            last[rows : rows + count] = seen @ state
        if k == intervals:
            break
        if not is_cut[k]:
            state = idle @ state
            continue
        own = next(cuts)
        state = own[:, :size] @ state
        before, after = place[k], place[k + 1]
        rate = own[:, size + count :]
        state[:, before : before + count] += own[:, size : size + count] - rate
        state[:, after : after + count] += rate
    return _radius(np.vstack([state, last]))


def _radius(matrix: np.ndarray) -> float:
    """Length of the greatest eigenvalue."""
    if len(matrix) > LARGEST_DENSE:
        start = np.cos(np.arange(len(matrix)) ** 2)  # any vector, but the same every time
        try:
            found = scipy.sparse.linalg.eigs(matrix, LEADING, v0=start, ncv=ARNOLDI, tol=1e-9, return_eigenvectors=False)
            return float(np.abs(found).max())
        except scipy.sparse.linalg.ArpackNoConvergence:
            pass
    return float(np.abs(scipy.linalg.eigvals(matrix)).max())


def stable_depth(cut: Cut, model: ModalModel, speed: float, guess: float) -> float:
    """Depth (m) at which the cut becomes unstable first, at a spindle speed (rad/s); infinite if it does not, 0 if any is.

    Depths are tried upwards from a tenth of a guess, in steps of `STEP`: an island of instability between two of them is
    missed.
    """
    depth = guess / 10
    while multiplier(cut, model, speed, depth) > 1:
        depth /= 10
        if depth < guess / DEEPEST:
            return 0.0
    stable = depth
    while multiplier(cut, model, speed, depth) <= 1:
        stable, depth = depth, depth * STEP
        if depth > DEEPEST * guess:
            return math.inf
    while depth - stable > CLOSE * depth:
        middle = (stable + depth) / 2
        if multiplier(cut, model, speed, middle) > 1:
            depth = middle
        else:
            stable = middle
    return (stable + depth) / 2
