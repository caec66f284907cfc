"""Slopes of a machine's poles with respect to its numbers, against differences of its modes."""

from __future__ import annotations

import numpy as np
import pytest

from trivet import Channel, Free, Functions, load
from trivet.measure.correlation import runs
from trivet.measure.machine.modes import modes_of, poles_of
from trivet.measure.machine.parameters import parameters
from trivet.measure.machine.setup import Setup, placed

CHANNELS = tuple(Channel(point, axis) for point in "12" for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))
POINTS = {"1": (0.0, -0.023, 0.135), "2": (0.02, 0.0115, 0.135)}
LOSSES = {
    # Damping in proportion to the stiffness, and in one kind of joint alone.
    "structural": {"ball.rotation": "elastic", "ball.stiffness": "400 N m/rad"},
    "dashpots": {"ball.rotation": "elastic", "ball.stiffness": "400 N m/rad", "ball.damping": "0.05 N m s/rad"},
    "own loss factor": {"slide.loss_factor": "0.2"},
}


@pytest.mark.parametrize("losses", LOSSES)
def test_slopes_of_poles_are_those_of_differences(losses: str) -> None:
    machine = load("azulay", LOSSES[losses])
    asked = Functions(
        np.array([100.0, 200.0]), np.zeros((6, 2), complex), ("acceleration",) * 6, CHANNELS, (CHANNELS[0],) * 6, POINTS
    )
    stood = placed(machine, Setup(others="platform"), asked)
    free = parameters(machine, [Free("slide.stiffness"), Free("link.length", 0.02), Free("home.position.3", 1e-3)], 0.02)
    theta = free.theta(free.start)

    def logarithms(theta: np.ndarray) -> np.ndarray:
        changed, loss = free.applied(machine, 0.02, theta)
        found = modes_of(stood, changed, float(loss), 700.0, CHANNELS)
        return np.log(np.concatenate([found.frequency[:8], found.damping[:8]]))

    found = modes_of(stood, machine, 0.02, 700.0, CHANNELS)
    assert [len(run) for run in runs(found.frequency[:8])].count(2) >= 2  # pairs of a machine of three equal legs
    poles = poles_of(stood, machine, 0.02, free, theta, found, np.arange(8))
    np.testing.assert_allclose(poles.values, logarithms(theta))
    for k, step in enumerate(1e-4 * free.spread):
        away = step * np.eye(3)[k]
        slopes = (logarithms(theta + away) - logarithms(theta - away)) / (2 * step)
        np.testing.assert_allclose(poles.slopes[:, k], slopes, rtol=1e-4, atol=1e-4 * np.abs(slopes).max())
