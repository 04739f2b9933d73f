r"""Conversion of formulas to MathML, which browsers render without scripts or network.

docutils translates the LaTeX source and warns about unknown commands. It misreads arguments without braces, such as
`\frac12` or an accent with an index. `add_braces` adds the braces first.
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


def add_braces(tex: str) -> str:
    """Return a LaTeX formula with braces around arguments of fractions and accents, and spaces after functions."""
    braced = FRACTION.sub(lambda m: f"{m[1]}{{{m[2]}}}" + (f"{{{m[3]}}}" if m[3] else ""), tex)
    braced = ACCENT.sub(lambda m: f"{{{m[1]}{{{m[2] or m[3]}}}{{}}}}", braced)
    return FUNCTION.sub(r"\1\, ", braced)


def setup(app: Sphinx) -> None:
    """Register the Sphinx math renderer `mathml`."""
    app.add_html_math_renderer("mathml", (write_inline_formula, None), (write_displayed_formula, None))


def write_inline_formula(self: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a sentence as HTML."""
    self.body.append(_mathml(node, False))
    raise nodes.SkipNode


def write_displayed_formula(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula as HTML, with its number if it has a label."""
    number = node.get("number")
    ids = f' id="{node["ids"][0]}"' if node.get("ids") else ""
    label = f'<span class="eqno">({number})</span>' if number else ""
    self.body.append(f'<div class="math"{ids} tabindex="0">{_mathml(node, True)}{label}</div>\n')
    raise nodes.SkipNode


def _mathml(node: Any, display: bool) -> str:
    text = node.astext()
    try:
        found: str = tex2mathml(add_braces(text.strip()), as_block=display)
    except (MathError, OSError) as error:
        log.warning("a formula that docutils does not know: %s", error, location=node, type="softmark", subtype="math")
        return f"<code>{nodes.Text(text)}</code>"
    return found
