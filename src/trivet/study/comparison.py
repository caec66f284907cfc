"""Comparison of machines by their static stiffness (paper section 4, Tables 2-4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from trivet.errors import InputError, NoResultError
from trivet.study.machines import MachineLike, choose
from trivet.study.statistics import Moments, WelchTest, every_pair, moments
from trivet.study.stiffness_map import StiffnessMap, stiffness_map, surface_of

PAPER_MACHINES = ("azulay", "eclipse", "alizade", "glozman")
"""What is compared when nothing is named: the machines of the paper's Table 4."""

HELD = ("K_xx", "K_yy", "K_zz")
FREE = ("1/C_xx", "1/C_yy", "1/C_zz")

CAVEATS = (
    "Neighbouring check points of a lattice are not independent samples: p-values overstate the evidence, and a finer lattice "
    "makes any difference significant. Judge by the effect sizes.",
    "K_ii holds all other displacements of the platform; 1/C_ii leaves them free. With free ball joints the first does not see "
    "a singularity, the second does.",
)

UNLIKE = (
    "The machines are compared over unlike hemispheres, each over the workpiece of its own file; one radius and height given "
    "for all make them alike."
)


@dataclass(frozen=True)
class Deviation:
    """A published mean and ours."""

    machine: str
    source: str
    quantity: str
    published: float
    ours: float
    published_variance: float | None
    our_variance: float

    @property
    def relative(self) -> float:
        """Deviation of our mean from the published one, relative to it."""
        return self.ours / self.published - 1


@dataclass(frozen=True)
class Convergence:
    """Means on the check points and on a finer lattice."""

    machine: str
    quantity: str
    points: int
    mean: float
    finer_points: int
    finer_mean: float

    @property
    def relative(self) -> float:
        """Change of the mean with the finer lattice."""
        return self.finer_mean / self.mean - 1


@dataclass(frozen=True)
class Comparison:
    """Stiffness maps of several machines side by side."""

    maps: tuple[StiffnessMap, ...]
    finer: tuple[StiffnessMap, ...]
    """The same over a finer lattice, or empty."""
    missing: tuple[str, ...] = ()
    """Machines that reach no point, each with the reason."""

    @property
    def hemispheres(self) -> list[str]:
        """Per map the hemisphere over which it is."""
        return [f"{m.surface.name} at z0 = {float(m.surface.position[:, 2].min()) * 1e3:g} mm" for m in self.maps]

    @property
    def caveats(self) -> tuple[str, ...]:
        """What to mind when reading it."""
        return (*((UNLIKE,) if len(set(self.hemispheres)) > 1 else ()), *CAVEATS)

    def samples(self, quantities: Sequence[str] = HELD) -> dict[str, dict[str, Moments]]:
        """Moments by machine and quantity over the points which that machine reaches (SI)."""
        return {m.machine.name: {q: moments(m.diagonal(q)[m.used]) for q in quantities} for m in self.maps}

    @cached_property
    def tests(self) -> list[WelchTest]:
        """Welch's test for every pair and axis, p corrected by Holm over the whole family."""
        return every_pair(self.samples())

    @cached_property
    def deviations(self) -> list[Deviation]:
        """Our means beside the published ones which the machine files carry."""
        samples = self.samples()
        return [
            Deviation(
                name,
                p.source,
                p.quantity,
                p.mean,
                samples[name][p.quantity].mean,
                p.variance,
                samples[name][p.quantity].variance,
            )
            for m in self.maps
            for name, p in ((m.machine.name, p) for p in m.machine.about.published)
        ]

    @cached_property
    def convergence(self) -> list[Convergence]:
        """Means on the check points against those on the finer lattice."""
        rows = []
        for coarse, fine in zip(self.maps, self.finer, strict=False):
            for q in HELD:
                a, b = moments(coarse.diagonal(q)[coarse.used]), moments(fine.diagonal(q)[fine.used])
                rows.append(Convergence(coarse.machine.name, q, a.n, a.mean, b.n, b.mean))
        return rows


def compare(
    *machines: MachineLike,
    objective: str = "K_xx",
    mode: str | None = None,
    steps: int = 10,
    radius: float | None = None,
    height: float | None = None,
    rolls: int = 360,
    finer: int = 2,
    progress: Callable[[str, int, int], None] = lambda machine, points, total: None,
) -> Comparison:
    """Compare machines over their workpiece hemispheres, each point with its best roll.

    Args:
        machines: machines, names or files; the paper's four when none is given.
        objective: what the roll maximises.
        mode: working mode of all machines; each machine's own when not given.
        steps: lattice steps from pole to rim; 10 gives the paper's 317 points.
        radius, height: of the hemisphere (m) for all machines; each machine's own workpiece when not given.
        rolls: rolls of the first grid.
        finer: refinement of the lattice for the convergence check; 1 leaves it out.
        progress: called with machine name, points done and of how many, those of the finer lattice among them.

    Raises:
        InputError: when one name stands for two machines.
        NoResultError: when no machine reaches any point; of several those which reach none are `missing`.
    """
    chosen = [choose(m) for m in machines or PAPER_MACHINES]
    names = [m.name for m in chosen]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{name}: given twice; give each file its own name under [about]; variants go as {name}@link.length=200 mm"
            )
    if not 1 <= finer <= 10:
        raise InputError(f"finer: {finer}; expected 1 (no convergence check) to 10")

    def over(machine: Any, scale: int) -> StiffnessMap:
        sizes = [len(surface_of(machine, steps * k, radius, height)) for k in dict.fromkeys((1, finer))]
        before, total = (sizes[0] if scale > 1 else 0), sum(sizes)
        surface = surface_of(machine, steps * scale, radius, height)
        return stiffness_map(
            machine,
            surface,
            objective=objective,
            mode=mode,
            rolls=rolls,
            progress=lambda points: progress(machine.name, before + points, total),
        )

    maps: list[StiffnessMap] = []
    missing: list[str] = []
    for machine in chosen:
        try:
            maps.append(over(machine, 1))
        except NoResultError as error:
            missing.append(str(error))
    if not maps:
        raise NoResultError(missing[0])
    return Comparison(tuple(maps), tuple(over(m.machine, finer) for m in maps) if finer > 1 else (), tuple(missing))
