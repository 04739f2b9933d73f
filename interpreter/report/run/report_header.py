"""Page header of a run's report: title, conclusion, outcome of the run, time and machine."""

from __future__ import annotations

from softmark.interpreter.report.page.html_document import date_html
from softmark.interpreter.report.page.html_markup import prose, tag, text
from softmark.interpreter.report.run import reused_results
from softmark.interpreter.report.run.report_summary import ReportSummary

SIGNS = {"good": "✓", "bad": "✗", "warn": "…"}


def header(findings: ReportSummary) -> str:
    """Return the HTML header of the report page."""
    mood, words = findings.status
    sign = tag("span", SIGNS[mood], class_="sign", aria_hidden="true")
    status = tag("p", sign, " ", prose(words + "."), class_=f"callout {mood}")
    above = tag("p", "softmark report", class_="eyebrow")
    conclusion = tag("p", prose(findings.conclusion), class_="conclusion")
    where = tag("p", _run_line(findings), class_="where")
    return tag(
        "header",
        above,
        tag("h1", text(title(findings))),
        conclusion,
        status,
        where,
        reused_results.note(findings.report),
    )


def title(findings: ReportSummary) -> str:
    """Return the title of the scene, or the name of its file."""
    scene = findings.report.scene
    return str(scene.get("title") or scene.get("file") or "Untitled scene")


def _run_line(findings: ReportSummary) -> str:
    """Return a line on time, scene and machine.

    For example: `21 November 2026, 08:33 UTC · silicone-beam.scene · AMD EPYC, 2 threads`.
    """
    env, scene = findings.report.environment, findings.report.scene
    threads = env.get("threads")
    machine = [str(env["cpu"])] if env.get("cpu") else []
    machine += [f"{threads} thread" + ("" if threads == 1 else "s")] if threads else []
    file = str(scene.get("file", "")).replace("\\", "/").rpartition("/")[2]
    pieces = [date_html(str(env.get("started", ""))), text(file), text(", ".join(machine))]
    return " · ".join(tag("span", piece) for piece in pieces if piece)
