"""Gallery pages of all shipped scenes, each with a picture, its results and its text.

No scene is run when the pages are built. `python tests/benchmarks/gallery.py` runs the scenes and stores their results
in `gallery.json` and a picture of each in `pictures/gallery/`.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from softmark.interpreter.documentation.docstring_markdown import code_block, collapsible, escape_markup
from softmark.interpreter.language.number_formatting import format_quantity, is_negligible
from softmark.interpreter.language.scene_sources import standard_scenes

ROOM = Path(__file__).parent
NUMBERS = ROOM / "gallery.json"
PICTURES = ROOM / "pictures" / "gallery"

FOLDER = "gallery"
SIGN = """# Gallery

Each shipped scene is shown with a picture, its results, its references, and its text.
`dsl run NAME` runs it and writes a report with shapes that can be rotated."""
STALE = """:::{warning}
The text of this scene has changed since these results were computed.
:::"""
QUIET = ("converged", "read")  # statuses that are not mentioned

Json = dict[str, Any]


def load_results() -> dict[str, Json]:
    """Return the stored results of the scenes, by scene name."""
    return dict(json.loads(NUMBERS.read_text(encoding="utf-8"))) if NUMBERS.is_file() else {}


def text_hash(name: str) -> str:
    """Return the digest of a scene's text, by which stored results are recognised as out of date."""
    return hashlib.sha256(standard_scenes()[name].read_bytes()).hexdigest()


def pages() -> dict[str, str]:
    """Return Markdown by file name: an overview with a card for each scene, and one page for each folder of scenes."""
    folders: dict[str, list[str]] = {}
    for name, file in standard_scenes().items():
        folders.setdefault(file.parent.name, []).append(name)
    kept = load_results()
    tree = "\n".join(["```{toctree}", ":maxdepth: 1", "", *folders, "```"])
    cards = [f"## {folder.capitalize()}\n\n{_cards(folder, names, kept)}" for folder, names in folders.items()]
    overview = "\n\n".join([SIGN, tree, *cards]) + "\n"
    own = {f"{FOLDER}/{f}.md": _folder_page(f, names, kept) for f, names in folders.items()}
    return {f"{FOLDER}/index.md": overview, **own}


def _cards(folder: str, names: list[str], kept: dict[str, Json]) -> str:
    inside = [f":::{{container}} card\n{_card(folder, name, kept.get(name))}\n:::" for name in names]
    return "\n".join(["::::{container} cards", *inside, "::::"])


def _card(folder: str, name: str, record: Json | None) -> str:
    place = f"{folder}.md#{name}"
    picture = f"[![]({_picture(name)})]({place})\n\n" if record and record["picture"] else ""
    words = escape_markup(record["title"]) if record else ""
    return f"{picture}[`{name}`]({place}) {words}"


def _picture(name: str) -> str:
    return f"../{PICTURES.relative_to(ROOM).as_posix()}/{name}.png"


def _folder_page(folder: str, names: list[str], kept: dict[str, Json]) -> str:
    return "\n\n".join([f"# {folder.capitalize()}", *(section(name, kept.get(name)) for name in names)]) + "\n"


def section(name: str, record: Json | None) -> str:
    """Return the section of one scene: picture, results, references and text."""
    file = standard_scenes()[name]
    text = file.read_text(encoding="utf-8")
    head = [f"```{{scene}} {name}\n```", f"## `{name}`"]
    if record is None:
        return "\n\n".join(
            [*head, "The results of this scene are not available.", collapsible("Its text", code_block("scene", text))]
        )
    stale = [STALE] if record["sha256"] != text_hash(name) else []
    picture = (
        [f"![{_caption(record)}]({_picture(name)})", f"{{.facts}}\n{_caption(record)}"] if record["picture"] else []
    )
    return "\n\n".join(
        [
            *head,
            f"**{escape_markup(record['title'])}**",
            *stale,
            *picture,
            _expectation_summary(name, record),
            _table(record),
            *_descriptions(record),
            collapsible("What it expects", _expectations(record)),
            collapsible("Its text", code_block("scene", text)),
        ]
    )


def _caption(record: Json) -> str:
    """Return the caption of a scene's picture."""
    shown = record["picture"]
    if "curve" in shown:
        return f"`{shown['curve']}` over the states: {', '.join(f'`{n}`' for n in shown['of'])}."
    names = ", ".join(f"`{n}`" for n in shown["shapes"])
    if (colour := shown["colour"]) is None:
        return f"{names}."
    ends = [format_quantity(colour[end], colour["unit"], 3, percent=True) for end in ("low", "high")]
    return f"{names}. Colour: {colour['words']}, from {ends[0]} to {ends[1]}."


def _expectation_summary(name: str, record: Json) -> str:
    judged = [e for e in record["expectations"] if not e["left_out"]]
    met = sum(e["verdict"] == "met" for e in judged)
    said = f"all {met} expectations met" if met == len(judged) else f"{met} of {len(judged)} expectations met"
    return f"`dsl run {name}`: {said}; {_seconds(record['seconds'])} of CPU, softmark {record['softmark']}."


def _seconds(seconds: float | None) -> str:
    if seconds is None:
        return ""
    return format_quantity(seconds, "s", 3) if seconds >= 1e-3 else "below 1\u00a0ms"


def _table(record: Json) -> str:
    """Return the table of models and references (rows) by metrics (columns), transposed if there are more columns."""
    references = {f"({n})": r for n, r in record["references"].items() if r["metrics"]}
    everyone = {**record["models"], **references}
    measured = [item for own in everyone.values() for item in own["metrics"].items()]
    clocked = {m for m, found in measured if found.get("clock")}  # frame times are valid only for one machine
    metrics = [m for m in dict.fromkeys(m for m, _ in measured) if m not in clocked]
    columns = {
        f"`{m}`": [_cell(own["metrics"].get(m), _largest_magnitude(everyone, m)) for own in everyone.values()]
        for m in metrics
    }
    columns["CPU time"] = [_seconds(own.get("cpu")) for own in everyone.values()]
    columns[""] = ["" if own["status"] in QUIET else own["status"] for own in everyone.values()]
    told = {head: column for head, column in columns.items() if any(column)}
    names = [f"`{n}`" for n in everyone]
    if len(metrics) > len(everyone):
        return _markdown_table(["", *names], [[head, *column] for head, column in told.items()])
    return _markdown_table(["", *told], [list(row) for row in zip(names, *told.values(), strict=True)])


def _largest_magnitude(everyone: dict[str, Json], metric: str) -> float:
    own = (r["metrics"].get(metric, {}).get("value") for r in everyone.values())
    return max((abs(v) for v in own if v is not None), default=0.0)


def _cell(found: Json | None, largest: float) -> str:
    if found is None or found["value"] is None:
        return "" if found is None else "–"
    value, unit = found["value"], found["unit"]
    return "0" if is_negligible(value, largest, unit) else format_quantity(value, unit, 4, percent=True)


def _markdown_table(head: list[str], rows: list[list[str]]) -> str:
    ruled = ["---", *["---:"] * (len(head) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ruled, *rows))


def _descriptions(record: Json) -> list[str]:
    """Return a description of each model, and of each reference with its source."""
    models = [f"`{n}`\n: {escape_markup(m['outline'])}" for n, m in record["models"].items()]
    references = [
        f"`{n}`\n: {escape_markup(', '.join(w for w in (r['kind'], r['means']) if w))}. {escape_markup(r['source'])}"
        for n, r in record["references"].items()
    ]
    return [":::{container} words", *models, *references, ":::"]


def _expectations(record: Json) -> str:
    said = {"met": "met", "not_met": "**not met**", "cannot_tell": "not judged"}
    return "\n".join(f"- `{e['text']}`: {said[e['verdict']]}" for e in record["expectations"]) or "Nothing."
