"""Names of machines in figures: a machine with settings goes by all of them, which is too long for one line."""

from __future__ import annotations

import re

_BREAKS = re.compile(r"(?<=[@,;=\-])(?=.)|(?<=\.)(?=[a-z])")


def broken(name: str, width: int, most: int = 5) -> str:
    """A name in lines of at most `width` letters, broken between its parts where it can be; beyond `most` lines the end is
    left out."""
    lines = [""]
    for part in _BREAKS.split(name):
        if lines[-1] and len(lines[-1]) + len(part.rstrip()) > width:
            lines.append("")
        lines[-1] += part
        while len(lines[-1].rstrip()) > width:
            lines[-1:] = [lines[-1][:width], lines[-1][width:]]
    lines = [line.strip() for line in lines]
    if len(lines) > most:
        lines[most - 1 :] = [lines[most - 1][: width - 1] + "…"]
    return "\n".join(lines)


def line_count(name: str) -> int:
    """How many lines a broken name has."""
    return name.count("\n") + 1
