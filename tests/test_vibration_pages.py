"""Pages of vibration in a browser: they draw themselves, tell no error and ask nothing of a network."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest
from browser import opened

chromium = pytest.mark.peer("chromium", program="chromium")

LISTEN = """
window.told = [];
for (const kind of ["error", "warn"]) {
  const own = console[kind];
  console[kind] = (...words) => { window.told.push(`console.${kind}: ${words.join(" ")}`); own.apply(console, words); };
}
addEventListener("error", (e) => window.told.push(`error: ${e.message || e.target.outerHTML.slice(0, 100)}`), true);
addEventListener("unhandledrejection", (e) => window.told.push(`rejected: ${e.reason}`));
"""
ASKED = "performance.getEntriesByType('resource').map((e) => e.name).filter((name) => !/^(data|blob|file):/.test(name))"
WORDS = "[...document.querySelectorAll('svg text')].map((own) => own.textContent)"
"""What is drawn, piece by piece."""
DRAWN = "!!document.querySelector('.plotly-graph-div .main-svg .infolayer')"
PATIENCE = 60
"""Seconds for a page to draw itself."""
CUT = ("--diameter", "16 mm", "--teeth", "4", "--radial-depth", "4 mm", "--side", "down", "--material", "aluminium-7075-t6")
TOUR = """
[[poses]]
position = ["0 mm", "0 mm", "125 mm"]

[[poses]]
position = ["5 mm", "0 mm", "125 mm"]
azimuth = "20 deg"
tilt = "15 deg"
"""


def seen(page: Path, profile: Path, ready: str) -> dict[str, Any]:
    """What a page shows once something is true of it, what it told and what it asked for."""
    with opened(page, profile) as browser:
        browser.ask("Page.enable")
        browser.ask("Page.addScriptToEvaluateOnNewDocument", source=LISTEN)
        browser.ask("Page.reload")
        end = time.monotonic() + PATIENCE
        while not browser.evaluate(f"typeof told !== 'undefined' && document.readyState === 'complete' && {ready}"):
            assert time.monotonic() < end, f"{page.name} is not drawn"
            time.sleep(0.1)
        found: dict[str, Any] = json.loads(browser.evaluate(f"JSON.stringify({{words: {WORDS}, told, asked: {ASKED}}})"))
        return found


@chromium
def test_a_page_in_trouble_is_noticed(tmp_path: Path) -> None:
    """The witness itself: errors of all kinds, a picture from elsewhere."""
    trouble = """<svg><text>trouble</text></svg><img src="http://nowhere.invalid/a.png"><script>
      console.error("first");
      Promise.reject("second");
      setTimeout(() => { window.done = true; throw new Error("third"); }, 100);
    </script>"""
    (tmp_path / "page.html").write_text(trouble)
    found = seen(tmp_path / "page.html", tmp_path / "profile", "window.done")
    told = " | ".join(found["told"])
    assert all(words in told for words in ("console.error: first", "rejected: second", "third", "nowhere.invalid"))
    assert found["asked"] == ["http://nowhere.invalid/a.png"]
    assert found["words"] == ["trouble"]


PAGES = {
    "lobes": (
        ("lobes", "azulay", *CUT, "--points", "40", "--highest", "800 Hz"),
        ("Azulay 3×PPRS", "feed at 0°, at the platform centre", "spindle speed, rpm", "stable at every speed"),
    ),
    "lobes along a path": (
        ("lobes", "azulay", *CUT, "--points", "40", "--highest", "800 Hz", "--path", "tour.toml"),
        ("Azulay 3×PPRS", "2 poses", "stable depth, mm"),
    ),
    "atlas": (
        ("map", "azulay", "--quantity", "dynamic-stiffness", "--steps", "1", "--entries", "xx", "--roll", "0 deg",
         "--from", "20 Hz", "--to", "300 Hz"),
        ("azulay, hemisphere of 4 mm", "loss factor 0.02", "over all poses"),
    ),
    "modes along a path": (
        ("modes", "azulay", "--path", "tour.toml", "--count", "3", "--steps", "4"),
        ("Azulay 3×PPRS", "from (0, 0, 125) mm", "branches", "natural frequency, Hz"),
    ),
    "solids": (
        ("solids", "azulay", "--part", "leg.link", "--to", "300 Hz", "--points", "5", "--fineness", "0.6"),
        ("Azulay 3×PPRS", "solids"),
    ),
}  # fmt: skip


NEEDS = {"solids": pytest.mark.peer("scikit-fem", module="skfem")}


@chromium
@pytest.mark.parametrize("name", [pytest.param(name, marks=NEEDS.get(name, ())) for name in PAGES])
def test_pages_draw_themselves(trivet: Any, tmp_path: Path, name: str) -> None:
    arguments, words = PAGES[name]
    (tmp_path / "tour.toml").write_text(TOUR)
    code, _, err = trivet(*arguments, "--figure", "page.html")
    assert code == 0, err
    found = seen(tmp_path / "page.html", tmp_path / "profile", DRAWN)
    assert found["told"] == []
    assert found["asked"] == []
    drawn = "\n".join(found["words"])
    assert [own for own in words if own not in drawn] == [], drawn
