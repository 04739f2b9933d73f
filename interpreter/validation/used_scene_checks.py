"""Checks for metrics that need a declaration of a used scene that only a run of that scene would evaluate.

`use` makes names known. Values such as materials, shapes and bodies can be taken from a used scene. A run places the
probes, applies the supports and solves the models and references of its own scene only.
"""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.planning.declaration_dependencies import find_named_declarations

EVALUATED = ("probe", "model", "reference", "support", "load", "contact", "metric")  # kinds that a run evaluates
VERBS = {
    "probe": "places no points of",
    "support": "holds nothing by",
    "load": "applies no",
    "contact": "detects no",
    "metric": "evaluates no",
}  # by default `solves no`, for models and references


def metric_faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield an error for each metric that needs a probe, model, support or similar of a used scene."""
    for metric in scene.of_kind("metric").values():
        for name in (*find_named_declarations(scene, metric, "name"), *find_named_declarations(scene, metric, "names")):
            kind = scene.declared[name].kind
            if kind not in EVALUATED or name in scene.of_kind(kind):
                continue
            own = name.rpartition(".")[2]
            verb = VERBS.get(kind, "solves no")
            yield diagnostic(
                "E509",
                next((at for field, at in metric.fields.items() if metric.value(field) == name), metric.at()),
                f"`{metric.name}` needs `{name}`, but a run {verb} {kind}s of imported scenes",
                f"a {kind} of another scene",
                f"declare it here, `{kind} {own} = {name}`, and write the metric with `{own}`",
            )
