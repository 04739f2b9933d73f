"""State of a run: the results found so far, which every step of the pipeline reads and extends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.scene_states import in_state, states_of
from softmark.interpreter.pipeline.saved_results import NOTHING, SavedResults, WarningGroup
from softmark.interpreter.problem.body_case import Case, case_for, case_of
from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.interpreter.problem.probe_points import ProbePoints, domain_of, find_probe_points
from softmark.interpreter.results.state_results import format_state

if TYPE_CHECKING:
    import numpy as np

    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.models.model_preparation import ComputingTimes
    from softmark.interpreter.models.shared.prepared_model import Prepared
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.planning.run_plan import Plan
    from softmark.interpreter.problem.solution import View
    from softmark.interpreter.results.run_report import ModelResult, ReferenceResult


@dataclass
class StateRun:
    """Run of a scene, or of one of its states if it has several: its plan and its results so far."""

    scene: Scene
    plan: Plan
    options: RunOptions
    warnings: list[Diagnostic]
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    state: float | None = None  # value of the state
    before: StateRun | None = None  # run of the state before
    meshes: dict[tuple[Any, ...], Any] = field(default_factory=dict)  # meshes that models share, in all states
    prepared: dict[str, tuple[Prepared, ComputingTimes]] = field(default_factory=dict)  # with the times of building it
    models: dict[str, ModelResult] = field(default_factory=dict)
    references: dict[str, ReferenceResult] = field(default_factory=dict)
    views: dict[str, View] = field(default_factory=dict)
    measured: dict[str, Any] = field(default_factory=dict)  # measured data by reference
    places: dict[str, ProbePoints] = field(default_factory=dict)  # points of probes
    domains: dict[str, ProbeDomain] = field(default_factory=dict)  # domains of probes of stress or strain
    surfaces: dict[str, ProbePoints] = field(default_factory=dict)  # surfaces of bodies for pictures, in all states
    drawn: dict[str, np.ndarray] = field(default_factory=dict)  # displacements there, by reference
    compiling: bool = False  # whether compilation of kernels was already reported
    number: int = 0  # index of its state
    estimates: dict[str, Any] = field(default_factory=dict)  # error estimates of models, in all states
    known: SavedResults = NOTHING  # saved results of an earlier run
    taken: set[str] = field(default_factory=set)  # models and references whose results are reused
    about: tuple[str, str] = ("", "")  # current step and model, to which new warnings belong
    told: dict[tuple[str, str], list[WarningGroup]] = field(default_factory=dict)  # all warnings, by step and model
    doubts: dict[str, tuple[str, ...]] = field(default_factory=dict)  # codes of warnings before its error statement

    def case(self, declared: Declared) -> Case:
        """Return the case (body, loads, supports and analysis) of a model or reference."""
        return case_for(self.scene, declared)

    def place(self, probe: Declared) -> ProbePoints:
        """Return the points of a probe, computed at the first call. Raises Fault.

        Only the points of measurements may differ between states.
        """
        if self.before is not None and probe.thing.tracked is None:
            return self.before.place(probe)
        if probe.name not in self.places:
            case = case_of(self.scene, probe.thing.body)
            self.places[probe.name] = find_probe_points(probe, case, lambda name: self.measured[name].X)
        return self.places[probe.name]

    def domain(self, probe: Declared) -> ProbeDomain:
        """Return the domain of a probe whose points are known, computed at the first call. Raises Fault."""
        if self.before is not None and probe.thing.tracked is None:
            return self.before.domain(probe)
        if probe.name not in self.domains:
            self.domains[probe.name] = domain_of(probe, case_of(self.scene, probe.thing.body), self.place(probe))
        return self.domains[probe.name]

    def probes(self, body: str) -> list[Declared]:
        """Return the probes of a body, except those whose measured points could not be read."""
        own = [p for p in self.scene.of_kind("probe").values() if p.thing.body == body]
        return [p for p in own if p.thing.tracked in (None, *self.measured)]

    def warn(self, found: Sequence[Diagnostic], here: Sequence[Diagnostic] = (), once: bool = False) -> None:
        """Store warnings for the report, and show those that no earlier state gave.

        Warnings in `here` are shown with the name of their state. With `once`, warnings that another model has already
        given are left out.
        """
        self.told.setdefault(self.about, []).append(WarningGroup(tuple(found), tuple(here), once))
        found = [d for d in found if d not in self.warnings] if once else found
        new, where = [d for d in (*found, *here) if not self._was_reported(d)], self.where.strip()
        self.warnings.extend((*found, *here))
        self.options.warn([replace(d, notes=(*d.notes, where)) if where and d in here else d for d in new])

    @property
    def earlier(self) -> list[StateRun]:
        """Runs of the earlier states, in order."""
        return [] if self.before is None else [*self.before.earlier, self.before]

    def _was_reported(self, found: Diagnostic) -> bool:
        before = self.before
        return before is not None and (found in before.warnings or before._was_reported(found))

    @property
    def where(self) -> str:
        """Text ` in the state 12.5 %` for progress messages; empty in a scene without states."""
        return "" if self.state is None else f" in the state {format_state(self.state)}"


def make_state_runs(
    scene: Scene, plan: Plan, options: RunOptions, warnings: Sequence[Diagnostic], known: SavedResults = NOTHING
) -> tuple[StateRun, ...]:
    """Return the runs of a scene's states in order, or a single run for a scene without states."""
    states = states_of(scene)
    if not states:
        return (StateRun(scene, plan, options, list(warnings), known=known),)
    works: list[StateRun] = []
    for number, value in enumerate(states):
        own = in_state(scene, number)
        work = StateRun(own, plan, options, list(warnings), state=value, number=number, known=known)
        if works:
            work.before, work.started = works[-1], works[0].started
            work.meshes, work.surfaces = works[0].meshes, works[0].surfaces
            work.estimates = works[0].estimates
        works.append(work)
    return tuple(works)
