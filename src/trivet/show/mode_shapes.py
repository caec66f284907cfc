"""Natural modes: the shapes of a machine's drawing with the way that every corner of them goes in every mode."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trivet.files import replacing
from trivet.show.drawing import title_lines
from trivet.show.maps import check_suffix
from trivet.show.scene import scene
from trivet.show.shapes import Array, Shape
from trivet.statics.assembly import GROUND, PLATFORM
from trivet.study.mode_summary import ModeSummary, summaries
from trivet.study.modes import ModesReport

LARGEST = 0.1
"""Largest displacement in a drawing, as a share of the machine's size."""
COARSER = 2
"""Of what is round every so manieth corner is drawn."""
HIDDEN = 0.75
"""Share of a barrel in which the rod is not drawn, so that it does not come out below."""
SEGMENTS = 16
"""Of a beam, at least."""


class Moving(NamedTuple):
    """A shape that moves in modes."""

    shape: Shape
    moves: Array
    """(rings, corners, 3, m): way of its corners in every mode."""

    def at(self, mode: int, factor: float) -> Shape:
        """The shape displaced."""
        return self.shape._replace(rings=self.shape.rings + factor * self.moves[..., mode])


class MovingScene(NamedTuple):
    """A machine as it vibrates."""

    bodies: tuple[Moving, ...]
    """Ways are scaled, the largest of every mode to `LARGEST` times the size."""
    rest: tuple[Shape, ...]
    """What stands still: the ground, what is fixed to it, the axes of {O}."""
    size: float
    """Largest extent of the machine, m."""
    modes: tuple[ModeSummary, ...]
    title: tuple[str, ...]
    """The machine, how it stands, what is shown."""


def draw_modes(report: ModesReport, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Draw modes: the first six side by side (PNG), or all of them moving, one at a time, in a self-contained page (HTML)."""
    suffix = check_suffix(path)
    with replacing(path, overwrite=overwrite) as temporary:
        if suffix == ".png":
            from trivet.show.mode_picture import write_picture as write_drawing
        else:
            from trivet.show.mode_page import write_page as write_drawing
        write_drawing(moving_scene(report), temporary)


def moving_scene(report: ModesReport) -> MovingScene:
    """The machine of a report with its modes."""
    at = report.at
    seen = scene(at.machine, at.frame, at.mode or None)
    kept = [s for s in seen.shapes if s.role not in ("workpiece", "motion") and not s.name.startswith("{E}")]
    corners = np.concatenate([s.rings.reshape(-1, 3) for s in kept if not s.name.startswith("{O}")])
    size = float(np.ptp(corners, axis=0).max())
    carried = [(shape, _carriers(shape, report)) for shape in kept]
    barrels = {s.name: _length(s) for s in kept if s.role.endswith("joint") and _length(s) > 0}
    found = [_moving(shape, nodes, barrels.get(shape.name, 0.0), report) for shape, nodes in carried if nodes != [GROUND]]
    most = np.max([np.linalg.norm(body.moves, axis=2).max(axis=(0, 1)) for body in found], axis=0)
    scaled = tuple(body._replace(moves=body.moves * (LARGEST * size / np.where(most > 0, most, 1.0))) for body in found)
    what = f"natural modes without damping; the largest displacement is drawn as {100 * LARGEST:.0f} % of the machine's size"
    rest = tuple(shape for shape, nodes in carried if nodes == [GROUND])
    title = (*title_lines(at.machine, at.frame, at.mode), what)
    return MovingScene(scaled, rest, size, tuple(summaries(report)), title)


def _carriers(shape: Shape, report: ModesReport) -> list[int]:
    """Nodes with which a shape moves: one that it is rigid with, or those along a beam."""
    structure = report.modes.mesh.structure
    if shape.role in ("platform", "tool"):
        return [PLATFORM]
    pieces = [beam for beam in structure.beams if beam.name == shape.name]
    along = [beam.first for beam in pieces] + [beam.second for beam in pieces[-1:]]
    tie = next((tie for tie in structure.connections if tie.name == shape.name), None)
    if shape.role != "guide" and _length(shape) > 0 and pieces:  # a link, or the barrel of a telescope
        return along
    if tie is None:
        return [GROUND]
    if shape.role == "guide":
        return [tie.first]
    # The carriage of a slide that has a beam is drawn at its far end.
    return along[-1:] or [tie.second]


def _length(shape: Shape) -> float:
    return float(np.linalg.norm(shape.end - shape.start))


def _moving(shape: Shape, nodes: list[int], barrel: float, report: ModesReport) -> Moving:
    """A shape with the ways of its corners, not scaled; on a beam its rings are as many as make the bend smooth.

    Args:
        shape: as the scene has it.
        nodes: with which it moves.
        barrel: length of the barrel in which it, the rod of a telescope, begins; zero for other shapes.
        report: the modes.
    """
    coarse = shape._replace(rings=shape.rings[:, :: COARSER if shape.rings.shape[1] > 12 else 1])
    places, twists = report.modes.mesh.structure.nodes[nodes], report.modes.displacements[nodes]
    low, high, count = 0.0, 1.0, SEGMENTS // 2 if _length(shape) > 0 else 0
    if len(nodes) > 1:
        whole, is_barrel = float(np.linalg.norm(places[-1] - places[0])), shape.role.endswith("joint")
        if is_barrel:  # it bends with its rod, but stays on its foot
            twists = twists - np.concatenate([_slip(shape.name, nodes[0], report), np.zeros_like(twists[0, :3])])
        low, high = (0.0, barrel / whole) if is_barrel else (HIDDEN * barrel / whole, 1.0)
        places, twists = _bent(places, twists, low, high)
        count = len(places)
    if count:
        own = np.linspace(0.0 if shape.role.endswith("joint") else low, 1.0, count)[:, None, None]
        coarse = coarse._replace(rings=(1 - own) * coarse.rings[0] + own * coarse.rings[-1])
    arms = coarse.rings - places[:, None]
    turned = np.cross(twists[:, None, 3:], arms[..., None], axisa=2, axisb=2, axisc=2)
    return Moving(coarse, twists[:, None, :3] + turned)


def _slip(name: str, node: int, report: ModesReport) -> Array:
    """(3, m): what a node behind a joint moves more than the body before the joint."""
    structure, twists = report.modes.mesh.structure, report.modes.displacements
    first = next(tie.first for tie in structure.connections if tie.name == name)
    arm = structure.nodes[node] - structure.nodes[first]
    slip: Array = twists[node, :3] - twists[first, :3] - np.cross(twists[first, 3:], arm, axisa=0, axisc=0)
    return slip


def _bent(nodes: Array, twists: Array, low: float, high: float) -> tuple[Array, Array]:
    """A stretch of a beam between its nodes, cubic across and linear along as its elements are.

    Args:
        nodes: (n, 3) positions, m.
        twists: (n, 6, m) in every mode.
        low, high: where the stretch begins and ends, shares of the length.

    Returns:
        Positions (k, 3) and twists (k, 6, m) at equal distances.
    """
    pieces = -(-SEGMENTS // (len(nodes) - 1))
    inside = np.linspace(0.0, 1.0, pieces + 1)[None, 1:, None, None]
    ways = np.diff(nodes, axis=0)
    first, second = twists[:-1, None], twists[1:, None]
    between = (1 - inside) * first + inside * second
    across = np.cross(twists[:, 3:], _of_nodes(ways)[:, :, None], axisa=1, axisb=1, axisc=1)
    # What the cubic with the slopes of the ends adds to the straight line.
    chord = second[:, :, :3] - first[:, :, :3]
    length = np.einsum("ni,ni->n", ways, ways)[:, None, None, None]
    chord = chord - np.einsum("ni,nkim->nkm", ways, chord)[:, :, None] * ways[:, None, :, None] / length
    start, end = across[:-1, None] - chord, across[1:, None] - chord
    between[:, :, :3] += inside * (1 - inside) * ((1 - inside) * start - inside * end)
    flat = np.concatenate([twists[:1], between.reshape(-1, *twists.shape[1:])])
    places = np.concatenate([nodes[:1], (nodes[:-1, None] + inside[..., 0] * ways[:, None]).reshape(-1, 3)])
    wanted = np.linspace(low, high, len(flat)) * (len(flat) - 1)
    below = np.minimum(wanted.astype(int), len(flat) - 2)
    beyond = (wanted - below)[:, None]
    here = (1 - beyond) * places[below] + beyond * places[below + 1]
    return here, (1 - beyond[..., None]) * flat[below] + beyond[..., None] * flat[below + 1]


def _of_nodes(ways: Array) -> Array:
    """(n, 3) from (n - 1, 3): the way of the element beside every node, all elements of a beam being equal."""
    return np.concatenate([ways, ways[-1:]])


def joined(shapes: list[Shape]) -> tuple[Array, Array]:
    """Vertices (n, 3) in m and triangles (k, 3) of several shapes as one skin."""
    meshes = [shape.mesh() for shape in shapes]
    starts = itertools.accumulate((len(vertices) for vertices, _ in meshes[:-1]), initial=0)
    triangles = [faces + start for start, (_, faces) in zip(starts, meshes, strict=True)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(triangles)


def captions(seen: MovingScene) -> Iterator[tuple[str, str]]:
    """Two lines per mode: its frequency with what the platform does, and what yields."""
    for mode in seen.modes:
        moves = " " + mode.motion if mode.motion.startswith("hardly") else f": {mode.motion}"
        yielding = ", ".join(f"{part}\u00a0{100 * share:.0f}\u00a0%" for part, share in mode.yielding)
        yield f"{mode.number}: {mode.frequency:.1f} Hz, platform{moves}", f"yielding: {yielding}"
