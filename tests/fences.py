"""Blocks of code on a page, each of a kind that says what the tests do with it.

The first line of a block names its kind, then what is special about it; GitHub and the site show neither:

    ```console                     commands, run one after the other, and what they print
    ```console not run: a reason   commands whose options alone are looked at
    ```python                      run
    ```toml                        a machine file, which lies there for what follows
    ```toml set-up                 a file of a test set-up, read
    ```toml study                  a study file, read, which lies there for what follows as study.toml
    ```toml tolerances             a tolerance file, read, which lies there for what follows as tolerances.toml
    ```toml piece                  keys and values out of a file, read as TOML
    ```csv                         a table of measured responses, read
    ```math                        an equation, which the site sets
    ```text                        what a command further up prints
    ```text usage                  a command and what it takes, as its help says
    ```text not run: a reason      anything else; options of commands in it are looked at
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from typing import NamedTuple

from markdown_it import MarkdownIt

KINDS = (
    "console", "console not run", "python", "toml", "toml set-up", "toml study", "toml tolerances", "toml piece", "csv",
    "math", "text", "text usage", "text not run",
)  # fmt: skip
_COMMAND = re.compile(r"\$ (.*)\n((?:(?!\$ ).*\n)*)")
_SPOKEN = re.compile(r"(?:^|[\s/\\])trivet (?P<words>.*?)(?:\s[>|]\s.*)?$", re.MULTILINE)


class Fence(NamedTuple):
    """A block of code."""

    kind: str
    text: str


class Command(NamedTuple):
    """A line of a console, and what stands under it."""

    words: str
    shown: str

    @property
    def arguments(self) -> list[str]:
        """Of the program."""
        return shlex.split(self.words, comments=True)[1:]

    @property
    def code(self) -> int:
        """The exit code that a comment at its end tells."""
        told = re.search(r"# .*exit code (\d)", self.words)
        return int(told.group(1)) if told else 0


def fences(page: str, name: str) -> Iterator[Fence]:
    """All blocks of a page; fails on one of which it is not said what to do with it."""
    for token in MarkdownIt("commonmark").parse(page):
        if token.type not in ("fence", "code_block"):
            continue
        where = f"{name}:{token.map[0] + 1 if token.map else 0}"
        assert token.type == "fence", f"{where}: a block of a kind begins with three backquotes; this one is only indented"
        kind, _, reason = token.info.partition(": ")
        assert kind in KINDS, f"{where}: '{kind}' is no kind of block; kinds are {', '.join(KINDS)}"
        assert bool(reason.strip()) == kind.endswith("not run"), f"{where}: what is not run has a reason, what is run has none"
        yield Fence(kind, token.content)


def commands(text: str) -> list[Command]:
    """Lines of a console, each a command of the program, with what is shown under it."""
    found = _COMMAND.findall(text)
    assert text == "".join(f"$ {words}\n{shown}" for words, shown in found), f"a console begins with a command: {text}"
    for words, shown in found:
        assert words.startswith("trivet "), f"{words}: only trivet is run; other programs are text that is not run"
        assert not re.search(r"^\s+\$ ", shown, re.MULTILINE), f"{words}: commands below it are indented"
    return [Command(*one) for one in found]


def spoken(text: str) -> Iterator[list[str]]:
    """Arguments of all commands that a text names, without redirections."""
    for match in _SPOKEN.finditer(text):
        yield shlex.split(match["words"], comments=True)


def spoken_inline(page: str) -> Iterator[list[str]]:
    """The same of code between words."""
    for token in MarkdownIt("commonmark").enable("table").parse(page):
        for part in token.children or ():
            if part.type == "code_inline" and part.content.startswith("trivet "):
                yield from spoken(part.content)
