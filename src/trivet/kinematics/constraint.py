"""The wrenches which a chain transmits: those that do no work on any of its slack joints."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp

from trivet.errors import NoResultError
from trivet.space.scalar import Scalar, add, is_known, is_zero, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import ZERO, X, Y, Z

_LEAST_PIVOT = 1e-3
"""A known power below this is a rounding error of an oblique axis, or nearly one."""

_ALL = tuple(Wrench(v, ZERO) for v in (X, Y, Z)) + tuple(Wrench(ZERO, v) for v in (X, Y, Z))


def transmitted(slack: Sequence[Twist]) -> list[Wrench]:
    """A basis of the wrenches reciprocal to the given twists.

    One twist after the other is taken out of the space of all wrenches.  Where the power of some basis wrench on the twist is
    a number known at trace time (a ball's rotations, a hinge across the plane), that wrench is the pivot and the zeros stay;
    else two wrenches are crossed, or more reflected (Householder), so that no pivot can vanish.

    Raises:
        NoResultError: when a twist is taken out twice, that is when the chain has an idle freedom.
    """
    basis = list(_ALL)
    # Twists with known components first: they make the most zeros.
    for twist in sorted(slack, key=lambda t: -sum(is_known(c) for v in t for c in v)):
        powers = [wrench @ twist for wrench in basis]
        working = [i for i, p in enumerate(powers) if not is_zero(p)]
        if not working:
            raise NoResultError("the slack joints of a chain allow one motion twice; a part of it turns freely")
        known = [i for i in working if is_known(powers[i]) and abs(powers[i]) > _LEAST_PIVOT]
        if known:
            basis = _eliminate(basis, powers, max(known, key=lambda i: abs(powers[i])))
        elif len(working) == 1:
            del basis[working[0]]
        elif len(working) == 2:
            i, j = working
            crossed = _scaled(basis[j], powers[i]).plus(basis[i], -powers[j])
            basis = [w for k, w in enumerate(basis) if k not in working] + [crossed]
        else:
            basis = [w for k, w in enumerate(basis) if k not in working] + _reflect(
                [basis[k] for k in working], [powers[k] for k in working]
            )
    return basis


def _scaled(wrench: Wrench, factor: Scalar) -> Wrench:
    return Wrench(wrench.force * factor, wrench.moment * factor)


def _eliminate(basis: list[Wrench], powers: list[Scalar], pivot: int) -> list[Wrench]:
    return [
        wrench if is_zero(power) else wrench.plus(basis[pivot], mul(power, -1 / powers[pivot]))
        for k, (wrench, power) in enumerate(zip(basis, powers, strict=True))
        if k != pivot
    ]


def _reflect(wrenches: list[Wrench], powers: list[Scalar]) -> list[Wrench]:
    """All but the first column of the reflection which turns the powers onto the first axis."""
    square: Scalar = 0
    for power in powers:
        square = add(square, mul(power, power))
    size = jnp.sqrt(square)
    head = powers[0] + jnp.where(powers[0] < 0, -size, size)
    mirror = [head, *powers[1:]]
    scale = 1 / (size * jnp.abs(head))
    total = Wrench(ZERO, ZERO)
    for wrench, component in zip(wrenches, mirror, strict=True):
        total = total.plus(wrench, component)
    return [w.plus(total, -mul(component, scale)) for w, component in zip(wrenches[1:], mirror[1:], strict=True)]
