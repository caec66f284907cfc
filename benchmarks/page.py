"""The page: how long from an input until what is drawn in the browser has followed it."""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

Row = tuple[str, str, str]

MACHINES = ("azulay", "rmmt", "gough-stewart")
INPUTS, REST = 60, 400
"""Key presses on a slider, and ms between them; the studies that wait for rest do not disturb half of them."""

HOOK = """
(() => {
  const kept = window.__kept = {pressed: null, arrived: [], drawn: []};
  window.addEventListener("keydown", () => { kept.pressed = performance.now(); }, true);
  const Own = window.Worker;
  window.Worker = class extends Own {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", () => {
        const pressed = kept.pressed;
        if (pressed === null) return;
        kept.pressed = null;
        kept.arrived.push(performance.now() - pressed);
        requestAnimationFrame(() => requestAnimationFrame(() => kept.drawn.push(performance.now() - pressed)));
      });
    }
  };
})();
"""
"""The page hears from the server through a worker; the first it hears after a key press is where the bodies are now."""


def input_to_scene() -> Iterator[Row]:
    """Medians in the page, machine by machine."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from page import OPTIONS
    from playwright.sync_api import sync_playwright

    import trivet
    from trivet.viewer.serve import serving
    from trivet.viewer.state import state_of

    sys.setswitchinterval(1e-3)  # as `trivet view` does
    with sync_playwright() as play, tempfile.TemporaryDirectory() as folder:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(OPTIONS))
        for name in MACHINES:
            with serving(state_of([trivet.load(name)], [None]), folder=Path(folder)) as (address, page):
                web = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
                web.add_init_script(HOOK)
                web.goto(address)
                slider = web.get_by_role("slider").nth(4)
                slider.focus()
                for warming in (True, False):
                    for number in range(INPUTS):
                        slider.press("ArrowRight" if number < INPUTS / 2 else "ArrowLeft")
                        web.wait_for_timeout(REST if number % 2 else REST / 4)
                    kept = web.evaluate("window.__kept")
                    if warming:
                        web.evaluate("window.__kept.arrived.length = window.__kept.drawn.length = 0")
                assert page.failure is None
                web.close()
            arrived, drawn = (statistics.median(kept[key]) for key in ("arrived", "drawn"))
            late = statistics.quantiles(kept["drawn"], n=10)[-1]
            what = f"page, {name}: median from a key press to the scene that follows, drawn without a graphics card"
            yield what, f"{drawn:.0f} ms (a tenth takes more than {late:.0f}); {arrived:.0f} ms until it has come", "50 ms"
        browser.close()
