"""Frequency responses of machines at home and the least dynamic stiffness (paper sections 3.3.2, 3.3.3 and 4.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from trivet.model.section import STRICT
from trivet.reproduce.found import AS_DESCRIBED, Asked, Chart, Found, Ours, Progress, Series, rounded

if TYPE_CHECKING:
    from trivet.study.dynamic_comparison import DynamicComparison

FrequencyHz = Annotated[float, Field(gt=0)]


@dataclass(frozen=True)
class Dynamic:
    """The least dynamic stiffness "D_xx", "D_yy", "D_zz" as described and in variants, and responses as curves."""

    __pydantic_config__ = STRICT

    kind: Literal["dynamic"]
    variants: tuple[str, ...] | Literal["all"] = "all"
    """Which of the variants of `trivet compare` are looked at besides the machines as described; repeats are left out."""
    premise: str = AS_DESCRIBED
    """The one of them that is set beside the paper."""
    curves: tuple[str, ...] = ()
    """Variants whose responses are drawn; what moves home or damps otherwise has none."""
    low: FrequencyHz = 20.0
    high: FrequencyHz = 6000.0
    """Ends of the curves, Hz."""
    points: Annotated[int, Field(ge=2, le=10_000)] = 800
    """Of a curve, besides those about resonances."""

    def found(self, machines: tuple[str, ...], asked: tuple[Asked, ...], progress: Progress) -> Found:
        """Minima in every setting, and the curves."""
        from trivet.study.dynamic_comparison import compare_dynamics, variants

        wanted = [v.name for v in variants()[1:]] if self.variants == "all" else list(self.variants)
        total, done = len(machines) * (1 + len(wanted) + len(self.curves)), 0

        def advance(*_: Any) -> None:
            nonlocal done
            done += 1
            progress(done, total)

        result = compare_dynamics(*machines, sensitivity=wanted, progress=advance)
        rows = [
            Ours(f"D_{axis}{axis}", name, setting, None if least is None else least.stiffness, "N/um")
            for setting in self._different(result, machines)
            for name in machines
            for axis in "xyz"
            for least in (result.of(name, setting).along(axis),)
        ]
        return Found(tuple(rows), tuple(self._charts(machines, asked, advance)))

    def _different(self, result: DynamicComparison, machines: tuple[str, ...]) -> list[str]:
        """Settings no two of which are the same for all machines, the premise first."""
        different: dict[tuple[float, ...], str] = {}
        for setting in sorted(result.variant_names, key=lambda name: name != self.premise):
            minima = (least.stiffness for name in machines for least in result.of(name, setting).minima)
            different.setdefault(tuple(rounded(minima, 9)), setting)
        return list(different.values())

    def _charts(self, machines: tuple[str, ...], asked: tuple[Asked, ...], advance: Any) -> list[Chart]:
        from trivet.study.dynamic_comparison import variants
        from trivet.study.frf import frf
        from trivet.study.machines import choose

        change = {v.name: v.change for v in variants()}
        charts = []
        for setting in self.curves:
            responses = {}
            for name in machines:
                machine = change[setting](choose(name))
                responses[name] = frf(machine, low=self.low, high=self.high, points=self.points)
                advance()
            chart = partial(Chart, setting, x="frequency, Hz", y="|H|, µm/N", logarithmic="xy")
            for entry in ("xx", "yy", "zz"):
                series = [
                    Series(name, rounded(own.frequency), rounded(1e6 * abs(own.entry(entry))))
                    for name, own in responses.items()
                ]
                charts.append(chart(panel=entry, series=series + self._published(asked, entry)))
        return charts

    def _published(self, asked: tuple[Asked, ...], entry: str) -> list[Series]:
        """The paper's peaks, which have no frequency, at the right end."""
        own = (one for one in asked if one.quantity == f"D_{entry}")
        return [
            Series(f"{name}, paper's peak", [self.high], [float(f"{1e6 / number.value:.6g}")], "points", name)
            for one in own
            for name, number in one.paper.items()
            if number is not None
        ]
