"""Where is the platform when the drives stand there?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from trivet.errors import InputError, nearest
from trivet.kinematics.approach import drive_coordinates
from trivet.kinematics.forward import Forward, assembly_modes, drive_elements, drive_values, nearest_pose
from trivet.kinematics.inverse import require_six_freedoms
from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.locked import holds_circles
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import home_pose
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.study.machines import MachineLike, choose, coordinate, parse_settings

FREEDOMS = 6
"""Freedoms of a platform in space."""


def parse_drives(machine: Machine, listed: str | None, single: Iterable[str]) -> dict[str, float]:
    """Drive coordinates as written, by name, m and rad.

    Args:
        machine: the machine.
        listed: all of them in the order of Q with their units, separated by commas, or None.
        single: some of them as "leg-1.slide=30 mm"; they go before those of the list.

    Raises:
        InputError: for a wrong number, an unknown name, a value without or with a wrong unit.
    """
    elements = dict(zip(actuator_names(machine), drive_elements(machine), strict=True))
    found = {}
    if listed is not None:
        texts = listed.split(",")
        if len(texts) != len(elements):
            raise InputError(
                f"drives: {len(texts)} values, but {machine.name} has {len(elements)} drives: {', '.join(elements)}"
            )
        found = {name: coordinate(name, e, text) for (name, e), text in zip(elements.items(), texts, strict=True)}
    for name, text in parse_settings(single).items():
        if name not in elements:
            raise InputError(f"drive {name}: {machine.name} has no such drive{nearest(name, elements)}")
        found[name] = coordinate(name, elements[name], text)
    return found


def forward(
    machine: MachineLike,
    drives: Mapping[str, float] | Sequence[float] = (),
    *,
    start: Frame | None = None,
    mode: str | None = None,
    anyway: bool = False,
) -> Forward:
    """All poses that a machine can take with its drives at given coordinates.

    Args:
        machine: machine, name or file.
        drives: coordinates in the order of Q (first drives of all chains, then the second ones), or some of them by name
            ("leg-1.slide"), m and rad; what is not given is as at the starting pose.
        start: platform frame {E} in {O}; home when not given.  A machine for which not all poses can be found is solved from
            there.
        mode: working mode at the starting pose; the machine's own when not given.
        anyway: whether drives may be outside their travel.

    Raises:
        InputError: for a wrong number of drives, an unknown name, a value outside its travel; for locks that leave the platform
            more or less than its six freedoms.
        NoResultError: when no pose has these coordinates, or infinitely many have.
    """
    chosen = choose(machine)
    require_six_freedoms(chosen)
    drives_of = actuator_names(chosen)
    if len(drives_of) != FREEDOMS:
        remedy = f"lock {len(drives_of) - FREEDOMS}" if len(drives_of) > FREEDOMS else f"drive {FREEDOMS - len(drives_of)} more"
        raise InputError(f"{chosen.name}: has {len(drives_of)} drives, but the platform six freedoms; {remedy} of its joints")
    signs = parse_mode(chosen, mode)
    begin = home_pose(chosen) if start is None else start
    if len(drives) == 0:
        drives = drive_coordinates(chosen, begin, signs)
    elif isinstance(drives, Mapping):
        drives = drive_coordinates(chosen, begin, signs) | dict(drives)
    values = drive_values(chosen, drives, anyway)
    return assembly_modes(chosen, values) if holds_circles(chosen) else nearest_pose(chosen, values, begin, signs)
