"""Neutral axes of the sockets on the platform, for machines whose sources give a cone but not from what."""

from __future__ import annotations

import dataclasses
from typing import Literal, get_args

import numpy as np

from trivet.errors import InputError, nearest
from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import Standing, home_pose, stand
from trivet.model import Machine
from trivet.model.check import check_socket
from trivet.model.elements import Neutral, Socket
from trivet.space.frame import Frame
from trivet.space.vector import Vec

Reference = Literal["as-described", "home", "normal", "radial", "elevation"]

REFERENCES: dict[Reference, str] = {
    "as-described": "as the machine file says, or no limit",
    "home": "where the stem is at home",
    "normal": "the platform normal, on the stem's side",
    "radial": "in the platform's plane, outwards to the joint",
    "elevation": "the platform's plane, both ways",
}


def with_neutral(machine: Machine, reference: Reference, mode: str | None = None) -> Machine:
    """The machine with the neutral axes of all cones on its platform laid down; other sockets stay as they are.

    Args:
        machine: the machine.
        reference: from what the stems deviate, one of REFERENCES.
        mode: working mode in which it is at home; the machine's own when not given.

    Raises:
        InputError: for an unknown reference.
        NoResultError: when the machine does not reach home.
    """
    if reference not in get_args(Reference):
        raise InputError(f"neutral axis '{reference}'{nearest(reference, get_args(Reference))}")
    if reference == "as-described":
        return machine
    home = home_pose(machine)
    chains = {}
    standing = stand(machine, home, parse_mode(machine, mode))
    for name, chain in machine.chains.items():
        socket = chain.elements[-1]
        if not isinstance(socket, Socket) or socket.cone is None:
            chains[name] = chain
            continue
        neutral = Neutral((0.0, 0.0, 1.0), measure="elevation" if reference == "elevation" else "deviation")
        elements = (*chain.elements[:-1], dataclasses.replace(socket, neutral=neutral))
        check_socket(f"chains.{name}.elements.{socket.name}", len(elements) - 1, elements)
        legs = [one for one in standing if one.leg.chain is chain]
        axes = [_axis(one, home, reference) for one in legs]
        for one, axis in zip(legs, axes, strict=True):
            measure: Literal["deviation", "elevation"] = "elevation" if reference == "elevation" else "deviation"
            last = dataclasses.replace(socket, neutral=Neutral(axis, measure=measure))
            if np.allclose(axes, axes[0], rtol=0, atol=1e-9):
                chains[name] = dataclasses.replace(chain, elements=(*chain.elements[:-1], last))
                break
            if machine.apart.may_touch:
                raise InputError(
                    f"{machine.name}: with '{reference}' the copies of {name} differ, and interference.may_touch may name them "
                    "all; give the chains and the pairs one by one in a file"
                )
            alone = one.leg.alone()
            chains[one.leg.name] = dataclasses.replace(alone, elements=(*alone.elements[:-1], last))
    return dataclasses.replace(machine, chains=chains)


def _axis(one: Standing, home: Frame, reference: Reference) -> tuple[float, float, float]:
    """In the frame of the platform joint."""
    if reference == "radial":
        return (1.0, 0.0, 0.0)
    if reference == "elevation":
        return (0.0, 0.0, 1.0)
    seat = home.place(one.leg.platform_frame())
    along, frame = next((e.axis_of_body, f) for e, f, _ in reversed(one.steps[:-1]) if e.axis_of_body is not None)
    stem: Vec = -frame.direction(along)
    local = [float(stem @ axis) for axis in seat[1:]]
    if reference == "normal":
        return (0.0, 0.0, 1.0 if local[2] > 0 else -1.0)
    return (local[0], local[1], local[2])
