"""Relations which the numbers of a machine keep among each other, of one machine or of many at once.

`check` tells them of one machine, in words; of many machines of one topology, their numbers as arrays (n,), `kept` says which
of them could be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trivet.model.elements import Drivable, Joint, Revolute, Socket, Spherical
from trivet.model.kinds import kinds
from trivet.model.machine import Machine, Platform
from trivet.model.paths import dimensions
from trivet.model.section import Material, Tube

SOFTEST = 1e-3
"""Rotational stiffness (N m/rad) of a ball below which rounding would drown the rest of its chain."""
ROUNDED = 1 + 1e-12
"""What "90 deg" may be too much, read as radians."""


class Rule(NamedTuple):
    """A relation among numbers."""

    kept: Any
    """Whether it is kept, of one machine or of many."""
    words: Callable[[], str]
    """What is said of one machine that does not keep it."""


def kept(machine: Machine) -> NDArray[Any]:
    """Which of many machines keep all rules, their signs among them; numbers are floats, or arrays that broadcast to (n,)."""
    own = kinds(machine)
    found: Any = np.bool_(True)
    for path, value in dimensions(machine).items():
        if own[path].positive:
            found = found & (value > 0)
        elif own[path].at_least_zero:
            found = found & (value >= 0)
    for rule in rules(machine):
        found = found & rule.kept
    return np.asarray(found)


def rules(machine: Machine) -> Iterator[Rule]:
    """All of them, in the order of the machine file."""
    for name, section in machine.sections.items():
        if isinstance(section, Tube):
            yield _bore(f"sections.{name}", section)
    for name, material in machine.materials.items():
        yield _ratio(f"materials.{name}", material)
    yield from _platform_rules(machine.platform)
    for name, chain in machine.chains.items():
        for element in chain.elements:
            path = f"chains.{name}.elements.{element.name}"
            if isinstance(element, Drivable):
                yield from _travel_rules(path, element)
            if isinstance(element, Joint) and element.inertia is not None:
                yield _moments_rule(f"{path}.inertia", element.inertia)
            if isinstance(element, Spherical) and element.stiffness is not None:
                yield _softest(path, element.stiffness)
            if isinstance(element, Socket):
                yield from cone_rules(path, element)


def _bore(path: str, section: Tube) -> Rule:
    inner, outer = section.inner_diameter, section.outer_diameter
    words = f"{path}.inner_diameter: {{}} is not smaller than the outer diameter {{}}"
    return Rule(inner < outer, lambda: words.format(mm(inner), mm(outer)))


def _ratio(path: str, material: Material) -> Rule:
    ratio = material.poisson_ratio
    return Rule(ratio < 0.5, lambda: f"{path}.poisson_ratio: {ratio} is not below 0.5")


def _platform_rules(platform: Platform) -> Iterator[Rule]:
    if platform.inertia is not None:
        yield _moments_rule("platform.inertia", platform.inertia, platform.products_of_inertia or (0.0, 0.0, 0.0))


def _moments_rule(path: str, moments: Any, products: Any = (0.0, 0.0, 0.0)) -> Rule:
    """No body has a principal moment of inertia below zero, or greater than the other two together."""
    (xx, yy, zz), (xy, xz, yz) = moments, products
    rows = np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in (xx, xy, xz, xy, yy, yz, xz, yz, zz)))
    principal = np.linalg.eigvalsh(np.stack(rows, axis=-1).reshape(*rows[0].shape, 3, 3))
    low, middle, high = np.moveaxis(principal, -1, 0)
    slack = 1e-6 * np.abs(high)

    def words() -> str:
        written = ", ".join(f"{value * 1e6:g}" for value in principal)
        return f"{path}: principal moments {written} kg mm^2; no body has one above the other two together"

    return Rule((low >= -slack) & (high <= low + middle + slack), words)


def _travel_rules(path: str, joint: Drivable) -> Iterator[Rule]:
    if joint.travel is None:
        return
    (low, high), locked = joint.travel, joint.locked
    written = deg if joint.is_angular else mm
    is_elevation = isinstance(joint, Revolute) and joint.measure == "elevation"
    if locked is not None and not is_elevation:
        words = f"{path}.locked: {{}} is outside its travel, {{}} to {{}}"
        inside = (low <= locked) & (locked <= high)
        yield Rule(inside, lambda: words.format(written(locked), written(low), written(high)))
    yield Rule(low < high, lambda: f"{path}.travel: runs from {written(low)} to {written(high)}; write the lower limit first")
    if is_elevation:
        most = math.pi / 2 * ROUNDED
        words = f"{path}.travel: {{}} to {{}}, but an elevation lies between -90 deg and 90 deg"
        yield Rule((-low <= most) & (high <= most), lambda: words.format(deg(low), deg(high)))


def _softest(path: str, stiffness: Any) -> Rule:
    words = f'{path}.stiffness: {{:g}} N m/rad is as good as none; write rotation = "free" instead'
    return Rule(stiffness >= SOFTEST, lambda: words.format(stiffness))


def cone_rules(path: str, socket: Socket) -> Iterator[Rule]:
    """Those of a socket's cone."""
    cone = socket.cone
    if cone is None:
        return
    yield Rule(
        (cone > 0) & (cone <= math.pi * ROUNDED), lambda: f"{path}.cone: {deg(cone)} does not lie between 0 deg and 180 deg"
    )
    if socket.neutral is not None and socket.neutral.measure == "elevation":
        words = f"{path}.cone: {{}}, but an elevation lies between -90 deg and 90 deg"
        yield Rule(cone <= math.pi / 2 * ROUNDED, lambda: words.format(deg(cone)))


def mm(value: float) -> str:
    """A length in words."""
    return f"{value * 1e3:g} mm"


def deg(value: float) -> str:
    """An angle in words."""
    return f"{math.degrees(value):g} deg"
