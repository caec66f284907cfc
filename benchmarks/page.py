"""The page: how long from an input until what is drawn in the browser has followed it."""

from __future__ import annotations

import shutil
import statistics
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

Row = tuple[str, str, str]

MACHINES = ("azulay", "rmmt", "gough-stewart")
TILT = 4
"""Number of its slider."""
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


BARE = "page, bare: a slider and one frame that follows it, what browser and viser take by themselves"


def input_to_scene() -> Iterator[Row]:
    """Medians in the page, machine by machine, beside those of a page that shows nothing."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from page import OPTIONS
    from playwright.sync_api import sync_playwright

    import trivet
    from trivet.viewer.serve import serving
    from trivet.viewer.state import state_of

    sys.setswitchinterval(1e-3)  # as `trivet view` does
    with sync_playwright() as play, tempfile.TemporaryDirectory() as folder:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=list(OPTIONS))
        with _bare() as address:
            yield BARE, _told(browser, address, 0), ""
        for name in MACHINES:
            with serving(state_of([trivet.load(name)], [None]), folder=Path(folder)) as (address, page):
                what = f"page, {name}: median from a key press to the scene that follows, drawn without a graphics card"
                yield what, _told(browser, address, TILT), "50 ms"
                assert page.failure is None
        browser.close()


@contextmanager
def _bare() -> Iterator[str]:
    """A page of viser's with nothing but what is moved."""
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    slider = server.gui.add_slider("x", 0.0, 100.0, 0.1, 50.0)
    frame = server.scene.add_frame("/frame", show_axes=False)

    @slider.on_update
    def moved(_: Any) -> None:
        frame.position = (slider.value, 0.0, 0.0)
        server.flush()

    try:
        yield f"http://127.0.0.1:{server.get_port()}"
    finally:
        server.stop()


def _told(browser: Any, address: str, number: int) -> str:
    """Medians on the page at an address, of a slider by its number."""
    web = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    web.add_init_script(HOOK)
    web.goto(address)
    slider = web.get_by_role("slider").nth(number)
    slider.focus()
    for _ in ("warming", "timed"):
        web.evaluate("window.__kept.arrived.length = window.__kept.drawn.length = 0")
        for press in range(INPUTS):
            slider.press("ArrowRight" if press < INPUTS / 2 else "ArrowLeft")
            web.wait_for_timeout(REST if press % 2 else REST / 4)
    kept = web.evaluate("window.__kept")
    web.close()
    arrived, drawn = (statistics.median(kept[key]) for key in ("arrived", "drawn"))
    late = statistics.quantiles(kept["drawn"], n=10)[-1]
    return f"{drawn:.0f} ms (a tenth takes more than {late:.0f}); {arrived:.0f} ms until it has come"
