"""Earlier words of the language with their present names, for error messages and `dsl fmt --upgrade`.

To rename a word, add one line in the table of its kind. An old constructor or kind must not be a present one, and an
old field must not be a field of the constructors for which it is listed.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping

from softmark.grammar import tree
from softmark.grammar.diagnostic import Fix, Remedy

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
FIELDS = {"course": "amplitude"}  # old: new name of a field, for every constructor that has the new one
FIELDS_OF = {
    "fem": {"cap": "max_iterations", "finer": "refine_factor", "towards": "refine_at", "start": "initial_guess",
            "linear_cap": "max_linear_iterations"},
}  # fmt: skip
ALIASES = {
    "energy_norm": "relative_l2_error"
}  # second names of constructors that stay valid: this one is used by the 2008 paper


def find_renamed_field(constructor: str, name: str) -> str | None:
    """Return the present name of a constructor's field that was renamed, or None."""
    return FIELDS_OF.get(constructor, {}).get(name) or FIELDS.get(name)


def present_names() -> dict[str, str]:
    """Return the present names of all renamed constructors, kinds and fields, by their earlier names."""
    fields = {old: new for table in FIELDS_OF.values() for old, new in table.items()}
    return fields | KINDS | CONSTRUCTORS


def remedy(new: str) -> Remedy:
    """Return the remedy for an earlier word, which names the present word and the command that rewrites a scene."""
    return Remedy(f"it is called `{new}` now; `dsl fmt --upgrade FILE` rewrites a scene", Fix(new))


def upgrade(text: str, parsed: tree.Tree) -> str:
    """Return the text of a scene with every earlier word replaced by its present name, and nothing else changed."""
    for start, end, new in sorted(set(_find_replacements(parsed)), reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _find_replacements(parsed: tree.Tree) -> Iterator[tuple[int, int, str]]:
    """Yield start and end of each earlier word, and its present name."""
    names = {d.name: d for d in parsed.declarations if isinstance(d, tree.Declare | tree.Param)}
    for declaration in parsed.declarations:
        if isinstance(declaration, tree.Declare):
            if declaration.kind in KINDS:
                yield declaration.kind_span.start, declaration.kind_span.end, KINDS[declaration.kind]
            yield from _bare_word_replacement(declaration.value, names)
        for root in tree.expressions(declaration):
            for part, _ in tree.walk(root):
                if isinstance(part, tree.Call):
                    yield from _replacements_in_call(part, names)
                elif isinstance(part, tree.Name):
                    yield from _dotted_field_replacement(part, names)


def _replacements_in_call(call: tree.Call, names: Container[str]) -> Iterator[tuple[int, int, str]]:
    """Yield the earlier words in a call: its constructor, its fields, and amplitudes given by name only."""
    present = CONSTRUCTORS.get(call.function.text, call.function.text)
    if present != call.function.text:
        yield call.function.span.start, call.function.span.end, present
    for argument in call.arguments:
        new = find_renamed_field(present, argument.name or "")
        if new and argument.name_span is not None:
            yield argument.name_span.start, argument.name_span.end, new
        if argument.name in (*FIELDS, *FIELDS.values()):
            yield from _bare_word_replacement(argument.value, names)


def _bare_word_replacement(value: tree.Expression, names: Container[str]) -> Iterator[tuple[int, int, str]]:
    """Yield the earlier word of a constructor that is written without brackets and that the scene does not declare."""
    if isinstance(value, tree.Name) and value.text in CONSTRUCTORS and value.text not in names:
        yield value.span.start, value.span.end, CONSTRUCTORS[value.text]


def _dotted_field_replacement(
    name: tree.Name, names: Mapping[str, tree.Declare | tree.Param]
) -> Iterator[tuple[int, int, str]]:
    """Yield the earlier name of a field in `coarse.size`, the form in which studies name what they vary.

    Metrics keep their names.
    """
    owner = names.get(name.parts[0])
    if len(name.parts) != 2 or owner is None or not isinstance(owner.value, tree.Call) or name.parts[1] in names:
        return
    made = owner.value.function.text
    if (new := find_renamed_field(CONSTRUCTORS.get(made, made), name.parts[1])) is not None:
        yield name.span.end - len(name.parts[1]), name.span.end, new
