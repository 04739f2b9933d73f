"""Sampling at probes: their points, found before any model is solved, and displacements at these points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.models.shared.prepared_model import Prepared
from softmark.interpreter.pipeline.run_state import StateRun
from softmark.interpreter.problem.body_case import Fault, fault
from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.interpreter.results.motion_history import History
from softmark.interpreter.results.run_report import ProbeResult


def place_probes(work: StateRun) -> None:
    """Find the points of every probe. Raises SceneError that lists all probes without points."""
    plan, faults, work.about = work.plan, [], ("place", "")
    bodies = {work.case(work.scene.declared[name]).body.name: None for name in (*plan.models, *plan.references)}
    for probe in (probe for body in bodies for probe in work.probes(body)):
        try:
            work.warn(work.place(probe).notes)
        except Fault as error:
            faults.append(error.diagnostic)
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))


def require_probes_inside(work: StateRun, body: str, prepared: Prepared) -> None:
    """Refuse probes outside a mesh that was read from a file (generated shapes are checked exactly). Raises Fault."""
    for probe in work.probes(body):
        if probe.thing.stations is None:
            continue
        if (distance := prepared.outside(work.place(probe).X)) > 0:
            field = "at" if "at" in probe.fields else "to"
            raise fault(
                "E504",
                probe.at(field),
                f"`{probe.name}` has a point {units.format_value(distance, units.LENGTH)} outside `{body}`",
                "outside the body",
                "write coordinates of the undeformed body",
            )


def sample_probes(
    work: StateRun, body: str, displacement: Callable[[Any], Any], history: History | None = None
) -> dict[str, ProbeResult]:
    """Return a displacement field, and its history if any, at the probes of a body, by probe name."""
    found = {}
    for probe in work.probes(body):
        place = work.place(probe)
        times = course = None
        if history is not None and place.triangles is None and place.weights is None:
            times, course = history.times, np.asarray(history.displacement(place.X))
        u = np.asarray(displacement(place.X))
        found[probe.name] = ProbeResult(place.X, u, times, course, place.triangles)
    return found


def probe_weights(work: StateRun, body: str) -> dict[str, np.ndarray]:
    """Return the weights of the points of each probe, by probe name, for probes that have weights."""
    places = {p.name: work.place(p) for p in work.probes(body)}
    return {name: place.weights for name, place in places.items() if place.weights is not None}


def probe_domains(work: StateRun, body: str) -> dict[str, ProbeDomain]:
    """Return the domains of a body's probes, by probe name, if stress or strain metrics are evaluated there."""
    asked = {
        metric.thing.probe for metric in work.scene.of_kind("metric").values() if isinstance(metric.thing, TensorMetric)
    }
    return {probe.name: work.domain(probe) for probe in work.probes(body) if probe.name in asked}
