"""Pose files: a pose and a working mode (TOML, with units)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import StringConstraints, TypeAdapter

from trivet.files import replacing
from trivet.model.checked import read_checked
from trivet.model.quantity import AngleValue, Length
from trivet.model.section import STRICT


@dataclass(frozen=True)
class PoseFile:
    """A pose of a platform; angles that are not given are zero."""

    __pydantic_config__ = STRICT

    position: tuple[Length, Length, Length]
    """Platform centre in {O}."""
    azimuth: AngleValue = 0.0
    tilt: AngleValue = 0.0
    roll: AngleValue = 0.0
    mode: Annotated[str, StringConstraints(pattern=r"^[+\- ]*$", max_length=100)] = ""
    """Working mode; the machine's own when not given."""
    format: Literal[1] = 1
    """Version of the file format."""


def read_pose(path: str | os.PathLike[str]) -> PoseFile:
    """Read a pose file.

    Raises:
        InputError: with the key, the value and what was expected.
    """
    return read_checked(path, PoseFile, "a pose file", {"position": "a pose has three coordinates"})


def write_pose(pose: PoseFile, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a pose file; it appears whole or not at all.

    Raises:
        InputError: when the file exists (unless `overwrite`), or cannot be written.
    """
    document: dict[str, Any] = TypeAdapter(PoseFile).dump_python(pose)
    with replacing(path, overwrite=overwrite) as temporary:
        temporary.write_text(tomli_w.dumps({k: v for k, v in document.items() if v != ""}), encoding="utf-8")
