"""Earlier words of the language and their present names: an error names the new word, `dsl fmt --upgrade` writes it.

To rename a word: one line in the table of its kind. An old constructor or kind must not be a present one, and an old
field must not be a field of the constructors that it is listed for.
"""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy
from softmark.grammar.tree import Span

KINDS = {"course": "amplitude"}  # kinds of declarations
CONSTRUCTORS = {
    "apart": "disjoint", "bowl": "truncated_ellipsoid_shell", "bowl_section": "truncated_ellipsoid_section",
    "filled": "tetrahedralized", "tip": "rounded_cone",
    "viscous": "viscoelastic",
    "turned": "rotated", "follows": "measured_motion", "hinged": "pinned", "bedded": "elastic_foundation",
    "level": "rigid_plate",
    "between": "rigid_contact", "itself": "self_contact",
    "tension": "remote_stress",
    "state": "per_state",
    "outside": "external_solver", "outside_rod": "external_rod",
    "nodes": "mesh_nodes",
    "strain_energy_norm": "energy_norm_error", "course_norm": "trajectory_error", "realtime": "realtime_factor",
    "stability": "robustness",
}  # fmt: skip
FIELDS = {"course": "amplitude"}  # of every constructor that has the new one
FIELDS_OF = {
    "fem": {"cap": "max_iterations", "finer": "refine_factor", "towards": "refine_at", "start": "initial_guess",
            "linear_cap": "max_linear_iterations"},
}  # fmt: skip
ALIASES = {"energy_norm": "relative_l2_error"}  # other names of a constructor that stay: this one is of the 2008 paper


def find_renamed_field(constructor: str, name: str) -> str | None:
    """Return the present name of a field with an earlier name, or None."""
    return FIELDS_OF.get(constructor, {}).get(name) or FIELDS.get(name)


def present_name(word: str) -> str | None:
    """Return the present name of an earlier constructor, kind or field, or None."""
    fields = {old: new for table in FIELDS_OF.values() for old, new in table.items()}
    return CONSTRUCTORS.get(word) or KINDS.get(word) or fields.get(word)


def remedy(new: str) -> Remedy:
    """Return the remedy for an earlier word: its present name, and the command that rewrites a scene."""
    return Remedy(f"it is called `{new}` now; `dsl fmt --upgrade FILE` rewrites a scene", Fix(new))


def upgrade(text: str, parsed: tree.Tree) -> str:
    """Return a scene with every earlier word replaced by its present name; nothing else changes."""
    for span, new in sorted(set(_replacements(parsed)), key=lambda found: found[0].start, reverse=True):
        text = text[: span.start] + new + text[span.end :]
    return text


def _replacements(parsed: tree.Tree) -> Iterator[tuple[Span, str]]:
    """Yield the place of each earlier word and its present name."""
    declared = {d.name: d for d in parsed.declarations if isinstance(d, tree.Declare)}
    names = {d.name for d in parsed.declarations if isinstance(d, tree.Declare | tree.Param)}
    for declaration in parsed.declarations:
        if isinstance(declaration, tree.Declare):
            if declaration.kind in KINDS:
                yield declaration.kind_span, KINDS[declaration.kind]
            yield from _bare(declaration.value, names)
        for part in _expressions(declaration):
            yield from _in_expression(part, declared, names)


def _expressions(declaration: tree.Declaration) -> Iterator[tree.Expression | tree.Argument]:
    """Yield every expression and argument of a declaration, outermost first."""
    match declaration:
        case tree.Declare() | tree.Param():
            found = [declaration.value]
        case tree.Expect():
            found = [declaration.condition]
        case _:
            return
    if isinstance(declaration, tree.Param):
        found += [limit for limit in (declaration.low, declaration.high) if limit is not None]
    for root in found:
        for part, _ in tree.walk(root):
            yield part


def _in_expression(
    part: tree.Expression | tree.Argument, declared: dict[str, tree.Declare], names: set[str]
) -> Iterator[tuple[Span, str]]:
    if isinstance(part, tree.Call):
        function = part.function
        if function.text in CONSTRUCTORS:
            yield function.span, CONSTRUCTORS[function.text]
        present = CONSTRUCTORS.get(function.text, function.text)
        for argument in part.arguments:
            new = find_renamed_field(present, argument.name or "")
            if new and argument.name_span is not None:
                yield argument.name_span, new
            if argument.name in (*FIELDS, *FIELDS.values()):
                yield from _bare(argument.value, names)
    elif isinstance(part, tree.Name) and len(part.parts) == 2 and part.parts[0] in declared:
        owner, field = part.parts
        value = declared[owner].value
        made = value.function.text if isinstance(value, tree.Call) else ""
        new = find_renamed_field(CONSTRUCTORS.get(made, made), field)
        if new:
            start = part.span.end - len(field)
            yield Span(start, part.span.end, *_line_and_column(part.span, start)), new


def _bare(value: tree.Expression, names: set[str]) -> Iterator[tuple[Span, str]]:
    """Yield a constructor that is written without brackets and is no name of the scene."""
    if isinstance(value, tree.Name) and value.text in CONSTRUCTORS and value.text not in names:
        yield value.span, CONSTRUCTORS[value.text]


def _line_and_column(span: Span, start: int) -> tuple[int, int, int, int]:
    column = span.column + start - span.start
    return span.line, column, span.end_line, span.end_column
