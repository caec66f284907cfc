"""What the machine is."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.model import Machine
from trivet.model.elements import Curvilinear, Joint, Spherical
from trivet.report.document import Block, Plot, Section, Table, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, drawn, repeat, told
from trivet.vibration.damping import own_damping

_THEORIES = {"euler-bernoulli": "Euler and Bernoulli, without shear", "timoshenko": "Timoshenko, with shear"}
_BALLS = {
    "free": "free: they transmit forces and no moments",
    "clamped": "clamped: they transmit moments too",
    "elastic": "elastic: they resist turning with a stiffness of their own",
}
_GUIDES = {"translation": "straight along the tangent", "rotation": "along the circle, turning with it"}


def section(subject: Subject) -> Section:
    """Picture, chains, dimensions, sources, and what the numbers of the report rest on."""
    from trivet.views import machine as view

    # The machine's own name stands above; the rest of the first lines is what there is to say about it.
    first, *rest = view.tables(subject.described)
    words = first.split("\n")[1:]
    about = (Words("\n".join(words)),) if words else ()
    blocks = (*about, *attempt(lambda: _picture(subject)), *told(rest), assumptions(subject.machine))
    return Section("The machine", (*blocks, repeat(subject.command("show", "--figure", "machine.html"))))


def _picture(subject: Subject) -> Iterator[Block]:
    from trivet.show.drawing import draw
    from trivet.show.page import page
    from trivet.show.palette import paint
    from trivet.show.scene import scene
    from trivet.study.home import require_home

    require_home(subject.machine, subject.mode, within_travel=False)
    seen = scene(subject.machine, mode=subject.mode)
    caption = f"{subject.name} at home."
    alt = f"The machine {subject.name} at its home pose: chains from the ground to the platform, drives in orange."
    still = drawn(subject.machine, lambda machine, path: draw(machine, mode=subject.mode, path=path))
    yield Plot(caption, alt, page(paint(seen.shapes), seen), still)


def assumptions(machine: Machine) -> Table:
    """What the numbers of a report rest on, beside the dimensions."""
    elements = [e for chain in machine.chains.values() for e in chain.elements]
    balls = dict.fromkeys(_BALLS[e.rotation] for e in elements if isinstance(e, Spherical))
    guides = dict.fromkeys(_GUIDES[e.yields] for e in elements if isinstance(e, Curvilinear))
    but = ", but for parts with their own" if own_damping(machine) else ""
    masses = [e.name for e in elements if isinstance(e, Joint) and not e.mass]
    rows = [
        ("beams", _THEORIES[machine.theory]),
        ("platform", "rigid"),
        ("ball joints, in statics and vibration", "; ".join(balls)),
        ("drives of circular guides give way", "; ".join(guides)),
        ("damping in responses", f"structural, loss factor 0.02 (1 % of critical){but}"),
        ("joints without a mass in the file", ", ".join(dict.fromkeys(masses))),
        ("poses", "a pose counts as reached when every joint is inside its travel"),
    ]
    return Table("what the numbers rest on", ("", ""), tuple(row for row in rows if row[1]))
