"""What a page tells in words and bars, as pieces of HTML; whatever comes from a file is escaped."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

from trivet.errors import NoResultError, TrivetError
from trivet.show.palette import BLUE, GREEN, MARKED, ORANGE
from trivet.statics.objective import AXES
from trivet.study.frf import Minimum
from trivet.study.pose import JointRow, PoseReport
from trivet.study.singularity import SingularityReport
from trivet.viewer.standing import Standing

MOST_SENTENCES, MOST_SHARES = 4, 8
_STYLE = "font-size:0.8em;padding:0 0.9em 0.4em"
_CELL = "padding:1px 6px 1px 0;text-align:right;font-variant-numeric:tabular-nums"


def esc(text: str) -> str:
    """Text as it may stand in a page."""
    return html.escape(text, quote=True)


def block(*pieces: str, role: str = "") -> str:
    """Pieces together, in the type of the page."""
    return f'<div style="{_STYLE}"{role and f" {role}"}>{"".join(pieces)}</div>'


def status(name: str, standing: Standing) -> str:
    """Whether a pose is reached, what bites and where."""
    mark, word = ("✓", "reached") if standing.is_right else ("✗", "not allowed" if standing.report else "not reached")
    colour = GREEN if standing.is_right else MARKED
    said = standing.sentences[:MOST_SENTENCES]
    rest = len(standing.sentences) - len(said)
    lines = [esc(sentence) for sentence in said] + ([f"and {rest} more"] if rest else [])
    head = f'<b>{esc(name)}</b> <span style="color:{colour};font-weight:bold">{mark} {word}</span>'
    return f"<div>{head}{''.join(f'<div>{line}</div>' for line in lines)}</div>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; cells are escaped, the first of every row is its name."""
    names = "".join(f'<th scope="col" style="{_CELL}">{esc(cell)}</th>' for cell in head)
    body = ""
    for first, *rest in rows:
        cells = "".join(f'<td style="{_CELL}">{esc(cell)}</td>' for cell in rest)
        body += f'<tr><th scope="row" style="{_CELL};text-align:left;font-weight:normal">{esc(first)}</th>{cells}</tr>'
    return f'<table style="border-collapse:collapse"><thead><tr>{names}</tr></thead><tbody>{body}</tbody></table>'


def bars(rows: Iterable[tuple[str, float, str, str]]) -> str:
    """Names with a bar from 0 to 1, what is written behind it, and its colour."""
    found = ""
    for name, share, written, colour in rows:
        width = 100 * min(max(share, 0.0), 1.0)
        found += (
            f'<div style="display:flex;gap:6px;align-items:center"><span style="flex:0 0 8.5em">{esc(name)}</span>'
            '<span style="flex:1;height:0.6em;border:1px solid currentColor;border-radius:2px">'
            f'<span style="display:block;height:100%;width:{width:.1f}%;background:{colour}"></span></span>'
            f'<span style="flex:0 0 5.5em;text-align:right">{esc(written)}</span></div>'
        )
    return found


def joints(report: PoseReport) -> str:
    """Where every joint is within its travel."""
    return bars(_joint(row) for row in report.joints)


def _joint(row: JointRow) -> tuple[str, float, str, str]:
    scale, unit = (1e3, "mm") if row.unit == "m" else (math.degrees(1), "°")
    value = row.limited if math.isfinite(row.low) or math.isfinite(row.high) else row.coordinate
    share = (value - row.low) / (row.high - row.low) if math.isfinite(row.low) and math.isfinite(row.high) else 0.0
    colour = MARKED if not row.inside else ORANGE if row.actuated else GREEN
    return row.name, share, f"{scale * value:.1f} {unit}", colour


def stiffness(report: PoseReport) -> str:
    """Along and about every axis: others held, and others free."""
    rows = []
    for axis in AXES:
        name, scale, unit = (f"_{axis}{axis}", 1e-6, "N/µm") if len(axis) == 1 else (f"_{axis}", 1.0, "N m/rad")
        rows.append((f"{axis}, {unit}", *(_value(report, kind + name, scale) for kind in ("K", "1/C"))))
    return table(("", "others held", "others free"), rows)


def _value(report: PoseReport, name: str, scale: float) -> str:
    try:
        return f"{scale * report.diagonal(name):.4g}"
    except NoResultError:
        return "0"


def budget(report: PoseReport, direction: str) -> str:
    """What a deflection along a direction is lost in."""
    try:
        shares = report.budget(direction)[:MOST_SHARES]
    except TrivetError as error:
        return f"<div>{esc(str(error))}</div>"
    return bars((f"{s.chain}.{s.element} {s.part}", s.share, f"{100 * s.share:.1f} %", BLUE) for s in shares)


def singular(report: SingularityReport) -> str:
    """How near the pose is to a singularity."""
    found = report.singularity
    rows = [("σ_min", f"{found.sigma_min:.4g}"), ("type", str(found.type) if found.type else "regular")]
    if math.isfinite(report.tilt_margin.angle):
        rows.append(("next Type 2, tilted", f"{math.degrees(report.tilt_margin.angle):.3g}°"))
    if math.isfinite(report.shift_margin.length):
        rows.append(("next Type 2, centre moved", f"{1e3 * report.shift_margin.length:.3g} mm"))
    sentences = "".join(f"<div>{esc(sentence)}</div>" for sentence in found.meaning)
    return table(("", ""), rows) + sentences


def minima(found: Iterable[Minimum]) -> str:
    """Least dynamic stiffness and where it is."""
    rows = []
    for one in found:
        scale, unit = (1e-6, "N/µm") if len(one.direction) == 1 else (1.0, "N m/rad")
        rows.append((one.direction, f"{scale * one.stiffness:.4g} {unit}", f"{one.frequency:.1f} Hz"))
    return "<div>least 1/|H|, 1 Hz to 20 kHz</div>" + table(("", "", "at"), rows)


def scale(label: str, low: float, high: float, colours: Sequence[str]) -> str:
    """A bar of colours with what its ends and its middle are."""
    ramp = ", ".join(colours)
    ends = "".join(f"<span>{value:.4g}</span>" for value in (low, (low + high) / 2, high))
    return (
        f'<div>{esc(label)}</div><div style="height:0.9em;background:linear-gradient(to right, {ramp})"></div>'
        f'<div style="display:flex;justify-content:space-between">{ends}</div>'
    )


def swatches(rows: Iterable[tuple[str, str]]) -> str:
    """Lines of words, each behind a square of its colour where it has one."""
    square = "display:inline-block;width:0.8em;height:0.8em;margin-right:0.4em;border:1px solid currentColor;background:"
    return "".join(
        f'<div>{f"""<span style="{square}{colour}"></span>""" if colour else ""}{esc(text)}</div>' for colour, text in rows
    )
