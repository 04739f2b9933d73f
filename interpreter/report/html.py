"""`render`: the whole page, one file that needs nothing else."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from importlib.resources import files

from softmark.interpreter.report import (
    centre_lines,
    comparison,
    convergence,
    deviation,
    histograms,
    histories,
    listing,
    provenance,
    published,
    realtime,
    refinement,
    shapes,
    verdicts,
)
from softmark.interpreter.report.findings import Findings
from softmark.interpreter.report.header import header, navigation, title
from softmark.interpreter.report.markup import plain, tag, text
from softmark.interpreter.report.plate import toggles
from softmark.interpreter.results import Report

# id of the section, its name in the navigation, who makes it ("" where it has nothing to show)
SECTIONS: tuple[tuple[str, str, Callable[[Findings], str]], ...] = (
    ("shapes", "Shapes", shapes.section_of),
    ("figure", "Centre lines", centre_lines.section_of),
    ("table", "Table", comparison.section_of),
    ("refinement", "Refinement", refinement.section_of),
    ("published", "Published", published.section_of),
    ("distribution", "Distribution", histograms.section_of),
    ("error", "Along the line", deviation.section_of),
    ("realtime", "Real time", realtime.section_of),
    ("histories", "Over time", histories.section_of),
    ("convergence", "Convergence", convergence.section_of),
    ("expectations", "Expectations", verdicts.expectations),
    ("warnings", "Warnings", verdicts.warnings),
    ("scene", "Scene", listing.section_of),
    ("provenance", "Provenance", provenance.section_of),
)
FOOTER = (
    "Made by softmark. Colours after Okabe and Ito (2008). All numbers in full, in SI, are in report.json."
)
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


def render(report: Report) -> str:
    """A complete HTML5 document: no network, no other file; without JavaScript shapes stand still and tooltips lack."""
    findings = Findings(report)
    made = [(key, name, make(findings)) for key, name, make in SECTIONS]
    main = tag("main", *(f"\n{markup}\n" for _, _, markup in made), id="content")
    skip = tag("a", "Skip to the results", href="#content", class_="skip")
    links = navigation([(key, name) for key, name, markup in made if markup])
    script = tag("script", *(_part(name) for name in _needed(main, "js")))
    body = tag("body", skip, header(findings), links, main, _footer(), script)
    return "<!DOCTYPE html>\n" + tag("html", _head(findings, _needed(main, "css")), body, lang="en") + "\n"


def _needed(main: str, kind: str) -> list[str]:
    """The parts of this package that a page needs; those that draw shapes only where there are some."""
    shapes = ["shapes.css"] if kind == "css" else ["raster.js", "shapes_controls.js", "shapes.js"]
    return [f"report.{kind}", *(shapes if 'class="shapes"' in main else ())]


def _head(findings: Findings, styles: list[str]) -> str:
    curves = 1 + len(findings.everyone)
    return tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="color-scheme", content="light dark"),
        tag("meta", name="description", content=plain(findings.conclusion)),
        tag("title", text(f"{title(findings)} – softmark report")),
        tag("style", *(_part(name) for name in styles), toggles(curves)),
    )


def _footer() -> str:
    return tag("footer", tag("p", text(FOOTER)))


@lru_cache(maxsize=8)
def _part(name: str) -> str:
    """A file of this package."""
    return files(__package__ or "").joinpath(name).read_text(encoding="utf-8")
