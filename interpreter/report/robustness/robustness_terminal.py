"""Terminal text of a robustness study: the range in which each model is right, and its status beyond the range."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from softmark.grammar.diagnostic import make_all_visible
from softmark.interpreter.language import units
from softmark.interpreter.planning.varied_quantities import WalkedQuantity
from softmark.interpreter.report.robustness.validity_range_text import (
    nowhere_right,
    options_by_class,
    range_ends,
    unjudged_points_phrase,
)
from softmark.interpreter.study.robustness.robustness_record import (
    ChoiceEdge,
    Robustness,
    RobustnessStudyRecord,
    RobustnessSummary,
    ValidityEdge,
)

RED, OFF = "\033[1;31m", "\033[0m"
MOST = 20  # silent points that are listed

SAID = {
    "inaccurate": "inaccurate", "silent": "SILENT", "not_converged": "not converged", "diverged": "diverged",
    "right": "right", "refused": "refused", "failed": "failed", "timed_out": "timed out",
    "unjudged": "no valid reference",
}  # fmt: skip


def table(found: Robustness, file: str, overrides: Sequence[str], colour: bool, place: str | None) -> str:
    """Return the terminal text: all studies, the number of points in each class, and the silently wrong points.

    Each of these points has the command that repeats it.
    """
    lines = [str(found.scene["title"])]
    for study in found.studies:
        lines += ["", *_study(study)]
    lines = [make_all_visible(line) for line in (*lines, "", _counts(found.summary))]
    lines += _silent_point_lines(found, file, overrides, colour)
    if place:
        lines.append(f"report: {place}")
    return "\n".join(lines)


def _study(study: RobustnessStudyRecord) -> Iterator[str]:
    yield (f"{study.name}: {study.metric} against {study.against}; right: error of at most {100 * study.within:g} %; "
           f"varied until {study.until}")  # fmt: skip
    for quantity in study.quantities:
        models = list(dict.fromkeys(e.model for e in study.edges if e.quantity == quantity.name))
        if not models:
            continue
        yield f"  {quantity.name} (scene: {quantity.text}{', scaled by' if _is_vector(quantity) else ''})"
        width = max(len(m) for m in models)
        for model in models:
            own = study.edges_of(model, quantity.name)
            yield f"    {model:<{width}}  {_range(own, quantity.unit)}"
            lines = dict.fromkeys(line for e in own for line in _status_lines_beyond(e, quantity.unit))
            yield from (f"    {'':<{width}}    {line}" for line in lines)


def _is_vector(quantity: WalkedQuantity) -> bool:
    return quantity.kind == "factor" and quantity.text.startswith("(")


def _range(edges: Sequence[ValidityEdge], unit: str) -> str:
    """Return `right 0.3 .. 0.4995`, or a text that the model is right nowhere or was not judged."""
    if isinstance(edges[0], ChoiceEdge):
        return "; ".join(f"{SAID.get(word, word)}: {', '.join(own)}" for word, own in options_by_class(edges[0]))
    found = range_ends(edges, lambda value: quantity_text(value, unit))
    if not found:
        return nowhere_right(edges)
    said = f"right at {found[0]}" if len(found) == 1 else f"right {' .. '.join(found)}"
    return "; ".join(piece for piece in (said, unjudged_points_phrase(edges)) if piece)


def _status_lines_beyond(edge: ValidityEdge, unit: str) -> Iterator[str]:
    """Yield lines with the status beyond a validity edge, and its remedy."""
    if edge.word is None:
        return
    at = ""
    if edge.met is not None and (edge.word != "unjudged" or edge.last_right is not None):
        at = f" at {quantity_text(edge.met, unit)} and {'above' if edge.direction == 'up' else 'below'}"
    yield f"{SAID.get(edge.word, edge.word)}{at}" + (f": {edge.reason}" if edge.reason else "")
    if edge.silence and edge.first_silence is not None and edge.first_silence != edge.first_wrong:
        yield f"{SAID.get(edge.silence, edge.silence)} from {quantity_text(edge.first_silence, unit)} on"
    if edge.remedy:
        yield f"= help: {edge.remedy}"


def quantity_text(value: float, unit: str) -> str:
    """Return a value as text; close to one half, as for Poisson's ratio, as the difference from one half."""
    if unit == "1" and 0.499 < value < 0.5:
        return f"0.5 - {0.5 - value:.3g}"
    return units.format_value(float(f"{value:.4g}"), units.parse_unit(unit).dimension)


def _counts(summary: RobustnessSummary) -> str:
    parts = [f"{n} {SAID.get(word, word)}" for word, n in summary.classes.items() if n and word != "silent"]
    said = f"{summary.points} points: {', '.join(parts)}; {summary.silent} silent (wrong without a warning)"
    none = summary.points and summary.classes.get("unjudged") == summary.points
    return said + (": no point was judged, so this has no meaning" if none else "")


def _silent_point_lines(found: Robustness, file: str, overrides: Sequence[str], colour: bool) -> Iterator[str]:
    """Yield lines on the points that are wrong without a warning, with the commands that repeat them."""
    silent = [(s.metric, p) for s in found.studies for p in s.points if p.found.word == "silent"]
    if not silent:
        return
    on, off = (RED, OFF) if colour else ("", "")
    yield f"{on}wrong without a warning:{off}"
    for metric, point in silent[:MOST]:
        plugins = (p["file"] for p in found.scene.get("plugins", ()))
        command = ["dsl", "run", file, *(part for own in plugins for part in ("--plugin", own))]
        for text in (*overrides, *(f"{n}={make_all_visible(t)}" for n, t in point.texts.items())):
            command += ["-p", text]
        command += ["--model", point.model]
        says = "" if point.found.states is None else f", estimated error {100 * point.found.states:.2g} %"
        error = f"{metric} = {100 * (point.found.error or 0.0):.3g} %{says}"
        yield f"{on}  {shlex.join(command)}{off}   # {error}"
    if len(silent) > MOST:
        yield f"{on}  and {len(silent) - MOST} more{off}"
