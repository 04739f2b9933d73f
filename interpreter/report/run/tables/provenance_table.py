"""Provenance of a run: data needed to repeat it, and facts on which its numbers may depend."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_markup import section, tag, text
from softmark.interpreter.report.run.report_summary import ReportSummary
from softmark.interpreter.report.run.tables.scene_listing import colour_line

WORDS = {
    "softmark": "softmark", "python": "Python", "numpy": "NumPy", "scipy": "SciPy", "numba": "Numba",
    "platform": "Platform", "cpu": "Processor", "threads": "Threads", "started": "Started (UTC)",
}  # fmt: skip


def section_of(findings: ReportSummary) -> str:
    """Return the HTML section with the command, the digest of the scene, and the environment."""
    rows = [tag("tr", tag("th", text(n), scope="row"), tag("td", text(v))) for n, v in _facts(findings)]
    table = tag("table", tag("caption", "Environment"), tag("tbody", *rows), class_="facts")
    repeat = tag("pre", tag("code", text(command(findings))), class_="command")
    box = tag("div", table, class_="scroll")
    return section("provenance", "Provenance", tag("p", "To rerun:"), repeat, box)


def table_of(environment: Mapping[str, Any]) -> str:
    """Return the environment as an HTML table; empty if it is not known."""
    facts = [(WORDS.get(k, k), v) for k, v in environment.items()]
    rows = [tag("tr", tag("th", text(n), scope="row"), tag("td", text(v))) for n, v in facts]
    table = tag("table", tag("caption", "Environment"), tag("tbody", *rows), class_="facts")
    return tag("div", table, class_="scroll") if rows else ""


def scene_listing(scene: Mapping[str, Any]) -> str:
    """Return the text of a scene with its digest as HTML that opens on demand."""
    lines = [tag("span", colour_line(line), "\n", class_="line") for line in str(scene.get("text") or "").splitlines()]
    whole = tag("pre", tag("code", *lines), class_="scene", tabindex=0, role="region", aria_label="Text of the scene")
    digest = tag("p", f"SHA-256 {text(scene.get('sha256') or '–')}", class_="quiet digest")
    title = scene_name(scene, str(scene.get("title") or "scene"))
    return details(
        f"Scene: {title}", digest, whole if lines else tag("p", "The text is not available.", class_="quiet")
    )


def scene_name(scene: Mapping[str, Any], otherwise: str) -> str:
    """Return the name of a scene for a command: its name in the standard library, its file, or `otherwise`."""
    return str(scene.get("standard") or scene.get("file") or otherwise)


def _facts(findings: ReportSummary) -> list[tuple[str, str]]:
    scene, report = findings.report.scene, findings.report
    facts = [("Scene", scene_name(scene, "–")), ("SHA-256 of its text", scene.get("sha256", "–"))]
    facts += [(WORDS.get(key, key), value) for key, value in report.environment.items()]
    solvers = sorted({str(s) for m in report.models.values() if (s := m.solve.get("linear_solver"))})
    facts += [("Linear solver", ", ".join(solvers))] if solvers else []
    programs = sorted({str(p) for m in report.models.values() if (p := m.solve.get("program"))})
    facts += [("Other programs", ", ".join(programs))] if programs else []
    return [(name, str(value)) for name, value in facts]


def command(findings: ReportSummary) -> str:
    """Return the command that repeats the run, `dsl run FILE -p h=3mm --model rod`, quoted for a shell.

    A scene without a file is read from standard input.
    """
    file = scene_name(findings.report.scene, "-")
    parts = ["dsl", "run", "-" if file.startswith("<") else file]
    parts += [part for override in _overrides(findings) for part in ("-p", override)]
    parts += [part for name in _requested_models(findings) for part in ("--model", name)]
    times = [timing for m in findings.report.models.values() if (timing := m.time.get("solve_s"))]
    runs = max((timing.runs for timing in times), default=1)
    return shlex.join([*parts, "--repeat", str(runs)] if runs > 1 else parts)


def _overrides(findings: ReportSummary) -> list[str]:
    """Return the overrides of the command line or, if these are not known, the overridden parameters."""
    scene = findings.report.scene
    given = scene.get("overrides")
    if given is not None:
        return [str(override) for override in given]
    parameters = scene.get("parameters") or {}
    return [f"{n}={parameters[n].get('text', '')}" for n in scene.get("overridden") or () if n in parameters]


def _requested_models(findings: ReportSummary) -> list[str]:
    """Return the requested models; empty if the report has all models of the scene."""
    declared = set(findings.report.names.of_kind("model"))
    run = list(findings.report.models)
    return run if not findings.report.partial and run and declared - set(run) else []
