"""The pages do what they say: machine files are read, Python runs, commands succeed, the reference is up to date."""

from __future__ import annotations

import importlib.util
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from trivet.model import load

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), DOCS.parent / "README.md"]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r'^name = "(.*)"$', re.MULTILINE)

Trivet = Callable[..., tuple[int, str, str]]
"""The fixture of that name."""


def run_command(trivet: Trivet, line: str) -> None:
    """Succeeds, or has the exit code that a comment at the end of the line tells."""
    program, *arguments = shlex.split(line, comments=True)
    expected = int(told.group(1)) if (told := re.search(r"# .*exit code (\d)", line)) else 0
    assert program == "trivet", line
    code, out, err = trivet(*arguments)
    assert code == expected, f"{line}\n{out}\n{err}"


NEEDS = {"solids.md": pytest.mark.peer("scikit-fem", module="skfem")}


@pytest.mark.usefixtures("own_kernels")
@pytest.mark.parametrize("page", [pytest.param(page, id=page.name, marks=NEEDS.get(page.name, ())) for page in PAGES])
def test_examples_work(page: Path, trivet: Trivet) -> None:
    """Block after block in one folder, and in one process; a machine file lies there when the next block runs."""
    names: dict[str, object] = {}
    for language, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if language == "toml" and text.startswith(("format = 1", "variant_of = ")):
            found = NAME.search(text)
            assert found, "a machine has a name"
            path = Path(f"{found.group(1)}.toml")
            path.write_text(text, encoding="utf-8")
            assert load(path).name == found.group(1)
        elif language == "python":
            exec(compile(text, str(page), "exec"), names)
        elif language == "console":
            for line in text.splitlines():
                if line.startswith("$ trivet "):
                    run_command(trivet, line[2:])


def test_the_pages_have_examples() -> None:
    found = [language for page in PAGES for language, _ in BLOCK.findall(page.read_text(encoding="utf-8"))]
    assert {"toml", "python", "console"} <= set(found)


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^):#]+\.md)[^)]*\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def make_reference() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_reference", DOCS / "make_reference.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_is_up_to_date() -> None:
    module = make_reference()
    assert module.PAGE.read_text(encoding="utf-8") == module.page(), "run: python docs/make_reference.py"


def test_the_reference_explains_every_key() -> None:
    for line in make_reference().page().splitlines():
        if line.startswith("| `"):
            *_, meaning, _ = re.split(r"(?<!\\)\|", line)
            assert meaning.strip(), line
