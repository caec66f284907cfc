"""Stiffness over a surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from trivet.kinematics.mode import mode_words
from trivet.study.comparison import FREE, HELD
from trivet.study.statistics import moments
from trivet.study.stiffness_map import StiffnessMap
from trivet.views.layout import table
from trivet.views.si import diagonal_key, finite


def tables(result: StiffnessMap) -> list[Any]:
    """A map in short."""
    return [
        f"{result.machine.name}, {mode_words(result.mode)}, {result.surface.name}, best roll for {result.objective.name}",
        statistics_table([result]),
        points_table([result]),
    ]


def statistics_table(maps: Sequence[StiffnessMap]) -> Table:
    """Means and variances over the points that are reached."""
    found = table(
        "stiffness over the points that are reached, N/µm; population variances, (N/µm)²",
        "machine",
        "",
        "n",
        "mean",
        "variance",
        "least",
        "greatest",
        left=2,
    )
    for result in maps:
        for k, quantity in enumerate((*HELD, *FREE)):
            m = moments(result.diagonal(quantity)[result.used] / 1e6)
            found.add_row(
                result.machine.name if k == 0 else "",
                quantity,
                str(m.n),
                f"{m.mean:.3f}",
                f"{m.variance:.4f}",
                f"{m.least:.3f}",
                f"{m.greatest:.3f}",
            )
    return found


def points_table(maps: Sequence[StiffnessMap], hemispheres: Sequence[str] = ()) -> Table:
    """How many points are reached, and why others are not; with the hemispheres where they are to be told."""
    found = table(
        "check points",
        "machine",
        *(("over",) if hemispheres else ()),
        "points",
        "used",
        "excluded because",
        "a limit decides the roll",
        "several rolls equally good",
        left=2 if hemispheres else 1,
    )
    for row, result in enumerate(maps):
        reasons = ", ".join(f"{n} × {why}" for why, n in result.exclusions().items()) or "none"
        found.add_row(
            result.machine.name, *hemispheres[row : row + 1], str(len(result.surface)), str(int(result.used.sum())), reasons,
            str(int(result.best.at_limit.sum())), str(int(result.ties_beyond_symmetry.sum())),
        )  # fmt: skip
    return found


def statistics_json(result: StiffnessMap) -> dict[str, Any]:
    """Moments of the stiffness over the points which are reached."""
    found = {}
    for quantity in (*HELD, *FREE):
        m = moments(result.diagonal(quantity)[result.used])
        found[quantity] = {
            "mean_N_per_m": finite(m.mean), "variance_N2_per_m2": finite(m.variance),
            "least_N_per_m": finite(m.least), "greatest_N_per_m": finite(m.greatest),
        }  # fmt: skip
    return {
        "machine": result.machine.name,
        "mode": result.mode,
        "surface": result.surface.name,
        "objective": result.objective.name,
        "points": len(result.surface),
        "used": int(result.used.sum()),
        "excluded": result.exclusions(),
        "points_where_a_limit_decides": int(result.best.at_limit.sum()),
        "points_with_ties_beyond_symmetry": int(result.ties_beyond_symmetry.sum()),
        "statistics": found,
    }


def as_json(result: StiffnessMap) -> dict[str, Any]:
    """A stiffness map, point by point."""
    points = {
        "position_m": finite(result.surface.position),
        "azimuth_rad": finite(result.surface.azimuth),
        "tilt_rad": finite(result.surface.tilt),
        "roll_rad": finite(result.best.roll),
        "ties": finite(result.best.ties),
        "at_limit": finite(result.best.at_limit),
    }
    points |= {diagonal_key(q): finite(result.diagonal(q)) for q in (*HELD, *FREE)}
    reasons = {str(k): miss.reason for k, miss in result.excluded.items()}
    return statistics_json(result) | {"by_point": points, "excluded_because": reasons}
