"""Machines and poses that several tests use."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from trivet.kinematics.inverse import branches, inverse
from trivet.kinematics.jacobian import actuator_names
from trivet.model import Machine, document_of, load, parse
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

PAPER = ("azulay", "eclipse", "alizade", "glozman")
STATIC_CASES = json.loads((Path(__file__).parent / "data" / "static.json").read_text())["cases"]
# Our name of each machine, and of its second actuated joint.
_REFERENCE = {
    "proposed": ("azulay", "slide"),
    "eclipse": ("eclipse", "column"),
    "alizade": ("alizade", "telescope"),
    "glozman": ("glozman", "shoulder"),
}


def reference_machine(case: dict[str, Any]) -> Machine:
    """The machine of a case of static.json."""
    p = case["params"]
    name, second = _REFERENCE[case["mechanism"]]
    lengths = {"L": "link.length", "L1": "link-1.length", "L2": "link-2.length"}
    settings = {
        "materials.steel.youngs_modulus": f"{p['E']} MPa",
        "poisson_ratio": p["nu"],
        "outer_diameter": f"{p['do']} mm",
        "inner_diameter": f"{p['di']} mm",
        "guide.radius": f"{p['Rb']} mm",
        "platform_joint.radius": f"{p['Rp']} mm",
        "guide.stiffness": f"{p['ka']} N/mm",
        "guide.yields": {"trans": "translation", "rot": "rotation"}[p["tang"]],
        f"{second}.stiffness": f"{p['krev'] * 1e-3} N m/rad" if "krev" in p else f"{p['ka']} N/mm",
    } | {key: f"{p[short]} mm" for short, key in lengths.items() if short in p}
    return load(name, settings)


def reference_pose(case: dict[str, Any]) -> Frame:
    """The pose of a case of static.json."""
    columns = np.array(case["pose"]["R"]).T
    return Frame(Vec(*np.array(case["pose"]["c"]) * 1e-3), *(Vec(*c) for c in columns))


def reference_stiffness(case: dict[str, Any], key: str) -> np.ndarray:
    """A stiffness of static.json (N/mm, N/rad, N mm/rad) in SI."""
    force = np.r_[np.ones(3), np.full(3, 1e-3)]  # N mm to N m
    motion = np.r_[np.full(3, 1e3), np.ones(3)]  # per mm to per m
    return np.array(case[key]) * force[:, None] * motion


def difference(machine: Machine, found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Relative Frobenius distance (...) of stiffnesses (..., 6, 6), rotations scaled by the platform's radius."""
    scale = np.r_[np.ones(3), np.full(3, 1 / float(machine.characteristic_length))]
    weight = scale[:, None] * scale
    return np.linalg.norm((found - expected) * weight, axis=(-2, -1)) / np.linalg.norm(expected * weight, axis=(-2, -1))


def bracketed() -> Machine:
    """The paper's machine with a rigid bracket of 0.2 kg on the carriage, and a platform with its mass off centre."""
    document = document_of(load("azulay"))
    bracket = {"name": "bracket", "type": "offset", "vector": ["5 mm", "0 mm", "3 mm"], "mass": "0.2 kg"}
    document["chains"]["leg"]["elements"].insert(1, bracket)
    document["platform"] = {"mass": "0.5 kg", "centre_of_mass": ["3 mm", "-2 mm", "20 mm"]}
    return parse(document)


def unlocked() -> Machine:
    """The redundant prototype with all nine drives free: chains of seven freedoms, which no closed form solves."""
    document = document_of(load("rmmt"))
    del document["chains"]["leg"]["elements"][0]["locked"]
    return parse(document)


def random_stands(machine: Machine, count: int, seed: int) -> tuple[Frame, np.ndarray]:
    """Reachable poses (count,) around home, tilted up to 100 degrees, and a working mode for each, (legs, 2, count)."""
    rng = np.random.default_rng(seed)
    most, legs = 40 * count, len(machine.legs)
    position = np.array(machine.home.position) + rng.uniform(-0.03, 0.03, (most, 3))
    pose = zyz_frame(
        position, rng.uniform(-np.pi, np.pi, most), rng.uniform(0, np.radians(100), most), rng.uniform(-np.pi, np.pi, most)
    )
    signs = rng.choice([-1.0, 1.0], (legs, 2, most))
    for index, leg in enumerate(machine.legs):
        for branch in {0, 1} - set(branches(leg)):
            signs[index, branch] = 1.0  # a choice that the chain does not have
    reach = [np.asarray(inverse(leg, pose, s).reach) for leg, s in zip(machine.legs, signs, strict=True)]
    keep = np.flatnonzero(np.all(np.stack(reach) >= 0, axis=0))[:count]
    assert len(keep) == count, "too few of the random poses are reachable"
    return Frame(*(Vec(*(np.broadcast_to(c, most)[keep] for c in v)) for v in pose)), signs[..., keep]


def drives_of(machine: Machine, poses: Frame, signs: np.ndarray) -> np.ndarray:
    """Drive coordinates (n, n_actuators) in the order of Q at poses in a working mode each, (legs, 2, n)."""
    names, columns = actuator_names(machine), {}
    for leg, sign in zip(machine.legs, signs, strict=True):
        coordinates = inverse(leg, poses, sign).coordinates
        for element, coordinate in zip(leg.chain.elements, coordinates, strict=True):
            is_angle = hasattr(coordinate, "cos")
            columns[f"{leg.name}.{element.name}"] = np.arctan2(coordinate.sin, coordinate.cos) if is_angle else coordinate
    return np.stack([np.asarray(columns[name]) for name in names], axis=-1)


def part(pose: Frame, which: Any) -> Frame:
    """Some of a batch of poses, or one."""
    return Frame(*(Vec(*(c[which] for c in v)) for v in pose))
