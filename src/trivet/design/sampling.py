"""Points of the unit cube by their index, at once and in constant memory: the same whichever of them are asked for together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from trivet.errors import InputError

Array = NDArray[Any]
Method = Literal["grid", "latin-hypercube", "sobol", "random"]

MOST = 1_000_000_000
"""Points of a sampling."""
SOBOL_BITS = 30
"""Binary digits of the points of a Sobol sequence, as SciPy has them by default; it has 2^30 of them."""
SOBOL_DIMENSIONS = 21_201
"""Of which directions are known."""
JITTER_BITS = 22
"""Binary digits of a place within a stratum: with the 30 of its number they fit the 53 of a float64."""
ROUNDS = 8
"""Of a permutation: as many shifts of one part of a number by a hash of the other."""
RANDOM, JITTER, KEYS = range(3)
"""Streams of random numbers that have one seed."""


class Sampling(Protocol):
    """Points by their index."""

    @property
    def count(self) -> int:
        """How many there are."""

    @property
    def dimensions(self) -> int:
        """Of each point, d."""

    def points(self, start: int, stop: int) -> Array:
        """Those from an index to before another, (stop - start, d)."""


def sampling(method: Method, dimensions: int, count: int | None, seed: int = 0, steps: Sequence[int] = ()) -> Sampling:
    """A sampling as a study file names it.

    Args:
        method: how points are laid.
        dimensions: of each point.
        count: number of points; that of a grid follows from its steps.
        seed: of what is random; a grid has none.
        steps: of a grid, one for each dimension.

    Raises:
        InputError: for wrong counts.
    """
    if method == "grid":
        if count is not None:
            raise InputError(f"count: {count}; that of a grid follows from the steps of its variables, leave it out")
        return Grid(tuple(steps))
    if count is None:
        raise InputError(f'count: is missing; method = "{method}" needs the number of designs')
    kinds: dict[str, type[LatinHypercube | Sobol | Random]] = {
        "latin-hypercube": LatinHypercube,
        "sobol": Sobol,
        "random": Random,
    }
    return kinds[method](count, dimensions, seed)


@dataclass(frozen=True)
class Grid:
    """All levels of each dimension with all of the others, the last dimension fastest.

    Levels are equally spaced in [0, 1], both ends included; a single one is 1/2.
    """

    steps: tuple[int, ...]

    def __post_init__(self) -> None:
        _check(self.count, len(self.steps), "steps")

    @property
    def count(self) -> int:
        return math.prod(self.steps)

    @property
    def dimensions(self) -> int:
        return len(self.steps)

    def points(self, start: int, stop: int) -> Array:
        levels = np.unravel_index(_indices(self, start, stop), self.steps)
        columns = [level / (n - 1) if n > 1 else np.full(len(level), 0.5) for level, n in zip(levels, self.steps, strict=True)]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True)
class Random:
    """Independent uniform points in [0, 1): the doubles of a counter-based generator (Philox), in their order."""

    count: int
    dimensions: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self.count, self.dimensions)

    def points(self, start: int, stop: int) -> Array:
        _indices(self, start, stop)
        return (_words(self, RANDOM, start, stop) >> np.uint64(11)) * 2.0**-53


@dataclass(frozen=True)
class LatinHypercube:
    """Points in [0, 1), in each dimension one in each of as many strata as there are points, anywhere in its stratum.

    The strata of a dimension are taken in the order of a permutation that is worked out number by number: a Feistel network
    over pairs of residues, walked on until it is back among the numbers of strata (Black and Rogaway 2002).
    """

    count: int
    dimensions: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self.count, self.dimensions)

    def points(self, start: int, stop: int) -> Array:
        numbers = _indices(self, start, stop).astype(np.uint64)
        keys = np.random.Philox(key=_key(self.seed, KEYS)).random_raw(ROUNDS * self.dimensions)
        strata = np.stack([_permuted(numbers, self.count, own) for own in keys.reshape(-1, ROUNDS)], axis=-1)
        jitter = _words(self, JITTER, start, stop) >> np.uint64(64 - JITTER_BITS)
        return (strata + (jitter + 0.5) * 2.0**-JITTER_BITS) / self.count


@dataclass(frozen=True)
class Sobol:
    """The scrambled Sobol sequence of SciPy, in [0, 1).

    With a number of points that is no power of two, the points of a dimension are no longer one to a stratum, and errors of
    means of smooth functions fall as 1/n at best rather than n^-3/2.  Points are affine in the Gray code of their index over
    the field of two elements: the origin and one direction for each binary digit tell all of them.  SciPy is walked to those
    once per process, in a time that grows with the number of points (20 s for half a billion of them in 200 dimensions).
    """

    count: int
    dimensions: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self.count, self.dimensions)
        if self.dimensions > SOBOL_DIMENSIONS:
            raise InputError(f'dimensions: {self.dimensions}; method = "sobol" has at most {SOBOL_DIMENSIONS}; take "random"')

    def points(self, start: int, stop: int) -> Array:
        indices = _indices(self, start, stop).astype(np.uint64)
        gray = indices ^ (indices >> np.uint64(1))
        origin, directions = _directions(max(self.count - 1, 0).bit_length(), self.dimensions, self.seed)
        found = np.broadcast_to(origin, (len(gray), self.dimensions)).copy()
        for digit, direction in enumerate(directions):
            found ^= ((gray >> np.uint64(digit)) & np.uint64(1))[:, None] * direction
        return found * 2.0**-SOBOL_BITS


@dataclass(frozen=True)
class Saltelli:
    """Points for Sobol indices of d variables, as SALib.analyze.sobol takes them without second order.

    Halves A and B of the points of a sequence of 2 d dimensions: for each of them A, then for each variable A with that
    variable from B, then B, hence d + 2 rows (Saltelli et al. 2010).
    """

    base: int
    """Points of the sequence; a power of two is best."""
    dimensions: int
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self.count, self.dimensions, f"count: {self.base}, with {self.dimensions + 2} designs of each")

    @property
    def count(self) -> int:
        return self.base * (self.dimensions + 2)

    @cached_property
    def _sequence(self) -> Sobol:
        return Sobol(self.base, 2 * self.dimensions, self.seed)

    def points(self, start: int, stop: int) -> Array:
        sample, row = np.divmod(_indices(self, start, stop), self.dimensions + 2)
        first = int(sample[0]) if len(sample) else 0
        both = self._sequence.points(first, first + len(np.unique(sample)))[sample - first]
        a, b = np.split(both, 2, axis=1)
        is_from_b = (row[:, None] == np.arange(1, self.dimensions + 1)) | (row[:, None] == self.dimensions + 1)
        return np.where(is_from_b, b, a)


def _check(count: int, dimensions: int, told: str = "") -> None:
    if not 1 <= count <= MOST:
        raise InputError(f"{told or 'count'}: {count} designs; expected 1 to {MOST}")
    if dimensions < 1:
        raise InputError(f"dimensions: {dimensions}; expected at least 1")


def _indices(own: Sampling, start: int, stop: int) -> Array:
    if not 0 <= start <= stop <= own.count:
        raise ValueError(f"points {start} to {stop} of {own.count}")
    return np.arange(start, stop)


def _key(seed: int, stream: int) -> Array:
    return np.array([seed, stream], dtype=np.uint64)


def _words(own: Random | LatinHypercube, stream: int, start: int, stop: int) -> Array:
    """Random words of 64 bits, (stop - start, d): Philox makes four of them from each number that it counts."""
    first, last = start * own.dimensions, stop * own.dimensions
    generator = np.random.Philox(key=_key(own.seed, stream), counter=first // 4)
    skipped = first % 4
    words: Array = generator.random_raw(skipped + last - first)[skipped:]
    return words.reshape(-1, own.dimensions)


def _permuted(numbers: Array, count: int, keys: Array) -> Array:
    """Where a permutation of 0 … count - 1 takes numbers."""
    high = math.isqrt(count - 1) + 1
    low = -(-count // high)
    found = _shuffled(numbers, high, low, keys)
    while np.any(outside := found >= count):
        found[outside] = _shuffled(found[outside], high, low, keys)
    return found


def _shuffled(numbers: Array, high: int, low: int, keys: Array) -> Array:
    """A permutation of 0 … high low - 1: of the two digits of a number, in turn one is shifted by a hash of the other."""
    left, right = np.divmod(numbers, np.uint64(low))
    for k, key in enumerate(keys):
        if k % 2:
            right = (right + _hashed(left ^ key) % np.uint64(low)) % np.uint64(low)
        else:
            left = (left + _hashed(right ^ key) % np.uint64(high)) % np.uint64(high)
    return left * np.uint64(low) + right


def _hashed(words: Array) -> Array:
    """The finalizer of SplitMix64 (Steele, Lea and Flood 2014), modulo 2^64."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        words = (words ^ (words >> np.uint64(shift))) * np.uint64(factor)
    return words ^ (words >> np.uint64(31))


@cache
def _directions(digits: int, dimensions: int, seed: int) -> tuple[Array, Array]:
    """Origin (d,) and directions (digits, d) of a scrambled Sobol sequence, integers."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(dimensions, scramble=True, bits=SOBOL_BITS, rng=seed)

    def point(index: int) -> Array:
        """A later one: the Gray code of 2^(b+1) - 1 has digit b alone."""
        if index > sequence.num_generated:
            sequence.fast_forward(index - sequence.num_generated)
        return (sequence.random(1)[0] * 2.0**SOBOL_BITS).astype(np.uint64)

    origin = point(0)
    directions = [point(2 ** (digit + 1) - 1) ^ origin for digit in range(digits)]
    return origin, np.array(directions, dtype=np.uint64).reshape(digits, dimensions)
