"""Formulas as MathML, which browsers draw themselves: no script, no network.

docutils translates the LaTeX; what it does not know is a warning at its place. Of what TeX reads token by token it
takes too much: a fraction of two digits, an accent with an index. `spelt_out` gives it braces there.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

log = logging.getLogger(__name__)

TOKEN = r"(\\[A-Za-z]+|[^\s\\{}])"
FRACTION = re.compile(rf"(\\[tdc]?frac)\s*{TOKEN}\s*(?:{TOKEN}|(?=\{{))")
ACCENT = re.compile(rf"(\\(?:bar|hat|tilde|dot|ddot|vec|check|breve))(?![A-Za-z])\s*(?:{TOKEN}|\{{([^{{}}]*)\}})")
FUNCTION = re.compile(r"(\\(?:det|ln|log|exp|sin|cos|tan)|\\operatorname\{[^{}]*\})\s+(?=[A-Za-z\\])")


def spelt_out(tex: str) -> str:
    """The same formula with braces around what a fraction and an accent take, and room behind functions."""
    braced = FRACTION.sub(lambda m: f"{m[1]}{{{m[2]}}}" + (f"{{{m[3]}}}" if m[3] else ""), tex)
    braced = ACCENT.sub(lambda m: f"{{{m[1]}{{{m[2] or m[3]}}}{{}}}}", braced)
    return FUNCTION.sub(r"\1\, ", braced)


def setup(app: Sphinx) -> None:
    """The renderer `mathml`."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))


def inline(self: HTML5Translator, node: nodes.math) -> None:
    """A formula in a sentence."""
    self.body.append(_mathml(node, False))
    raise nodes.SkipNode


def block(self: HTML5Translator, node: nodes.math_block) -> None:
    """A formula on lines of its own, with its number where it has a label."""
    number = node.get("number")
    ids = f' id="{node["ids"][0]}"' if node.get("ids") else ""
    label = f'<span class="eqno">({number})</span>' if number else ""
    self.body.append(f'<div class="math"{ids} tabindex="0">{_mathml(node, True)}{label}</div>\n')
    raise nodes.SkipNode


def _mathml(node: Any, display: bool) -> str:
    text = node.astext()
    try:
        found: str = tex2mathml(spelt_out(text.strip()), as_block=display)
    except (MathError, OSError) as error:
        log.warning("a formula that docutils does not know: %s", error, location=node, type="softmark", subtype="math")
        return f"<code>{nodes.Text(text)}</code>"
    return found
