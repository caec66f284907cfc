"""Every file of a reproduction."""

from __future__ import annotations

from pathlib import Path

from trivet.report.document import write_document
from trivet.reproduce.datasets import write_datasets
from trivet.reproduce.page import document
from trivet.reproduce.run import Reproduction
from trivet.reproduce.tables import write_tables


def write_all(result: Reproduction, folder: Path, command: str, *, pdf: bool = False) -> list[Path]:
    """Write report, tables and NetCDF; those of an earlier run in the same folder are replaced, and its PDF goes.

    Args:
        result: what to write.
        folder: that of the items.
        command: what made it.
        pdf: whether the report is printed as well.
    """
    page, printed = document(result, command), folder / "report.pdf"
    reports = [folder / "report.html", *([printed] if pdf else [])]
    if not pdf:
        printed.unlink(missing_ok=True)  # it would tell of another run
    for path in reports:
        write_document(page, path, overwrite=True)
    return [*reports, *write_tables(result, folder), *write_datasets(result, folder)]
