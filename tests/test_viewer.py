"""What the page is made of: states, files, maps and their points, work for the newest request, words that are escaped."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from trivet.errors import InputError
from trivet.model import load
from trivet.model.quantity import Quantity
from trivet.study.posefile import PoseFile, read_pose, write_pose
from trivet.study.stiffness_map import surface_of
from trivet.viewer import keeping, words
from trivet.viewer.dome import EXCLUDED, UNBOUNDED, Dome, _told, hit
from trivet.viewer.mapping import _scaled, mapped
from trivet.viewer.panels.machine import _label
from trivet.viewer.standing import standing
from trivet.viewer.state import PoseNumbers, home_of, state_of
from trivet.viewer.studying import vibration
from trivet.viewer.worker import Worker

AZULAY, ECLIPSE = load("azulay"), load("eclipse")
LEANING = PoseNumbers(0.001, -0.002, 0.13, 0.5, 0.2, -0.5)


def test_linked_poses_differ_from_their_homes_alike() -> None:
    state = state_of([AZULAY, ECLIPSE], [None, None], LEANING)
    own = state.pose_of(1)
    np.testing.assert_allclose(np.subtract(own, home_of(ECLIPSE)), np.subtract(LEANING, home_of(AZULAY)), rtol=0, atol=1e-15)
    assert state.pose_of(0) == LEANING


@pytest.mark.parametrize("count", [0, 3])
def test_a_page_shows_one_machine_or_two(count: int) -> None:
    with pytest.raises(InputError, match=f"^{count} machines; a page shows one, or 2 side by side$"):
        state_of([AZULAY] * count, [None] * count)


def test_what_is_saved_comes_back(tmp_path: Path) -> None:
    state = state_of([AZULAY, ECLIPSE], ["++ +- ++", None], LEANING)
    files = keeping.save(state, tmp_path, "mine", overwrite=False)
    assert [path.name for path in files] == ["mine.toml", "mine.beside.toml", "mine.pose.toml"]
    found = keeping.restore(tmp_path, "mine")
    assert [m.name for m in found.machines] == ["azulay", "eclipse"]
    assert found.modes == state.modes
    np.testing.assert_allclose(found.pose, state.pose, rtol=1e-15)
    with pytest.raises(InputError, match="exists already; choose another name, or tick the box"):
        keeping.save(state, tmp_path, "mine", overwrite=False)
    keeping.save(replace(state, machines=(AZULAY,), modes=("",)), tmp_path, "mine", overwrite=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.pose.toml", "mine.toml"]


def test_a_machine_file_without_a_pose_is_shown_at_home(tmp_path: Path) -> None:
    keeping.save(state_of([AZULAY], [None], LEANING), tmp_path, "mine", overwrite=False)
    (tmp_path / "mine.pose.toml").unlink()
    assert keeping.restore(tmp_path, "mine").pose == home_of(AZULAY)


@pytest.mark.parametrize(
    "name", ["", ".", "..", "../x", "/etc/passwd", "a/b", "a\\b", ".hidden", "x" * 61, "a.toml", "a\0b", "a\nb", "ä"]
)
def test_names_stay_in_the_folder(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="expected up to 60 letters"):
        keeping.kept(tmp_path, name, ".toml")


def test_links_do_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (inside / "mine.html").symlink_to(outside / "x.html")
    with pytest.raises(InputError, match=r"mine\.html: is a link"):
        keeping.keep_page("<html>", inside, "mine", overwrite=True)
    assert list(outside.iterdir()) == []


def test_pose_files_are_read_and_written(tmp_path: Path) -> None:
    pose = PoseFile((0.001, 0.0, 0.12), 0.1, 0.2, -0.3, "++ ++ +-")
    write_pose(pose, tmp_path / "p.toml")
    assert read_pose(tmp_path / "p.toml") == pose


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "position: missing"),
        ('position = ["1 mm", "2 mm"]', "position"),
        ('position = ["1 mm", "2 mm", "nan mm"]', "position"),
        ('position = ["1 mm", "2 mm", "3 mm"]\nmode = "up"', "mode"),
        ('position = ["1 mm", "2 mm", "3 mm"]\ntilt = 3', "the unit is missing"),
        ('position = ["1 mm", "2 mm", "3 mm"]\nspeed = 3', "speed"),
        ('position = ["1 mm", "2 mm", "3 mm"]\nformat = true', "format: true"),
        ("position = [", "p.toml"),
    ],
)
def test_wrong_pose_files_get_one_line(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "p.toml").write_text(text)
    with pytest.raises(InputError, match=complaint) as caught:
        read_pose(tmp_path / "p.toml")
    assert "\n" not in str(caught.value)


def test_a_pose_that_is_not_reached_is_told_and_not_raised() -> None:
    right = standing(AZULAY, home_of(AZULAY), "")
    assert right.is_right
    assert right.named == frozenset()
    low = standing(AZULAY, home_of(AZULAY)._replace(z=0.04), "")
    assert low.report is not None
    assert low.named == {"leg-1.slide", "leg-2.slide", "leg-3.slide"}
    assert not low.is_right
    far = standing(AZULAY, home_of(AZULAY)._replace(z=1.0), "")
    assert far.report is None
    assert "leg-1 cannot close" in far.sentences[0]


def test_bodies_that_are_too_near_are_named() -> None:
    machine = load("azulay", {"interference.clearance": "30 mm"})
    near = standing(machine, home_of(machine)._replace(tilt=0.5), "")
    assert any("mm apart, less than 30 mm" in sentence for sentence in near.sentences)
    assert not near.is_right
    assert {"leg-1.link", "leg-2.link"} <= near.named


@pytest.mark.parametrize(
    ("quantity", "roll", "factor"), [("K_zz", "best K_zz", 1e6), ("sigma_min", "-alpha", 1.0), ("D_xx", "-alpha", 1e6)]
)
def test_maps_are_those_of_the_studies(quantity: str, roll: str, factor: float) -> None:
    import trivet
    from trivet.study.families import hemisphere_of

    found = mapped(AZULAY, "", quantity, 2, roll, lambda done: None)
    surface = surface_of(AZULAY, 2)
    if quantity == "K_zz":
        wanted = trivet.stiffness_map(AZULAY, surface, objective="K_zz").diagonal("K_zz")
    elif quantity == "D_xx":
        wanted = trivet.atlas(AZULAY, hemisphere_of(AZULAY, 2), entries=["xx"], roll=roll, search=False).stiffness[:, 0]
    else:
        wanted = trivet.singularity_map(AZULAY, surface, roll=roll).values
    np.testing.assert_allclose(factor * found.values, wanted, rtol=1e-12)
    assert len(found.surface) == len(found.roll) == 13
    assert found.limits[0] == np.nanmin(found.values)


def test_a_map_tells_what_its_scale_does_not() -> None:
    surface = surface_of(AZULAY, 2)
    values = np.linspace(-1.0, 10.0, len(surface)) ** 3
    values[3], values[4:6] = -np.inf, np.nan
    found = _scaled(surface, np.zeros(len(surface)), values, "1/det J^-1", True)
    colours = Dome._colours(found, values)
    assert [tuple(colours[k]) for k in (3, 4)] == [UNBOUNDED, EXCLUDED]
    told = [text for _, text in _told(found)]
    assert told == [
        f"colours end at {found.limits[0]:.4g} and {found.limits[1]:.4g}; values go from -1 to 1000",
        "11 of 13 points reached", "infinite at 1",
    ]  # fmt: skip
    assert "the angles of the pose fail" in _told(found._replace(is_angular=True))[-1][1]
    plain = _scaled(surface, np.zeros(len(surface)), np.linspace(1.0, 2.0, len(surface)), "K_zz, N/µm")
    assert [text for _, text in _told(plain)] == ["13 of 13 points reached"]


def test_modes_in_pairs_are_told_along_the_axes() -> None:
    """At home a machine of threefold symmetry has pairs of modes, any mixture of which is one."""
    told = vibration(AZULAY, home_of(AZULAY)._replace(tilt=0.0), "", False).modes
    assert [text.split(", ", 1)[1].split(" ")[0] for text in told[:2]] == ["x", "y"]
    assert all(" with x" not in text and " with y" not in text for text in told[:2])


@pytest.mark.parametrize(("path", "unit", "label"), [
    ("chains.leg.elements.hinge.travel.2", "deg", "hinge travel, greatest, °"),
    ("platform.tool_tip.1", "mm", "platform tool tip, x, mm"),
    ("chains.leg.elements.guide.stiffness", "N/um", "guide stiffness, N/µm"),
    ("materials.steel.density", "kg/m^3", "steel density, kg/m³"),
    ("materials.steel.poisson_ratio", "", "steel poisson ratio"),
])  # fmt: skip
def test_dimensions_are_called_as_people_do(path: str, unit: str, label: str) -> None:
    assert _label(path, Quantity("", "1", unit).symbol) == label


@pytest.mark.parametrize(("quantity", "steps", "roll", "complaint"), [
    ("K_xy", 2, "best K_xx", "quantity"), ("K_xx", 0, "best K_xx", "steps: 0"), ("K_xx", 31, "best K_xx", "steps: 31"),
    ("K_xx", 2, "sideways", "roll"), ("K_xx", 2, "-alpha", "best roll"),
])  # fmt: skip
def test_wrong_maps_are_refused(quantity: str, steps: int, roll: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        mapped(AZULAY, "", quantity, steps, roll, lambda done: None)


def test_a_ray_hits_the_point_nearest_to_where_it_enters() -> None:
    generator = np.random.default_rng(3)
    points = generator.normal(size=(200, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    for k in range(0, 200, 10):
        eye = points[k] * 5 + 0.001 * generator.normal(size=3)
        assert hit(points, eye, points[k] - eye) == k
    assert hit(points, np.array((5.0, 0, 0)), np.array((0.0, 1, 0))) is None
    assert hit(points, np.array((5.0, 0, 0)), np.zeros(3)) is None
    assert hit(points, np.array((np.nan, 0, 0)), np.ones(3)) is None


def test_a_worker_does_the_newest_and_survives_a_fault() -> None:
    done: list[int] = []
    gate = threading.Event()

    def work(number: int) -> None:
        gate.wait(5)
        if number == 99:
            raise ValueError("no")
        done.append(number)

    failures: list[Exception] = []
    worker = Worker(work, failures.append)
    for number in range(10):
        worker.ask(number)
    gate.set()
    wait(lambda: worker.is_idle)
    assert done[-1] == 9
    assert len(done) <= 3
    worker.ask(99)
    wait(lambda: failures)
    worker.ask(5)
    wait(lambda: done[-1] == 5)
    worker.end()
    worker.join(5)
    assert [str(failure) for failure in failures] == ["no"]


def test_a_patient_worker_waits_until_nothing_comes() -> None:
    done: list[tuple[int, float]] = []
    worker: Worker[int] = Worker(lambda number: done.append((number, time.monotonic())), print, settled=0.5)
    for number in range(5):
        worker.ask(number)
    last = time.monotonic()
    wait(lambda: done)
    worker.end()
    worker.join(5)
    assert [number for number, _ in done] == [4]
    assert done[0][1] >= last + 0.4


def test_a_queue_does_all_in_their_order_and_refuses_what_is_too_much() -> None:
    done: list[int] = []
    gate = threading.Event()
    worker: Worker[int] = Worker(lambda number: (gate.wait(5), done.append(number))[1], print, waiting=3)
    worker.ask(0)
    wait(lambda: not worker.is_overtaken)  # it is at work
    assert [worker.ask(number) for number in (1, 2, 3, 4)] == [True, True, True, False]
    gate.set()
    wait(lambda: worker.is_idle)
    assert done == [0, 1, 2, 3]
    worker.end()
    worker.join(5)


def wait(is_so: Callable[[], object]) -> None:
    end = time.monotonic() + 20
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_what_comes_from_a_file_is_escaped() -> None:
    hostile = '<script>alert("x")</script>'
    for text in (
        words.esc(hostile),
        words.table((hostile,), [(hostile, hostile)]),
        words.bars([(hostile, 0.5, hostile, "red")]),
    ):
        assert "<script>" not in text
    assert "<script>" not in words.status(hostile, standing(AZULAY, home_of(AZULAY), ""))


def test_bars_stay_within_their_frames() -> None:
    assert "width:100.0%" in words.bars([("a", 7.0, "", "red")])
    assert "width:0.0%" in words.bars([("a", -math.inf, "", "red")])


@pytest.mark.parametrize(("arguments", "complaint"), [
    (("a", "b", "c"), "a: no machine of this name"),
    (("azulay", "azulay", "azulay"), "3 machines; a page shows one, or 2 side by side"),
    (("azulay", "--port", "0"), "--port 0: expected 1 to 65535"),
    (("azulay", "--mode", "+"), 'mode "+"'),
    (("azulay", "--tilt", "3"), "--tilt"),
])  # fmt: skip
def test_wrong_input_gets_one_line(
    trivet: Callable[..., tuple[int, str, str]], arguments: tuple[str, ...], complaint: str
) -> None:
    code, out, err = trivet("view", *arguments, "--no-browser")
    assert (code, out) == (2, "")
    assert err.startswith("trivet: ")
    assert complaint in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_it_is_ended(tmp_path: Path, number: int) -> None:
    command = [sys.executable, "-m", "trivet", "view", "azulay", "--no-browser"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        address = process.stdout.readline().split()[0]
        assert address.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(address) as answer:
            assert b"<html" in answer.read(2000).lower()
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert "Traceback" not in err
    assert process.returncode == (0 if number == signal.SIGINT else 128 + number)
    assert list(tmp_path.iterdir()) == []


INSIDE = """
import os, signal, sys, threading, time
from trivet.study.machines import choose
from trivet.viewer.serve import serve
from trivet.viewer.state import state_of
armed = []
def sent(own):
    def waits(*given):
        if armed and threading.current_thread() is threading.main_thread():
            armed.clear()
            os.kill(os.getpid(), signal.SIGTERM)
        return own(*given)
    return waits
threading.Condition.wait, time.sleep = sent(threading.Condition.wait), sent(time.sleep)
serve(state_of([choose("azulay")], [None]), None, False, False, lambda line: armed.append(line))
"""
"""The signal comes while the thread that gets it waits, and may hold what it waits by."""


def test_a_signal_in_the_middle_of_waiting_ends_it() -> None:
    assert subprocess.run([sys.executable, "-c", INSIDE], timeout=60, check=False).returncode == 128 + signal.SIGTERM
