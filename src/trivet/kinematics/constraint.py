"""The wrenches which a chain transmits: those that do no work on any of its slack joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, Self, TypeVar

import jax.numpy as jnp

from trivet.errors import NoResultError
from trivet.space.scalar import Scalar, add, free_sign, is_known, is_zero, mul
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import ZERO, X, Y, Z

_LEAST_PIVOT = 1e-3
"""A known power below this is a rounding error of an oblique axis, or nearly one."""

_ALL = tuple(Wrench(v, ZERO) for v in (X, Y, Z)) + tuple(Wrench(ZERO, v) for v in (X, Y, Z))


class Column(Protocol):
    """A vector of a linear space, of components some of which are known zeros."""

    def plus(self, other: Self, factor: Scalar) -> Self:
        """This vector plus a multiple of another."""

    def times(self, factor: Scalar) -> Self:
        """A multiple of this vector."""


_Column = TypeVar("_Column", bound=Column)


def transmitted(slack: Sequence[Twist]) -> list[Wrench]:
    """A basis of the wrenches reciprocal to the given twists.

    Raises:
        NoResultError: when a twist is taken out twice, that is when the chain has an idle freedom.
    """
    basis = list(_ALL)
    # Twists with known components first: they make the most zeros.
    for twist in sorted(slack, key=lambda t: -sum(is_known(c) for v in t for c in v)):
        basis = without(basis, [wrench @ twist for wrench in basis])
    return basis


def without(basis: list[_Column], powers: list[Scalar]) -> list[_Column]:
    """A basis, one smaller, of those combinations of the given vectors whose power vanishes.

    Where the power of some vector is a number known at trace time (of a ball's rotations, of a hinge across the plane), that
    vector is the pivot and the zeros stay; else two vectors are crossed, or more reflected (Householder), so that no pivot can
    vanish.

    Raises:
        NoResultError: when no vector has power.
    """
    working = [i for i, p in enumerate(powers) if not is_zero(p)]
    if not working:
        raise NoResultError("the slack joints of a chain allow one motion twice; a part of it turns freely")
    known = [i for i in working if is_known(powers[i]) and abs(powers[i]) > _LEAST_PIVOT]
    if known:
        return _eliminate(basis, powers, max(known, key=lambda i: abs(powers[i])))
    idle = [v for k, v in enumerate(basis) if k not in working]
    if len(working) == 1:
        return idle
    if len(working) == 2:
        i, j = working
        return [*idle, basis[j].times(powers[i]).plus(basis[i], -powers[j])]
    return idle + _reflect([basis[k] for k in working], [powers[k] for k in working])


def _eliminate(basis: list[_Column], powers: list[Scalar], pivot: int) -> list[_Column]:
    return [
        vector if is_zero(power) else vector.plus(basis[pivot], mul(power, -1 / powers[pivot]))
        for k, (vector, power) in enumerate(zip(basis, powers, strict=True))
        if k != pivot
    ]


def _reflect(basis: list[_Column], powers: list[Scalar]) -> list[_Column]:
    """All but the first of the vectors' images in the (unitary) reflection which turns the powers onto the first of them."""
    square: Scalar = 0
    for power in powers:
        square = add(square, _square(power))
    size = jnp.sqrt(square)
    head = powers[0] + _direction(powers[0]) * size
    mirror = [jnp.conj(component) for component in (head, *powers[1:])]
    scale = 1 / (size * jnp.abs(head))
    total = basis[0].times(mirror[0])
    for vector, component in zip(basis[1:], mirror[1:], strict=True):
        total = total.plus(vector, component)
    return [v.plus(total, -mul(power, scale)) for v, power in zip(basis[1:], powers[1:], strict=True)]


def _square(a: Scalar) -> Scalar:
    """|a|^2."""
    return a.real * a.real + a.imag * a.imag if jnp.iscomplexobj(a) else mul(a, a)


def _direction(a: Scalar) -> Scalar:
    """a / |a|, of a size of one where a vanishes."""
    if not jnp.iscomplexobj(a):
        return free_sign(a)
    size = jnp.abs(a)
    return jnp.where(size == 0, 1.0, a / jnp.where(size == 0, 1.0, size))
