"""What Sphinx is told of softmark: roles of words, messages and scenes, the language of blocks, and formulas."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from pygments.lexers import find_lexer_class_by_name
from pygments.lexers.special import TextLexer
from pygments.util import ClassNotFound
from sphinx.application import Sphinx

from softmark.interpreter.pages import formulas


def setup(app: Sphinx) -> dict[str, Any]:
    """Sphinx asks this of an extension."""
    for role in ("word", "message", "scene"):  # ```{word} fem marks a place, {word}`fem` leads there
        app.add_crossref_type(role, role, "single: %s", nodes.literal)
    for name in ("scene", "csv"):  # what Pygments may not know; ours comes by an entry point, once it is installed
        try:
            find_lexer_class_by_name(name)
        except ClassNotFound:
            app.add_lexer(name, TextLexer)
    formulas.setup(app)
    app.add_css_file("softmark.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
