"""Scalars with zeros and ones known at trace time.

A kernel for one pose is written with general vector formulas.  Most components of a planar chain in its own frame are
exactly 0 or 1; the functions here fold those (Python numbers) away while JAX traces, so that the general formula compiles
to the special one.  Everything that is not a Python number is passed on to JAX unchanged.

Double precision is switched on here, in the module which every kernel imports.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]

Scalar: TypeAlias = Any
"""A Python number (known at trace time), a NumPy number or array, or a JAX tracer."""


def is_known(a: Scalar) -> bool:
    """Whether a scalar is a plain Python number, hence known while tracing."""
    return type(a) in (int, float)  # not isinstance: a NumPy double is a float, but its zeros are accidents of the data


def is_zero(a: Scalar) -> bool:
    """Whether a scalar is exactly zero and known to be so while tracing."""
    return is_known(a) and a == 0


def add(a: Scalar, b: Scalar) -> Scalar:
    """a + b."""
    if is_zero(a):
        return b
    return a if is_zero(b) else a + b


def sub(a: Scalar, b: Scalar) -> Scalar:
    """a - b."""
    if is_zero(a):
        return -b
    return a if is_zero(b) else a - b


def mul(a: Scalar, b: Scalar) -> Scalar:
    """a * b, where a known 0 annihilates (also NaN and infinity) and a known +1 or -1 costs nothing."""
    if is_zero(a) or is_zero(b):
        return 0
    if is_known(b):
        a, b = b, a
    if is_known(a):
        if a == 1:
            return b
        if a == -1:
            return -b
    return a * b


@jax.jit
def free_sign(a: Scalar) -> Scalar:
    """1, or -1 where a number is below zero, to keep off cancellation: for results that are the same with either."""
    return jnp.where(a < 0, -1.0, 1.0)


FREE_SIGN = "free_sign"
"""The name of that function in what JAX traces."""


def sine(a: Scalar) -> Scalar:
    """sin(a) of an angle (rad)."""
    return math.sin(a) if is_known(a) else jnp.sin(a)


def cosine(a: Scalar) -> Scalar:
    """cos(a) of an angle (rad)."""
    return math.cos(a) if is_known(a) else jnp.cos(a)
