"""Statistics of a comparison: moments of a sample, Welch's test, Holm's correction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray


@dataclass(frozen=True)
class Moments:
    """A sample in short; the variance is the population's (divisor n), as in the paper's tables."""

    n: int
    mean: float
    variance: float
    least: float
    greatest: float


def moments(sample: NDArray[Any]) -> Moments:
    """Moments of a sample of at least one value."""
    return Moments(sample.size, float(sample.mean()), float(sample.var()), float(sample.min()), float(sample.max()))


@dataclass(frozen=True)
class WelchTest:
    """Welch's two-tailed test of the null hypothesis that two samples have one mean."""

    first: str
    second: str
    quantity: str
    difference: float
    """Mean of the first less mean of the second."""
    t: float
    freedom: float
    """Degrees of freedom (Welch-Satterthwaite)."""
    p: float
    p_holm: float
    """p after Holm's correction over the whole family of tests."""
    effect: float
    """Hedges' g: the difference over the pooled standard deviation, corrected for small samples."""


def welch(first: Moments, second: Moments) -> tuple[float, float, float, float]:
    """t, degrees of freedom, two-tailed p and Hedges' g (Welch 1947; Hedges 1981), with variances by divisor n - 1.

    Two constant samples have t = 0 and p = 1 when they are equal, else infinite t and p = 0; a sample of one has no
    variance and gives NaN.
    """
    from scipy.special import stdtr  # late; scipy.stats is a second slower to import than the one function needs

    if min(first.n, second.n) < 2:
        return (math.nan,) * 4
    a, b = (m.variance * m.n / (m.n - 1) for m in (first, second))
    difference = first.mean - second.mean
    square = a / first.n + b / second.n
    pooled = ((first.n - 1) * a + (second.n - 1) * b) / (first.n + second.n - 2)
    if square == 0:
        same = difference == 0
        return (
            (0.0 if same else math.copysign(math.inf, difference)),
            math.nan,
            float(same),
            0.0 if same else math.copysign(math.inf, difference),
        )
    t = difference / math.sqrt(square)
    freedom = square**2 / ((a / first.n) ** 2 / (first.n - 1) + (b / second.n) ** 2 / (second.n - 1))
    small = 1 - 3 / (4 * (first.n + second.n) - 9)
    return t, freedom, float(2 * stdtr(freedom, -abs(t))), difference / math.sqrt(pooled) * small


def holm(p: list[float]) -> list[float]:
    """p values corrected over their whole family (Holm 1979); NaN stays NaN and does not count."""
    order = sorted((i for i, v in enumerate(p) if not math.isnan(v)), key=lambda i: p[i])
    corrected = [math.nan] * len(p)
    highest = 0.0
    for rank, i in enumerate(order):
        highest = max(highest, min(1.0, p[i] * (len(order) - rank)))
        corrected[i] = highest
    return corrected


def every_pair(samples: dict[str, dict[str, Moments]]) -> list[WelchTest]:
    """Every pair of machines on every quantity: samples[machine][quantity]."""
    names = list(samples)
    cases = [(a, b, q) for i, a in enumerate(names) for b in names[i + 1 :] for q in samples[a]]
    found = [welch(samples[a][q], samples[b][q]) for a, b, q in cases]
    corrected = holm([p for _, _, p, _ in found])
    return [
        WelchTest(a, b, q, samples[a][q].mean - samples[b][q].mean, t, freedom, p, ph, effect)
        for (a, b, q), (t, freedom, p, effect), ph in zip(cases, found, corrected, strict=True)
    ]
