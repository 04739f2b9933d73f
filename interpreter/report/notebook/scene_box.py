"""Notebook display of a scene: parameters, declarations, warnings and text."""

from __future__ import annotations

from collections.abc import Sequence

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.scene_sources import standard_name
from softmark.interpreter.report.notebook.box_frame import LARGEST, ROWS, render_box, table
from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_markup import count, join_names, prose, tag, text
from softmark.interpreter.report.run.tables import expectation_table
from softmark.interpreter.report.run.tables.scene_listing import colour_line, value_shown
from softmark.interpreter.results.prompt_representation import shorten
from softmark.interpreter.results.run_report import ReportWarning

KINDS = ("body", "material", "model", "reference", "probe", "metric", "study")  # kinds shown, in this order
LINES = 200  # largest number of lines of the text


def inline(scene: Scene, warnings: Sequence[Diagnostic]) -> str:
    """Return the display of a scene as HTML of bounded size."""
    parts = [
        tag("p", prose(_not_run_note(scene))),
        _warning_summary(warnings),
        _parameters(scene),
        _declaration_table(scene),
        _text(scene),
    ]
    return render_box(scene.title or scene.source.name, *parts)


def _not_run_note(scene: Scene) -> str:
    file = standard_name(scene.path) or scene.path or scene.source.name
    return f"`{shorten(file)}`: {count(len(scene.expectations), 'expectation')}; not computed yet, call `run()`."


def _warning_summary(warnings: Sequence[Diagnostic]) -> str:
    """Return the number of warnings as HTML, and the first warnings."""
    if not warnings:
        return ""
    said = [ReportWarning(d.code, d.message, d.span.line if d.span else None, d.help) for d in warnings[:ROWS]]
    return details(count(len(warnings), "warning"), expectation_table.warning_list(said))


def _parameters(scene: Scene) -> str:
    from softmark.interpreter.pipeline.run_environment import describe_scene

    known = describe_scene(scene)
    rows = [
        tag("tr", tag("th", tag("code", text(name)), scope="row"), tag("td", text(value_shown(p))),
            tag("td", "given" if name in known["overridden"] else "of the scene"))
        for name, p in list(known["parameters"].items())[:ROWS]
    ]  # fmt: skip
    return table("Parameters", ("Parameter", "Value", "From"), rows) if rows else ""


def _declaration_table(scene: Scene) -> str:
    """Return the declared names of each kind with their constructors, as HTML."""
    rows = [_kind(kind, own) for kind in KINDS if (own := scene.of_kind(kind))]
    return table("Declarations of the scene", ("Kind", "Names"), rows) if rows else ""


def _kind(kind: str, own: dict[str, Declared]) -> str:
    names = [f"`{shorten(name)}` ({shorten(d.constructor.name)})" for name, d in list(own.items())[:ROWS]]
    names += [f"{len(own) - ROWS} more"] if len(own) > ROWS else []
    return tag("tr", tag("th", text(kind), scope="row"), tag("td", prose(join_names(names))))


def _text(scene: Scene) -> str:
    lines = scene.source.text[: LARGEST // 10].splitlines()
    shown = "\n".join(colour_line(line) for line in lines[:LINES])
    left = scene.source.text.count("\n") + 1 - LINES
    more = tag("p", f"{left} more lines are in the file.", class_="quiet") if left > 0 else ""
    return details("Text of the scene", tag("pre", tag("code", shown)), more)
