"""Plans as labelled datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trivet.reach.touch import Touch
from trivet.results.netcdf import COMPONENTS, labelled
from trivet.study.cone import ConePlan
from trivet.study.plan import Plan, PlanStudy
from trivet.study.roll_grid import Along, Rules, met

if TYPE_CHECKING:
    import xarray as xr

Variables = dict[str, tuple[Any, ...]]
RATE = "per rad that the platform turns; on a path per move by the machine's size, where that is more"


def plan_datasets(study: PlanStudy) -> dict[str, xr.Dataset]:
    """One case each, by a name that says which."""
    return {f"{k + 1}-{plan.machine.name}": _plan(plan) for k, plan in enumerate(study.plans)}


def _plan(plan: Plan) -> xr.Dataset:
    grid, rows = plan.grid, ("row",)
    rolls = grid.path.roll[:, None] + grid.step * np.arange(grid.columns)
    value = np.where(np.isfinite(plan.field.value), plan.field.value, np.nan)
    meaning = f"{_aims(plan.rules)}; NaN where the pose is not allowed"
    variables: Variables = _touch("", rows, grid.path._replace(roll=rolls), ("row", "column")) | {
        "value": (("row", "column"), value, _unit(plan.rules), meaning),
        "side": (("row", "column"), plan.field.side.astype(np.int8), "1", "sign of det J_x, 0 where the pose is not allowed"),
        "radius": ((), plan.rules.radius, "m", "radius of the sphere; 0 where the platform touches none"),
    }
    coordinates: dict[str, Any] = {"axis": COMPONENTS[:3]}
    if grid.poses is not None:
        variables["pose"] = (rows, grid.poses, "1", "where the row is, counted in the given poses from 1")
    if plan.knots is not None and plan.along is not None and plan.drives is not None:
        drives, each = plan.drives, "angles over rad, lengths over m, in the order of drive_unit"
        variables |= _touch("knot_", ("knot",), plan.knots)
        variables |= _touch("sample_", ("sample",), plan.along.touch)
        variables |= _met("sample_", ("sample",), plan.rules, plan.along)
        variables |= {
            "knot_drive": (("knot", "drive"), drives.knots, "m or rad", f"coordinates of the drives at the knots; {each}"),
            "drive_rate": (
                ("between", "drive"),
                drives.rates,
                "m/rad or rad/rad",
                RATE,
            ),
            "drive_rate_row": (("between",), drives.rows, "1", "where that is, along the rows of the grid from 0"),
            "drive_unit": (("drive",), np.where(drives.is_angular, "rad", "m").astype(object), "1", "of its coordinate"),
        }
        coordinates["drive"] = list(drives.names)
    return labelled(plan.machine, variables, coordinates, stopped_by=plan.stopped_by, **_attributes(plan))


def cone_dataset(plan: ConePlan) -> xr.Dataset:
    """The rolls over a cone, at the nodes between which they are bilinear."""
    shape, rolls = ("azimuth", "tilt"), np.full(plan.knots.roll.shape, np.nan)
    variables: Variables = {
        "centre": (("axis",), [float(c[0, 0]) for c in plan.knots[:3]], "m", "centre of the sphere in {O}"),
        "radius": ((), plan.rules.radius, "m", "radius of the sphere"),
        "widest": ((), plan.largest, "rad", "tilt of the widest cone of this grid that has a continuous roll; NaN for none"),
    }
    if plan.is_possible:
        rolls = plan.knots.roll
        nodes = met(plan.rules, Touch(*(np.ravel(c) for c in plan.knots)), np.zeros(rolls.size))
        found = _met("", shape, plan.rules, nodes)
        variables |= {name: (*own[:1], np.reshape(own[1], rolls.shape), *own[2:]) for name, own in found.items()}
    variables["roll"] = (shape, rolls, "rad", "gamma of R = Rz(alpha) Ry(beta) Rz(gamma), bilinear between; NaN for none")
    coordinates = {"axis": COMPONENTS[:3], "azimuth": plan.knots.azimuth[:, 0], "tilt": plan.knots.tilt[0]}
    return labelled(plan.machine, variables, coordinates, **_attributes(plan))


def _touch(name: str, along: tuple[str, ...], touch: Touch, rolled: tuple[str, ...] | None = None) -> Variables:
    centre = np.stack(np.broadcast_arrays(*touch[:3]), axis=-1)
    return {
        f"{name}centre": ((*along, "axis"), centre, "m", "centre of the sphere in {O}; of radius 0 the platform centre"),
        f"{name}azimuth": (along, touch.azimuth, "rad", "alpha of R = Rz(alpha) Ry(beta) Rz(gamma)"),
        f"{name}tilt": (along, touch.tilt, "rad", "beta"),
        f"{name}roll": (rolled or along, touch.roll, "rad", "gamma"),
    }


def _met(name: str, along: tuple[str, ...], rules: Rules, found: Along) -> Variables:
    """What is met at poses."""
    variables: Variables = {
        f"{name}value": (along, found.value, _unit(rules), _aims(rules)),
        f"{name}sigma_min": (along, found.sigma_min, "1", "smallest singular value of J_x, moments over the platform's size"),
        f"{name}travel_margin": (along, found.travel, "1", "least of all joints, as a part of half their travel"),
    }
    if rules.scene is not None:
        variables[f"{name}clearance"] = (along, found.clearance, "m", "signed distance of the nearest bodies")
    return variables


def _unit(rules: Rules) -> str:
    (aim, *more) = rules.aims
    if more or aim.scalar is None or aim.unit != 1:
        return "1"
    return "N m/rad" if aim.scalar.is_rotational else "N/m"


def _aims(rules: Rules) -> str:
    parts = [aim.name + (f" over {aim.unit:g} (SI)" if aim.unit != 1 else "") for aim in rules.aims]
    return parts[0] if len(parts) == 1 else f"the least of {' and '.join(parts)}"


def _attributes(plan: Plan | ConePlan) -> dict[str, Any]:
    found = {
        "working_mode": plan.mode,
        "neutral": plan.neutral,
        "limits": int(plan.rules.limits),
        "bodies_apart": int(plan.rules.scene is not None),
        "possible": int(plan.is_possible),
        "verdict": plan.verdict,
    }
    return found | ({} if plan.proof is None else {"sigma_min_of_the_proof": plan.proof.demand.sigma_min})
