"""How far a model is trusted (A. R. Conn, N. I. M. Gould and Ph. L. Toint, Trust-Region Methods, SIAM, 2000)."""

from __future__ import annotations

from dataclasses import dataclass

WIDER = 2.0
"""After a whole step, as a factor."""


@dataclass
class Trust:
    """How far variables may go on one model, as a part of their range; at first as far as one that is true near by allows."""

    radius: float = 0.05
    widest: float = 0.3
    narrower: float = 0.2
    """After steps that led to nothing better, as a factor, and the least one."""

    def went(self, part: float | None) -> None:
        """The radius next time, after a part of the way to what a model promised was the best; None where none was better."""
        factor = self.narrower if part is None else WIDER if part == 1 else max(part, self.narrower)
        self.radius = min(self.radius * factor, self.widest)
