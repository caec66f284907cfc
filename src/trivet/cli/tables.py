"""Results as tables for people; units as designers use them, each written at its column."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from trivet.kinematics.forward import Forward
    from trivet.model import Machine
    from trivet.study.comparison import Comparison
    from trivet.study.pose import PoseReport
    from trivet.study.singularity import SingularityReport
    from trivet.study.singularity_map import SingularityMap
    from trivet.study.stiffness_map import StiffnessMap

AXES = ("x", "y", "z", "rx", "ry", "rz")


def _console() -> Console:
    # A pipe gets whole lines, not a terminal's width of them; a narrow terminal breaks lines, which is better than cut numbers.
    console = Console(highlight=False, soft_wrap=False)
    return Console(highlight=False, width=max(console.width, 110) if console.is_terminal else 160)


def _table(title: str, *columns: str, left: int = 1) -> Table:
    table = Table(
        title=title, title_justify="left", title_style="bold", header_style="", box=None, pad_edge=False, padding=(0, 2, 0, 0)
    )
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k < left else "right", no_wrap=k < left)
    return table


def _print(*parts: Any) -> None:
    console = _console()
    for part in parts:
        console.print(part if not isinstance(part, str) else Text(part))
        console.print()


def print_catalogue(machines: list[Machine]) -> None:
    """The catalogue, one line each."""
    table = _table("Machines of the catalogue", "name", "what it is", "chains", left=3)
    for machine in machines:
        chains = ", ".join(f"{c.copies} × {topology(c)}" for _, c in sorted(machine.chains.items()))
        table.add_row(machine.name, machine.about.title, chains)
    _print(table)


def topology(chain: Any) -> str:
    """The joints of a chain by their letters, the actuated ones in brackets: "[P][P]RS"."""
    from trivet.kinematics.jacobian import is_driven

    letters = {"curvilinear": "P", "prismatic": "P", "revolute": "R", "spherical": "S", "universal": "U"}
    joints = [(letters[e.type], is_driven(e)) for e in chain.elements if e.type in letters]
    return "".join(f"[{letter}]" if driven else letter for letter, driven in joints)


def print_machine(machine: Machine) -> None:
    """A machine: chains, dimensions, sources."""
    from trivet.model import document_of

    about = machine.about
    _print(
        "\n".join(
            line
            for line in (f"{machine.name}: {about.title}", about.description, f"Source: {about.source}" if about.source else "")
            if line
        )
    )
    document = document_of(machine)
    for name, chain in sorted(machine.chains.items()):
        table = _table(
            f"chain {name}, {chain.copies} ×, {topology(chain)} (actuated joints in brackets)",
            "element",
            "type",
            "data",
            left=3,
        )
        for row in document["chains"][name]["elements"]:
            data = ", ".join(f"{k} {_plain(v)}" for k, v in row.items() if k not in ("name", "type") and v is not False)
            table.add_row(row["name"], row["type"], data)
        _print(table)
    rest = _table("the rest", "key", "value", left=2)
    for key in ("platform", "home", "workpiece", "sections", "materials", "theory"):
        for path, value in _flat(document.get(key, {}), key):
            rest.add_row(path, _plain(value))
    for name, chain in sorted(document["chains"].items()):
        for key in ("platform_joint", "base"):
            for path, value in _flat(chain.get(key, {}), f"{name}.{key}"):
                rest.add_row(path, _plain(value))
    _print(rest)
    noted = [n for n in about.notes if n.status != "given"]
    if noted:
        table = _table("numbers that are not given by the source", "key", "status", "why", left=3)
        for note in noted:
            table.add_row(note.path, note.status, note.source)
        _print(table)


def _flat(node: Any, path: str) -> list[tuple[str, Any]]:
    if isinstance(node, dict) and "value" not in node:
        return [pair for key, value in node.items() for pair in _flat(value, f"{path}.{key}")]
    return [(path, node)]


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return _plain(value["value"]) if "value" in value else ", ".join(f"{k} {_plain(v)}" for k, v in value.items())
    if isinstance(value, list):
        return " … ".join(map(_plain, value)) if len(value) == 2 else ", ".join(map(_plain, value))
    return "yes" if value is True else str(value)


def print_pose(report: PoseReport, load: Any = None) -> None:
    """Everything about one pose."""
    from trivet.kinematics.mode import mode_words

    x, y, z = (f"{v * 1e3:g}" for v in report.position)
    alpha, beta, gamma = (f"{math.degrees(v):.6g}" for v in report.angles)
    _print(
        f"{report.machine.name}, {mode_words(report.mode)}, centre ({x}, {y}, {z}) mm, "
        f"alpha {alpha}°, beta {beta}°, gamma {gamma}°\n"
        + ("reached, all joints inside their travel" if report.miss is None else f"NOT inside travel: {report.miss.reason}")
    )
    joints = _table("joints", "joint", "coordinate", "limited", "from", "to", "")
    for j in report.joints:
        unit, scale = ("mm", 1e3) if j.unit == "m" else ("°", math.degrees(1))
        limits = [f"{v * scale:.4g} {unit}" if math.isfinite(v) else "" for v in (j.low, j.high)]
        limited = f"{j.limited * scale:.4f} {unit}" if limits[0] else ""
        kind = "actuated" if j.actuated else "locked" if j.locked else ""
        words = " ".join(w for w in (kind, "" if j.inside else "OUTSIDE") if w)
        joints.add_row(j.name, f"{j.coordinate * scale:.4f} {unit}", limited, *limits, words)
    _print(joints)
    stiffness = _table("stiffness at the platform centre in {O} (forces in N, moments in N m, per m and rad)", "", *AXES)
    size = [abs(report.stiffness[i, i]) ** 0.5 for i in range(6)]
    for i, axis in enumerate(("Fx", "Fy", "Fz", "Mx", "My", "Mz")):
        # What is rounding beside the diagonal is printed as the zero that it is.
        row = (v if abs(v) > 1e-12 * size[i] * size[j] else 0.0 for j, v in enumerate(report.stiffness[i]))
        stiffness.add_row(axis, *(f"{v:.5g}" for v in row))
    _print(stiffness)
    both = _table("along each axis", "axis", "K_ii (others held)", "1/C_ii (others free)")
    for a in AXES:
        name, scale, unit = (f"_{a}{a}", 1e-6, "N/µm") if len(a) == 1 else (f"_{a}", 1.0, "N m/rad")
        both.add_row(a, *(f"{report.diagonal(kind + name) * scale:.5g} {unit}" for kind in ("K", "1/C")))
    _print(both, budget_table(report))
    if load is not None:
        _print(*load_tables(load))


def budget_table(report: PoseReport) -> Table:
    """Shares of the deflection under a force along x, y and z."""
    shares = {a: {(s.chain, f"{s.element} {s.part}"): s.share for s in report.budget(a)} for a in AXES[:3]}
    table = _table("compliance budget: share of the deflection under a force along", "what yields", *AXES[:3])
    elements = list(dict.fromkeys(element for _, element in shares["x"]))
    for element in elements:
        totals = [sum(v for (_, e), v in shares[a].items() if e == element) for a in AXES[:3]]
        table.add_row(f"all {element}", *(f"{100 * t:.1f} %" for t in totals))
        for chain in dict.fromkeys(c for c, e in shares["x"] if e == element):
            table.add_row(f"  {chain}.{element}", *(f"{100 * shares[a][chain, element]:.1f} %" for a in AXES[:3]))
    return table


def load_tables(load: Any) -> list[Table]:
    """Deflections and drive loads of a load case."""
    moved = _table("deflection under the load", "", "x µm", "y µm", "z µm", "rx µrad", "ry µrad", "rz µrad")
    moved.add_row("tool tip", *(f"{v * 1e6:.4f}" for v in load.tool_tip))
    moved.add_row("platform centre", *(f"{v * 1e6:.4f}" for v in load.platform_centre))
    drives = _table("what the drives carry", "drive", "load")
    for name, drive in load.drives.items():
        drives.add_row(name, f"{drive.load:.4f} {drive.unit}")
    return [moved, drives]


def print_forward(result: Forward) -> None:
    """All assembly modes at drive coordinates."""
    from trivet.kinematics.forward import drive_elements
    from trivet.model.elements import Prismatic

    drives = _table(f"{result.machine.name}: drives", "drive", "coordinate")
    for (name, value), element in zip(result.drives.items(), drive_elements(result.machine), strict=True):
        text = (
            f"{_plain_number(value * 1e3)} mm" if isinstance(element, Prismatic) else f"{_plain_number(math.degrees(value))}°"
        )
        drives.add_row(name, text)
    columns = ("", "mode", "x mm", "y mm", "z mm", "α °", "β °", "γ °", "mirror", "home", "joints")
    poses = _table("poses with these drive coordinates", *columns, left=2)
    for k, pose in enumerate(result.modes, 1):
        place = (_number(v * 1e3) for v in pose.position)
        angles = (_number(math.degrees(v)) for v in pose.angles)
        twin = "" if pose.mirror is None else f"{pose.mirror + 1}" + (" (itself)" if pose.mirror + 1 == k else "")
        joints = "inside" if pose.miss is None else f"{pose.miss.chain}.{pose.miss.joint} outside"
        number = f"{k}" if pose.multiplicity == 1 else f"{k} (double)"
        poses.add_row(number, pose.mode, *place, *angles, twin, pose.home, joints)
    if result.expected is not None:
        real = sum(pose.multiplicity for pose in result.modes)
        words = f"{result.found} of {result.expected} complex solutions found, {real} of them real" + (
            "; so these are all poses there are" if result.complete else f"; NOT complete: {result.remark}"
        )
    else:
        words = result.remark
    worst = max(pose.residual for pose in result.modes)
    _print(drives, poses, f"{words}. Drives at these poses deviate by {worst:.1g} m or rad at most.")


def print_singularity(report: SingularityReport) -> None:
    """Singularity and transmission at one pose."""
    from trivet.kinematics.mode import mode_words
    from trivet.kinematics.singularity import motion_words

    found = report.singularity
    place = ", ".join(f"{1e3 * float(c) + 0.0:g}" for c in found.frame.origin)
    alpha, beta, gamma = (f"{math.degrees(v):.6g}" for v in report.angles)
    stands = (
        f"{found.machine.name}, {mode_words(found.mode)}, centre ({place}) mm, alpha {alpha}°, beta {beta}°, gamma {gamma}°"
    )
    verdict = "\n".join(found.meaning) or f"regular; the drives control least how the platform {motion_words(found.motion)}"
    numbers = _table("how near", "", "value", left=1)
    det, far = found.determinants, found.distance
    rows = (
        ("smallest singular value of J_x (moments over the characteristic length)", f"{found.sigma_min:.6g}"),
        ("moving the centre, to a Type 2 singularity to first order", _first_order(1e3 * far.length, "mm", 1e3)),
        ("tilting about the centre, to a Type 2 singularity to first order", _first_order(math.degrees(far.angle), "°", 180)),
        ("tilting about the centre until there is a Type 2 singularity", _tilt_margin(report)),
        ("det J_x; its sign changes across Type 2 singularities", f"{det.j_x * 1e9:.6g} mm³"),
        ("det J_q", f"{det.j_q:.6g} (SI)"),
        ("1 / det J⁻¹, geometric", f"{1 / det.inverse if det.inverse else math.inf:.6g} (SI)"),
    )
    for words, value in rows:
        numbers.add_row(words, value)
    drives = _table("drives", "drive", "lever of its force", "ITI", "OTI", "")
    moved = report.transmission
    for k, drive in enumerate(found.drives):
        lever = f"{1e3 * drive.lever:.4g} mm" if drive.is_angular else f"cos {drive.lever:.4g}"
        idle = "SINGULAR" if drive.is_singular else ""
        drives.add_row(drive.name, lever, f"{float(moved.input[k]):.4f}", f"{float(moved.output[k]):.4f}", idle)
    _print(stands, verdict, numbers, drives, f"local transmission index LTI {float(moved.local):.4f}, the least of all")


def _first_order(value: float, unit: str, most: float) -> str:
    """A distance to first order, unless it is so long that it says nothing."""
    return f"{value:.4g} {unit}" if value < most else "none near"


def _tilt_margin(report: SingularityReport) -> str:
    margin = report.tilt_margin
    if not math.isfinite(margin.angle):
        return "none up to 90° and as far as the chains reach"
    return f"{math.degrees(margin.angle):.4f}° towards {math.degrees(margin.azimuth):g}° from x of {{E}}"


def _print_singularities(result: SingularityMap) -> None:
    from trivet.kinematics.mode import mode_words

    table = _table("over the points that are reached", "quantity", "least", "median", "greatest", "unit")
    for name, values in result.fields.items():
        own = values[np.isfinite(values)]
        if len(own):
            table.add_row(name, f"{own.min():.4g}", f"{np.median(own):.4g}", f"{own.max():.4g}", result.unit(name))
    curves = _table("curves of Type 2 singularities", "", "points", "length mm", "distance from the axis mm", "")
    for k, curve in enumerate(result.curves, 1):
        away = 1e3 * np.hypot(*curve.surface.position[:, :2].T)
        spread = f"{away.min():.3f} to {away.max():.3f}"
        closed = "closed" if curve.is_closed else "open"
        curves.add_row(str(k), str(len(curve.roll)), f"{1e3 * curve.length:.3f}", spread, closed)
    used = f"{int(result.used.sum())} of {len(result.surface)} points reached"
    height = 1e3 * float(result.surface.position[:, 2].min())
    _print(
        f"{result.machine.name}, {mode_words(result.mode)}, {result.surface.name} at z0 = {height:g} mm, "
        f"roll {result.policy}: {used}",
        table,
        curves if result.curves else "no Type 2 singularity between the points that are reached",
    )


def _number(value: float) -> str:
    """Four decimals, without a negative zero."""
    return f"{round(value, 4) + 0.0:.4f}"


def _plain_number(value: float) -> str:
    """Six digits, without what is rounding beside a unit."""
    return f"{round(value, 9) + 0.0:.6g}"


def print_map(result: StiffnessMap | SingularityMap) -> None:
    """A map in short."""
    from trivet.study.stiffness_map import StiffnessMap

    if not isinstance(result, StiffnessMap):
        _print_singularities(result)
        return
    from trivet.kinematics.mode import mode_words

    _print(
        f"{result.machine.name}, {mode_words(result.mode)}, {result.surface.name}, best roll for {result.objective.name}",
        _statistics([result]),
        _points([result]),
    )


def _statistics(maps: list[StiffnessMap]) -> Table:
    from trivet.study.comparison import FREE, HELD
    from trivet.study.statistics import moments

    table = _table(
        "stiffness over the points that are reached, N/µm; population variances, (N/µm)²",
        "machine",
        "",
        "n",
        "mean",
        "variance",
        "least",
        "greatest",
        left=2,
    )
    for result in maps:
        for k, quantity in enumerate((*HELD, *FREE)):
            m = moments(result.diagonal(quantity)[result.used] / 1e6)
            table.add_row(
                result.machine.name if k == 0 else "",
                quantity,
                str(m.n),
                f"{m.mean:.3f}",
                f"{m.variance:.4f}",
                f"{m.least:.3f}",
                f"{m.greatest:.3f}",
            )
    return table


def _points(maps: list[StiffnessMap]) -> Table:
    table = _table(
        "check points",
        "machine",
        "points",
        "used",
        "excluded because",
        "a limit decides the roll",
        "several rolls equally good",
    )
    for result in maps:
        reasons = ", ".join(f"{n} × {why}" for why, n in result.exclusions().items()) or "none"
        table.add_row(
            result.machine.name, str(len(result.surface)), str(int(result.used.sum())), reasons,
            str(int(result.best.at_limit.sum())), str(int(result.ties_beyond_symmetry.sum())),
        )  # fmt: skip
    return table


def print_comparison(result: Comparison) -> None:
    """A comparison: statistics, published values, tests, convergence, caveats."""
    from trivet.kinematics.mode import mode_words
    from trivet.study.comparison import CAVEATS

    maps = list(result.maps)
    surfaces = "; ".join(
        f"{m.machine.name}: {m.surface.name} at z0 = {float(m.surface.position[:, 2].min()) * 1e3:g} mm, {mode_words(m.mode)}"
        for m in maps
    )
    _print(f"best roll for {maps[0].objective.name}. {surfaces}", _statistics(maps), _points(maps))
    for rows, table in ((result.deviations, _published), (result.tests, _tests), (result.convergence, _convergence)):
        if rows:
            _print(table(result))
    _print("\n".join(f"Mind: {caveat}" for caveat in CAVEATS))


def _published(result: Comparison) -> Table:
    columns = ("machine", "source", "", "n", "published", "ours", "deviation", "variance published", "ours")
    table = _table("beside published means, N/µm", *columns, left=3)
    used = {m.machine.name: str(int(m.used.sum())) for m in result.maps}
    for d in result.deviations:
        variance = "" if d.published_variance is None else f"{d.published_variance / 1e12:.3f}"
        means = (f"{d.published / 1e6:.3f}", f"{d.ours / 1e6:.3f}", f"{100 * d.relative:+.1f} %")
        table.add_row(d.machine, d.source, d.quantity, used[d.machine], *means, variance, f"{d.our_variance / 1e12:.4f}")
    return table


def _tests(result: Comparison) -> Table:
    columns = ("pair", "", "difference N/µm", "t", "p", "p Holm", "Hedges' g")
    table = _table("Welch's two-tailed t test, p after Holm's correction over all rows", *columns, left=2)
    for t in result.tests:
        numbers = (f"{t.difference / 1e6:+.3f}", f"{t.t:.2f}", f"{t.p:.2g}", f"{t.p_holm:.2g}", f"{t.effect:+.2f}")
        table.add_row(f"{t.first} - {t.second}", t.quantity, *numbers)
    return table


def _convergence(result: Comparison) -> Table:
    columns = ("machine", "", "points", "mean N/µm", "finer points", "mean N/µm", "change")
    table = _table("convergence: means on a finer lattice", *columns, left=2)
    for c in result.convergence:
        means = (str(c.points), f"{c.mean / 1e6:.4f}", str(c.finer_points), f"{c.finer_mean / 1e6:.4f}")
        table.add_row(c.machine, c.quantity, *means, f"{100 * c.relative:+.2f} %")
    return table
