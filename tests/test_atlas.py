"""Atlases of frequency responses against single poses, and the worst pose against brute force."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trivet
from trivet.errors import InputError, NoResultError
from trivet.model import load
from trivet.space.family import along, in_block, over_hemisphere
from trivet.study.atlas import Atlas, atlas
from trivet.views.atlas import as_json, tables

LOW, HIGH = 20.0, 900.0


@pytest.fixture(scope="module")
def small() -> Atlas:
    return atlas("azulay", over_hemisphere(0.121, 0.004, 3), entries=("xx", "zz", "x_ry"), low=LOW, high=HIGH, points=300)


def test_a_pose_beyond_a_travel_is_not_reached() -> None:
    """At 20 mm the chains close, but the slides would be out by more than 65 mm."""
    found = atlas("azulay", in_block((0, 0, 0.07), (0, 0, 0.1), (1, 1, 1)), roll=0.0, low=LOW, high=HIGH, points=5)
    assert found.places.position[:, 2].tolist() == pytest.approx([0.02, 0.12])
    assert found.used.tolist() == [False, True]
    assert found.worst[0].position[2] > 0.04
    ((_, values),) = found.receptances()
    assert np.isfinite(values).all(axis=(1, 2)).tolist() == [False, True]


def test_places_of_families_are_their_grids() -> None:
    hemisphere = over_hemisphere(0.121, 0.004, 10)
    there, points = hemisphere.places(hemisphere.coordinates), trivet.hemisphere(0.121, 0.004, 10)
    assert len(hemisphere) == 317
    np.testing.assert_allclose(there.position, points.position, atol=1e-10)
    np.testing.assert_allclose(there.tilt, points.tilt, atol=1e-6)
    assert np.isnan(hemisphere.places(np.array([[0.0041, 0.0]])).position).all()
    block = in_block((0.0, 0.0, 0.125), (0.004, 0.002, 0.0), (4, 2, 1), azimuth=0.3, tilt=0.1)
    assert block.coordinates.shape == (15, 2)
    assert block.places(block.coordinates).position[:, 2].tolist() == [0.125] * 15
    np.testing.assert_allclose(block.spacing, [0.001, 0.001])
    assert np.isnan(block.places(np.array([[0.003, 0.0]])).position).all()
    outside = np.array([[0.003, 0.004], [0.0, -0.009], [0.001, 0.001]])
    np.testing.assert_allclose(hemisphere.nearest(outside), [[0.0024, 0.0032], [0, -0.004], [0.001, 0.001]], atol=1e-15)
    np.testing.assert_allclose(block.nearest(outside), [[0.002, 0.001], [0, -0.001], [0.001, 0.001]], atol=1e-15)
    assert np.isfinite(hemisphere.places(hemisphere.nearest(outside)).position).all()
    with pytest.raises(InputError, match="steps along y"):
        in_block((0, 0, 0), (1, 1, 1), (1, 0, 1))
    with pytest.raises(InputError, match="more than"):
        in_block((0, 0, 0), (1, 1, 1), (10_000, 10_000, 1))
    with pytest.raises(InputError, match="below zero"):
        in_block((0, 0, 0), (1, -1, 1), (1, 1, 1))


def test_atlas_against_single_poses(small: Atlas) -> None:
    found = np.concatenate([values for _, values in small.receptances()])
    assert small.used.all()
    assert small.places.roll is not None
    for k in (0, 7, len(small.family) - 1):
        place = [float(x) for x in small.places.position[k]]
        angles = [float(a[k]) for a in (small.places.azimuth, small.places.tilt, small.places.roll)]
        one = trivet.frf("azulay", place, *angles, low=LOW, high=HIGH, points=300, anyway=True)
        wanted = np.searchsorted(one.frequency, small.frequency)
        for entry, values in zip(small.entries, found[k], strict=True):
            expected = one.entry(entry)[wanted]
            assert np.abs(values - expected).max() < 1e-8 * np.abs(expected).max()
        for direction, column in (("x", 0), ("z", 1)):
            minimum = next(m for m in one.minima if m.direction == direction)
            np.testing.assert_allclose(small.stiffness[k, column], minimum.stiffness, rtol=1e-7)
            np.testing.assert_allclose(small.at_frequency[k, column], minimum.frequency, rtol=1e-5)
    np.testing.assert_allclose(small.greatest, np.abs(found).max(axis=0), rtol=1e-12)
    np.testing.assert_allclose(small.least, np.abs(found).min(axis=0), rtol=1e-12)


def test_worst_pose_by_brute_force(small: Atlas) -> None:
    fine = atlas("azulay", over_hemisphere(0.121, 0.004, 40), entries=("xx", "zz"), low=LOW, high=HIGH, points=2)
    for name in ("xx", "zz"):
        column = small.entries.index(name)
        worst, brute = small.worst[column], np.nanmin(fine.stiffness[:, ("xx", "zz").index(name)])
        assert worst.entry == name
        assert worst.on_grid == np.nanmin(small.stiffness[:, column])
        assert worst.stiffness <= worst.on_grid
        assert worst.stiffness <= brute * (1 + 1e-9)
        # Not closer: with the statically best roll both roll and carriages jump, and the least is a limit at an edge.
        np.testing.assert_allclose(worst.stiffness, fine.worst[("xx", "zz").index(name)].stiffness, rtol=0.02)
        one = trivet.frf(
            "azulay", worst.position, worst.azimuth, worst.tilt, worst.roll, low=LOW, high=HIGH, points=50, anyway=True
        )
        minimum = next(m for m in one.minima if m.direction == name[0])
        np.testing.assert_allclose((worst.stiffness, worst.frequency), (minimum.stiffness, minimum.frequency), rtol=1e-5)


@pytest.mark.parametrize(("name", "height"), [("azulay", 0.121), ("alizade", 0.157)])
def test_worst_pose_does_not_depend_on_the_grid(name: str, height: float) -> None:
    """A ring of soft poses along a singular curve, narrow and nearly level."""
    machine = load(name).with_spherical("free")
    found = [
        atlas(machine, over_hemisphere(height, 0.004, steps), entries=("xx",), roll="-alpha", low=LOW, high=HIGH, points=2)
        for steps in (3, 5)
    ]
    coarse, fine = (one.worst[0].stiffness for one in found)
    np.testing.assert_allclose(coarse, fine, rtol=1e-4)
    assert max(coarse, fine) <= min(np.nanmin(one.stiffness) for one in found)


def test_along_a_path_rolls_are_given() -> None:
    def pose_at(s: np.ndarray) -> np.ndarray:
        return np.stack([0.003 * s, 0 * s, 0.125 + 0 * s, 0 * s, 0.1 * s, 0.2 * s], axis=1)

    found = atlas("azulay", along("move", pose_at, 1.0, 5), entries=("yy",), low=LOW, high=HIGH, points=10)
    assert found.policy == "as given"
    assert found.places.roll is not None
    np.testing.assert_allclose(found.places.roll, 0.2 * np.linspace(0, 1, 5))
    assert found.worst[0].stiffness <= found.stiffness.min()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"low": 50.0, "high": 20.0}, "rises from above"),
        ({"points": 1}, "at least 2"),
        ({"entries": ()}, "none"),
        ({"entries": ("xq",)}, "xq"),
        ({"point": "tool"}, "has no platform.tool_tip"),
        ({"point": "elbow"}, "platform"),
        ({"loss_factor": -0.1}, "loss factor"),
        ({"loss_factor": 0.0}, "damping"),
        ({"roll": "worst"}, "worst"),
        ({"mode": "+"}, "mode"),
    ],
)
def test_wrong_input(change: dict[str, Any], words: str) -> None:
    given = {"family": over_hemisphere(0.121, 0.004, 1), "low": LOW, "high": HIGH, "points": 5} | change
    with pytest.raises(InputError, match=words):
        atlas("azulay", **given)


def test_no_pose_is_reached() -> None:
    with pytest.raises(NoResultError, match="no pose of the hemisphere of 4 mm is reached"):
        atlas("azulay", over_hemisphere(0.9, 0.004, 1), low=LOW, high=HIGH, points=5)
    part = atlas("azulay", in_block((0, 0, 0.17), (0, 0, 0.12), (1, 1, 3)), roll=0.0, low=LOW, high=HIGH, points=5)
    assert part.used.tolist() != [True] * 4
    assert np.isnan(part.stiffness[~part.used]).all()
    assert np.isfinite(part.worst[0].stiffness)


def test_poses_do_not_add_to_what_is_kept(small: Atlas) -> None:
    kept = sum(
        np.asarray(getattr(small, field.name)).nbytes
        for field in dataclasses.fields(small)
        if field.name in ("stiffness", "at_frequency", "least", "greatest")
    )
    n, k, f = len(small.family), len(small.entries), len(small.frequency)
    assert kept == 8 * (2 * n * k + 2 * k * f)


def test_the_workpiece_by_default() -> None:
    machine = load("azulay")
    bare = dataclasses.replace(machine, workpiece=None)
    with pytest.raises(InputError, match="workpiece"):
        atlas(bare, low=LOW, high=HIGH, points=5)


def test_entries_that_symmetry_makes_nought_are_unbounded(tmp_path: Path) -> None:
    line = in_block((0.0002, 0, 0.125), (0.0004, 0, 0), (1, 1, 1))
    entries = ("xx", "xy")
    asked: dict[str, Any] = {"roll": 0.0, "entries": entries, "low": 300.0, "high": 700.0, "points": 50, "search": False}
    kept = atlas("azulay", line, **asked)  # the plane y = 0 is one of symmetry
    assert kept.used.all()
    assert np.all(np.isinf(kept.stiffness) == [False, True])
    assert np.all(np.isnan(kept.at_frequency) == [False, True])
    aside = atlas("azulay", in_block((0, 1e-12, 0.125), (0.0004, 0, 0), (1, 1, 1)), **asked)
    assert np.isfinite(aside.stiffness).all(), "a picometre beside it the response is small, not rounding"
    assert aside.stiffness[0, 1] > 1e8 * aside.stiffness[0, 0]
    worst = kept.worst[1]
    assert (worst.stiffness, math.isnan(worst.frequency)) == (math.inf, True)
    shown = [part for part in tables(kept) if isinstance(part, str)]
    assert any("xy: unbounded where the motion" in text for text in shown)
    assert as_json(kept)["least_stiffness_SI"]["xy"] == [None] * len(line)
    for name in ("one.png", "one.html"):
        trivet.figure(kept, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 10_000
