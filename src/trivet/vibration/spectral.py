"""Exact dynamic stiffness and receptance of a machine at its platform centre: no mesh, differentiable in every dimension.

The stiffness of a chain is a ratio of entire functions of frequency (`vibration.spectral_chain`), which are as smooth at the
resonances as between them.  So the range is cut into panels; in each a chain is solved at a few Chebyshev nodes, and numerator
and denominator are interpolated (Berrut and Trefethen, SIAM Review 46:501, 2004): thousands of frequencies cost a small matrix
product, and the error is little more than that of rounding.  The platform's inertia is then added at every frequency, and what
is wanted is made of the sum (`Finish`).

Where all that yields has one loss factor eta, the stiffness of a chain is (1 + i eta) D(omega^2 / (1 + i eta)), with D that of
the chain without damping: a ratio of real functions, which are sampled as real numbers and interpolated at complex places.

`receptance` and `dynamic_stiffness` are for numbers.  For derivatives call `standing`, `plan` and `divided` with numbers, and
differentiate `kernel`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from trivet.kinematics.inverse import inverse
from trivet.kinematics.standing import postures
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import Joint
from trivet.model.machine import Chain, copy_rotation
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.symmetric import Symmetric
from trivet.statics.beam_element import uniform
from trivet.statics.parts import Bar
from trivet.vibration.platform import platform_inertia
from trivet.vibration.spectral_beam import Array, terms_for, wave_numbers
from trivet.vibration.spectral_chain import Effort, Excitation, leg_dynamics, leg_parts

NODES = 24
"""Nodes of a panel, twice as many where damping is viscous; also the least number of frequencies of a compiled call."""
REAL_NODES = 18
"""Nodes where the functions are real, which they are in a single panel only: without damping to fill the valleys of the
denominators, rounding would drown more in a later one."""
PANEL = 8.0
"""Wave numbers times lengths, of bending and of the rest, summed over a chain, which one panel of frequencies may add."""
TERMS = 8
"""Terms of the series are taken by so many at a time, since kernels are compiled for every number of them."""
PIECE = 8.0
"""Wave number times length of a piece of a beam."""
NARROW = 1e-3
"""Least width of a panel, against its upper end: nodes that coincide tell nothing apart."""
LEAST = 1e-5
"""Least denominator at the nodes of a panel, against its greatest, below which a panel is divided."""
LOWER = 0.5
"""Where it is divided, against its upper end."""
COINCIDING = 1e-20
"""Distance of a frequency from a node, against the node, that stands for none."""
PADDED = 200
"""Frequencies of a panel are filled up to a multiple of this, since kernels are compiled for every number of them."""
CHUNK = 16
"""Poses of a call: few enough for the intermediate arrays to stay in a cache."""

UPPER = np.triu_indices(6)
_T = TypeVar("_T")


class Stand(NamedTuple):
    """How chains are known to stand: in a working mode, or (at one pose, closed numerically) as they stand."""

    signs: Any
    """(n_chains, 2), or None."""
    postures: tuple[Posture, ...] | None
    """Per chain, with one leading axis, or None."""


class Plan(NamedTuple):
    """How frequencies are covered; kernels are compiled for all but the edges."""

    effort: Effort
    edges: tuple[float, ...]
    """Upper ends of the panels, rad/s."""
    power: int
    """The functions are smooth in this power of frequency: 2, or 1 where a joint has viscous damping."""
    is_real: bool
    """Whether the functions are sampled without damping: all that yields has the loss factor of the analysis, and there is one
    panel."""


class Finish(Protocol):
    """What is made of the dynamic stiffness of a machine, to be hashed: kernels are compiled for it."""

    @property
    def axis(self) -> int:
        """That of the frequencies in what is made."""
        ...

    def __call__(self, matrix: Symmetric, arms: Any) -> Array:
        """From entries (p, n), complex, at the platform centre, in {O}; and whatever arrays (p,) were given with the poses."""
        ...


class Matrices(NamedTuple):
    """6×6 matrices (p, n, 6, 6), or (n, 6, 6) of a pose that is alone."""

    inverted: bool
    """Receptance rather than dynamic stiffness."""
    alone: bool
    axis: int = -3

    def __call__(self, matrix: Symmetric, arms: Any) -> Array:
        one = Symmetric.of(6, [entry[0] for entry in matrix.upper()]) if self.alone else matrix
        entries = (one.inverse() if self.inverted else one).full()
        return jnp.stack([jnp.stack(row, axis=-1) for row in entries], axis=-2)


class _Chains(NamedTuple):
    """The copies of a chain at poses and nodes; all arrays have the axes (copies, poses) in front."""

    stiffness: Array
    """(nodes, m (m + 1) / 2): upper triangle of its dynamic stiffness along the m wrenches which it transmits."""
    denominator: Array
    """(nodes,)."""
    spread: Array
    """(m (m + 1) / 2, 21): from that triangle to the upper triangle at the platform centre, in {O}."""


class _Samples(NamedTuple):
    """A machine at poses and nodes."""

    chains: list[_Chains]
    inertia: Array
    """(p, 21): upper triangle of the platform's inertia at its centre, in {O}."""
    least: Array
    """The least denominator."""


def receptance(machine: Machine, pose: Frame, signs: Any, frequency: Any, loss_factor: Scalar = 0.02) -> Array:
    """Receptance (..., n, 6, 6) at the platform centre, in {O}: [u; w] = H [F; M] exp(i omega t), m/N, rad/N, rad/(N m).

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, m; components are numbers, or arrays of one shape (p,).
        signs: (n_chains, 2) working mode; None for a machine without, at one pose.
        frequency: (n,) above zero, Hz.
        loss_factor: structural damping eta of all that has no loss factor of its own.

    Returns:
        H; NaN at poses which a chain does not reach (travel limits are not looked at).

    Raises:
        NoResultError: a chain turns freely, or does not close numerically.
    """
    return prepared(machine, pose, signs, float(np.max(frequency)), loss_factor)(frequency)


def dynamic_stiffness(machine: Machine, pose: Frame, signs: Any, frequency: Any, loss_factor: Scalar = 0.02) -> Array:
    """Dynamic stiffness (..., n, 6, 6) at the platform centre, the inverse of the `receptance`; arguments as there."""
    return prepared(machine, pose, signs, float(np.max(frequency)), loss_factor, inverted=False)(frequency)


def prepared(
    machine: Machine, pose: Frame, signs: Any, highest: float, loss_factor: Scalar = 0.02, *, inverted: bool = True
) -> Callable[[Any], Array]:
    """`receptance` as a function of frequencies (n,) up to a highest one (Hz), for who asks more than once.

    With `inverted` false it is the dynamic stiffness.
    """
    poses = jax.tree.map(lambda c: np.atleast_1d(np.asarray(c, dtype=float)), pose)
    stand = standing(machine, pose, signs)
    chosen = plan(machine, poses, stand, 2 * math.pi * highest)
    finish, count = Matrices(inverted, alone=not np.ndim(pose.origin.x)), len(poses.origin.x)

    def answer(frequency: Any) -> Array:
        omega = 2 * math.pi * np.asarray(frequency, dtype=float).ravel()
        found = []
        for start in range(0, count, CHUNK):
            some = poses if count <= CHUNK else jax.tree.map(lambda c, start=start: c[start : start + CHUNK], poses)
            found.append(kernel(machine, some, stand, omega, loss_factor, chosen, finish))
        return jnp.concatenate(found) if len(found) > 1 else found[0]

    return answer


def standing(machine: Machine, pose: Frame, signs: Any) -> Stand:
    """How the chains of a machine stand at poses, as the kernels take it."""
    if signs is not None:
        return Stand(np.asarray(signs), None)
    alone = jax.tree.map(lambda c: np.asarray(c, dtype=float)[None], postures(machine, pose, None))
    return Stand(None, alone)


def plan(machine: Machine, poses: Frame, stand: Stand, highest: float) -> Plan:
    """How to cover the frequencies up to a highest one (rad/s) at poses (p,)."""
    longest, bending, stretching = np.maximum(0.0, _arguments(machine, poses, stand, highest))
    segments = max(1, math.ceil(longest / PIECE))
    panels = max(1, math.ceil((bending + stretching) / PANEL))
    joints = [e for chain in machine.chains.values() for e in chain.elements if isinstance(e, Joint)]
    viscous = any(joint.viscosity is not None for joint in joints)
    others = any(owner.loss_factor is not None for owner in (*joints, *machine.materials.values()))
    # Bending waves shorten with the root of the frequency, those of stretching and torsion with the frequency itself:
    # panels of equal bending sqrt(x) + stretching x.
    shares = np.arange(1, panels + 1) / panels * (bending + stretching)
    roots = 2 * shares / np.maximum(bending + np.sqrt(bending**2 + 4 * stretching * shares), 1e-30)
    terms = -(-terms_for(longest / segments) // TERMS) * TERMS
    edges = tuple(float(x) for x in highest * roots**2)
    return Plan(Effort(terms, segments), edges, 1 if viscous else 2, panels == 1 and not (viscous or others))


def kernel(
    machine: Machine,
    poses: Frame,
    stand: Stand,
    omega: np.ndarray,
    loss_factor: Scalar,
    chosen: Plan,
    finish: Finish,
    arms: Any = None,
) -> Array:
    """What is made of the dynamic stiffness at poses (p,) and frequencies (n,) (rad/s) which a plan covers.

    JAX may trace the machine; then the panels are those of the plan: take one that is `divided`.
    """
    pieces, order = [], []
    left = list(_panels(omega, chosen))
    while left:
        places = left.pop()
        at = omega[places]
        nodes, weights = _nodes(at, chosen)
        if weights is None:
            samples = _samples(machine, poses, stand, nodes, loss_factor, chosen.effort)
            finished = _at_nodes(samples, nodes, finish, arms)
        else:
            samples = _samples(machine, poses, stand, nodes, None if chosen.is_real else loss_factor, chosen.effort)
            more = -len(places) % PADDED
            padded = np.pad(at, (0, more), mode="edge") if more else at
            # On its way before the samples are looked at, since it is seldom in vain.
            finished = _between(samples, weights, nodes, padded, loss_factor, chosen.power, chosen.is_real, finish, arms)
            if not isinstance(samples.least, jax.core.Tracer) and _is_steep(samples, at):
                is_low = at < at.max() * LOWER
                left += [places[is_low], places[~is_low]]
                continue
        pieces.append(jax.lax.slice_in_dim(finished, 0, len(places), axis=finish.axis))
        order.append(places)
    if len(pieces) == 1:
        return pieces[0]
    return jnp.take(jnp.concatenate(pieces, axis=finish.axis), np.argsort(np.concatenate(order)), axis=finish.axis)


def divided(machine: Machine, poses: Frame, stand: Stand, omega: np.ndarray, loss_factor: Scalar, chosen: Plan) -> Plan:
    """A plan for these frequencies (rad/s) with panels so narrow that `kernel` would divide none."""
    edges, left = list(chosen.edges), [omega[places] for places in _panels(omega, chosen)]
    while left:
        at = left.pop()
        nodes, weights = _nodes(at, chosen)
        loss = None if chosen.is_real else loss_factor
        if weights is not None and _is_steep(_samples(machine, poses, stand, nodes, loss, chosen.effort), at):
            edges.append(float(at.max() * LOWER))
            left += [at[at < edges[-1]], at[at >= edges[-1]]]
    return chosen._replace(edges=tuple(sorted(edges)))


def _is_steep(samples: _Samples, omega: np.ndarray) -> bool:
    """Whether the denominators vary so much over a panel that rounding would drown the least; and it can be divided."""
    return bool(samples.least < LEAST and omega.min() < omega.max() * LOWER)


def _panels(omega: np.ndarray, chosen: Plan) -> Iterator[np.ndarray]:
    """The frequencies of every panel, by index."""
    panel = np.searchsorted(chosen.edges[:-1], omega, side="right")
    for number in range(len(chosen.edges)):
        (places,) = np.nonzero(panel == number)
        if len(places):
            yield places


def _nodes(omega: np.ndarray, chosen: Plan) -> tuple[np.ndarray, np.ndarray | None]:
    """Nodes (rad/s) for the frequencies of a panel, and their weights; None where the frequencies are the nodes."""
    power = chosen.power
    if len(omega) <= NODES * 2 // power:
        return np.pad(omega, (0, NODES * 2 // power - len(omega)), mode="edge"), None
    count = REAL_NODES if chosen.is_real else NODES * 2 // power
    low, high = omega.min() ** power, omega.max() ** power
    # The places where real functions are wanted lie beside the axis, as far as damping leads them from it.
    low = 0.0 if chosen.is_real else min(low, high * (1 - NARROW))
    angle = (2 * np.arange(count) + 1) * np.pi / (2 * count)
    nodes = (low + high) / 2 + (high - low) / 2 * np.cos(angle)
    return nodes ** (1 / power), (-1.0) ** np.arange(count) * np.sin(angle)


def _over_chains(
    machine: Machine, poses: Frame, stand: Stand, omega: Any, work: Callable[[Leg, Frame, Posture, Any], _T]
) -> list[_T]:
    """What some work gives for every chain of the file, with the axes (copies, poses) in front; see `_samples` for omega."""
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
def _samples(
    machine: Machine, poses: Frame, stand: Stand, omega: Array, loss_factor: Scalar | None, effort: Effort
) -> _Samples:
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
    return _Samples(chains, platform_inertia(machine, poses)[:, UPPER[0], UPPER[1]], least)


@partial(jax.jit, static_argnames="finish")
def _at_nodes(samples: _Samples, nodes: Array, finish: Finish, arms: Any) -> Array:
    """What is made of the stiffness of chains and platform together at the nodes, (n,) or (p, n)."""
    total: Any = sum(jnp.einsum("cpnm,cpmu->pun", chains.stiffness, chains.spread) for chains in samples.chains)
    return finish(_with_platform(total, samples, nodes), arms)


@partial(jax.jit, static_argnames=("power", "is_real", "finish"))
def _between(
    samples: _Samples,
    weights: Array,
    nodes: Array,
    omega: Array,
    loss_factor: Scalar,
    power: int,
    is_real: bool,
    finish: Finish,
    arms: Any,
) -> Array:
    """The same at frequencies between the nodes, of many poses at `PADDED` frequencies at a time, which a cache can hold."""

    def some(omega: Array) -> Array:
        return _interpolated(samples, weights, nodes, omega, loss_factor, power, is_real, finish, arms)

    if len(omega) <= PADDED or len(samples.inertia) == 1:
        return some(omega)
    found = jnp.moveaxis(jax.lax.map(some, omega.reshape(-1, PADDED)), 0, finish.axis - 1)
    axis = found.ndim + finish.axis
    return found.reshape(*found.shape[: axis - 1], len(omega), *found.shape[axis + 1 :])


def _interpolated(
    samples: _Samples,
    weights: Array,
    nodes: Array,
    omega: Array,
    loss_factor: Scalar,
    power: int,
    is_real: bool,
    finish: Finish,
    arms: Any,
) -> Array:
    """The same, all at once: numerators and denominators by the barycentric formula, then their quotients."""
    elastic = 1 + 1j * jnp.asarray(loss_factor) if is_real else 1.0
    scaled_nodes, places = nodes**power, omega**power / elastic
    apart = places - scaled_nodes[:, None]
    cauchy = weights[:, None] / jnp.where(apart == 0, COINCIDING * scaled_nodes[:, None], apart)
    total: Any = 0
    for chains in samples.chains:
        denominator = chains.denominator[..., None]
        both = jnp.moveaxis(jnp.concatenate([chains.stiffness * denominator, denominator], axis=-1), 2, -1)
        # Real and imaginary parts apart: a complex product with real factors would do twice the work, a quotient far more.
        if is_real:
            real, imag = jnp.split(_along_nodes(both, jnp.concatenate([cauchy.real, cauchy.imag], axis=-1)), 2, axis=-1)
        else:
            real, imag = jnp.split(_along_nodes(jnp.concatenate([both.real, both.imag], axis=2), cauchy), 2, axis=2)
        shrunk = 1 / (real[..., -1:, :] ** 2 + imag[..., -1:, :] ** 2)
        below = real[..., -1:, :] * shrunk, imag[..., -1:, :] * shrunk
        real, imag = real[..., :-1, :], imag[..., :-1, :]
        quotient = jnp.concatenate([real * below[0] + imag * below[1], imag * below[0] - real * below[1]], axis=-1)
        total += jnp.einsum("cpmf,cpmu->puf", quotient, chains.spread)
    chain_stiffness = elastic * jax.lax.complex(total[..., : len(omega)], total[..., len(omega) :])
    return finish(_with_platform(chain_stiffness, samples, omega), arms)


def _along_nodes(values: Array, factors: Array) -> Array:
    """Values (..., nodes) times factors (nodes, n)."""
    return (values.reshape(-1, values.shape[-1]) @ factors).reshape(*values.shape[:-1], -1)


def _with_platform(upper: Array, samples: _Samples, omega: Array) -> Symmetric:
    """The dynamic stiffness from the upper triangle (p, 21, n) of that of the chains."""
    whole = upper - samples.inertia[..., None] * jnp.square(omega)[..., None, :]
    return Symmetric.of(6, [whole[:, k] for k in range(21)])


@jax.jit
def _arguments(machine: Machine, poses: Frame, stand: Stand, omega: Scalar) -> Array:
    """(3,): wave numbers times lengths, the greatest over all poses: of a beam; of bending and of stretching, over a chain."""

    def arguments(leg: Leg, pose: Frame, posture: Posture, omega: Scalar) -> Array:
        bars = [p for p in leg_parts(leg, pose, posture, machine.stock) if isinstance(p, Bar)]
        own = [wave_numbers(uniform(b.profile, machine.stock), omega) * jnp.abs(jnp.asarray(b.length)) for b in bars]
        return jnp.stack([jnp.zeros(2), *own])

    found = _over_chains(machine, poses, stand, omega, arguments)
    longest = jnp.stack([jnp.nanmax(a) for a in found]).max()
    together = jnp.stack([jnp.nanmax(a.sum(axis=-2), axis=(0, 1)) for a in found]).max(axis=0)
    return jnp.stack([longest, *together])
