"""A scene moved with the bodies of its machine is the scene drawn there."""

from __future__ import annotations

from importlib import resources

import jax
import numpy as np
import pytest
import trimesh

from trivet.kinematics.mode import parse_mode
from trivet.kinematics.standing import GROUND, PLATFORM, bodies, home_pose, starts
from trivet.model import load
from trivet.show.rig import rig
from trivet.show.scene import scene
from trivet.space.pose import moved

NAMES = sorted(
    file.name.removesuffix(".toml")
    for file in resources.files("trivet.catalog").iterdir()
    if file.name.endswith(".toml") and not file.name.startswith("_")
)


@pytest.mark.parametrize("name", NAMES)
def test_what_moves_with_the_bodies_is_what_is_drawn_there(name: str) -> None:
    machine = load(name)
    home, signs = jax.tree.map(float, home_pose(machine)), parse_mode(machine)
    drawn = scene(machine, home)
    moving = rig(drawn.shapes, bodies(machine, home, signs))
    kept = [k for k, shape in enumerate(drawn.shapes) if not shape.name.startswith("{")]  # triads are as large as the scene
    generator = np.random.default_rng(7)
    reach = 0.01 * float(np.ptp(np.concatenate([drawn.shapes[k].rings.reshape(-1, 3) for k in kept]), axis=0).max())
    for _ in range(3):
        there = moved(home, generator.uniform(-1, 1, 6) * ([reach] * 3 + [0.1] * 3))
        placed, wanted = moving.placed(bodies(machine, there, signs)), scene(machine, there).shapes
        for k in kept:
            own, shape = moving.shapes[k], wanted[k]
            assert own.name == shape.name
            for ours, theirs in ((own.start, shape.start), (own.end, shape.end)):
                at = placed.origin[k] + placed.axes[k] @ (ours * (1, 1, placed.stretch[k]))
                np.testing.assert_allclose(at, theirs, rtol=0, atol=1e-12)
            if shape.name == "platform":  # bars and pins may be turned about their axes
                rings = own.rings @ placed.axes[k].T + placed.origin[k]
                np.testing.assert_allclose(rings, shape.rings, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_shapes_are_closed_and_face_outwards(name: str) -> None:
    """The page draws one side of each face."""
    machine = load(name)
    for shape in scene(machine, jax.tree.map(float, home_pose(machine))).shapes:
        mesh = trimesh.Trimesh(*shape.mesh(), validate=True)  # without the faces that shrink to a line at tips
        faces = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]  # four where a guide goes round to its own end
        assert np.all(faces % 2 == 0), shape.name
        assert mesh.is_winding_consistent, shape.name
        assert mesh.volume > 0, shape.name


def test_bodies_of_a_pose_out_of_reach_have_no_place() -> None:
    machine = load("azulay")
    home = jax.tree.map(float, home_pose(machine))
    found = bodies(machine, moved(home, (0, 0, 1.0, 0, 0, 0)), parse_mode(machine))
    assert np.all(found.reach < 0)
    np.testing.assert_array_equal(found.frames[GROUND, 1:], np.eye(3))
    assert np.isfinite(found.frames[PLATFORM]).all()
    assert np.isnan(found.frames[starts(machine)[0] + 8]).any()
