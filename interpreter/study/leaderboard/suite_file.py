"""Suite files: each declaration makes a metric of a scene a case of the leaderboard.

    scene "A board of two cases"
    case lifted = judged("bend-45", by = off_lifted, kind = one_code, within = 2 %, asks = "How far out of its plane?")

Suite files are read by the parser of scenes. `kind` is the kind of the reference (`theory`, `measurement`, ...).
`within` is the largest error of a right answer, in the unit of the metric. Scenes are paths relative to the suite, or
names of the standard library. To add a field, write one line in FIELDS and one in Case.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import get_args

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.grammar.name_suggestions import nearest
from softmark.grammar.parser import parse
from softmark.grammar.tree import Span
from softmark.interpreter.language import units
from softmark.interpreter.language.units import Dimension, UnitError
from softmark.records import dataclass
from softmark.references.reference_base import Kind
from softmark.scenes import ROOT

SUFFIX = ".suite"
KINDS: tuple[str, ...] = get_args(Kind)  # kinds of references, as scenes write them
FIELDS: Mapping[str, tuple[type, str]] = {  # fields of a case after its scene, with their forms
    "by": (tree.Name, "a metric of the scene, such as `by = eta`"),
    "kind": (tree.Name, f"the kind of its reference: {', '.join(KINDS)}"),
    "within": (tree.Number, "the largest error of a correct result, such as `within = 2 %`"),
    "asks": (tree.String, 'the question in one line, such as `asks = "How far does it sag?"`'),
}
FORM = 'case lifted = judged("bend-45", by = off_lifted, kind = one_code, within = 2 %, asks = "...")'


@dataclass(frozen=True)
class Case:
    """Case of the leaderboard: a metric of a scene, and the largest error `within` of a right answer, SI, or None."""

    name: str
    scene: str  # as it is written
    by: str | None  # the metric; None: the first error of the scene
    kind: str | None = None  # of the reference, `one code`
    within: float | None = None
    dimension: Dimension = units.NONE
    asks: str = ""
    source: Source | None = None
    places: Mapping[str, Span] | None = None  # of its fields, and of its `scene`

    def fault(self, code: str, field: str, message: str, label: str, help: str) -> Diagnostic:
        """Return a diagnostic located at a field of the case, or at its `scene`."""
        return Diagnostic(code, message, self.source, (self.places or {}).get(field), label, help)


@dataclass(frozen=True)
class Suite:
    """Suite: a title and its cases; their scenes are searched in `folder`, then in the standard library."""

    title: str
    cases: tuple[Case, ...]
    folder: Path


def standard_suites() -> dict[str, Path]:
    """Return the suite files of the standard library by name.

    Each file has two names, such as `2026` and `std/suites/2026.suite`.
    """
    files = sorted((ROOT / "suites").glob(f"*{SUFFIX}"))
    return {name: f for f in files for name in (f.stem, f"std/suites/{f.name}")}


def is_suite(text: str) -> bool:
    """Return whether a text is a suite, because it declares cases; the file name does not matter."""
    return any(line.lstrip().startswith("case ") for line in text.splitlines())


def read_suite(source: Source, folder: Path) -> tuple[Suite | None, list[Diagnostic]]:
    """Return the suite that a text declares (None if it has errors), and the errors."""
    syntax, found = parse(source)
    title, cases = Path(source.name).stem, list[Case]()
    for node in syntax.declarations:
        if isinstance(node, tree.Title):
            title = node.text
        elif isinstance(node, tree.Declare) and node.kind == "case":
            if (case := _case(node, source, found)) is not None:
                cases.append(case)
        elif not isinstance(node, tree.Version):
            found.append(Diagnostic("E740", "a suite contains only cases", source, node.span, "not a case",
                                    f"write everything else in the scene of the case: `{FORM}`"))  # fmt: skip
    found += _find_duplicates(cases)
    if not cases and not found:
        start = Span(0, 0, 1, 1, 1, 1)
        found.append(Diagnostic("E740", "the suite has no case", source, start, help=f"declare one: `{FORM}`"))
    return (None if found else Suite(title, tuple(cases), folder)), found


def _find_duplicates(cases: list[Case]) -> list[Diagnostic]:
    """Return errors for cases with equal names, or with the same scene and metric."""
    names: set[str] = set()
    asked: dict[tuple[str, str | None], str] = {}
    found = []
    for case in cases:
        first = asked.setdefault((case.scene, case.by), case.name)
        if case.name in names:
            found.append(case.fault("E740", "name", f"`{case.name}` is declared twice", "the second one",
                                    "give each case its own name"))  # fmt: skip
        elif first != case.name:
            found.append(case.fault("E740", "name", f"`{case.name}` repeats `{first}`", "the same metric",
                                    "remove one of them: each case must have another metric or scene"))  # fmt: skip
        names.add(case.name)
    return found


def _case(node: tree.Declare, source: Source, found: list[Diagnostic]) -> Case | None:
    """Return the case that a declaration makes; if it is invalid, add the errors to `found` and return None."""

    def fail(span: Span, message: str, label: str, help: str) -> None:
        found.append(Diagnostic("E741", message, source, span, label, help))

    call = node.value
    if not isinstance(call, tree.Call) or call.function.text != "judged":
        fail(call.span, f"`{node.name}` has no `judged(...)`", "`judged(...)` expected", f"such as `{FORM}`")
        return None
    given: dict[str, tree.Expression] = {}
    places = {"name": node.name_span, "": call.span}
    for argument in call.arguments:
        name = argument.name or "scene"
        span, value = argument.name_span or argument.span, argument.value
        if name in given:
            fail(span, f"`{name}` is given twice", "given again", "a case has one scene, and each field once")
        elif name != "scene" and name not in FIELDS:
            close = nearest(name, FIELDS)
            hint = f"did you mean `{close}`?" if close else f"fields are {', '.join(FIELDS)}"
            fail(span, f"a case has no field `{name}`", "unknown field", hint)
        elif not isinstance(value, FIELDS[name][0] if name in FIELDS else tree.String):
            fail(value.span, f"`{name}` has an invalid value", "invalid", _expected_value(name))
        given[name], places[name] = value, value.span
    missing = [name for name in ("scene", *FIELDS) if name not in given]
    for name in missing:
        fail(call.span, f"`{node.name}` has no `{name}`", "missing", f"give {_expected_value(name)}")
    if any(d.span is not None and node.span.start <= d.span.start < node.span.end for d in found):
        return None
    return _make_case(node.name, given, source, places, found)


def _expected_value(name: str) -> str:
    return (
        FIELDS[name][1] if name in FIELDS else 'the scene as first argument, by its file or name, such as `"bend-45"`'
    )


def _make_case(
    name: str, given: Mapping[str, tree.Expression], source: Source, places: Mapping[str, Span], found: list[Diagnostic]
) -> Case | None:
    scene, by, kind, within, asks = (given[n] for n in ("scene", *FIELDS))
    match scene, by, kind, within, asks:
        case tree.String(), tree.Name(), tree.Name(), tree.Number(), tree.String():
            made = Case(name, scene.value, by.text, kind.text.replace("_", " "), asks=asks.value, source=source,
                        places=places)  # fmt: skip
        case _:  # refused before
            return None
    if kind.text not in KINDS:
        close = nearest(kind.text, KINDS)
        hint = f"did you mean `{close}`?" if close else f"kinds are {', '.join(KINDS)}"
        found.append(made.fault("E744", "kind", f"`{kind.text}` is not a kind of reference", "not known", hint))
        return None
    try:
        unit = units.parse_unit(within.unit.text) if within.unit else units.Measure(1.0, units.NONE)
    except UnitError as error:
        found.append(made.fault("E745", "within", error.problem, "not a unit", error.remedy))
        return None
    if not 0 < within.value < float("inf"):
        found.append(made.fault("E745", "within", "the tolerance is zero", "zero",
                                "give the largest error that still answers the question"))  # fmt: skip
        return None
    return replace(made, within=within.value * unit.factor, dimension=unit.dimension)
