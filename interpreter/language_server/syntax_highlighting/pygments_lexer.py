"""Pygments lexers for scenes and messages, used by Sphinx, IPython, LaTeX (minted) and others.

Pygments finds them by the entry point `pygments.lexers`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pygments.lexer import Lexer, RegexLexer, bygroups
from pygments.token import (
    Comment,
    Generic,
    Keyword,
    Name,
    Number,
    Operator,
    Punctuation,
    String,
    Text,
)

from softmark.interpreter.language_server.syntax_highlighting.token_roles import parts

TOKENS = {
    "comment": Comment.Single, "reserved": Keyword, "kind": Keyword.Declaration, "declared": Name.Variable,
    "constructor": Name.Class, "function": Name.Function, "field": Name.Attribute, "constant": Name.Constant,
    "name": Name, "number": Number, "unit": Keyword.Type, "string": String, "operator": Operator,
    "bracket": Punctuation, "error": Generic.Error,  # not Error, which Sphinx refuses: pages also show invalid scenes
}  # fmt: skip


class SceneLexer(Lexer):  # type: ignore[misc]
    """Lexer of scenes, derived from the lexer of the language."""

    name = "softmark scene"
    aliases = ("scene", "softmark")
    filenames = ("*.scene",)
    mimetypes = ("text/x-softmark-scene",)
    url = "https://pypi.org/project/softmark"

    def get_tokens_unprocessed(self, text: str) -> Iterator[tuple[int, Any, str]]:
        """Yield offset, token type and text of each part."""
        end = 0
        for part in parts(text):
            if part.start > end:
                yield end, Text, text[end : part.start]
            yield part.start, TOKENS[part.role], part.text
            end = part.start + len(part.text)
        if end < len(text):
            yield end, Text, text[end:]


class MessageLexer(RegexLexer):  # type: ignore[misc]
    """Lexer of messages of `dsl` about a scene, with their place, cause and remedy."""

    name = "softmark messages"
    aliases = ("softmark-messages",)
    filenames = ()
    tokens = {  # noqa: RUF012
        "root": [
            (r"^(error)(\[E\d+\])?(:)(.*\n?)", bygroups(Generic.Error, Name.Label, Punctuation, Generic.Strong)),
            (r"^(warning)(\[W\d+\])?(:)(.*\n?)", bygroups(Keyword, Name.Label, Punctuation, Generic.Strong)),
            (r"^( +)(-->|:::)(.*\n?)", bygroups(Text, Punctuation, Comment)),
            (r"^( *= )(\w+)(:)(.*\n?)", bygroups(Punctuation, Keyword, Punctuation, Text)),
            (r"^( *\d* \|)( *)([\^~-]+)(.*\n?)", bygroups(Comment, Text, Generic.Error, Generic.Emph)),
            (r"^( *\d* \|)(.*\n?)", bygroups(Comment, Text)),
            (r".*\n|.+", Text),
        ]
    }
