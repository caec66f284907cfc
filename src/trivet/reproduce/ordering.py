"""Orders of machines: what the paper's digits tell, what comes out, and statements in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise, permutations
from typing import NamedTuple

from trivet.reproduce.numbers import Number
from trivet.reproduce.paper import Claim, Pair

ROUNDING = 1e-9
"""Relative difference up to which two numbers of ours are one."""


class Ordering(NamedTuple):
    """The machines by one quantity in one setting."""

    quantity: str
    setting: str
    paper: str
    """The paper's order, "a > b = c"."""
    ours: str
    agreeing: int
    """Pairs in the paper's order."""
    pairs: int
    """Pairs that its digits tell apart."""
    missing: int
    """Machines of the paper's that have no number of ours here."""

    @property
    def is_reproduced(self) -> bool:
        """Whether all pairs are in order; where there are none there is nothing to reproduce."""
        return self.pairs > 0 and self.agreeing == self.pairs


def ordering(quantity: str, setting: str, paper: Mapping[str, Number | None], ours: Mapping[str, float]) -> Ordering:
    """Ours (SI) beside the paper's; a pair of which one has no number of ours is not in order."""
    known = {name: number for name, number in paper.items() if number is not None}
    pairs = told_apart(known)
    agreeing = sum(is_above(pair, ours) for pair in pairs)
    theirs = written({name: own.value for name, own in known.items()}, lambda a, b: known[a].is_above(known[b]))
    return Ordering(quantity, setting, theirs, written(ours), agreeing, len(pairs), sum(name not in ours for name in known))


def told_apart(known: Mapping[str, Number]) -> list[Pair]:
    """Pairs of machines whose numbers differ by more than their digits hide, the greater first."""
    return [Pair(a, b) for a, b in permutations(known, 2) if known[a].is_above(known[b])]


def is_above(pair: Pair, values: Mapping[str, float]) -> bool:
    """Whether one machine is above the other; not where one has no number."""
    return pair.above in values and pair.below in values and values[pair.above] > values[pair.below]


def written(values: Mapping[str, float], is_above: Callable[[str, str], bool] | None = None) -> str:
    """Machines by their numbers, the greatest first, "a > b = c"; those are equal of which none is above the other."""
    names = sorted(values, key=lambda name: -values[name])
    text = names[0] if names else ""
    for above, below in pairwise(names):
        apart = values[above] - values[below] > ROUNDING * abs(values[above])
        text += f" {'>' if (apart if is_above is None else is_above(above, below)) else '='} {below}"
    return text


class Moments(NamedTuple):
    """What a test of means needs, in any unit."""

    n: int
    mean: float
    variance: float


def holds(claim: Claim, values: Mapping[str, float], samples: Mapping[str, Moments] | None = None) -> bool | None:
    """Whether a claim is true of values (SI) by machine; None where it cannot be told, as where a machine has no number.

    Args:
        claim: what is said.
        values: by machine, those which have one.
        samples: by machine, for a claim of significance.
    """
    names = claim.named or tuple(values)
    if not names or any(name not in values for name in names):
        return None
    if claim.at_least is not None:
        return all(values[name] >= claim.at_least.value for name in names)
    if claim.about is not None:
        return all(claim.about.is_about(values[name]) for name in names)
    if not claim.pairs:
        return None
    is_ordered = all(is_above(pair, values) for pair in claim.pairs)
    if claim.significance is None:
        return is_ordered
    worst = greatest_p(claim.pairs, samples) if samples else None
    return None if worst is None else is_ordered and worst < claim.significance


def greatest_p(pairs: list[Pair], samples: Mapping[str, Moments]) -> float | None:
    """The greatest p of Welch's two-tailed test over pairs, after Holm's correction over them."""
    from trivet.study import statistics

    if any(name not in samples for pair in pairs for name in pair):
        return None
    full = {name: statistics.Moments(own.n, own.mean, own.variance, own.mean, own.mean) for name, own in samples.items()}
    return max(statistics.holm([statistics.welch(full[a], full[b])[2] for a, b in pairs]))
