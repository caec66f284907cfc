"""Planar chains: a guide, which puts the platform joint into a plane, carrying a planar leg (paper Eqs 2-4).

Guides and legs are chosen by what the chain is made of; every pair of them is a chain.
"""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

import jax.numpy as jnp

from trivet.kinematics.chains import ELBOW, SIDE
from trivet.kinematics.guides import Placing, circular, stage, straight
from trivet.kinematics.legs import elbow, slide_link, telescope
from trivet.kinematics.walk import Posture
from trivet.model import Leg
from trivet.model.elements import Element, Offset
from trivet.space.frame import IDENTITY, Angle, Frame
from trivet.space.scalar import Scalar

GUIDES: tuple[ModuleType, ...] = (stage, circular, straight)
LEGS: tuple[ModuleType, ...] = (slide_link, telescope, elbow)


class _Parts(NamedTuple):
    """A chain as guide, rigid offsets and leg."""

    guide: ModuleType
    family: ModuleType
    guide_elements: tuple[Element, ...]
    offsets: tuple[Offset, ...]
    leg_elements: tuple[Element, ...]


def _parts(elements: tuple[Element, ...]) -> _Parts | None:
    for guide in GUIDES:
        count = guide.matches(elements)
        offsets: list[Offset] = []
        for element in elements[count:]:
            if not isinstance(element, Offset):
                break
            offsets.append(element)
        core = elements[count + len(offsets) :]
        for family in LEGS if count else ():
            if family.matches(core) and (guide is not stage or _can_stand(elements, family, core)):
                return _Parts(guide, family, elements[:count], tuple(offsets), core)
    return None


def _can_stand(elements: tuple[Element, ...], family: ModuleType, core: tuple[Element, ...]) -> bool:
    return not stage.is_open(elements) or (family is slide_link and slide_link.is_locked_flat(core))


def matches(elements: tuple[Element, ...]) -> bool:
    """Whether a chain is a guide carrying a leg."""
    return _parts(elements) is not None


def guide_size(elements: tuple[Element, ...]) -> int:
    """How many elements, from the first, are the guide; none where the chain is not a guide carrying a leg."""
    parts = _parts(elements)
    return 0 if parts is None else len(parts.guide_elements)


def branches(elements: tuple[Element, ...]) -> tuple[int, ...]:
    """The choices of guide and leg."""
    parts = _parts(elements)
    assert parts is not None
    side = (SIDE,) if parts.guide.has_side(elements) else ()
    return side + ((ELBOW,) if parts.family.HAS_ELBOW else ())


def stand(leg: Leg, pose: Frame, signs: Scalar) -> Posture:
    """How the chain stands; coordinates are NaN where `reach` is below zero."""
    parts = _parts(leg.chain.elements)
    assert parts is not None
    base, end = leg.base_frame(), pose.shift(leg.platform_frame().origin).origin
    placing: Placing
    if parts.guide is stage and stage.is_open(parts.guide_elements):
        # Where the leg starts needs no placing: the guide's own frames are the same in every plane.
        circle, cross = parts.guide_elements
        frame = _beyond(cross.advance(circle.advance(IDENTITY, Angle(1, 0)), 0), parts.offsets)
        outwards, limit = slide_link.outwards(parts.leg_elements, frame, end.z - base.origin.z, signs[ELBOW])
        placing = stage.place(parts.guide_elements, base, end, signs[SIDE], outwards)
        placing = placing._replace(clear=jnp.minimum(placing.clear, limit))
    else:
        placing = parts.guide.place(parts.guide_elements, base, end, signs[SIDE])
    frame = placing.start
    for element, coordinate in zip(parts.guide_elements, placing.walked, strict=True):
        frame = element.advance(frame, coordinate)
    frame = _beyond(frame, parts.offsets)
    solved, reach = parts.family.solve(parts.leg_elements, frame, placing.end, signs[ELBOW])
    rest = (*(None for _ in parts.offsets), *solved)
    return Posture(
        placing.heading,
        placing.start,
        placing.end,
        (*placing.walked, *rest),
        (*placing.coordinates, *rest),
        jnp.minimum(reach, placing.clear),
    )


def _beyond(frame: Frame, offsets: tuple[Offset, ...]) -> Frame:
    for offset in offsets:
        frame = offset.advance(frame)
    return frame
