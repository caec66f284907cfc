"""Machines side by side: minimum dynamic stiffness at home."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.table import Table

from trivet.study.dynamic_comparison import AS_DESCRIBED, TRANSLATIONS, DynamicComparison, MinimumStiffness
from trivet.study.frf import Minimum
from trivet.views.comparison import DEVIATION
from trivet.views.layout import table
from trivet.views.si import finite, minima_json


def tables(result: DynamicComparison) -> Iterator[Any]:
    """Minima, published values, orders, what descriptions leave open."""
    yield (
        f"Dynamic stiffness at the platform centre, every machine at home, {result.low:g} to {result.high:g} Hz, "
        f"structural damping with loss factor {result.loss_factor:g}"
    )
    yield from (f"No dynamic comparison: {line}" for line in result.missing)
    yield _described(result)
    if result.deviations:
        yield _published(result)
        yield DEVIATION
    if len(result.names) > 1:
        yield _orders(result)
    if result.variants:
        yield _ranges(result)
        yield _variants(result)


def _described(result: DynamicComparison) -> Table:
    columns = [head for axis in TRANSLATIONS for head in (axis, "at Hz")]
    found = table("minimum dynamic stiffness as described, N/µm", "machine", *columns, "natural frequencies, Hz")
    for own in result.described:
        cells = [cell for axis in TRANSLATIONS for cell in _cells(own.along(axis))]
        found.add_row(own.machine, *cells, ", ".join(f"{f:.1f}" for f in own.natural))
    return found


def _cells(minimum: Minimum | None) -> tuple[str, str]:
    return ("", "") if minimum is None else (_written(minimum.stiffness), f"{minimum.frequency:.1f}")


def _written(stiffness: float) -> str:
    """N/m in N/µm."""
    return f"{stiffness / 1e6:.4f}"


def _published(result: DynamicComparison) -> Table:
    columns = ("machine", "source", "", "published", "ours", "deviation")
    found = table("beside published minimum dynamic stiffness, N/µm", *columns, left=3)
    for d in result.deviations:
        numbers = (_written(d.published), _written(d.ours), f"{100 * d.relative:+.0f} %")
        found.add_row(d.machine, d.source, d.quantity, *numbers)
    return found


def _orders(result: DynamicComparison) -> Table:
    found = table("order as described, stiffest first", "along", "ours", "published", left=3)
    for order in result.orderings:
        if order.variant == AS_DESCRIBED:
            found.add_row(order.axis, " > ".join(order.machines), " > ".join(order.published))
    return found


def _ranges(result: DynamicComparison) -> Table:
    columns = ("machine", "along", "least", "when", "greatest", "when", "published")
    found = table("what descriptions leave open: minimum dynamic stiffness over all variants, N/µm", *columns, left=2)
    for own in result.ranges:
        words = "" if own.published is None else _written(own.published) + ("" if own.covers else " outside")
        least, greatest = (_written(value) for value in (own.least, own.greatest))
        found.add_row(own.machine, own.axis, least, own.least_variant, greatest, own.greatest_variant, words)
    return found


def _variants(result: DynamicComparison) -> Table:
    found = table("variant by variant along x, y and z, N/µm", "variant", *result.names)
    for variant in result.variant_names:
        every = [[result.of(name, variant).along(axis) for axis in TRANSLATIONS] for name in result.names]
        found.add_row(variant, *("  ".join(_written(own.stiffness) for own in row if own is not None) for row in every))
    return found


def as_json(result: DynamicComparison) -> dict[str, Any]:
    """Everything of the dynamic half."""
    return {
        "frequency_range_Hz": [result.low, result.high],
        "loss_factor": result.loss_factor,
        "machines": [_one(own) for own in result.described],
        "published": [
            {
                "machine": d.machine, "source": d.source, "quantity": d.quantity, "published_N_per_m": d.published,
                "minimum_N_per_m": finite(d.ours), "relative_deviation": finite(d.relative),
            }
            for d in result.deviations
        ],
        "orders": [
            {
                "variant": order.variant, "axis": order.axis, "machines": list(order.machines), "missing": list(order.missing),
                "published": list(order.published), "is_published": order.is_published,
            }
            for order in result.orderings
        ],
        "ranges": [
            {
                "machine": own.machine, "axis": own.axis,
                "least_N_per_m": finite(own.least), "least_variant": own.least_variant,
                "greatest_N_per_m": finite(own.greatest), "greatest_variant": own.greatest_variant,
                "published_N_per_m": own.published,
            }
            for own in result.ranges
        ],
        "variants": [_one(own) for own in result.variants],
        "missing": list(result.missing),
    }  # fmt: skip


def _one(own: MinimumStiffness) -> dict[str, Any]:
    return {
        "machine": own.machine,
        "variant": own.variant,
        "status": own.status or None,
        "minimum_dynamic_stiffness": minima_json(own.minima),
        "natural_frequencies_Hz": finite(own.natural),
    }
