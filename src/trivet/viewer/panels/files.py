"""What is kept: the machines and the pose as files, the scene as a page that plays without Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from trivet.viewer import words
from trivet.viewer.panels.inputs import on_press, on_switch


class FilesPanel:
    """Saving and loading in the folder in which the page was started."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        is_dark: bool,
        save: Callable[[str, bool], None],
        load: Callable[[str, bool], None],
        export: Callable[[str, bool], None],
        theme: Callable[[bool], None],
    ) -> None:
        """`name` is what files are called at first; `save`, `load` and `export` are called with a name, and whether files may
        be replaced."""
        gui = server.gui
        dark = gui.add_checkbox("Dark", is_dark, hint="Dark or light (key T)")
        on_switch(dark, theme)
        self._dark: Any = dark
        self._name = gui.add_text("Name", name, hint="Of the files, without a suffix")
        self._replace = gui.add_checkbox("Replace files that exist", False)
        for label, then in (("Save machine and pose", save), ("Load them", load), ("Export the scene (HTML)", export)):
            on_press(gui.add_button(label), partial(self._asked, then))
        self._told = gui.add_html("")

    def _asked(self, then: Callable[[str, bool], None]) -> None:
        then(self._name.value, bool(self._replace.value))

    def tell(self, text: str) -> None:
        """What became of it."""
        self._told.content = words.block(words.esc(text), role='role="status"')

    def turn(self, is_dark: bool) -> None:
        """Set the switch of the theme."""
        self._dark.value = is_dark
