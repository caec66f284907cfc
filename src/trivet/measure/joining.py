"""Measured responses of several files as one set: on one axis of frequencies, with the points of all."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from trivet.errors import InputError
from trivet.measure.checking import check_functions
from trivet.measure.functions import Functions
from trivet.measure.imported import LISTED, Content, Imported, Measured

ALIKE = 1e-5
"""Up to which, against each other, two frequencies are the same: what six digits leave open."""


def joined(contents: Sequence[Content], least_coherence: float | None = None) -> Imported:
    """All functions of some files, those that were measured several times as their mean.

    Raises:
        InputError: for the same file twice, functions on different frequencies, a point at two places, and whatever is no
            measured response.
    """
    _check_paths([content.path for content in contents])
    measured = [one for content in contents for one in content.functions]
    if not measured:
        raise InputError(_nothing(contents))
    for one in measured[1:]:
        apart = first_difference(measured[0].frequency, one.frequency)
        if apart is not None:
            raise InputError(f"{measured[0].title} and {one.title} are on different frequencies: {apart}; give them apart")
    whole = Functions(
        measured[0].frequency,
        np.array([one.values for one in measured]),
        tuple(one.motion for one in measured),
        tuple(one.response for one in measured),
        tuple(one.reference for one in measured),
        _points(contents),
        _coherence(measured),
        "; ".join(content.source for content in contents if content.source),
    )
    check_functions(whole, ", ".join(dict.fromkeys(content.path for content in contents if content.functions)))
    once = whole.averaged()
    return Imported(
        once,
        tuple(", ".join(dict.fromkeys(measured[k].unit for k in own)) for own in whole.alike),
        tuple(mode for content in contents for mode in content.modes),
        tuple(_again(whole, once, measured)),
        tuple(one for content in contents for one in content.unused),
        least_coherence,
    )


def first_difference(one: np.ndarray, other: np.ndarray) -> str | None:
    """Where two axes differ, in words; None where they are alike."""
    if one is other:
        return None
    n = min(len(one), len(other))
    apart = np.flatnonzero(np.abs(one[:n] - other[:n]) > ALIKE * np.maximum(one[:n], other[:n]))
    if len(apart):
        k = int(apart[0])
        return f"line {k + 1} is at {one[k]:.9g} Hz and at {other[k]:.9g} Hz"
    return None if len(one) == len(other) else f"they have {len(one)} and {len(other)} lines"


def is_at(one: Sequence[float] | np.ndarray, other: Sequence[float] | np.ndarray) -> bool:
    """Whether two positions (3,) in m are the same, as far as six digits say."""
    return bool(np.allclose(one, other, rtol=1e-5, atol=1e-9))


def _check_paths(paths: Sequence[str]) -> None:
    known: dict[str, str] = {}
    for path in paths:
        real = os.path.realpath(path)
        if real in known:
            name = "" if path == known[real] else f", as {known[real]} before"
            raise InputError(f"{path}: is given twice{name}; give every file once")
        known[real] = path


def _nothing(contents: Sequence[Content]) -> str:
    """What is said of files without any function."""
    kinds = dict.fromkeys(one.what for content in contents for one in content.unused)
    modes = sum(len(content.modes) for content in contents)
    rest = ", ".join([*kinds, *([f"{modes} modes"] if modes else [])])
    names = ", ".join(content.path for content in contents)
    return f"{names}: no frequency response function (type 58, function type 4); found: {rest or 'nothing else'}"


def _points(contents: Sequence[Content]) -> dict[str, tuple[float, float, float]]:
    points: dict[str, tuple[float, float, float]] = {}
    for content in contents:
        for point, at in content.points.items():
            if not is_at(points.setdefault(point, at), at):
                before = list(points[point])
                raise InputError(f"{content.path}: point {point} is at {list(at)} m, at {before} m in another file")
    return points


def _coherence(measured: Sequence[Measured]) -> np.ndarray | None:
    if all(one.coherence is None for one in measured):
        return None
    none = np.full(len(measured[0].frequency), np.nan)
    return np.array([none if one.coherence is None else one.coherence for one in measured])


def _again(whole: Functions, once: Functions, measured: Sequence[Measured]) -> list[str]:
    """What is said of functions that were measured more than once."""
    notes: list[str] = []
    for mean, label, own in zip(once.values, once.labels, whole.alike, strict=True):
        if len(own) > 1:
            apart = max(np.linalg.norm(whole.values[k] - mean) for k in own) / max(float(np.linalg.norm(mean)), 1e-300)
            where = " and ".join([measured[k].title for k in own[:2]]) + (" and others" if len(own) > 2 else "")
            times = "twice" if len(own) == 2 else f"{len(own)} times"
            notes.append(f"{label} is measured {times}, in {where}: the mean is taken, from which they differ by {apart:.2%}")
    more = len(notes) - LISTED
    return notes if more <= 0 else [*notes[:LISTED], f"{more} functions more are measured several times: their means are taken"]
