"""Documents as pages and on paper: what is said arrives as it is, nothing is asked for, nothing is left behind."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from html.parser import HTMLParser
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
from documents import message_of
from PIL import Image

from trivet.errors import NoResultError
from trivet.files import borrowed_folder, remove_begun
from trivet.report import printing
from trivet.report.document import Block, Document, Listing, Picture, Plot, Section, Table, Words, write_document
from trivet.report.page import page_of

HOSTILE = "</script><script>alert(1)</script> & \"'><img src=x onerror=alert(2)> {{ 7*7 }} <!--"
chromium = pytest.mark.peer("chromium", program="chromium")
VOID = {"meta", "img", "br", "link", "input"}


class Read(HTMLParser):
    """What a browser makes of a page: elements with their attributes and texts, each closed in its turn."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.texts: list[str] = []
        self.within: list[int] = []
        self.feed(text)
        self.close()
        assert self.within == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        self.texts.append("")
        if tag not in VOID:
            self.within.append(len(self.elements) - 1)

    def handle_endtag(self, tag: str) -> None:
        assert self.elements[self.within.pop()][0] == tag

    def handle_data(self, data: str) -> None:
        for number in self.within:
            self.texts[number] += data

    def all(self, tag: str) -> list[tuple[dict[str, str], str]]:
        pairs = zip(self.elements, self.texts, strict=True)
        return [(attributes, text) for (name, attributes), text in pairs if name == tag]


def png(width: int = 8, height: int = 6) -> bytes:
    made = io.BytesIO()
    Image.new("RGB", (width, height), "#0072B2").save(made, "PNG")
    return made.getvalue()


def curve(name: str = "x") -> go.Figure:
    return go.Figure([go.Scatter(x=[0, 1, 2], y=[0, 1, 0], name=name)]).update_layout(title="gone", width=5000)


def document(*blocks: Block, title: str = "Title", word: str = "word") -> Document:
    inner = Section(word, blocks, (Section("Deeper", (Words(word),)),))
    return Document(title, word, (Section("First", (Words("one"),), (inner,)), Section("Second", ())), ((word, word),))


def every(word: str) -> tuple[Block, ...]:
    return (
        Words(word), Table(word, (word, "n"), ((word, "1"),)), Picture(word, word, png()), Plot(word, word, curve(word)),
        Listing(word, word),
    )  # fmt: skip


def policy(page: Read) -> str:
    (found,) = (a["content"] for a, _ in page.all("meta") if a.get("http-equiv") == "Content-Security-Policy")
    return found


def test_hostile_words_are_words() -> None:
    plain, hostile = (Read(page_of(document(*every(w), title=w, word=w))) for w in ("word", HOSTILE))
    assert [tag for tag, _ in hostile.elements] == [tag for tag, _ in plain.elements]
    assert not [name for _, attributes in hostile.elements for name in attributes if name.startswith("on")]
    for tag in ("title", "h1", "h3", "p", "th", "td", "figcaption", "code", "dt", "dd"):
        assert any(HOSTILE in text for _, text in hostile.all(tag)), tag
    assert HOSTILE in [a["alt"] for a, _ in hostile.all("img")]
    (data,) = (text for a, text in hostile.all("script") if "data-plot" in a)
    assert json.loads(data)["data"][0]["name"] == HOSTILE


def test_a_page_asks_nobody() -> None:
    page = Read(page_of(document(*every("word"))))
    assert not page.all("link")
    assert not page.all("base")
    for tag, attributes in page.elements:
        for name in ("src", "href", "action", "srcset", "data"):
            assert attributes.get(name, "#").startswith(("#", "data:image/png;base64,")), (tag, attributes)
    assert "@import" not in page.all("style")[0][1]
    assert "url(" not in page.all("style")[0][1]


def test_scripts_are_those_that_the_head_names() -> None:
    two = Read(page_of(document(Plot("a", "a", curve()), Plot("b", "b", curve()))))
    scripts = [text for attributes, text in two.all("script") if "type" not in attributes]
    sums = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts]
    assert re.findall(r"'sha256-([^']+)'", policy(two)) == sums
    assert sum("plotly.js v" in text[:400] for text in scripts) == 1, "once, however many plots there are"
    assert "unsafe-eval" not in policy(two)
    none = Read(page_of(document(Words("word"))))
    assert none.all("script") == []
    assert "script-src 'none'" in policy(none)
    for page in (two, none):
        assert policy(page).startswith("default-src 'none'; img-src data:")


def test_a_page_can_be_found_around_in() -> None:
    page = Read(page_of(document(*every("word"))))
    names = Counter(a["id"] for _, a in page.elements if "id" in a)
    assert set(names.values()) == {1}
    targets = [a["href"][1:] for a, _ in page.all("a")]
    assert set(targets) <= set(names)
    assert {a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a} <= set(names)
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h\d", tag)]
    assert levels == [1, 2, 2, 3, 4, 2, 2], "title; contents; 1, 1.1, 1.1.1; 2; provenance"
    assert [" ".join(text.split()) for _, text in page.all("h3")] == ["1.1 word"]
    assert {f"section-{n}" for n in ("1", "1-1", "1-1-1", "2")} <= set(targets)
    assert page.all("html")[0][0]["lang"] == "en"
    assert page.all("title")[0][1] == "Title"
    assert all(a["alt"] for a, _ in page.all("img"))
    assert all("aria-label" in a for _, a in page.elements if "tabindex" in a and a.get("id") != "start")
    scrolling = [a for tag, a in page.elements if tag == "pre" or a.get("class") == "scrolling"]
    assert [a.get("tabindex") for a in scrolling] == ["0"] * 3, "the table, the picture, the listing"


def test_numbers_stand_to_the_right() -> None:
    heads = ("name", "number", "unit", "exponent", "share", "part", "range", "topology", "none")
    rows = (
        ("a", "1.5", "33566 N m/rad", "9.1e-07", "3 %", "", "0 to 350", "3 × [P]RS", ""),
        ("7", "-2", "-5 °/s", "1", "-0.1 %", "1", "1", "1", ""),
    )
    page = Read(page_of(document(Table("caption", heads, rows))))
    aligned = [text for a, text in page.all("th") if a.get("class") == "number"]
    assert aligned == ["number", "unit", "exponent", "share", "part"]
    assert sum(a.get("class") == "number" for a, _ in page.all("td")) == 2 * len(aligned)
    bare = Read(page_of(document(Table("caption", ("", ""), (("a", "b"),)))))
    assert bare.all("thead") == []


def test_only_what_is_in_space_can_be_turned() -> None:
    body = go.Figure([go.Scatter3d(x=[0, 1], y=[0, 1], z=[0, 1])])
    page = Read(page_of(document(Plot("curve", "curve", curve()), Plot("body", "body", body))))
    captions = [text for _, text in page.all("figcaption")]
    assert ["can be turned and zoomed" in text for text in captions] == [False, True]
    assert all("zoomed, and says its values" in text for text in captions)


def test_pictures_are_inside() -> None:
    own, still = png(5), png(7)
    page = Read(page_of(document(Picture("a", "a", own), Plot("b", "b", curve(), still), Plot("c", "c", curve()))))
    sources = [a.get("src", "") for a, _ in page.all("img")]
    assert [base64.b64decode(s.partition(",")[2]) for s in sources] == [own, still, b""]
    for _, text in page.all("script")[:2]:
        layout = json.loads(text)["layout"]
        assert "title" not in layout, "the caption says it"
        assert "width" not in layout, "it is as wide as the page"


def test_files_appear_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "report.html"
    write_document(document(), path)
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert "exists already" in message_of(lambda: write_document(document(), path))
    write_document(document(title="Other"), path, overwrite=True)
    assert "<title>Other</title>" in path.read_text(encoding="utf-8")
    said = message_of(lambda: write_document(document(), tmp_path / "report.htm"))
    assert "a report ends in .html (a page) or .pdf (printed); name it report.html, say" in said
    assert "report ends in" in message_of(lambda: write_document(document(), tmp_path / "report"))
    monkeypatch.setattr("trivet.report.page.page_of", lambda document: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_document(document(), tmp_path / "none.html")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


@chromium
def test_paper(tmp_path: Path) -> None:
    write_document(document(*every("word"), title="A title on paper"), tmp_path / "report.pdf")
    data = (tmp_path / "report.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert re.search(rb"/Title \(A title on paper\)\s*/Creator", data)
    assert len(re.findall(rb"/Type /Page\b", data)) >= 3, "a page for every section"
    assert [p.name for p in tmp_path.iterdir()] == ["report.pdf"]


def fake(folder: Path, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A browser that does something else."""
    (folder / "bin").mkdir()
    program = folder / "bin" / "chromium"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder / 'bin'}:/usr/bin:/bin")
    (folder / "tmp").mkdir()
    monkeypatch.setenv("TMPDIR", str(folder / "tmp"))
    monkeypatch.setattr("tempfile.tempdir", None)


@pytest.mark.parametrize(
    ("script", "words"),
    [("echo no display >&2; exit 3", "ended with 3: no display"), ("exit 0", "printed nothing"), ("sleep 60", "within 0.5 s")],
)
def test_browsers_that_fail(script: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake(tmp_path, script, monkeypatch)
    monkeypatch.setattr(printing, "TIMEOUT", 0.5)
    with pytest.raises(NoResultError, match=words) as told:
        write_document(document(), tmp_path / "report.pdf")
    assert "\n" not in str(told.value)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bin", "tmp"]
    assert list((tmp_path / "tmp").iterdir()) == []


def test_no_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(NoResultError, match=r"Chromium, Chrome nor Edge .*; install one, or write \.html"):
        write_document(document(), tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []


def alive(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def heeding() -> None:
    """Commands that ran here before may have left interruptions ignored."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks at processes in /proc")
def test_whoever_interrupts_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the browser nor its children nor their folder."""
    fake(tmp_path, f"echo > $TMPDIR/left; sleep 1000 & echo $$ $! > {tmp_path}/running; wait", monkeypatch)
    code = (
        "import sys; sys.argv = ['trivet']\n"
        "import trivet.cli, trivet.cli.app\n"
        "from trivet.report.document import Document, write_document\n"
        "def app(**_): write_document(Document('t', 'l', (), ()), 'report.pdf')\n"
        "trivet.cli.app.app = app\n"
        "trivet.cli.program()\n"
    )
    command = [sys.executable, "-c", code]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, preexec_fn=heeding)
    end = time.monotonic() + 60
    while not (tmp_path / "running").exists() or not (tmp_path / "running").read_text().strip():
        assert time.monotonic() < end
        assert process.poll() is None, process.stderr and process.stderr.read()
        time.sleep(0.02)
    children = [int(number) for number in (tmp_path / "running").read_text().split()]
    assert all(map(alive, children))
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (130, "trivet: interrupted\n")
    while any(map(alive, children)):
        assert time.monotonic() < end
        time.sleep(0.02)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bin", "running", "tmp"]
    assert list((tmp_path / "tmp").iterdir()) == []


def test_folders_vanish_however_often_their_end_is_interrupted(monkeypatch: pytest.MonkeyPatch) -> None:
    tries = iter((KeyboardInterrupt(), SystemExit(143), None))
    remove = shutil.rmtree

    def interrupted(folder: str, ignore_errors: bool) -> None:
        if (fault := next(tries)) is not None:
            raise fault
        remove(folder, ignore_errors)

    monkeypatch.setattr("shutil.rmtree", interrupted)
    with pytest.raises(SystemExit), borrowed_folder() as folder:
        (folder / "file").write_text("text")
    assert not folder.exists()
    monkeypatch.undo()
    with borrowed_folder() as folder:
        (folder / "file").write_text("text")
        remove_begun()
        assert not folder.exists(), "also for who leaves without ending the block"


def wide() -> Document:
    """Whatever could be wider than a phone."""
    rng = np.random.default_rng(1)
    x, y, z = rng.normal(size=(3, 12))
    body = go.Figure([go.Mesh3d(x=x, y=y, z=z, alphahull=0, color="#0072B2")])
    body.update_layout(scene_camera_eye={"x": 1.0, "y": 1.0, "z": 1.0})
    heads = tuple(f"column {k}" for k in range(20))
    return document(
        Words("w" * 300), Table("wide", heads, (tuple("1234567.8 mm" for _ in heads),) * 3),
        Table("narrow", ("", "one"), (("tilt of the platform " * 6, "3 × [P]RS, chains " * 6), ("number", "1.234"))),
        Picture("picture", "alt", png(3000, 40)),
        Plot("curve", "curve", curve(), png(900, 500)), Plot("body", "body", body), Listing("long", "x" * 500 + "\n" * 90),
        title="t" * 60, word="v" * 100,
    )  # fmt: skip


@chromium
def test_in_a_browser(tmp_path: Path) -> None:
    """From file:// without a network, on a desk and on a phone, in light and dark, with the keyboard."""
    from playwright.sync_api import sync_playwright

    path = tmp_path / "report.html"
    write_document(wide(), path)
    options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=options)
        papers = set()
        for scheme, (width, height) in product(("light", "dark"), ((1280, 800), (390, 844))):
            view = {"width": width, "height": height}
            context = browser.new_context(viewport=view, color_scheme=scheme, offline=True)
            papers.add(look_at(context.new_page(), path.as_uri()))
            context.close()
        assert len(papers) == 2, "light and dark"
        browser.close()


def shaded(page: Any) -> list[bool]:
    """Whether a table is shaded at its left and its right edge, between its lines."""
    taken = Image.open(io.BytesIO(page.locator(".scrolling").first.screenshot())).convert("L")
    own = np.asarray(taken, dtype=float)[4]
    return [abs(float(edge) - float(np.median(own))) > 10 for edge in (own[2], own[-3])]


def look_at(page: Any, address: str) -> str:
    """The colour of the page, after a look that all is well on it."""
    faults: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.wait_for_selector("html[data-drawn=all]", state="attached", timeout=120_000)
    assert page.locator(".plot .main-svg").count() > 1
    assert page.locator(".plot canvas").count() >= 1, "the body can be turned"
    assert page.evaluate("[...document.querySelectorAll('img.still')].every(one => one.src.startsWith('data:image/'))")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.evaluate(
        "document.querySelectorAll('.scrolling')[0].scrollWidth > document.querySelectorAll('.scrolling')[0].clientWidth"
    )
    assert shaded(page) == [False, True], "there is more to the right"
    assert page.evaluate("(own => own.scrollWidth <= own.clientWidth)(document.querySelectorAll('.scrolling')[1])"), "wraps"
    page.evaluate("document.querySelectorAll('.scrolling')[0].scrollLeft = 1e6")
    assert shaded(page) == [True, False], "there is more to the left"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "scrolling", "a table that can be scrolled"
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
    assert faults == []
    found: str = page.evaluate("getComputedStyle(document.body).backgroundColor")
    return found


@chromium
def test_paper_shows_stills(tmp_path: Path) -> None:
    """On paper every plot is a picture, also one that brought none; the machine file is not cut off."""
    from playwright.sync_api import sync_playwright

    path = tmp_path / "report.html"
    write_document(wide(), path)
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page()
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-drawn=all]", state="attached", timeout=120_000)
        page.emulate_media(media="print")
        assert page.locator(".plot:visible").count() == 0
        assert page.locator("img.still:visible").count() == 2
        assert page.evaluate("[...document.querySelectorAll('img.still')].every(one => one.naturalWidth > 100)")
        assert page.evaluate("document.querySelector('pre').clientHeight > 90 * 10"), "all of its lines"
        browser.close()
    assert os.listdir(tmp_path) == ["report.html"]


def test_what_nobody_sees_is_told() -> None:
    page = page_of(document(Words("a\0b\u202ec"), title="t\u202e"))
    assert "\0" not in page
    assert "\u202e" not in page
    assert "a\\x00b\\u202ec" in page
