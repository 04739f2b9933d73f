"""Locations of warnings relative to the declaration that they concern, which may have moved in the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic, SecondaryPlace, Source
from softmark.grammar.tree import Span

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Location, Scene

Json = Mapping[str, Any]


class NoDeclaration(Exception):
    """Error: a warning is located outside all declarations."""


def to_json(found: Diagnostic, scene: Scene) -> dict[str, Any]:
    """Return a warning as JSON, with locations relative to declarations. Raises NoDeclaration."""
    return {
        "code": found.code, "message": found.message, "label": found.label, "help": found.help,
        "notes": list(found.notes), "at": _relative_location(found.source, found.span, scene),
        "also": [{"label": s.label, "at": _relative_location(s.source, s.span, scene)} for s in found.also],
    }  # fmt: skip


def from_json(own: Json, scene: Scene) -> Diagnostic:
    """Return the warning that JSON describes, located in the given scene. Raises LookupError."""
    source, span = _absolute_location(own["at"], scene)
    also = []
    for second in own["also"]:
        where, there = _absolute_location(second["at"], scene)
        if where is None or there is None:
            raise LookupError("a second place is nowhere")
        also.append(SecondaryPlace(where, there, second["label"]))
    return Diagnostic(
        own["code"], own["message"], source, span, own["label"], own["help"], tuple(own["notes"]), tuple(also)
    )


def _relative_location(source: Source | None, span: Span | None, scene: Scene) -> list[Any] | None:
    """Return the location of a span relative to the declaration and field that contain it; None without a span."""
    if source is None or span is None:
        return None
    for name, field, at in _declaration_locations(scene):
        if at.source == source and at.span.start <= span.start and span.end <= at.span.end:
            return [name, field, *_shift_span(span, at.span, -1)]
    raise NoDeclaration(f"{source.name}:{span.line}")


def _absolute_location(at: list[Any] | None, scene: Scene) -> tuple[Source | None, Span | None]:
    if at is None:
        return None, None
    name, field, *offsets = at
    declared = scene.declared[name]
    anchor = declared.fields[field] if field else declared.location
    return anchor.source, Span(*_shift_span(Span(*offsets), anchor.span, 1))


def _declaration_locations(scene: Scene) -> Iterator[tuple[str, str, Location]]:
    for name, declared in scene.declared.items():
        yield name, "", declared.location
        yield from ((name, field, at) for field, at in declared.fields.items())


def _shift_span(span: Span, begin: Span, sign: int) -> tuple[int, int, int, int, int, int]:
    """Return a span relative to its anchor `begin` (sign -1), or the absolute span again (sign 1).

    Columns are relative only in the first line.
    """
    first = 0 if sign > 0 else begin.line

    def column(line: int, column: int) -> int:
        return column + sign * (begin.column if line == first else 0)

    return (
        span.start + sign * begin.start, span.end + sign * begin.start,
        span.line + sign * begin.line, column(span.line, span.column),
        span.end_line + sign * begin.line, column(span.end_line, span.end_column),
    )  # fmt: skip
