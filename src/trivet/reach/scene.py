"""What a machine can run into: its bodies as capsules and boxes, and the pairs of them that must stay apart."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.errors import InputError
from trivet.kinematics.alike import Alike
from trivet.kinematics.walk import Posture, walk
from trivet.model import Leg, Machine, shape
from trivet.model.elements import Beam, Element, Joint, Prismatic, Stock
from trivet.model.elements.beam import beam_axes
from trivet.model.machine import PLATFORM, WORKPIECE, Platform, bodies
from trivet.reach.distance import Box, Capsule, boxes, capsule_to_box, capsules
from trivet.reach.meshes import Solid, hull
from trivet.space.frame import IDENTITY, Frame, about_z
from trivet.space.scalar import Scalar
from trivet.space.vector import Vec

Placeable = Capsule | Box | Solid

Placed = dict[tuple[Any, ...], tuple[tuple[int, ...], Placeable]]
"""Shapes in {O} by source, that of the first of alike chains: which parts they are, and the shapes, components (parts, n)."""


class Ball(NamedTuple):
    """The workpiece, as far as something may run into it: a sphere in {O}, m."""

    centre: Vec
    radius: Scalar


class Part(NamedTuple):
    """One shape of one body."""

    body: str
    """Its element, "leg-1.link"; "platform", "workpiece" or a fixture."""
    source: tuple[Any, ...]
    """Where the shape comes from: ("leg", chain, element, k), ("platform", k), ("fixture", name, k) or ("workpiece",)."""
    kind: str
    """"capsule", "box" or "mesh"."""
    mesh: tuple[str, str] | None = None
    """File and unit of a mesh."""

    def hull(self) -> Any:
        """What coal makes of a mesh; None for any other shape.

        Raises:
            InputError: names the body.
        """
        try:
            return None if self.mesh is None else hull(*self.mesh)
        except InputError as error:
            raise InputError(f"shapes of {self.body}: {error}") from None


class Scene(NamedTuple):
    """The shapes of a machine, and which of them must stay apart; nothing in it depends on dimensions."""

    parts: tuple[Part, ...]
    pairs: tuple[tuple[int, int], ...]

    @property
    def plain(self) -> Scene:
        """The scene without pairs that have a mesh in them."""
        return self._replace(pairs=tuple(p for p in self.pairs if all(self.parts[k].mesh is None for k in p)))

    @property
    def meshed(self) -> Scene:
        """The scene with those pairs alone."""
        return self._replace(pairs=tuple(p for p in self.pairs if any(self.parts[k].mesh is not None for k in p)))

    def names(self) -> list[tuple[str, str]]:
        """The bodies of every pair."""
        return [(self.parts[a].body, self.parts[b].body) for a, b in self.pairs]


def scene_of(machine: Machine, *, with_workpiece: bool) -> Scene:
    """What is to be looked at.

    Args:
        machine: the machine.
        with_workpiece: whether the workpiece stands in the way.
    """
    legs = machine.legs
    parts, place = [], {}
    for number, leg in enumerate(legs):
        for index, element in enumerate(leg.chain.elements):
            for k, kind in enumerate(_kinds(element, machine.stock)):
                name = f"{leg.name}.{element.name}"
                is_platform = index == len(leg.chain.elements) - 1
                parts.append(Part(name, ("leg", number, index, k), *kind))
                place[len(parts) - 1] = PLATFORM if is_platform else (number, _joints_upto(leg, index))
    for k, kind in enumerate(_platform_kinds(machine.platform)):
        parts.append(Part(PLATFORM, ("platform", k), *kind))
        place[len(parts) - 1] = PLATFORM
    for name, shapes in sorted(machine.fixtures.items()):
        for k, own in enumerate(shapes):
            parts.append(Part(name, ("fixture", name, k), *_kind(own)))
            place[len(parts) - 1] = "ground"
    if with_workpiece:
        parts.append(Part(WORKPIECE, ("workpiece",), "capsule"))
        place[len(parts) - 1] = WORKPIECE
    touching = _touching(machine)
    filled = {where for where in place.values() if isinstance(where, tuple)}
    pairs = [
        (a, b)
        for a in range(len(parts))
        for b in range(a + 1, len(parts))
        if not _may_touch(place[a], place[b], filled, legs) and frozenset((parts[a].body, parts[b].body)) not in touching
    ]
    return Scene(tuple(parts), tuple(pairs))


def _joints_upto(leg: Leg, index: int) -> int:
    return sum(isinstance(e, Joint) for e in leg.chain.elements[: index + 1])


def _kind(own: shape.AnyShape) -> tuple[Any, ...]:
    """Kind of a shape, and file and unit of a mesh."""
    if isinstance(own, shape.Mesh):
        return "mesh", (own.file, own.unit)
    return ("box",) if isinstance(own, shape.Box) else ("capsule",)


def _kinds(element: Element, stock: Stock) -> list[tuple[Any, ...]]:
    if element.shapes is not None:
        return [_kind(own) for own in element.shapes]
    profile = _profile(element)
    if profile is None:
        return []
    return [("capsule",) if stock.sections[profile.section].outline.is_round else ("box",)]


def _platform_kinds(platform: Platform) -> list[tuple[Any, ...]]:
    if platform.shapes is not None:
        return [_kind(own) for own in platform.shapes]
    return [] if platform.disc is None else [("box",)]


def _profile(element: Element) -> Any:
    if isinstance(element, Beam):
        return element.profile
    return element.beam if isinstance(element, Prismatic) else None


def _touching(machine: Machine) -> set[frozenset[str]]:
    """Declared pairs, copy by copy."""
    known = bodies(machine)
    return {frozenset((a, b)) for pair in machine.apart.may_touch for a in known[pair[0]] for b in known[pair[1]]}


def _may_touch(a: Any, b: Any, filled: set[Any], legs: tuple[Leg, ...]) -> bool:
    """Whether two bodies are one, or connected by joints with nothing that has a shape in between."""
    if a == b or {a, b} == {PLATFORM, WORKPIECE} or {a, b} == {"ground", WORKPIECE}:
        return True
    if isinstance(a, tuple) and isinstance(b, tuple):
        (leg, low), (other, high) = sorted((a, b))
        return leg == other and not any((leg, k) in filled for k in range(low + 1, high))
    if isinstance(b, tuple):
        a, b = b, a
    if not isinstance(a, tuple):
        return False
    leg, own = a
    if b == "ground":
        return own == 1  # the carriage on its guide
    last = sum(isinstance(e, Joint) for e in legs[leg].chain.elements)
    return b == PLATFORM and not any((leg, k) in filled for k in range(own + 1, last))


def placed(
    scene: Scene, machine: Machine, groups: list[Alike], stands: list[Posture], pose: Frame, workpiece: Ball | None
) -> Placed:
    """Every shape in {O}.

    Args:
        scene: what is to be placed.
        machine: of the same topology.
        groups, stands: its chains and how they stand, components (chains, n).
        pose: platform frame, components (n,).
        workpiece: where it is, in a scene that has one.

    Returns:
        By source, that of the first of alike chains: which parts these are, and the shape, components (parts, n) or such that
        they spread to these.
    """
    number = {part.source: k for k, part in enumerate(scene.parts)}
    found: Placed = {}
    for group, posture in zip(groups, stands, strict=True):
        elements = group.leg.chain.elements
        steps = walk(elements, posture)
        end = pose.shift(group.leg.platform_frame().origin)
        for index, (element, frame, _) in enumerate(steps):
            if not any(("leg", group.places[0], index, k) in number for k in range(len(_kinds(element, machine.stock)))):
                continue
            if index == len(steps) - 1:
                beyond = pose.place(group.leg.platform_frame())
                before = beyond
            else:
                before, beyond = (_in_o(f, posture, end.origin) for f in (frame, steps[index + 1][1]))
            for k, own in enumerate(_own_shapes(element, before, beyond, machine.stock)):
                parts = tuple(number["leg", place, index, k] for place in group.places)
                found["leg", group.places[0], index, k] = parts, own
    for k, own in enumerate(_platform_shapes(machine.platform, pose)):
        found["platform", k] = (number["platform", k],), _with_axis(own)
    for name, shapes in machine.fixtures.items():
        for k, given in enumerate(shapes):
            found["fixture", name, k] = (number["fixture", name, k],), _with_axis(shape_in(given, IDENTITY))
    if ("workpiece",) in number:
        assert workpiece is not None
        found[("workpiece",)] = (number[("workpiece",)],), Capsule(workpiece.centre, workpiece.centre, workpiece.radius)
    # All of one shape, so that what belongs to a chain is never taken for what belongs to a pose.
    count = jnp.shape(pose.origin.x)[0]
    return {source: (parts, _spread(own, len(parts), count)) for source, (parts, own) in found.items()}


def _spread(own: Placeable, many: int, count: int) -> Any:
    return jax.tree.map(lambda c: jnp.broadcast_to(c, (many, count)), own)


def _in_o(frame: Frame, posture: Posture, end: Vec) -> Frame:
    """A frame of a walk in {O}: the walk's axes are turned about z, and its platform joint is where the pose has it."""
    turned = (about_z(posture.heading, axis) for axis in frame[1:])
    return Frame(end + about_z(posture.heading, frame.origin - posture.end), *turned)


def _own_shapes(element: Element, before: Frame, beyond: Frame, stock: Stock) -> Iterator[Placeable]:
    if element.shapes is not None:
        yield from (shape_in(own, beyond) for own in element.shapes)
        return
    profile = _profile(element)
    if profile is None:
        return
    outline = stock.sections[profile.section].outline
    start, end = before.origin, beyond.origin
    if outline.is_round:
        yield Capsule(start, end, outline.width / 2)
        return
    x, y, z = beam_axes(before, element.axis_of_body)  # type: ignore[arg-type]
    along = end - start
    half = Vec(jnp.abs(along @ x) / 2, outline.width / 2, outline.height / 2)
    yield Box(Frame(start + along * 0.5, x, y, z), half)


def _platform_shapes(platform: Platform, pose: Frame) -> Iterator[Placeable]:
    if platform.shapes is not None:
        yield from (shape_in(own, pose) for own in platform.shapes)
    elif platform.disc is not None:
        radius = platform.disc.radius
        yield Box(pose, Vec(radius, radius, platform.disc.thickness / 2))


def shape_in(own: shape.AnyShape, frame: Frame) -> Placeable:
    """A shape of a machine file, given in a frame, in the outer axes of that frame."""
    if isinstance(own, shape.Mesh):
        return Solid(frame.shift(own.centre))
    if isinstance(own, shape.Box):
        x, y, z = own.size
        return Box(frame.shift(own.centre), Vec(x / 2, y / 2, z / 2))
    start, end = (own.centre, own.centre) if isinstance(own, shape.Sphere) else (own.start, own.end)
    return Capsule(frame.shift(start).origin, frame.shift(end).origin, own.radius)


def _with_axis(own: Any) -> Any:
    """With an axis for the chains, of which there is one."""
    return jax.tree.map(lambda c: jnp.asarray(c, dtype=float)[None] if jnp.ndim(c) else c, own)


def distances(scene: Scene, shapes: Placed) -> Iterator[tuple[list[int], Scalar]]:
    """Signed distances of pairs, those of one kind of shapes at a time, so that each kind is compiled once.

    Yields:
        Which pairs of the scene these are, and their distances (pairs, n).
    """
    stacks: dict[type, Any] = {}
    home: dict[int, tuple[type, int]] = {}
    for kind in (Capsule, Box):
        own = [(parts, shape) for parts, shape in shapes.values() if isinstance(shape, kind)]
        if own:
            stacks[kind] = jax.tree.map(lambda *c: jnp.concatenate(c), *(shape for _, shape in own))
            home |= {part: (kind, row) for row, part in enumerate(part for parts, _ in own for part in parts)}
    groups: dict[tuple[type, type], list[tuple[int, int, int]]] = {}
    for k, (a, b) in enumerate(scene.pairs):
        (one, row), (two, other) = home[a], home[b]
        if one is Box and two is Capsule:
            (one, row), (two, other) = (two, other), (one, row)
        groups.setdefault((one, two), []).append((k, row, other))
    for (one, two), members in groups.items():
        order, rows, others = (np.array(column) for column in zip(*members, strict=True))
        first, second = (jax.tree.map(lambda c, at=at: c[at], stacks[kind]) for kind, at in ((one, rows), (two, others)))
        yield order.tolist(), _distance(first, second)


def _distance(one: Any, two: Any) -> Scalar:
    if isinstance(two, Capsule):
        return capsules(one, two)
    return boxes(one, two) if isinstance(one, Box) else capsule_to_box(one, two)


FAR = math.inf
"""Distance of the nearest bodies where there are none to be looked at."""
