"""Sobol indices: which part of a quantity's variance is due to each variable, by sampling (Saltelli et al. 2010).

The first index is the part that a variable makes alone, the total one with all that it does together with others.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

LEAST = 8
"""Base samples from which indices are told."""
CONSTANT = 1e-12
"""A quantity whose values differ by this part of their mean does not vary."""
RESAMPLES = 200
"""Of the bootstrap."""
CONFIDENCE = 0.95
SEED = 1
"""Of the bootstrap; SALib takes another one each time when it is zero."""


class Indices(NamedTuple):
    """Of one quantity, by d variables; NaN where there are none."""

    first: Array
    first_margin: Array
    """Half the width of the interval with a confidence of 95 %."""
    total: Array
    total_margin: Array
    left_out: int
    """Base samples of which not all designs have the quantity; the rest is no longer of independent variables."""
    base: int
    """Base samples in all."""

    @property
    def has_values(self) -> bool:
        """Whether there are indices."""
        return bool(np.isfinite(self.first).any())


def indices(values: Array) -> Indices:
    """Indices of a quantity from values (base, d + 2) in the order of `sampling.Saltelli`.

    There are none where fewer than half of the base samples are whole, or where the quantity does not vary.
    """
    base, width = values.shape
    whole = values[np.isfinite(values).all(axis=1)]
    left_out = base - len(whole)
    if len(whole) < LEAST or left_out * 2 > base or np.std(whole) <= CONSTANT * abs(np.mean(whole)):
        none = np.full(width - 2, np.nan)
        return Indices(none, none, none, none, left_out, base)
    from SALib.analyze import sobol

    problem = {"num_vars": width - 2, "names": [str(k) for k in range(width - 2)], "bounds": [[0, 1]] * (width - 2)}
    asked = {"calc_second_order": False, "num_resamples": RESAMPLES, "conf_level": CONFIDENCE, "seed": SEED}
    found = sobol.analyze(problem, whole.reshape(-1), **asked)
    first, first_margin, total, total_margin = (
        np.asarray(found[key], dtype=float) for key in ("S1", "S1_conf", "ST", "ST_conf")
    )
    return Indices(first, first_margin, total, total_margin, left_out, base)
