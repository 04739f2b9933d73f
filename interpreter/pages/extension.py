"""What Sphinx is told of softmark: roles of words, messages and scenes, the language of blocks, and formulas."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from pygments.lexers import find_lexer_class_by_name
from pygments.lexers.special import TextLexer
from pygments.util import ClassNotFound
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import process_index_entry

from softmark.interpreter.editor.colours.pygments_lexer import SceneLexer
from softmark.interpreter.pages import formulas


def setup(app: Sphinx) -> dict[str, Any]:
    """Sphinx asks this of an extension."""
    for role in ("word", "message", "scene"):  # ```{word} fem marks a place, {word}`fem` leads there
        app.add_crossref_type(role, role, "single: %s", nodes.literal)
    app.add_lexer("scene", SceneLexer)
    try:
        find_lexer_class_by_name("csv")
    except ClassNotFound:  # which Pygments may not know
        app.add_lexer("csv", TextLexer)
    app.add_directive("indexed", Indexed)
    formulas.setup(app)
    app.add_css_file("softmark.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Indexed(SphinxDirective):
    """Entries of the index that lead to here, a line each: `single: young (field); fem`."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """The entries, and the place that they lead to."""
        target = nodes.target("", "", ids=[f"index-{self.env.new_serialno('index')}"])
        self.state.document.note_explicit_target(target)
        entries = [entry for line in self.content for entry in process_index_entry(line, target["ids"][0])]
        return [addnodes.index(entries=entries), target]
