"""Architectures: the legs of one machine on the guides of another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from trivet.errors import InputError
from trivet.kinematics.chains.planar import guide_size
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.report import joint_state_once, shortfall
from trivet.kinematics.standing import home_pose
from trivet.model import Machine
from trivet.model.check import check
from trivet.model.elements import Prismatic, Profile
from trivet.model.machine import Chain
from trivet.study.home import nearest_height

Stocked = TypeVar("Stocked")


def on_guide(machine: Machine, other: Machine) -> Machine:
    """The legs, platform and workpiece of a machine, its chains standing on the guides of another, where those stand.

    Sections and materials that both name are those of `machine`: the two are made of the same.  Home moves to the nearest
    height that is reached, if there is one, in the working mode that a file without one has.  A machine whose own guides these
    are stays as it is.

    Args:
        machine: whose chains are guides carrying planar legs.
        other: another such machine, all its chains on one kind of guide.

    Raises:
        InputError: for a machine with other chains, or a pair that cannot be.
    """
    _cut(machine)
    guide = _cut(other)
    chains = {name: _standing(chain, guide) for name, chain in machine.chains.items()}
    if chains == machine.chains:
        return machine
    made = replace(
        machine.renamed(f"{machine.name}-on-{other.name}"),
        chains=chains,
        home=replace(machine.home, mode=""),
        sections=_with(machine.sections, other.sections, (profile.section for profile in _profiles(guide))),
        materials=_with(machine.materials, other.materials, (profile.material for profile in _profiles(guide))),
    )
    made = replace(made, about=replace(made.about, title=f"Legs of {machine.name} on the guides of {other.name}", notes=()))
    try:
        check(made)
    except InputError as error:
        raise InputError(f"{made.name}: {error}") from None
    return _at_home(made)


def pairs(machines: Sequence[Machine], others: Sequence[Machine]) -> list[Machine]:
    """Every machine on the guides of every other machine, each pair once; errors as for `on_guide`."""
    made: dict[str, Machine] = {}
    for other in others:
        for machine in machines:
            pair = on_guide(machine, other)
            made.setdefault(pair.name, pair)
    return list(made.values())


def _cut(machine: Machine) -> Chain:
    """The first chain, of the guide alone; where there are more, they stand on the same."""
    guides = []
    for name, chain in machine.chains.items():
        size = guide_size(chain.elements)
        if not size:
            raise InputError(f"{machine.name}: chains.{name}: is not a planar leg on a guide, whose guide could be another")
        guides.append(replace(chain, elements=chain.elements[:size]))
    first = guides[0]
    if any((own.elements, own.base) != (first.elements, first.base) for own in guides[1:]):
        raise InputError(f"{machine.name}: its chains stand on unlike guides")
    return first


def _standing(chain: Chain, guide: Chain) -> Chain:
    return replace(chain, base=guide.base, elements=guide.elements + chain.elements[guide_size(chain.elements) :])


def _profiles(chain: Chain) -> list[Profile]:
    """What the slides of a guide are made of."""
    return [element.beam for element in chain.elements if isinstance(element, Prismatic) and element.beam is not None]


def _with(own: Mapping[str, Stocked], others: Mapping[str, Stocked], needed: Iterable[str]) -> dict[str, Stocked]:
    return {**{name: others[name] for name in needed if name in others}, **own}


def _at_home(machine: Machine) -> Machine:
    signs = closed_form_signs(machine, None)
    if shortfall(machine, joint_state_once(machine, home_pose(machine), signs)) is None:
        return machine
    height = nearest_height(machine, signs)
    if height is None:  # as whoever asks for home is told
        return machine
    x, y, _ = machine.home.position
    return replace(machine, home=replace(machine.home, position=(x, y, height)))
