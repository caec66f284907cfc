"""Quotients of entire functions over many frequencies, from their values at few: panels, Chebyshev nodes, interpolation.

Numerator and denominator are smooth where their quotient has resonances, so over a panel of frequencies each is interpolated
between Chebyshev nodes by the barycentric formula (Berrut and Trefethen, SIAM Review 46:501, 2004), at the cost of a small
matrix product.  What the interpolation cannot follow shows in the last Chebyshev coefficients of the denominator; against the
least denominator met they tell the size of the relative error to be feared at a resonance (`Quotients.doubt`).  They are an
estimate and no bound: with damping as usual the error is far less, but at tiny damping, where the least denominator is all but
lost in rounding, it may be more.
A panel in doubt is to be divided, unless doubt is great though nothing but rounding is left in those coefficients
(`Quotients.lost`): then the least denominator is as good as nought, as on a resonance without damping, and narrower panels are
no better.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

Array: TypeAlias = jax.Array

MACHINE_NODES = 24
"""Nodes of a panel of a machine."""
BLOCK = 100
"""Frequencies of one panel that are worked on at once; filled up, since kernels are compiled for every number of them."""
FILLED = 2
"""Panels and blocks are filled up to a multiple of this, for the same reason; many of them to coarser steps."""
PANEL_STEPS, BLOCK_STEPS = 4, 8
"""Steps up to the next power of two.  A new number of panels costs more compiling than one of blocks, a block more work."""
NARROW = 1e-3
"""Least width of a panel, against its upper end: nodes that coincide tell nothing apart."""
COINCIDING = 1e-20
"""Distance of a frequency from a node, against the node, that stands for none."""


class Nodes(NamedTuple):
    """Chebyshev nodes of a panel, in a power of frequency in which functions are smooth."""

    omega: Any
    """(m,) rad/s."""
    power: Any
    """(m,) omega^power."""
    weights: Any
    """(m,) of the barycentric formula, the same in all panels."""

    @classmethod
    def between(cls, low: Any, high: Any, count: int, power: int) -> Nodes:
        """So many between two values of the power of frequency, or between many (panels,)."""
        angle = _angles(count)
        low, high = np.minimum(low, high * (1 - NARROW))[..., None], np.asarray(high)[..., None]
        at = (low + high) / 2 + (high - low) / 2 * np.cos(angle)
        return cls(at ** (1 / power), at, (-1.0) ** np.arange(count) * np.sin(angle))


class Blocks(NamedTuple):
    """Frequencies (n,) in blocks of `BLOCK`, each within one of several panels."""

    nodes: Nodes
    """Of the panels, (panels, `MACHINE_NODES`) each."""
    power: np.ndarray
    """(blocks, `BLOCK`) omega^power."""
    panel: np.ndarray
    """(blocks,) the panel of each."""
    order: np.ndarray
    """(n,) where the frequencies are among those of all blocks."""
    edges: np.ndarray
    """Of the panels, without those that fill up, rad/s."""

    @classmethod
    def of(cls, omega: np.ndarray, cuts: tuple[float, ...], power: int) -> Blocks:
        """Of frequencies (n,) in rad/s, with panels cut at some."""
        low, high = float(omega.min()), float(omega.max())
        edges = np.array([low, *(cut for cut in sorted(cuts) if low < cut < high), high])
        own = np.clip(np.searchsorted(edges, omega, side="right") - 1, 0, len(edges) - 2)
        sorted_by_panel = np.argsort(own, kind="stable")
        counts = np.bincount(own, minlength=len(edges) - 1)
        # Blocks of a panel begin with its first frequency; the last one is filled up with its last.
        blocks = -(-counts // BLOCK)
        first, panel = np.cumsum(counts) - counts, _filled(np.repeat(np.arange(len(counts)), blocks), BLOCK_STEPS)
        within = _filled(np.arange(blocks.sum()) - np.repeat(np.cumsum(blocks) - blocks, blocks), BLOCK_STEPS) * BLOCK
        rank = np.minimum(within[:, None] + np.arange(BLOCK), counts[panel][:, None] - 1)
        order = np.empty(len(omega), dtype=int)
        start = (np.cumsum(blocks) - blocks) * BLOCK - first
        order[sorted_by_panel] = start[own[sorted_by_panel]] + np.arange(len(omega))
        scaled = edges**power
        nodes = Nodes.between(_filled(scaled[:-1], PANEL_STEPS), _filled(scaled[1:], PANEL_STEPS), MACHINE_NODES, power)
        return cls(nodes, omega[sorted_by_panel[first[panel][:, None] + rank]] ** power, panel, order, edges)

    def halves(self, doubtful: np.ndarray) -> tuple[float, ...]:
        """Frequencies (rad/s) at which the panels of doubtful blocks (by whether they are) are to be cut; those that are wide
        enough."""
        ends = (self.edges[k : k + 2] for k in np.unique(self.panel[doubtful]))
        return tuple(float(np.sqrt(np.mean(np.square(own)))) for own in ends if own[0] < own[1] * (1 - NARROW))


class Quotients(NamedTuple):
    """Quotients at the frequencies of blocks."""

    values: Array
    """(p, k, blocks · `BLOCK`)."""
    doubt: Array
    """(blocks,): the relative error at a resonance that may be feared."""
    lost: Array
    """(panels,): what the interpolation cannot follow of the denominator, against its greatest."""


def cauchy(nodes: Array, weights: Array, at: Array) -> Array:
    """(m, n): factors of the values at nodes (m,), up to one factor for each of the places (n,), which may be complex."""
    apart = at - nodes[:, None]
    return weights[:, None] / jnp.where(apart == 0, COINCIDING * nodes[:, None], apart)


@jax.jit
def quotients(values: Array, denominator: Array, nodes: Nodes, power: Array, panel: Array) -> Quotients:
    """Quotients between nodes.

    Args:
        values: (p, k, panels · m) quotients at the nodes of all panels.
        denominator: (p, panels · m) the common one there, up to one factor per pose and panel.
        nodes: (panels, m).
        power, panel: of the `Blocks`.
    """
    poses, kinds, _ = values.shape
    panels, count = nodes.power.shape
    below = denominator.reshape(poses, 1, panels, count)
    below = below / jax.lax.stop_gradient(jnp.abs(below).max(axis=-1, keepdims=True))
    both = jnp.concatenate([values.reshape(poses, kinds, panels, count) * below, below], axis=1)
    # Real and imaginary parts apart: a complex product with real factors would do twice the work, a quotient far more.
    rows = jnp.moveaxis(jnp.stack([both.real, both.imag]), 3, 0).reshape(panels, -1, count)
    last = 2 / count * np.cos(np.outer(_angles(count), [count - 2, count - 1]))
    lost = jnp.abs(below[:, 0] @ last).max(axis=-1)

    def block(own: tuple[Array, Array]) -> tuple[tuple[Array, Array], Array]:
        at, panel = own
        factors = cauchy(nodes.power[panel], nodes.weights, at)
        found = rows[panel] @ (factors / factors.sum(axis=0))
        real, imag = found.reshape(2, poses, kinds + 1, -1)
        size = real[:, -1] ** 2 + imag[:, -1] ** 2
        real, imag, c, d = real[:, :-1], imag[:, :-1], (real[:, -1] / size)[:, None], (imag[:, -1] / size)[:, None]
        doubt = jnp.nanmax(lost[:, panel] / jnp.sqrt(size.min(axis=-1)))
        return (real * c + imag * d, imag * c - real * d), doubt

    parts, doubt = jax.lax.map(block, (power, panel))
    real, imag = (jnp.moveaxis(part, 0, 2).reshape(poses, kinds, -1) for part in parts)
    return Quotients(jax.lax.complex(real, imag), doubt, jnp.nanmax(lost, axis=0))


def _angles(count: int) -> np.ndarray:
    return (2 * np.arange(count) + 1) * np.pi / (2 * count)


def _filled(values: np.ndarray, steps: int) -> np.ndarray:
    """The last one again and again, up to a multiple of `FILLED`, or of one of so many steps up to the next power of two."""
    count = len(values)
    step = max(FILLED, 2 ** (count - 1).bit_length() // steps)
    return values[np.minimum(np.arange(-(-count // step) * step), count - 1)]
