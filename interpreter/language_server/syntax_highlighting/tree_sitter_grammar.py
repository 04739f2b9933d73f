"""Tree-sitter grammar as JSON with highlighting queries, for Neovim, Helix, Zed and others."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from softmark.interpreter.language_server.syntax_highlighting.highlighted_words import words

TITLE = "a tree-sitter grammar with queries for Helix, Neovim and Zed"


def files() -> dict[str, bytes]:
    """Return the grammar, the queries, and tree-sitter's configuration of both."""
    about = {
        "grammars": [{"name": "softmark", "scope": "source.softmark", "path": ".", "file-types": ["scene"],
                      "highlights": "queries/highlights.scm"}],
        "metadata": {"version": "0.1.0", "license": "Apache-2.0", "description": "Scenes of softmark"},
    }  # fmt: skip
    return {
        "src/grammar.json": (json.dumps(grammar(), indent=2, ensure_ascii=False) + "\n").encode(),
        "queries/highlights.scm": queries().encode(),
        "tree-sitter.json": (json.dumps(about, indent=2) + "\n").encode(),
    }


def install(folder: Path) -> str:
    """Return instructions on how to generate the tree-sitter parser from the files in `folder`."""
    return (
        f"In {folder}: tree-sitter generate src/grammar.json, then tree-sitter build; queries/ holds the highlighting."
    )


Node = dict[str, Any]  # a rule, as tree-sitter writes one in JSON


def seq(*members: Node) -> Node:
    """Return the rule of a sequence."""
    return {"type": "SEQ", "members": list(members)}


def choice(*members: Node) -> Node:
    """Return the rule of a choice of one member."""
    return members[0] if len(members) == 1 else {"type": "CHOICE", "members": list(members)}


def maybe(member: Node) -> Node:
    """Return the rule of an optional member."""
    return choice(member, {"type": "BLANK"})


def rule(name: str) -> Node:
    """Return a reference to another rule."""
    return {"type": "SYMBOL", "name": name}


def text(value: str) -> Node:
    """Return the rule of a fixed text."""
    return {"type": "STRING", "value": value}


def word(value: str) -> Node:
    """Return the rule of a reserved word with the blanks around it, so that it is not read as a unit after a number."""
    first = {"type": "PREC", "value": 1, "content": pattern(rf"[ \t]+{value}[ \t]+")}
    spaced = {"type": "IMMEDIATE_TOKEN", "content": first}
    return choice(text(value), {"type": "ALIAS", "content": spaced, "named": False, "value": value})


def pattern(value: str) -> Node:
    """Return the rule of a regular expression."""
    return {"type": "PATTERN", "value": value}


def many(member: Node) -> Node:
    """Return the rule of any number of repetitions."""
    return {"type": "REPEAT", "content": member}


def field_rule(name: str, member: Node) -> Node:
    """Return the rule of a member that becomes a named field of its node."""
    return {"type": "FIELD", "name": name, "content": member}


def prec_left(level: int, *members: Node) -> Node:
    """Return the rule of a left-associative sequence; among competing rules the one with the higher level wins."""
    return {"type": "PREC_LEFT", "value": level, "content": seq(*members)}


def comma_separated_rule(member: Node) -> Node:
    """Return the rule of a list separated by commas, with an optional comma after the last member."""
    return maybe(seq(member, many(seq(text(","), member)), maybe(text(","))))


LEVELS = {
    1: ("or",),
    2: ("and",),
    4: ("<", "<=", ">", ">=", "==", "!="),
    5: ("+", "-"),
    6: ("*", "/"),
}  # precedence
UNARY = {"not": 3, "+": 7, "-": 7}


def grammar() -> Node:
    """Return the grammar of `grammar/scene.lark`; line ends are ignored, since no scene depends on them."""
    factor = pattern(r"(%|°?[\p{L}]\w*)(\^[+-]?[0-9]+(\.[0-9]+)?)?")
    product = many(seq(pattern(r"[*/·]"), factor))
    below = seq(text("("), factor, product, text(")"))  # `J/(kg*K)`
    unit = seq(pattern(r"[ \t\u00a0\u2009\u202f]*"), factor, many(seq(pattern(r"[*/·]"), choice(factor, below))))
    expression = rule("_expression")
    operators = [
        prec_left(
            level,
            field_rule("left", expression),
            field_rule("operator", choice(*(word(o) if o.isalpha() else text(o) for o in own))),
            field_rule("right", expression),
        )
        for level, own in LEVELS.items()
    ]
    rules = {
        "scene": many(rule("_declaration")),
        "_declaration": choice(*map(rule, ("version", "title", "use", "param", "expect", "declare"))),
        "version": seq(text("softmark"), rule("number")),
        "title": seq(text("scene"), rule("string")),
        "use": seq(text("use"), rule("string"), text("as"), field_rule("name", rule("name"))),
        "param": seq(
            text("param"),
            field_rule("name", rule("name")),
            text("="),
            field_rule("value", expression),
            maybe(seq(word("in"), expression, text(".."), expression)),
        ),
        "expect": seq(text("expect"), expression),
        "declare": seq(
            field_rule("kind", rule("name")),
            field_rule("name", rule("name")),
            text("="),
            field_rule("value", expression),
        ),
        "_expression": choice(
            *map(
                rule,
                ("binary", "unary", "power", "quantity", "string", "path", "name", "call", "group", "vector", "series"),
            )
        ),
        "binary": choice(*operators),
        "unary": choice(
            *({"type": "PREC", "value": level, "content": seq(text(sign), expression)} for sign, level in UNARY.items())
        ),
        "power": {"type": "PREC_RIGHT", "value": 8, "content": seq(expression, text("^"), expression)},
        "quantity": seq(rule("number"), maybe(rule("unit"))),
        "call": {
            "type": "PREC",
            "value": 9,
            "content": seq(
                field_rule("function", choice(rule("name"), rule("path"))),
                text("("),
                comma_separated_rule(rule("argument")),
                text(")"),
            ),
        },
        "argument": choice(
            seq(field_rule("field", rule("name")), text("="), field_rule("value", expression)), expression
        ),
        "group": seq(text("("), expression, text(")")),
        "vector": seq(
            text("("), expression, text(","), comma_separated_rule(expression), text(")"), maybe(rule("unit"))
        ),
        "series": seq(text("["), comma_separated_rule(expression), text("]"), maybe(rule("unit"))),
        "number": pattern(r"([0-9]+(\.[0-9]+)?|\.[0-9]+|[0-9]+\.)([eE][+-]?[0-9]+)?"),
        "string": pattern(r'"([^"\\\r\n]|\\[^\r\n])*"'),
        "path": pattern(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+"),
        "name": pattern(r"[A-Za-z_]\w*"),
        "comment": pattern(r"#[^\r\n]*"),
        "unit": {"type": "IMMEDIATE_TOKEN", "content": unit},
    }
    blanks = pattern(r"[\s\u00a0\u2009\u202f\uFEFF]")
    return {"name": "softmark", "word": "name", "rules": rules, "extras": [blanks, rule("comment")], "conflicts": [],
            "precedences": [], "externals": [], "inline": [], "supertypes": []}  # fmt: skip


def queries() -> str:
    """Return the highlighting queries; if several match a word, the last one counts."""
    own = words()

    def one_of(names: list[str]) -> str:
        return " ".join(f'"{name}"' for name in names)

    return f"""\
(comment) @comment
(string) @string
(number) @number
(unit) @type
(name) @variable
((name) @constant (#any-of? @constant {one_of(own.constants)}))
(declare kind: (name) @keyword (#any-of? @keyword {one_of(own.kinds)}))
(declare name: (name) @variable)
(param name: (name) @variable)
(argument field: (name) @property)
(call function: (name) @function)
(call function: (name) @constructor (#any-of? @constructor {one_of(own.constructors)}))
(call function: (name) @function.builtin (#any-of? @function.builtin {one_of(own.functions)}))
[{one_of(own.reserved)}] @keyword
["=" "+" "-" "*" "/" "^" "<" "<=" ">" ">=" "==" "!=" ".."] @operator
["(" ")" "[" "]"] @punctuation.bracket
"""
