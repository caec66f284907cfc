"""What a page tells of a machine when it has settled: stiffness, singularity, responses, natural modes; as pieces of HTML."""

from __future__ import annotations

from typing import NamedTuple

from trivet.errors import TrivetError
from trivet.model import Machine
from trivet.show.mode_shapes import MovingScene, moving_scene
from trivet.study.frf import FrequencyResponse, frf, minimum_dynamic_stiffness
from trivet.study.mode_summary import MORE, aligned, summaries
from trivet.study.modes import modes
from trivet.study.pose import PoseReport
from trivet.study.singularity import SingularityReport, singularity_report
from trivet.viewer import words
from trivet.viewer.state import PoseNumbers

POINTS, HIGHEST, MODES = 400, 3000.0, 12
"""Of a frequency response: frequencies, and the highest (Hz); natural modes."""


def stiffness_pieces(report: PoseReport, direction: str) -> list[str]:
    """Stiffness along the axes, and what a deflection is lost in."""
    try:
        return [words.stiffness(report), f"<b>budget along {direction}</b>", words.budget(report, direction)]
    except TrivetError as error:
        return [words.esc(str(error))]


def singular(machine: Machine, numbers: PoseNumbers, mode: str) -> tuple[SingularityReport | None, str]:
    """How near a singularity is; None and why, where that cannot be told."""
    try:
        found = singularity_report(machine, numbers.frame, mode=mode or None)
    except TrivetError as error:
        return None, words.esc(str(error))
    return found, words.singular(found)


class Vibration(NamedTuple):
    """How a machine vibrates."""

    response: FrequencyResponse | None
    told: list[str]
    modes: list[str]
    """In words."""
    seen: MovingScene | None


def vibration(machine: Machine, numbers: PoseNumbers, mode: str, with_scene: bool) -> Vibration:
    """Responses up to `HIGHEST` and the lowest modes, with what is to be seen of them where asked for."""
    at = (machine, numbers[:3], *numbers[3:])
    try:
        response = frf(*at, mode=mode or None, anyway=True, high=HIGHEST, points=POINTS)
        told = [words.minima(minimum_dynamic_stiffness(response.at)[:3])]
        found = aligned(modes(*at, mode=mode or None, anyway=True, count=MODES + MORE), MODES)
    except TrivetError as error:
        return Vibration(None, [words.esc(str(error))], [], None)
    listed = [f"{one.frequency:.1f} Hz, {one.motion}" for one in summaries(found)]
    return Vibration(response, told, listed, moving_scene(found) if with_scene else None)
