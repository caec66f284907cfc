"""What is asked of plans: settings that ways and cones share, rules that come of them, and the proof that these are kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypedDict

from trivet.errors import InputError
from trivet.kinematics.jacobian import require_six_each
from trivet.kinematics.mode import closed_form_signs
from trivet.kinematics.travel import winding
from trivet.reach.certificate import Demand, Patches, Proof, Prover
from trivet.reach.neutral import Reference, with_neutral
from trivet.reach.scene import scene_of
from trivet.study.aims import SIGMA, read_aims
from trivet.study.machines import MachineLike, choose
from trivet.study.roll_grid import Aim, Along, Rules
from trivet.study.tilt import ball_of, sphere_of

SHARE = 0.8
"""Of the least sigma_min along a plan, which is to be proven when nothing else is asked for."""
BUDGET = 200_000
"""Patches of a proof, at most."""


@dataclass(frozen=True)
class Requirements:
    """What is asked of a plan."""

    mode: str | None = None
    """Working mode; the machine's own when None."""
    neutral: Reference = "as-described"
    """From what the stems of the platform's sockets deviate, see `trivet.reach.neutral`."""
    aims: Sequence[Aim | str] = (SIGMA,)
    """What is to be great at the worst place, as `trivet.study.aims` reads it; of several the least over what counts as one."""
    limits: bool = True
    """Whether joints must stay inside their travel."""
    bodies: bool = True
    """Whether bodies must stay apart."""
    proof: bool = True
    """Whether to try to prove that it is free."""
    sigma: float | None = None
    """sigma_min that every pose must have and that is to be proven; `SHARE` of the least that is met when None."""

    def __post_init__(self) -> None:
        if self.sigma is not None and not 0 < self.sigma < math.inf:
            raise InputError(f"sigma_min to be proven: {self.sigma:g}; it must be above zero and finite")

    def rules(self, machine: MachineLike) -> Rules:
        """What a machine has to keep to, on no sphere as yet."""
        chosen = with_neutral(choose(machine), self.neutral, self.mode)
        signs = closed_form_signs(chosen, self.mode)
        require_six_each(chosen)
        wound = winding(chosen) if self.limits else []
        if wound:
            raise InputError(
                f"{chosen.name}: {', '.join(wound)} may turn beyond a turn, and plans do not count turns; give a travel of 360 "
                "deg at most or none, or leave limits aside"
            )
        scene = scene_of(chosen, with_workpiece=False) if self.bodies else None
        if self.proof and scene is not None and scene.meshed.pairs:
            raise InputError(
                f"{chosen.name}: bodies with meshes have no proofs; ask for none (--no-proof), or describe them by "
                "capsules, boxes and spheres"
            )
        return Rules(chosen, signs, scene, None, 0.0, self.limits, read_aims(self.aims), self.sigma or 0.0)

    def prove(self, rules: Rules, patches: Patches, samples: Along, progress: Callable[[int, int], None]) -> Proof | None:
        """Try to prove that rules are kept all over patches, of which samples are known; None where no proof is asked for."""
        if not self.proof:
            return None
        least = SHARE * float(samples.sigma_min.min()) if self.sigma is None else self.sigma
        return prover_of(rules).prove(patches, demand_of(rules, least), BUDGET, progress)


class Settings(TypedDict, total=False):
    """`Requirements` by keywords."""

    mode: str | None
    neutral: Reference
    aims: Sequence[Aim | str]
    limits: bool
    bodies: bool
    proof: bool
    sigma: float | None


def on_sphere(rules: Rules, radius: float | None, height: float | None, solid: bool) -> tuple[Rules, float]:
    """Rules on a sphere, and the height of its centre (m).

    Args:
        rules: those on none.
        radius: of the sphere, m; that of the workpiece when None.
        height: of its centre above {O}, on the z axis, m; that of the workpiece when None.
        solid: whether bodies must stay clear of the sphere as well.
    """
    radius, height = sphere_of(rules.machine, radius, height)
    if solid and rules.scene is None:
        raise InputError("a solid sphere is something that bodies stay clear of; look at bodies as well")
    if solid:
        rules = rules._replace(scene=scene_of(rules.machine, with_workpiece=True))
    return rules._replace(radius=radius, workpiece=ball_of((0.0, 0.0, height), radius)), height


def prover_of(rules: Rules) -> Prover:
    """What proves that rules are kept."""
    return Prover(rules.machine, rules.signs, rules.scene, rules.radius, rules.workpiece)


def demand_of(rules: Rules, sigma: float) -> Demand:
    """What is to be proven: what the rules ask for, and a sigma_min."""
    return Demand(0.0 if rules.limits else -math.inf, None if rules.scene is None else rules.gap, sigma)


def verdict(proof: Proof | None) -> str:
    """What became of a proof, in a word or two."""
    if proof is None:
        return "no proof asked for"
    return "proven" if proof.is_proven else ("refuted" if proof.is_refuted else "not proven")
