"""Where models, contacts and theories were measured to be right: from stability studies, shown by `dsl explain`.

`ranges.json` beside this file has what `python tests/benchmarks/ranges.py` made of each `dsl stress` of a scene.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softmark.interpreter.planning.varied_quantities import WalkedQuantity
    from softmark.interpreter.study.robustness.robustness_record import StressEdge

Json = dict[str, Any]

FILE = "ranges.json"


def ranges_of(stress: Mapping[str, Any], constructors: Mapping[str, str], seconds: float) -> Json:
    """What a `softmark-stress/1` says of where its models are right; `constructors`: of each model by its name.

    Each point had so many `seconds`, s of CPU.
    """
    from softmark.interpreter.study.robustness.robustness_record import Stress

    found = Stress.from_json(stress)
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


def _range(own: list[StressEdge], quantity: WalkedQuantity) -> Json:
    from softmark.interpreter.report.robustness.robustness_view import beyond, reach
    from softmark.interpreter.report.robustness.validity_range_text import nowhere
    from softmark.interpreter.study.robustness.robustness_record import StressChoice

    said = {e.direction: words for e in own if (words := beyond(e, quantity.unit)) is not None}
    chosen = any(isinstance(e, StressChoice) for e in own)
    right = reach(own, quantity.unit)
    found = {"quantity": quantity.name, "choice": chosen, "right": right, "beyond": said}
    return found if right or chosen else {**found, "nowhere": nowhere(own)}


def lines(constructor: str) -> list[str]:
    """What `dsl explain` says of a constructor: a line for each quantity of each of its models, if it was measured.

    A study that is about other words, as about a contact, shows its models there, each at the words that it is about.
    """
    path = files(__package__ or "").joinpath(FILE)
    measured = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
    return [line for study in measured for line in _of_study(study, constructor)]


def _of_study(measured: Json, constructor: str) -> list[str]:
    words = measured.get("words") or ()
    own = [
        m for m in measured["models"]
        if (constructor in m.get("words", words) if words else m["constructor"] == constructor)
    ]  # fmt: skip
    if not own:
        return []
    head = [
        f"Measured range: `{measured['title']}`, all else as that scene has it; right means within "
        f"{100 * measured['within']:g} % of its reference.",
        f"From {measured['points']} points by `dsl stress {measured['scene']} --timeout {measured['seconds']:g}`, "
        f"softmark {measured['softmark']}; an end of which nothing is said is as far as it was walked:",
    ]
    return head + [line for model in own for line in _lines(model)]


def _lines(model: Json) -> list[str]:
    width = max((len(r["quantity"]) for r in model["ranges"]), default=0)
    return [f"  {model['outline']}"] + [f"    {r['quantity']:<{width}}  {_words(r)}" for r in model["ranges"]]


def _words(found: Json) -> str:
    right, sides = found["right"], {"down": "below: ", "up": "above: "}
    if found["choice"]:
        return "; ".join([f"right with {', '.join(right)}" if right else "never right", *found["beyond"].values()])
    words = " to ".join(right)
    words = f"right from {words}" if len(right) == 2 else f"right at {words}"
    words = words if right else str(found.get("nowhere") or "never right")
    return "; ".join([words, *(sides[d] + said for d, said in found["beyond"].items())])
