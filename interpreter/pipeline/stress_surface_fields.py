"""Stress, strain and stretch on the surface of a model for pictures, only for scenes with such metrics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.metrics.tensor_metrics import TensorMetric, stress_field_of
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.run_report import RequestedSurfaceValues
from softmark.interpreter.verification.stress_singularities import singular_stress
from softmark.interpreter.verification.stress_warnings import APART

if TYPE_CHECKING:
    Floats = np.ndarray[Any, np.dtype[np.float64]]


def stress_fields(work: StateRun, view: View, X: Floats) -> tuple[RequestedSurfaceValues, ...]:
    """Return the fields that the metrics of a model's body ask for, at points X (n, 3), m, of its surface."""
    asked = _group_tensor_metrics(work, view.body)
    if not asked:
        return ()
    try:
        field = stress_field_of(view.stress)
        tensors = field.at(X)
    except Undefined as undefined:
        return tuple(_make_surface_field(metrics, None, str(undefined)) for metrics in asked)
    found, mesh = [], work.prepared[view.name][0].mesh
    edge = singular_stress(
        replace(asked[0][0].thing, over="largest"), view.case, mesh, X
    )  # the same for all stress fields
    for metrics in asked:
        values = metrics[0].thing.values(tensors)
        if np.all(np.isfinite(values)):
            size = metrics[0].thing.usual(field)
            apart = float(np.mean(field.relative_fit_residual(X, metrics[0].thing.decisive_tensor_part) > APART))
            found.append(replace(_make_surface_field(metrics, values, None), size=size, apart=apart, limitless=edge))
        else:
            found.append(_make_surface_field(metrics, None, "the deformation is so large that a value is not finite"))
    return tuple(found)


def _group_tensor_metrics(work: StateRun, body: str) -> list[list[Declared]]:
    """Return the stress and strain metrics of a body, grouped by tensor and component."""
    found: dict[tuple[Any, ...], list[Declared]] = {}
    for metric in work.scene.of_kind("metric").values():
        thing = metric.thing
        if isinstance(thing, TensorMetric) and work.scene.declared[thing.probe].thing.body == body:
            key = type(thing), *(vars(thing).get(name) for name in ("component", "measure_"))
            found.setdefault(key, []).append(metric)
    return list(found.values())


def _make_surface_field(metrics: list[Declared], values: Floats | None, reason: str | None) -> RequestedSurfaceValues:
    thing: Mapping[str, Any] = vars(metrics[0].thing)
    words = f"{metrics[0].constructor.name} {thing['component']}"
    words += f", {thing['measure_']}" if "measure_" in thing else ""
    return RequestedSurfaceValues(words, metrics[0].thing.natural, tuple(m.name for m in metrics), values, reason)
