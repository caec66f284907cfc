"""A table or a figure with what was found: numbers beside the paper's, orders, statements, verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from trivet.reproduce.found import Asked, Found, Ours
from trivet.reproduce.numbers import Number, Unit, unit_named
from trivet.reproduce.ordering import Moments, Ordering, greatest_p, holds, ordering, written
from trivet.reproduce.paper import Claim, Item
from trivet.reproduce.verdict import AS_PUT_IN, MET, Verdict, deviation, of_fit, of_input, of_statement, verdict_of

POINTS = "points"
MEAN, VARIANCE = "mean ", "variance "


class Row(NamedTuple):
    """A number of ours beside the paper's; SI."""

    quantity: str
    machine: str
    unit: Unit
    """The paper's, where it tells of the quantity."""
    paper: Number | None
    ours: float | None
    setting: str
    """Of ours."""
    least: float | None
    """Over all settings that have a number; None where there is one setting only."""
    greatest: float | None
    verdict: Verdict

    @property
    def deviation(self) -> float | None:
        """Of ours, relative to the paper's."""
        return None if self.paper is None or self.ours is None else deviation(self.paper, self.ours)


class Statement(NamedTuple):
    """What the paper says in words of one quantity."""

    text: str
    quantity: str
    """Empty where it is of none."""
    expected: str
    ours: str
    """What it is about, in the first setting."""
    holding: int
    """Settings in which it holds."""
    settings: int
    """Settings in which it can be told."""
    left_out: int
    """Settings in which it cannot, since a machine has no number there."""
    in_paper: bool | None
    """Whether the paper's own numbers bear it out; None where it has none."""
    verdict: Verdict


@dataclass(frozen=True)
class Outcome:
    """An item, and what was found."""

    item: Item
    found: Found

    @cached_property
    def settings(self) -> dict[str, list[str]]:
        """Settings by quantity, the first being the one that is set beside the paper."""
        table: dict[str, dict[str, None]] = {}
        for own in self.found.ours:
            table.setdefault(own.quantity, {})[own.setting] = None
        return {quantity: list(own) for quantity, own in table.items()}

    def values(self, quantity: str, setting: str) -> dict[str, float]:
        """Numbers by machine (SI), where there are any."""
        return {
            own.machine: own.value
            for own in self.found.ours
            if (own.quantity, own.setting) == (quantity, setting) and own.value is not None
        }

    def paper(self, quantity: str) -> Mapping[str, Number | None]:
        """The paper's numbers by machine, for a quantity that puts them in order; empty where it has none."""
        return next((asked.paper for asked in self.item.asked if asked.ordered_by == quantity), {})

    @cached_property
    def orderings(self) -> tuple[Ordering, ...]:
        """Orders of the machines, by quantity that the paper tells of two or more, and setting; inputs have none."""
        return tuple(
            ordering(quantity, setting, asked.paper, self.values(quantity, setting))
            for asked in self.item.asked
            if not asked.is_input and sum(number is not None for number in asked.paper.values()) > 1
            for quantity in (asked.ordered_by,)
            for setting in self.settings.get(quantity, [])
        )

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Numbers in the first setting of their quantity, in the order of the paper's table."""
        first = [own for own in self.found.ours if own.setting == self.settings[own.quantity][0] and own.quantity != POINTS]
        order = list(dict.fromkeys([*(asked.quantity for asked in self.item.asked), *self.settings]))
        return tuple(self._row(own) for own in sorted(first, key=lambda own: order.index(own.quantity)))

    def _row(self, own: Ours) -> Row:
        asked = next((one for one in self.item.asked if one.quantity == own.quantity), None)
        paper = asked and asked.paper.get(own.machine)
        every = [
            other.value
            for other in self.found.ours
            if (other.quantity, other.machine) == (own.quantity, own.machine) and other.value is not None
        ]
        is_varied = len(self.settings[own.quantity]) > 1 and bool(every)
        verdict = self._verdict(asked, own, paper)
        least, greatest = (min(every), max(every)) if is_varied else (None, None)
        printed = (number.unit for number in (asked.paper.values() if asked else ()) if number is not None)
        unit = next(printed, None) or unit_named(own.unit)
        return Row(own.quantity, own.machine, unit, paper, own.value, own.setting, least, greatest, verdict)

    def _verdict(self, asked: Asked | None, own: Ours, paper: Number | None) -> Verdict:
        reason = self.item.reason(own.quantity, own.machine)
        if asked is not None and asked.is_input:
            return of_input(paper, own.value, reason)
        if asked is not None and asked.is_fitted:
            return of_fit(paper, own.value, reason)
        first = next((o for o in self.orderings if asked is not None and o.quantity == asked.ordered_by), None)
        return verdict_of(paper, own.value, first is not None and first.is_reproduced, reason)

    @cached_property
    def statements(self) -> tuple[Statement, ...]:
        """What the paper says in words, quantity by quantity."""
        return tuple(self._statement(claim, quantity) for claim in self.item.claims for quantity in claim.quantities or ("",))

    def _statement(self, claim: Claim, quantity: str) -> Statement:
        settings = self.settings.get(quantity, [])
        told = [holds(claim, self.values(quantity, s), self._samples(quantity, s)) for s in settings]
        known = {name: own.value for name, own in self.paper(quantity).items() if own is not None}
        in_paper = holds(claim, known, self._paper_samples(quantity)) if known else None
        number, how = claim.number, "at least" if claim.at_least else "about"
        expected = claim.order if number is None else f"{how} {number.text} {number.unit.shown}"
        ours = self._ours_in_words(claim, quantity, settings[0]) if settings else ""
        reason = claim.reason or self.item.reason(quantity, "")
        verdict = of_statement(told[0] if told else None, in_paper, bool(claim.order), reason)
        judged = [one for one in told if one is not None]
        counts = sum(judged), len(judged), len(told) - len(judged)
        return Statement(claim.text, quantity, expected, ours, *counts, in_paper, verdict)

    def _ours_in_words(self, claim: Claim, quantity: str, setting: str) -> str:
        values = self.values(quantity, setting)
        if claim.number is None:
            order = written({name: value for name, value in values.items() if name in claim.named})
            p = greatest_p(claim.pairs, self._samples(quantity, setting)) if claim.significance is not None else None
            return order if p is None else f"{order}; greatest p {p:.1g}"
        unit, names = claim.number.unit, claim.named or tuple(values)
        return ", ".join(f"{name} {unit.text(values.get(name))} {unit.shown}" for name in names)

    def _samples(self, quantity: str, setting: str) -> dict[str, Moments]:
        """Ours as samples, where means and variances are."""
        own = quantity.removeprefix(MEAN)
        means, variances = self.values(MEAN + own, setting), self.values(VARIANCE + own, setting)
        return {
            name: Moments(int(n), means[name], variances[name])
            for name, n in self.values(POINTS, setting).items()
            if name in means and name in variances
        }

    def _paper_samples(self, quantity: str) -> dict[str, Moments]:
        """The paper's means and variances, with as many points as ours have."""
        own = quantity.removeprefix(MEAN)
        means, variances = self.paper(MEAN + own), self.paper(VARIANCE + own)
        counts = self.values(POINTS, self.settings[POINTS][0]) if POINTS in self.settings else {}
        return {
            name: Moments(int(counts[name]), mean.value, variance.value)
            for name, mean in means.items()
            if name in counts and mean is not None and (variance := variances.get(name)) is not None
        }

    @property
    def summary(self) -> str:
        """How much of it comes out, in a line."""
        inputs, fits = ([row.verdict.words for row in self.rows if row.verdict.kind == kind] for kind in ("input", "fit"))
        numbers = [r.verdict.kind for r in self.rows if r.paper is not None and r.verdict.kind not in ("input", "fit")]
        first = [o for o in self.orderings if o.setting == self.settings[o.quantity][0] and o.pairs]
        parts = [f"{inputs.count(AS_PUT_IN)} of {len(inputs)} inputs as put in"] if inputs else []
        parts += [f"{fits.count(MET)} of {len(fits)} fitted numbers met"] if fits else []
        if numbers:
            parts.append(f"{numbers.count('reproduced')} of {len(numbers)} numbers reproduced")
        if first:
            parts.append(f"{sum(o.is_reproduced for o in first)} of {len(first)} orderings")
        judged = [s for s in self.statements if s.settings]
        if judged:
            held = sum(s.verdict.kind != "not reproducible" for s in judged)
            parts.append(f"{held} of {len(judged)} statements hold" if len(judged) > 1 else f"{held} of 1 statement holds")
        unknown = len(self.statements) - len(judged)
        if unknown:
            parts.append(f"{unknown} statement{'' if unknown == 1 else 's'} cannot be looked at")
        return ", ".join(parts)
