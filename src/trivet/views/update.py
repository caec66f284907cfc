"""A machine corrected by measurements."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from trivet.measure.correction.identifiability import Direction, NextPoint
from trivet.measure.machine.parameters import LOSS_FACTOR
from trivet.study.update import Compared, Update
from trivet.views.layout import more, table
from trivet.views.likeness import criteria, idle, means
from trivet.views.si import finite, functions_json

ROWS = 12
"""Rows of a table of functions or places, at most."""
SHARE = 0.2
"""Share in a combination of numbers below which one is not named."""


def tables(result: Update, further: bool = False) -> Iterator[Any]:
    """The numbers before and after, what the measurements tell of them, how alike responses and modes are before and after."""
    yield _setting(result)
    if not result.is_explained:
        yield unexplained(result.found.spread)
    yield _numbers(result)
    yield from _notes(result)
    yield _functions("functions that were fitted", result.fitted)
    if result.held is not None:
        yield _functions("functions that were held back", result.held)
    if result.modes is not None:
        yield _modes(result)
    if further:
        yield _further(result)


def _setting(result: Update) -> str:
    found, seen = result.found, result.fitted.measured
    apart = (
        f"residuals of ln|H| scatter by {found.spread:.3f} and are alike over {found.lines_alike:.1f} lines "
        f"and {found.functions_alike:.1f} functions"
    )
    return (
        f"{result.problem.machine.name}, {seen.source or 'measured responses'}: {len(seen)} functions at "
        f"{len(seen.frequency)} frequencies, {seen.frequency[0]:g} to {seen.frequency[-1]:g} Hz\n"
        f"{apart}; found in {found.steps} steps"
    )


def _numbers(result: Update) -> Any:
    free = result.problem.free
    found = table(
        "numbers; ± where all others are exact", "", "before", "after", "±", "known before ±", "told by the measurements"
    )
    for k, path in enumerate(free.paths):
        shrunk = result.told.deviation[k] / free.spread[k]
        before = free.scale(free.start)[k] * free.spread[k]
        found.add_row(
            path,
            *(free.kinds[k].told(value, 6) for value in (float(free.start[k]), float(result.after[k]))),
            *(free.kinds[k].told(value, 2) for value in (float(result.deviation[k]), float(before))),
            f"{100 * (1 - shrunk**2):.1f} %",
        )
    return found


def _notes(result: Update) -> Iterator[str]:
    """What should be known of the numbers."""
    paths, told = result.paths, result.told
    lines = [
        f"{paths[a]} and {paths[b]} cannot be told apart by these measurements (correlation {c:+.3f})"
        for a, b, c in told.inseparable
    ]
    lines += [f"not told, and left as it was known before: {combination(result, d)}" for d in told.directions if not d.is_told]
    lines += [f"{path} went {way:+.1f} standard deviations from what was known before" for path, way in result.surprises]
    if not lines and result.is_explained:
        lines = ["every number is told by the measurements, and each apart from the others"]
    if LOSS_FACTOR in paths:
        lines.append(
            f"machine files hold no loss factor of the analysis: give other commands --loss-factor {result.loss_factor:.4g}"
        )
    yield from (*lines, *idle(result.problem.placed))


def unexplained(spread: float) -> str:
    """That what is free does not bring the model to the measurement."""
    return (
        f"the model does not explain the measurement: responses are off by a factor of {math.exp(spread):.1f}, and the ± are "
        "those of a wrong model; free other numbers, or let parts yield that are rigid now (bearings), and look at --figure"
    )


def combination(result: Update, direction: Direction) -> str:
    """A combination of numbers in words: "+0.71 ball.stiffness -0.70 slide.stiffness"."""
    shares = [(k, float(share)) for k, share in enumerate(direction.shares) if abs(share) >= SHARE]
    words = [f"{share:+.2f} {result.paths[k]}" for k, share in sorted(shares, key=lambda one: -abs(one[1]))]
    return " ".join(words) if len(words) > 1 else words[0].partition(" ")[2]


def _functions(title: str, compared: Compared) -> Any:
    found = table(title, "response / reference", "FRAC before", "after", "FAAC before", "after")
    all_four = *compared.frac, *compared.faac
    for k, label in enumerate(compared.measured.labels[:ROWS]):
        found.add_row(label, *criteria(all_four, k))
    more(found, len(compared.measured), ROWS)
    found.add_row("in the mean", *means(all_four))
    return found


def _modes(result: Update) -> Any:
    poles, modes = result.problem.poles, result.modes
    assert poles is not None
    assert modes is not None
    found = table(
        "poles", "measured Hz", "damping %", "Hz before", "after", "by % before", "after", "damping % before", "after", left=0
    )
    for k, (frequency, damping) in enumerate(zip(poles.modes.frequency, poles.modes.damping, strict=True)):
        own = [float(one.frequency[k]) for one in modes]
        found.add_row(
            f"{frequency:.2f}",
            f"{100 * damping:.3f}",
            *(f"{f:.2f}" for f in own),
            *(f"{100 * (f / frequency - 1):+.2f}" for f in own),
            *(f"{100 * float(one.damping[k]):.3f}" for one in modes),
        )
    return found


def _further(result: Update) -> Any:
    found = table("what to measure next, with the loads that there are", "sensor at", "along", "bits it would tell", left=2)
    for one in result.next_points[:ROWS]:
        found.add_row(one.site.point, one.axis, f"{one.gain:.2f}")
    return found


def as_json(result: Update, further: bool = False) -> dict[str, Any]:
    """All of it."""
    free, told, found = result.problem.free, result.told, result.found
    answer: dict[str, Any] = {
        "machine": result.problem.machine.name,
        "source": result.fitted.measured.source,
        "parameters": [
            {
                "path": path,
                "unit": free.kinds[k].si or "1",
                "before": float(free.start[k]),
                "after": float(result.after[k]),
                "standard_deviation": float(result.deviation[k]),
                "standard_deviation_before": float(free.scale(free.start)[k] * free.spread[k]),
                "is_logarithmic": bool(free.is_log[k]),
            }
            for k, path in enumerate(free.paths)
        ],
        "correlation": told.correlation.tolist(),
        "inseparable": [{"paths": [free.paths[a], free.paths[b]], "correlation": c} for a, b, c in told.inseparable],
        "directions": [
            {"shares": d.shares.tolist(), "information": d.information, "is_told": d.is_told} for d in told.directions
        ],
        "scatter_of_ln_magnitude": found.spread,
        "lines_alike": found.lines_alike,
        "functions_alike": found.functions_alike,
        "steps": found.steps,
        "loss_factor": result.loss_factor,
        "explains_measurement": result.is_explained,
        "surprises": [{"path": path, "standard_deviations": way} for path, way in result.surprises],
        "idle_points": list(result.problem.placed.idle),
        "fitted": _compared(result.fitted),
        "held_back": None if result.held is None else _compared(result.held),
        "poles": _poles(result),
    }
    if further:
        answer["next_points"] = [_next(one, free.paths) for one in result.next_points]
    return answer


def _compared(compared: Compared) -> list[dict[str, Any]]:
    frac, faac = compared.frac, compared.faac
    return [
        one
        | {
            "frac_before": finite(frac[0][k]),
            "frac_after": finite(frac[1][k]),
            "faac_before": finite(faac[0][k]),
            "faac_after": finite(faac[1][k]),
        }
        for k, one in enumerate(functions_json(compared.measured))
    ]


def _poles(result: Update) -> list[dict[str, float]] | None:
    if result.modes is None or result.problem.poles is None:
        return None
    before, after = result.modes
    measured = result.problem.poles.modes
    return [
        {
            "frequency_Hz": float(measured.frequency[k]),
            "damping_ratio": float(measured.damping[k]),
            "frequency_before_Hz": float(before.frequency[k]),
            "frequency_after_Hz": float(after.frequency[k]),
            "damping_ratio_before": float(before.damping[k]),
            "damping_ratio_after": float(after.damping[k]),
        }
        for k in range(len(measured.frequency))
    ]


def _next(one: NextPoint, paths: tuple[str, ...]) -> dict[str, Any]:
    deviations = dict(zip(paths, (float(d) for d in one.deviation), strict=True))
    return {"place": one.site.point, "axis": one.axis, "gain_bits": one.gain, "standard_deviations_of_theta": deviations}
