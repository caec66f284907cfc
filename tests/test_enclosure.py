"""Balls: what is anywhere in a box is in them, they tighten as they should, and they know their own rounding."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from trivet.space.enclosure import Enclosure

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "polynomial": lambda x, y: x**3 - 2 * x * y + y**2 / 3 - 1,
    "quotient": lambda x, y: (1 + x * y) / (3 + x - y),
    "root": lambda x, y: jnp.sqrt(4 + x * x - y),
    "angles": lambda x, y: jnp.sin(3 * x) * jnp.cos(y) - jnp.arctan2(y + 3, x),
    "behind": lambda x, y: jnp.arctan2(y - 3, x - 2),
    "kinks": lambda x, y: jnp.abs(x) + jnp.minimum(x, y) * 2 - jnp.maximum(y, 0.3 * x),
    "choice": lambda x, y: jnp.where(x > y, x * y, y - x * x),
    "truths": lambda x, y: jnp.where((x > y) & (x >= 0) | (y < -0.5), x, 1 - y),
    "steps": lambda x, y: x * jnp.round(2 * y) + jnp.sign(x),
    "arrays": lambda x, y: (jnp.stack([x, y, x * y]) * jnp.array([[1.0], [2.0], [-1.0]])).reshape(-1)[: 2 * x.shape[0]],
    "nested": lambda x, y: jax.jit(lambda a: a / jnp.sqrt(1 + a * a))(x - y),
    "reciprocal": lambda x, y: (5 + x) ** -2 * y,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_is_in_a_box_is_in_the_ball(name: str) -> None:
    rng = np.random.default_rng(4)
    function, count = FUNCTIONS[name], 400
    middles = [rng.uniform(-1, 1, count) for _ in range(2)]
    edges = [[rng.normal(size=count) * 10.0 ** rng.uniform(-6, -0.5, count) for _ in range(2)] for _ in range(2)]
    found = Enclosure(function, middles, 2)(middles, edges)
    tightest = np.full(np.shape(found.middle), np.inf)
    np.testing.assert_allclose(found.middle, function(*map(jnp.asarray, middles)), rtol=1e-12, atol=1e-12)
    for k in range(200):
        share = (
            rng.uniform(-1, 1, (2, count)) if k > 3 else np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)][k])[:, None] * (1 - 1e-9)
        )
        inner = [middles[i] + share[0] * edges[0][i] + share[1] * edges[1][i] for i in range(2)]
        off = np.abs(np.asarray(function(*map(jnp.asarray, inner))) - found.middle)
        assert np.all(off <= found.radius)
        tightest = np.minimum(tightest, found.radius - off)
    if name in ("polynomial", "quotient", "root", "angles"):
        small = np.max(np.abs(np.array(edges)), axis=(0, 1)) < 1e-3
        assert np.all(tightest[small] < 0.05 * found.radius[small] + 2e-6)  # the corners all but touch the ball


def test_what_is_given_away_is_of_second_order() -> None:
    middles = [np.array([0.3]), np.array([-0.4])]
    spare = []
    for size in (1e-2, 1e-3, 1e-4):
        edges = [[np.array([size]), np.array([0.5 * size])]]
        ball = Enclosure(FUNCTIONS["angles"], middles, 1)(middles, edges)
        shares = np.linspace(-1, 1, 2001)
        values = np.asarray(FUNCTIONS["angles"](0.3 + shares * size, -0.4 + 0.5 * shares * size))
        spare.append(float(ball.radius[0] - np.abs(values - ball.middle).max()))
    assert all(50 < a / b < 200 for a, b in pairwise(spare))


def test_rounding_is_in_the_ball() -> None:
    """Cancellation, against fractions."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-1, 1, 200), rng.uniform(-1, 1, 200)

    def function(a: Any, b: Any) -> Any:
        return (1e8 + a * b) - 1e8 - a * (b - 1 / 3.0)

    found = Enclosure(function, [x, y], 1)([x, y], [[0 * x, 0 * y]])
    third = Fraction(1 / 3.0)
    for k in range(200):
        a, b = Fraction(x[k]), Fraction(y[k])
        exact = (10**8 + a * b) - 10**8 - a * (b - third)
        assert abs(Fraction(found.middle[k]) - exact) <= Fraction(found.radius[k])
    assert np.any(found.middle != x / 3.0)
    assert found.radius.max() < 1e-6


def test_what_cannot_be_bounded_is_infinite() -> None:
    x = [np.array([0.0, 0.5])]
    edges = [[np.array([0.1, 0.1])]]
    for function in (lambda a: 1 / a, jnp.sqrt, lambda a: jnp.arctan2(a, -1.0 + 0 * a)):
        ball = Enclosure(function, x, 1)(x, edges)
        is_open = ~(ball.radius < 6)
        assert list(is_open) == [True, False]


def test_an_operation_without_a_rule_is_named() -> None:
    enclosure = Enclosure(jnp.exp, [np.zeros(2)], 1)
    with pytest.raises(NotImplementedError, match="exp"):
        enclosure([np.zeros(2)], [[np.ones(2)]])
