"""Formulas as MathML, which browsers draw themselves: no script, no network.

docutils translates the LaTeX; what it does not know is a warning at its place, and with `-W` an error.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

log = logging.getLogger(__name__)


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
        found: str = tex2mathml(text.strip(), as_block=display)
    except (MathError, OSError) as error:
        log.warning("a formula that docutils does not know: %s", error, location=node, type="softmark", subtype="math")
        return f"<code>{nodes.Text(text)}</code>"
    return found
