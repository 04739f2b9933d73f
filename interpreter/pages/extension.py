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
    try:
        find_lexer_class_by_name("scene")
    except ClassNotFound:  # the lexer comes by an entry point, which a copy that is not installed does not have
        app.add_lexer("scene", TextLexer)
    formulas.setup(app)
    app.add_css_file("softmark.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}
