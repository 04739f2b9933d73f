"""Resolution of a configuration: cell sizes, segments and time steps, with theoretical orders of convergence.

The resolution is declared and not inferred. Configurations are refinements of one another if they differ in only one of
these fields. A sweep of a body's length also changes the number of unknowns, but it changes the problem and has no
order.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.problem.body_case import Fault, case_for
from softmark.interpreter.study.configurations.configuration_keys import declaration_text
from softmark.interpreter.vocabulary.analysis_words import Dynamic

PROBLEM = ("material", "body", "support", "contact", "load", "analysis")  # kinds that define the problem


def resolution_of(scene: Scene, model: str) -> dict[str, Any]:
    """Return the resolution of a model as JSON.

    `of`: the size, segments and step. `formal`: the theoretical order in displacements of each, if known. `problem`: a
    digest of everything else. `meshed`: whether the number of elements is that of the model's own mesh. `counts`: the
    number of cells of that mesh along each direction, if the shape of the body gives it.
    """
    own = scene.declared[model]
    whole = [scene.declared[name] for name in with_dependencies(scene, [model])]
    problem = [d for d in scene.declared.values() if d.kind in PROBLEM]
    found = {}
    for declared in (*problem, *whole):
        for name, value in _resolution_fields(declared).items():
            if value is not None and (declared is own or name not in found):
                found[name] = float(value)
    digest = hashlib.sha256(
        "".join(declaration_text(_without_resolution(d)) for d in (*problem, *whole)).encode()
    ).hexdigest()
    size = _resolution_fields(own).get("size")
    return {"of": found, "formal": formal_orders(scene, own), "problem": digest, "meshed": size is not None,
            "counts": None if size is None else _cell_counts(scene, own, size)}  # fmt: skip


def _cell_counts(scene: Scene, model: Declared, size: float) -> list[int] | None:
    try:
        case = case_for(scene, model)
    except Fault:
        return None
    counts = case.shape.counts(size, model.thing.cuts(case))
    return None if counts is None else list(counts)


def _without_resolution(declared: Declared) -> Declared:
    """Return a model or an analysis with its resolution fields removed."""
    names = dict.fromkeys(_resolution_fields(declared))
    return replace(declared, thing=replace(declared.thing, **names)) if names else declared


def _resolution_fields(declared: Declared) -> dict[str, Any]:
    """Return the resolution fields of a model or a dynamic analysis, by name."""
    thing = declared.thing
    if declared.kind == "model":
        return {name: getattr(thing, name) for name in thing.resolution_fields}
    return {"step": thing.step} if isinstance(thing, Dynamic) else {}


# ------------------------------------------------------------------ theoretical orders


def formal_orders(scene: Scene, model: Declared) -> dict[str, int]:
    """Return the theoretical order in displacements of each resolution field of a model, for smooth solutions.

    Models declare the orders of their size or segments, time integrators the order of the step. Springs, modes and
    tolerances have none.
    """
    if model.thing.may_be_unconverged:
        return {}
    found = dict(model.thing.orders())
    motion = next((d.thing for d in scene.of_kind("analysis").values() if isinstance(d.thing, Dynamic)), None)
    return found if motion is None else {**found, "step": _order_in_time(motion, model.thing)}


def _order_in_time(motion: Dynamic, model: Any) -> int:
    """Return the order of convergence in the time step.

    Stiffness-proportional damping uses the stiffness at the start of a step. It is of first order if the stiffness
    changes.
    """
    first = motion.integrator == "implicit_euler" or (motion.damping_stiffness > 0 and not model.constant)
    return 1 if first else 2
