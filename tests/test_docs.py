"""The pages do what they say: files are read, Python runs, commands print what is shown, what is named is there, links lead."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import inspect
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from fences import Command, commands, fences, spoken, spoken_inline

import trivet as t
from trivet.model import load

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.glob("*.md")), ROOT / "README.md"]
BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)

Trivet = Callable[..., tuple[int, str, str]]
"""The fixture of that name."""


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


# Examples


def run_command(trivet: Trivet, command: Command) -> str:
    """Has the exit code that it should, and prints what is shown, "..." standing for anything; returns what it prints."""
    code, out, err = trivet(*command.arguments)
    assert code == command.code, f"{command.words}\n{out}\n{err}"
    alike = doctest.OutputChecker().check_output(command.shown, out + err, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert alike or not command.shown.strip(), f"{command.words}\n{out}\n{err}"
    return out


def check_spoken(trivet: Trivet, arguments: list[str]) -> None:
    """The program has this command and its options; nothing is run."""
    code, _, err = trivet(*arguments, "--help")
    assert code == 0, f"{arguments}: {err}"


def load_shown(text: str) -> None:
    """A machine file lies there under the name of the machine."""
    path = Path(f"{tomllib.loads(text)['about']['name']}.toml")
    path.write_text(text, encoding="utf-8")
    assert load(path).name == path.stem


READ: dict[str, tuple[str, Callable[[str], object]]] = {
    "toml set-up": ("shown.toml", t.read_setup),
    "toml study": ("study.toml", t.read_study),
    "toml tolerances": ("tolerances.toml", t.read_tolerances),
    "csv": ("shown.csv", t.read_functions),
}
"""Files by their kinds: under which name they lie there, and what reads them."""


class Reader:
    """Does with blocks of a page, one after the other, what their kinds ask for."""

    def __init__(self, trivet: Trivet, capfd: pytest.CaptureFixture[str], page: str) -> None:
        self.trivet, self.capfd, self.page = trivet, capfd, page
        self.names: dict[str, object] = {}
        self.printed = ""
        self.said: list[tuple[Command, str]] = []

    def read(self, text: str) -> None:
        """All of a page."""
        for fence in fences(text, self.page):
            self.take(*fence)

    def take(self, kind: str, text: str) -> None:
        match kind:
            case "console":
                self.said += [(command, run_command(self.trivet, command)) for command in commands(text)]
                self.printed = "".join(out for _, out in self.said)
            case "console not run":
                for command in commands(text):
                    check_spoken(self.trivet, command.arguments)
            case "text not run":
                for arguments in spoken(text):
                    check_spoken(self.trivet, arguments)
            case "text usage":
                check_spoken(self.trivet, [word for word in text.split()[1:] if word.islower()])
            case "text":
                assert "".join(text.split()) in "".join(self.printed.split()), f"no command above prints: {text}"
            case "python":
                exec(compile(text, self.page, "exec"), self.names)
                self.capfd.readouterr()
            case "toml":
                load_shown(text)
            case "toml piece":
                tomllib.loads(text)
            case kind if kind in READ:
                file, read = READ[kind]
                Path(file).write_text(text, encoding="utf-8")
                read(file)
            case _:
                assert kind == "math", "what the site sets"


NEEDS = {"solids.md": pytest.mark.peer("scikit-fem", module="skfem")}


@pytest.mark.usefixtures("own_kernels")
@pytest.mark.parametrize(
    "page", [pytest.param(page, id=page.name, marks=NEEDS.get(page.name, ())) for page in PAGES if page.name != "json.md"]
)
def test_examples_work(page: Path, trivet: Trivet, capfd: pytest.CaptureFixture[str]) -> None:
    """Block after block in one folder, and in one process."""
    Reader(trivet, capfd, page.name).read(page.read_text(encoding="utf-8"))


def keys_of(value: Any) -> set[str]:
    """All keys of a JSON document, at any depth."""
    if isinstance(value, dict):
        return set(value).union(*map(keys_of, value.values()))
    return set().union(*map(keys_of, value)) if isinstance(value, list) else set()


def told_of_json(page: str) -> Iterator[tuple[tuple[str, ...], set[str], bool]]:
    """Rows of the table: commands, the keys that are told of them but for those cut short, and whether an option makes them."""
    of: tuple[str, ...] = ()
    for line in page.splitlines():
        if line.startswith(("| `", "| |")):
            _, command, keys, meaning, _ = re.split(r"(?<!\\)\|", line)
            of = tuple(re.findall("`([^`]+)`", command)) or of
            paths = [key for key in re.findall("`([^`]+)`", keys) if "…" not in key and "NAME" not in key]
            yield of, {part for path in paths for part in re.split(r"(?:\[\])?\.|\[\]", path) if part}, "with `--" in meaning


FILES = ("accuracy", "sweep", "optimise", "sensitivity")
"""Commands of which the page tells every key; of others what explains itself is left out."""
OTHERWISE = {
    "plan": {"rate_m_per_rad", "open", "open_at", "met_there"},
    "modes": {
        "branches", "mode_number", "MAC", "steps", "encounters", "kind", "gap_Hz", "exchange_rad", "poses", "place", "doubts"
    },
}  # fmt: skip
"""Keys of other cases than those which the page runs: a drive that turns fastest, a proof that is open, a path."""


@pytest.mark.usefixtures("own_kernels")
def test_json_is_as_its_page_tells(trivet: Trivet, capfd: pytest.CaptureFixture[str]) -> None:
    """What the page tells of commands that it runs is printed; of those of files all that is printed is told."""
    reader = Reader(trivet, capfd, "json.md")
    reader.read(text_of("json.md"))
    documents = [(command.arguments, json.loads(out)) for command, out in reader.said]
    told: dict[str, set[str]] = {}
    for of, keys, is_of_option in told_of_json(text_of("json.md")):
        told[of[0]] = told.get(of[0], set()) | keys
        found = [keys_of(own) for words, own in documents if any(set(name.split()) <= set(words) for name in of)]
        if found and not is_of_option:
            assert keys - OTHERWISE.get(of[0], set()) <= set().union(*found), of
    for name in FILES:
        (document,) = (own for words, own in documents if words[0] == name)
        assert set(document) <= told[name], name


def test_commands_in_the_text_are_there(trivet: Trivet) -> None:
    for arguments in sorted({tuple(own) for page in PAGES for own in spoken_inline(page.read_text(encoding="utf-8"))}):
        check_spoken(trivet, list(arguments))


MACHINE = 'format = 1\n[about]\nname = "bare"\n'
FAULTS = {
    "an unknown kind": ("```bash\ntrivet list\n```", "is no kind of block"),
    "no kind": ("```\ntrivet list\n```", "is no kind of block"),
    "indented": ("Say\n\n    $ trivet list\n", "only indented"),
    "no reason": ("```text not run\ntrivet list\n```", "has a reason"),
    "another program": ("```console\n$ make compare\n```", "only trivet is run"),
    "no command": ("```console\ntrivet list\n```", "begins with a command"),
    "an indented command": ("```console\n$ trivet list\n   $ trivet lisst\n```", "are indented"),
    "a wrong command": ("```console\n$ trivet lisst\n```", "No such command"),
    "another exit code": ("```console\n$ trivet list  # exit code 1\n```", "trivet list"),
    "other words": ("```console\n$ trivet list\nMachines of the stable\n...\n```", "trivet list"),
    "a wrong option of what is not run": (
        "```console not run: serves\n$ trivet view azulay --no-brouser\n```",
        "No such option",
    ),
    "a wrong option in a text": ("```text not run: ssh\nssh there trivet view --prt 8080\n```", "No such option"),
    "what nothing prints": ("```console\n$ trivet list\n```\n```text\nMachines of the stable\n```", "no command above prints"),
    "broken TOML": ("```toml piece\na = \n```", "Invalid value"),
    "a broken machine": (f"```toml\n{MACHINE}```", "bare.toml: "),
    "no machine": ("```toml\na = 1\n```", "about"),
    "a broken set-up": ("```toml set-up\na = 1\n```", "shown.toml: "),
    "broken tolerances": ("```toml tolerances\n[[play]]\njoints = 1\n```", "tolerances.toml: "),
    "a broken table": ("```csv\n1,2\n```", "shown.csv: "),
    "a broken example": ("```python\nassert 1 > 2, 'more'\n```", "more"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_no_fault_of_a_page_passes(fault: str, trivet: Trivet, capfd: pytest.CaptureFixture[str]) -> None:
    page, words = FAULTS[fault]
    with pytest.raises((AssertionError, KeyError, ValueError), match=words):
        Reader(trivet, capfd, "page.md").read(page)


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
    for line in "".join([*maker("make_reference").pages().values(), maker("make_commands").page()]).splitlines():
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
