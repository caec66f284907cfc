"""Errors that a user can mend, each one line, with the exit code of the commands."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class TrivetError(Exception):
    """An error with a message for the user."""

    exit_code = 1


class InputError(TrivetError, ValueError):
    """Wrong input: a file, a key, a value, an option."""

    exit_code = 2


class NoResultError(TrivetError):
    """The input was right, yet there is nothing to compute: no pose is reachable, say."""

    exit_code = 1


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint that names the nearest known names: "; did you mean 'length'?", or the list of all when none is near."""
    names = sorted(set(known))
    near = difflib.get_close_matches(name, names, n=2, cutoff=0.6)
    if near:
        return "; did you mean " + " or ".join(f"'{n}'" for n in near) + "?"
    if not names:
        return ""
    listed = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    return f"; known are: {listed}"
