"""What a machine would answer at the channels at which it was measured, and how that changes with its numbers.

Where all points and sensors are on the platform, the exact receptance of the platform is differentiated by JAX.  Points on
chains are seen by the exact structure (`vibration.exact`), solved at every frequency, and slopes are central differences.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from trivet.measure.functions import Channel, Functions
from trivet.measure.machine.parameters import Parameters
from trivet.measure.machine.setup import ON_PLATFORM, Placed
from trivet.model import Machine
from trivet.model.mass import platform_mass, point_mass, together
from trivet.space.frame import Frame
from trivet.space.vector import Vec
from trivet.statics.assembly import PLATFORM, NodeMass, Structure, assemble
from trivet.vibration import spectral
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.places import Place, place_of
from trivet.vibration.spectral_machine import Stand, standing

STEP = 1e-5
"""Step of a central difference, in standard deviations beforehand."""


class Slopes(NamedTuple):
    """Receptances and their slopes."""

    values: np.ndarray
    """(q, n) complex."""
    slopes: np.ndarray
    """(p, q, n) with respect to theta of `Parameters`."""


def predicted(placed: Placed, functions: Functions, loss_factor: float = 0.02) -> Functions:
    """What the machine would answer at the channels, at the frequencies and in the motions of some functions.

    At zero frequency the displacement is that of the statics, and velocity and acceleration are zero.

    Raises:
        NoResultError: the machine does not stand, or moves without resistance, at the pose of the set-up.
    """
    own = Receptances.of(placed, functions).values(placed.machine, loss_factor)
    values = own * (1j * functions.omega) ** functions.orders[:, None]
    return dataclasses.replace(
        functions, values=values, coherence=None, source=f"{placed.machine.name}, loss factor {loss_factor:g}"
    )


@dataclasses.dataclass(frozen=True)
class Receptances:
    """Receptances of a machine at the channels of some functions, as a function of its numbers."""

    placed: Placed
    omega: np.ndarray
    """(n,) rad/s."""
    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    pairs: np.ndarray
    """(q, 2) which output and which input each function has."""

    @classmethod
    def of(cls, placed: Placed, functions: Functions) -> Receptances:
        """For all functions."""
        outputs, inputs = tuple(dict.fromkeys(functions.responses)), tuple(dict.fromkeys(functions.references))
        places = {channel: k for k, channel in enumerate(outputs)}, {channel: k for k, channel in enumerate(inputs)}
        channels = zip(functions.responses, functions.references, strict=True)
        pairs = np.array([(places[0][a], places[1][b]) for a, b in channels], dtype=int).reshape(-1, 2)
        # A beam at rest is the limit of a slow one; at zero itself its waves have no length.
        lowest = 1e-6 * float(functions.omega.max())
        return cls(placed, np.maximum(functions.omega, lowest), outputs, inputs, pairs)

    def values(self, machine: Machine, loss_factor: float) -> np.ndarray:
        """(q, n) with a machine of the same topology."""
        if not self.placed.is_on_platform:
            return self._structural(machine, loss_factor)
        stand, chosen = self._covered(machine, loss_factor)
        return np.asarray(self._exact(machine, loss_factor, stand, chosen))

    def slopes(self, machine: Machine, loss_factor: float, free: Parameters, theta: np.ndarray) -> Slopes:
        """Receptances and slopes at some theta."""
        if self.placed.is_on_platform and self.placed.signs is not None:
            stand, chosen = self._covered(*free.applied(machine, loss_factor, theta))

            def both(theta: Any) -> tuple[Any, Any]:
                values = self._exact(*free.applied(machine, loss_factor, theta), stand, chosen)
                return values, values

            slopes, values = jax.jacfwd(both, has_aux=True)(jnp.asarray(theta))
            return Slopes(np.asarray(values), np.moveaxis(np.asarray(slopes), -1, 0))
        # Chains that are closed numerically are not differentiated, and neither is the structure with all its nodes.
        rows = []
        for k, step in enumerate(STEP * free.spread):
            away = step * np.eye(len(theta))[k]
            ends = [self.values(*free.applied(machine, loss_factor, theta + sign * away)) for sign in (1, -1)]
            rows.append((ends[0] - ends[1]) / (2 * step))
        return Slopes(self.values(*free.applied(machine, loss_factor, theta)), np.array(rows))

    def _covered(self, machine: Machine, loss_factor: float) -> tuple[Stand, spectral.Plan]:
        """How the chains stand, and how to cover the frequencies, with a machine in numbers."""
        loaded, poses = with_sensors(machine, self.placed), self._poses(machine)
        stand = standing(loaded, self.placed.pose.frame(machine), self.placed.signs)
        chosen = spectral.plan(loaded, poses, stand, float(self.omega.max()))
        return stand, spectral.divided(loaded, poses, stand, self.omega, loss_factor, chosen, CENTRE)

    def _exact(self, machine: Machine, loss_factor: Any, stand: Stand, chosen: spectral.Plan) -> Any:
        """(q, n) from the receptance of the platform; JAX may trace the machine."""
        loaded, poses = with_sensors(machine, self.placed), self._poses(machine)
        centre = spectral.kernel(loaded, poses, stand, self.omega, loss_factor, chosen, CENTRE)
        turn = jnp.stack([jnp.stack([jnp.asarray(c)[0] for c in axis], axis=-1) for axis in poses[1:]], axis=-1)
        seen, loaded_rows = (self._rows(channels, turn) for channels in (self.outputs, self.inputs))
        between = jnp.einsum("oi,nij,kj->okn", seen, centre, loaded_rows)
        return between[self.pairs[:, 0], self.pairs[:, 1]]

    def _poses(self, machine: Machine) -> Frame:
        frame = self.placed.pose.frame(machine)
        return jax.tree.map(lambda c: jnp.atleast_1d(jnp.asarray(c, dtype=float)), frame)

    def _rows(self, channels: Sequence[Channel], turn: Any) -> Any:
        """(k, 6) what channels see of the twist of the platform's centre, also the wrench there of their unit loads.

        The platform is turned (3, 3), by the home of a machine that may be traced.
        """
        placed = self.placed
        along = np.array([placed.along(channel) for channel in channels])
        own = np.array([placed.sites[channel.point].at - placed.centre for channel in channels]) @ _axes(placed.frame)
        arms = own @ turn.T
        return jnp.concatenate([along[:, :3], along[:, 3:] + jnp.cross(arms, along[:, :3])], axis=1)

    def _structural(self, machine: Machine, loss_factor: float) -> np.ndarray:
        """(q, n) from the structure between all nodes, solved at every frequency."""
        placed = self.placed
        structure, sites = with_sites(machine, placed)
        exact = ExactStructure(exact_mesh(structure, float(self.omega.max())))
        seen, loaded = (
            np.concatenate([placed.along(c)[None] @ exact.mesh.rows(sites[c.point].node, sites[c.point].at) for c in channels])
            for channels in (self.outputs, self.inputs)
        )
        answers = exact.receptance(seen, loaded, self.omega, float(loss_factor))
        return answers[:, self.pairs[:, 0], self.pairs[:, 1]].T


CENTRE = spectral.Matrices(inverted=True, alone=True)
"""What is made of the dynamic stiffness: the receptance of the platform centre."""


def with_sensors(machine: Machine, placed: Placed) -> Machine:
    """The machine with the masses of all sensors added to its platform; JAX may trace it."""
    heavy = [site for site in placed.sites.values() if site.mass > 0]
    if not heavy:
        return machine
    to_own = _axes(placed.frame).T
    points = [point_mass(site.mass, Vec(*(to_own @ (site.at - placed.centre)))) for site in heavy]
    whole = together([platform_mass(machine.platform, machine.stock), *points])
    about = whole.about_centre
    platform = dataclasses.replace(
        machine.platform,
        disc=None,
        mass=whole.mass,
        centre_of_mass=tuple(whole.centre),
        inertia=(about.xx, about.yy, about.zz),
        products_of_inertia=(about.xy, about.xz, about.yz),
    )
    return dataclasses.replace(machine, platform=platform)


def with_sites(machine: Machine, placed: Placed) -> tuple[Structure, dict[str, Place]]:
    """The structure of the machine with a node at every site, and the masses of sensors."""
    frame = placed.pose.frame(machine)
    structure, sites = assemble(machine, frame, placed.signs), {}
    centre, turn = structure.nodes[PLATFORM], _axes(frame) @ _axes(placed.frame).T
    for point, site in placed.sites.items():
        if site.on == ON_PLATFORM:
            sites[point] = Place(structure, PLATFORM, centre + turn @ (site.at - placed.centre))
        else:
            sites[point] = place_of(machine, frame, structure, site.on)
            structure = sites[point].structure
    lumps = [
        NodeMass(f"sensor {point}", sites[point].node, sites[point].at, site.mass, np.zeros((3, 3)))
        for point, site in placed.sites.items()
        if site.mass > 0
    ]
    return dataclasses.replace(structure, masses=(*structure.masses, *lumps)), sites


def _axes(frame: Frame) -> np.ndarray:
    """(3, 3): axes of a frame as columns, numbers."""
    return np.array([[float(c) for c in axis] for axis in frame[1:]]).T
