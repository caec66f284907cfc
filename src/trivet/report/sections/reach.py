"""How far the platform leans, and where it gets to."""

from __future__ import annotations

from collections.abc import Iterator

from trivet.report.document import Block, Section, Words
from trivet.report.subject import Subject
from trivet.report.telling import attempt, picture, repeat, told

_TILT = (
    "How far the platform leans at every azimuth while its centre stays on a sphere, with the best roll about its normal. "
    "Pose by pose says what is reached at all; from home says what is reached without crossing a singularity on the way."
)
_WORKSPACE = (
    "Where the platform centre gets to with the platform oriented as at home, joints inside their travel and bodies apart. "
    "The volume counts pose by pose, however each is come to; from home is the part that hangs together with home without "
    "crossing a Type 2 singularity on the way."
)


def section(subject: Subject) -> Section:
    """Tilt and workspace."""
    leaning = subject.command("tilt", *subject.points.lengths, "--figure", "tilt.png")
    going = subject.command("workspace", "--figure", "workspace.png")
    tilt = (Words(_TILT), *attempt(lambda: _tilt(subject)), repeat(leaning))
    workspace = (Words(_WORKSPACE), *attempt(lambda: _workspace(subject)), repeat(going))
    return Section("Reach", (), (Section("Tilt", tilt), Section("Workspace", workspace)))


def _tilt(subject: Subject) -> Iterator[Block]:
    from trivet.study.tilt import TiltStudy
    from trivet.views import tilt as view

    alt = f"Tilt of {subject.name} over the azimuth, in degrees, pose by pose and from home."
    yield picture(subject.tilt, "Tilt over the azimuth.", alt)
    yield from told(view.tables(TiltStudy((subject.tilt,))))


def _workspace(subject: Subject) -> Iterator[Block]:
    from trivet.study.workspace import WorkspaceStudy
    from trivet.views import workspace as view

    caption = "Height of the workspace over x and y, and its section at y = 0."
    yield picture(subject.workspace, caption, f"The workspace of {subject.name} from above and in section.")
    yield from told(view.tables(WorkspaceStudy((subject.workspace,))))
