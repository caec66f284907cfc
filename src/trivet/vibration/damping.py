"""How little damping there is in a machine, which decides how narrow its resonances are."""

from __future__ import annotations

from trivet.errors import InputError
from trivet.model import Machine
from trivet.model.elements import Beam, Joint, Prismatic

SLIGHT = 1e-3
"""Loss factor as which a dashpot counts where the width of a resonance is asked: what it adds depends on the mode."""


def check_loss_factor(loss_factor: float) -> None:
    """Refuse a loss factor that none can be: twice a damping ratio, which is critical at 1."""
    if not 0 <= loss_factor < 2:
        raise InputError(f"loss factor: {loss_factor:g}; expected 0 or more, and below 2")


def least_damping(machine: Machine, loss_factor: float) -> float:
    """The least loss factor above zero, of the analysis or of any part; zero where nothing at all is damped."""
    return min((value for value in (loss_factor, *own_damping(machine)) if value > 0), default=0.0)


def own_damping(machine: Machine) -> list[float]:
    """Loss factors of the parts that have their own, or dashpots."""
    elements = [e for chain in machine.chains.values() for e in chain.elements]
    joints = [e for e in elements if isinstance(e, Joint)]
    profiles = [e.profile for e in elements if isinstance(e, Beam)]
    profiles += [e.beam for e in elements if isinstance(e, Prismatic) and e.beam is not None]
    own = [*(j.loss_factor for j in joints), *(machine.materials[p.material].loss_factor for p in profiles)]
    return [float(value) for value in own if value is not None] + [SLIGHT for j in joints if j.viscosity]
