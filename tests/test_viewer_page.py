"""The page driven as people drive it: every control, by mouse and by keyboard, on a desk and on a phone, in both themes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page import Seen, opened, until

from trivet.model import load
from trivet.viewer.page import Page
from trivet.viewer.serve import serving
from trivet.viewer.state import state_of

pytestmark = pytest.mark.peer("chromium", program="chromium")

DESK, PHONE = (1280, 800), (390, 844)
TABS = ("Pose", "Stiffness", "Vibration", "Map", "Machine", "Files")


class Driven:
    """A page with a machine or two, in the browser."""

    def __init__(self, seen: Seen, page: Page, folder: Path) -> None:
        self.seen, self.page, self.folder, self.web = seen, page, folder, seen.page

    def settle(self) -> None:
        until(lambda: self.page.is_idle)

    def tab(self, name: str) -> None:
        self.web.get_by_role("tab", name=name).click()

    def row(self, label: str) -> Any:
        found = self.web.locator("label").filter(has_text=label).locator("xpath=ancestor::div[2]")
        return found.filter(visible=True).first

    def type(self, label: str, value: str) -> None:
        box = self.row(label).locator("input[inputmode=decimal]")
        box.fill(value)
        box.press("Enter")
        self.sent()

    def sent(self) -> None:
        """Wait until what was put in is sent: viser sends once in 50 ms, and of what two controls say between only the last."""
        self.web.evaluate("new Promise(done => setTimeout(done, 100))")

    def press(self, label: str, keys: str) -> None:
        thumb = self.row(label).get_by_role("slider")
        thumb.focus()
        for key in keys.split():
            thumb.press(key)
        self.sent()

    def choose(self, label: str, option: str) -> None:
        self.row(label).get_by_role("combobox").click()
        self.web.get_by_role("option", name=option, exact=True).filter(visible=True).first.click()
        self.sent()

    def switch(self, label: str) -> None:
        self.row(label).get_by_role("checkbox").click()
        self.sent()

    def click(self, label: str) -> None:
        self.web.get_by_role("button", name=label).filter(visible=True).first.click()

    def says(self, text: str) -> None:
        self.web.get_by_text(text).filter(visible=True).first.wait_for()

    def pixel(self, point: Any) -> tuple[float, float]:
        """Where a point (3,) of the page's world is seen."""
        camera = next(iter(self.page._server.get_clients().values())).camera
        w, x, y, z = camera.wxyz
        turn = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        across, down, ahead = turn.T @ (np.asarray(point) - camera.position)
        focus = camera.image_height / 2 / math.tan(camera.fov / 2)
        return camera.image_width / 2 + focus * across / ahead, camera.image_height / 2 + focus * down / ahead


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Page, Path]]:
    folder = tmp_path_factory.mktemp("kept")
    with serving(state_of([load("azulay")], [None]), None, folder) as (address, page):
        yield address, page, folder


@pytest.fixture
def driven(one: tuple[str, Page, Path]) -> Iterator[Driven]:
    """At home on a desk, all settled; nothing may have gone wrong when the test is over."""
    address, page, folder = one
    page.change(pose=page.home, by="test")
    with opened(address, DESK) as seen:
        found = Driven(seen, page, folder)
        seen.page.get_by_role("tab", name="Pose").wait_for()
        until(lambda: page._server.get_clients())
        found.settle()
        seen.drawn()
        yield found
        seen.check()
        assert page.failure is None


def test_the_pose_by_number_and_by_key(driven: Driven) -> None:
    driven.type("x, mm", "3")
    driven.type("z, mm", "120.5")
    driven.type("tilt, °", "20")
    driven.type("azimuth, °", "-90")
    driven.settle()
    pose = driven.page.state.pose
    assert pose[:3] == pytest.approx((3e-3, 0, 0.1205))
    assert pose[3:] == pytest.approx((-math.pi / 2, math.radians(20), 0))
    driven.press("roll, °", "ArrowRight ArrowRight ArrowLeft ArrowRight")
    until(lambda: driven.page.state.pose.roll == pytest.approx(math.radians(0.2)))
    driven.says("✓ reached")
    driven.click("Home")
    until(lambda: driven.page.state.pose == driven.page.home)
    until(lambda: driven.row("tilt, °").locator("input[inputmode=decimal]").input_value() == "0")
    driven.type("y, mm", "1")
    until(lambda: driven.page.state.pose != driven.page.home)
    driven.web.mouse.click(200, 700)
    driven.web.keyboard.press("h")
    until(lambda: driven.page.state.pose == driven.page.home)


def test_what_bites_is_named_and_coloured(driven: Driven) -> None:
    driven.type("z, mm", "40")
    driven.settle()
    driven.says("leg-1.slide")
    driven.says("✗ not allowed")
    assert "leg-1.slide" in driven.page._actors[0].stage._marked
    driven.seen.keep("not-allowed")
    driven.type("z, mm", "250")
    driven.settle()
    driven.says("✗ not reached")
    assert driven.page._actors[0].stage._ghost.visible
    driven.seen.keep("not-reached")


def test_the_handle_is_dragged_and_the_machine_follows(driven: Driven) -> None:
    assert driven.page._handle.visible
    home, size = driven.page.home, driven.page._size
    poses: list[float] = []
    follow = driven.page._actors[0].follow
    driven.page._actors[0].follow = lambda *given: (poses.append(given[2].z), follow(*given))[1]  # type: ignore[method-assign]
    try:
        x, y = driven.pixel((0, 0, home.z + 0.2 * size))
        driven.web.mouse.move(x, y)
        driven.web.mouse.down()
        for step in range(1, 41):
            driven.web.mouse.move(x, y - step)
            driven.web.wait_for_timeout(50)
        driven.web.mouse.up()
        driven.settle()
    finally:
        driven.page._actors[0].follow = follow  # type: ignore[method-assign]
    moved = driven.page.state.pose
    assert moved.z > home.z + 5e-3
    assert moved[3:] == pytest.approx(home[3:], abs=1e-6)
    assert len(set(poses)) >= 5
    assert np.all(np.diff(poses) >= -1e-9)
    box = driven.row("z, mm").locator("input[inputmode=decimal]")
    until(lambda: float(box.input_value()) == pytest.approx(1e3 * moved.z, abs=0.06))
    driven.seen.keep("dragged")
    driven.switch("Drag handle")
    until(lambda: not driven.page._handle.visible)
    driven.switch("Drag handle")
    driven.switch("Names")
    until(lambda: not driven.page._actors[0].stage._names[0].visible)
    driven.switch("Names")


def test_working_and_assembly_modes(driven: Driven) -> None:
    driven.web.get_by_text("Working mode of azulay").click()
    driven.choose("leg-1", "+-")
    until(lambda: driven.page.state.modes == ("+- ++ ++",))
    driven.settle()
    driven.choose("leg-1", "++")
    until(lambda: driven.page.state.modes == ("++ ++ ++",))
    driven.click("Find assembly modes")
    driven.says("assembly modes")
    driven.settle()
    driven.row("Assembly mode").get_by_role("combobox").click()
    options = driven.web.get_by_role("option").filter(has_text="mm,")
    options.nth(1).click()
    until(lambda: driven.page.state.pose != driven.page.home)
    driven.settle()
    driven.click("Home")
    driven.page.change(mode=(0, "++ ++ ++"))


def test_stiffness_and_singularity(driven: Driven) -> None:
    driven.tab("Stiffness")
    driven.switch("Compliance ellipsoid")
    driven.says("ellipsoid, µm/N: 0.192 × 0.192 × 0.184")
    assert driven.page._actors[0].marks._ellipsoid.visible
    driven.switch("Least controlled motion")
    until(lambda: driven.page._actors[0].marks._arrow is not None)
    driven.choose("Budget of a load along", "rx")
    driven.says("budget along rx")
    driven.settle()
    driven.seen.keep("stiffness")
    driven.switch("Compliance ellipsoid")
    driven.switch("Least controlled motion")
    until(lambda: not driven.page._actors[0].marks._ellipsoid.visible)


def test_responses_and_natural_modes(driven: Driven) -> None:
    driven.tab("Vibration")
    driven.says("0.1144 N/µm")
    driven.choose("Response", "xx")
    driven.says("|H_xx|")
    driven.row("Natural mode").get_by_role("combobox").click()
    driven.web.get_by_role("option").filter(has_text="512.1 Hz, z").click()
    until(lambda: driven.page._actors[0].ringing.is_shown)
    driven.settle()
    meshes = driven.page._actors[0].ringing._meshes["platform"]
    before = meshes.vertices.copy()
    until(lambda: np.abs(meshes.vertices - before).max() > 1e-4)
    driven.seen.keep("ringing")
    driven.choose("Natural mode", "at rest")
    until(lambda: not driven.page._actors[0].ringing.is_shown)


def test_a_map_and_its_points(driven: Driven) -> None:
    driven.tab("Map")
    driven.choose("Quantity", "sigma_min")
    driven.choose("Roll", "-alpha")
    driven.type("Steps from pole to rim", "4")
    driven.click("Map it")
    driven.says("sigma_min; the hemisphere is drawn")
    driven.says("49 of 49 points reached")
    dome = driven.page._actors[0].dome
    assert dome.shown is not None
    assert len(dome.shown.surface) == 49
    assert len(dome.shown.curves) == 1
    driven.seen.keep("map")
    north = dome._centre + dome._radius * np.array((0.0, -math.sin(0.7), math.cos(0.7)))
    until(lambda: _clicked_to(driven, north))
    pose = driven.page.state.pose
    assert math.degrees(pose.azimuth) == pytest.approx(-90)
    assert pose.roll == pytest.approx(-pose.azimuth)
    driven.type("Go to point", "1")
    until(lambda: driven.page.state.pose.tilt == pytest.approx(math.pi / 2))
    driven.settle()
    driven.choose("Quantity", "K_zz")
    driven.click("Map it")
    driven.says("is mapped with the best roll")


def _clicked_to(driven: Driven, point: Any) -> bool:
    """Click on a point of the scene, which a slow machine may not have drawn yet; gives whether the platform was tilted."""
    driven.web.mouse.click(*driven.pixel(point))
    driven.seen.drawn()
    driven.settle()
    return driven.page.state.pose.tilt > 0.3


def test_dimensions(driven: Driven) -> None:
    driven.tab("Machine")
    driven.web.get_by_text("chain leg").click()
    driven.type("link length, mm", "230")
    until(lambda: float(driven.page.state.machines[0].chains["leg"].elements[3].length) == pytest.approx(0.23))
    driven.settle()
    driven.tab("Stiffness")
    driven.web.get_by_text("others held").first.wait_for()
    driven.tab("Machine")
    driven.web.get_by_text("section tube").click()
    driven.type("tube inner diameter, mm", "19.5")
    driven.says("inner_diameter")
    assert driven.row("tube inner diameter, mm").locator("input[inputmode=decimal]").input_value() == "14"
    driven.click("Reset azulay")
    until(lambda: driven.page.state.machines[0] is driven.page._dimensions[0]._first)
    driven.settle()


def test_files(driven: Driven) -> None:
    driven.type("tilt, °", "10")
    driven.tab("Files")
    name = driven.row("Name").locator("input")
    name.fill("../outside")
    driven.click("Save machine and pose")
    driven.says("expected up to 60 letters")
    name.fill("mine")
    driven.click("Save machine and pose")
    driven.says("written: mine.toml, mine.pose.toml")
    driven.click("Save machine and pose")
    driven.says("tick the box")
    driven.switch("Replace files that exist")
    driven.click("Save machine and pose")
    until(lambda: sorted(path.name for path in driven.folder.iterdir()) == ["mine.pose.toml", "mine.toml"])
    driven.tab("Pose")
    driven.click("Home")
    driven.tab("Files")
    driven.row("Name").locator("input").fill("mine")
    driven.click("Load them")
    until(lambda: driven.page.state.pose.tilt == pytest.approx(math.radians(10)))
    driven.settle()


def test_an_exported_scene_plays_without_a_network(driven: Driven) -> None:
    driven.type("tilt, °", "15")
    driven.tab("Files")
    driven.row("Name").locator("input").fill("scene")
    driven.click("Export the scene")
    file = driven.folder / "scene.html"
    until(file.exists)
    assert file.stat().st_size < 5e6
    with driven.seen.beside(file.as_uri()) as alone:
        alone.page.locator("canvas").first.wait_for()
        alone.page.wait_for_timeout(1500)
        first = alone.keep("exported-1")
        until(lambda: alone.keep("exported-2") != first)
        alone.check()
    file.unlink()


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_every_panel_on_a_desk_and_a_phone_by_day_and_night(
    one: tuple[str, Page, Path], size: tuple[int, int], dark: bool
) -> None:
    address, page, _ = one
    with opened(address, size) as seen:
        seen.page.locator("canvas").first.wait_for()
        seen.page.get_by_role("tab", name="Files").click()
        box = seen.page.get_by_role("checkbox").filter(visible=True).first
        if box.is_checked() != dark:
            box.click()
        until(lambda: page._is_dark == dark)
        for name in TABS:
            seen.page.get_by_role("tab", name=name).click()
            seen.page.wait_for_timeout(300)
            seen.keep(f"{name.lower()}-{size[0]}-{'dark' if dark else 'light'}")
        seen.check()
        scheme = seen.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(int(c) for c in scheme[4:-1].split(",")[:3]) < 300) == dark


def test_two_machines_with_linked_poses(tmp_path: Path) -> None:
    machines = [load("azulay"), load("eclipse")]
    with (
        serving(state_of(machines, [None, None]), None, tmp_path) as (address, page),
        opened(address) as seen,
    ):
        seen.page.get_by_role("tab", name="Pose").wait_for()
        driven = Driven(seen, page, tmp_path)
        driven.type("tilt, °", "12")
        driven.type("z, mm", "120")
        driven.settle()
        for number, machine in enumerate(machines):
            own = page.state.pose_of(number)
            assert math.degrees(own.tilt) == pytest.approx(12)
            assert own.z - float(machine.home.position[2]) == pytest.approx(0.120 - float(machines[0].home.position[2]))
        driven.says("the pose of azulay; eclipse moves as far from its own home")
        seen.keep("two-machines")
        driven.tab("Files")
        driven.row("Name").locator("input").fill("both")
        driven.click("Save machine and pose")
        until(lambda: len(list(tmp_path.iterdir())) == 3)
        seen.check()
