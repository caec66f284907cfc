"""Every file of a reproduction."""

from __future__ import annotations

from pathlib import Path

from trivet.report.document import write_document
from trivet.reproduce.datasets import write_datasets
from trivet.reproduce.page import document
from trivet.reproduce.run import Reproduction
from trivet.reproduce.tables import write_tables


def write_all(result: Reproduction, folder: Path, command: str, *, pdf: bool = False) -> list[Path]:
    """Write report, tables and NetCDF; those of an earlier run in the same folder are replaced.

    Args:
        result: what to write.
        folder: that of the items.
        command: what made it.
        pdf: whether the report is printed as well.
    """
    page = document(result, command)
    reports = [folder / "report.html", *([folder / "report.pdf"] if pdf else [])]
    for path in reports:
        write_document(page, path, overwrite=True)
    return [*reports, *write_tables(result, folder), *write_datasets(result, folder)]
