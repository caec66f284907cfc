"""The pages do what they say: files are read, Python runs, commands print what is shown, what is named is there, links lead."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import inspect
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from trivet.model import load

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "README.md"]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
NAME = re.compile(r'^name = "(.*)"$', re.MULTILINE)

Trivet = Callable[..., tuple[int, str, str]]
"""The fixture of that name."""


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


# Examples


def run_command(trivet: Trivet, line: str, shown: str = "") -> None:
    """Succeeds, or has the exit code that a comment at its end tells; and prints what is shown, "..." standing for anything."""
    program, *arguments = shlex.split(line, comments=True)
    expected = int(told.group(1)) if (told := re.search(r"# .*exit code (\d)", line)) else 0
    assert program == "trivet", line
    code, out, err = trivet(*arguments)
    assert code == expected, f"{line}\n{out}\n{err}"
    alike = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert not shown.strip() or doctest.OutputChecker().check_output(shown, out + err, alike), f"{line}\n{out}\n{err}"


NEEDS = {"solids.md": pytest.mark.peer("scikit-fem", module="skfem")}


@pytest.mark.usefixtures("own_kernels")
@pytest.mark.parametrize("page", [pytest.param(page, id=page.name, marks=NEEDS.get(page.name, ())) for page in PAGES])
def test_examples_work(page: Path, trivet: Trivet, capfd: pytest.CaptureFixture[str]) -> None:
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
            capfd.readouterr()
        elif language == "console":
            for line, shown in COMMAND.findall(text):
                # The order of equal shares in what README shows is that of rounding.
                if line.startswith("trivet "):
                    run_command(trivet, line, "" if page.name == "README.md" else shown)


def test_the_pages_have_examples() -> None:
    found = [language for page in PAGES for language, _ in BLOCK.findall(page.read_text(encoding="utf-8"))]
    assert {"toml", "python", "console"} <= set(found)


def test_links_lead_somewhere() -> None:
    """Those between files as they are, on GitHub say; those of the site are tested below."""
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)[^)]*\)", BLOCK.sub("", page.read_text(encoding="utf-8"))):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


# What is made, and what is named


def maker(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["make_reference", "make_commands", "make_api"])
def test_references_are_up_to_date(name: str) -> None:
    module = maker(name)
    pages = module.pages() if hasattr(module, "pages") else {module.PAGE: module.page()}
    for path, text in pages.items():
        assert path.read_text(encoding="utf-8") == text, f"run: python docs/{name}.py"


def test_references_explain_everything() -> None:
    for line in (maker("make_reference").page() + maker("make_commands").page()).splitlines():
        if line.startswith("| `"):
            *_, meaning, _ = re.split(r"(?<!\\)\|", line)
            assert meaning.strip(), line
    for path, text in maker("make_api").pages().items():
        assert not re.search(r"^- `.*`:\s*$", text, re.MULTILINE), path.name


def found_at(name: str) -> tuple[Any, Any]:
    """The module in which a name of the theory page lies, and what has the name."""
    module = value = importlib.import_module("trivet")
    for part in name.split("."):
        path = f"{module.__name__}.{part}"
        if hasattr(value, "__path__") and importlib.util.find_spec(path):
            module = value = importlib.import_module(path)
        else:
            value = getattr(value, part)
    return module, value


def equations(text: str) -> set[int]:
    """Numbers of equations that a docstring names: "Eq (14)", "Eqs 7-9 and 12", "Eqs (28)-(31)", "Eq 5b"."""
    number = r"\(?\d+[a-d]?\)?"
    spoken = re.findall(rf"Eqs? {number}(?:(?:-|, | and ){number})*", text)
    spans = [span for words in spoken for span in re.findall(r"(\d+)[a-d]?\)?(?:-\(?(\d+))?", words)]
    return {n for low, high in spans for n in range(int(low), int(high or low) + 1)}


def test_equations_are_where_the_theory_says() -> None:
    """Every function of the page is there, it or its module names the equation, and every equation has a function."""
    tied: set[int] = set()
    for left, right in re.findall(r"^\| (.+?) \| (.*`.*) \|", text_of("theory.md"), re.MULTILINE):
        wanted = {int(n) for n in re.findall(r"\((\d+)\)", left)}
        names = re.findall(r"`([a-z_]+(?:\.\w+)+)`", right)
        assert names, left
        for name in names:
            module, value = found_at(name)
            told = equations(f"{inspect.getdoc(value)}\n{inspect.getdoc(module)}")
            assert wanted <= told, f"{name} does not name {wanted - told}"
        tied |= wanted
    assert tied == set(range(1, 39))
    assert {int(n) for n in re.findall(r"\\tag\{(\d+)\}", text_of("theory.md"))} == tied - {9}


def test_validation_names_tests() -> None:
    named = re.findall(r"`(tests/\w+\.py)::(\w+)`", text_of("validation.md"))
    assert len(named) > 50
    for file, name in named:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert any(isinstance(node, ast.FunctionDef) and node.name == name for node in tree.body), f"{file}::{name}"


# The site


class Seen(HTMLParser):
    """What a page of the site has: anchors, links, and what it loads."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        of = {name: value or "" for name, value in attributes}
        self.anchors |= {of[name] for name in ("id", "name") if name in of}
        if tag == "a" and "href" in of:
            self.links.append(of["href"])
        self.loads += [of[name] for name in ("src", "data", "poster") if name in of]
        if tag == "link" and of.get("rel") not in ("next", "prev", "index", "search"):
            self.loads.append(of["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, Seen]:
    folder = tmp_path_factory.mktemp("site").resolve()
    options = ("-W", "--keep-going", "-q", "-d", str(tmp_path_factory.mktemp("doctrees")))
    made = subprocess.run([sys.executable, "-m", "sphinx", *options, DOCS, folder], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    return {page: Seen(page) for page in folder.rglob("*.html")}


def test_every_page_is_in_the_contents(site: dict[Path, Seen]) -> None:
    (index,) = (seen for page, seen in site.items() if page.name == "index.html")
    assert {f"{page.stem}.html" for page in DOCS.glob("*.md")} - {"index.html"} <= set(index.links)


def test_no_link_is_dead(site: dict[Path, Seen]) -> None:
    for page, seen in site.items():
        for link in seen.links:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "mailto"):
                continue
            target = page.parent / unquote(parts.path) if parts.path else page
            assert target.exists(), f"{page.name}: {link}"
            if parts.fragment and target.suffix == ".html":
                assert unquote(parts.fragment) in site[target.resolve()].anchors, f"{page.name}: {link}"


def lies_there(asked: str, page: Path) -> bool:
    parts = urlsplit(asked)
    return parts.scheme == "data" or (not (parts.scheme or parts.netloc) and (page.parent / parts.path).exists())


def test_nothing_is_asked_from_elsewhere(site: dict[Path, Seen]) -> None:
    for page, seen in site.items():
        for asked in seen.loads:
            assert lies_there(asked, page), f"{page.name}: {asked}"
    (index,) = (page for page in site if page.name == "index.html")
    for style in index.parent.rglob("*.css"):
        for asked in re.findall(r"""(?:url\(\s*|@import\s+)['"]?([^'")\s]+)""", style.read_text(encoding="utf-8")):
            assert lies_there(asked, style), f"{style.name}: {asked}"


def test_types_lead_to_what_they_hold(site: dict[Path, Seen]) -> None:
    """Every class that a public name takes or gives is documented, and linked from where it is named."""
    public = next(seen for page, seen in site.items() if page.name == "api.html")
    linked = {urlsplit(link).fragment for link in public.links}
    assert set(maker("make_api").parts()) <= linked
