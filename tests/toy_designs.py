"""Problems in closed form, as those of designs are asked: rows in JAX, each number the greatest of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import trivet.space.scalar  # noqa: F401  (double precision)
from trivet.design.front.problem import Array, Values


@dataclass(frozen=True)
class Rows:
    owner: Array
    of: Callable[[Any], Any]
    by: Callable[[Any], Any]

    def rows(self, design: Array) -> Array:
        return np.asarray(self.of(design))

    def slopes(self, design: Array) -> Array:
        return np.asarray(self.by(design))


@dataclass
class Toy:
    """Objectives and constraints by lists of rows, `kernel(x) -> ((row, ...), ...)`, objectives first."""

    kernel: Callable[[Any], Any]
    low: Array
    high: Array
    objectives: tuple[str, ...] = ("f1", "f2")
    constraints: tuple[str, ...] = ()
    discrete: tuple[tuple[float, ...] | None, ...] = ()
    batches: list[int] = field(default_factory=list)
    """Sizes of what was asked for."""

    def __post_init__(self) -> None:
        self.low, self.high = np.asarray(self.low, float), np.asarray(self.high, float)
        self.discrete = self.discrete or (None,) * len(self.low)

    @property
    def variables(self) -> tuple[str, ...]:
        return tuple(f"x{i + 1}" for i in range(len(self.low)))

    @cached_property
    def _owner(self) -> Array:
        parts = jax.eval_shape(self.kernel, jnp.asarray(self.low))
        return np.repeat(np.arange(len(parts)), [len(part) for part in parts])

    @cached_property
    def _rows(self) -> Callable[[Any], Any]:
        return jax.jit(lambda x: jnp.stack([jnp.asarray(row, float) for part in self.kernel(x) for row in part]))

    @cached_property
    def _many(self) -> Callable[[Any], Any]:
        return jax.jit(jax.vmap(self._rows))

    @cached_property
    def _slopes(self) -> Callable[[Any], Any]:
        return jax.jit(jax.jacfwd(self._rows))

    def values(self, designs: Array) -> Values:
        self.batches.append(len(designs))
        rows, count = np.asarray(self._many(designs)), len(self.objectives) + len(self.constraints)
        both = np.stack([rows[:, self._owner == i].max(axis=1) for i in range(count)], axis=1)
        return Values(both[:, : len(self.objectives)], both[:, len(self.objectives) :])

    def model(self, design: Array) -> Rows:
        return Rows(self._owner, self._rows, self._slopes)

    def missed(self, constraint: int, value: float) -> str:
        return f"'{self.constraints[constraint]}' by {value:.3g}"


def zdt1(variables: int = 8) -> Toy:
    """Front: f2 = 1 - sqrt(f1), all variables but the first zero (E. Zitzler, K. Deb and L. Thiele, 2000)."""

    def kernel(x: Any) -> Any:
        g = 1 + 9 * jnp.mean(x[1:])
        return (x[0],), (g * (1 - jnp.sqrt((x[0] + 1e-12) / g)),)

    return Toy(kernel, np.zeros(variables), np.ones(variables))


def zdt3(variables: int = 8) -> Toy:
    """Front in five pieces (same source)."""

    def kernel(x: Any) -> Any:
        g = 1 + 9 * jnp.mean(x[1:])
        ratio = (x[0] + 1e-12) / g
        return (x[0],), (g * (1 - jnp.sqrt(ratio) - ratio * jnp.sin(10 * jnp.pi * x[0])),)

    return Toy(kernel, np.zeros(variables), np.ones(variables))


def binh_korn() -> Toy:
    """Front: x1 = x2 up to 3, then x2 = 3 (T. Binh and U. Korn, 1997)."""

    def kernel(x: Any) -> Any:
        f = (4 * x[0] ** 2 + 4 * x[1] ** 2,), ((x[0] - 5) ** 2 + (x[1] - 5) ** 2,)
        return *f, (((x[0] - 5) ** 2 + x[1] ** 2) / 25 - 1,), (1 - ((x[0] - 8) ** 2 + (x[1] + 3) ** 2) / 7.7,)

    return Toy(kernel, [0, 0], [5, 3], constraints=("inside", "outside"))


def osy() -> Toy:
    """Six variables, six constraints, a front in pieces at active ones (A. Osyczka and S. Kundu, 1995)."""

    def kernel(x: Any) -> Any:
        a, b, c, d, e, f = x
        first = -(25 * (a - 2) ** 2 + (b - 2) ** 2 + (c - 1) ** 2 + (d - 4) ** 2 + (e - 1) ** 2)
        met = ((2 - a - b) / 2,), ((a + b - 6) / 6,), ((b - a - 2) / 2,), ((a - 3 * b - 2) / 2,)
        return (first,), (jnp.sum(x**2),), *met, (((c - 3) ** 2 + d - 4) / 4,), ((4 - (e - 3) ** 2 - f) / 4,)

    names = ("least sum", "greatest sum", "b - a", "a - 3b", "c and d", "e and f")
    return Toy(kernel, [0, 0, 1, 0, 1, 0], [10, 10, 5, 6, 5, 10], constraints=names)


def cantilever() -> Toy:
    """Volume and tip deflection of a beam in five steps (P. B. Thanedar and G. N. Vanderplaats, 1995)."""
    force, step, modulus, stress = 50e3, 100.0, 20e6, 14e3
    arms = step * np.arange(5, 0, -1)
    cubes = (arms**3 - (arms - step) ** 3) / 3

    def kernel(x: Any) -> Any:
        width, height = x[:5], x[5:]
        sag = force / modulus * jnp.sum(cubes * 12 / (width * height**3))
        bent = 6 * force * arms / (width * height**2) / stress - 1
        return (step * jnp.sum(width * height) / 1e4,), (sag,), tuple(bent), tuple(height / width / 20 - 1)

    names = ("volume", "deflection")
    return Toy(kernel, [1.0] * 5 + [5.0] * 5, [5.0] * 5 + [65.0] * 5, names, ("stress", "slenderness"))


def truss(most: float | None = None, areas: tuple[float, ...] | None = None) -> Toy:
    """Two bars that share a load (as of J. Palli and others, 1999): volume, and the greater of two stresses.

    Both bars are stressed alike in the best: y = 2, volume times stress = 400, areas x1 = 10 sqrt(20) / stress and
    x2 = 40 sqrt(5) / stress.  With `most` the stress is a constraint instead.
    """

    def kernel(x: Any) -> Any:
        first, second, y = x
        long, short = jnp.sqrt(16 + y**2), jnp.sqrt(1 + y**2)
        volume = first * long + second * short
        stresses = 20 * long / (y * first), 80 * short / (y * second)
        if most is None:
            return (volume,), stresses
        return (volume,), tuple(stress / most - 1 for stress in stresses)

    ends, discrete = ([0.05, 0.05, 1.0], [3.0, 6.0, 3.0]), (areas, None, None)
    if most is None:
        return Toy(kernel, *ends, ("volume", "stress"), discrete=discrete)
    return Toy(kernel, *ends, ("volume",), ("stress",), discrete)


def vessel() -> Toy:
    """Cost of a vessel whose walls come in sixteenths of an inch (E. Sandgren, 1990).

    The best of all costs 6059.714335 with walls of 13 and 7 sixteenths (X.-S. Yang and others, 2013).
    """

    def kernel(x: Any) -> Any:
        wall, end, radius, length = x
        cost = 0.6224 * wall * radius * length + 1.7781 * end * radius**2 + 3.1661 * wall**2 * length + 19.84 * wall**2 * radius
        held = jnp.pi * radius**2 * length + 4 / 3 * jnp.pi * radius**3
        return (cost,), (0.0193 * radius / wall - 1,), (0.00954 * radius / end - 1,), (1 - held / 1296000,), (length / 240 - 1,)

    walls = tuple(np.arange(1, 100) / 16)
    names = ("wall", "end", "volume", "length")
    return Toy(kernel, [0, 0, 10, 10], [9, 9, 200, 200], ("cost",), names, (walls, walls, None, None))


def welded() -> Toy:
    """Cost of a welded beam (K. M. Ragsdell and D. T. Phillips, 1976), at best 1.724852309 (as others found)."""

    def kernel(x: Any) -> Any:
        weld, length, height, width = x
        arm = jnp.sqrt(length**2 / 4 + ((weld + height) / 2) ** 2)
        polar = 2 * jnp.sqrt(2) * weld * length * (length**2 / 12 + ((weld + height) / 2) ** 2)
        direct, turning = 6000 / (jnp.sqrt(2) * weld * length), 6000 * (14 + length / 2) * arm / polar
        shear = jnp.sqrt(direct**2 + direct * turning * length / arm + turning**2)
        buckling = 4.013 * 30e6 * height * width**3 / 6 / 14**2 * (1 - height / 28 * jnp.sqrt(30e6 / 48e6))
        cost = 1.10471 * weld**2 * length + 0.04811 * height * width * (14 + length)
        bent, sag = 6 * 6000 * 14 / (width * height**2), 4 * 6000 * 14**3 / (30e6 * height**3 * width)
        met = shear / 13600 - 1, bent / 30000 - 1, weld / width - 1, sag / 0.25 - 1, 1 - buckling / 6000
        return (cost,), *((one,) for one in met)

    return Toy(kernel, [0.1] * 4, [2, 10, 10, 2], ("cost",), ("shear", "bending", "weld", "sag", "buckling"))


def valley() -> Toy:
    """Rosenbrock's function under a cubic and a line: a wide basin about zero, and the best, zero, in a corner at (1, 1)."""

    def kernel(x: Any) -> Any:
        value = (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2
        return (value,), ((x[0] - 1) ** 3 - x[1] + 1,), (x[0] + x[1] - 2,)

    return Toy(kernel, [-1.5, -0.5], [1.5, 2.5], ("value",), ("cubic", "line"))
