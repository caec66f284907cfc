"""Machines compared by their static stiffness over a hemisphere and by their dynamic stiffness at home."""

from __future__ import annotations

from dataclasses import dataclass

from trivet.study.comparison import Comparison
from trivet.study.dynamic_comparison import DynamicComparison


@dataclass(frozen=True)
class WholeComparison:
    """Both halves of a comparison."""

    static: Comparison
    dynamic: DynamicComparison | None
    missing: str = ""
    """Why there is no dynamic half, where it was asked for."""
    machines: tuple[str, ...] = ()
    """All that were to be compared; in a half without a result for one of them it is told to be missing."""

    @property
    def without_result(self) -> tuple[str, ...]:
        """Machines that have no result in a half that was asked for, each with the reason."""
        dynamic = self.dynamic.missing if self.dynamic is not None else (self.missing,) * bool(self.missing)
        return tuple(dict.fromkeys((*self.static.missing, *dynamic)))
