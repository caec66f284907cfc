"""Reports of machines: what they say is what commands say, what cannot be said has a reason, wrong input is refused at once."""

from __future__ import annotations

import dataclasses
import html
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from documents import message_of
from test_measure_correlate_cli import SETUP, fit, measured, setup
from test_report_document import HOSTILE, Read, heeding

import trivet as t
from trivet.errors import NoResultError
from trivet.measure.files.by_suffix import save_functions
from trivet.measure.functions import Channel
from trivet.report.document import Block, Document, Listing, Picture, Plot, Section, Table, Words
from trivet.report.making import TELL, report_of, subject_of
from trivet.report.page import page_of
from trivet.report.sections import OWN, SECTIONS, comparison, stiffness
from trivet.report.sections.measured import Measurement
from trivet.report.subject import CheckPoints, Subject

Trivet = Callable[..., tuple[int, str, str]]
"""The fixture of that name."""
FEW = CheckPoints(steps=2)
STUDIES = (
    "home", "tilt", "workspace", "singularity", "singularities", "comparison", "dynamics", "modes", "response", "motion",
)  # fmt: skip


def subject(name: str = "azulay", points: CheckPoints = FEW) -> Subject:
    return subject_of(name, points=points)


def sections(found: tuple[Section, ...]) -> Iterator[Section]:
    for section in found:
        yield section
        yield from sections(section.sections)


def blocks(document: Document, kind: type[Block]) -> list[Block]:
    return [block for section in sections(document.sections) for block in section.blocks if isinstance(block, kind)]


def commands(section: Section) -> list[list[str]]:
    found = [block.text for block in section.blocks if isinstance(block, Listing) and block.caption == "To repeat it"]
    return [shlex.split(line) for text in found for line in text.splitlines()]


def rows(document: Document | Section) -> list[tuple[str, ...]]:
    own = sections((document,) if isinstance(document, Section) else document.sections)
    return [row for section in own for block in section.blocks if isinstance(block, Table) for row in block.rows]


@pytest.fixture(scope="module")
def whole() -> Document:
    return report_of([subject()], command="the command")


def test_everything_is_told(whole: Document) -> None:
    assert [section.heading for section in whole.sections] == [
        "At a glance", "Beside published values", "The machine", "At home", "Reach", "Singularities",
        "Stiffness over the hemisphere", "Vibration", "Dynamics of a motion", "The machine file",
    ]  # fmt: skip
    assert not [words for words in blocks(whole, Words) if "nothing to show" in words.text]
    assert len(blocks(whole, Plot)) == 2, "the machine, its responses"
    assert len(blocks(whole, Picture)) == 8
    leaves = [section for section in sections(whole.sections) if not section.sections and section.heading != "At a glance"]
    assert all(commands(section) for section in leaves), "every section says how it is repeated"
    facts = dict(row for row in rows(whole.sections[0]))
    assert "–" not in facts.values()
    assert len(facts) == 15
    assert float(facts["workspace reached from home, cm³"]) < float(facts["workspace, pose by pose, cm³"])
    assert "tilt reached from home on the sphere of 4 mm, best roll, °" in facts


def test_all_sections_are_told_and_documented() -> None:
    assert tuple(TELL) == OWN
    page = (Path(__file__).parents[1] / "docs" / "report.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) == set(SECTIONS)


def test_masses_agree(whole: Document) -> None:
    """What moves at home is what vibrates and what rods have in their guides; the report says so where it gives either."""
    told = " ".join(block.text for block in blocks(whole, Words))
    (hidden, left), (less,) = (
        re.findall(r"([\d.]+) kg of that is inside .*?: ([\d.]+) kg vibrate", told)[0],
        re.findall(r"That is ([\d.]+) kg less than what moves", told),
    )
    (vibrating,) = re.findall(r"of the machine's ([\d.]+) kg", told)
    assert (hidden, left) == (less, vibrating)
    moving = dict(row for row in rows(whole.sections[0]))["mass of what moves, kg"]
    assert float(hidden) + float(left) == pytest.approx(float(moving), rel=1e-3)


def test_numbers_are_those_of_the_studies(whole: Document) -> None:
    facts = dict(row for row in rows(whole.sections[0]))
    found = t.stiffness_map("azulay", subject().surface)
    for axis in ("xx", "yy", "zz"):
        mean = np.nanmean(found.diagonal(f"K_{axis}")) / 1e6
        assert float(facts[f"K_{axis}, mean over the check points, N/µm"]) == pytest.approx(mean, rel=1e-3)
    assert float(facts["lowest natural frequency, Hz"]) == pytest.approx(t.modes("azulay").frequency[0], rel=1e-3)
    assert float(facts["mass of what moves, kg"]) == pytest.approx(sum(t.pose("azulay").masses.values()), rel=1e-3)


@pytest.mark.parametrize("heading", ["The machine", "At home", "Tilt", "Over the hemisphere", "Stiffness over the hemisphere"])
def test_commands_repeat_what_they_say(heading: str, whole: Document, trivet: Trivet) -> None:
    """What the command of a section prints holds every cell of its tables."""
    # "At home" is told of the pose and of singularities; the pose comes first.
    (found, *_) = (section for section in sections(whole.sections) if section.heading == heading)
    ((program, *arguments),) = commands(found)
    assert program == "trivet"
    code, out, _ = trivet(*arguments)
    assert code == 0
    printed = "".join(out.split())
    own = ("what the numbers rest on", "masses of what moves")
    tables = [block for block in found.blocks if isinstance(block, Table) and block.caption not in own]
    assert tables
    for cell in (cell for table in tables for row in table.rows for cell in row):
        for word in cell.split():
            assert word in printed, (cell, out)


def test_the_file_is_that_of_the_machine(whole: Document, tmp_path: Path) -> None:
    (listing,) = (block for block in whole.sections[-1].blocks if isinstance(block, Listing) and "file" in block.caption)
    path = tmp_path / "again.toml"
    path.write_text(listing.text, encoding="utf-8")
    assert t.dimensions(t.load(path)) == t.dimensions(t.load("azulay"))
    told = dict(whole.provenance)
    assert told["machine file of azulay"].split()[1].rstrip(",") == sha256(path.read_bytes()).hexdigest()
    assert {"trivet", "jax", "numpy", "scipy", "Python", "date"} <= set(told)
    assert told["command"] == "the command"


@pytest.fixture
def no_stills(monkeypatch: pytest.MonkeyPatch) -> None:
    """Machines that are drawn are drawn by other tests."""
    monkeypatch.setattr("trivet.report.sections.machine.drawn", lambda *_: b"")


@pytest.mark.usefixtures("no_stills")
def test_settings_and_switches_count_and_are_in_every_command(trivet: Trivet, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Subject] = []

    def none(self: Subject) -> None:
        asked.append(self)
        raise NoResultError("nothing")

    monkeypatch.setattr(Subject, "comparison", property(none))
    settings = ("--set", "link.length=210 mm", "--set", "home.position=0 mm,0 mm,120 mm")
    options = ("--spherical", "300 N m/rad", "--guide", "rotation", "--drives", "rigid", "--shear", "--mode=++ ++ ++")
    others = ("--sections", " machine,", "--sections", "stiffness", "--steps", "3", "--radius", "5 mm", "-o", "report.html")
    word = "azulay@link.length=210 mm,home.position=0 mm,0 mm,120 mm"
    code, out, err = trivet("report", "azulay", *settings, *options, *others)
    assert (code, out) == (0, "")
    assert [re.sub(r"\d+ s", "0 s", line) for line in err.splitlines()] == [
        f"{word}: machine (0 s)",
        f"{word}: stiffness (0 s)",
        "trivet: warning: Stiffness over the hemisphere: There is nothing to show here. nothing",
        "wrote report.html",
    ], "sections one by one, the empty one, and the file by its name as given"
    page = html.unescape(Path("report.html").read_text(encoding="utf-8"))
    for words in ("elastic: they resist", "Timoshenko", "along the circle, turning with it", "210 mm", "0 mm, 0 mm, 120 mm"):
        assert words in page
    (line,) = re.findall(r"<code>(trivet map .*)</code>", page)
    own = ["map", word, "--figure", "stiffness.png", "--steps", "3", "--radius", "5 mm"]
    assert shlex.split(line) == ["trivet", *own, *options]
    found = asked[0]
    length, home = float(found.machine.chains["leg"].elements[3].length), found.machine.home.position
    assert (length, home) == (0.21, (0.0, 0.0, 0.12))
    assert found.machine == t.switched(t.load("azulay", {"link.length": "210 mm", "home.position": "0 mm,0 mm,120 mm"}),
                                       "300 N m/rad", "rotation", True, "rigid")  # fmt: skip
    assert len(found.surface) == len(t.hemisphere(0.121, 0.005, 3))


@pytest.mark.usefixtures("no_stills")
@pytest.mark.parametrize("name", t.catalogue())
def test_every_machine_of_the_catalogue(name: str) -> None:
    found = report_of([subject(name)], ["machine", "file"])
    assert not [words for words in blocks(found, Words) if "nothing to show" in words.text]
    assert len(blocks(found, Plot)) == 1
    assert rows(found.sections[0])[0][1] == t.load(name).about.title


@pytest.mark.usefixtures("no_stills")
def test_hostile_machine_files_are_words() -> None:
    own = t.load("azulay")
    pages = []
    for word in ("word", HOSTILE):
        notes = tuple(dataclasses.replace(note, source=word) for note in own.about.notes)
        about = dataclasses.replace(own.about, title=word, description=word, source=word, notes=notes)
        machine = dataclasses.replace(own, about=about)
        pages.append(Read(page_of(report_of([subject_of(machine, points=FEW)], ["machine", "file"]))))
    plain, hostile = pages
    assert [tag for tag, _ in hostile.elements] == [tag for tag, _ in plain.elements]
    assert sum(HOSTILE in text for _, text in hostile.all("td")) == 1 + len(own.about.notes)
    assert HOSTILE in "".join(text for _, text in hostile.all("header"))


@pytest.mark.usefixtures("no_stills")
def test_what_cannot_be_told_has_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever fails, the rest is told; and what fails does so once per place."""

    def fails(self: Subject) -> None:
        raise NoResultError("the reason")

    for study in STUDIES:
        monkeypatch.setattr(Subject, study, property(fails))
    found = report_of([subject("azulay"), subject("eclipse")], [name for name in SECTIONS if name != "measured"])
    told = [words.text for words in blocks(found, Words) if "nothing to show" in words.text]
    assert len(told) == 2 + 2 * 9, "two halves of the comparison; per machine home, tilt, workspace, …"
    assert all("the reason" in words for words in told)
    facts = rows(found.sections[0])
    assert {cell for row in facts[2:] for cell in row[1:]} == {"–"}


@pytest.mark.parametrize(("height", "empty"), [("30 mm", {"At home", "Dynamics of a motion"}), ("400 mm", set())])
def test_a_home_that_is_not_reached_is_told_in_one_line(height: str, empty: set[str], trivet: Trivet) -> None:
    """Early, and once more with all sections that stay empty for it: key, chain or joint, and the height that would do."""
    place = ("--set", f"home.position=0 mm,0 mm,{height}")
    shown = ("--sections", "machine,home,dynamics", "-o", "report.html")
    code, _, err = trivet("report", "azulay", *place, *shown)
    first, last = (line for line in err.splitlines() if "warning" in line)
    reason = first.removeprefix("trivet: warning: ")
    assert code == 0
    assert re.search(
        rf"home\.position 0 mm, 0 mm, {height}: the pose is not reached: leg-1.*; with z at [\d.]+ mm it is$", reason
    )
    headings, _, told = last.removeprefix("trivet: warning: ").partition(": There is nothing to show here. ")
    assert told == reason
    assert set(headings.split(", ")) == (empty or {"The machine", "At home", "Dynamics of a motion"})
    page = html.unescape(Path("report.html").read_text(encoding="utf-8"))
    assert page.count(f"There is nothing to show here. {reason}") == len(headings.split(", "))


def test_a_singular_curve_across_the_check_points_is_minded() -> None:
    """Statistics over both of its sides say so; without a curve, or where it cannot be told, nothing is said."""
    one = subject()
    for curves, words in (((), ""), ((1,), "Mind: a curve of Type 2"), ((1, 2), "Mind: 2 curves of Type 2")):
        vars(one)["singularities"] = SimpleNamespace(curves=curves)
        last = stiffness.section(one).blocks[-2]
        assert isinstance(last, Words) == bool(words)
        assert getattr(last, "text", "").startswith(words)


def test_a_machine_without_a_hemisphere_is_left_out_of_a_comparison() -> None:
    bare = dataclasses.replace(t.load("azulay"), workpiece=None).renamed("bare")
    found = comparison.section([subject("azulay"), subject_of(bare, points=FEW)])
    static = found.sections[0]
    words = [block.text for block in static.blocks if isinstance(block, Words)]
    assert "Left out: bare: has no [workpiece]; give the radius and the height of the hemisphere" in words
    names = {row[0] for row in rows(static)}
    assert "azulay" in names
    assert "bare" not in names
    assert commands(static)[0][:4] == ["trivet", "compare", "azulay", "bare.toml"]


def test_several_machines_stand_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Subject, "dynamics", property(lambda self: (_ for _ in ()).throw(NoResultError("none"))))
    found = report_of([subject("azulay"), subject("azulay@link.length=210 mm")], ["comparison", "file"])
    assert [s.heading for s in found.sections] == ["At a glance", "Side by side", "azulay", "azulay@link.length=210 mm"]
    assert found.title == "Report on azulay and azulay@link.length=210 mm"
    assert {row[0] for row in rows(found)} >= {"azulay - azulay@link.length=210 mm"}, "tested against each other"


def test_measured_responses(trivet: Trivet) -> None:
    save_functions(measured(), "measured.nc")
    Path("setup.toml").write_text(SETUP, encoding="utf-8")
    given = ("--measured", "measured.nc", "--setup", "setup.toml")
    code, _, err = trivet("report", "azulay", *given, "--sections", "measured", "-o", "report.html")
    assert (code, "warning" in err) == (0, False)
    page = Path("report.html").read_text(encoding="utf-8")
    assert "FRAC" in page
    assert page.count("data:image/png") == 2
    (line,) = re.findall(r"<code>(trivet measure correlate .*)</code>", page)
    assert line.startswith("trivet measure correlate measured.nc azulay --setup setup.toml")
    for name in ("measured.nc", "setup.toml"):
        assert f"SHA-256 {sha256(Path(name).read_bytes()).hexdigest()}" in page
    Path("other.toml").write_text('[points.h]\non = "leg-1.hinge"\n', encoding="utf-8")
    code, _, err = trivet("report", "azulay", *given[:3], "other.toml", "-o", "other.html")
    assert code == 2
    assert err.startswith("trivet: point 1: the set-up does not say where it is")


def test_measurements_that_do_not_go_with_a_machine() -> None:
    at = subject()
    elsewhere = fit()._replace(channels=tuple(Channel(f"x{k}", (1.0, 0.0, 0.0)) for k in range(len(fit().channels))))
    Measurement("a", "b", "c", measured(), setup(), fit()).check(at)
    idle = Measurement("a", "b", None, measured().between(0, 0), setup(), None)
    assert "there are none at frequencies above zero" in message_of(lambda: idle.check(at))
    other = Measurement("a", "b", "c", measured(), setup(), elsewhere)
    assert "the fit has none of the channels" in message_of(lambda: other.check(at))


WRONG = [
    (("azulay", "-o", "report.txt"), "report.txt: a report ends in .html (a page) or .pdf (printed); name it report.html"),
    (("azulay", "-o", "report"), "report: a report ends in .html (a page) or .pdf (printed); name it report.html"),
    (("azulay", "--sections", "", "-o", "report.html"), "sections: none is named; choose from machine, home, reach"),
    (("azulay", "--sections", " , ", "-o", "report.html"), "or leave sections out to be told all"),
    (("azulay", "-o", "none/report.html"), "report.html: cannot be written"),
    (("azulay", "-o", "there.html"), "trivet: there.html: exists already"),
    (("azulay",), "Missing option '--output'"),
    (("azulays", "-o", "report.html"), "azulays: no machine of this name"),
    (("azulay", "azulay", "-o", "report.html"), "azulay: given twice"),
    (("azulay", "--mode", "+", "-o", "report.html"), "mode"),
    (("azulay", "--sections", "stifness", "-o", "report.html"), "section 'stifness' is not known; did you mean 'stiffness'"),
    (("azulay", "--sections", "measured", "-o", "report.html"), "section 'measured': is about measured responses; give th"),
    (
        ("azulay", "--setup", "setup.toml", "-o", "report.html"),
        "setup: goes with measured responses, and none are given as measured",
    ),
    (("azulay", "--measured", "measured.nc", "-o", "report.html"), "measured: where its points lie on the machine"),
    (("azulay", "--measured", "none.nc", "--setup", "setup.toml", "-o", "report.html"), "none.nc"),
    (("azulay", "--radius", "5", "-o", "report.html"), '--radius "5"'),
    (("azulay", "--steps", "0", "-o", "report.html"), "steps: 0 leaves the surface without points"),
    (("azulay", "--radius", "0 mm", "-o", "report.html"), "radius of the hemisphere: 0 mm"),
    (("azulay", "--set", "link.size=5 mm", "-o", "report.html"), "link.size"),
    (("azulay", "--spherical", "loose", "-o", "report.html"), 'spherical "loose"'),
]


@pytest.mark.parametrize(("arguments", "words"), WRONG, ids=[words[:30] for _, words in WRONG])
def test_wrong_input_is_refused_at_once(
    arguments: tuple[str, ...], words: str, trivet: Trivet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("trivet.report.making._of_one", lambda *_: pytest.fail("no work before the look"))
    Path("there.html").write_text("mine")
    code, out, err = trivet("report", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("trivet: ")
    assert words in err
    assert err.count("\n") == 1
    assert os.listdir() == ["there.html"]
    assert Path("there.html").read_text() == "mine"


def test_no_browser_is_told_at_once(trivet: Trivet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trivet.report.making._of_one", lambda *_: pytest.fail("no work before the look"))
    monkeypatch.setenv("PATH", "/nowhere")
    code, _, err = trivet("report", "azulay", "-o", "report.pdf")
    assert code == 1
    assert err.startswith("trivet: a PDF is printed by a browser")
    assert os.listdir() == []


@pytest.mark.usefixtures("no_stills")
def test_in_python(tmp_path: Path) -> None:
    seen: list[tuple[str, int, int]] = []
    machine = t.load("azulay")
    path = tmp_path / "report.html"
    t.write_report(machine, path, sections=["machine"], progress=lambda *told: seen.append(told))
    page = path.read_text(encoding="utf-8")
    assert "trivet show azulay.toml --figure" in page
    assert "trivet.write_report, in Python" in page
    assert seen == [("azulay", 0, 1), ("azulay", 1, 1)]


def test_whoever_interrupts_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "tmp").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "tmp")}
    command = [sys.executable, "-m", "trivet", "report", "azulay", "-o", "report.html"]
    process = subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=heeding,
    )  # fmt: skip
    end = time.monotonic() + 120
    while not list((tmp_path / "tmp").glob("trivet-*")):  # the first figure is being drawn
        assert time.monotonic() < end
        assert process.poll() is None
        time.sleep(0.001)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, "", "trivet: interrupted\n")
    assert list((tmp_path / "tmp").glob("trivet-*")) == []
    assert [p.name for p in tmp_path.iterdir()] == ["tmp"]
