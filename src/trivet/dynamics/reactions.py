"""What the joints transmit: the wrench between the two bodies of every joint, which sizes its bearings."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp

from trivet.dynamics.bodies import Bodies
from trivet.dynamics.chain import Chain, ChainMotion, Member, chain_motion, inertia_forces
from trivet.dynamics.equations import Stand, State, Surroundings, chain_needs, chains_at
from trivet.model.elements import Curvilinear, Joint, Prismatic
from trivet.space.elimination import Array
from trivet.space.frame import Frame
from trivet.space.scalar import Scalar
from trivet.space.screw import Twist, Wrench
from trivet.space.vector import Vec


def joint_wrenches(
    bodies: Bodies, state: State, acceleration: Twist, stand: Stand, around: Surroundings, forces: Sequence[Scalar]
) -> Array:
    """Wrenches in all joints, locked ones included, while the actuators give certain forces.

    Args:
        bodies, state, acceleration, stand, around: as for `equations.inverse_dynamics`.
        forces: of the actuators in the order of Q, components (n,): those of the inverse dynamics.

    Returns:
        (n, joints, 6): force (N) and moment (N m) which the body before a joint, nearer to the ground, puts on the one beyond
        it; chain by chain in the order of the elements; reduced at the joint, in its axes (those before it moves; of the
        carriage on a chain's guide, circular or straight, those of the carriage).
    """
    found: dict[int, Array] = {}
    given = dict(zip(bodies.ranks, forces, strict=True))
    for group, chain in zip(bodies.alike(), chains_at(bodies, state.pose, stand), strict=True):
        shape = (len(group.places), *jnp.shape(state.pose.origin.x))
        motion = chain_motion(chain, state.twist, acceleration)
        own = [jnp.stack([given[place, rank] for place in group.places]) for rank in range(len(chain.drives))]
        wrenches = jnp.stack([
            jnp.stack([jnp.broadcast_to(jnp.asarray(c, dtype=float), shape) for v in wrench for c in v], axis=-1)
            for wrench in _along(chain, motion, around, own)
        ], axis=-2)  # fmt: skip
        found |= {place: wrenches[k] for k, place in enumerate(group.places)}
    return jnp.concatenate([found[place] for place in sorted(found)], axis=-2)


def _along(chain: Chain, motion: ChainMotion, around: Surroundings, forces: Sequence[Scalar]) -> list[Wrench]:
    """The wrench in every joint of a chain, in the joint's own axes."""
    # What the chain puts on the platform is what its drives give, less what it needs to move itself.
    end = chain_needs(chain, motion, around).times(-1)
    for k, force in zip(chain.drives, forces, strict=True):
        end = end.plus(chain.reciprocal[k], force)
    _, handed_on = inertia_forces(chain, motion.rates, motion.accelerations, chain.inwards(around.gravity))
    if chain.ends_with_ball:
        handed_on = [*handed_on, Wrench(Vec(0, 0, 0), Vec(0, 0, 0))]
    found = []
    for k, (member, wrench) in enumerate(zip(chain.members, handed_on, strict=True)):
        if isinstance(member.element, Joint):
            found.append(_seen(wrench.plus(end), chain, _place(chain.members, k)))
    return found


def _place(members: Sequence[Member], k: int) -> Frame:
    """Where the bodies of a joint touch."""
    is_carriage = isinstance(members[k].element, Curvilinear) or (k == 0 and isinstance(members[k].element, Prismatic))
    return members[k + 1].frame if is_carriage else members[k].frame


def _seen(wrench: Wrench, chain: Chain, frame: Frame) -> Wrench:
    """A wrench at P, reduced at the origin of a frame and in its axes."""
    moment = wrench.moment + (chain.end - frame.origin).cross(wrench.force)
    return Wrench(*(Vec(*(axis @ v for axis in frame[1:])) for v in (wrench.force, moment)))
