"""Validity ranges of models, contacts and theories, measured by robustness studies and shown by `dsl explain`.

`ranges.json` in this folder is written by `python tests/benchmarks/ranges.py`, which runs `dsl robustness` once for
each scene.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softmark.interpreter.planning.varied_quantities import WalkedQuantity
    from softmark.interpreter.study.robustness.robustness_record import ValidityEdge

Json = dict[str, Any]

FILE = "ranges.json"


def ranges_of(stress: Mapping[str, Any], constructors: Mapping[str, str], seconds: float) -> Json:
    """Return the validity ranges in `stress`, the `softmark-stress/1` result of a robustness study.

    `constructors` maps each model to its constructor. Each point of the study had at most `seconds` of CPU time, s.
    """
    from softmark.interpreter.study.robustness.robustness_record import Robustness

    found = Robustness.from_json(stress)
    models = [
        {"constructor": constructors[m], "model": m, "outline": study.outlines.get(m, m),
         "ranges": [_range(edges, q) for q in study.quantities if (edges := study.edges_of(m, q.name))]}
        for study in found.studies for m in study.models
    ]  # fmt: skip
    return {
        "scene": Path(found.scene["file"]).stem, "title": found.scene["title"], "within": found.studies[0].within,
        "softmark": found.environment.get("softmark"), "points": found.summary.points, "seconds": seconds,
        "silent": found.summary.silent, "models": models,
    }  # fmt: skip


def _range(own: list[ValidityEdge], quantity: WalkedQuantity) -> Json:
    from softmark.interpreter.report.robustness.robustness_view import status_beyond, valid_range
    from softmark.interpreter.report.robustness.validity_range_text import nowhere_right
    from softmark.interpreter.study.robustness.robustness_record import ChoiceEdge

    said = {e.direction: words for e in own if (words := status_beyond(e, quantity.unit)) is not None}
    chosen = any(isinstance(e, ChoiceEdge) for e in own)
    right = valid_range(own, quantity.unit)
    found = {"quantity": quantity.name, "choice": chosen, "right": right, "beyond": said}
    return found if right or chosen else {**found, "nowhere": nowhere_right(own)}


def lines(constructor: str) -> list[str]:
    """Return the lines that `dsl explain` prints about the validity ranges of a constructor.

    There is one line for each measured quantity of each model. If a study is about other words, such as a contact, its
    ranges are shown on the pages of those words.
    """
    path = files(__package__ or "").joinpath(FILE)
    measured = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
    return [line for study in measured for line in _lines_of_study(study, constructor)]


def _lines_of_study(measured: Json, constructor: str) -> list[str]:
    words = measured.get("words") or ()
    own = [
        m for m in measured["models"]
        if (constructor in m.get("words", words) if words else m["constructor"] == constructor)
    ]  # fmt: skip
    if not own:
        return []
    head = [
        f"Measured range, in the scene `{measured['title']}`: one quantity is varied, and all others stay as in the "
        f"scene. A result is right if it is within {100 * measured['within']:g} % of the reference; (reported) means "
        "that the model itself warns or states such an error.",
        f"Softmark {measured['softmark']} tested {measured['points']} points by `dsl robustness {measured['scene']} "
        f"--timeout {measured['seconds']:g}`. If nothing follows an end of a range, no value beyond it was tested:",
    ]
    return head + [line for model in own for line in _lines_of_model(model)]


def _lines_of_model(model: Json) -> list[str]:
    width = max((len(r["quantity"]) for r in model["ranges"]), default=0)
    return [f"  {model['outline']}"] + [f"    {r['quantity']:<{width}}  {_range_words(r)}" for r in model["ranges"]]


def _range_words(found: Json) -> str:
    right, sides = found["right"], {"down": "below: ", "up": "above: "}
    if found["choice"]:
        return "; ".join([f"right with {', '.join(right)}" if right else "never right", *found["beyond"].values()])
    words = " to ".join(right)
    words = f"right from {words}" if len(right) == 2 else f"right at {words}"
    words = words if right else str(found.get("nowhere") or "never right")
    return "; ".join([words, *(sides[d] + said for d, said in found["beyond"].items())])
