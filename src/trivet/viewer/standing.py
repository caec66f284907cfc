"""How a machine stands at the pose of a page: whether it is reached, what bites, and who is named for it."""

from __future__ import annotations

import re
from typing import NamedTuple

from trivet.errors import NoResultError
from trivet.model import Machine
from trivet.study.pose import PoseReport, pose
from trivet.viewer.state import PoseNumbers

NAMES = re.compile(r"[a-z][a-z0-9_-]*\.[a-z][a-z0-9_-]*")
"""Of joints and bodies in a sentence: "leg-1.hinge"."""


class Standing(NamedTuple):
    """How a machine stands."""

    report: PoseReport | None
    """Everything about the pose; None where a chain cannot close."""
    is_right: bool
    """Whether the pose is reached, all joints inside their travel and all bodies apart."""
    sentences: tuple[str, ...]
    """What is to be said, the gravest first."""
    named: frozenset[str]
    """Joints and bodies that a sentence names."""


def standing(machine: Machine, numbers: PoseNumbers, mode: str) -> Standing:
    """A machine at a pose in a working mode."""
    try:
        report = pose(machine, numbers[:3], *numbers[3:], mode=mode or None, anyway=True)
    except NoResultError as error:
        return _said(None, [str(error).removeprefix(f"{machine.name}: ")])
    outside = [joint.name for joint in report.joints if not joint.inside]
    sentences = []
    if report.miss is not None:
        sentences.append(report.miss.reason)
        if more := [name for name in outside if name not in report.miss.reason]:
            sentences.append(f"outside their travel too: {', '.join(more)}")
    least = float(machine.apart.clearance)
    for one, other, distance in report.clearances:
        if distance < least:
            how = "touch" if distance < 0 else f"are {1e3 * distance:.2f} mm apart, less than {1e3 * least:g} mm"
            sentences.append(f"{one} and {other} {how}")
    return _said(report, sentences)


def _said(report: PoseReport | None, sentences: list[str]) -> Standing:
    named = {name for sentence in sentences for name in NAMES.findall(sentence)}
    if any(re.search(r"\bplatform and|and platform\b", sentence) for sentence in sentences):
        named.add("platform")
    return Standing(report, not sentences, tuple(sentences), frozenset(named))
