"""Beams of a machine as solids: which ones, of what shape, and put into its structure."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import NamedTuple

from trivet.errors import InputError, nearest
from trivet.model import Machine
from trivet.model.elements import Beam, Prismatic, Profile
from trivet.model.machine import bodies
from trivet.solids.bricks import bricks
from trivet.solids.ends import Ends
from trivet.solids.grid import Grid
from trivet.solids.reduction import Reduced, reduced
from trivet.solids.step import from_step
from trivet.statics.assembly import Structure
from trivet.vibration.bodies import Body
from trivet.vibration.mesh import STUB

ALIKE = 9
"""Digits to which lengths agree of beams that are one solid."""


class Wanted(NamedTuple):
    """A beam that is to be a solid."""

    name: str
    """ "leg-1.link"."""
    file: str | None
    """STEP; made from its section where None."""


class Solid(NamedTuple):
    """One solid, in place of all the beams that are alike."""

    names: tuple[str, ...]
    file: str | None
    length: float
    """m."""
    beam_mass: float
    """Of each of the beams, kg."""
    reduced: Reduced


class Kind(NamedTuple):
    """What solids have in common: beams of one kind are one solid."""

    file: str | None
    profile: Profile
    length: float
    """m."""


def wanted(machine: Machine, structure: Structure, parts: Iterable[str] | None, whole: bool = False) -> tuple[Wanted, ...]:
    """The beams that are to be solids.

    Args:
        machine, structure: the machine and its structure at a pose.
        parts: names, of one beam ("leg-1.link") or of all copies ("leg.link"), with a STEP file or without
            ("leg.link=part.step"); all beams that are long enough, by their sections, when None.
        whole: whether those that are not named are to be solids too, by their sections.

    Raises:
        InputError: for a name that is not known, or not that of a beam, or given twice; a beam that is too short.
    """
    spans = {beam.name: float(beam.length) for beam in structure.beams}
    short = {name for name, span in spans.items() if span < STUB * structure.scale}
    every = tuple(Wanted(name, None) for name in spans if name not in short)
    if parts is None:
        return every
    copies = bodies(machine)
    found: dict[str, Wanted] = {}
    for text in parts:
        name, equals, file = text.partition("=")
        if equals and not file:
            raise InputError(f"part {text}: no file is named; give one, or write {name} for its section")
        own = [beam for beam in copies.get(name, []) if beam in spans]
        if not own:
            known = [n for n, beams in copies.items() if any(beam in spans for beam in beams)]
            what = "is no beam, or has no length at this pose" if name in copies else "not known"
            raise InputError(f"part {name}: {what}{nearest(name, known)}")
        for beam in own:
            if beam in found:
                raise InputError(f"part {beam}: given twice")
            if beam in short:
                raise InputError(f"part {beam}: {1e3 * spans[beam]:.3g} mm long at this pose, too short for a solid")
            found[beam] = Wanted(beam, file or None)
    if not found:
        raise InputError("parts: none is named")
    rest = (one for one in every if one.name not in found)
    return (*found.values(), *(rest if whole else ()))


def solids(
    machine: Machine, structure: Structure, chosen: Iterable[Wanted], highest: float, fineness: float, ends: Ends
) -> tuple[Solid, ...]:
    """Beams as solids, alike ones worked out once.

    Args:
        machine, structure: the machine and its structure at a pose.
        chosen: see `wanted`.
        highest: frequency (Hz) up to which they must be right.
        fineness: 1, or more for smaller elements.
        ends: how their ends follow the machine, see `solids.ends`.

    Raises:
        InputError: for a section without a shape, a file that does not fit, a mesh that cannot be.
    """
    made_of, beams = profiles(machine), {beam.name: beam for beam in structure.beams}
    alike: dict[Kind, list[str]] = {}
    for name, file in chosen:
        length = float(f"{float(beams[name].length):.{ALIKE}g}")
        alike.setdefault(Kind(file, made_of[name], length), []).append(name)
    found = []
    for (file, profile, length), names in alike.items():
        grid = _grid(machine, names[0], file, profile, length, fineness)
        own = reduced(grid, machine.materials[profile.material], highest, ends)
        found.append(Solid(tuple(names), file, length, length * float(beams[names[0]].made_of.mass), own))
    return tuple(found)


def _grid(machine: Machine, name: str, file: str | None, profile: Profile, length: float, fineness: float) -> Grid:
    if file is not None:
        return from_step(name, file, length, fineness)
    return bricks(name, machine.sections[profile.section], length, fineness)


def profiles(machine: Machine) -> dict[str, Profile]:
    """Section and material of every beam by its name."""
    found: dict[str, Profile] = {}
    for leg in machine.legs:
        for element in leg.chain.elements:
            profile = element.profile if isinstance(element, Beam) else element.beam if isinstance(element, Prismatic) else None
            if profile is not None:
                found[f"{leg.name}.{element.name}"] = profile
    return found


def put_in(machine: Machine, structure: Structure, made: Iterable[Solid]) -> tuple[Structure, tuple[Body, ...]]:
    """The structure without the beams that are solids, and the solids between its nodes."""
    of = {name: solid.reduced for solid in made for name in solid.names}
    made_of = profiles(machine)
    placed = []
    for beam in structure.beams:
        if beam.name in of:
            own, loss = of[beam.name], machine.materials[made_of[beam.name].material].loss_factor
            loss = None if loss is None else float(loss)
            placed.append(Body(beam.name, beam.first, beam.second, beam.axes, own.stiffness, own.mass, loss))
    rest = tuple(beam for beam in structure.beams if beam.name not in of)
    return dataclasses.replace(structure, beams=rest), tuple(placed)
