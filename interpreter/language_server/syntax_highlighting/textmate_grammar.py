"""TextMate grammar with Oniguruma expressions, for VS Code, Sublime Text, JetBrains, GitHub and others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import NAME, NUMBER, any_of, words

TITLE = "a TextMate grammar for Sublime Text, JetBrains and others"
FILE = "scene.tmLanguage.json"


def files() -> dict[str, bytes]:
    """Return the grammar as JSON."""
    return {FILE: (json.dumps(grammar(), indent=2, ensure_ascii=False) + "\n").encode()}


def install(folder: Path) -> str:
    """Return instructions on how to install the TextMate grammar from `folder` in editors."""
    return (
        f"Sublime Text: copy {folder / FILE} to its folder Packages/User.\n"
        "JetBrains: unpack the .vsix of `dsl editor vscode`, and add its folder `extension` to its TextMate bundles."
    )


def grammar() -> dict[str, Any]:
    """Return the grammar, with its patterns in the order in which they are tried."""
    own = words()
    factor = r"(?:%|°?[[:alpha:]µμ]\w*)(?:\^[+-]?\d+(?:\.\d+)?)?"
    more = r"[*/·](?:\([\w*/^·-]+\)|[[:alpha:]µμ]\w*(?:\^[+-]?\d+(?:\.\d+)?)?)(?![\w(])"
    unit = rf"[ \t]*(?!(?:{any_of(own.reserved)})\b)({factor}(?:{more})*)"
    repository: dict[str, dict[str, Any]] = {
        "comment": {"name": "comment.line.number-sign.softmark", "match": "#.*$"},
        "declaration": {
            "match": rf"^\s*({any_of(own.kinds)})\s+({NAME})\s*(?==)",
            "captures": {"1": {"name": "storage.type.softmark"}, "2": {"name": "entity.name.type.softmark"}},
        },
        "named": {
            "match": rf"\b(param|as)\s+({NAME})",
            "captures": {"1": {"name": "keyword.control.softmark"}, "2": {"name": "entity.name.type.softmark"}},
        },
        "string": {
            "name": "string.quoted.double.softmark",
            "begin": '"',
            "end": '"|$',
            "patterns": [{"name": "constant.character.escape.softmark", "match": r'\\["\\]'}],
        },
        "quantity": {
            "match": rf"(?<![\w.])({NUMBER})(?:{unit})?",
            "captures": {"1": {"name": "constant.numeric.softmark"}, "2": {"name": "keyword.other.unit.softmark"}},
        },
        "vector": {"match": rf"(?<=[)\]]){unit}", "captures": {"1": {"name": "keyword.other.unit.softmark"}}},
        "reserved": {"name": "keyword.control.softmark", "match": rf"\b(?:{any_of(own.reserved)})\b"},
        "constructor": {"name": "support.class.softmark", "match": rf"\b(?:{any_of(own.constructors)})(?=\()"},
        "function": {"name": "support.function.softmark", "match": rf"\b(?:{any_of(own.functions)})(?=\()"},
        "call": {"name": "entity.name.function.softmark", "match": rf"\b{NAME}(?:\.{NAME})*(?=\()"},
        "field": {"name": "variable.parameter.softmark", "match": rf"\b{NAME}(?=\s*=(?!=))"},
        "constant": {"name": "support.constant.softmark", "match": rf"(?<![\w.])(?:{any_of(own.constants)})\b(?!\.\w)"},
        "name": {"name": "variable.other.softmark", "match": rf"\b{NAME}(?:\.{NAME})*"},
        "operator": {"name": "keyword.operator.softmark", "match": r"\.\.|[<>=!]=|[-+*/^<>=]"},
    }
    patterns = [{"include": f"#{name}"} for name in repository]
    return {"name": "softmark scene", "scopeName": "source.softmark", "fileTypes": ["scene"], "patterns": patterns,
            "repository": repository}  # fmt: skip
