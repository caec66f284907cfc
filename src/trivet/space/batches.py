"""Compiled kernels over any number of cases: calls of few sizes, over all cores, in their order."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import numpy as np

CORES = os.cpu_count() or 1
SIZES = (1, 256, 4096)
"""Cases per call: JAX compiles per size, and what a kernel works on should stay in the cache of a core."""


def in_batches(kernel: Callable[[Any], Any], cases: Any) -> Any:
    """A compiled kernel over a tree of arrays (n,); its results as NumPy arrays (n, ...), n at least one.

    No LAPACK in such kernels, see `elimination.solved`.
    """
    leaves, structure = jax.tree.flatten(cases)
    shape = np.broadcast_shapes(*(np.shape(leaf) for leaf in leaves))
    columns = [np.broadcast_to(np.asarray(leaf, dtype=float), shape) for leaf in leaves]
    (count,) = shape
    size = next((size for size in SIZES if count <= size), SIZES[-1])

    def slices() -> Iterator[Any]:
        for start in range(0, count, size):
            part = [column[start : start + size] for column in columns]
            if count - start < size:  # filled up with the last case
                part = [np.concatenate([c, np.broadcast_to(c[-1], size - len(c))]) for c in part]
            yield jax.tree.unflatten(structure, part)

    found = list(in_threads(lambda part: jax.tree.map(np.asarray, kernel(part)), slices()))
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *found)


def in_threads(work: Callable[[Any], Any], items: Iterator[Any]) -> Iterator[Any]:
    """Results of `work` in order, one item per core under way; the items are drawn only as they are needed."""
    with ThreadPoolExecutor(CORES) as pool:
        waiting = []
        for item in items:
            waiting.append(pool.submit(work, item))
            if len(waiting) > CORES:
                yield waiting.pop(0).result()
        for future in waiting:
            yield future.result()
