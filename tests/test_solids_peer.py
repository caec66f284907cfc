"""Vibration of beams against CalculiX, in which the same machine is made of solid bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from solid_model import Mesh, Model, Tripod, frequencies, frequency_deck, frf_deck, response, run

from trivet.kinematics.mode import parse_mode
from trivet.model import Machine, load
from trivet.space.pose import zyz_frame
from trivet.statics.structure import structural_stiffness
from trivet.vibration.modes import modes

calculix = pytest.mark.peer("CalculiX", program="ccx")

COUNT = 12
MESH, FINER = Mesh(1, 12, 2, 14), Mesh(1, 16, 4, 28)
HOME = zyz_frame((0.0, 0.0, Tripod().height), 0.0, 0.0, 0.0)


def machine_of_beams() -> Machine:
    return load("azulay").with_spherical("free").with_theory("timoshenko").with_rigid_drives()


@pytest.fixture(scope="module")
def solids(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """Natural frequencies of the solid machine, Hz."""
    return frequencies(run(frequency_deck(Model(Tripod(), MESH), COUNT), tmp_path_factory.mktemp("solids")))


@calculix
def test_frequencies(solids: np.ndarray) -> None:
    np.testing.assert_allclose(frequencies_of_beams(), solids, rtol=2e-3)


@calculix
def test_mesh_is_fine_enough(solids: np.ndarray, tmp_path: Path) -> None:
    finer = frequencies(run(frequency_deck(Model(Tripod(), FINER), COUNT), tmp_path))
    np.testing.assert_allclose(solids, finer, rtol=3e-4)


@calculix
def test_slow_loads_find_the_compliance(tmp_path: Path) -> None:
    """Far below the first mode; what higher modes yield is missing: much in z, little in other directions."""
    machine = machine_of_beams()
    found = response(run(frf_deck(Model(Tripod(), MESH), COUNT, damping=0.01, low=1.0, high=2.0, points=2), tmp_path))[1][0]
    static = np.linalg.inv(structural_stiffness(machine, HOME, parse_mode(machine)))
    scale = np.sqrt(np.diag(static))
    off = np.abs(found - static) / np.outer(scale, scale)
    off[2, 2] = 0
    assert off.max() < 3e-3


def frequencies_of_beams() -> np.ndarray:
    """Natural frequencies of the same machine made of Timoshenko beams, Hz."""
    machine = machine_of_beams()
    return modes(machine, HOME, parse_mode(machine), count=COUNT).frequency
