"""Loop closure: the joint coordinates of one chain at a platform pose, by least squares on the walk down the chain.

For chains which no leg family solves, and as an independent check of those which one does.  The unknowns are all coordinates
of all joints; the frame at the end of the chain must coincide with the frame of the platform joint, in place and in turn.
Lengths count in units of the chain's size, so that they compare with angles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError, NoResultError
from trivet.kinematics.travel import gauges_along
from trivet.kinematics.walk import Coordinate, Posture, walk_from
from trivet.model import Leg, Machine
from trivet.model.elements import Curvilinear, Drivable, Element, Prismatic
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.pose import zyz_frame
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

Array: TypeAlias = Any
Numbers: TypeAlias = Mapping[str, Sequence[float]]
"""Coordinates as plain numbers by the names of the joints: m and rad."""

CLOSED = 1e-9
"""Greatest gap of a closed chain, relative to its size; rounding leaves about 1e-15."""

SEEDS = 24
"""Random starts, tried in a fixed order after the middle of the travel."""


class Closure(NamedTuple):
    """How one chain stands when it closes."""

    coordinates: tuple[Coordinate, ...]
    """One per element, as `Element.advance` takes them when the walk starts in `Leg.base_frame`."""
    numbers: dict[str, tuple[float, ...]]
    """The same as plain numbers by the names of the joints: m, and rad in (-pi, pi]."""
    residual: float
    """Gap that remains, m: distance, and turn times the chain's size."""
    excess: float
    """How far the worst joint is outside its travel, as a fraction of that travel; zero or less inside."""

    @property
    def inside(self) -> bool:
        """Whether every limited joint is inside its travel."""
        return self.excess <= 0


class _Loop(NamedTuple):
    """One closure problem: gap (12,) and its Jacobian (12, n) as functions of the unknowns (n,), all dimensionless."""

    gap: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    size: float
    seat: Frame
    """The platform joint's frame in {O}."""


def close_machine(machine: Machine, pose: Frame) -> tuple[Closure, ...]:
    """Every chain of a machine at a pose, led there from home where that stays inside the travels.

    Args:
        machine: the machine.
        pose: platform frame {E} in {O}, of floats (m).

    Raises:
        NoResultError: as `close_chain`.
    """
    home = zyz_frame(machine.home.position, machine.home.azimuth, machine.home.tilt, machine.home.roll)
    found = []
    for leg in machine.legs:
        try:
            led = [close_chain(leg, pose, close_chain(leg, home).numbers)]
        except NoResultError:
            led = []
        if not led or not led[0].inside:
            led.append(close_chain(leg, pose))
        found.append(min(led, key=lambda closure: max(closure.excess, 0.0)))
    return tuple(found)


def close_chain(leg: Leg, pose: Frame, start: Numbers | None = None) -> Closure:
    """The coordinates with which a chain reaches its platform joint.

    A chain with more freedoms than six closes in many ways; of these, one is found whose actuated joints are nearest to the
    start (locally least sum of squares, lengths in units of the chain's size).

    Args:
        leg: the chain.
        pose: platform frame {E} in {O}, of floats (m).
        start: coordinates from which to search, as `Closure.numbers`.  When not given, the middle of the travel and then
            fixed random starts are tried until a solution inside the travel is found; failing that, the one least outside.

    Raises:
        InputError: when `start` does not fit the chain.
        NoResultError: with the chain and the smallest gap found, when it does not close.
    """
    loop = _loop(leg, pose)
    outside: list[Closure] = []
    gap = math.inf
    for guess in _guesses(leg, pose) if start is None else [_from_numbers(leg.chain.elements, start)]:
        origin = _scaled(leg.chain.elements, guess, 1 / loop.size)
        unknowns = _solve(loop, origin)
        if _size(loop.gap(unknowns)) < CLOSED:
            unknowns = _nearest(loop, unknowns, origin, _driven(leg.chain.elements))
        closure = _closure(leg, loop, unknowns)
        gap = min(gap, closure.residual)
        if closure.residual < CLOSED * loop.size:
            if closure.inside or start is not None:
                return closure
            outside.append(closure)
    if not outside:
        raise NoResultError(f"chains.{leg.name}: does not reach this pose; a gap of {gap * 1e3:.3g} mm remains")
    return min(outside, key=lambda closure: closure.excess)


def posture_of(leg: Leg, pose: Frame, closure: Closure) -> Posture:
    """A chain that was closed numerically as a posture; its walk is written in the axes of its base."""
    base, end = leg.base_frame(), pose.shift(leg.platform_frame().origin).origin
    local = end - base.origin
    seen = Vec(local @ base.x, local @ base.y, local.z)
    heading = Angle(base.x.x, base.x.y)
    return Posture(heading, IDENTITY, seen, closure.coordinates, closure.coordinates, math.inf)


def coordinates_from(elements: tuple[Element, ...], numbers: Array) -> tuple[Coordinate, ...]:
    """Coordinates as `Element.advance` takes them, from one flat array (n,) in m and rad."""
    found: list[Coordinate] = []
    values = iter(range(numbers.shape[0]))
    for element in elements:
        if isinstance(element, Drivable) and element.locked is not None:
            found.append(_coordinate(element.COORDINATES[0], element.locked))
            continue
        own = tuple(_coordinate(kind, numbers[next(values)]) for kind in element.unknowns)
        found.append(None if not own else own[0] if len(own) == 1 else own)
    return tuple(found)


def _coordinate(kind: str, value: Scalar) -> Scalar | Angle:
    return Angle(jnp.cos(value), jnp.sin(value)) if kind == "angle" else value


def end_frame(elements: tuple[Element, ...], base: Frame, coordinates: tuple[Coordinate, ...]) -> Frame:
    """The frame beyond the last element, in the axes in which `base` is written."""
    last, frame, coordinate = walk_from(base, elements, coordinates)[-1]
    return last.advance(frame, coordinate)


def _loop(leg: Leg, pose: Frame) -> _Loop:
    elements, base, target = _numeric(leg.chain.elements), leg.base_frame(), pose.place(leg.platform_frame())
    size = math.dist([float(c) for c in base.origin], [float(c) for c in target.origin])
    joint = leg.chain.platform_joint.radius
    size = max(size, float(joint), 1e-6)  # a chain that starts in its platform joint has a size all the same
    arguments = (elements, _numeric(base), _numeric(target), jnp.asarray(size))
    return _Loop(
        lambda unknowns: np.asarray(_gap(unknowns, *arguments)),
        lambda unknowns: np.asarray(_gap_slope(unknowns, *arguments)),
        size,
        target,
    )


def _numeric(tree: Any) -> Any:
    """Dimensions as arrays: traced, not compiled in."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), tree)


def _gap_of(unknowns: Array, elements: tuple[Element, ...], base: Frame, target: Frame, size: Scalar) -> Array:
    """Distance over size (3) and differences of the axes (9): twelve numbers for six conditions, but none of them ambiguous."""
    end = end_frame(elements, base, coordinates_from(elements, _scaled(elements, unknowns, size)))
    apart = [(a - b) / size for a, b in zip(end.origin, target.origin, strict=True)]
    turned = [a - b for own, other in zip(end[1:], target[1:], strict=True) for a, b in zip(own, other, strict=True)]
    return jnp.stack(jnp.broadcast_arrays(*apart, *turned))


_gap = eqx.filter_jit(_gap_of)
_gap_slope = eqx.filter_jit(jax.jacfwd(_gap_of))


def _kinds(elements: tuple[Element, ...]) -> list[str]:
    return [kind for element in elements for kind in element.unknowns]


def _scaled(elements: tuple[Element, ...], unknowns: Array, factor: Scalar) -> Array:
    """Lengths times a factor, angles as they are."""
    is_length = np.array([kind == "length" for kind in _kinds(elements)])
    return jnp.where(is_length, unknowns * factor, unknowns)


def _driven(elements: tuple[Element, ...]) -> Array:
    return np.array([isinstance(e, Drivable) and e.is_driven for e in elements for _ in e.unknowns], dtype=float)


def _size(vector: Array) -> float:
    return float(np.linalg.norm(vector))


def _solve(loop: _Loop, origin: Array) -> Array:
    """The unknowns of the smallest gap that a search from `origin` finds."""
    from scipy.optimize import least_squares

    method = "lm" if origin.size <= 12 else "trf"  # MINPACK's LM wants no more unknowns than equations
    to_rounding = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    found = least_squares(loop.gap, np.asarray(origin), jac=loop.slope, method=method, max_nfev=400, **to_rounding)
    return _newton(loop, found.x)


def _newton(loop: _Loop, unknowns: Array) -> Array:
    """A closed chain closed to rounding; Newton steps of least length, kept while they narrow the gap."""
    gap = loop.gap(unknowns)
    for _ in range(8):
        closer = unknowns - np.linalg.lstsq(loop.slope(unknowns), gap, rcond=1e-9)[0]
        narrower = loop.gap(closer)
        if not _size(narrower) < _size(gap):
            break
        unknowns, gap = closer, narrower
    return unknowns


def _nearest(loop: _Loop, unknowns: Array, origin: Array, weights: Array) -> Array:
    """Of the closed chains around a closed chain, the one whose weighted unknowns are nearest to `origin`.

    Steps in the null space of the Jacobian towards `origin`, each closed again and halved until it comes nearer; a chain
    without more freedoms than conditions stays as it is.
    """
    for _ in range(100):
        _, values, rows = np.linalg.svd(loop.slope(unknowns))
        null = rows[int(np.sum(values > 1e-7 * values[0])) :].T
        wanted = weights * (np.asarray(origin) - unknowns)
        step = null @ np.linalg.lstsq(weights[:, None] * null, wanted, rcond=1e-7)[0] if null.size else np.zeros_like(unknowns)
        factor = 1.0
        while factor * _size(step) > 1e-12:
            nearer = _newton(loop, unknowns + factor * step)
            if _size(loop.gap(nearer)) < CLOSED and _size(weights * (nearer - origin)) < _size(wanted):
                break
            factor /= 2
        else:
            break
        unknowns = nearer
    return unknowns


def _closure(leg: Leg, loop: _Loop, unknowns: Array) -> Closure:
    elements = leg.chain.elements
    values = [
        math.remainder(v, 2 * math.pi) if kind == "angle" else float(v)
        for kind, v in zip(_kinds(elements), _scaled(elements, unknowns, loop.size).tolist(), strict=True)
    ]
    numbers, rest = {}, list(values)
    for element in elements:
        if element.unknowns:
            numbers[element.name], rest = tuple(rest[: len(element.unknowns)]), rest[len(element.unknowns) :]
    coordinates = coordinates_from(elements, np.array(values))
    steps = walk_from(leg.base_frame(), elements, coordinates)
    limited = gauges_along(leg, steps, coordinates, loop.seat)
    excess = [float(max(g.low - g.value, g.value - g.high) / (g.high - g.low)) for g in limited]
    return Closure(coordinates, numbers, _size(loop.gap(unknowns)) * loop.size, max(excess, default=-math.inf))


def _from_numbers(elements: tuple[Element, ...], numbers: Numbers) -> Array:
    wanted = {e.name: len(e.unknowns) for e in elements if e.unknowns}
    if {name: len(values) for name, values in numbers.items()} != wanted:
        listed = ", ".join(f"{name} ({count})" for name, count in wanted.items())
        raise InputError(f"start: expected the coordinates of {listed}; got {', '.join(numbers) or 'none'}")
    return np.array([value for name in wanted for value in numbers[name]], dtype=float)


def _guesses(leg: Leg, pose: Frame) -> Iterator[Array]:
    """The middle of the travel, then random places inside it; m and rad."""
    ranges = np.array([r for e in leg.chain.elements for r in _ranges(leg, e, pose)])
    low, high = ranges[:, 0], ranges[:, 1]
    yield (low + high) / 2
    random = np.random.default_rng(0)
    for _ in range(SEEDS):
        yield random.uniform(low, high)


def _ranges(leg: Leg, element: Element, pose: Frame) -> list[tuple[float, float]]:
    """Where to start each coordinate of an element: in its travel, or around where the platform joint seems to want it."""
    if not element.unknowns:
        return []
    travel = getattr(element, "travel", None)
    if travel is not None and getattr(element, "measure", "angle") == "angle":
        return [(float(travel[0]), float(travel[1]))]
    base, end = leg.base_frame(), pose.place(leg.platform_frame()).origin
    towards = end - base.origin
    if isinstance(element, Prismatic):
        return [(0.0, float(math.sqrt(towards @ towards)))]
    if isinstance(element, Curvilinear):
        azimuth = math.atan2(towards @ base.y, towards @ base.x)
        return [(azimuth - math.pi, azimuth + math.pi)]
    return [(-math.pi, math.pi)] * len(element.unknowns)
