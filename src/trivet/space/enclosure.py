"""How far the results of a function can be, over a whole box, from those at its middle: arithmetic of balls.

A ball is a number and a radius, which bounds how far the exact result, anywhere in the box, is from that number; rounding is
counted.  A function written for JAX is traced once, with its derivatives along the edges of the box, and the operations are
done on balls by NumPy, many boxes side by side.  Middle values plus slopes over the box give away only what is of second order
in its size (the mean value form: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, 2009, chapter 6;
balls instead of intervals: F. Johansson, Arb, IEEE Transactions on Computers 66, 2017).  Where the function may jump in the
box, slopes tell nothing, and the ball is that of its values.

What cannot be bounded, a quotient by a ball around zero or a root of one that reaches below zero, has an infinite radius.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Literal
from numpy.typing import NDArray

from trivet.space.scalar import FREE_SIGN, Scalar

Array = NDArray[Any]

_UNIT = 2.0**-52
"""Twice the rounding of one operation, in parts of its result."""
_LIBRARY = 8 * _UNIT
"""The same of sines and arctangents, whatever library computes them."""
_TINY = 1e-300
"""Keeps radii from rounding down to nothing."""


class Ball(NamedTuple):
    """A number and how far the exact one may be from it; a truth value and whether it may be the other one."""

    middle: Scalar
    radius: Scalar
    jumps: Any = None
    """Where it may change by a jump within the box; None for nowhere."""


class Enclosure:
    """A function of arrays, traced for boxes of one shape."""

    def __init__(
        self, function: Callable[..., Any], arguments: Sequence[Array], edges: int, fixed: Sequence[Array] = ()
    ) -> None:
        """Trace a function.

        Args:
            function: of arrays, written with JAX; gives a tree of arrays.
            arguments: examples of those which have a box.
            edges: how many the boxes have.
            fixed: examples of further arguments, which are the same all over a box.

        Raises:
            NotImplementedError: names an operation that has no rule here.
        """
        many = len(arguments)
        both = [*arguments, *fixed]

        def numbers(*values: Any) -> Any:
            return jax.tree.map(lambda found: jnp.asarray(found, dtype=float), function(*values))

        def slopes(*values: Any) -> Any:
            rest, tangents = values[many : len(both)], values[len(both) :]
            _, along = jax.linearize(lambda *own: numbers(*own, *rest), *values[:many])
            return [along(*tangents[many * k : many * (k + 1)]) for k in range(edges)]

        self._values, shape = jax.make_jaxpr(numbers, return_shape=True)(*both)
        self._slopes = jax.make_jaxpr(slopes)(*both, *(list(arguments) * edges))
        self._tree = jax.tree.structure(shape)

    def __call__(self, middles: Sequence[Array], edges: Sequence[Sequence[Array]], fixed: Sequence[Array] = ()) -> Any:
        """The results over boxes, a tree of balls.

        Args:
            middles: of the boxes, for each argument.
            edges: for every edge half of it, for each argument: a box is all middles + sum of t_k edge_k, -1 <= t_k <= 1.
            fixed: the further arguments.
        """
        with np.errstate(all="ignore"):
            points = [Ball(np.asarray(c, dtype=float), 0.0) for c in middles]
            spread = [Ball(p.middle, _up(sum(np.abs(edge[k]) for edge in edges))) for k, p in enumerate(points)]
            along = [Ball(np.asarray(c, dtype=float), 0.0) for edge in edges for c in edge]
            rest = [Ball(np.asarray(value), 0.0) for value in fixed]
            found, wholes = (_evaluated(self._values, [*given, *rest]) for given in (points, spread))
            slopes = _evaluated(self._slopes, [*spread, *rest, *along])
            count, balls = len(found), []
            for k, (point, whole) in enumerate(zip(found, wholes, strict=True)):
                radius = point.radius
                for slope in slopes[k::count]:
                    radius = radius + np.abs(slope.middle) + slope.radius
                radius = np.where(np.isnan(radius) | ~np.isfinite(point.middle), np.inf, radius)
                if whole.jumps is not None:
                    radius = np.where(whole.jumps, np.inf, radius)
                values = np.where(np.isnan(whole.radius) | ~np.isfinite(point.middle), np.inf, whole.radius)
                radius = np.fmin(_up(radius), values)
                balls.append(Ball(point.middle, np.broadcast_to(radius, np.shape(point.middle)), whole.jumps))
            return jax.tree.unflatten(self._tree, balls)


def _up(radius: Any) -> Any:
    """A radius that a few roundings have not made too small."""
    return radius * (1 + 8 * _UNIT) + _TINY


def _evaluated(closed: Any, arguments: Sequence[Ball]) -> list[Ball]:
    """The results of a traced function on balls."""
    jaxpr = closed.jaxpr
    known: dict[Any, Ball] = {v: Ball(np.asarray(c), 0.0) for v, c in zip(jaxpr.constvars, closed.consts, strict=True)}
    known |= dict(zip(jaxpr.invars, arguments, strict=True))

    def of(atom: Any) -> Ball:
        return Ball(np.asarray(atom.val), 0.0) if isinstance(atom, Literal) else known[atom]

    for equation in _needed(jaxpr):
        name, given = equation.primitive.name, [of(atom) for atom in equation.invars]
        if equation.params.get("name") == FREE_SIGN:
            # Nothing hangs on the choice, so that it may be that of the middle all over the box.
            known[equation.outvars[0]] = Ball(np.where(given[0].middle < 0, -1.0, 1.0), 0.0)
            continue
        inner = None
        if name in _CALLS:
            inner = next((equation.params[key] for key in ("jaxpr", "call_jaxpr") if key in equation.params), None)
        if inner is not None:
            results = _evaluated(inner, given)
        elif all(_is_exact(ball) for ball in given) and (name == "gather" or all(_is_whole(ball) for ball in given)):
            results = [Ball(np.asarray(equation.primitive.bind(*(b.middle for b in given), **equation.params)), 0.0)]
        elif name in _RULES:
            result = _RULES[name](equation.params, *given)
            results = [result._replace(jumps=_any((result, *given)))]
        elif name in _MOVES:
            results = [_moved(_MOVES[name], equation.params, given)]
        else:
            raise NotImplementedError(f"no bounds are known for the operation {name}")
        known |= dict(zip(equation.outvars, results, strict=True))
    return [of(atom) for atom in jaxpr.outvars]


def _needed(jaxpr: Any) -> list[Any]:
    """The equations on which the results hang."""
    wanted = {v for v in jaxpr.outvars if not isinstance(v, Literal)}
    found = []
    for equation in reversed(jaxpr.eqns):
        if wanted.intersection(equation.outvars):
            found.append(equation)
            wanted.update(v for v in equation.invars if not isinstance(v, Literal))
    return found[::-1]


def _rounded(middle: Any, radius: Any, unit: float = _UNIT) -> Ball:
    return Ball(middle, radius * (1 + 8 * _UNIT) + (np.abs(middle) * unit + _TINY))


def _sum(_: Any, a: Ball, b: Ball) -> Ball:
    return _rounded(a.middle + b.middle, a.radius + b.radius)


def _difference(_: Any, a: Ball, b: Ball) -> Ball:
    return _rounded(a.middle - b.middle, a.radius + b.radius)


def _product(_: Any, a: Ball, b: Ball) -> Ball:
    # A factor of exactly zero annihilates, whatever the other may be.
    radius = np.abs(a.middle) * b.radius + a.radius * (np.abs(b.middle) + b.radius)
    return _rounded(a.middle * b.middle, np.where((_size(a) == 0) | (_size(b) == 0), 0.0, radius))


def _size(a: Ball) -> Any:
    return np.abs(a.middle) + a.radius


def _reciprocal(b: Ball) -> Ball:
    least = np.abs(b.middle) - b.radius
    radius = np.where(least > 0, b.radius / (np.abs(b.middle) * least), np.inf)
    return _rounded(1 / b.middle, radius, 2 * _UNIT)


def _quotient(_: Any, a: Ball, b: Ball) -> Ball:
    return _product(None, a, _reciprocal(b))


def _power(params: Any, a: Ball) -> Ball:
    found, power = a, params["y"]
    if power == 0:
        return Ball(np.ones_like(a.middle), 0.0)
    for _ in range(abs(power) - 1):
        found = _product(None, found, a)
    return found if power > 0 else _reciprocal(found)


def _square(_: Any, a: Ball) -> Ball:
    return _product(None, a, a)


def _root(_: Any, a: Ball) -> Ball:
    root = np.sqrt(a.middle)
    radius = np.where(a.middle > a.radius, a.radius / (root + np.sqrt(a.middle - a.radius)), np.inf)
    return _rounded(root, radius, 2 * _UNIT)


def _sine(_: Any, a: Ball) -> Ball:
    return _rounded(np.sin(a.middle), np.minimum(a.radius, 2.0), _LIBRARY)


def _cosine(_: Any, a: Ball) -> Ball:
    return _rounded(np.cos(a.middle), np.minimum(a.radius, 2.0), _LIBRARY)


def _arctangent(_: Any, y: Ball, x: Ball) -> Ball:
    far, near = np.hypot(y.middle, x.middle), np.hypot(y.radius, x.radius) * (1 + 8 * _UNIT)
    jumps = (x.middle - x.radius <= 0) & (np.abs(y.middle) <= y.radius)
    is_open = jumps | ~(near < far)
    radius = np.where(is_open, 2 * np.pi, np.arcsin(np.minimum(near / far, 1.0)))
    return _rounded(np.arctan2(y.middle, x.middle), radius, _LIBRARY)._replace(jumps=is_open if np.any(is_open) else None)


def _absolute(_: Any, a: Ball) -> Ball:
    return Ball(np.abs(a.middle), a.radius)


def _negative(_: Any, a: Ball) -> Ball:
    return Ball(-a.middle, a.radius)


def _least(_: Any, a: Ball, b: Ball) -> Ball:
    return Ball(np.minimum(a.middle, b.middle), np.maximum(a.radius, b.radius))


def _greatest(_: Any, a: Ball, b: Ball) -> Ball:
    return Ball(np.maximum(a.middle, b.middle), np.maximum(a.radius, b.radius))


def _to_whole(params: Any, a: Ball) -> Ball:
    nearest = np.asarray(np.rint(a.middle))
    is_sure = np.abs(np.subtract(a.middle, nearest)) + a.radius < 0.5
    return Ball(nearest, np.where(is_sure, 0.0, a.radius + 1.0), None if np.all(is_sure) else ~is_sure)


def _sign(_: Any, a: Ball) -> Ball:
    is_sure = (np.abs(a.middle) > a.radius) | ((a.middle == 0) & (np.asarray(a.radius) == 0))
    return Ball(np.sign(a.middle), np.where(is_sure, 0.0, 2.0), None if np.all(is_sure) else ~is_sure)


def _compared(by: Callable[[Any, Any], Any]) -> Callable[..., Ball]:
    def rule(_: Any, a: Ball, b: Ball) -> Ball:
        apart = np.abs(np.subtract(a.middle, b.middle, dtype=float)) > (a.radius + b.radius) * (1 + 8 * _UNIT)
        is_exact = (np.asarray(a.radius) == 0) & (np.asarray(b.radius) == 0)
        return Ball(by(a.middle, b.middle), ~(apart | is_exact))

    return rule


def _of_truths(by: Callable[[Any, Any], Any]) -> Callable[..., Ball]:
    def rule(_: Any, a: Ball, b: Ball) -> Ball:
        return Ball(by(a.middle, b.middle), np.asarray(a.radius, dtype=bool) | np.asarray(b.radius, dtype=bool))

    return rule


def _chosen(_: Any, which: Ball, no: Ball, yes: Ball) -> Ball:
    is_yes, is_open = np.asarray(which.middle, dtype=bool), np.asarray(which.radius, dtype=bool)
    middle, radius = np.where(is_yes, yes.middle, no.middle), np.where(is_yes, yes.radius, no.radius)
    if not is_open.any():
        return Ball(middle, radius)
    other: Any = np.where(is_yes, no.middle, yes.middle)
    its: Any = np.where(is_yes, no.radius, yes.radius)
    reach = np.where(other == middle, its, np.abs(other - middle) * (1 + 8 * _UNIT) + its)
    return Ball(middle, np.where(is_open, np.maximum(radius, reach), radius), is_open)


def _converted(params: Any, a: Ball) -> Ball:
    kind = np.dtype(params["new_dtype"])
    if np.issubdtype(kind, np.bool_):
        return Ball(np.asarray(a.middle).astype(kind), a.radius)
    if kind != np.float64 and not (_is_exact(a) or np.asarray(a.middle).dtype == bool):
        raise NotImplementedError(f"no bounds are known for a conversion to {kind}")
    is_open = np.asarray(a.radius) if np.asarray(a.radius).dtype == bool else np.zeros(())
    return Ball(np.asarray(a.middle).astype(kind), np.asarray(a.radius, dtype=float), is_open if is_open.any() else None)


_CALLS = ("jit", "pjit", "closed_call", "core_call", "custom_jvp_call", "custom_vjp_call", "checkpoint", "remat")
"""Operations that are functions of their own, done once."""

_RULES: dict[str, Callable[..., Ball]] = {
    "add": _sum,
    "add_any": _sum,
    "sub": _difference,
    "mul": _product,
    "div": _quotient,
    "neg": _negative,
    "integer_pow": _power,
    "square": _square,
    "sqrt": _root,
    "sin": _sine,
    "cos": _cosine,
    "atan2": _arctangent,
    "abs": _absolute,
    "min": _least,
    "max": _greatest,
    "round": _to_whole,
    "sign": _sign,
    "lt": _compared(np.less),
    "le": _compared(np.less_equal),
    "gt": _compared(np.greater),
    "ge": _compared(np.greater_equal),
    "eq": _compared(np.equal),
    "ne": _compared(np.not_equal),
    "and": _of_truths(np.logical_and),
    "or": _of_truths(np.logical_or),
    "select_n": _chosen,
    "convert_element_type": _converted,
}


def _spread_out(params: Any, a: Any) -> Any:
    shape = [1] * len(params["shape"])
    for size, axis in zip(a.shape, params["broadcast_dimensions"], strict=True):
        shape[axis] = size
    return np.broadcast_to(a.reshape(shape), params["shape"])


def _sliced(params: Any, a: Any) -> Any:
    strides = params["strides"] or (1,) * a.ndim
    return a[tuple(slice(*ends) for ends in zip(params["start_indices"], params["limit_indices"], strides, strict=True))]


_MOVES: dict[str, Callable[..., Any]] = {
    "broadcast_in_dim": _spread_out,
    "squeeze": lambda params, a: np.squeeze(a, tuple(params["dimensions"])),
    "reshape": lambda params, a: a.reshape(params["new_sizes"]),
    "transpose": lambda params, a: a.transpose(params["permutation"]),
    "slice": _sliced,
    "concatenate": lambda params, *parts: np.concatenate(parts, params["dimension"]),
    "stack": lambda params, *parts: np.stack(parts, params["axis"]),
    "copy": lambda params, a: a,
}
"""What only moves numbers about: done to middles and radii alike."""


def _any(balls: Sequence[Ball]) -> Any:
    """Where any of some numbers may jump."""
    jumping = [ball.jumps for ball in balls if ball.jumps is not None]
    return np.logical_or.reduce(np.broadcast_arrays(*jumping)) if jumping else None


def _is_exact(ball: Ball) -> bool:
    """Whether a number is the same all over a box, and known without rounding."""
    return np.isscalar(ball.radius) and ball.radius == 0


def _is_whole(ball: Ball) -> bool:
    return not np.issubdtype(np.asarray(ball.middle).dtype, np.inexact)


def _moved(move: Callable[..., Any], params: Any, given: Sequence[Ball]) -> Ball:
    middles = [np.asarray(ball.middle) for ball in given]
    if all(_is_exact(ball) for ball in given):
        return Ball(move(params, *middles), 0.0)
    radii = [np.broadcast_to(ball.radius, m.shape) for ball, m in zip(given, middles, strict=True)]
    jumps = None
    if any(ball.jumps is not None for ball in given):
        jumps = move(
            params, *(np.broadcast_to(b.jumps is not None and b.jumps, m.shape) for b, m in zip(given, middles, strict=True))
        )
    return Ball(move(params, *middles), move(params, *radii), jumps)
