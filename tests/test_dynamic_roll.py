"""The roll of greatest dynamic stiffness, and the worst pose with it, against brute force."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from trivet.errors import InputError
from trivet.model import load
from trivet.space.family import Places, in_block, over_hemisphere
from trivet.study.atlas import atlas
from trivet.study.responses import Responses

ASKED = Responses.of(load("azulay").with_spherical("free"), None, ["yy"], "platform", 0.02, 20.0, 900.0)
ROLLS = np.arange(0, 2 * np.pi / 3, 2 * np.pi / 720)
"""After which the machine is the same again."""


def brute(places: Places) -> np.ndarray:
    """The greatest over many rolls of the least dynamic stiffness along y, place by place."""
    count = len(places.tilt)
    free = places.some(np.repeat(np.arange(count), len(ROLLS)))
    found = ASKED.stiffness(free._replace(roll=np.tile(ROLLS, count)))[0][:, 0]
    return np.nanmax(found.reshape(count, -1), axis=1)


def test_no_other_roll_is_stiffer() -> None:
    family = over_hemisphere(0.121, 0.004, 5)
    places = family.places(family.coordinates).some(np.array([3, 20, 40, 66]))
    told: list[int] = []
    policy = ASKED.roll_policy("best D_yy", progress=told.append)
    roll = policy.choose(ASKED.machine, places.surface("four"), ASKED.signs)
    own = ASKED.stiffness(places._replace(roll=roll))[0][:, 0]
    most = brute(places)
    assert np.all(own >= most * (1 - 1e-9))
    np.testing.assert_allclose(own, most, rtol=0.02)
    static = ASKED.roll_policy("best K_yy").choose(ASKED.machine, places.surface("four"), ASKED.signs)
    assert np.all(own >= ASKED.stiffness(places._replace(roll=static))[0][:, 0] * (1 - 1e-9))
    assert policy.name == "best D_yy"
    assert told == [4]


def test_where_no_roll_reaches() -> None:
    family = over_hemisphere(0.9, 0.004, 1)
    roll = ASKED.roll_policy("best D_yy").choose(ASKED.machine, family.places(family.coordinates).surface("far"), ASKED.signs)
    assert np.isnan(roll).all()


def test_worst_pose_with_the_best_roll() -> None:
    """Between the points of a line."""
    line = in_block((-0.0025, 0.0, 0.122), (0.003, 0.0, 0.0), (3, 1, 1), azimuth=1.2, tilt=0.3)
    found = atlas(ASKED.machine, line, entries=("zz",), roll="best D_zz", low=20.0, high=900.0, points=5)
    (worst,) = found.worst
    assert found.policy == "best D_zz"
    own = ASKED.along(["zz"])
    finer = in_block((-0.0025, 0.0, 0.122), (0.003, 0.0, 0.0), (60, 1, 1), azimuth=1.2, tilt=0.3)
    places = finer.places(finer.coordinates)
    roll = own.roll_policy("best D_zz").choose(own.machine, places.surface("line"), own.signs)
    least = own.stiffness(places._replace(roll=roll))[0].min()
    assert worst.stiffness < worst.on_grid * (1 - 1e-5)
    assert worst.stiffness <= least
    np.testing.assert_allclose(worst.stiffness, least, rtol=1e-4)
    assert -0.004 < worst.position[0] < -0.001
    place = Places(np.array([worst.position]), np.array([worst.azimuth]), np.array([worst.tilt]), np.array([worst.roll]))
    stiffest = own.roll_policy("best D_zz").choose(own.machine, place.surface("worst"), own.signs)
    np.testing.assert_allclose(worst.stiffness, own.stiffness(place)[0][0, 0], rtol=1e-12)
    np.testing.assert_allclose(worst.stiffness, own.stiffness(place._replace(roll=stiffest))[0][0, 0], rtol=1e-7)


def test_rolls_at_which_a_machine_is_the_same() -> None:
    """It is not where the platform's mass or the tool lie beside the axis, however alike the chains."""
    assert ASKED.roll_symmetry() == 3
    machine = ASKED.machine
    heavy = dataclasses.replace(machine, platform=dataclasses.replace(machine.platform, centre_of_mass=(0.001, 0.0, 0.0)))
    tool = dataclasses.replace(machine, platform=dataclasses.replace(machine.platform, tool_tip=(0.0, 0.001, 0.02)))
    straight = dataclasses.replace(machine, platform=dataclasses.replace(machine.platform, tool_tip=(0.0, 0.0, 0.02)))
    for own, point, symmetry in ((heavy, "platform", 1), (tool, "tool", 1), (straight, "tool", 3)):
        assert Responses.of(own, None, ["yy"], point, 0.02, 20.0, 900.0).roll_symmetry() == symmetry


@pytest.mark.parametrize(("roll", "rolls", "words"), [("best D_q", None, "q"), ("best D_xx", 4, "rolls: 4; between 8")])
def test_wrong_input(roll: str, rolls: int | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        ASKED.roll_policy(roll, rolls)
