"""Where each kind of model was measured to be right: taken from a stability study, shown by `dsl explain`.

`ranges.json` beside this file is what `python tests/benchmarks/ranges.py` made of `dsl stress beam-at-the-extremes`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

Json = dict[str, Any]

FILE = "ranges.json"


def ranges_of(stress: Mapping[str, Any], constructors: Mapping[str, str]) -> Json:
    """What a `softmark-stress/1` says of where its models are right; `constructors`: of each model by its name."""
    study = stress["studies"][0]
    units = {q["name"]: str(q.get("unit") or "1") for q in study["quantities"]}
    nominal = {q["name"]: q.get("nominal") for q in study["quantities"]}
    models = [
        {"constructor": constructors[m], "outline": study["outlines"].get(m, m),
         "ranges": [_range(study, m, name, nominal[name], units[name]) for name in nominal if _edges(study, m, name)]}
        for m in study["models"]
    ]  # fmt: skip
    return {
        "scene": Path(stress["scene"]["file"]).stem, "title": stress["scene"]["title"], "within": study["within"],
        "softmark": stress["environment"].get("softmark"), "points": stress["summary"]["points"],
        "silent": stress["summary"]["silent"], "models": models,
    }  # fmt: skip


def _edges(study: Mapping[str, Any], model: str, name: str) -> dict[str, Json]:
    return {e["direction"]: e for e in study["edges"] if (e["model"], e["quantity"]) == (model, name)}


def _range(study: Mapping[str, Any], model: str, name: str, nominal: Any, unit: str) -> Json:
    from softmark.interpreter.report.stress_view import shown

    own = _edges(study, model, name)
    ends = [own[d].get("last_right") if d in own else nominal for d in ("down", "up")]
    said = [None if v is None else shown(v, unit) for v in ends]
    beyond = {d: _beyond(e, unit) for d, e in own.items() if e.get("class") is not None}
    return {"quantity": name, "from": said[0], "to": said[1], "beyond": beyond}


def _beyond(edge: Json, unit: str) -> str:
    from softmark.interpreter.report.stress_view import class_of, shown

    at = f" from {shown(edge['first_wrong'], unit)}" if edge.get("first_wrong") is not None else ""
    return class_of(edge["class"]).words + at


def lines(constructor: str) -> list[str]:
    """What `dsl explain` says of a constructor: a line for each quantity of each of its models, if it was measured."""
    path = files(__package__ or "").joinpath(FILE)
    measured = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {"models": []}
    own = [m for m in measured["models"] if m["constructor"] == constructor]
    if not own:
        return []
    head = [
        f"Measured range: `{measured['title']}`, all else as that scene has it; right means within "
        f"{100 * measured['within']:g} % of its reference.",
        f"From {measured['points']} points by `dsl stress {measured['scene']}`, softmark {measured['softmark']}; "
        "an end of which nothing is said is as far as it was walked:",
    ]
    return head + [line for model in own for line in _lines(model)]


def _lines(model: Json) -> list[str]:
    width = max((len(r["quantity"]) for r in model["ranges"]), default=0)
    return [f"  {model['outline']}"] + [f"    {r['quantity']:<{width}}  {_words(r)}" for r in model["ranges"]]


def _words(found: Json) -> str:
    ends = list(dict.fromkeys(v for v in (found["from"], found["to"]) if v is not None))
    right = f"right from {ends[0]} to {ends[1]}" if len(ends) == 2 else f"right at {ends[0]}" if ends else "never right"
    sides = {"down": "below", "up": "above"}
    beyond = [f"{sides[d]}: {said}" for d, said in found["beyond"].items()]
    return "; ".join([right, *beyond])
