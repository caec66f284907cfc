"""Errors that a user can mend, each one line, with the exit code of the commands."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

BEGUN = 3
"""Letters of a name that may stand for all of it."""


class TrivetError(Exception):
    """An error with a message for the user; whatever a message quotes, it is one printable line of at most 1000 characters."""

    exit_code = 1

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


class InputError(TrivetError, ValueError):
    """Wrong input: a file, a key, a value, an option."""

    exit_code = 2


class NoResultError(TrivetError):
    """The input was right, yet there is nothing to compute: no pose is reachable, say."""

    exit_code = 1


def one_line(text: str, longest: int = 1000) -> str:
    """Text as one printable line: control characters are escaped, and the middle of a long text is left out."""
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
    keep = (longest - 1) // 2
    return line if len(line) <= longest else f"{line[:keep]}…{line[-keep:]}"


def shown(value: object) -> str:
    """A value as messages quote it: text between double quotes, everything at most 60 characters long."""
    try:
        text = f'"{value}"' if isinstance(value, str) else repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, a table within itself
        text = f"{type(value).__name__} of great size"
    return one_line(text, 60)


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint that names the nearest known names, or one or two that begin so: "; did you mean 'length'?"; or the list of all
    when none is near."""
    names = sorted(set(known))
    begun = [one for one in names if len(name) >= BEGUN and one.startswith(name)]
    near = difflib.get_close_matches(name, names, n=2, cutoff=0.6) or (begun if len(begun) <= 2 else [])
    if near:
        return "; did you mean " + " or ".join(f"'{n}'" for n in near) + "?"
    if not names:
        return ""
    listed = ", ".join(names[:12]) + (", …" if len(names) > 12 else "")
    return f"; known are: {listed}"
