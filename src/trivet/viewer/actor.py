"""A machine on the page: all that is drawn of it, and how it follows a pose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from trivet.errors import NoResultError
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import Bodies, bodies
from trivet.model import Machine
from trivet.viewer.dome import Dome
from trivet.viewer.marks import Marks
from trivet.viewer.ringing import Ringing
from trivet.viewer.stage import Stage
from trivet.viewer.state import PoseNumbers, home_of


class Actor:
    """A machine on the page."""

    def __init__(self, server: viser.ViserServer, number: int, go: Callable[[int], None]) -> None:
        root = f"/machine-{number}"
        self.stage, self.marks = Stage(server, root), Marks(server, root)
        self.ringing, self.dome = Ringing(server, root), Dome(server, root, go)
        self._drawn: tuple[Machine, str] | None = None

    def follow(self, machine: Machine, mode: str, wanted: PoseNumbers) -> bool:
        """Stand at a pose, if the chains reach it; gives whether they do."""
        if self._drawn is None or self._drawn[0] is not machine or self._drawn[1] != mode:
            self._draw(machine, mode, wanted)
        there = _bodies(machine, mode, wanted)
        if there is None or self._drawn is None:
            self.stage.want(wanted.frame)
            return False
        self.stage.place(there)
        self.stage.want(None)
        return True

    def _draw(self, machine: Machine, mode: str, wanted: PoseNumbers) -> None:
        """Draw the machine anew, at the pose that is wanted or else at home; nothing where it reaches neither."""
        for numbers in (wanted, home_of(machine)):
            try:
                self.stage.draw(machine, numbers.frame, mode)
            except NoResultError:
                continue
            self._drawn = machine, mode
            return
        self._drawn = None


def _bodies(machine: Machine, mode: str, wanted: PoseNumbers) -> Bodies | None:
    """Where the bodies are, None where a chain does not reach."""
    try:
        there = bodies(machine, wanted.frame, parse_mode(machine, mode or None))
    except NoResultError:
        return None
    return there if np.all(there.reach >= 0) and np.isfinite(there.frames).all() else None
