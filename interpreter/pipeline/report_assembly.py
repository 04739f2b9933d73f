"""The report of a run: every answer measured and drawn, expectations judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.metric_evaluation import evaluate_metrics
from softmark.interpreter.pipeline.run_environment import describe, environment
from softmark.interpreter.pipeline.run_state import Work
from softmark.interpreter.pipeline.scene_declarations import names_of
from softmark.interpreter.problem.probe_points import drawn, surface_of
from softmark.interpreter.problem.solution import View
from softmark.interpreter.results.run_report import (
    CarriedNumber,
    ModelResult,
    ReferenceResult,
    Report,
    SeenInstrument,
    SeenSurface,
    Warned,
)
from softmark.interpreter.results.state_results import joined, percent
from softmark.interpreter.verification.expectation_results import judge
from softmark.interpreter.verification.force_verification import loose
from softmark.interpreter.verification.stress_warnings import asks

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic

MOST = 6  # numbers of one body: each is in the page for every point of every model
FULL = f"a page has room for {MOST} numbers"


def unfinished(works: Sequence[Work]) -> Report:
    """What is known by now, without shapes and verdicts."""
    for work in works:
        _measure(work, partial=True)
    return _report(works, partial=True)


def measured(works: Sequence[Work], name: str) -> None:
    """A model measured and drawn as at the end of the run, while others are still to be solved."""
    for work in works:
        _measure(work, partial=False, coloured=work is works[-1], only=name)


def finished(works: Sequence[Work]) -> Report:
    """What came of everything that was asked for."""
    for work in works:
        _measure(work, partial=False, coloured=work is works[-1])
        work.warn(loose(work.scene, work.models))
        if any(model.status == "read" for model in work.models.values()):
            from softmark.interpreter.verification.unit_mismatch import other_units

            work.warn(other_units(work.scene, work.models, work.references))
    return _report(works, partial=False)


def _measure(work: Work, partial: bool, coloured: bool = False, only: str = "") -> None:
    """Metrics and shapes of what is there; in an unfinished report, of what is new since the last.

    Where the scene asks for stress, or what a contact does, shapes may be `coloured` by it: a page shows that of the
    last state alone.
    """
    results: list[dict[str, Any]] = [work.models, work.references]
    for kept in results:
        for name, result in kept.items():
            if name in work.taken or (partial and result.metrics) or (only and name != only):
                continue
            before = [w.views for w in work.earlier]
            metrics, errors = evaluate_metrics(work.scene, work.views[name], work.views, before, work.plan.models)
            shape = _shape(work, name, errors) if work.options.draw and not partial else None
            if shape is not None and work.views[name].case.contacts:
                shape = _beside(work.views[name], shape)
            if coloured and shape is not None and kept is work.models:
                shape = _coloured(work, name, shape)
            kept[name] = replace(result, metrics=metrics, shape=shape or result.shape)


def _shape(work: Work, name: str, errors: dict[str, np.ndarray]) -> SeenSurface | None:
    """The surface of a body as a model or a theory has it, coloured by its error where there is one."""
    view = work.views[name]
    if view.displacement is None:
        return None
    probe = next((p for p in work.probes(view.body) if work.place(p).triangles is not None), None)
    if view.body not in work.surfaces:
        work.surfaces[view.body] = work.place(probe) if probe else drawn(view.case)
    place, u = work.surfaces[view.body], _drawn(work, view)
    asked = {m.name: m.thing for m in work.scene.of_kind("metric").values()}
    for metric, error in errors.items():
        if probe is not None and asked[metric].probe == probe.name:
            return surface_of(view, place, u, error, asked[metric].measured_from)
    fields = (v for v in work.views.values() if v.name in work.references and v.body == view.body)
    known = next((v for v in fields if v.displacement is not None), None)
    if known is None or known.name == name:
        return surface_of(view, place, u, None, None)
    error = np.linalg.norm(u - _drawn(work, known), axis=1)
    return surface_of(view, place, u, error, known.name)


def _beside(view: View, shape: SeenSurface) -> SeenSurface:
    """The surface with the rigid bodies that it may touch."""
    from softmark.interpreter.pipeline.rigid_body_shapes import instruments

    return replace(shape, instruments=instruments(view.case, shape, view.solve.get("rigid")))


def _coloured(work: Work, name: str, shape: SeenSurface) -> SeenSurface:
    """The surface of a model with what the scene asks of its stress, and of its contacts."""
    view, found = work.views[name], list[CarriedNumber]()
    X = work.surfaces[view.body].X
    if asks(work.scene):
        from softmark.interpreter.pipeline.stress_surface_fields import carried

        found += carried(work, view, X)
    if view.case.contacts or view.case.pairs:
        from softmark.interpreter.pipeline.contact_surface_fields import colours_of_contacts

        found += colours_of_contacts(work.scene, view, X)
    return replace(shape, carried=_in_room(found)) if found else shape


def _in_room(found: Sequence[CarriedNumber]) -> tuple[CarriedNumber, ...]:
    """The first MOST of them with values: each is in a page for every point of every model."""
    return *found[:MOST], *(replace(n, values=None, reason=n.reason or FULL) for n in found[MOST:])


def _drawn(work: Work, view: View) -> np.ndarray:
    """The displacements (n, 3) of a body's surface in m; of a reference, which all models are compared with, kept."""
    if view.displacement is None:
        raise ValueError(f"{view.name} has no displacements")
    if view.name in work.drawn:
        return work.drawn[view.name]
    u = np.asarray(view.displacement(work.surfaces[view.body].X))
    if view.name in work.references:
        work.drawn[view.name] = u
    return u


def _report(works: Sequence[Work], partial: bool) -> Report:
    scene = works[0].scene
    states = tuple(work.state for work in works if work.state is not None)
    warnings = tuple(
        Warned(d.code, d.message + where, d.span.line if d.span and d.source is scene.source else None, d.help)
        for d, where in _warned(works).items()
    )
    models: dict[str, ModelResult] = _over_states([work.models for work in works], states)
    references: dict[str, ReferenceResult] = _over_states([work.references for work in works], states)
    known: dict[str, ModelResult | ReferenceResult] = {**models, **references}
    expectations = () if partial else tuple(judge(scene, known, e, states) for e in scene.expectations)
    described, machine = describe(scene), environment(works[0].started)
    return Report(described, machine, models, references, expectations, warnings, partial, names_of(scene))


def _warned(works: Sequence[Work]) -> dict[Diagnostic, str]:
    """All warnings, each with the states that it is about where it is not about all."""
    found: dict[Diagnostic, list[str]] = {}
    for work in works:
        for d in dict.fromkeys(work.warnings):
            found.setdefault(d, []).append(percent(work.state or 0.0))
    return {
        d: "" if len(own) == len(works) else f" (in the {'state' if len(own) == 1 else 'states'} {', '.join(own)})"
        for d, own in found.items()
    }


def _over_states(known: Sequence[dict[str, Any]], states: Sequence[float]) -> dict[str, Any]:
    """Results by name, those of several states together."""
    if not states:
        return dict(known[0])
    whole = {name: joined([own[name] for own in known], states) for name in known[-1]}
    return {name: replace(result, shape=_in_states(result, states)) for name, result in whole.items()}


def _in_states(result: ModelResult | ReferenceResult, states: Sequence[float]) -> SeenSurface | None:
    """The surface in the last state with those of all as its frames, where all have one."""
    seen = [own.shape for own in result.each if own.shape is not None]
    if len(seen) < max(2, len(states)) or len({s.position.shape for s in seen}) > 1:
        return result.shape
    frames, labels = np.stack([s.position for s in seen]), tuple(map(percent, states))
    whole = replace(seen[-1], times=np.arange(len(seen), dtype=np.float64), frames=frames, labels=labels)
    each = zip(*(s.instruments for s in seen), strict=True)
    return replace(whole, instruments=tuple(_moved(own) for own in each))


def _moved(states: Sequence[SeenInstrument]) -> SeenInstrument:
    """One rigid body at its places in all states."""
    turns, shifts = (np.concatenate([getattr(s, name) for s in states]) for name in ("turns", "shifts"))
    return replace(states[-1], turns=turns, shifts=shifts)
