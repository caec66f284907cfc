"""Commands on a terminal show from the start on that they work, and leave nothing of it behind."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from trivet import compare
from trivet.cli import output
from trivet.cli.output import counted, goes_on
from trivet.errors import NoResultError

pty = pytest.importorskip("pty", reason="no pseudo-terminals here")


def on_terminal(*arguments: str, stdout: Path | None = None) -> tuple[int, str]:
    """Exit code of a command, and all that its terminal got; the standard output may go into a file.  "-c": of Python."""
    how = [] if arguments[0] == "-c" else ["-m", "trivet"]
    child, terminal = pty.fork()
    if child == 0:
        os.environ |= {"TERM": "xterm", "COLUMNS": "120"}
        if stdout is not None:
            os.dup2(os.open(stdout, os.O_WRONLY | os.O_CREAT), 1)
        os.execv(sys.executable, [sys.executable, *how, *arguments])
    told = b""
    while True:
        try:
            piece = os.read(terminal, 65536)
        except OSError:  # how Linux says that the other end is closed
            break
        if not piece:
            break
        told += piece
    os.close(terminal)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), told.decode()


def test_a_sign_comes_first_and_only_to_the_terminal(tmp_path: Path, trivet: object) -> None:
    code, told = on_terminal("show", "azulay", "--toml", stdout=tmp_path / "mine.toml")
    assert code == 0
    assert "getting ready …" in told
    assert (tmp_path / "mine.toml").read_text() == trivet("show", "azulay", "--toml")[1]  # type: ignore[operator]


def test_a_sign_goes_away_with_the_answer() -> None:
    code, told = on_terminal("pose", "nosuch")
    first, answer = told.index("getting ready …"), told.index("trivet: nosuch: no machine")
    assert (code, first < answer) == (2, True)
    assert "getting ready" not in told[answer:]
    shown, hidden = (told[: told.rindex("getting ready")].rfind(f"\x1b[?25{letter}") for letter in "hl")
    assert shown > hidden  # whoever interrupts it has a cursor


def test_json_is_silent() -> None:
    code, told = on_terminal("list", "--json")
    assert (code, told[:1], "getting ready" in told) == (0, "[", False)


STAGES = """
from time import sleep
from trivet.cli.output import stages
with stages(False) as show:
    for doing, done, total in ("a (1 of 2), evolution", 4, 4), ("a (1 of 2), polish", 9, None), ("b (2 of 2), check", 1, 4):
        show(doing, done, total, "7 best")
        sleep(0.5)
"""


def test_stages_share_a_line() -> None:
    """That of the running one; one without an end takes none from the stage before, and what follows a full one spins again."""
    code, told = on_terminal("-c", STAGES)
    lines = [re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]|\d:\d\d:\d\d|[━╸╺]", "", line) for line in re.split(r"[\r\n]+", told)]
    lines = [" ".join(line.split()) for line in lines if " of 2" in line]
    assert [line for line, _ in groupby(line.lstrip("⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏ ") for line in lines)] == [
        "a (1 of 2), evolution 4 of 4 7 best", "a (1 of 2), polish 9 done 7 best", "b (2 of 2), check 1 of 4 7 best",
    ]  # fmt: skip
    assert all((line[0] in "⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏") == ("4 of 4" not in line) for line in lines)
    assert code == 0


def test_how_far_a_comparison_is() -> None:
    calls: list[tuple[str, int, int]] = []
    compare("azulay", "azulay-196", steps=2, rolls=24, finer=2, progress=lambda *told: calls.append(told))
    for name in ("azulay", "azulay-196"):
        own = [(done, total) for machine, done, total in calls if machine == name]
        assert {total for _, total in own} == {13 + 49}
        assert [done for done, _ in own] == sorted({done for done, _ in own})
        assert own[-1][0] == own[-1][1]


def test_an_optimisation_says_which_machine_of_how_many(
    trivet: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[tuple[object, ...]] = []

    @contextmanager
    def stages(quiet: bool) -> Iterator[Callable[..., None]]:
        yield lambda *told: said.append(told)

    def optimise(study: Any, progress: Callable[..., None], **_: object) -> None:
        progress(study.names[-1], "polish", 9, None, 1624)
        raise NoResultError("enough")

    monkeypatch.setattr(output, "stages", stages)
    monkeypatch.setattr("trivet.design.optimisation.optimise", optimise)
    tube = '[[variables]]\nof = "sections.tube.outer_diameter"\nlow = "18 mm"\nhigh = "24 mm"\n'
    for machines in ('"azulay", "eclipse"', '"azulay"'):
        Path("s.toml").write_text(f'machines = [{machines}]\n[optimise]\nminimise = ["mass"]\n{tube}')
        assert trivet("optimise", "s.toml")[2] == "trivet: enough\n"
    assert said == [
        ("eclipse (2 of 2), polish", 9, None, "1,624 that no other dominates"),
        ("azulay, polish", 9, None, "1,624 that no other dominates"),
    ]


def test_counts_never_ask() -> None:
    assert counted(3, 7) == "3 of 7"
    assert counted(317, None) == "317"


@pytest.mark.parametrize("leaving", [KeyboardInterrupt(), SystemExit(143)])
def test_an_interrupted_study_says_what_it_keeps(leaving: BaseException, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(type(leaving)), goes_on("some.zarr"):
        raise leaving
    assert capsys.readouterr() == ("", "whatever some.zarr holds by now is kept; the same command goes on from there\n")


def test_a_study_that_ends_by_itself_says_nothing_of_it(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit), goes_on("some.zarr"):
        raise SystemExit(2)
    assert capsys.readouterr() == ("", "")
