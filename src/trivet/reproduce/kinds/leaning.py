"""How far machines lean on spheres, pose by pose and from upright on one side of all singularities (paper section 3.1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from trivet.errors import NoResultError
from trivet.reach.neutral import Reference
from trivet.reproduce.found import Ours

if TYPE_CHECKING:
    from trivet.model import Chain, Machine
    from trivet.reach.tilt import Grid, Looked

ALL: tuple[Reference, ...] = get_args(Reference)[1:]
"""Neutral axes that machine files leave open."""
AZIMUTHS, MOST = 36, math.pi
ROLLS = 180
HALVINGS = 7
"""How often the steps of a search are halved."""
CUTS = 10
"""How often the space between two heights of a grid is halved."""
NEAR = math.radians(0.005)
"""What is as near as this is as near as anybody asks."""


class Sphere(NamedTuple):
    """A sphere that the platform touches, and from where the cones of the ball joints are counted."""

    neutral: Reference
    height: float
    """Of its centre, m."""
    radius: float
    """m"""

    def __str__(self) -> str:
        return f"{self.neutral}, z0 {1e3 * self.height:.4g} mm, radius {1e3 * self.radius:.3g} mm"


class Lean(NamedTuple):
    """A tilt, and what lies on the way there from upright: with any rolls, over neighbouring poses of a grid, inside limits."""

    sphere: Sphere
    tilt: float
    """rad"""
    one_sided: float
    """Greatest tilt of the grid (rad), not above this one, to which a way leads on one side of every Type 2 singularity."""
    crossing: float
    """The same where singularities may be crossed."""
    step: float
    """Of the grid, rad."""

    def words(self, name: str) -> str:
        """A sentence of a machine."""
        tilt, own, across = (f"{math.degrees(angle):.{n}f}°" for angle, n in zip(self[1:4], (1, 0, 0), strict=True))
        start, blurred = f"{name}, {self.sphere}: {tilt}", 2 * self.step
        if self.one_sided > self.tilt - blurred:
            return f"{start}; a way from upright crosses no singularity."
        ends = []
        if self.crossing - self.one_sided >= blurred:
            ends.append(f"every way from upright beyond {own} crosses a Type 2 singularity")
        if self.crossing <= self.tilt - blurred or not ends:
            ends.append(f"beyond {across} the poses of the grid do not hang together with upright")
        return f"{start}; {', and '.join(ends)}."


def rows_of(quantity: str, name: str, setting: str, lean: Lean | None) -> tuple[Ours, Ours]:
    """A tilt of a machine, and how much of it is reached from upright on one side of every Type 2 singularity."""
    tilt, own = (None, None) if lean is None else (lean.tilt, lean.one_sided)
    return Ours(quantity, name, setting, tilt, "deg"), Ours(f"{quantity}, no singularity crossed", name, setting, own, "deg")


@dataclass(frozen=True)
class Leaning:
    """A machine that leans with its best roll."""

    machine: Machine
    """Without neutral axes of its own."""
    neutral: Reference
    bodies: bool
    """Whether bodies must stay apart."""
    step: float
    """Of the tilt, degrees; the tilt is refined between."""

    @cached_property
    def azimuths(self) -> int:
        """One where the machine turns about z and stays the same: all chains on full circles, and nothing on the ground."""
        is_round = all(_is_round(chain) for chain in self.machine.chains.values())
        return 1 if is_round and not self.machine.fixtures else AZIMUTHS

    def tilt(self, sphere: Sphere) -> float | None:
        """The tilt (rad) up to which every tilt is reached at every azimuth; None where home or the pole is not reached."""
        from trivet.reach.tilt import inside, refined, unbroken

        if self.looked is None:
            return None
        grid = self._grid(sphere)
        last = unbroken(inside(self.looked, grid).roll >= 0)
        return None if (last < 0).any() else float(refined(self.looked, grid, last).min())

    def lean(self, sphere: Sphere) -> Lean | None:
        """The tilt with what lies on the way there; None as for `tilt`."""
        tilt = self.tilt(sphere)
        if tilt is None:
            return None
        one_sided, crossing = (min(tilt, self.from_upright(sphere, crossing=is_crossed)) for is_crossed in (False, True))
        return Lean(sphere, tilt, one_sided, crossing, math.radians(self.step))

    def from_upright(self, sphere: Sphere, *, crossing: bool = False) -> float:
        """Greatest tilt of the grid (rad) to which ways lead from upright; zero where upright is not reached.

        Args:
            sphere: the sphere.
            crossing: whether ways may cross singularities.
        """
        import numpy as np

        from trivet.reach.tilt import inside, sides_of

        if self.looked is None:
            return 0.0
        grid = self._grid(sphere)
        reached = inside(self.looked, grid).inside
        sides = reached.astype(float) if crossing else sides_of(self.looked, grid, reached)
        return float(np.min(grid.tilts[_last(sides)]))

    @cached_property
    def looked(self) -> Looked | None:
        """How it is looked at; None where home is not reached, from which some neutral axes are taken."""
        from trivet.kinematics.mode import closed_form_signs
        from trivet.reach.neutral import with_neutral
        from trivet.reach.scene import scene_of
        from trivet.reach.tilt import Looked

        try:
            machine = with_neutral(self.machine, self.neutral)
        except NoResultError:
            return None
        scene = scene_of(machine, with_workpiece=False) if self.bodies else None
        return Looked(machine, closed_form_signs(machine, None), scene, None)

    def _grid(self, sphere: Sphere) -> Grid:
        from trivet.reach.tilt import Grid

        return Grid.of((0.0, 0.0, sphere.height), sphere.radius, self.azimuths, math.radians(self.step), MOST, ROLLS)


def _is_round(chain: Chain) -> bool:
    """Whether it stands on a full circle about z."""
    from trivet.model.elements import Curvilinear

    first = chain.elements[0]
    return isinstance(first, Curvilinear) and all(held is None for held in (chain.base, first.travel, first.locked))


def _last(sides: Any) -> Any:
    """(a,) the last tilt that hangs together with upright at any roll; takes sides (a, b, c), as for `hanging_together`."""
    import numpy as np

    from trivet.reach.tilt import hanging_together

    joined = np.zeros(sides.shape, dtype=bool)
    for roll in np.flatnonzero(sides[0, 0]):
        if not joined[0, 0, roll]:
            joined |= hanging_together(sides, int(roll))
    tilts: Any = joined.any(axis=2)
    return np.where(tilts.any(axis=1), tilts.shape[1] - 1 - tilts[:, ::-1].argmax(axis=1), 0)


def best_sphere(
    tilt: Callable[[Sphere], float | None],
    wanted: float,
    neutral: Reference,
    heights: tuple[float, ...],
    radii: tuple[float, ...],
) -> Sphere | None:
    """The sphere whose tilt is nearest to a wanted one; None for no tilt.

    It is sought on a grid, where the tilt passes the wanted one between two heights of it, and then by steps about the best of
    these, which are halved in turn. Along a jump of the tilt such steps alone would stick.

    Args:
        tilt: of a sphere, rad; None where its pole is not reached.
        wanted: rad.
        neutral: neutral axis.
        heights, radii: in order, m; what is found lies between the ends of both.
    """

    def missed(sphere: Sphere) -> float:
        value = tilt(sphere)
        return math.inf if value is None else abs(value - wanted)

    def around(of: Sphere, up: float, out: float) -> Iterator[Sphere]:
        for height, radius in ((up, 0.0), (-up, 0.0), (0.0, out), (0.0, -out)):
            height, radius = round(of.height + height, 9), round(of.radius + radius, 9)
            if heights[0] <= height <= heights[-1] and radii[0] <= radius <= radii[-1]:
                yield Sphere(neutral, height, radius)

    best = min((Sphere(neutral, h, r) for h in heights for r in radii), key=missed)
    if math.isinf(missed(best)):
        return None
    for sphere in _passing(tilt, wanted, neutral, heights, radii):
        if missed(best) <= NEAR:
            break
        best = min(best, sphere, key=missed)
    up, out = (max((b - a for a, b in pairwise(of)), default=0.0) for of in (heights, radii))
    for _ in range(HALVINGS):
        up, out = up / 2, out / 2
        while missed(best) > NEAR:
            near = min(around(best, up, out), key=missed, default=best)
            if not missed(near) < missed(best):
                break
            best = near
    return best


def _passing(
    tilt: Callable[[Sphere], float | None],
    wanted: float,
    neutral: Reference,
    heights: tuple[float, ...],
    radii: tuple[float, ...],
) -> Iterator[Sphere]:
    """Spheres where the tilt passes a wanted one, or jumps over it, between two heights; takes what `best_sphere` does."""

    def is_above(sphere: Sphere) -> bool:
        value = tilt(sphere)
        return value is not None and value >= wanted

    for radius, ends in product(radii, pairwise(heights)):
        low, high = (Sphere(neutral, height, radius) for height in ends)
        if is_above(low) is is_above(high):
            continue
        for _ in range(CUTS):
            middle = Sphere(neutral, round((low.height + high.height) / 2, 9), radius)
            low, high = (low, middle) if is_above(middle) is is_above(high) else (middle, high)
        yield from (low, high)
