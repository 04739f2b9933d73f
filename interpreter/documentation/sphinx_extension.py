"""Sphinx extension of softmark: roles for words, messages and scenes, highlighting of scenes, and formulas."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from pygments.lexers.special import TextLexer
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import process_index_entry

from softmark.interpreter.documentation import mathml
from softmark.interpreter.language_server.syntax_highlighting.pygments_lexer import SceneLexer


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension with Sphinx and return its metadata."""
    for role in ("word", "message", "scene"):  # ```{word} fem marks a place, {word}`fem` leads there
        app.add_crossref_type(role, role, "single: %s", nodes.literal)
    app.add_lexer("scene", SceneLexer)
    app.add_lexer("csv", TextLexer)  # Pygments has no lexer for it
    app.add_directive("indexed", IndexDirective)
    mathml.setup(app)
    app.add_css_file("softmark.css")
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class IndexDirective(SphinxDirective):
    """Directive that adds index entries for its position, one per line: `single: young (field); fem`."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the index node with its entries, and the target node to which they lead."""
        target = nodes.target("", "", ids=[f"index-{self.env.new_serialno('index')}"])
        self.state.document.note_explicit_target(target)
        entries = [entry for line in self.content for entry in process_index_entry(line, target["ids"][0])]
        return [addnodes.index(entries=entries), target]
