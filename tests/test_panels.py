"""Quotients of entire functions over panels, against sums of resonances and machines frequency by frequency."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import trivet
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.space.pose import zyz_frame
from trivet.vibration import panels, spectral
from trivet.vibration.directional import Asked, Entries
from trivet.vibration.panels import Blocks, Quotients, quotients

NATURAL = 2 * math.pi * np.array([110.0, 110.0, 111.0, 400.0, 900.0, 1500.0, 2200.0, 2210.0, 4000.0])
SHARES = np.array([1.0, 0.5, 2.0, 0.3, -0.7, 1.0, 2.0, -1.5, 3.0])


def resonances(omega: np.ndarray, loss: float) -> tuple[np.ndarray, np.ndarray]:
    """Values (1, 1, n) and denominators (1, n) of a sum of resonances, two of which coincide."""
    apart = NATURAL**2 * (1 + 1j * loss) - np.square(omega)[:, None]
    return (SHARES * NATURAL**2 / apart).sum(axis=1)[None, None], np.prod(apart / NATURAL**2, axis=1)[None]


def between(omega: np.ndarray, cuts: tuple[float, ...], loss: float, power: int = 2) -> tuple[np.ndarray, np.ndarray, Blocks]:
    """Values (n,) by interpolation, the doubt about blocks, and the blocks."""
    blocks = Blocks.of(omega, cuts, power)
    at_nodes = resonances(blocks.nodes.omega.ravel(), loss)
    found = quotients(*at_nodes, blocks.nodes, blocks.power, blocks.panel)
    return np.asarray(found.values)[0, 0, blocks.order], np.asarray(found.doubt), blocks


@pytest.mark.parametrize("power", [1, 2])
def test_resonances_that_coincide_and_lie_close(power: int) -> None:
    random = np.random.default_rng(1)
    omega = 2 * math.pi * random.permutation(np.r_[np.linspace(5.0, 3000.0, 600), np.geomspace(5.0, 3000.0, 371)])
    cuts = tuple(float(2 * math.pi * f) for f in (187.5, 375.0, 750.0, 1500.0))
    for loss, close in ((0.1, 1e-12), (0.02, 1e-11), (0.002, 1e-8)):
        found, doubt, _ = between(omega, cuts, loss, power)
        expected = resonances(omega, loss)[0][0, 0]
        assert np.abs(found - expected).max() < close * np.abs(expected).max()
        assert doubt.max() < 1e3 * close


def test_a_panel_that_is_too_wide_is_in_doubt_until_it_is_divided(monkeypatch: pytest.MonkeyPatch) -> None:
    """With few nodes, so that there is something to doubt; the doubt is no less than what is wrong."""
    monkeypatch.setattr(panels, "MACHINE_NODES", 9)
    omega = 2 * math.pi * np.linspace(5.0, 3000.0, 1000)
    cuts: tuple[float, ...] = ()
    expected = resonances(omega, 0.02)[0][0, 0]
    for _ in range(12):
        found, doubt, blocks = between(omega, cuts, 0.02)
        wrong = np.abs(found / expected - 1)
        in_block = np.full(blocks.power.size, 0.0)
        in_block[blocks.order] = np.where(np.abs(expected) > 0.1 * np.abs(expected).max(), wrong, 0.0)
        assert np.all(in_block.reshape(blocks.power.shape).max(axis=1) < 3 * doubt + 1e-12)
        if np.all(doubt < 1e-8):
            break
        cuts = (*cuts, *blocks.halves(doubt >= 1e-8))
    assert np.all(doubt < 1e-8)
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize("count", [1, 2, panels.BLOCK, panels.BLOCK + 1, 777])
def test_every_frequency_is_in_a_block_of_its_panel(count: int) -> None:
    omega = np.random.default_rng(count).uniform(10.0, 900.0, count)
    blocks = Blocks.of(omega, (5.0, 100.0, 100.1, 640.0, 2000.0), 2)
    np.testing.assert_array_equal(blocks.power.ravel()[blocks.order], omega**2)
    places = np.sqrt(blocks.power)
    edges = blocks.edges
    assert np.all(places >= edges[blocks.panel][:, None] * (1 - 1e-12))
    assert np.all(places <= edges[blocks.panel + 1][:, None] * (1 + 1e-12))
    assert len(np.unique(blocks.order)) == count


@pytest.mark.parametrize("name", ["azulay", "glozman"])
def test_a_machine_is_what_it_is_at_every_frequency(name: str) -> None:
    """At home, where resonances coincide in threes and twos, and beside; two dozen frequencies at a time are not interpolated
    between panels."""
    machine = load(name).with_spherical("free")
    home = np.array(machine.home.position)
    poses = zyz_frame(home + np.array([[0, 0, 0], [0.002, -0.001, 0.001]]), 0.0, np.array([0.0, 0.1]), 0.0)
    entries: Any = Entries.named([("x", "x"), ("z", "z"), ("x", "ry")])
    omega = 2 * math.pi * np.linspace(5.0, 3000.0, 1001)
    for loss, close in ((0.02, 1e-9), (0.002, 1e-8)):
        several = Asked.of(machine, poses, parse_mode(machine), entries, loss)
        rest = several.machine, several.poses, several.stand
        chosen = spectral.plan(*rest, float(omega[-1]))
        found, divided = spectral.solved(*rest, omega, loss, chosen, entries)
        assert len(omega) > panels.MACHINE_NODES * (len(divided.cuts) + 2), "between panels"
        some = np.arange(0, len(omega), 50)
        expected = np.concatenate(
            [np.asarray(spectral.kernel(*rest, omega[part], loss, chosen, entries)) for part in (some[:11], some[11:])], axis=-1
        )
        wrong = np.abs(np.asarray(found)[..., some] - expected).max(axis=-1)
        assert np.all(wrong < close * np.abs(np.asarray(found)).max(axis=-1))


def some_rounds(monkeypatch: pytest.MonkeyPatch) -> list[Quotients]:
    """What is interpolated between nodes from now on; more often than a few times is a failure."""
    rounds: list[Quotients] = []

    def counted(*args: Any) -> Quotients:
        assert len(rounds) < 4
        rounds.append(quotients(*args))
        return rounds[-1]

    monkeypatch.setattr(spectral, "quotients", counted)
    return rounds


def directly(machine: Any, frequency: np.ndarray, loss: float) -> np.ndarray:
    """Receptances (n, 6, 6) at home, at frequencies that are the nodes themselves."""
    at, signs = zyz_frame(np.array(machine.home.position), 0.0, 0.0, 0.0), parse_mode(machine)
    parts = [frequency[start : start + 24] for start in range(0, len(frequency), 24)]
    return np.concatenate([np.asarray(spectral.receptance(machine, at, signs, part, loss)) for part in parts])


def relative_error(found: np.ndarray, expected: np.ndarray) -> float:
    """Of receptances (n, 6, 6), against those of a load and its own displacement at that frequency."""
    own = np.sqrt(np.abs(np.diagonal(expected, axis1=-2, axis2=-1)))
    return float((np.abs(found - expected) / (own[:, :, None] * own[:, None, :])).max())


def test_natural_frequencies_of_a_machine_without_damping(monkeypatch: pytest.MonkeyPatch) -> None:
    """No panel is so narrow that a denominator could be told from nought there; beside them all is as it should be."""
    rounds = some_rounds(monkeypatch)
    found = trivet.frf("azulay", loss_factor=0, points=1200)
    assert rounds
    assert np.asarray(rounds[-1].doubt).max() > spectral.DOUBT
    apart = np.abs(found.frequency[:, None] / found.natural - 1).min(axis=1)
    places = np.nonzero(apart > 1e-3)[0][::25]
    expected = directly(load("azulay"), found.frequency[places], 0.0)
    assert relative_error(found.receptance[places], expected) < 1e-7


@pytest.mark.parametrize("loss", [0.0, 0.02])
def test_equal_frequencies(monkeypatch: pytest.MonkeyPatch, loss: float) -> None:
    """On a resonance, where there is nothing to divide."""
    machine = load("azulay")
    natural = trivet.frf("azulay", loss_factor=0, points=50).natural[0]
    some_rounds(monkeypatch)
    at, signs = zyz_frame(np.array(machine.home.position), 0.0, 0.0, 0.0), parse_mode(machine)
    found = np.asarray(spectral.receptance(machine, at, signs, np.full(201, natural), loss))
    assert found.shape == (201, 6, 6)
    if loss:
        assert relative_error(found, directly(machine, np.array([natural]), loss)) < 1e-9


def test_doubt_ends_where_each_frequency_is_worked_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of few nodes, in a number that fills nothing, and with doubt about everything: the panels are not kept."""
    monkeypatch.setattr(panels, "MACHINE_NODES", 7)
    monkeypatch.setattr(spectral, "DOUBT", 0.0)
    some_rounds(monkeypatch)
    rest, omega, chosen = at_home("azulay")
    entries: Any = Entries.named([("z", "z")])
    found, divided = spectral.solved(*rest, omega, 0.02, chosen, entries)
    expected = np.concatenate([spectral.kernel(*rest, part, 0.02, chosen, entries) for part in np.split(omega, 20)], axis=-1)
    assert np.all(np.abs(found - expected) < 1e-9 * np.abs(expected).max())
    assert divided.direct


def test_a_steep_panel_is_sampled_with_damping_once_it_is_divided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spectral, "LEAST", math.inf)
    rest, omega, chosen = at_home("azulay")
    assert chosen.is_real
    entries: Any = Entries.named([("z", "z")])
    found, divided = spectral.solved(*rest, omega, 0.02, chosen, entries)
    expected = np.concatenate([spectral.kernel(*rest, part, 0.02, chosen, entries) for part in np.split(omega, 20)], axis=-1)
    assert np.all(np.abs(found - expected) < 1e-9 * np.abs(expected).max())
    assert len(divided.edges) > 1
    assert not divided.is_real


def at_home(name: str) -> tuple[Any, np.ndarray, spectral.Plan]:
    """Machine, pose and stand; 480 frequencies, and how to cover them."""
    machine = load(name)
    omega = 2 * math.pi * np.linspace(5.0, 2000.0, 480)
    home = zyz_frame(np.array(machine.home.position), 0.0, 0.0, np.zeros(1))
    several = Asked.of(machine, home, parse_mode(machine), Entries.named([("z", "z")]), 0.02)
    rest = several.machine, several.poses, several.stand
    return rest, omega, spectral.plan(*rest, float(omega[-1]))
