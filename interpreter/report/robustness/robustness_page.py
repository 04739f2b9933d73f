"""HTML page of `dsl robustness`: one self-contained file that starts with the silently wrong points."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from softmark.interpreter.report.page.figure_frame import details
from softmark.interpreter.report.page.html_document import date_html, document
from softmark.interpreter.report.page.html_markup import count, join_names, prose, section, strip_backticks, tag, text
from softmark.interpreter.report.robustness import robustness_figures as stress_figures
from softmark.interpreter.report.robustness.robustness_view import (
    CLASSES,
    format_value,
    percent,
    point_tooltip,
    status_beyond,
    valid_range,
    verdict_display,
)
from softmark.interpreter.report.robustness.validity_range_text import nowhere_right, unjudged_points_phrase
from softmark.interpreter.report.run.tables.provenance_table import scene_listing, scene_name, table_of
from softmark.interpreter.study.robustness.robustness_record import (
    ChoiceEdge,
    Robustness,
    RobustnessPoint,
    RobustnessStudyRecord,
    ValidityEdge,
)

FOLDED = 60  # points beyond which their table is folded


def page(stress: Robustness) -> str:
    """Return the page as a complete HTML5 document that needs no network and no other files."""
    return document(
        f"{stress.scene['title']} – softmark stress",
        strip_backticks(conclusion(stress)),
        _header(stress),
        [(name, make(stress)) for name, make in SECTIONS],
        "stress.json",
        0,
        ["report.css", "stress.css"],
        ["report.js"],
    )


def conclusion(stress: Robustness) -> str:
    """Return a sentence that counts points, such as `2 340 points of 9 models: 1 402 right, ...`."""
    summary, counts = stress.summary, stress.summary.classes
    models = len(dict.fromkeys(m for study in stress.studies for m in study.models))
    ordered = [name for name in CLASSES if counts.get(name) and name != "silent"]
    said = join_names([f"{counts[name]} {verdict_display(name).words}" for name in ordered])
    judged = summary.points - (counts.get("unjudged") or 0)
    none = "None was wrong without a warning." if judged or not summary.points else "Nothing was judged."
    last = f"{summary.silent} wrong without a warning!" if summary.silent else none
    return f"{count(summary.points, 'point')} of {count(models, 'model')}: {said or 'none computed'}. {last}"


def _header(stress: Robustness) -> str:
    where = [date_html(stress.created or ""), text((stress.environment or {}).get("cpu") or "")]
    line = tag("p", " · ".join(tag("span", piece) for piece in where if piece), class_="where")
    above = tag("p", "softmark stress", class_="eyebrow")
    said = tag("p", prose(conclusion(stress)), class_="conclusion")
    return tag("header", above, tag("h1", text(stress.scene["title"])), said, line)


def _silent(stress: Robustness) -> str:
    return section("silent", "Wrong without a warning", silent_points_section(stress)) if stress.silent else ""


def silent_points_section(stress: Robustness, most: int | None = None) -> str:
    """Return the points that are wrong without a warning, at most `most`, each with the command that repeats it."""
    file, plugins = scene_name(stress.scene, "-"), [p["file"] for p in stress.scene.get("plugins", ())]
    items = [
        tag("li", tag("code", text(p.model)), ", ", prose(point_tooltip(p)), _command(repeat_command(file, p, plugins)))
        for p in stress.silent[:most]
    ]
    return tag("div", tag("ul", *items), class_="callout bad")


def repeat_command(file: str, point: RobustnessPoint, plugins: Sequence[str] = ()) -> str:
    """Return the shell command that computes a point again."""
    parts = ["dsl", "run", file, *(part for own in plugins for part in ("--plugin", own))]
    parts += [part for n, t in point.texts.items() for part in ("-p", f"{n}={t}")]
    return shlex.join([*parts, "--model", point.model])


def _command(said: str) -> str:
    return tag("pre", tag("code", text(said)), class_="command")


def _validity_range_section(stress: Robustness) -> str:
    return section("edges", "Ranges where each model is right", validity_range_tables(stress))


def validity_range_tables(stress: Robustness) -> str:
    """Return for each study a table of the range in which each model is right, and its status beyond the range."""
    return "".join(_with_study_name(stress, study, _validity_range_table(study)) for study in stress.studies)


def _with_study_name(stress: Robustness, study: RobustnessStudyRecord, markup: str) -> str:
    """Return HTML under the name of its study; the name is omitted if there is only one study."""
    if not markup or len(stress.studies) < 2:
        return markup
    return tag("h3", tag("code", text(study.name))) + markup


def _validity_range_table(study: RobustnessStudyRecord) -> str:
    asked = study.quantities
    columns = (tag("th", tag("code", text(q.name)), scope="col") for q in asked)
    head = tag("tr", tag("th", "Model", scope="col"), *columns)
    rows = [
        tag("tr", tag("th", tag("code", text(m)), scope="row"),
            *(_validity_range_cell(study.edges_of(m, q.name), q.unit) for q in asked))
        for m in study.models
    ]  # fmt: skip
    against = f" against `{study.against}`" if study.against else ""
    lead = (
        f"Right means that `{study.metric}`{against} is at most {percent(study.within)} plus the uncertainty of the "
        f"reference. One quantity is varied at a time; all others have the values of the scene."
    )
    table = tag("table", tag("thead", head), tag("tbody", *rows), class_="edges")
    return tag("p", prose(lead), class_="lead") + tag("div", table, class_="scroll", tabindex=0, role="region",
                                                      aria_label="Edges")  # fmt: skip


def _validity_range_cell(own: list[ValidityEdge], unit: str) -> str:
    """Return table cell text such as `0.3 … 0.4995`, with the status beyond each end below it."""
    if not own:
        return tag("td", "–")
    if choices := [e for e in own if isinstance(e, ChoiceEdge)]:
        none = "no option" if any(e.wrong_options for e in choices) else ""
        words = ", ".join(text(v) for v in valid_range(own, unit)) or none
        said = [tag("small", _describe_beyond_edge(e, unit)) for e in own]
    else:
        words = " … ".join(text(v) for v in valid_range(own, unit)) or nowhere_right(own)
        between = unjudged_points_phrase(own) if valid_range(own, unit) else ""
        sides = (_describe_beyond_edge(e, unit) for e in own if any(e.judged for e in own))
        said = [tag("small", line) for line in (text(between), *sides) if line]
    worst = next((e.word for e in own if e.word), "right")
    return tag("td", words, *said, class_=worst)


def _describe_beyond_edge(edge: ValidityEdge, unit: str) -> str:
    met = status_beyond(edge, unit)
    if isinstance(edge, ChoiceEdge):  # a choice of options has no lower and upper end
        return text(met or "right with all options")
    side = "above" if edge.direction == "up" else "below"
    return text(f"{side}: {met or 'right up to the last tested value, ' + format_value(edge.reached, unit)}")


def _strips(stress: Robustness) -> str:
    drawn = strips(stress)
    return section("walks", "Along each quantity", drawn) if drawn else ""


def strips(stress: Robustness) -> str:
    """Return one figure for each quantity, in which every model has a strip."""
    blocks = []
    for study in stress.studies:
        figures = "".join(stress_figures.strip(study, asked) for asked in study.quantities)
        blocks.append(
            _with_study_name(stress, study, stress_figures.verdict_legend(study) + figures if figures else "")
        )
    return "".join(blocks)


def _heat_map_section(stress: Robustness) -> str:
    """Return the section of heat maps over pairs of quantities."""
    blocks = [_with_study_name(stress, study, stress_figures.maps(study)) for study in stress.studies]
    return section("maps", "Two quantities varied at once", *blocks) if any(blocks) else ""


def _remedy_list(stress: Robustness) -> str:
    """Return the HTML section that lists why models are not right beyond their validity ranges, and the remedies.

    Each item names a quantity and the models with the same reason and remedy. The section is empty if there is none.
    """
    found: dict[tuple[str, str, str], list[str]] = {}
    for study in stress.studies:
        for e in study.edges:
            if e.word is not None and (e.reason or e.remedy):
                found.setdefault((e.quantity, e.reason or "", e.remedy or ""), []).append(e.model)
    items = [
        tag(
            "li",
            tag("code", text(name)),
            ", ",
            join_names([tag("code", text(m)) for m in dict.fromkeys(models)]),
            ": ",
            prose("; ".join(piece for piece in (reason, remedy) if piece)),
        )
        for (name, reason, remedy), models in found.items()
    ]
    return section("remedies", "How to extend the ranges", tag("ul", *items, class_="wanted")) if items else ""


def _points(stress: Robustness) -> str:
    """Return an HTML table of all solved configurations with their class, errors and message."""
    rows = [_point(p) for p in stress.points]
    if not rows:
        return ""
    heads = ("Model", "Values", "Class", "Error", "Estimated error", "Message")
    head = tag("tr", *(tag("th", h, scope="col") for h in heads))
    table = tag("div", tag("table", tag("thead", head), tag("tbody", *rows), class_="compared"), class_="scroll")
    return section("points", "Points", table if len(rows) <= FOLDED else details(count(len(rows), "point"), table))


def _point(point: RobustnessPoint) -> str:
    found = point.found
    values = ", ".join(f"{n} = {t}" for n, t in point.texts.items()) or "all values of the scene"
    figures = [percent(v) if v is not None else "–" for v in (found.error, found.states)]
    message = " ".join(piece for piece in (found.code, found.message) if piece)
    return tag(
        "tr", tag("th", tag("code", text(point.model)), scope="row"), tag("td", text(values)),
        tag("td", text(verdict_display(found.word).words)), *(tag("td", text(f), class_="n") for f in figures),
        tag("td", tag("small", prose(message))),
    )  # fmt: skip


def _provenance(stress: Robustness) -> str:
    """Return the HTML section with the command, the environment and the scene of the study."""
    repeat = tag("p", "To rerun this study:") + _command(stress.command) if stress.command else ""
    return section("provenance", "Provenance", repeat, table_of(stress.environment or {}), scene_listing(stress.scene))


SECTIONS = (
    ("silent", _silent),
    ("edges", _validity_range_section),
    ("walks", _strips),
    ("maps", _heat_map_section),
    ("remedies", _remedy_list),
    ("points", _points),
    ("provenance", _provenance),
)
