"""Checks that need more than one key of a machine file."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator

import numpy as np

from trivet.errors import InputError, nearest, shown
from trivet.model.elements import (
    Beam,
    Body,
    Curvilinear,
    Drivable,
    Element,
    Joint,
    Offset,
    Prismatic,
    Profile,
    Revolute,
    Socket,
    Spherical,
    Universal,
)  # fmt: skip
from trivet.model.machine import PLATFORM, WORKPIECE, Chain, Machine, Platform, bodies
from trivet.model.rules import cone_rules, mm, rules
from trivet.model.section import General


def check(machine: Machine, known_materials: Iterable[str] = ()) -> None:
    """Raise InputError with the key path, the values and the remedy at the first contradiction.

    Args:
        machine: as read, with every material that it names and trivet knows.
        known_materials: names of materials that trivet knows, for hints.
    """
    materials = {*machine.materials, *known_materials}
    for name, section in machine.sections.items():
        if isinstance(section, General) and machine.theory == "timoshenko":
            for key in ("shear_area_y", "shear_area_z"):
                if getattr(section, key) is None:
                    raise InputError(f'sections.{name}.{key}: needed, and missing, with theory = "timoshenko"')
    platform = machine.platform
    if platform.disc is not None:
        if platform.mass is not None:
            raise InputError("platform.mass: given together with platform.disc; keep one of them")
        _defined("platform.disc.material", platform.disc.material, machine.materials, materials)
    _check_platform(platform)
    for name, chain in machine.chains.items():
        for path, profile in _profiles(f"chains.{name}", chain):
            _defined(f"{path}.section", profile.section, machine.sections, machine.sections)
            _defined(f"{path}.material", profile.material, machine.materials, materials)
        _check_chain(f"chains.{name}", chain)
    _check_bodies(machine)
    for rule in rules(machine):
        if not rule.kept:
            raise InputError(rule.words())


def _check_bodies(machine: Machine) -> None:
    for name in machine.fixtures:
        if name in (PLATFORM, WORKPIECE):
            raise InputError(f'fixtures.{name}: "{name}" is a body that every machine has; choose another name')
    known = bodies(machine)
    for body in (body for pair in machine.apart.may_touch for body in pair):
        if body not in known:
            raise InputError(f"interference.may_touch: no body {shown(body)}{nearest(body, known)}")


def _check_platform(platform: Platform) -> None:
    if platform.inertia is None:
        if platform.products_of_inertia is not None:
            raise InputError("platform.products_of_inertia: needs platform.inertia beside it")
        return
    if platform.mass is None:
        raise InputError("platform.inertia: needs platform.mass beside it")
    if not platform.mass and any(platform.inertia):
        raise InputError("platform.inertia: a body without mass has none; give platform.mass")


def _check_lump(path: str, joint: Joint) -> None:
    for key in ("centre_of_mass", "inertia"):
        if getattr(joint, key) is not None and joint.mass is None:
            raise InputError(f"{path}.{key}: needs {path}.mass beside it")
    if joint.inertia is not None and not joint.mass and any(joint.inertia):
        raise InputError(f"{path}.inertia: a body without mass has none; give {path}.mass")


def _check_bearing(path: str, joint: Joint) -> None:
    """A bearing yields across the joint's freedom: along the freedom the joint's own stiffness, or its drive's, is at work."""
    if joint.bearing is None:
        return
    along: list[np.ndarray] = []
    about: list[np.ndarray] = []
    if isinstance(joint, Spherical):
        about = list(np.eye(3))
    elif isinstance(joint, Universal):
        about = [np.array(axis) for axis in joint.axes]
    elif isinstance(joint, Revolute):
        about = [np.array(joint.axis)]
    else:
        along = [np.array(joint.axis) if isinstance(joint, Prismatic) else np.eye(3)[1]]
    for keys, freedoms in ((("x", "y", "z"), along), (("rx", "ry", "rz"), about)):
        for key, axis in zip(keys, np.eye(3), strict=True):
            if getattr(joint.bearing, key) is not None and any(abs(axis @ freedom) > 1e-12 for freedom in freedoms):
                raise InputError(f"{path}.bearing.{key}: the joint itself moves that way; a bearing yields across its freedom")


def _check_chain(path: str, chain: Chain) -> None:
    elements = chain.elements
    names = [e.name for e in elements]
    for index, element in enumerate(elements):
        here = f"{path}.elements.{element.name}"
        if names.count(element.name) > 1:
            raise InputError(f"{here}.name: two elements of this chain have this name; give each its own")
        if isinstance(element, Joint):
            _check_lump(here, element)
            _check_bearing(here, element)
        if isinstance(element, Drivable) and element.reflected_inertia is not None and not element.actuated:
            raise InputError(f"{here}.reflected_inertia: that of a motor, and none drives this joint; set actuated = true")
        if isinstance(element, Spherical):
            _check_ball(here, element)
        check_socket(here, index, elements)
        if isinstance(element, Universal):
            first, second = element.axes
            if abs(sum(a * b for a, b in zip(first, second, strict=True))) > 1e-12:
                raise InputError(f"{here}.axes: the two axes are not at right angles")
    if not isinstance(elements[0], Joint):
        here = f"{path}.elements.{elements[0].name}"
        raise InputError(f'{here}: a chain starts with a joint on the ground; this is of type "{elements[0].type}"')
    if isinstance(elements[-1], Body):
        here = f"{path}.elements.{elements[-1].name}"
        raise InputError(f'{here}: a chain ends with a joint on the platform; this is of type "{elements[-1].type}"')
    if chain.base is None and not isinstance(elements[0], Curvilinear):
        raise InputError(
            f"{path}.base: needed, since this chain does not start on a circular guide; "
            'write at least base = { azimuth = "0 deg" }'
        )
    if not any(isinstance(e, Drivable) and e.actuated for e in elements):
        raise InputError(f"{path}: no joint of this chain is actuated; set actuated = true on at least one")
    _check_walk(path, chain)


def _check_walk(path: str, chain: Chain) -> None:
    """What the walk down a chain in its own frame takes for granted."""
    first = chain.elements[0]
    here = f"{path}.elements.{first.name}"
    if isinstance(first, Prismatic) and first.beam is not None:
        raise InputError(f"{here}.beam: a slide on the ground is a guide; a beam can extend from a later joint only")
    if isinstance(first, Curvilinear) and first.travel is not None and chain.base is None and chain.copies > 1:
        raise InputError(f'{here}.travel: needs {path}.base, as in base = {{ azimuth = "0 deg" }}, to turn with the copies')
    for index, element in enumerate(chain.elements):
        here = f"{path}.elements.{element.name}"
        if isinstance(element, Offset) and element.vector[1] != 0:
            raise InputError(f"{here}.vector: {mm(element.vector[1])} along y; an offset must stay in the chain's x-z plane")
        by_elevation = isinstance(element, Revolute) and element.measure == "elevation" and element.travel is not None
        if by_elevation and all(e.axis_of_body is None for e in chain.elements[index + 1 :]):
            raise InputError(f'{here}.measure: "elevation" is that of the next body, and none follows; use "angle"')


def _check_ball(path: str, ball: Spherical) -> None:
    if ball.rotation == "elastic" and ball.stiffness is None:
        raise InputError(f'{path}.stiffness: needed, and missing, with rotation = "elastic"')
    if ball.rotation != "elastic" and ball.stiffness is not None:
        raise InputError(f'{path}.stiffness: goes with rotation = "elastic" only, which is "{ball.rotation}" here')


def check_socket(path: str, index: int, elements: tuple[Element, ...]) -> None:
    """Raise InputError, naming the key, for a cone or a neutral axis that cannot be."""
    socket = elements[index]
    if not isinstance(socket, Socket):
        return
    for rule in cone_rules(path, socket):
        if not rule.kept:
            raise InputError(rule.words())
    neutral = socket.neutral
    if neutral is None:
        return
    if socket.cone is None:
        raise InputError(f"{path}.neutral: needs {path}.cone beside it")
    others = elements[:index] if neutral.body == "beyond" else elements[index + 1 :]
    if neutral.stem is None and all(e.axis_of_body is None for e in others):
        side = "before" if neutral.body == "beyond" else "beyond"
        raise InputError(f"{path}.neutral.stem: needed, since the chain has no beam or slide {side} this joint")


def _profiles(path: str, chain: Chain) -> Iterator[tuple[str, Profile]]:
    for element in chain.elements:
        if isinstance(element, Beam):
            yield f"{path}.elements.{element.name}", element.profile
        elif isinstance(element, Prismatic) and element.beam is not None:
            yield f"{path}.elements.{element.name}.beam", element.beam


def _defined(path: str, name: str, defined: Container[str], hints: Iterable[str]) -> None:
    if name not in defined:
        raise InputError(f"{path}: {shown(name)} is not defined in this file{nearest(name, hints)}")
