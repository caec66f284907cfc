"""Machine files of the designs on a front."""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Iterator
from pathlib import Path

from trivet.design.optimisation import Member, Optimisation
from trivet.errors import InputError
from trivet.model import write
from trivet.model.check import check
from trivet.model.kinds import kinds
from trivet.model.machine import Note

LONGEST = 34
"""Characters of a machine's name that its designs' names keep, so that machine files take them."""


def write_machines(result: Optimisation, folder: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[str]:
    """Write a machine file of every member into a folder, made where it is missing; gives their paths.

    Raises:
        InputError: for a file that exists unasked, or that cannot be written.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{target}: cannot be made: {error.strerror or error}") from None
    for k, member in enumerate(result.members):
        base = result.study.names[member.place]
        name = f"{re.sub(r'[^a-z0-9_-]', '-', base.lower())[:LONGEST]}-{k + 1:03d}"
        machine = result.machine(member)
        about = dataclasses.replace(
            machine.about, name=name, title=f"{machine.about.title or base}, optimised", description=_words(result, member),
            published=(), published_dynamic=(), notes=_notes(result, member),
        )  # fmt: skip
        machine = dataclasses.replace(machine, about=about)
        check(machine)
        path = target / f"{name}.toml"
        write(machine, path, overwrite=overwrite)
        yield str(path)


def _notes(result: Optimisation, member: Member) -> tuple[Note, ...]:
    """Where numbers come from: those that varied from the optimisation, others from where they came."""
    machine, paths = result.study.subjects[member.place].machine, list(kinds(result.study.subjects[member.place].machine))
    actions = (variable.actions[member.place] for variable in result.study.variables)
    leaves = [leaf for action in actions if action is not None for leaf in action.leaves]
    # A member of a list, "travel.2", has no note of its own.
    varied = dict.fromkeys(re.sub(r"\.\d+$", "", paths[leaf]) for leaf in leaves)
    own = [note for note in machine.about.notes if note.path not in varied]
    return (*own, *(Note(path, "found by optimisation") for path in varied))


def _words(result: Optimisation, member: Member) -> str:
    values = (
        f"{own.name} {own.kind.write(float(f'{value:.6g}'))}"
        for own, value in zip(result.study.quantities, member.values, strict=True)
    )
    return f"A design of {result.study.names[member.place]}, found by optimisation: {', '.join(values)}."
