"""Comparison of machines by their minimum dynamic stiffness at home (paper sections 3.3.2 and 4.2, Table 5).

What a description leaves open (how balls and drives give way, the height of home, the platform's mass, what is meant by the
damping) decides such a comparison, so it is made once as the machine files say and once for every variant of it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from itertools import combinations
from typing import Any, Literal

import numpy as np
from scipy.optimize import minimize_scalar

from trivet.errors import InputError, NoResultError, nearest
from trivet.model import Machine
from trivet.model.elements import Drivable, Element, Spherical
from trivet.statics.assembly import PLATFORM
from trivet.study.comparison import PAPER_MACHINES
from trivet.study.frf import Minimum, minimum_dynamic_stiffness
from trivet.study.machines import MachineLike, choose
from trivet.study.pose import PoseReport, pose
from trivet.vibration.exact import ExactStructure, exact_mesh
from trivet.vibration.modes import Modes, exact_frequencies, modes
from trivet.vibration.resonance import grid
from trivet.vibration.response import Damping, modal_receptance

TRANSLATIONS = ("x", "y", "z")
FREQUENCIES = 6
"""Natural frequencies that are told."""
ELEMENTS = 12
"""Elements of a beam of the mesh on which peaks are sought."""
MOST_MODES = 10_000
"""More than that mesh has."""
NEAR = 0.9
"""Peaks on the mesh that reach this share of the greatest are looked at closely."""
PRECISION = 1e-7
"""Of the frequency of a peak, relative; the error of its height goes with the square."""

Rotation = Literal["free", "clamped"] | float
"""How ball joints give way, as `Machine.with_spherical` takes it."""

AS_DESCRIBED = "as described"
BALLS: tuple[Rotation, ...] = ("free", 100.0, 300.0, 1000.0, "clamped")
"""Rotational stiffness of ball joints (N m/rad) that variants take."""
DRIVES = (3.0, 10.0)
"""Factors on the stiffnesses of drives that variants take, besides rigid ones."""
HEIGHTS = (-0.010, -0.005, 0.005, 0.010)
"""Moves of home along z (m) that variants take."""


@dataclass(frozen=True)
class Variant:
    """One way to read a description that leaves something open; it applies to whatever a machine has."""

    name: str
    change: Callable[[Machine], Machine] = lambda machine: machine
    """The machine so read, in its kinematics the same; raises NoResultError where it has nothing that could be read so."""
    raised: float = 0.0
    """How far home is moved along z, m."""
    loss: float = 1.0
    """Factor on the loss factor."""
    damping: Damping = "structural"


def variants() -> tuple[Variant, ...]:
    """All variants; the first one leaves machines as their files describe them."""
    return (
        Variant(AS_DESCRIBED),
        *(Variant(f"home {1e3 * step:+g} mm", raised=step) for step in HEIGHTS),
        *(Variant(f"balls {_written(r)}", partial(_with_balls, rotation=r)) for r in BALLS),
        *(
            Variant(f"drives × {f:g}{balls}", partial(_with_drives, factor=f, rotation=r))
            for r, balls in ((None, ""), (BALLS[2], f", balls {_written(BALLS[2])}"))
            for f in DRIVES
        ),
        Variant("drives rigid", _with_drives),
        *(Variant(f"drives rigid, balls {_written(r)}", partial(_with_drives, rotation=r)) for r in BALLS),
        *(Variant(f"platform × {factor:g}", partial(_weighing, factor=factor)) for factor in (0.5, 2.0)),
        Variant("Euler-Bernoulli", lambda machine: machine.with_theory("euler-bernoulli")),
        Variant("Timoshenko", lambda machine: machine.with_theory("timoshenko")),
        Variant("loss factor × 0.5", loss=0.5),
        Variant("modal damping", damping="modal"),
    )


@dataclass(frozen=True)
class MinimumStiffness:
    """A machine at home in one variant."""

    machine: str
    variant: str
    minima: tuple[Minimum, ...]
    """Minimum of 1/|H_jj| along x, y and z; empty where there is none."""
    natural: np.ndarray
    """The lowest natural frequencies, Hz."""
    status: str = ""
    """Why there is nothing, or empty."""

    def along(self, axis: str) -> Minimum | None:
        """The minimum along x, y or z."""
        return next((m for m in self.minima if m.direction == axis), None)


@dataclass(frozen=True)
class DynamicDeviation:
    """A published minimum dynamic stiffness and ours, N/m."""

    machine: str
    source: str
    quantity: str
    published: float
    ours: float

    @property
    def relative(self) -> float:
        """Deviation of ours from the published one, relative to it."""
        return self.ours / self.published - 1


@dataclass(frozen=True)
class Ordering:
    """Machines along one axis in one variant, the greatest minimum dynamic stiffness first."""

    variant: str
    axis: str
    machines: tuple[str, ...]
    """Those which have a result."""
    missing: tuple[str, ...]
    """Those which have none."""
    published: tuple[str, ...]
    """All machines in their published order; empty where not all are published."""

    @property
    def is_published(self) -> bool | None:
        """Whether it is the published ordering; None where a machine has no result, or none published."""
        return self.machines == self.published if self.published and not self.missing else None

    @property
    def agreeing(self) -> tuple[int, int]:
        """How many pairs of machines stand in their published order, and of how many."""
        pairs = [p for p in combinations(self.published, 2) if not set(p) & set(self.missing)]
        return sum(self.machines.index(a) < self.machines.index(b) for a, b in pairs), len(pairs)

    def __str__(self) -> str:
        return f"{self.axis}: {' > '.join(self.machines)}"


@dataclass(frozen=True)
class Range:
    """Least and greatest of a minimum dynamic stiffness (N/m) over all variants, with the variants."""

    machine: str
    axis: str
    least: float
    least_variant: str
    greatest: float
    greatest_variant: str
    published: float | None

    @property
    def covers(self) -> bool | None:
        """Whether the published value lies between them; None where none is published."""
        return None if self.published is None else self.least <= self.published <= self.greatest


@dataclass(frozen=True)
class DynamicComparison:
    """Minimum dynamic stiffness of several machines at home, as described and in variants."""

    poses: tuple[PoseReport, ...]
    """The machines at home, as described."""
    described: tuple[MinimumStiffness, ...]
    """Per machine, as described."""
    variants: tuple[MinimumStiffness, ...]
    """Per variant and machine, those as described first; empty without a sensitivity study."""
    low: float
    high: float
    """Range of frequencies, Hz."""
    loss_factor: float
    missing: tuple[str, ...] = ()
    """Machines that have no result as described, each with the reason."""

    @property
    def names(self) -> list[str]:
        """Names of the machines."""
        return [at.machine.name for at in self.poses]

    @property
    def variant_names(self) -> list[str]:
        """Names of the variants in their order."""
        return list(dict.fromkeys(d.variant for d in self.variants or self.described))

    def of(self, machine: str, variant: str = AS_DESCRIBED) -> MinimumStiffness:
        """What was found for a machine in a variant."""
        for found in self.variants or self.described:
            if (found.machine, found.variant) == (machine, variant):
                return found
        wrong = (machine, self.names) if machine not in self.names else (variant, self.variant_names)
        raise InputError(f"{machine}, {variant}: not compared{nearest(*wrong)}")

    @cached_property
    def deviations(self) -> list[DynamicDeviation]:
        """Our minima as described beside the published ones which the machine files carry."""
        rows = []
        for at, found in zip(self.poses, self.described, strict=True):
            for p in at.machine.about.published_dynamic:
                ours = found.along(p.quantity[-1])
                assert ours is not None, "as described there is a result, or an error"
                rows.append(DynamicDeviation(found.machine, p.source, p.quantity, p.minimum, ours.stiffness))
        return rows

    def published(self, machine: str, axis: str) -> float | None:
        """The published minimum (N/m) along x, y or z; the first in the file where there are several."""
        return next((d.published for d in self.deviations if (d.machine, d.quantity[-1]) == (machine, axis)), None)

    @cached_property
    def orderings(self) -> list[Ordering]:
        """The machines in order, by variant and axis."""
        found = self.variants or self.described
        rows = []
        for variant in self.variant_names:
            own = [d for d in found if d.variant == variant]
            for axis in TRANSLATIONS:
                reached = {d.machine: m.stiffness for d in own if (m := d.along(axis)) is not None}
                known = {name: value for name in self.names if (value := self.published(name, axis)) is not None}
                published = tuple(sorted(known, key=lambda n: -known[n])) if len(known) == len(self.names) else ()
                missing = tuple(d.machine for d in own if d.machine not in reached)
                rows.append(Ordering(variant, axis, tuple(sorted(reached, key=lambda n: -reached[n])), missing, published))
        return rows

    @cached_property
    def ranges(self) -> list[Range]:
        """Least and greatest over all variants with a result, by machine and axis."""
        rows = []
        for name in self.names:
            own = [d for d in self.variants or self.described if d.machine == name and d.minima]
            for axis in TRANSLATIONS:
                values = {d.variant: m.stiffness for d in own if (m := d.along(axis)) is not None}
                least, most = min(values, key=lambda v: values[v]), max(values, key=lambda v: values[v])
                rows.append(Range(name, axis, values[least], least, values[most], most, self.published(name, axis)))
        return rows


def compare_dynamics(
    *machines: MachineLike,
    mode: str | None = None,
    low: float = 1.0,
    high: float = 20000.0,
    loss_factor: float = 0.02,
    sensitivity: bool | Sequence[str] = True,
    progress: Callable[[str, str], None] = lambda machine, variant: None,
) -> DynamicComparison:
    """Compare machines by the minimum over frequency of 1/|H_jj| at the platform centre, each at its home pose.

    Args:
        machines: machines, names or files; the paper's four when none is given.
        mode: working mode of all machines; each machine's own when not given.
        low, high: range of frequencies, Hz.
        loss_factor: eta of all that has no loss factor of its own; 0.02 is the paper's damping ratio of 1 %.
        sensitivity: whether to vary what descriptions leave open; or the names of the variants to look at.
        progress: called with machine and variant before each is worked out.

    Raises:
        InputError: when one name stands for two machines; for an unknown variant, a range that does not rise from above zero,
            or no damping.
        NoResultError: when no machine has a result, since it does not reach its home pose or moves freely there; of several
            those without are `missing`, and in a variant this is a status.
    """
    chosen = [choose(m) for m in machines or PAPER_MACHINES]
    names = [m.name for m in chosen]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{name}: given twice; give each file its own name under [about]; variants go as {name}@link.length=200 mm"
            )
    described, *others = variants()
    known = [v.name for v in others]
    wanted = known if sensitivity is True else list(sensitivity or ())
    for name in wanted:
        if name not in (AS_DESCRIBED, *known):
            raise InputError(f"variant '{name}' is not known{nearest(name, known)}")

    def found(variant: Variant) -> tuple[MinimumStiffness, ...]:
        return tuple(_dynamics(m, variant, mode, low, high, loss_factor, progress) for m in chosen)

    first = found(described)
    missing = tuple(f"{own.machine}: {own.status}" for own in first if own.status)
    chosen = [m for m, own in zip(chosen, first, strict=True) if not own.status]
    if not chosen:
        raise NoResultError(missing[0])
    first = tuple(own for own in first if not own.status)
    varied = [d for v in others if v.name in wanted for d in found(v)]
    poses = tuple(pose(m, mode=mode) for m in chosen)
    return DynamicComparison(poses, first, (*first, *varied) if sensitivity else (), low, high, loss_factor, missing)


def _dynamics(
    machine: Machine,
    variant: Variant,
    mode: str | None,
    low: float,
    high: float,
    loss_factor: float,
    progress: Callable[[str, str], None],
) -> MinimumStiffness:
    progress(machine.name, variant.name)
    try:
        x, y, z = machine.home.position
        place = (x, y, z + variant.raised) if variant.raised else None
        # Changed afterwards, since the kinematics of another machine would be compiled anew.
        at = dataclasses.replace(pose(machine, place, mode=mode), machine=variant.change(machine))
        found = modes(at.machine, at.frame, at.signs, MOST_MODES, ELEMENTS)
        minima = _minima(at, found, low, high, loss_factor * variant.loss, variant.damping)
        natural = exact_frequencies(found.structure, found.mesh_frequency[:FREQUENCIES])
        return MinimumStiffness(machine.name, variant.name, tuple(minima), natural)
    except NoResultError as error:
        return MinimumStiffness(machine.name, variant.name, (), np.zeros(0), str(error).removeprefix(f"{machine.name}: "))


def _minima(at: PoseReport, found: Modes, low: float, high: float, loss_factor: float, damping: Damping) -> list[Minimum]:
    """As `minimum_dynamic_stiffness`, whose kernels would be compiled anew for nearly every variant.

    All modes of a mesh show where the peaks are; with structural damping their heights are then free of its error.
    """
    if found.mesh.loss.nnz or found.mesh.viscosity.nnz:  # parts with damping of their own couple the modes
        if damping == "modal":
            raise NoResultError("has parts with damping of their own, which couple the modes")
        return minimum_dynamic_stiffness(at, low, high, loss_factor)[: len(TRANSLATIONS)]
    rows = found.mesh.rows(PLATFORM)[: len(TRANSLATIONS)]

    def on_mesh(frequency: np.ndarray) -> np.ndarray:
        response = modal_receptance(found, rows, rows, frequency, loss_factor, damping)
        return np.abs(np.diagonal(response, axis1=1, axis2=2))

    places = grid(low, high, loss_factor)
    peaks = [_peaks(places, values) for values in on_mesh(places).T]
    if not all(peaks):
        raise NoResultError("has no finite response in the range of frequencies")
    if damping == "modal":
        return [_least(axis, ends, lambda f: on_mesh(np.array([f]))[0]) for axis, ends in zip(TRANSLATIONS, peaks, strict=True)]
    highest = max(top for ends in peaks for _, top in ends)
    exact = ExactStructure(exact_mesh(found.structure, 2 * math.pi * highest))
    own = exact.mesh.rows(PLATFORM)[: len(TRANSLATIONS)]
    load = own.toarray().T

    @cache
    def size(frequency: float) -> np.ndarray:
        (dynamic,) = exact.damped(np.array([2 * math.pi * frequency]), loss_factor)
        return np.abs(np.diagonal(own @ np.linalg.solve(dynamic, load)))

    return [_least(axis, ends, size) for axis, ends in zip(TRANSLATIONS, peaks, strict=True)]


def _peaks(places: np.ndarray, values: np.ndarray) -> list[tuple[float, float]]:
    """Brackets (Hz) of the peaks of a grid that are near its greatest."""
    padded = np.r_[0.0, values, 0.0]
    (tops,) = np.nonzero((values >= padded[:-2]) & (values >= padded[2:]) & (values >= NEAR * values.max()))
    last = len(places) - 1
    return [(float(places[max(int(k) - 2, 0)]), float(places[min(int(k) + 2, last)])) for k in tops]


def _least(axis: str, brackets: list[tuple[float, float]], size: Callable[[float], np.ndarray]) -> Minimum:
    """The minimum along one axis, where the response (m/N) is greatest within the brackets."""
    number = TRANSLATIONS.index(axis)
    found = []
    for low, high in brackets:
        options = {"xatol": PRECISION * high}
        peak = minimize_scalar(lambda f: -size(float(f))[number], bounds=(low, high), method="bounded", options=options)
        found.append(Minimum(axis, -1 / float(peak.fun), float(peak.x)))
    return min(found, key=lambda m: m.stiffness)


def _written(rotation: Rotation) -> str:
    return rotation if isinstance(rotation, str) else f"{rotation:g} N m/rad"


def _with_balls(machine: Machine, rotation: Rotation) -> Machine:
    if not any(isinstance(e, Spherical) for e in _elements(machine)):
        raise NoResultError("has no spherical joint")
    return machine.with_spherical(rotation)


def _with_drives(machine: Machine, factor: float | None = None, rotation: Rotation | None = None) -> Machine:
    """The machine with its drives' stiffnesses multiplied, or rigid drives; and with other balls."""
    if not any(_yields(e) for e in _elements(machine)):
        raise NoResultError("has no drive that yields")
    changed = machine.with_rigid_drives() if factor is None else _with_stiffer_drives(machine, factor)
    return changed if rotation is None else _with_balls(changed, rotation)


def _with_stiffer_drives(machine: Machine, factor: float) -> Machine:
    def stiffer(element: Any) -> Any:
        return dataclasses.replace(element, stiffness=factor * element.stiffness) if _yields(element) else element

    chains = {
        name: dataclasses.replace(chain, elements=tuple(stiffer(e) for e in chain.elements))
        for name, chain in machine.chains.items()
    }
    return dataclasses.replace(machine, chains=chains)


def _yields(element: Element) -> bool:
    return isinstance(element, Drivable) and element.actuated and element.stiffness is not None


def _weighing(machine: Machine, factor: float) -> Machine:
    """The machine with a thicker disc, or with mass and moments of inertia multiplied."""
    platform = machine.platform
    if platform.disc is not None:
        disc = dataclasses.replace(platform.disc, thickness=factor * platform.disc.thickness)
        return dataclasses.replace(machine, platform=dataclasses.replace(platform, disc=disc))
    if platform.mass is None:
        raise NoResultError("has a platform without mass")

    def times(values: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        return None if values is None else (factor * values[0], factor * values[1], factor * values[2])

    return dataclasses.replace(
        machine,
        platform=dataclasses.replace(
            platform,
            mass=factor * platform.mass,
            inertia=times(platform.inertia),
            products_of_inertia=times(platform.products_of_inertia),
        ),
    )


def _elements(machine: Machine) -> Iterator[Element]:
    for chain in machine.chains.values():
        yield from chain.elements
