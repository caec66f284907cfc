"""Loop closure against the closed forms, and certified by the walk where there is none."""

from __future__ import annotations

import math
import re
from itertools import product

import numpy as np
import pytest
from machines import PAPER, random_stands, unlocked

from trivet.errors import InputError, NoResultError
from trivet.kinematics import closure
from trivet.kinematics.closure import Closure, close_chain, close_machine, end_frame
from trivet.kinematics.inverse import inverse
from trivet.kinematics.travel import within
from trivet.model import Leg, Machine, load
from trivet.model.elements import Element, Spherical
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

OPEN = ("tahmasebi", "rmmt", "gough-stewart")
MOST_TILT = {"tahmasebi": 0.15, "rmmt": 0.3, "gough-stewart": 0.2}
"""Greatest tilt, rad, of poses which the machines without a leg family reach."""


def _one(pose: Frame, index: int) -> Frame:
    return Frame(*(Vec(*(float(c[index]) for c in v)) for v in pose))


def _plain(element: Element, coordinate: object) -> tuple[float, ...]:
    """One coordinate of the closed forms as plain numbers."""
    if not element.COORDINATES:
        return ()
    if element.COORDINATES == ("length",):
        return (float(coordinate),)  # type: ignore[arg-type]
    return (math.atan2(float(coordinate.sin), float(coordinate.cos)),)  # type: ignore[attr-defined]


def _closed_form(leg: Leg, pose: Frame, signs: np.ndarray) -> dict[str, tuple[float, ...]]:
    """Coordinates of all joints but the last ball."""
    coordinates = inverse(leg, pose, signs).coordinates
    return {
        e.name: _plain(e, c) for e, c in zip(leg.chain.elements, coordinates, strict=True) if e.COORDINATES and c is not None
    }


def _apart(leg: Leg, a: dict[str, tuple[float, ...]], b: dict[str, tuple[float, ...]]) -> float:
    """Greatest difference of the coordinates that both name; angles modulo a turn."""
    kinds = {e.name: e.COORDINATES for e in leg.chain.elements}
    return max(
        abs(p - q if kind == "length" else math.remainder(p - q, 2 * math.pi))
        for name in a.keys() & b.keys()
        for kind, p, q in zip(kinds[name], a[name], b[name], strict=True)
    )


def _gap(leg: Leg, pose: Frame, found: Closure) -> float:
    """Distance (m) and turn (rad) between the end of the chain and its platform joint, by the walk."""
    end = end_frame(leg.chain.elements, leg.base_frame(), found.coordinates)
    target = pose.place(leg.platform_frame())
    return max(abs(float(p) - float(q)) for v, w in zip(end, target, strict=True) for p, q in zip(v, w, strict=True))


@pytest.mark.parametrize("name", PAPER)
def test_agrees_with_the_closed_form_in_every_mode(name: str) -> None:
    """Started beside the closed form of a random mode at a random pose, closure ends on it, and closes the orientation too."""
    machine = load(name)
    poses, signs = random_stands(machine, 12, seed=5)
    rng = np.random.default_rng(6)
    for index in range(12):
        pose = _one(poses, index)
        for leg, sign in zip(machine.legs, signs[..., index], strict=True):
            expected = _closed_form(leg, pose, sign)
            start = {key: tuple(v + rng.uniform(-1e-3, 1e-3) for v in values) for key, values in expected.items()}
            found = None
            # The closed forms leave the ball open; some of a few starts for its turns lead home.
            for turns in [(0.0, 0.0, 0.0), *rng.uniform(-math.pi, math.pi, (6, 3)).tolist()]:
                found = close_chain(leg, pose, start | {_ball(leg): tuple(turns)})
                if _apart(leg, found.numbers, expected) < 1e-9:
                    break
            assert found is not None
            assert _apart(leg, found.numbers, expected) < 1e-9
            assert found.inside == bool(within(leg, inverse(leg, pose, sign), pose))
            assert _gap(leg, pose, found) < 1e-12


def _ball(leg: Leg) -> str:
    return next(e.name for e in leg.chain.elements if isinstance(e, Spherical))


@pytest.mark.parametrize("name", PAPER)
def test_unguided_closure_is_one_of_the_modes(name: str) -> None:
    """Found without being told the mode, a closure is one of the closed forms, or a telescope drawn out backwards."""
    machine = load(name)
    poses, _ = random_stands(machine, 6, seed=8)
    for index in range(6):
        pose, leg = _one(poses, index), machine.legs[index % 3]
        found = close_chain(leg, pose)
        modes = [np.array(signs) for signs in product((1.0, -1.0), repeat=2)]
        nearest = min(_apart(leg, found.numbers, _closed_form(leg, pose, signs)) for signs in modes)
        assert nearest < 1e-9 or (name == "alizade" and found.numbers["telescope"][0] < 0)
        assert _gap(leg, pose, found) < 1e-12


def _poses(machine: Machine, count: int) -> list[Frame]:
    """Poses around home, tilted any way and turned by up to 0.1 rad."""
    rng = np.random.default_rng(11)
    found = []
    for _ in range(count):
        position = np.array(machine.home.position) + rng.uniform(-0.01, 0.01, 3)
        azimuth, tilt = rng.uniform(-np.pi, np.pi), rng.uniform(0, MOST_TILT[machine.name])
        found.append(zyz_frame(position, azimuth, tilt, rng.uniform(-0.1, 0.1) - azimuth))
    return found


@pytest.mark.parametrize("name", OPEN)
def test_chains_without_a_family_close_and_are_certified(name: str) -> None:
    machine = load(name)
    home = zyz_frame(machine.home.position, 0.0, 0.0, 0.0)
    for found in close_machine(machine, home):
        assert found.inside
    for pose in _poses(machine, 3):
        for leg, found in zip(machine.legs, close_machine(machine, pose), strict=True):
            assert found.residual < 1e-9
            assert found.inside
            assert _gap(leg, pose, found) < 1e-12


def test_hexapod_struts_are_as_long_as_the_distance() -> None:
    machine = load("gough-stewart")
    for pose in _poses(machine, 3):
        for leg, found in zip(machine.legs, close_machine(machine, pose), strict=True):
            foot, joint = leg.base_frame().origin, pose.place(leg.platform_frame()).origin
            assert found.numbers["strut"][0] == pytest.approx(math.dist(foot, joint), abs=1e-12)


def test_minimanipulator_feet_are_a_link_away_across_the_hinge() -> None:
    """The foot lies a link's length from the hinge, in the plane at right angles to the hinge's axis, on the base."""
    machine = load("tahmasebi")
    for pose in _poses(machine, 3):
        for leg, found in zip(machine.legs, close_machine(machine, pose), strict=True):
            base, joint = leg.base_frame(), pose.place(leg.platform_frame())
            foot = base.shift((found.numbers["slide-x"][0], found.numbers["slide-y"][0], 0.0)).origin
            link = joint.origin - foot
            assert math.sqrt(link @ link) == pytest.approx(0.150, abs=1e-12)
            assert float(link @ joint.y) == pytest.approx(0, abs=1e-12)


def test_redundant_chain_keeps_its_drives_nearest_to_the_start() -> None:
    """No neighbour among the closures (found by moving the guide a little and closing again) is nearer."""
    machine = unlocked()
    pose = _poses(machine, 1)[0]
    for leg in machine.legs:
        start = close_chain(leg, zyz_frame(machine.home.position, 0.0, 0.0, 0.0)).numbers
        found = close_chain(leg, pose, start).numbers
        size = math.dist(leg.base_frame().origin, pose.place(leg.platform_frame()).origin)
        for away in (-0.02, 0.02):
            # A start that lies in the direction of another guide angle pulls the solution there.
            neighbour = close_chain(leg, pose, found | {"guide": (found["guide"][0] + away,)}).numbers
            assert abs(neighbour["guide"][0] - found["guide"][0]) > 1e-4
            assert _moved(neighbour, start, size) > _moved(found, start, size)


def _moved(numbers: dict[str, tuple[float, ...]], start: dict[str, tuple[float, ...]], size: float) -> float:
    """Sum of squares by which the drives of the prototype have moved."""
    scales = {"guide": 1.0, "tangential": size, "radial": size}
    return sum(((numbers[d][0] - start[d][0]) / scale) ** 2 for d, scale in scales.items())


def test_out_of_reach_names_chain_and_gap() -> None:
    machine = load("azulay")
    far = zyz_frame((0.0, 0.0, 0.3), 0.0, 0.0, 0.0)
    with pytest.raises(NoResultError, match=r"^chains\.leg-2: .* gap of 84 mm remains$") as caught:
        close_chain(machine.legs[1], far)
    assert caught.value.exit_code == 1
    assert "\n" not in str(caught.value)


def test_start_that_does_not_fit() -> None:
    leg = load("azulay").legs[0]
    with pytest.raises(InputError, match=re.escape("guide (1), slide (1), hinge (1), ball (3)")):
        close_chain(leg, zyz_frame((0.0, 0.0, 0.125), 0.0, 0.0, 0.0), {"guide": (0.0,)})


def test_home_closes_in_the_mode_inside_the_travel() -> None:
    machine = load("azulay")
    home = zyz_frame(machine.home.position, 0.0, 0.0, 0.0)
    for leg, found in zip(machine.legs, close_machine(machine, home), strict=True):
        assert found.inside
        assert found.excess <= 0
        assert _apart(leg, found.numbers, _closed_form(leg, home, np.ones(2))) < 1e-9


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2), (2, 1)])
def test_inside_of_the_travel_is_preferred(order: tuple[int, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever start comes first: the mode inside the travel if there is one, else the one least outside."""
    machine = load("azulay")
    home, leg = zyz_frame(machine.home.position, 0.0, 0.0, 0.0), machine.legs[0]
    modes = [np.array((1.0, 1.0)), np.array((1.0, -1.0)), np.array((-1.0, -1.0))]
    starts = [close_chain(leg, home, _closed_form(leg, home, signs) | {"ball": (0.1, 0.2, 0.3)}) for signs in modes]
    assert [start.inside for start in starts] == [True, False, False]
    guesses = [np.array([v for values in starts[k].numbers.values() for v in values]) for k in order]
    monkeypatch.setattr(closure, "_guesses", lambda leg, pose: iter(guesses))
    expected = min((starts[k] for k in order), key=lambda start: max(start.excess, 0.0))
    assert _apart(leg, close_chain(leg, home).numbers, expected.numbers) < 1e-9
