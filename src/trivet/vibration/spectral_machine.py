"""A machine of exact chains at a few frequencies, and what is asked of its dynamic stiffness there.

The stiffness of a chain is a ratio of entire functions of frequency (`vibration.spectral_chain`), sampled at Chebyshev nodes
and interpolated.  Where all that yields has one loss factor eta, it is (1 + i eta) D(omega^2 / (1 + i eta)), with D that of the
chain without damping: a ratio of real functions, which are sampled as real numbers and interpolated at complex places.  The
platform's inertia is added to the sum of the chains, and what is wanted is made of it (`Finish`).

That is again a ratio of entire functions.  Chains and platform together are one system of linear equations whose coefficients
are entire; its determinant is that of the dynamic stiffness times the denominators of all chains, and the receptance times this
has no poles.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from trivet.kinematics.inverse import inverse
from trivet.kinematics.standing import postures
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.machine import Chain, copy_rotation
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.symmetric import Symmetric
from trivet.statics.beam_element import uniform
from trivet.statics.parts import Bar
from trivet.vibration.panels import Nodes, cauchy
from trivet.vibration.platform import platform_inertia
from trivet.vibration.spectral_beam import Array, wave_numbers
from trivet.vibration.spectral_chain import Effort, Excitation, leg_dynamics, leg_parts

PADDED = 48
"""Frequencies between the nodes are filled up to a multiple of this, since kernels are compiled for every number of them."""
AT_ONCE = 48 * PADDED
"""So many are worked on at a time, over all poses: a cache can hold what stands in between."""

UPPER = np.triu_indices(6)
_T = TypeVar("_T")


class Stand(NamedTuple):
    """How chains are known to stand: in a working mode, or (at one pose, closed numerically) as they stand."""

    signs: Any
    """(n_chains, 2), or None."""
    postures: tuple[Posture, ...] | None
    """Per chain, with one leading axis, or None."""


class Finish(Protocol):
    """What is made of the dynamic stiffness of a machine, to be hashed: kernels are compiled for it."""

    def __call__(self, matrix: Symmetric, arms: Any) -> tuple[Array, Array]:
        """k values (p, k, n), and a common factor (p, n) that frees them of the poles which are not those of chains.

        Args:
            matrix: entries (p, n), complex, at the platform centre, in {O}.
            arms: whatever arrays (p,) were given with the poses.
        """
        ...

    def shaped(self, values: Array) -> Array:
        """The values (p, k, n) as they are wanted."""
        ...


class _Chains(NamedTuple):
    """The copies of a chain at poses and nodes; all arrays have the axes (copies, poses) in front."""

    stiffness: Array
    """(nodes, m (m + 1) / 2): upper triangle of its dynamic stiffness along the m wrenches which it transmits."""
    denominator: Array
    """(nodes,)."""
    spread: Array
    """(m (m + 1) / 2, 21): from that triangle to the upper triangle at the platform centre, in {O}."""


class Samples(NamedTuple):
    """A machine at poses and nodes."""

    chains: list[_Chains]
    inertia: Array
    """(p, 21): upper triangle of the platform's inertia at its centre, in {O}."""
    least: Array
    """The least denominator."""


def standing(machine: Machine, pose: Frame, signs: Any) -> Stand:
    """How the chains of a machine stand at poses, as the kernels take it."""
    if signs is not None:
        return Stand(np.asarray(signs), None)
    alone = jax.tree.map(lambda c: np.asarray(c, dtype=float)[None], postures(machine, pose, None))
    return Stand(None, alone)


def _over_chains(
    machine: Machine, poses: Frame, stand: Stand, omega: Any, work: Callable[[Leg, Frame, Posture, Any], _T]
) -> list[_T]:
    """What some work gives for every chain of the file, with the axes (copies, poses) in front; see `sampled` for omega."""
    found, first = [], 0
    for _, chain in sorted(machine.chains.items()):

        def one(rotation: Scalar, own: Stand, pose: Frame, omega: Any, chain: Chain = chain) -> _T:
            leg = Leg.standing(chain, rotation)
            posture = inverse(leg, pose, own.signs) if own.postures is None else own.postures
            return work(leg, pose, posture, omega)  # type: ignore[arg-type]

        copies = slice(first, first + chain.copies)
        first = copies.stop
        rotations = jnp.asarray([copy_rotation(chain, k) for k in range(chain.copies)])
        if stand.postures is None:
            own, axes = Stand(stand.signs[copies], None), Stand(None, None)
        else:
            own = Stand(None, jax.tree.map(lambda *c: jnp.stack(c), *stand.postures[copies]))
            axes = Stand(None, 0)  # type: ignore[arg-type]
        over_poses = jax.vmap(one, in_axes=(None, axes, 0, 0 if np.ndim(omega) == 2 else None))
        found.append(jax.vmap(over_poses, in_axes=(0, 0, None, None))(rotations, own, poses, omega))
    return found


@partial(jax.jit, static_argnames="effort")
def sampled(machine: Machine, poses: Frame, stand: Stand, omega: Array, loss_factor: Scalar | None, effort: Effort) -> Samples:
    """The machine at nodes (n,), or at those of every pose (p, n) (rad/s); without damping where no loss factor is given."""

    def sample(leg: Leg, pose: Frame, posture: Posture, omega: Array) -> _Chains:
        part = leg_dynamics(leg, pose, posture, machine.stock, Excitation(omega, loss_factor), effort)
        arm = pose.direction(leg.platform_frame().origin)
        carried = [w.carried(posture.heading, arm) for w in part.wrenches]
        wrenches = [jnp.stack([jnp.asarray(c, dtype=float) for c in (*w.force, *w.moment)]) for w in carried]
        pairs = list(zip(*np.triu_indices(len(wrenches)), strict=True))
        # Products with constants, since gathers compile slowly.
        size = len(wrenches)
        entries = part.stiffness.reshape(-1, size * size) @ np.eye(size * size)[:, [a * size + b for a, b in pairs]]
        dyads = [jnp.outer(wrenches[a], wrenches[b]) for a, b in pairs]
        both = jnp.stack([d if a == b else d + d.T for d, (a, b) in zip(dyads, pairs, strict=True)])
        spread = both.reshape(-1, 36) @ np.eye(36)[:, 6 * UPPER[0] + UPPER[1]]
        return _Chains(jnp.where(posture.reach < 0, jnp.nan, entries), part.denominator, spread)

    chains = _over_chains(machine, poses, stand, jnp.asarray(omega), sample)
    least = jnp.stack([jnp.nanmin(jnp.abs(c.denominator)) for c in chains]).min()
    return Samples(chains, platform_inertia(machine, poses)[:, UPPER[0], UPPER[1]], least)


@partial(jax.jit, static_argnames="finish")
def at_nodes(samples: Samples, omega: Array, finish: Finish, arms: Any) -> Array:
    """What is asked (p, k, n) at the nodes themselves, (n,) or (p, n) in rad/s."""
    total: Any = sum(jnp.einsum("cpnm,cpmu->pun", chains.stiffness, chains.spread) for chains in samples.chains)
    return finish(_with_platform(total, samples, omega), arms)[0]


def between(
    samples: Samples, nodes: Nodes, omega: np.ndarray, loss_factor: Scalar, power: int, finish: Finish, arms: Any
) -> tuple[Array, Array]:
    """What is asked (p, k, n) at frequencies (n,) (rad/s) between the nodes; and what frees it of poles.

    That is a factor (p, n), up to one for every pose.
    """
    count, poses = len(omega), len(samples.inertia)
    turns = -(-count * poses // AT_ONCE)
    own = -(-count // (turns * PADDED)) * PADDED
    filled = np.pad(omega, (0, turns * own - count), mode="edge").reshape(turns, own)
    found = _between(samples, nodes, filled, loss_factor, power, finish, arms)
    return found if filled.size == count else jax.tree.map(lambda a: jax.lax.slice_in_dim(a, 0, count, axis=-1), found)


@partial(jax.jit, static_argnames=("power", "finish"))
def _between(
    samples: Samples, nodes: Nodes, omega: Array, loss_factor: Scalar, power: int, finish: Finish, arms: Any
) -> tuple[Array, Array]:
    """`between`, at frequencies (turns, m), a turn at a time."""

    def some(omega: Array) -> tuple[Array, Array]:
        is_real = not jnp.iscomplexobj(samples.chains[0].stiffness)
        elastic = 1 + 1j * jnp.asarray(loss_factor) if is_real else 1.0
        factors = cauchy(nodes.power, nodes.weights, omega**power / elastic)
        node_factors = factors / factors.sum(axis=0)
        total: Any = 0
        poles: Any = 1.0
        for chains in samples.chains:
            stiffness, denominator = _along(chains, node_factors)
            total += jnp.einsum("cpmf,cpmu->puf", stiffness, chains.spread)
            poles *= jnp.prod(denominator, axis=0)
        real, imag = jnp.split(total, 2, axis=-1)
        values, factor = finish(_with_platform(elastic * jax.lax.complex(real, imag), samples, omega), arms)
        return values, factor * poles

    values, factor = jax.lax.map(some, omega)
    values = jnp.moveaxis(values, 0, 2)
    return values.reshape(*values.shape[:2], -1), jnp.moveaxis(factor, 0, 1).reshape(len(factor[0]), -1)


def _along(chains: _Chains, factors: Array) -> tuple[Array, Array]:
    """Stiffness (copies, p, m (m + 1) / 2, 2 n), real parts before imaginary parts, and denominator (copies, p, n) from factors
    (nodes, n)."""
    denominator = chains.denominator[..., None]
    both = jnp.moveaxis(jnp.concatenate([chains.stiffness * denominator, denominator], axis=-1), 2, -1)
    # Real and imaginary parts apart: a complex product with real factors would do twice the work, a quotient far more.
    if jnp.iscomplexobj(factors):
        real, imag = jnp.split(_product(both, jnp.concatenate([factors.real, factors.imag], axis=-1)), 2, axis=-1)
    else:
        real, imag = jnp.split(_product(jnp.concatenate([both.real, both.imag], axis=2), factors), 2, axis=2)
    shrunk = 1 / (real[..., -1:, :] ** 2 + imag[..., -1:, :] ** 2)
    below = real[..., -1:, :] * shrunk, imag[..., -1:, :] * shrunk
    above = real[..., :-1, :], imag[..., :-1, :]
    quotient = jnp.concatenate([above[0] * below[0] + above[1] * below[1], above[1] * below[0] - above[0] * below[1]], axis=-1)
    return quotient, jax.lax.complex(real[..., -1, :], imag[..., -1, :])


def _product(values: Array, factors: Array) -> Array:
    """Values (..., nodes) times factors (nodes, n)."""
    return (values.reshape(-1, values.shape[-1]) @ factors).reshape(*values.shape[:-1], -1)


def _with_platform(upper: Array, samples: Samples, omega: Array) -> Symmetric:
    """The dynamic stiffness from the upper triangle (p, 21, n) of that of the chains."""
    whole = upper - samples.inertia[..., None] * jnp.square(omega)[..., None, :]
    return Symmetric.of(6, [whole[:, k] for k in range(21)])


@jax.jit
def arguments(machine: Machine, poses: Frame, stand: Stand, omega: Scalar) -> Array:
    """(3,): wave numbers times lengths, the greatest over all poses: of a beam; of bending and of stretching, over a chain."""

    def own(leg: Leg, pose: Frame, posture: Posture, omega: Scalar) -> Array:
        bars = [p for p in leg_parts(leg, pose, posture, machine.stock) if isinstance(p, Bar)]
        waves = [wave_numbers(uniform(b.profile, machine.stock), omega) * jnp.abs(jnp.asarray(b.length)) for b in bars]
        return jnp.stack([jnp.zeros(2), *waves])

    found = _over_chains(machine, poses, stand, omega, own)
    longest = jnp.stack([jnp.nanmax(a) for a in found]).max()
    together = jnp.stack([jnp.nanmax(a.sum(axis=-2), axis=(0, 1)) for a in found]).max(axis=0)
    return jnp.stack([longest, *together])
