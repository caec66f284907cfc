"""Workpiece materials whose cutting forces are published: `catalog/_cutting.toml`, units in it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources

from pydantic import TypeAdapter

from trivet.errors import InputError, nearest
from trivet.model.quantity import SpecificForce
from trivet.model.section import STRICT
from trivet.model.toml import parse_toml


@dataclass(frozen=True)
class CuttingMaterial:
    """Specific forces of a material, from cutting tests of somebody else."""

    __pydantic_config__ = STRICT

    tangential: SpecificForce
    """K_t: tangential force per chip thickness and depth of cut."""
    radial: SpecificForce
    """The same of the radial force, K_r K_t."""
    about: str
    """What was cut, and with what."""
    source: str
    """Where the numbers are published."""


@cache
def cutting_materials() -> dict[str, CuttingMaterial]:
    """All that trivet knows, by name."""
    data = resources.files("trivet.catalog").joinpath("_cutting.toml").read_bytes()
    return TypeAdapter(dict[str, CuttingMaterial]).validate_python(parse_toml("_cutting.toml", data, "a list of materials"))


def material_named(name: str) -> CuttingMaterial:
    """The material of a name.

    Raises:
        InputError: for a name that is not known, with the nearest.
    """
    known = cutting_materials()
    if name not in known:
        raise InputError(f"material '{name}': no cutting forces of it are known{nearest(name, known)}")
    return known[name]
