"""Load cases: how a machine gives way under a load at the tool tip and under its own weight, and what its masses are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from trivet.errors import InputError
from trivet.model import Machine
from trivet.space.frame import Frame
from trivet.statics.assembly import NodeMass, Sheathed
from trivet.statics.beam_element import uniform_load
from trivet.statics.structure import GROUND, PLATFORM, Structure, assemble, carry, solve

_NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class DriveLoad:
    """The load on one actuator, along the screw on which it yields.

    For a carriage on a circular guide with yields = "translation" that is the force of a tangential spring in a carriage which
    does not turn; what a motor along the circle must give (J_G^T F) is seen with yields = "rotation".
    """

    load: float
    """What the structure puts on the drive, above zero when it pushes towards larger coordinates; N or N m, see `unit`."""
    unit: str
    """ "N" for a drive that yields straight, "N m" for one that yields about an axis."""


@dataclass(frozen=True)
class LoadResult:
    """How a machine answers one load case; arrays are (6,), linear part first, in {O} axes."""

    tool_tip: np.ndarray
    """Deflection of the tool tip: displacement (m) and rotation (rad)."""
    platform_centre: np.ndarray
    """Deflection of the platform centre: displacement (m) and rotation (rad)."""
    applied: np.ndarray
    """All that loads the machine, its weight included: force (N), and moment about the origin of {O} (N m)."""
    reactions: dict[str, np.ndarray]
    """Per chain, the force (N) and the moment about the origin of {O} (N m) which it puts on the ground."""
    drives: dict[str, DriveLoad]
    """Per actuator ("leg-1.slide"), the load that it carries."""


def load_case(
    machine: Machine,
    pose: Frame,
    signs: Any,
    force: Sequence[float] = _NONE,
    moment: Sequence[float] = _NONE,
    gravity: Sequence[float] = _NONE,
) -> LoadResult:
    """Deflections, reactions and drive loads of a machine under a load at the tool tip and its own weight (Eq 37).

    The weight is that of beams (uniform), of what guides hide of the rods of slides, of joints, offsets and platform.

    Args:
        machine: the machine, its actuators at rest.
        pose: platform frame {E} in {O}, m; numbers.
        signs: (n_chains, 2) working mode.
        force: at the tool tip, in {O}, N.
        moment: in {O}, N m.
        gravity: acceleration of free fall in {O}, m/s^2; (0, 0, -9.81) for a machine that stands upright.

    Raises:
        InputError: a load is not three finite numbers.
        NoResultError: a chain does not reach the pose, or the machine does not resist the load.
    """
    wrench = np.concatenate([_three("force", force), _three("moment", moment)])
    structure = assemble(machine, pose, signs)
    to_tip = carry(np.array([float(c) for c in pose.direction(machine.platform.tool_tip or _NONE)]))
    loads = weight(structure, _three("gravity", gravity))
    loads[PLATFORM] += to_tip.T @ wrench
    solution = solve(structure, loads[..., None])
    reactions: dict[str, np.ndarray] = {}
    drives: dict[str, DriveLoad] = {}
    for tie, taken in zip(structure.connections, solution.ties[..., 0], strict=True):
        if tie.first == GROUND:
            reactions[tie.name.partition(".")[0]] = carry(tie.at).T @ taken
        if tie.drive is not None:
            drives[tie.name] = DriveLoad(float(tie.drive @ taken), "N m" if np.any(tie.drive[3:]) else "N")
    centre = solution.displacements[PLATFORM, :, 0]
    applied = sum(carry(at).T @ f for at, f in zip(structure.nodes, loads, strict=True))
    return LoadResult(to_tip @ centre, centre, np.asarray(applied), reactions, drives)


def weight(structure: Structure, gravity: np.ndarray) -> np.ndarray:
    """Weight of a structure at one pose as wrenches (n, 6) on its nodes in {O}, N and N m.

    Args:
        structure: the structure.
        gravity: (3,) acceleration of free fall in {O}, m/s^2.
    """
    loads = np.zeros((len(structure.nodes), 6))
    for beam in structure.beams:
        first, second = uniform_load(beam, beam.made_of.mass * gravity).reshape(2, 6)
        loads[beam.first] += first
        loads[beam.second] += second
    lumps: tuple[NodeMass | Sheathed, ...] = (*structure.masses, *structure.sheathed)
    for lump in lumps:
        at_lump = np.concatenate([lump.mass * gravity, np.zeros(3)])
        loads[lump.node] += carry(lump.at - structure.nodes[lump.node]).T @ at_lump
    return loads


def masses(machine: Machine, pose: Frame, signs: Any) -> dict[str, float]:
    """Masses (kg) of a machine's parts at a pose: of every chain element ("leg-1.link"), and of the "platform".

    A slide's is that of the lump on it and of its whole rod, which reaches over all of its travel; without a travel, of the
    part that is extended.

    Args:
        machine, pose, signs: as for `load_case`.

    Raises:
        NoResultError: a chain does not reach the pose.
    """
    structure = assemble(machine, pose, signs)
    found = {f"{leg.name}.{element.name}": 0.0 for leg in machine.legs for element in leg.chain.elements} | {"platform": 0.0}
    for beam in structure.beams:
        found[beam.name] += beam.made_of.mass * float(beam.length)
    lumps: tuple[NodeMass | Sheathed, ...] = (*structure.masses, *structure.sheathed)
    for lump in lumps:
        found[lump.name] += float(lump.mass)
    return found


def _three(name: str, value: Sequence[float]) -> np.ndarray:
    vector = np.asarray(value, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InputError(f"{name}: expected three finite numbers along the axes of {{O}}, got {value}")
    return vector
