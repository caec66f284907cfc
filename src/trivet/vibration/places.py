"""Places on a machine at which it is excited and at which its motion is looked at."""

from __future__ import annotations

import dataclasses
import re
from typing import NamedTuple

import numpy as np

from trivet.errors import InputError, nearest
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.assembly import PLATFORM, Structure

_ON_BEAM = re.compile(r"(?P<name>[^@]+)@(?P<share>[0-9]*\.?[0-9]+)")


class Place(NamedTuple):
    """A point of a structure."""

    structure: Structure
    """With a node there."""
    node: int
    at: np.ndarray
    """(3,) in {O}, m; rigid with the node."""


def place_of(machine: Machine, pose: Frame, structure: Structure, name: str) -> Place:
    """The place of a name.

    Args:
        machine, pose: the machine and where its platform is.
        structure: the machine's structure there.
        name: "platform" (its centre), "tool" (its tip), a joint ("leg-1.hinge", the side of the platform), or a share of a beam
            from the ground on ("leg-1.link@0.5").

    Raises:
        InputError: for a name that is none of these.
    """
    if name in ("platform", "tool"):
        return Place(structure, PLATFORM, point_of_platform(machine, pose, name))
    ties = {tie.name: tie for tie in structure.connections}
    if name in ties:
        node = ties[name].second
        return Place(structure, node, structure.nodes[node] if node != PLATFORM else ties[name].at)
    beams = list(dict.fromkeys(beam.name for beam in structure.beams))
    match = _ON_BEAM.fullmatch(name)
    if match and match["name"] in beams and float(match["share"]) <= 1:
        divided, node = _with_node(structure, match["name"], float(match["share"]))
        return Place(divided, node, divided.nodes[node])
    known = ["platform", "tool", *ties, *(f"{beam}@0.5" for beam in beams)]
    raise InputError(
        f"place {name}: not known{nearest(name, known)}; write platform, tool, a joint or a share of a beam: {beams[0]}@0.5"
    )


def point_of_platform(machine: Machine, pose: Frame, name: str) -> np.ndarray:
    """(3,) platform centre or tool tip in {O}, m.

    Raises:
        InputError: for the tool of a machine that has none.
    """
    local = (0.0, 0.0, 0.0) if name == "platform" else machine.platform.tool_tip
    if local is None:
        raise InputError(f"place tool: {machine.name} has no platform.tool_tip; give one, or write platform")
    return np.array([float(c) for c in pose.shift(local).origin])


def _with_node(structure: Structure, name: str, share: float) -> tuple[Structure, int]:
    """The structure with a node at a share of a beam, which may have pieces already."""
    pieces = [beam for beam in structure.beams if beam.name == name]
    spans = np.array([float(beam.length) for beam in pieces])
    ends = np.concatenate([[0.0], np.cumsum(spans)])
    distance = share * ends[-1]
    for end, node in zip(ends, [pieces[0].first, *(beam.second for beam in pieces)], strict=True):
        if abs(distance - end) < 1e-9 * ends[-1]:
            return structure, node
    number = int(np.searchsorted(ends, distance)) - 1
    beam, part = pieces[number], distance - ends[number]
    node = len(structure.nodes)
    fraction = part / spans[number]
    at = (1 - fraction) * structure.nodes[beam.first] + fraction * structure.nodes[beam.second]
    halves = [
        dataclasses.replace(beam, second=node, length=np.asarray(part)),
        dataclasses.replace(beam, first=node, length=np.asarray(spans[number] - part)),
    ]
    where = structure.beams.index(beam)
    beams = (*structure.beams[:where], *halves, *structure.beams[where + 1 :])
    return dataclasses.replace(structure, nodes=np.concatenate([structure.nodes, at[None]]), beams=beams), node
