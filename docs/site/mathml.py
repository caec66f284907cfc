"""Formulae as MathML, which browsers show by themselves, without a script.  `\\tag{7}` numbers one, as it does on GitHub."""

from __future__ import annotations

import re

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

TAG = re.compile(r"\\tag\{(.*?)\}")
DOTTED = re.compile(r"<munderover>\s*(<mi>.*?</mi>)\s*(.*?)\s*(<mo[^>]*>[˙¨]</mo>)\s*</munderover>", re.DOTALL)
"""A letter with dots and an index, which docutils puts under it."""


def shown(formula: str, as_block: bool) -> str:
    """A formula as MathML."""
    return DOTTED.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', tex2mathml(formula, as_block=as_block))


def inline(writer: HTML5Translator, node: nodes.math) -> None:
    writer.body.append(shown(node.astext(), as_block=False))
    raise nodes.SkipNode


def block(writer: HTML5Translator, node: nodes.math_block) -> None:
    text = node.astext()
    tag = TAG.search(text)
    formula = shown(TAG.sub("", text), as_block=True)
    number = f'<a class="number" id="eq-{tag[1]}" href="#eq-{tag[1]}">({tag[1]})</a>' if tag else ""
    writer.body.append(f'<div class="formula">{formula}{number}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
