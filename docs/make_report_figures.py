"""Draw the picture of docs/report.md: a part of a report, in Chromium.

python docs/make_report_figures.py
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import trivet

ROOT = Path(__file__).parents[1]
FIGURE = ROOT / "docs" / "figures" / "report.png"


def main() -> None:
    """Write a report and take its picture."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        path = Path(folder) / "report.html"
        trivet.write_report(["azulay", "eclipse"], path, sections=["comparison", "machine", "stiffness", "vibration"])
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 1000})
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-drawn=all]", state="attached")
        page.evaluate("document.querySelector('#section-3').scrollIntoView()")
        page.screenshot(path=FIGURE)
        browser.close()
    print(FIGURE)


if __name__ == "__main__":
    main()
