"""All tables and figures in turn; what an earlier run has left is taken where it fits."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path

from trivet.reproduce import store
from trivet.reproduce.found import Found
from trivet.reproduce.outcome import Outcome
from trivet.reproduce.paper import Item, Paper

Advance = Callable[[str, int, int], None]
"""Called with a name and how much of how much is done."""


@dataclass(frozen=True)
class Reproduction:
    """Tables and figures of a paper, worked out."""

    paper: Paper
    outcomes: tuple[Outcome, ...]

    def of(self, name: str) -> Outcome:
        """An item by its name."""
        return next(outcome for outcome in self.outcomes if outcome.item.name == name)

    def only(self, names: Collection[str]) -> Reproduction:
        """Some of them; all when none is named."""
        return replace(self, outcomes=tuple(outcome for outcome in self.outcomes if not names or outcome.item.name in names))


def reproduce(
    paper: Paper,
    folder: Path,
    only: Collection[str] = (),
    *,
    advance: Advance = lambda name, done, total: None,
    tell: Callable[[str], None] = lambda words: None,
) -> Reproduction:
    """Work items out, each kept in the folder as soon as it is done; those that are kept and fit are taken.

    Args:
        paper: whose they are.
        folder: for the results; new, empty, or of an earlier run.
        only: names of items; all when none is named. Others are there as well where the folder holds them and they fit.
        advance: called as the work goes on.
        tell: called with a line for every item.

    Raises:
        InputError: for a name that is none, or a folder that holds other files or cannot be written.
        NoResultError: when a machine has no result.
    """
    wanted = {item.name for item in paper.chosen(only)}
    store.prepare(folder)
    outcomes = []
    for number, item in enumerate(paper.items):
        advance("paper", number, len(paper.items))
        found = _found(item, folder, advance, tell) if item.name in wanted else _left(item, folder, tell)
        if found is not None:
            outcomes.append(Outcome(item, found))
    advance("paper", len(paper.items), len(paper.items))
    return Reproduction(paper, tuple(outcomes))


def _left(item: Item, folder: Path, tell: Callable[[str], None]) -> Found | None:
    """What an earlier run has left of an item that is not asked for."""
    found, reason = store.kept(folder, item)
    if found is not None:
        tell(f"{item.name}: taken from {store.path_of(folder, item)} as well")
    elif reason:
        tell(f"{item.name}: left out, since {store.path_of(folder, item)} {reason}; --only {item.name} makes it again")
    return found


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
