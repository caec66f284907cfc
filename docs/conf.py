"""Settings of the site that Sphinx makes of these pages: `make docs`.  Neither making nor reading it needs a network."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed
from pathlib import Path

from pygments.lexers import TextLexer
from sphinx.application import Sphinx

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent / "site")]

project = "trivet"
author = "The trivet developers"
project_copyright = author
version = release = installed("trivet")

extensions = ["myst_parser", "sphinx.ext.autodoc", "docstrings", "mathml", "pages"]
exclude_patterns = ["site"]

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
smartquotes_action = "D"  # dashes only: quotes in commands are to be copied

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True, "undoc-members": False}
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
toc_object_entries = False  # their thousands make every page slow
maximum_signature_line_length = 88

html_theme = "furo"
html_title = f"trivet {release}"
html_static_path = ["site/static"]
html_css_files = ["trivet.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False


def setup(app: Sphinx) -> None:
    app.add_lexer("csv", TextLexer)
