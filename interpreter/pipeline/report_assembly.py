"""Assembly of the report of a run: evaluation of metrics, drawn surfaces and verdicts on expectations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.metric_evaluation import evaluate_metrics
from softmark.interpreter.pipeline.run_environment import describe_environment, describe_scene
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.pipeline.scene_declarations import names_of
from softmark.interpreter.problem.probe_points import drawn_surface, surface_of
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.run_report import (
    DrawnRigidBody,
    DrawnSurface,
    ModelResult,
    ReferenceResult,
    Report,
    ReportWarning,
    RequestedSurfaceValues,
)
from softmark.interpreter.results.state_results import format_state, join_states
from softmark.interpreter.verification.expectation_results import judge
from softmark.interpreter.verification.force_verification import tolerance_warnings
from softmark.interpreter.verification.stress_warnings import asks_for_stress

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic

MOST = 6  # maximum number of fields of one body; the page stores each for every point of every model
FULL = f"the report page shows at most {MOST} surface fields"


def unfinished_report(works: Sequence[StateRun]) -> Report:
    """Return the report of the results so far, without drawn surfaces and verdicts."""
    for work in works:
        _evaluate_and_draw(work, partial=True)
    return _make_report(works, partial=True)


def measure_model(works: Sequence[StateRun], name: str) -> None:
    """Evaluate the metrics of one solved model and draw its surface, while other models are still to be solved."""
    for work in works:
        _evaluate_and_draw(work, partial=False, coloured=work is works[-1], only=name)


def finished_report(works: Sequence[StateRun]) -> Report:
    """Return the report of all requested results, with drawn surfaces and verdicts on expectations."""
    for work in works:
        _evaluate_and_draw(work, partial=False, coloured=work is works[-1])
        work.warn(tolerance_warnings(work.scene, work.models))
        if any(model.status == "read" for model in work.models.values()):
            from softmark.interpreter.verification.unit_mismatch import other_units

            work.warn(other_units(work.scene, work.models, work.references))
    return _make_report(works, partial=False)


def _evaluate_and_draw(work: StateRun, partial: bool, coloured: bool = False, only: str = "") -> None:
    """Evaluate metrics and draw surfaces of the results in one state.

    For an unfinished report (`partial`) only metrics of new results are evaluated, and no surfaces are drawn. `only`
    selects one model. If `coloured`, surfaces have the stress and contact fields that the scene asks for; a page shows
    only those of the last state.
    """
    results: list[dict[str, Any]] = [work.models, work.references]
    for kept in results:
        for name, result in kept.items():
            if name in work.taken or (partial and result.metrics) or (only and name != only):
                continue
            before = [w.views for w in work.earlier]
            metrics, errors = evaluate_metrics(work.scene, work.views[name], work.views, before, work.plan.models)
            shape = _draw_surface(work, name, errors) if work.options.draw and not partial else None
            if shape is not None and work.views[name].case.contacts:
                shape = _add_rigid_bodies(work.views[name], shape)
            if coloured and shape is not None and kept is work.models:
                shape = _add_fields(work, name, shape)
            kept[name] = replace(result, metrics=metrics, shape=shape or result.shape)


def _draw_surface(work: StateRun, name: str, errors: dict[str, np.ndarray]) -> DrawnSurface | None:
    """Return the drawn surface of a body in a model or theory, coloured by the error of its points if it is known."""
    view = work.views[name]
    if view.displacement is None:
        return None
    probe = next((p for p in work.probes(view.body) if work.place(p).triangles is not None), None)
    if view.body not in work.surfaces:
        work.surfaces[view.body] = work.place(probe) if probe else drawn_surface(view.case)
    place, u = work.surfaces[view.body], _surface_displacements(work, view)
    asked = {m.name: m.thing for m in work.scene.of_kind("metric").values()}
    for metric, error in errors.items():
        if probe is not None and asked[metric].probe == probe.name:
            return surface_of(view, place, u, error, asked[metric].measured_from)
    fields = (v for v in work.views.values() if v.name in work.references and v.body == view.body)
    known = next((v for v in fields if v.displacement is not None), None)
    if known is None or known.name == name:
        return surface_of(view, place, u, None, None)
    error = np.linalg.norm(u - _surface_displacements(work, known), axis=1)
    return surface_of(view, place, u, error, known.name)


def _add_rigid_bodies(view: View, shape: DrawnSurface) -> DrawnSurface:
    """Return a drawn surface with the rigid bodies that the body may touch."""
    from softmark.interpreter.pipeline.rigid_body_shapes import drawn_rigid_bodies

    return replace(shape, instruments=drawn_rigid_bodies(view.case, shape, view.solve.get("rigid")))


def _add_fields(work: StateRun, name: str, shape: DrawnSurface) -> DrawnSurface:
    """Return the drawn surface of a model with the stress and contact fields that the scene asks for."""
    view, found = work.views[name], list[RequestedSurfaceValues]()
    X = work.surfaces[view.body].X
    if asks_for_stress(work.scene):
        from softmark.interpreter.pipeline.stress_surface_fields import stress_fields

        found += stress_fields(work, view, X)
    if view.case.contacts or view.case.pairs:
        from softmark.interpreter.pipeline.contact_surface_fields import contact_fields

        found += contact_fields(work.scene, view, X)
    return replace(shape, carried=_limit_fields(found)) if found else shape


def _limit_fields(found: Sequence[RequestedSurfaceValues]) -> tuple[RequestedSurfaceValues, ...]:
    """Return the first MOST fields that have values, because a page stores each field at every surface point."""
    return *found[:MOST], *(replace(n, values=None, reason=n.reason or FULL) for n in found[MOST:])


def _surface_displacements(work: StateRun, view: View) -> np.ndarray:
    """Return the displacements (n, 3), m, of the surface points of a body in a model or reference.

    Those of a reference are cached, because the errors of all models need them.
    """
    if view.displacement is None:
        raise ValueError(f"{view.name} has no displacements")
    if view.name in work.drawn:
        return work.drawn[view.name]
    u = np.asarray(view.displacement(work.surfaces[view.body].X))
    if view.name in work.references:
        work.drawn[view.name] = u
    return u


def _make_report(works: Sequence[StateRun], partial: bool) -> Report:
    scene = works[0].scene
    states = tuple(work.state for work in works if work.state is not None)
    warnings = tuple(
        ReportWarning(d.code, d.message + where, d.span.line if d.span and d.source is scene.source else None, d.help)
        for d, where in _collect_warnings(works).items()
    )
    models: dict[str, ModelResult] = _combine_states([work.models for work in works], states)
    references: dict[str, ReferenceResult] = _combine_states([work.references for work in works], states)
    known: dict[str, ModelResult | ReferenceResult] = {**models, **references}
    expectations = () if partial else tuple(judge(scene, known, e, states) for e in scene.expectations)
    described, machine = describe_scene(scene), describe_environment(works[0].started)
    return Report(described, machine, models, references, expectations, warnings, partial, names_of(scene))


def _collect_warnings(works: Sequence[StateRun]) -> dict[Diagnostic, str]:
    """Return all warnings, each with the text of the states that it concerns, "" if it concerns all."""
    found: dict[Diagnostic, list[str]] = {}
    for work in works:
        for d in dict.fromkeys(work.warnings):
            found.setdefault(d, []).append(format_state(work.state or 0.0))
    return {
        d: "" if len(own) == len(works) else f" (in the {'state' if len(own) == 1 else 'states'} {', '.join(own)})"
        for d, own in found.items()
    }


def _combine_states(known: Sequence[dict[str, Any]], states: Sequence[float]) -> dict[str, Any]:
    """Return for each model or reference one result that combines its results in all states."""
    if not states:
        return dict(known[0])
    whole = {name: join_states([own[name] for own in known], states) for name in known[-1]}
    return {name: replace(result, shape=_surface_with_state_frames(result, states)) for name, result in whole.items()}


def _surface_with_state_frames(result: ModelResult | ReferenceResult, states: Sequence[float]) -> DrawnSurface | None:
    """Return the drawn surface in the last state, with the surfaces of all states as frames; None if one is missing."""
    seen = [own.shape for own in result.each if own.shape is not None]
    if len(seen) < max(2, len(states)) or len({s.position.shape for s in seen}) > 1:
        return result.shape
    frames, labels = np.stack([s.position for s in seen]), tuple(map(format_state, states))
    whole = replace(seen[-1], times=np.arange(len(seen), dtype=np.float64), frames=frames, labels=labels)
    each = zip(*(s.instruments for s in seen), strict=True)
    return replace(whole, instruments=tuple(_join_rigid_body_states(own) for own in each))


def _join_rigid_body_states(states: Sequence[DrawnRigidBody]) -> DrawnRigidBody:
    """Return one drawn rigid body with its positions in all states."""
    turns, shifts = (np.concatenate([getattr(s, name) for s in states]) for name in ("turns", "shifts"))
    return replace(states[-1], turns=turns, shifts=shifts)
