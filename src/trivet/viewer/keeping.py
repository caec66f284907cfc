"""What a page keeps in the folder in which it was started: machines, pose, and scenes that play without Python."""

from __future__ import annotations

import re
from pathlib import Path

from trivet.errors import InputError, shown
from trivet.files import check_writable, replacing
from trivet.model import load, write
from trivet.study.posefile import PoseFile, read_pose, write_pose
from trivet.viewer.state import PoseNumbers, State, state_of

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,59}")
"""Of files: no folder, no suffix, nothing hidden."""


def name_of(machine: str) -> str:
    """A name for files of a machine: its own, as far as it can be one."""
    found = NAME.match(machine)
    return f"my-{found[0]}"[:60] if found else "machine"


def kept(folder: Path, name: str, suffix: str) -> Path:
    """A file in the folder.

    Raises:
        InputError: for a name that could mean a file elsewhere.
    """
    if not NAME.fullmatch(name):
        raise InputError(f"name {shown(name)}: expected up to 60 letters, digits, - and _, without a folder or a suffix")
    path = folder / f"{name}{suffix}"
    if path.is_symlink():
        raise InputError(f"{path.name}: is a link to another place; choose another name")
    return path


def _check_free(path: Path, overwrite: bool) -> None:
    if path.exists() and not overwrite:
        raise InputError(f"{path.name}: exists already; choose another name, or tick the box that lets files be replaced")
    check_writable(path, overwrite=overwrite)


def _files(folder: Path, name: str) -> tuple[Path, Path, Path]:
    """Of the machine, of the machine beside it, and of the pose."""
    return kept(folder, name, ".toml"), kept(folder, name, ".beside.toml"), kept(folder, name, ".pose.toml")


def save(state: State, folder: Path, name: str, overwrite: bool) -> list[Path]:
    """Write the machines and the pose; gives the files.

    Raises:
        InputError: for a name that is none, or files that exist unasked or cannot be written.
    """
    first, beside, pose = _files(folder, name)
    machines = [first, beside][: len(state.machines)]
    for path in (*machines, pose):
        _check_free(path, overwrite)
    for path, machine in zip(machines, state.machines, strict=True):
        write(machine, path, overwrite=overwrite)
    numbers = state.pose
    write_pose(PoseFile(numbers[:3], *numbers[3:], mode=state.modes[0]), pose, overwrite=overwrite)
    if len(machines) == 1 and overwrite:
        beside.unlink(missing_ok=True)  # of an earlier state: it would come back
    return [*machines, pose]


def restore(folder: Path, name: str) -> State:
    """The state that was saved under a name; a machine file without a pose is shown at home.

    Raises:
        InputError: for a name that is none, or files that are missing or wrong.
    """
    first, beside, pose = _files(folder, name)
    machines = [load(path) for path in (first, beside) if path == first or path.exists()]
    if not pose.exists():
        return state_of(machines, [None] * len(machines))
    found = read_pose(pose)
    modes = [found.mode or None, *(None for _ in machines[1:])]
    return state_of(machines, modes, PoseNumbers(*found.position, found.azimuth, found.tilt, found.roll))


def check_page(folder: Path, name: str, overwrite: bool) -> None:
    """Raise InputError, before the work, where `keep_page` would."""
    _check_free(kept(folder, name, ".html"), overwrite)


def keep_page(page: str, folder: Path, name: str, overwrite: bool) -> Path:
    """Write a scene as a page; gives the file.

    Raises:
        InputError: as for `save`.
    """
    path = kept(folder, name, ".html")
    with replacing(path, overwrite=overwrite) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return path
