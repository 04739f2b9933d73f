"""Instructions for an exam, as a text file next to the exam sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from softmark.grammar.diagnostic import make_visible
from softmark.interpreter.models.external.exporters import FORMATS, Format

FILE = "README.txt"


def readme_text(sheet: Mapping[str, Any], to: str) -> str:
    """Return the instructions: contents of the folder, how to solve the problems, and how results are evaluated."""
    scene = sheet["scene"]
    file = scene["standard"] or Path(scene["file"]).name
    lines = [
        make_visible(scene["title"]),
        "",
        f"Exported by softmark {sheet['softmark']} to {to}: {FORMATS[to].what}.",
        "exam.json contains the probe points, reference values there with their uncertainty, and the metrics and",
        "expectations of the scene, in SI units: m, s, N and Pa.",
        f"The other files here are in {FORMATS[to].units}.",
        "",
        *_requested_numbers(sheet["metrics"], FORMATS[to]),
        *(_model(name, own) for name, own in sheet["models"].items()),
        "",
        "Forces act on nodes of the undeformed body; their size and direction are constant unless stated otherwise",
        "below. Supports are given as fixed or prescribed nodal displacements.",
        "",
        "To assess a result as another model of the scene, from displacements in a result file (VTU, PVD,",
        "VTK, XDMF, .frd, CSV), or by deformed positions with `--at position`:",
        "",
        f"    dsl judge {file} RESULT --as NAME --unit {FORMATS[to].unit}",
        *(["", "Not exported, with the reason:"] if sheet["left"] else []),
        *(f"- {own['what']}: {own['why']}" for own in sheet["left"]),
    ]
    return "\n".join([*lines, ""])


def _requested_numbers(metrics: Mapping[str, Any], to: Format) -> Iterator[str]:
    """Yield a line for every requested number, with its unit in the sheet and in the result files."""
    same: dict[str, list[str]] = {}
    for name, own in metrics.items():
        same.setdefault(own["unit"], []).append(name)
    if same:
        yield "Requested values, in the unit of exam.json (and of the other files, if different):"
    for unit, names in same.items():
        there = f" ({to.unit_of(unit)})" if to.unit_of(unit) != unit else ""
        yield f"- {', '.join(names)}: {'a plain number' if unit == '1' else unit + there}"
    yield from [""] if same else []


def _model(name: str, own: Mapping[str, Any]) -> str:
    """Return lines on a model and its states, such as `linear_tet: linear_tet/job.inp (tet4, ..., 1148 nodes)`."""
    parts = "" if len(own["shares"]) == 1 else f", {len(own['shares'])} load levels in sequence"
    if "steps" in own:
        parts += f", {own['steps']} steps of {own['step']:g} s, by the program's own integrator"
    return f"{name}: {', '.join(own['files'])} ({own['element']}, {own['strain']} strain, {own['nodes']} nodes{parts})"
