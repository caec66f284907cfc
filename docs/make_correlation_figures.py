"""Draw the figures of the section "Comparing with a machine" of docs/measure.md, by doing what it says.

python docs/make_correlation_figures.py
"""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

import trivet
from trivet.study.correlate import MappedPoints

DOCS = Path(__file__).parent.resolve()
SECTION = re.compile(r"^## Comparing with a machine\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def main() -> None:
    (section,) = SECTION.findall((DOCS / "measure.md").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for block in BLOCK.findall(section):
            exec(compile(block, "measure.md", "exec"), names)
        os.chdir(DOCS)
    found = names["found"]
    assert isinstance(found, trivet.Correlation)
    trivet.figure(found, DOCS / "figures" / "measured-overlay.png", overwrite=True)
    trivet.figure(MappedPoints(found.placed, found.measured), DOCS / "figures" / "measured-points.png", overwrite=True)


if __name__ == "__main__":
    main()
