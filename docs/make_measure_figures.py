"""Draw the figures of docs/measure.md by doing what it says.

python docs/make_measure_figures.py
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

import trivet
from trivet.study.correlate import MappedPoints

DOCS = Path(__file__).parent.resolve()
FIGURES = DOCS / "figures"
SECTION = re.compile(r"^## (.*?)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def main() -> None:
    sections = dict(SECTION.findall((DOCS / "measure.md").read_text(encoding="utf-8")))
    names: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for title in ("Reading measurements", "Fitting modes", "Comparing with a machine"):
            for block in BLOCK.findall(sections[title]):
                exec(compile(block, "measure.md", "exec"), names)
            if title == "Reading measurements":
                beam = names["beam"]
                assert isinstance(beam, trivet.Functions)
                trivet.save_functions(beam, "measured.nc")  # what the command there does
        os.chdir(DOCS)
    fit, found = names["fit"], names["found"]
    assert isinstance(fit, trivet.ModalFit)
    assert isinstance(found, trivet.Correlation)
    trivet.figure(fit, FIGURES / "measured-modes.png", overwrite=True)
    trivet.figure(found, FIGURES / "measured-overlay.png", overwrite=True)
    trivet.figure(MappedPoints(found.placed, found.measured), FIGURES / "measured-points.png", overwrite=True)


if __name__ == "__main__":
    main()
