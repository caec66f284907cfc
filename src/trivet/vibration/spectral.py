"""Exact dynamic stiffness and receptance of a machine at its platform centre: no mesh, differentiable in every dimension.

Nothing is solved at the frequencies that are asked for.  The range is cut into panels in which chains are solved at a few
Chebyshev nodes each; between them numerators and denominators of their stiffness are interpolated, which are as smooth at the
resonances as elsewhere (`vibration.spectral_machine`).  What is asked of the machine as a whole is a ratio of such functions
too, with the resonances of all chains together, so it is worked out at the nodes of narrower panels and interpolated once more
(`vibration.panels`): a frequency costs a few products, whatever the machine.

`receptance` and `dynamic_stiffness` are for numbers.  For derivatives call `standing`, `plan` and `divided` with numbers, and
differentiate `kernel`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.model import Machine
from trivet.model.elements import Joint
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.symmetric import Symmetric
from trivet.vibration.panels import BLOCK, Blocks, Nodes, quotients
from trivet.vibration.spectral_beam import Array, terms_for
from trivet.vibration.spectral_chain import Effort
from trivet.vibration.spectral_machine import (
    UPPER,
    Finish,
    Samples,
    Stand,
    arguments,
    at_nodes,
    between,
    sampled,
    standing,
)

CHAIN_NODES = 24
"""Nodes of a panel of chains, twice as many where damping is viscous; also the least number of frequencies of a call."""
REAL_NODES = 18
"""Nodes where the functions are real, which they are in a single panel only: without damping to fill the valleys of the
denominators, rounding would drown more in a later one."""
PANEL = 8.0
"""Wave numbers times lengths, of bending and of the rest, summed over a chain, which one panel of chains may add."""
TERMS = 8
"""Terms of the series are taken by so many at a time, since kernels are compiled for every number of them."""
PIECE = 8.0
"""Wave number times length of a piece of a beam."""
LEAST = 1e-5
"""Least denominator at the nodes of a panel of chains, against its greatest, below which the panel is divided."""
LOWER = 0.5
"""Where it is divided, against its upper end."""
OCTAVES = 4
"""Panels of a machine are octaves to begin with, so many below the highest frequency, of which the highest is halved as most
machines want it, and one for the rest."""
DOUBT = 1e-8
"""Error at a resonance that may be feared, above which a panel of a machine is divided.  An estimate: as a rule the error is a
hundredth of it, yet at tiny damping, where rounding decides, it may be more."""
ROUNDING = 1e-14
"""What is lost of a denominator, against its greatest in a panel, by rounding alone, as its last Chebyshev coefficients show.
Values lose as much or more, which against a tiny least denominator is not small."""
HOPELESS = 0.1
"""Doubt that only a denominator of nought can raise where rounding alone is lost: a resonance without damping.  Dividing panels
that lose no more is no use then."""
ROUNDS = 3
"""Panels of a machine are divided so many times at most."""
CHUNK = 16
"""Poses of a call: few enough for the intermediate arrays to stay in a cache."""


class Plan(NamedTuple):
    """How frequencies are covered; kernels are compiled for the effort and the power, and the number of cuts."""

    effort: Effort
    edges: tuple[float, ...]
    """Upper ends of the panels of chains, rad/s."""
    power: int
    """The functions are smooth in this power of frequency: 2, or 1 where a joint has viscous damping."""
    is_real: bool
    """Whether the functions are sampled without damping: all that yields has the loss factor of the analysis, and there is one
    panel of chains."""
    cuts: tuple[float, ...]
    """Frequencies between the panels of the machine, rad/s."""
    direct: bool = False
    """Whether those panels leave doubt, however they are divided; where JAX traces, and no doubt can be seen, every frequency
    is then worked out by itself."""


class Matrices(NamedTuple):
    """6×6 matrices (p, n, 6, 6), or (n, 6, 6) of a pose that is alone."""

    inverted: bool
    """Receptance rather than dynamic stiffness."""
    alone: bool

    def __call__(self, matrix: Symmetric, arms: Any) -> tuple[Array, Array]:
        units = [[int(i == j) for j in range(6)] for i in range(6)]
        found, factor = matrix.products(units, list(zip(*UPPER, strict=True))) if self.inverted else (matrix.upper(), 1.0)
        return jnp.stack(found, axis=-2), jnp.broadcast_to(jnp.asarray(factor, dtype=complex), jnp.shape(matrix[0, 0]))

    def shaped(self, values: Array) -> Array:
        place = np.zeros((6, 6), dtype=int)
        place[UPPER] = place.T[UPPER] = np.arange(21)
        whole = jnp.moveaxis(values[:, place.ravel()], -1, 1).reshape(len(values), -1, 6, 6)
        return whole[0] if self.alone else whole


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
        nonlocal chosen
        omega = 2 * math.pi * np.asarray(frequency, dtype=float).ravel()
        found = []
        for start in range(0, count, CHUNK):
            some = poses if count <= CHUNK else jax.tree.map(lambda c, start=start: c[start : start + CHUNK], poses)
            part, chosen = solved(machine, some, stand, omega, loss_factor, chosen, finish)
            found.append(part)
        return jnp.concatenate(found) if len(found) > 1 else found[0]

    return answer


def plan(machine: Machine, poses: Frame, stand: Stand, highest: float) -> Plan:
    """How to cover the frequencies up to a highest one (rad/s) at poses (p,)."""
    longest, bending, stretching = np.maximum(0.0, arguments(machine, poses, stand, highest))
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
    cuts = (*(highest / 2**k for k in range(OCTAVES, 0, -1)), highest * math.sqrt(5 / 8))
    return Plan(Effort(terms, segments), edges, 1 if viscous else 2, panels == 1 and not (viscous or others), cuts)


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

    JAX may trace the machine; then the panels are those of the plan, or none if it is `direct`: take one that is `divided`.
    """
    return solved(machine, poses, stand, omega, loss_factor, chosen, finish, arms)[0]


def divided(
    machine: Machine,
    poses: Frame,
    stand: Stand,
    omega: np.ndarray,
    loss_factor: Scalar,
    chosen: Plan,
    finish: Finish,
    arms: Any = None,
) -> Plan:
    """A plan with panels so narrow that `kernel` would divide none, or one without (`direct`); arguments as there."""
    return solved(machine, poses, stand, omega, loss_factor, chosen, finish, arms)[1]


def solved(
    machine: Machine,
    poses: Frame,
    stand: Stand,
    omega: np.ndarray,
    loss_factor: Scalar,
    chosen: Plan,
    finish: Finish,
    arms: Any = None,
) -> tuple[Array, Plan]:
    """`kernel`, and the plan `divided`."""
    pieces: list[Array] = []
    order, known = np.empty(len(omega), dtype=int), 0
    left = list(_panels(omega, chosen))
    while left:
        places = left.pop()
        at = omega[places]
        nodes = _nodes(at, chosen)
        if nodes is None:
            filled = np.pad(at, (0, _most(chosen) - len(at)), mode="edge")
            samples = sampled(machine, poses, stand, filled, loss_factor, chosen.effort)
            found, own = at_nodes(samples, filled, finish, arms), np.arange(len(at))
        else:
            loss = None if chosen.is_real else loss_factor
            samples = sampled(machine, poses, stand, nodes.omega, loss, chosen.effort)
            is_traced = any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves((samples, loss_factor, arms)))
            if not is_traced and _is_steep(samples, at):
                chosen = chosen._replace(edges=tuple(sorted((*chosen.edges, at.max() * LOWER))), is_real=False)
                is_low = at < at.max() * LOWER
                left += [places[is_low], places[~is_low]]
                continue
            at_those = partial(between, samples, nodes, loss_factor=loss_factor, power=chosen.power, finish=finish, arms=arms)
            found, own, chosen = _between(at_those, at, chosen, is_traced)
        order[places] = known + own
        known += found.shape[-1]
        pieces.append(found)
    return _arranged(jnp.concatenate(pieces, axis=-1) if len(pieces) > 1 else pieces[0], order, finish), chosen


def _between(
    at_those: Callable[..., tuple[Array, Array]], omega: np.ndarray, chosen: Plan, is_traced: bool
) -> tuple[Array, np.ndarray, Plan]:
    """Values (p, k, m) at the frequencies of a panel of chains, and where those of each (n,) are among them.

    Between nodes of the machine where that is less work and its panels need not become too many, else at each; also at each
    where dividing the panels leaves doubt.
    """
    cuts = chosen.cuts
    for divisions in range(ROUNDS + 1):
        blocks = Blocks.of(omega, cuts, chosen.power)
        nodes = blocks.nodes.omega.ravel()
        if len(nodes) >= len(omega) or (is_traced and chosen.direct):
            return at_those(omega=omega)[0], np.arange(len(omega)), chosen._replace(cuts=cuts)
        found = quotients(*at_those(omega=nodes), blocks.nodes, blocks.power, blocks.panel)
        if is_traced:
            return found.values, blocks.order, chosen
        doubtful = np.asarray(found.doubt) > DOUBT
        is_rounding = (np.asarray(found.lost) < ROUNDING)[blocks.panel]
        meets_nought = np.any(is_rounding & (np.asarray(found.doubt) > HOPELESS))
        more = blocks.halves(doubtful & ~(is_rounding & meets_nought))
        if not more or divisions == ROUNDS:
            break
        cuts = tuple(sorted((*cuts, *more)))
    chosen = chosen._replace(cuts=cuts)
    if not np.any(doubtful):
        return found.values, blocks.order, chosen
    (places,) = np.nonzero(doubtful[blocks.order // BLOCK])
    # As many at a time as there are nodes, for which the kernel is compiled.
    filled = np.pad(omega[places], (0, -len(places) % len(nodes)), mode="edge")
    parts = [np.asarray(at_those(omega=part)[0]) for part in filled.reshape(-1, len(nodes))]
    mended = np.array(found.values)
    mended[..., blocks.order[places]] = np.concatenate(parts, axis=-1)[..., : len(places)]
    return jnp.asarray(mended), blocks.order, chosen._replace(direct=True)


@partial(jax.jit, static_argnames="finish")
def _arranged(values: Array, order: Array, finish: Finish) -> Array:
    return finish.shaped(jnp.take(values, order, axis=-1, mode="clip"))


def _is_steep(samples: Samples, omega: np.ndarray) -> bool:
    """Whether the denominators vary so much over a panel that rounding would drown the least; and it can be divided."""
    return bool(samples.least < LEAST and omega.min() < omega.max() * LOWER)


def _panels(omega: np.ndarray, chosen: Plan) -> Iterator[np.ndarray]:
    """The frequencies of every panel of chains, by index."""
    panel = np.searchsorted(chosen.edges[:-1], omega, side="right")
    for number in range(len(chosen.edges)):
        (places,) = np.nonzero(panel == number)
        if len(places):
            yield places


def _most(chosen: Plan) -> int:
    """Frequencies of a panel up to which they are nodes themselves."""
    return CHAIN_NODES * 2 // chosen.power


def _nodes(omega: np.ndarray, chosen: Plan) -> Nodes | None:
    """Nodes of chains for the frequencies of a panel; None where the frequencies are the nodes."""
    if len(omega) <= _most(chosen):
        return None
    low, high = (float(end) ** chosen.power for end in (omega.min(), omega.max()))
    # The places where real functions are wanted lie beside the axis, as far as damping leads them from it.
    return Nodes.between(0.0 if chosen.is_real else low, high, REAL_NODES if chosen.is_real else _most(chosen), chosen.power)
