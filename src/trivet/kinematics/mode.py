"""Working modes: the choice of every branch of the inverse kinematics.

A mode is written as one group of signs per chain, in the order of the chains: first the side (carriage on the same side of the
guide's axis as P, or opposite), then the elbow, each where the chain has that choice: "++ +- ++", or "+ + +" for a telescope.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from trivet.errors import InputError
from trivet.kinematics.inverse import branches, has_closed_form, kind_of
from trivet.model import Machine


def parse_mode(machine: Machine, text: str | None = None) -> Any:
    """Signs (n_chains, 2) of a written mode, +1.0 or -1.0; a choice which a chain does not have is +1.

    Args:
        machine: the machine.
        text: the mode; the machine's own when None or empty, all plus when it has none.

    Returns:
        The signs, or None for a machine with a chain that has no closed form: it has no working modes by name.

    Raises:
        InputError: when groups or signs are too few or too many, or name a mode of a machine that has none by name.
    """
    if not all(has_closed_form(leg) for leg in machine.legs):
        if text is not None and text.strip():
            return closed_form_signs(machine, text)
        return None
    written = text if text is not None and text.strip() else machine.home.mode
    counts = [len(branches(leg)) for leg in machine.legs]
    example = " ".join("+" * n for n in counts)
    if not written.strip():
        written = example
    groups = written.split()
    if len(groups) == 1 and len(written.strip()) == sum(counts):
        joined = groups[0]
        groups = [joined[sum(counts[:i]) : sum(counts[: i + 1])] for i in range(len(counts))]
    chosen = iter(groups)
    if [len(g) for g in groups] != [n for n in counts if n] or set(written) - set("+- "):
        raise InputError(f'mode "{written}": {machine.name} has the signs "{example}" ({describe_branches(machine)})')
    signs = np.ones((len(counts), 2))
    for i, leg in enumerate(machine.legs):
        for branch, sign in zip(branches(leg), next(chosen) if counts[i] else "", strict=True):
            signs[i, branch] = 1.0 if sign == "+" else -1.0
    return signs


def mode_text(machine: Machine, signs: Any) -> str:
    """The written form of signs (n_chains, 2); empty for a machine that has no choice, or that is closed numerically (None)."""
    if signs is None:
        return ""
    groups = ("".join("+" if signs[i][b] > 0 else "-" for b in branches(leg)) for i, leg in enumerate(machine.legs))
    return " ".join(group for group in groups if group)


def mode_words(written: str) -> str:
    """A written mode in a sentence."""
    return f"mode {written}" if written else "no choice of mode"


def describe_branches(machine: Machine) -> str:
    """What the signs of one chain mean."""
    names = [("side", "elbow")[b] for b in branches(machine.legs[0])]
    return "per chain: " + (", ".join(names) if names else "no choice")


def all_modes(machine: Machine) -> list[str]:
    """Every working mode of a machine, as text."""
    groups = [["".join(signs) for signs in product("+-", repeat=len(branches(leg)))] for leg in machine.legs]
    return [" ".join(group for group in choice if group) for choice in product(*groups)]


def closed_form_signs(machine: Machine, text: str | None = None) -> Any:
    """`parse_mode` for what is done at many poses: raises InputError, naming the chain, where there is no closed form."""
    for leg in machine.legs:
        kind_of(leg)
    return parse_mode(machine, text)
