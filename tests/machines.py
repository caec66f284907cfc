"""Machines and poses that several tests use."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from trivet.kinematics.inverse import branches, inverse
from trivet.kinematics.jacobian import actuator_names
from trivet.kinematics.standing import stand
from trivet.model import Machine, document_of, load, parse
from trivet.space.frame import Frame
from trivet.space.pose import zyz_frame
from trivet.space.vector import Vec

PAPER = ("azulay", "eclipse", "alizade", "glozman")
_DATA = Path(__file__).parent / "data"
STATIC_CASES = json.loads((_DATA / "static.json").read_text())["cases"]
VIBRATION_CASES = json.loads((_DATA / "frf.json").read_text())["cases"]
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


# Our name of each machine, its second drive with the joint of the case at which it ends, its two beams.
_VIBRATING = {
    "prop": ("azulay", "slide", "C", ("slide", "link")),
    "eclipse": ("eclipse", "column", "C", ("column", "link")),
    "alizade": ("alizade", "telescope", "A", (None, "telescope")),
    "glozman": ("glozman", "shoulder", "B", ("link-1", "link-2")),
}


def changed(machine: Machine, elements: dict[str, dict[str, Any]] | None = None, **others: Any) -> Machine:
    """A machine with keys of its chains' elements changed, or taken out where None; and with other tables of its file."""
    document = document_of(machine)
    document |= others
    for chain in document["chains"].values():
        for element in chain["elements"]:
            own = element | (elements or {}).get(element["name"], {})
            element.clear()
            element.update({key: value for key, value in own.items() if value is not None})
    return parse(document)


def vibrating_machine(case: dict[str, Any]) -> Machine:
    """The machine of a case of frf.json."""
    p = case["params"]
    name, second, _, (first_beam, _) = _VIBRATING[case["mechanism"]]
    about = "N m/rad" if case["mechanism"] == "glozman" else "N/m"
    keys: dict[str, dict[str, Any]] = {
        "guide": {"radius": f"{p['Rb_mm']} mm", "stiffness": _rate(p["k_act"], "N/m")},
        second: {"stiffness": _rate(p["k_act2"], about)},
        "hinge": {"stiffness": _rate(p["k_rev"], "N m/rad") if p["k_rev"] else None},
        "ball": _ball(p["k_sph"]),
    }
    if p["k_rev"] == "inf":
        keys["hinge"] |= {"actuated": True}  # by a drive without stiffness, which is rigid
    if p["k_rev_par"] != "inf":
        keys["hinge"]["bearing"] = dict.fromkeys(("rx", "rz"), f"{p['k_rev_par']} N m/rad")
    if p["k_sph_tr"] != "inf":
        keys["ball"]["bearing"] = dict.fromkeys(("x", "y", "z"), f"{p['k_sph_tr']} N/m")
    if p["m_C"]:
        keys["hinge"]["mass"] = f"{p['m_C']} kg"
    document = document_of(load(name))
    lengths = {"link": p["L_mm"], "link-1": p["glo_L1_mm"], "link-2": p["glo_L2_mm"]}
    for element in document["chains"]["leg"]["elements"]:
        if element["name"] in lengths:
            element["length"] = f"{lengths[element['name']]} mm"
        if element["name"] == first_beam:
            element.get("beam", element)["section"] = "first"
    document["chains"]["leg"]["platform_joint"] = {"radius": f"{p['Rp_mm']} mm", "azimuth": f"{p['az0']} rad"}
    return changed(
        parse(document | {"sections": {"tube": _tube(p["od_mm"], p["id_mm"]), "first": _tube(p["od1_mm"], p["id1_mm"])}}),
        keys,
        materials={"steel": {"youngs_modulus": f"{p['E']} Pa", "poisson_ratio": p["nu"], "density": f"{p['rho']} kg/m^3"}},
        platform=_platform(case),
        theory="timoshenko" if p["shear"] else "euler-bernoulli",
        rotary_inertia=p["rotary"],
    )


def _rate(value: Any, unit: str) -> str | None:
    return None if value == "inf" else f"{value} {unit}"


def _tube(outer: float, inner: float) -> dict[str, Any]:
    return {"shape": "tube", "outer_diameter": f"{outer} mm", "inner_diameter": f"{inner} mm"}


def _ball(rate: Any) -> dict[str, Any]:
    if rate in (0, "inf"):
        return {"rotation": "clamped" if rate else "free", "stiffness": None}
    return {"rotation": "elastic", "stiffness": f"{rate} N m/rad"}


def _platform(case: dict[str, Any]) -> dict[str, Any]:
    p = case["params"]
    centre = {"centre_of_mass": ["0 mm", "0 mm", f"{p['plat_com_z_mm']} mm"]}
    if p["m_plat"] is None and p["J_plat"] is None:
        disc = {"radius": f"{p['plat_r_mm']} mm", "thickness": f"{p['plat_t_mm']} mm", "material": "steel"}
        return centre | {"disc": disc}
    return centre | {"mass": f"{case['m_plat_kg']} kg", "inertia": [f"{value} kg m^2" for value in case["J_plat_kgm2"]]}


def vibrating_stand(case: dict[str, Any]) -> tuple[Machine, Frame, np.ndarray]:
    """The machine of a case of frf.json, its pose, and the working mode in which its joints stand where the case says."""
    machine, points = vibrating_machine(case), case["points_chain_rz_mm"]
    pose = zyz_frame((0.0, 0.0, points["P"][1] * 1e-3), 0.0, 0.0, 0.0)
    _, _, joint, _ = _VIBRATING[case["mechanism"]]
    for sign in (1.0, -1.0):
        signs = np.tile([1.0, sign], (len(machine.legs), 1))
        if 1 in branches(machine.legs[0]) or sign > 0:
            steps = {element.name: frame for element, frame, _ in stand(machine, pose, signs)[0].steps}
            x, y, z = (float(c) for c in steps["hinge"].origin)
            if np.allclose([np.hypot(x, y), z], np.array(points[joint]) * 1e-3, atol=1e-9):
                return machine, pose, signs
    raise AssertionError(f"no working mode has its joints where {case['name']} has them")


def vibrating_elements(case: dict[str, Any]) -> dict[str, int]:
    """How the beams of a case of frf.json are divided."""
    *_, beams = _VIBRATING[case["mechanism"]]
    return {beam: case["mesh"][key] for beam, key in zip(beams, ("ne1", "ne2"), strict=True) if beam is not None}


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
