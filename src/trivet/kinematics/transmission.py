"""Transmission indices: how well the power of each drive reaches the platform.

After J. Wang, C. Wu and X.-J. Liu, "Performance evaluation of parallel manipulators: motion/force transmissibility and its
index", Mech. Mach. Theory 45(10), 2010, 1462-1476.  For every actuator

- the *transmission wrench* is the wrench which its chain transmits and which does no work on any joint of the chain but it;
- the *input twist* is the actuator's own motion, the *output twist* the motion of the platform with all other actuators locked;
- the input and the output transmission index are |wrench o twist| / |wrench o twist|_max for either twist;
- the local transmission index is the least of all of them.

The maximum is over all directions which the wrench could have at its characteristic point C, the twist being what it is.  In
a chain with a ball a transmission wrench is a force f on a line through the ball, so |wrench o twist| = |f . v_C|, its maximum
is |f| |v_C|, and each index is the cosine of a pressure angle: between 0 and 1, without a unit, the same in every frame.  The
power does not depend on where C lies on the line, the maximum does.  On the input side C is the point of the line nearest to
the first passive joint beyond the actuator (the elbow of two links), on the output side the one nearest to the platform joint.

The output indices vanish at Type 2 singularities.  The input indices vanish at Type 1 singularities, save where a carriage
meets the axis of its circular guide: there force and speed remain along each other while both lose their lever.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from trivet.errors import InputError
from trivet.kinematics.jacobian import actuator_names, arm_of, chain_rows, is_driven, matrix, per_chain
from trivet.kinematics.walk import Posture
from trivet.model import Leg, Machine
from trivet.model.elements import Element, Joint, Spherical
from trivet.space.batches import in_batches
from trivet.space.elimination import solved
from trivet.space.frame import Frame, about_z
from trivet.space.scalar import Scalar
from trivet.space.screw import Wrench
from trivet.space.vector import ZERO, Vec


class Transmission(NamedTuple):
    """Transmission indices at one pose, actuators in the order of Q; NaN at an exact Type 1 singularity."""

    input: Scalar
    """(6,) ITI."""
    output: Scalar
    """(6,) OTI."""

    @property
    def local(self) -> Scalar:
        """LTI, the least of all."""
        return jnp.minimum(jnp.min(self.input, axis=-1), jnp.min(self.output, axis=-1))


def lacks(machine: Machine) -> str | None:
    """Why transmission indices are not told of a machine; None where they are."""
    names = actuator_names(machine)
    if len(names) != 6:
        return f"{len(names)} actuators; transmission indices are told of six"
    for leg in machine.legs:
        if not any(isinstance(e, Spherical) for e in leg.chain.elements):
            return f"chain {leg.name} has no ball joint; transmission indices are told of forces"
    return None


def check(machine: Machine) -> None:
    """Raise InputError for a machine of which transmission indices are not told."""
    reason = lacks(machine)
    if reason is not None:
        raise InputError(f"{machine.name}: {reason}")


class _Drives(NamedTuple):
    """The k drives of a chain with their transmission wrenches, unit forces, at the platform centre in {O}."""

    wrench: Scalar
    """(k, 6)."""
    input: Scalar
    """(k,) input transmission index."""
    output_point: Scalar
    """(k, 3) characteristic point on the output side, m from the platform centre."""


def transmission(machine: Machine, pose: Frame, signs: Scalar) -> Transmission:
    """Transmission indices at one pose, a kernel.

    Args:
        machine: a machine with six actuators and six constraints, each chain with a ball joint.
        pose: platform frame in {O}, scalar components.
        signs: (n_chains, 2) working mode, or None as for `standing.postures`.

    Raises:
        InputError: for any other machine.
    """
    check(machine)
    names = actuator_names(machine)
    chains = per_chain(machine, pose, signs, lambda leg, posture: _drives(machine, leg, posture, pose))
    own = [f"{leg.name}.{e.name}" for leg in machine.legs for e in leg.chain.elements if is_driven(e)]
    order = jnp.array([own.index(name) for name in names])
    drives = _Drives(*(jnp.concatenate(column)[order] for column in zip(*chains, strict=True)))
    # Column k: the platform's motion at unit power of wrench k, with all others idle.
    outputs = solved(drives.wrench, jnp.eye(6))
    velocities = outputs[:3] + jnp.cross(outputs[3:], drives.output_point.T, axis=0)
    return Transmission(drives.input, 1 / jnp.linalg.norm(velocities, axis=0))


_transmissions = jax.jit(jax.vmap(transmission, in_axes=(None, 0, None)))


def transmissions(machine: Machine, poses: Frame, signs: Any) -> Transmission:
    """`transmission` at many poses, component arrays of shape (n,): NumPy arrays (n, 6), NaN where a chain does not reach."""
    return in_batches(lambda frames: _transmissions(machine, frames, signs), poses)


def _drives(machine: Machine, leg: Leg, posture: Posture, pose: Frame) -> _Drives:
    chain = chain_rows(leg, posture, machine.characteristic_length)
    ball = next(f.origin for e, f, _ in chain.steps if isinstance(e, Spherical))
    powers = matrix([[wrench @ twist for _, twist in chain.driven] for wrench in chain.wrenches], len(chain.driven))
    if powers.shape[0] != powers.shape[1]:
        raise InputError(
            f"{machine.name}: a chain has {powers.shape[1]} drives and {powers.shape[0]} constraints; as many are needed"
        )
    shares, arm = solved(powers, jnp.eye(len(powers))), arm_of(leg, pose)
    wrenches, indices, points = [], [], []
    for k, (joint, twist) in enumerate(chain.driven):
        share = shares[k] / jnp.sqrt(shares[k] @ shares[k])
        wrench = Wrench(ZERO, ZERO)
        for part, factor in zip(chain.wrenches, share, strict=True):
            wrench = wrench.plus(part, factor)
        at_input = _nearest(ball, wrench.force, _first_passive(chain.steps, joint, posture.end)) - posture.end
        at_output = _nearest(ball, wrench.force, posture.end) - posture.end
        velocity = twist.linear + twist.angular.cross(at_input)
        moved = wrench.carried(posture.heading, arm)
        wrenches.append([*moved.force, *moved.moment])
        indices.append([jnp.abs(wrench @ twist) / jnp.sqrt(velocity @ velocity)])
        points.append([*(arm + about_z(posture.heading, at_output))])
    return _Drives(matrix(wrenches, 6), matrix(indices, 1)[:, 0], matrix(points, 3))


def _first_passive(steps: list[tuple[Element, Frame, Any]], joint: Element, end: Vec) -> Vec:
    """Where the first passive joint beyond an actuator is; the platform joint when there is none."""
    beyond = steps[[e for e, _, _ in steps].index(joint) + 1 :]
    return next((f.origin for e, f, _ in beyond if isinstance(e, Joint) and not is_driven(e)), end)


def _nearest(through: Vec, along: Vec, to: Vec) -> Vec:
    """The point nearest to another of the line through a point along a unit vector."""
    return through + along * (along @ (to - through))
