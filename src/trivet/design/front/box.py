"""Designs as numbers of equal standing: continuous variables from 0 to 1, discrete ones by the number of their value."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trivet.design.front.problem import Array, Problem


@dataclass(frozen=True)
class Box:
    """Where designs lie."""

    low: Array
    """(d,)"""
    high: Array
    """(d,)"""
    discrete: tuple[tuple[float, ...] | None, ...]

    @classmethod
    def of(cls, problem: Problem) -> Box:
        """Where a problem's designs lie."""
        return cls(np.asarray(problem.low, float), np.asarray(problem.high, float), problem.discrete)

    @cached_property
    def is_discrete(self) -> Array:
        """(d,)"""
        return np.array([values is not None for values in self.discrete])

    @cached_property
    def is_free(self) -> Array:
        """(d,) whether a variable can vary little by little."""
        return ~self.is_discrete & (self.high > self.low)

    @cached_property
    def width(self) -> Array:
        """(d,)"""
        return self.high - self.low

    @property
    def counts(self) -> Array:
        """(d,) of discrete values, 0 for continuous variables."""
        return np.array([0 if values is None else len(values) for values in self.discrete])

    def designs(self, genes: Array) -> Array:
        """Of genes (n, d)."""
        # Of both ends, so that neither is missed by rounding.
        made: Array = self.low * (1 - genes) + self.high * genes
        for i, values in enumerate(self.discrete):
            if values is not None:
                made[:, i] = np.array(values)[np.rint(genes[:, i]).astype(int)]
        return made

    def genes(self, designs: Array) -> Array:
        """Of designs (n, d); discrete variables at their nearest value."""
        width = np.where(self.width > 0, self.width, 1.0)
        made: Array = np.clip((designs - self.low) / width, 0.0, 1.0)
        for i, values in enumerate(self.discrete):
            if values is not None:
                made[:, i] = np.abs(designs[:, i, None] - np.array(values)).argmin(axis=1)
        return made

    def beside(self, design: Array) -> list[Array]:
        """Designs (d,) like one, but one discrete variable at the value below or above its own."""
        made = []
        for i, values in enumerate(self.discrete):
            if values is not None:
                ordered = sorted(values)
                place = ordered.index(design[i])
                for value in ordered[max(place - 1, 0) : place] + ordered[place + 1 : place + 2]:
                    made.append(np.where(np.arange(len(design)) == i, value, design))
        return made

    def moved(self, design: Array, genes: Array) -> Array:
        """Designs (n, d) like one (d,) with its free variables at genes (n, f)."""
        made = np.repeat(design[None], len(genes), axis=0)
        low, high = self.low[self.is_free], self.high[self.is_free]
        made[:, self.is_free] = np.clip(low * (1 - genes) + high * genes, low, high)
        return made
