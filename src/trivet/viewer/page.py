"""The page: one state, asked for by controls, followed by the scene at once and by studies when it has settled."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import viser

from trivet.errors import TrivetError
from trivet.kinematics.mode import mode_text, parse_mode
from trivet.space.frame import Frame
from trivet.space.pose import zyz_angles
from trivet.space.vector import Vec
from trivet.study.forward import forward
from trivet.viewer import keeping, words
from trivet.viewer.actor import Actor
from trivet.viewer.look import Look
from trivet.viewer.mapping import mapped
from trivet.viewer.panels.files import FilesPanel
from trivet.viewer.panels.machine import MachinePanel
from trivet.viewer.panels.map import MapPanel
from trivet.viewer.panels.pose import PosePanel
from trivet.viewer.panels.stiffness import StiffnessPanel
from trivet.viewer.panels.vibration import VibrationPanel
from trivet.viewer.recording import recorded
from trivet.viewer.ringing import FRAMES, PERIOD
from trivet.viewer.stage import quaternion
from trivet.viewer.standing import standing
from trivet.viewer.state import PoseNumbers, State, home_of
from trivet.viewer.studying import Vibration, singular, stiffness_pieces, vibration
from trivet.viewer.worker import Worker

PATIENCE = 2.0
"""How long (s) the end waits for what is being done."""
WAITING = 8
"""Things that may be asked for before the first is done."""
SETTLED = 0.2
"""How long (s) nothing may have moved before what takes longer is worked out."""
APART = 1.25
"""Of the machines side by side, as a multiple of the larger one's size."""
FAR = 20.0
"""How far from home a handle may be dragged, in sizes of the machine."""
WIDTH = 400
"""Of the panel, pixels."""
NOT_REACHED = "the pose is not reached"
WAIT = "<div>… stiffness and vibration are being worked out</div>"
HANDLE = 0.28
"""Length of its arrows, as a share of the machine's size."""


class Asked(NamedTuple):
    """A state, by what it was asked for, and on which of the scenes and panels that were put up one after the other."""

    state: State
    by: str
    build: int


class Page:
    """What is shown to all who look at the page."""

    def __init__(self, server: viser.ViserServer, state: State, folder: Path, is_dark: bool = False) -> None:
        """Show a state.

        Args:
            server: a server that shows nothing yet.
            state: what to begin with.
            folder: where files are kept.
            is_dark: whether the page is light on dark.
        """
        self._server, self._folder, self._is_dark = server, folder, is_dark
        self._lock = threading.Lock()
        self._following, self._studying = threading.Lock(), threading.Lock()
        self.state, self._build_number = state, 0
        self.failure: BaseException | None = None
        """The first thing that went wrong in a way that nobody foresaw."""
        self.is_over = False
        self._build(state)
        server.on_client_connect(lambda client: self._look.show(client))
        self._follower: Worker[Asked] = Worker(self._follow, self.fail)
        self._student: Worker[Asked] = Worker(self._study, self.fail, SETTLED)
        self._runner: Worker[Callable[[], None]] = Worker(self._run, self.fail, waiting=WAITING)
        self._ended = threading.Event()
        threading.Thread(target=self._swing, daemon=True).start()
        self._ask(state, "start")

    def end(self) -> None:
        """Stop all work; `is_over` tells whether all of it has stopped, or whether some goes on that takes long."""
        self._ended.set()
        workers = self._follower, self._student, self._runner
        for worker in workers:
            worker.end()
        until = time.monotonic() + PATIENCE
        over = [worker.join(until - time.monotonic()) for worker in workers]
        self.is_over = all(over)

    @property
    def home(self) -> PoseNumbers:
        """The home pose of the first machine."""
        return home_of(self.state.machines[0])

    @property
    def is_idle(self) -> bool:
        """Whether all that was asked for is shown."""
        return all(worker.is_idle for worker in (self._follower, self._student, self._runner))

    # What is asked for

    def change(
        self,
        pose: PoseNumbers | None = None,
        coordinate: tuple[int, float] | None = None,
        mode: tuple[int, str] | None = None,
        machine: tuple[int, Any] | None = None,
        by: str = "control",
        **shown: Any,
    ) -> None:
        """Ask for another state.

        Args:
            pose: of the first machine.
            coordinate: one of the numbers of that pose, counted from 0, and its value (m, rad).
            mode: number of a machine and its working mode.
            machine: number of a machine and the machine, of the same topology.
            by: what asked.
            shown: what is to be seen, fields of `Shown`.
        """
        with self._lock:
            state = self.state
            if pose is not None:
                state = replace(state, pose=pose)
            if coordinate is not None:
                state = replace(state, pose=PoseNumbers(*_with(state.pose, *coordinate)))
            if mode is not None:
                number, text = mode
                signs = parse_mode(state.machines[number], text or None)
                state = replace(state, modes=_with(state.modes, number, mode_text(state.machines[number], signs)))
            if machine is not None:
                state = replace(state, machines=_with(state.machines, *machine))
            if shown:
                state = replace(state, shown=replace(state.shown, **shown))
            self.state = state
        self._ask(state, by)

    def _ask(self, state: State, by: str) -> None:
        asked = Asked(state, by, self._build_number)
        self._follower.ask(asked)
        self._student.ask(asked)

    def _send(self, errand: Callable[..., None], *given: Any) -> None:
        """Have something done that takes a while, after what is being done."""
        if not self._runner.ask(partial(errand, *given)):
            self._note(f"{WAITING} things wait to be done; ask again later", is_good=False)

    def fail(self, error: BaseException) -> None:
        """Tell of an input that led to an error."""
        if isinstance(error, TrivetError):
            self._note(str(error), is_good=False)
            return
        self.failure = self.failure or error
        traceback.print_exception(error)

    # What is built

    def _build(self, state: State) -> None:
        """Put up the scene and the panels for the machines of a state; what was there before is gone."""
        with self._studying, self._following:
            self._build_number += 1
            self._put_up(state)

    def _put_up(self, state: State) -> None:
        server, gui = self._server, self._server.gui
        gui.reset()
        server.scene.reset()
        self._actors = [Actor(server, number, self._go) for number in range(len(state.machines))]
        for number, (actor, machine) in enumerate(zip(self._actors, state.machines, strict=True)):
            actor.stage.light(self._is_dark)
            actor.follow(machine, state.modes[number], state.pose_of(number))
        self._size = max(actor.stage.size for actor in self._actors) or 1.0
        for number, actor in enumerate(self._actors):
            aside = (number - (len(self._actors) - 1) / 2) * APART * self._size
            actor.stage.set_aside(np.array((aside, 0.0, 0.0)))
            if len(self._actors) > 1:
                actor.stage.entitle(state.machines[number].name)
        self._look = Look(server, self._size, len(self._actors))
        self._theme()
        self._set_handle()
        gui.set_panel_label("trivet")
        gui.main_panel.set_width(WIDTH)
        self._status, self._lines = gui.add_html(""), [""]
        tabs = gui.add_tab_group()
        with tabs.add_tab("Pose"):
            self._pose = PosePanel(server, state, self._size, self.change, partial(self._send, self._assemble))
        with tabs.add_tab("Stiffness"):
            self._stiffness = StiffnessPanel(server, state, self.change)
        with tabs.add_tab("Vibration"):
            self._vibration = VibrationPanel(server, state, self.change)
        with tabs.add_tab("Map"):
            self._map = MapPanel(server, state, partial(self._send, self._seek_map), self._go)
        with tabs.add_tab("Machine"):
            self._dimensions = [
                MachinePanel(server, number, machine, self.change) for number, machine in enumerate(state.machines)
            ]
        with tabs.add_tab("Files"):
            save, load, export = (partial(self._send, errand) for errand in (self._save, self._load, self._export))
            name = keeping.name_of(state.machines[0].name)
            self._files = FilesPanel(server, name, self._is_dark, save, load, export, partial(self._send, self._set_theme))
        self._add_keys()

    def _theme(self) -> None:
        self._server.gui.configure_theme(dark_mode=self._is_dark, show_logo=False, show_share_button=False)

    def _set_theme(self, is_dark: bool) -> None:
        self._is_dark = is_dark
        self._theme()
        with self._following:
            for actor in self._actors:
                actor.stage.light(is_dark)

    def _set_handle(self) -> None:
        size = HANDLE * self._size
        self._handle = self._server.scene.add_transform_controls(
            "/machine-0/handle", scale=size, line_width=3.0, disable_sliders=True, depth_test=False
        )

        async def dragged(event: Any) -> None:
            numbers = _numbers(self._handle.position, self._handle.wxyz)
            if numbers is not None and np.abs(np.subtract(numbers[:3], self.home[:3])).max() < FAR * self._size:
                self.change(pose=numbers, by="handle")
            else:
                self._ask(self.state, "refused")

        self._handle.on_update(dragged)

    def _add_keys(self) -> None:
        home = self._server.gui.add_command("Home pose", hotkey="H")
        dark = self._server.gui.add_command("Dark or light", hotkey="T")
        whole = self._server.gui.add_command("Whole machine", hotkey="V")

        async def go(_: Any) -> None:
            self._pose.go_home()

        async def turn(_: Any) -> None:
            self._files.turn(not self._is_dark)
            self._send(self._set_theme, not self._is_dark)

        async def look(_: Any) -> None:
            for client in self._server.get_clients().values():
                self._look.show(client)

        whole.on_trigger(look)
        home.on_trigger(go)
        dark.on_trigger(turn)

    # What follows at once

    def _follow(self, asked: Asked) -> None:
        with self._following:
            if asked.build == self._build_number:
                self._stand(asked.state, asked.by)

    def _stand(self, state: State, by: str) -> None:
        with self._server.atomic():
            for number, actor in enumerate(self._actors):
                actor.follow(state.machines[number], state.modes[number], state.pose_of(number))
            if by != "handle":
                frame = state.pose.frame
                self._handle.position = np.array(frame.origin, dtype=float)
                self._handle.wxyz = quaternion(np.array(frame.matrix(), dtype=float))
            self._handle.visible = state.shown.handle
        self._server.flush()
        lines = []
        for number, actor in enumerate(self._actors):
            found = standing(state.machines[number], state.pose_of(number), state.modes[number])
            actor.stage.mark(found.named)
            actor.stage.show_names(state.shown.names)
            self._pose.tell(number, found)
            lines.append(words.status(state.machines[number].name, found))
            wanted = state.pose_of(number)
            actor.dome.here(wanted.azimuth, wanted.tilt)
        self._pose.follow(state, by)
        self._lines = lines
        self._tell_status(is_waiting=True)

    def _tell_status(self, is_waiting: bool) -> None:
        """Show how the machines stand, and whether stiffness and vibration are still those of another state."""
        more = [WAIT] if is_waiting else []
        self._status.content = words.block(*self._lines, *more, role='role="status"')

    # What is worked out when all has settled

    def _study(self, asked: Asked) -> None:
        with self._studying:
            if asked.build == self._build_number:
                self._tell(asked.state)

    def _tell(self, state: State) -> None:
        found = []
        for number, actor in enumerate(self._actors):
            self._tell_stiffness(state, number, actor)
        for number, actor in enumerate(self._actors):
            if self._student.is_overtaken:
                return
            found.append(self._tell_vibration(state, number, actor))
        self._vibration.plot([one.response for one in found], state.shown.entry)
        self._vibration.offer(next((one.modes for one in found if one.modes), []), state.shown.ringing)
        if not self._student.is_overtaken:
            self._tell_status(is_waiting=False)

    def _tell_stiffness(self, state: State, number: int, actor: Actor) -> None:
        machine, mode, wanted, shown = state.machines[number], state.modes[number], state.pose_of(number), state.shown
        report = standing(machine, wanted, mode).report
        soft = actor.marks.soften(report if shown.ellipsoid else None, actor.stage.size)
        near, near_words = singular(machine, wanted, mode)
        is_pointed = near is not None and report is not None and shown.twist
        actor.marks.point(near.singularity.motion if near and is_pointed else None, wanted.frame, actor.stage.size)
        pieces = [NOT_REACHED] if report is None else stiffness_pieces(report, shown.direction)
        near_pieces = [] if report is None else ["<b>singularity</b>", near_words, words.esc(soft)]
        self._stiffness.tell(number, [f"<b>{words.esc(machine.name)}</b>", *pieces, *near_pieces])

    def _tell_vibration(self, state: State, number: int, actor: Actor) -> Vibration:
        machine, wanted = state.machines[number], state.pose_of(number)
        found = vibration(machine, wanted, state.modes[number], state.shown.ringing is not None)
        self._vibration.tell(number, [f"<b>{words.esc(machine.name)}</b>", *found.told])
        is_seen = found.seen is not None and state.shown.ringing is not None
        with self._following:
            actor.ringing.show(found.seen, min(state.shown.ringing or 0, len(found.modes) - 1))
            actor.stage.hide(is_seen)
        return found

    def _swing(self) -> None:
        """Move what rings."""
        while not self._ended.wait(PERIOD / FRAMES):
            with self._studying, self._server.atomic():
                for actor in self._actors:
                    actor.ringing.swing(2 * np.pi * (time.monotonic() / PERIOD % 1.0))

    # What is done once

    def _run(self, errand: Callable[[], None]) -> None:
        try:
            errand()
        except TrivetError as error:
            self._note(str(error), is_good=False)
        except Exception as error:
            self._note(f"that failed: {type(error).__name__}; the terminal says more", is_good=False)
            raise

    def _note(self, text: str, is_good: bool = True) -> None:
        self._files.tell(text)
        for client in self._server.get_clients().values():
            client.add_notification("trivet", text, color="green" if is_good else "red", auto_close_seconds=8)

    def _assemble(self) -> None:
        state = self.state
        found = forward(state.machines[0], start=state.pose.frame, mode=state.modes[0] or None, anyway=True)
        offered = []
        for number, one in enumerate(found.modes, start=1):
            pose = PoseNumbers(*one.position, *one.angles)
            right = "inside travel" if one.miss is None else "outside travel"
            offered.append((f"{number}: z {1e3 * pose.z:.1f} mm, {right} ({one.mode or 'no choice'})", pose, one.mode))
        self._pose.offer(offered)
        self._note(f"{len(offered)} assembly modes")

    def _seek_map(self, number: int, quantity: str, steps: int, roll: str) -> None:
        state, actor = self.state, self._actors[number]
        total = 3.15 * steps**2
        self._map.advance(0.0)
        try:
            found = mapped(
                state.machines[number], state.modes[number], quantity, steps, roll,
                lambda done: self._map.advance(min(done / total, 1.0)),
            )  # fmt: skip
        finally:
            self._map.advance(None)
        for other in self._actors:
            if other is not actor:
                other.dome.show(None, 1.0, 0.0)
        legend = actor.dome.show(found, actor.stage.size, actor.stage.top)
        wanted = state.pose_of(number)
        actor.dome.here(wanted.azimuth, wanted.tilt)
        self._map.tell(legend, len(found.surface))

    def _go(self, point: int) -> None:
        """Go to a check point of the map that is shown."""
        for number, actor in enumerate(self._actors):
            found = actor.dome.shown
            if found is not None and 0 <= point < len(found.surface):
                surface, roll = found.surface, float(found.roll[point])
                angles = surface.azimuth[point], surface.tilt[point], 0.0 if np.isnan(roll) else roll
                there, state = PoseNumbers(*(float(c) for c in (*surface.position[point], *angles))), self.state
                own = there if number == 0 else home_of(state.machines[0]).moved(home_of(state.machines[number]), there)
                self._map.stand(point)
                self.change(pose=own, by="map")

    def _save(self, name: str, overwrite: bool) -> None:
        files = keeping.save(self.state, self._folder, name, overwrite)
        self._note("written: " + ", ".join(path.name for path in files))

    def _load(self, name: str, overwrite: bool) -> None:
        self._show(keeping.restore(self._folder, name))
        self._note(f"{name} is shown")

    def _export(self, name: str, overwrite: bool) -> None:
        keeping.check_page(self._folder, name, overwrite)
        with self._studying, self._following:
            state = self.state
            self._handle.visible = False  # nobody follows it there
            try:
                page = recorded(self._server, self._actors, state, self._is_dark)
            finally:
                self._handle.visible = state.shown.handle
        self._note(f"written: {keeping.keep_page(page, self._folder, name, overwrite).name}")

    def _show(self, state: State) -> None:
        """Show other machines."""
        with self._lock:
            self.state = state
        self._build(state)
        self._ask(self.state, "load")


def _with(values: tuple[Any, ...], number: int, value: Any) -> tuple[Any, ...]:
    return tuple(value if k == number else own for k, own in enumerate(values))


def _numbers(position: Any, wxyz: Any) -> PoseNumbers | None:
    """The pose of a handle; None where it is none."""
    from scipy.spatial.transform import Rotation

    place, turn = np.asarray(position, dtype=float), np.asarray(wxyz, dtype=float)
    if place.shape != (3,) or turn.shape != (4,) or not np.linalg.norm(turn) > 1e-3:
        return None
    columns = Rotation.from_quat(np.roll(turn, -1)).as_matrix().T
    frame = Frame(Vec(*place.tolist()), *(Vec(*column) for column in columns.tolist()))
    return PoseNumbers(*(float(number) for number in (*place, *zyz_angles(frame))))
