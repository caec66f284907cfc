"""What is said of a number beside the paper's, by rules that are stated once."""

from __future__ import annotations

from typing import Literal, NamedTuple

from trivet.reproduce.numbers import ABOUT, Number

BANDS = (0.01, 0.02, 0.05)
"""Deviations up to which a number is reproduced; the least that holds it is told."""

RULES = (
    "A number of the paper stands for all that are rounded to it. One of ours that rounds to it is reproduced to its digits; "
    f"one that deviates by no more is reproduced within {', '.join(f'{100 * band:g}' for band in BANDS[:-1])} or "
    f"{100 * BANDS[-1]:g} %.",
    "Where the number is not reproduced, and every two machines that the paper's digits tell apart stand in the same order for "
    "this quantity, the ordering is reproduced.",
    "Else it is not reproducible, and the reason is told. The reasons are our judgement.",
    "A number that our machine files took from the paper is an input. It is as put in, or it is not; that says nothing of the "
    "paper, and no input is counted among the numbers that are reproduced.",
    "A number to which something was fitted that the paper does not give, as z0, is met by a fit where ours deviates by no "
    f"more than {100 * BANDS[-1]:g} %, else missed by it. A fit that meets its number confirms nothing, and it is not counted "
    "among the numbers that are reproduced either.",
    "What the paper says in words holds, or does not, in the setting that is told first. Beside it is told in how many of all "
    "settings it holds, and whether the paper's own table bears it out.",
    f"What is about a number deviates from it by no more than {100 * ABOUT:g} %.",
    "A setting in which one of the machines has no number says nothing of an order, or of a statement, about them. It is left "
    "out, and how many are is told.",
    "Least and greatest go over the settings that are looked at, not over all that the paper leaves open. That its number "
    "lies between them confirms nothing.",
)
"""For who reads a report."""

Kind = Literal["reproduced", "ordering", "not reproducible", "no number", "input", "fit"]


class Verdict(NamedTuple):
    """What is said of a number, or of a statement."""

    kind: Kind
    words: str
    reason: str = ""
    """Why it does not come out, as far as that can be told."""

    @property
    def sentence(self) -> str:
        """The words with the reason."""
        return f"{self.words}, because {self.reason}" if self.reason else self.words


AS_PUT_IN, MET = "as put in", "met by a fit"
NO_NUMBER = Verdict("no number", "no number in the paper's text")


def verdict_of(paper: Number | None, ours: float | None, keeps_order: bool, reason: str) -> Verdict:
    """Of a number.

    Args:
        paper: the paper's.
        ours: ours, SI; None where there is none.
        keeps_order: whether the machines stand in the paper's order for this quantity.
        reason: why ours may differ.
    """
    if paper is None:
        return NO_NUMBER
    if ours is not None:
        if paper.rounds_to(ours):
            return Verdict("reproduced", "reproduced to its digits")
        apart = deviation(paper, ours)
        for band in BANDS:
            if apart is not None and abs(apart) <= band:
                return Verdict("reproduced", f"reproduced within {100 * band:g} %")
        if keeps_order:
            return Verdict("ordering", "ordering reproduced", reason)
    return Verdict("not reproducible", "not reproducible", reason)


def of_input(paper: Number | None, ours: float | None, reason: str) -> Verdict:
    """Of a number of the paper that a machine file holds.

    Args:
        paper: the paper's.
        ours: what the machine file holds, SI; None where it holds none.
        reason: why it may hold another, or none.
    """
    if paper is None:
        return NO_NUMBER
    if ours is not None and paper.rounds_to(ours):
        return Verdict("input", AS_PUT_IN)
    return Verdict("input", "not put in" if ours is None else "put in otherwise", reason)


def of_fit(paper: Number | None, ours: float | None, reason: str) -> Verdict:
    """Of a number of the paper to which something was fitted; takes what `of_input` does."""
    verdict = verdict_of(paper, ours, False, reason)
    if verdict.kind == "no number":
        return verdict
    return Verdict("fit", MET) if verdict.kind == "reproduced" else Verdict("fit", "missed by a fit", reason)


def of_statement(holds: bool | None, in_paper: bool | None, is_order: bool, reason: str) -> Verdict:
    """Of what the paper says in words.

    Args:
        holds: whether it holds; None where it cannot be told.
        in_paper: whether the paper's own numbers bear it out; None where it has none.
        is_order: whether it is about an order of machines.
        reason: why it may not hold.
    """
    if holds:
        return Verdict("ordering" if is_order else "reproduced", "holds")
    if in_paper is False:
        return Verdict("not reproducible", "does not hold, nor in the paper's own table")
    return Verdict("not reproducible", "not reproducible" if holds is None else "does not hold", reason)


def deviation(paper: Number, ours: float) -> float | None:
    """Of ours from the paper's, relative to that; None from zero."""
    return ours / paper.value - 1 if paper.value else None
