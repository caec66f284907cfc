"""Every file of a reproduction."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from trivet.report.document import write_document
from trivet.reproduce.datasets import write_datasets
from trivet.reproduce.page import document
from trivet.reproduce.run import Reproduction
from trivet.reproduce.tables import write_tables


def write_all(
    result: Reproduction, folder: Path, command: str, *, pdf: bool = False, tell: Callable[[str], None] = lambda words: None
) -> list[Path]:
    """Write report, tables and NetCDF; those of an earlier run in the same folder are replaced, and its PDF goes, as is told.

    Args:
        result: what to write.
        folder: that of the items.
        command: what made it.
        pdf: whether the report is printed as well.
        tell: called with a line where something goes.
    """
    page, printed = document(result, command), folder / "report.pdf"
    reports = [folder / "report.html", *([printed] if pdf else [])]
    if not pdf and printed.is_file():
        printed.unlink()
        tell(f"removed {printed}, which was of another run; --pdf prints it anew")
    for path in reports:
        write_document(page, path, overwrite=True)
    return [*reports, *write_tables(result, folder), *write_datasets(result, folder)]
