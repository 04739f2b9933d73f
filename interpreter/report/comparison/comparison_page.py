"""HTML page of `dsl compare`: one self-contained file that starts with the recommendation."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from softmark.interpreter.report.comparison import comparison_tables, cost_figure, study_answers
from softmark.interpreter.report.comparison.comparison_view import SceneView, separate_problems_note, status_of, views
from softmark.interpreter.report.comparison.work_precision_diagram import Diagram, diagram_legend, has_step_times
from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_document import date_html, document
from softmark.interpreter.report.page.html_markup import count, join_names, prose, section, strip_backticks, tag, text
from softmark.interpreter.report.run.tables.provenance_table import scene_listing, table_of
from softmark.interpreter.study.analysis.comparison_advice import Advice
from softmark.interpreter.study.analysis.comparison_record import ComparisonRecord
from softmark.interpreter.study.configurations.task_outcome import PointWarning

OPEN = 40  # configurations beyond which their table is folded


def page(comparison: ComparisonRecord) -> str:
    """Return the page as a complete HTML5 document that needs no network and no other files."""
    own = views(comparison)
    return document(
        f"{title(own)} – softmark comparison",
        strip_backticks(conclusion(own)),
        _header(own, comparison),
        [(name, make(own, comparison)) for name, make in SECTIONS],
        "compare.json",
        max((len(view.lines) for view in own), default=0),
        ["report.css", "compare.css"],
        ["report.js"],
    )


def title(own: Sequence[SceneView]) -> str:
    """Return the titles of the compared scenes in one line."""
    titles = list(dict.fromkeys(view.title for view in own))
    return (
        join_names(titles) if 0 < len(titles) <= 3 else count(len(titles), "scene") if titles else "Nothing to compare"
    )


def conclusion(own: Sequence[SceneView]) -> str:
    """Return a sentence that counts configurations, such as `9 configurations of 3 models, 8 of them solved.`."""
    points = [p for view in own for p in view.points]
    if not points:
        return "No configurations."
    models = len({(p.scene, p.model) for p in points})
    solved = sum(p.solved for p in points)
    rest = "all of them solved" if solved == len(points) else f"{solved} of them solved" if solved else "none solved"
    return f"{count(len(points), 'configuration')} of {count(models, 'model')}, {rest}."


def _header(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
    where = [date_html(comparison.created), text(comparison.environment.get("cpu") or "")]
    line = tag("p", " · ".join(tag("span", piece) for piece in where if piece), class_="where")
    above = tag("p", "softmark comparison", class_="eyebrow")
    said = tag("p", prose(conclusion(own)), class_="conclusion")
    return tag("header", above, tag("h1", text(title(own))), said, line)


# ------------------------------------------------------------------ sections


def _advice(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
    """Return the HTML section with the recommendations."""
    return section("advice", "Advice", advice(own, comparison))


def advice(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
    """Return the recommendations for all scenes as HTML, each with its caveats below."""
    blocks = []
    allowed = comparison.analysis.options.allow_contaminated
    for view in own:
        items = [tag("li", _recommendation_html(a), class_=None if a.winner else "none") for a in view.analysis.advice]
        said = tag("ul", *items, class_="advice") if items else tag("p", prose(view.no_advice_reason), class_="quiet")
        rest = [tag("p", prose(d.text), class_="callout warn") for d in view.analysis.disagreements]
        blocks.append(
            _with_scene_title(view, own, said + "".join(rest) + cost_figure.timing_quality_html(view, allowed))
        )
    said = separate_problems_note(own)
    blocks = [tag("p", prose(said), class_="lead"), *blocks] if said else blocks
    return "".join(blocks) or tag("p", "No recommendation is possible.", class_="quiet")


def _recommendation_html(advice: Advice) -> str:
    """Return one recommendation as HTML, with its caveats below."""
    return prose(advice.sentence) + "".join(tag("small", prose(caveat)) for caveat in advice.caveats)


def _with_scene_title(view: SceneView, own: Sequence[SceneView], markup: str) -> str:
    """Return HTML under the title of its scene; the title is omitted if there is only one scene."""
    return (tag("h3", text(view.heading)) if len(own) > 1 else "") + markup if markup else ""


def _diagrams(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
    drawn = diagrams(own)
    return section("work", "Work and precision", drawn) if drawn else ""


def diagrams(own: Sequence[SceneView]) -> str:
    """Return the diagrams of error against effort as HTML, with the failures below; empty without configurations."""
    return "".join(_with_scene_title(view, own, _figures(view) + _failures(view)) for view in own if view.points)


def _figures(view: SceneView) -> str:
    if not view.metrics:
        return ""
    figures = [Diagram(view, i, metric).figure() for i, metric in enumerate(view.metrics)]
    if has_step_times(view):
        figures += [Diagram(view, i, metric, frames=True).figure() for i, metric in enumerate(view.metrics)]
    lead = (
        "Lower left is better: smaller error, less time."
        if view.timed
        else "No times were measured, so errors are plotted against the number of unknowns."
    )
    return tag("p", lead, class_="lead") + diagram_legend(view) + "".join(figures)


def _failures(view: SceneView) -> str:
    """Return the configurations without a solution as HTML, with the reasons."""
    entries = {(f.label, f.message): f for f in view.analysis.failures}.values()
    if not entries:
        return ""
    items = []
    for f in entries:
        who = "reference " if f.kind == "reference" else ""
        message = prose(f.message or "no reason given")
        items.append(tag("li", text(who), tag("code", text(f.label)), f" {text(status_of(f.status))}: ", message))
    title = tag("p", tag("b", f"✗ {count(len(items), 'failure')}"))
    return tag("div", title, tag("ul", *items, class_="failures"), class_="callout bad")


def _make_section_builder(
    make: Callable[[SceneView], str], name: str, title: str
) -> Callable[[Sequence[SceneView], ComparisonRecord], str]:
    """Return a function that makes a section with the table `make(view)` of every scene."""

    def made(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
        blocks = [_with_scene_title(view, own, make(view)) for view in own if view.points]
        return section(name, title, *blocks) if any(blocks) else ""

    return made


def _points(view: SceneView) -> str:
    own = comparison_tables.all_points(view)
    return own if len(view.points) <= OPEN else details(f"{len(view.points)} configurations", own)


def _change_effect_table(view: SceneView) -> str:
    own = comparison_tables.change_effects(view)
    return own if len(view.analysis.levers) <= OPEN else details(f"{len(view.analysis.levers)} changes", own)


def _provenance(own: Sequence[SceneView], comparison: ComparisonRecord) -> str:
    """Return the HTML section with the command, the environment, the references and the scenes."""
    again = tag("p", "To rerun this comparison:")
    repeat = again + tag("pre", tag("code", text(comparison.command)), class_="command") if comparison.command else ""
    scenes = [scene_listing(scene) for scene in comparison.scenes]
    box = table_of(comparison.environment)
    return section("provenance", "Provenance", repeat, _references(own), _warnings(own), box, *scenes)


def _references(own: Sequence[SceneView]) -> str:
    items = []
    for view in own:
        for name, r in view.references.items():
            kind, source = r.kind or "reference", r.source or "source not stated"
            about = f"{kind[:1].upper()}{kind[1:]}: {source}."
            items.append(tag("div", tag("dt", tag("code", text(name))), tag("dd", prose(about))))
    return tag("dl", *items, class_="meanings") if items else tag("p", "No references.", class_="quiet")


def _warnings(own: Sequence[SceneView]) -> str:
    """Return the warnings about configurations as HTML, each once with the number of configurations that have it."""
    found: dict[PointWarning, int] = {}
    for warning in (w for view in own for point in view.points for w in point.warnings):
        found[warning] = found.get(warning, 0) + 1
    items = [
        tag("li", tag("span", text(w.code), class_="code"), prose(f"{w.message} ({count(n, 'configuration')})"))
        for w, n in found.items()
    ]
    return tag("p", "Warnings") + tag("ul", *items, class_="warnings") if items else ""


SECTIONS: tuple[tuple[str, Callable[[Sequence[SceneView], ComparisonRecord], str]], ...] = (
    ("advice", _advice),
    ("work", _diagrams),
    ("levels", _make_section_builder(comparison_tables.effort_to_error, "levels", "Cost for a given error")),
    ("rates", _make_section_builder(comparison_tables.best_at_rates, "rates", "Most accurate within a frame")),
    ("points", _make_section_builder(_points, "points", "Configurations")),
    ("studies", _make_section_builder(study_answers.studies, "studies", "Results of studies")),
    ("orders", _make_section_builder(comparison_tables.orders, "orders", "Convergence orders")),
    ("distances", _make_section_builder(comparison_tables.distances, "distances", "Differences between models")),
    ("levers", _make_section_builder(_change_effect_table, "levers", "Effect of single changes")),
    ("costs", _make_section_builder(cost_figure.costs, "costs", "Breakdown of CPU time")),
    ("provenance", _provenance),
)
