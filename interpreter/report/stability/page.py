"""`page`: what `dsl stress` shows, one HTML file that needs nothing else; what went wrong silently comes first."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.report.page.document import document, moment
from softmark.interpreter.report.page.markup import count, listed, plain, prose, section, tag, text
from softmark.interpreter.report.page.plate import details
from softmark.interpreter.report.run.tables.provenance import listing, scene_name, table_of
from softmark.interpreter.report.stability import figures as stress_figures
from softmark.interpreter.report.stability.reach import gaps, nowhere
from softmark.interpreter.report.stability.view import CLASSES, beyond, class_of, percent, reach, shown, told

Json = Mapping[str, Any]

FOLDED = 60  # points beyond which their table is folded


def page(stress: Json) -> str:
    """A complete HTML5 document of a `softmark-stress/1`: no network, no other file."""
    return document(
        f"{stress['scene']['title']} – softmark stress",
        plain(_conclusion(stress)),
        _header(stress),
        [(name, title, make(stress)) for name, title, make in SECTIONS],
        "stress.json",
        0,
        ["report.css", "stress.css"],
        ["report.js"],
    )


def _conclusion(stress: Json) -> str:
    """`2 340 points of 9 models: 1 402 right, 512 inaccurate and said so, ...; none was wrong without a word.`"""
    counts: Mapping[str, int] = stress["summary"]["classes"]
    models = len(dict.fromkeys(m for study in stress["studies"] for m in study["models"]))
    ordered = [name for name in CLASSES if counts.get(name) and name != "silent"]
    said = listed([f"{counts[name]} {class_of(name).words}" for name in ordered])
    silent = stress["summary"]["silent"]
    points = stress["summary"]["points"]
    judged = points - (counts.get("unjudged") or 0)
    none = "None was wrong without a word." if judged or not points else "Nothing was judged."
    last = f"{silent} wrong without a word!" if silent else none
    return f"{count(points, 'point')} of {count(models, 'model')}: {said or 'none computed'}. {last}"


def _header(stress: Json) -> str:
    environment = stress.get("environment") or {}
    where = [moment(str(stress.get("created") or "")), text(environment.get("cpu") or "")]
    line = tag("p", " · ".join(tag("span", piece) for piece in where if piece), class_="where")
    above = tag("p", "softmark stress", class_="eyebrow")
    conclusion = tag("p", prose(_conclusion(stress)), class_="conclusion")
    return tag("header", above, tag("h1", text(stress["scene"]["title"])), conclusion, line)


def _silent(stress: Json) -> str:
    """Every point that was wrong without a word, with the command that repeats it."""
    wrong = [p for study in stress["studies"] for p in study["points"] if p["class"] == "silent"]
    if not wrong:
        return ""
    file = scene_name(stress["scene"], "-")
    items = [tag("li", tag("code", text(p["model"])), ", ", prose(told(p)), _command(again(file, p))) for p in wrong]
    box = tag("div", tag("ul", *items), class_="callout bad")
    return section("silent", "Wrong without a word", box)


def again(file: str, point: Json) -> str:
    """The command that computes a point again."""
    parts = ["dsl", "run", file]
    parts += [part for n, t in (point.get("texts") or {}).items() for part in ("-p", f"{n}={t}")]
    return shlex.join([*parts, "--model", str(point["model"])])


def _command(said: str) -> str:
    return tag("pre", tag("code", text(said)), class_="command")


def _edges(stress: Json) -> str:
    """For each study, where each model is right, and what comes beyond."""
    blocks = [_under(stress, study, _table(study)) for study in stress["studies"]]
    return section("edges", "Where each model is right", *blocks)


def _under(stress: Json, study: Json, markup: str) -> str:
    """Under the study's name where there are several."""
    if not markup or len(stress["studies"]) < 2:
        return markup
    return tag("h3", tag("code", text(study["name"]))) + markup


def _table(study: Json) -> str:
    names = [q["name"] for q in study["quantities"]]
    units = {q["name"]: str(q.get("unit") or "1") for q in study["quantities"]}
    head = tag("tr", tag("th", "Model", scope="col"), *(tag("th", tag("code", text(n)), scope="col") for n in names))
    rows = [
        tag("tr", tag("th", tag("code", text(m)), scope="row"), *(_range(study, m, n, units[n]) for n in names))
        for m in study["models"]
    ]
    against = f" against `{study['against']}`" if study.get("against") else ""
    lead = (
        f"Right means that `{study['metric']}`{against} is at most {percent(study['within'])} and what the reference "
        "itself may be off by. One quantity is moved at a time, all others are as the scene has them."
    )
    table = tag("table", tag("thead", head), tag("tbody", *rows), class_="edges")
    return tag("p", prose(lead), class_="lead") + tag("div", table, class_="scroll", tabindex=0, role="region",
                                                      aria_label="Edges")  # fmt: skip


def _range(study: Json, model: str, name: str, unit: str) -> str:
    """`0.3 … 0.4995`, what comes beyond each end beneath."""
    own = {e["direction"]: e for e in study["edges"] if (e["model"], e["quantity"]) == (model, name)}
    if not own:
        return tag("td", "–")
    if _chosen(own):
        none = "with none" if any(e.get("wrong") for e in own.values()) else ""
        words = ", ".join(text(v) for v in reach(own, unit)) or none
        said = [tag("small", _beyond(e, unit)) for e in own.values()]
    else:
        words = " … ".join(text(v) for v in reach(own, unit)) or nowhere(own.values())
        between = gaps(own.values()) if reach(own, unit) else ""
        sides = (_beyond(e, unit) for e in own.values() if any(e["judged"] for e in own.values()))
        said = [tag("small", line) for line in (text(between), *sides) if line]
    worst = next((str(e["class"]) for e in own.values() if e.get("class")), "right")
    return tag("td", words, *said, class_=worst)


def _chosen(own: Mapping[str, Json]) -> bool:
    """Whether it is a choice that was walked, which has no sides."""
    return any(e.get("right") is not None for e in own.values())


def _beyond(edge: Json, unit: str) -> str:
    met = beyond(edge, unit)
    if edge.get("right") is not None:
        return text(met or "right with all")
    side = "above" if edge["direction"] == "up" else "below"
    return text(f"{side}: {met or 'right as far as it was walked, to ' + shown(edge['reached'], unit)}")


def _strips(stress: Json) -> str:
    """One figure for each quantity."""
    blocks = []
    for study in stress["studies"]:
        figures = "".join(stress_figures.strip(study, asked) for asked in study["quantities"])
        blocks.append(_under(stress, study, stress_figures.key(study) + figures if figures else ""))
    return section("walks", "Along each quantity", *blocks) if any(blocks) else ""


def _maps(stress: Json) -> str:
    """Heat maps of pairs."""
    blocks = [_under(stress, study, stress_figures.maps(study)) for study in stress["studies"]]
    return section("maps", "Two at a time", *blocks) if any(blocks) else ""


def _remedies(stress: Json) -> str:
    """Why each edge is where it is, and what would move it."""
    found: dict[tuple[str, str, str], list[str]] = {}
    for study in stress["studies"]:
        for e in study["edges"]:
            if e.get("class") is not None and (e.get("reason") or e.get("remedy")):
                entry = str(e["quantity"]), str(e.get("reason") or ""), str(e.get("remedy") or "")
                found.setdefault(entry, []).append(str(e["model"]))
    items = [
        tag("li", tag("code", text(name)), ", ", listed([tag("code", text(m)) for m in dict.fromkeys(models)]), ": ",
            prose("; ".join(piece for piece in (reason, remedy) if piece)))
        for (name, reason, remedy), models in found.items()
    ]  # fmt: skip
    return section("remedies", "What would move the edges", tag("ul", *items, class_="wanted")) if items else ""


def _points(stress: Json) -> str:
    """Every point."""
    rows = [_point(p) for study in stress["studies"] for p in study["points"]]
    if not rows:
        return ""
    heads = ("Model", "Values", "Class", "Error", "Stated", "Message")
    head = tag("tr", *(tag("th", h, scope="col") for h in heads))
    table = tag("div", tag("table", tag("thead", head), tag("tbody", *rows), class_="compared"), class_="scroll")
    return section("points", "Points", table if len(rows) <= FOLDED else details(count(len(rows), "point"), table))


def _point(point: Json) -> str:
    texts = point.get("texts") or {}
    stated = (point.get("stated") or {}).get("value")
    values = ", ".join(f"{n} = {t}" for n, t in texts.items()) or "as the scene has it"
    figures = [percent(v) if v is not None else "–" for v in (point.get("error"), stated)]
    message = " ".join(str(piece) for piece in (point.get("code"), point.get("message")) if piece)
    return tag(
        "tr", tag("th", tag("code", text(point["model"])), scope="row"), tag("td", text(values)),
        tag("td", text(class_of(point["class"]).words)), *(tag("td", text(f), class_="n") for f in figures),
        tag("td", tag("small", prose(message))),
    )  # fmt: skip


def _provenance(stress: Json) -> str:
    """The command, the environment and the scene."""
    command = stress.get("command")
    said = " ".join(command) if isinstance(command, list) else str(command or "")
    repeat = tag("p", "To repeat this study:") + _command(said) if said else ""
    return section("provenance", "Provenance", repeat, table_of(stress.get("environment") or {}),
                   listing(stress["scene"]))  # fmt: skip


SECTIONS = (
    ("silent", "Wrong without a word", _silent),
    ("edges", "Edges", _edges),
    ("walks", "Walks", _strips),
    ("maps", "Maps", _maps),
    ("remedies", "Remedies", _remedies),
    ("points", "Points", _points),
    ("provenance", "Provenance", _provenance),
)
