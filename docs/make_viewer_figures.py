"""Draw the picture of docs/viewer.md: the page itself, in Chromium.

python docs/make_viewer_figures.py
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import trivet
from trivet.viewer.serve import serving
from trivet.viewer.state import PoseNumbers, state_of

ROOT = Path(__file__).parents[1]
FIGURE = ROOT / "docs" / "figures" / "page.png"
POSE = PoseNumbers(-0.001, 0.0015, 0.1245, 2.2, 0.45, -2.2)


def main() -> None:
    """Map the singular values, stand near the singular ring, and take the picture."""
    sys.path.insert(0, str(ROOT / "tests"))
    from page import opened, until

    state = state_of([trivet.load("azulay")], [None], POSE)
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(state, folder=Path(folder)) as (address, page),
        opened(address) as seen,
    ):
        seen.page.get_by_role("tab", name="Map").click()
        page._map._quantity.value, page._map._roll.value, page._map._steps.value = "sigma_min", "-alpha", 16
        page._seek_map(0, "sigma_min", 16, "-alpha")
        seen.page.get_by_text("sigma_min; the hemisphere").wait_for()
        page.change(twist=True)
        until(lambda: page.is_idle)
        seen.page.locator(".mantine-Notification-closeButton").first.click()
        seen.drawn()
        seen.page.screenshot(path=FIGURE)
    print(FIGURE)


if __name__ == "__main__":
    main()
