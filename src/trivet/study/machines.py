"""Choosing machines: names, files, variants, and the switches of the static model."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence

from pydantic_core import PydanticCustomError

from trivet.errors import InputError, nearest
from trivet.model import Machine, load
from trivet.model.check import check
from trivet.model.elements import Drivable
from trivet.model.quantity import Quantity

MachineLike = Machine | str | os.PathLike[str]

LARGEST_ANGLE = 1e4
"""Angle (rad) of a pose above which its sine loses digits that matter."""

_ROTATIONAL = Quantity("rotational stiffness", "N m/rad", "N m/rad", positive=True)


def choose(machine: MachineLike, settings: Mapping[str, str] | None = None) -> Machine:
    """A machine as it is, by its name in the catalogue, or from a file.

    A name may carry settings of its own, "azulay@link.length=200 mm,workpiece.height=118 mm"; the machine then goes by that
    whole text in tables.
    """
    if isinstance(machine, Machine):
        return machine
    text = os.fspath(machine)
    name, _, own = text.partition("@")
    chosen = load(name, parse_settings(own.split(",") if own else []) | dict(settings or {}))
    return chosen.renamed(text) if own else chosen


def parse_settings(pairs: Iterable[str]) -> dict[str, str]:
    """Settings written as "key=value"."""
    settings: dict[str, str] = {}
    whole: list[str] = []
    for pair in pairs:
        # A comma within a value ("home.position=0 mm,0 mm,120 mm") does not begin another setting.
        if "=" not in pair and whole:
            whole[-1] += f",{pair}"
        else:
            whole.append(pair)
    for pair in whole:
        key, sign, value = (part.strip() for part in pair.partition("="))
        if not sign or not key or not value:
            raise InputError(f'setting "{pair}": expected KEY=VALUE, for example link.length="200 mm"')
        settings[key] = value
    return settings


def locked(machine: Machine, pairs: Iterable[str]) -> Machine:
    """A machine with joints locked as written, "leg-2.radial=30 mm" or, in every chain that has it, "radial=30 mm".

    Raises:
        InputError: for an unknown joint, or a value without or with a wrong unit.
    """
    joints = {f"{leg.name}.{e.name}": e for leg in machine.legs for e in leg.chain.elements if isinstance(e, Drivable)}
    joints |= {e.name: e for e in joints.values()}
    locks = {}
    for name, text in parse_settings(pairs).items():
        if name not in joints:
            raise InputError(f"lock {name}: {machine.name} has no such joint{nearest(name, joints)}")
        locks[name] = coordinate(f"lock {name}", joints[name], text)
    if not locks:
        return machine
    held = machine.with_locks(locks)
    check(held)
    return held


def coordinate(label: str, joint: Drivable, text: str) -> float:
    """A joint coordinate as written, "30 mm" or "5 deg", in m or rad; `label` begins the message of an error."""
    kind = Quantity("angle", "rad", "deg") if joint.is_angular else Quantity("length", "m", "mm")
    try:
        return kind.parse(text)
    except PydanticCustomError as error:
        raise InputError(f'{label} "{text}": {error.message()}') from None


def switched(
    machine: Machine,
    spherical: str | None = None,
    guide: str | None = None,
    shear: bool | None = None,
    drives: str | None = None,
) -> Machine:
    """A machine with switches of the model thrown; None leaves what the machine file says.

    Args:
        machine: the machine.
        spherical: "free", "clamped" or a rotational stiffness with its unit ("300 N m/rad").
        guide: how carriages on circular guides give way, "translation" or "rotation".
        shear: whether beams deflect in shear (Timoshenko) or not (Euler-Bernoulli).
        drives: "rigid", their actuators locked, or "as-described".
    """
    if spherical in ("free", "clamped"):
        machine = machine.with_spherical(spherical)  # type: ignore[arg-type]
    elif spherical is not None:
        try:
            machine = machine.with_spherical(_ROTATIONAL.parse(spherical))
        except ValueError as error:
            raise InputError(f'spherical "{spherical}": expected free, clamped or a stiffness; {error}') from None
    if guide is not None:
        if guide not in ("translation", "rotation"):
            raise InputError(f'guide "{guide}": expected translation or rotation')
        machine = machine.with_guide(guide)  # type: ignore[arg-type]
    if shear is not None:
        machine = machine.with_theory("timoshenko" if shear else "euler-bernoulli")
    if drives is not None:
        if drives not in ("rigid", "as-described"):
            raise InputError(f'drives "{drives}": expected rigid or as-described')
        machine = machine.with_rigid_drives() if drives == "rigid" else machine
    check(machine)
    return machine


def pose_numbers(
    machine: Machine,
    position: Sequence[float] | None = None,
    azimuth: float | None = None,
    tilt: float | None = None,
    roll: float | None = None,
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Platform centre in {O} (m) and alpha, beta, gamma (rad) of a pose; what is not given is as at home.

    Raises:
        InputError: for numbers that are not finite, or angles of many turns.
    """
    home = machine.home
    x, y, z, *more = (float(v) for v in (home.position if position is None else position))
    given = zip((azimuth, tilt, roll), (home.azimuth, home.tilt, home.roll), strict=True)
    alpha, beta, gamma = (float(default if value is None else value) for value, default in given)
    if more or not all(math.isfinite(v) for v in (x, y, z, alpha, beta, gamma)):
        raise InputError("the pose needs three finite coordinates and three finite angles")
    for angle in (alpha, beta, gamma):
        if abs(angle) > LARGEST_ANGLE:
            raise InputError(f"the pose has an angle of {angle:g} rad; give it within a few turns")
    return (x, y, z), (alpha, beta, gamma)
