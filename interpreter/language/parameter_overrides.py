"""Overrides: `-p L=120mm` and `-p silicone.young=30kPa` on the command line, and the values of a sweep."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source, did_you_mean, make_encodable
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language import field_schema
from softmark.interpreter.language.expression_evaluation import SourceErrors
from softmark.interpreter.language.scene_sources import ModuleTable
from softmark.records import dataclass


@dataclass(frozen=True)
class Override:
    """Expression that replaces the value of a parameter or a field: `-p NAME=VALUE`.

    `written` is how the user writes such an override, for messages; `text` is `NAME=VALUE`.
    """

    name: str
    node: tree.Expression
    place: SourceErrors
    name_span: tree.Span
    written: str = "-p {}=VALUE"
    text: str = ""

    def example(self, name: str) -> str:
        """Return how to write an override of another name in the same form."""
        return self.written.format(name)


def read_overrides(texts: Sequence[str], diagnostics: list[Diagnostic]) -> list[Override]:
    """Parse the overrides of a command line; report and leave out those that cannot be parsed."""
    found = (read_override(text, diagnostics) for text in texts)
    return [override for override in found if override is not None]


def read_override(text: str, diagnostics: list[Diagnostic], option: str = "-p") -> Override | None:
    """Parse `NAME=VALUE` as an override; return None, with the error in the list, if it cannot be parsed."""
    text = make_encodable(text)
    shown = Source(f"{option} {text}", text)
    place = SourceErrors(shown, diagnostics)
    name, equals, value = text.partition("=")
    span = tree.Span(0, len(name), 1, 1, 1, 1 + len(name))
    if not equals or not name.strip():
        missing = "`=` and a value are missing" if not equals else "the name is missing"
        place.error("E220", span, "an override has the form `NAME=VALUE`", missing, f"for example `{option} L=120mm`")
        return None
    if not value.strip():
        after = tree.Span(len(text), len(text), 1, 1 + len(text), 1, 1 + len(text))
        place.error(
            "E220",
            after,
            "an override has the form `NAME=VALUE`",
            "the value is missing",
            f"for example `{option} {name.strip()}=120mm`",
        )
        return None
    # blanks instead of `NAME=`, so that spans count from the start of the argument
    node, problems = parse_expression(Source(shown.name, " " * (len(name) + 1) + value))
    diagnostics.extend(Diagnostic(p.code, p.message, shown, p.span, p.label, p.help, p.notes) for p in problems)
    if node is None:
        return None
    return Override(name.strip(), node, place, span, f"{option} {{}}=VALUE", text)


def assign_overrides(overrides: Sequence[Override], table: ModuleTable) -> dict[str, Override]:
    """Return overrides by the parameter or field (`declared.field`) that they replace; the last one counts."""
    found = {}
    for override in overrides:
        owner = override.name.rpartition(".")[0]
        symbol, declared = table.symbols.get(override.name), table.symbols.get(owner)
        if table.is_broken(override.name):
            continue  # its own declaration is reported already
        if symbol is not None and isinstance(symbol.node, tree.Param):
            found[override.name] = override
        elif declared is not None and isinstance(declared.node, tree.Declare):
            if isinstance(declared.node.value, tree.Name):
                _report_alias_override(override, owner, declared.node.value)
            found[override.name] = override
        else:
            _report_unknown_override(override, table)
    return found


def _report_alias_override(override: Override, owner: str, original: tree.Name) -> None:
    field = override.name.rpartition(".")[2]
    problem = f"`{owner}` has no fields of its own, it is another name for `{original.text}`"
    override.place.error(
        "E205",
        override.name_span,
        problem,
        "not a field",
        f"replace the field of the original: `{override.example(f'{original.text}.{field}')}`",
    )


def _report_unknown_override(override: Override, table: ModuleTable) -> None:
    parameters = [n for n, s in table.symbols.items() if isinstance(s.node, tree.Param)]
    known = table.symbols.get(override.name)
    if known is not None and isinstance(known.node, tree.Declare):
        kind = f"{field_schema.article(known.node.kind)} {known.node.kind}"
        override.place.error(
            "E213",
            override.name_span,
            f"`{override.name}` is {kind}, not a parameter",
            kind,
            f"replace one of its fields: `{override.example(f'{override.name}.FIELD')}`",
        )
        return
    close = nearest(override.name, parameters) or nearest(override.name, table.symbols)
    owner, _, field = override.name.rpartition(".")
    if close is None and (meant := nearest(owner, table.symbols)) is not None:
        close = f"{meant}.{field}"
    listed = ", ".join(parameters) or "none"
    hint = did_you_mean(close) if close else f"parameters of the scene: {listed}"
    override.place.error(
        "E201", override.name_span, f"`{override.name}` is not a parameter of the scene", "not found", hint
    )
