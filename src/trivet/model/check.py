"""Checks that need more than one key of a machine file."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.errors import InputError, nearest
from trivet.model.elements import Beam, Body, Curvilinear, Element, Joint, Prismatic, Profile, Revolute, Spherical, Universal
from trivet.model.machine import Chain, Machine
from trivet.model.section import General, Tube


def check(machine: Machine) -> None:
    """Raise InputError with the key path, the values and the remedy at the first contradiction."""
    for name, section in machine.sections.items():
        if isinstance(section, Tube) and section.inner_diameter >= section.outer_diameter:
            raise InputError(
                f"sections.{name}.inner_diameter: {_mm(section.inner_diameter)} is not smaller than the outer diameter "
                f"{_mm(section.outer_diameter)}"
            )
        if isinstance(section, General) and machine.theory == "timoshenko" and None in (section.shear_area_y, section.shear_area_z):
            raise InputError(f"sections.{name}.shear_area_y: needed, with shear_area_z, when theory = \"timoshenko\"")
    for name, material in machine.materials.items():
        if material.poisson_ratio >= 0.5:
            raise InputError(f"materials.{name}.poisson_ratio: {material.poisson_ratio} is not below 0.5")
    platform = machine.platform
    if platform.disc is not None:
        if platform.mass is not None:
            raise InputError("platform.mass: given together with platform.disc; keep one of them")
        _known("platform.disc.material", platform.disc.material, machine.materials)
    if platform.inertia is not None and platform.mass is None:
        raise InputError("platform.inertia: needs platform.mass beside it")
    for name, chain in machine.chains.items():
        for path, profile in _profiles(f"chains.{name}", chain):
            _known(f"{path}.section", profile.section, machine.sections)
            _known(f"{path}.material", profile.material, machine.materials)
        _check_chain(f"chains.{name}", chain)


def _check_chain(path: str, chain: Chain) -> None:
    elements = chain.elements
    names = [e.name for e in elements]
    for element in elements:
        here = f"{path}.elements.{element.name}"
        if names.count(element.name) > 1:
            raise InputError(f"{here}.name: two elements of this chain have this name; give each its own")
        _check_travel(here, element)
        if isinstance(element, Spherical):
            if (element.rotation == "elastic") != (element.stiffness is not None):
                raise InputError(f'{here}.stiffness: goes with rotation = "elastic", which is "{element.rotation}" here')
        if isinstance(element, Universal):
            first, second = element.axes
            if abs(sum(a * b for a, b in zip(first, second, strict=True))) > 1e-12:
                raise InputError(f"{here}.axes: the two axes are not at right angles")
    if not isinstance(elements[0], Joint):
        raise InputError(f"{path}.elements.{elements[0].name}: a chain starts with a joint on the ground; this is a {elements[0].type}")  # type: ignore[attr-defined]
    if isinstance(elements[-1], Body):
        raise InputError(f"{path}.elements.{elements[-1].name}: a chain ends with a joint on the platform; this is a {elements[-1].type}")  # type: ignore[attr-defined]
    if chain.base is None and not isinstance(elements[0], Curvilinear):
        raise InputError(f"{path}.base: needed, since this chain does not start on a circular guide; at least base = {{ azimuth = \"0 deg\" }}")
    if not any(isinstance(e, (Curvilinear, Prismatic, Revolute)) and e.actuated for e in elements):
        raise InputError(f"{path}: no joint of this chain is actuated; set actuated = true on at least one")


def _check_travel(path: str, element: Element) -> None:
    travel = getattr(element, "travel", None)
    if travel is None:
        return
    low, high = travel
    if low >= high:
        unit, scale = ("mm", 1e3) if isinstance(element, Prismatic) else ("deg", 57.29577951308232)
        raise InputError(f"{path}.travel: runs from {low * scale:g} {unit} to {high * scale:g} {unit}; write the lower limit first")
    if isinstance(element, Revolute) and element.measure == "elevation" and not -90 <= low * 57.29577951308232 < high * 57.29577951308232 <= 90.0000001:
        raise InputError(f"{path}.travel: an elevation lies between -90 deg and 90 deg")


def _profiles(path: str, chain: Chain) -> Iterator[tuple[str, Profile]]:
    for element in chain.elements:
        if isinstance(element, Beam):
            yield f"{path}.elements.{element.name}", element.profile
        elif isinstance(element, Prismatic) and element.beam is not None:
            yield f"{path}.elements.{element.name}.beam", element.beam


def _known(path: str, name: str, known: dict[str, object]) -> None:  # type: ignore[type-arg]
    if name not in known:
        raise InputError(f"{path}: '{name}' is not defined in this file{nearest(name, known)}")


def _mm(value: float) -> str:
    return f"{value * 1e3:g} mm"
