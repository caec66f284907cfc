"""A scene as one page that plays without Python: the machines as they ring, or on their way from home to the pose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from trivet.viewer.actor import Actor
from trivet.viewer.ringing import FRAMES, PERIOD
from trivet.viewer.state import PoseNumbers, State, home_of

PACE = 24.0
"""Pictures per second on the way."""
WAY = 48
"""Pictures there, and as many back."""


def recorded(server: viser.ViserServer, actors: list[Actor], state: State, is_dark: bool) -> str:
    """The page."""
    serializer = server.get_scene_serializer()
    try:
        _play(serializer, actors, state)
    finally:
        page: str = serializer.as_html(is_dark)  # even if all is lost: it would go on recording
    return page


def _play(serializer: Any, actors: list[Actor], state: State) -> None:
    if any(actor.ringing.is_shown for actor in actors):
        for picture in range(FRAMES):
            for actor in actors:
                actor.ringing.swing(2 * math.pi * picture / FRAMES)
            serializer.insert_sleep(PERIOD / FRAMES)
    else:
        for part in (1 - np.cos(np.linspace(0, 2 * np.pi, 2 * WAY + 1))) / 2:
            _stand(actors, state, float(part))
            serializer.insert_sleep(1 / PACE)
        _stand(actors, state, 1.0)


def _stand(actors: list[Actor], state: State, part: float) -> None:
    for number, actor in enumerate(actors):
        begin, end = home_of(state.machines[number]), state.pose_of(number)
        numbers = PoseNumbers(*(a + part * (b - a) for a, b in zip(begin, end, strict=True)))
        actor.follow(state.machines[number], state.modes[number], numbers)
