"""All tables and figures in turn; what an earlier run has left is taken where it fits."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from trivet.reproduce import store
from trivet.reproduce.found import Found
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.paper import Item

Advance = Callable[[str, int, int], None]
"""Called with a name and how much of how much is done."""


@dataclass(frozen=True)
class Reproduction:
    """Tables and figures of the paper, worked out."""

    outcomes: tuple[Outcome, ...]

    def of(self, name: str) -> Outcome:
        """An item by its name."""
        return next(outcome for outcome in self.outcomes if outcome.item.name == name)


def reproduce(
    items: Sequence[Item],
    folder: Path,
    *,
    advance: Advance = lambda name, done, total: None,
    tell: Callable[[str], None] = lambda words: None,
) -> Reproduction:
    """Work items out, each kept in the folder as soon as it is done; those that are kept and fit are taken.

    Args:
        items: which, see `trivet.reproduce.paper.chosen`.
        folder: for the results; new, empty, or of an earlier run.
        advance: called as the work goes on.
        tell: called with a line for every item.

    Raises:
        InputError: when the folder holds other files, or cannot be written.
        NoResultError: when a machine has no result.
    """
    store.prepare(folder)
    outcomes = []
    for number, item in enumerate(items):
        advance("paper", number, len(items))
        outcomes.append(Outcome(item, _found(item, folder, advance, tell)))
    advance("paper", len(items), len(items))
    return Reproduction(tuple(outcomes))


def _found(item: Item, folder: Path, advance: Advance, tell: Callable[[str], None]) -> Found:
    path = store.path_of(folder, item)
    found, reason = store.kept(folder, item)
    if found is not None:
        tell(f"{item.name}: taken from {path}")
        return found
    start = time.monotonic()
    found = item.work.found(item.machines, item.asked, lambda done, total: advance(item.name, done, total))
    store.keep(folder, item, found)
    why = f" again, since {path} {reason}" if reason else ""
    tell(f"{item.name}: worked out{why} ({time.monotonic() - start:.0f} s)")
    return found
