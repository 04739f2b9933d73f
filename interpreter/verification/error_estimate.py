"""Stated error of a model's solution, estimated without any reference.

The error is a sum of parts, each a function of what a probe evaluates:

- discretisation: distance to a finer space over the same cells, or else to the same model on coarser meshes;
- model: distance to the same model with the best strain measure that its material has; for beams, estimates of the
  error of beam theory;
- rounding: by the condition of the stiffness, or by forces and coordinates;
- solver: the next Newton step.

Each part is in the unit of the metric. If a part is not known, or would cost too much, the model states no error and
gives the reason. For results that nobody requested, the error is only stated if it costs nothing.

A warning of DOUBTS also counts as a statement, because the model reports with it that its solution may be inaccurate.
With a warning of VOID the model states no error.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.curve_metrics import CurveMetric
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.metrics.trajectory_error import TrajectoryError
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.models.shared.prepared_model import Prepared
from softmark.interpreter.problem.solution import View
from softmark.interpreter.problem.surface_selection.load_resultants import largest_load_error as missing_of
from softmark.interpreter.results.error_statements import StatedError
from softmark.interpreter.results.json_records import to_plain_json
from softmark.interpreter.results.run_report import ModelResult, ProbeResult
from softmark.interpreter.results.state_results import SOLVED
from softmark.interpreter.validation.amplitude_resolution import is_resolved_by_step
from softmark.interpreter.verification import grid_convergence, rounding_error
from softmark.interpreter.verification.accuracy_warnings import DOUBTS, accuracy_warning_codes, is_doubt
from softmark.interpreter.verification.by_model import verifier_of
from softmark.interpreter.verification.by_model.verifier import Verifier
from softmark.interpreter.verification.estimation_budget import BudgetExceeded
from softmark.interpreter.verification.geometry_error import facet_errors
from softmark.interpreter.verification.probe_errors import TRIFLE, Floats, NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.selection_error import selection_errors
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.vocabulary.analysis_words import SAME, Dynamic, Quasistatic

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.deformed_mesh import NodalDisplacementField

__all__ = [
    "DOUBTS",
    "ErrorEstimate",
    "NoErrorEstimate",
    "ProbeResultUnderTest",
    "accuracy_warning_codes",
    "estimate_errors",
    "is_doubt",
]

VOID = ("W351",)  # warnings with which no error can be stated

FIRST_ORDER = ("implicit_euler",)  # integrators
LONGEST = 0.25  # cost of a step four times as long over the solution
MODAL = 1.25  # safety factor, as weakly excited vibrations are left out
LEFT = 2.0  # safety factor on the next Newton step
COARSE = grid_convergence.COARSE  # relative error above which an estimate is useless


@dataclass
class ErrorEstimate(SolutionUnderTest):
    """Error estimate of a solution as the sum of its parts."""

    def of(self, seen: ProbeResultUnderTest) -> StatedError:
        """Return the stated error of a probe's result: its parts and their sum, or the `reason` why there is none."""
        parts: dict[str, float | None] = {}
        reasons: dict[str, list[str]] = {}
        asked = self._parts()
        last = self.in_time or bool(self.case.contacts or self.case.pairs)  # costs as much as a finer space
        for name in sorted(asked, key=lambda name: (name == "model") == last):
            part = asked[name]
            try:
                with self.budget:
                    parts[name] = float(part(seen))
                if not math.isfinite(parts[name] or 0.0):
                    raise NoErrorEstimate("part of the error is not finite")
            except NoErrorEstimate as unknown:
                parts[name] = None
                reasons.setdefault(str(unknown), []).append(name)
        parts = {name: parts[name] for name in asked}
        known = [v for v in parts.values() if v is not None]
        value = to_plain_json(sum(known)) if len(known) == len(parts) else None
        reason = "; ".join(f"{', '.join(names)} error: {why}" for why, names in reasons.items())
        return StatedError(value, seen.unit, parts, reason or None)

    def _parts(self) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
        """Return the functions that compute the parts of the error, by name."""
        found: dict[str, Callable[[ProbeResultUnderTest], float]] = {
            "discretisation": self._discretisation_error,
            "model": self._model_error,
            "rounding": self._rounding_error,
            "solver": self._solver_error,
        }
        found |= selection_errors(self)
        if self.case.contacts or self.case.pairs:
            from softmark.interpreter.verification.contact_error import gap_errors, tie_errors
            from softmark.interpreter.verification.contact_warnings import selection_errors as touching

            found |= gap_errors(self) | tie_errors(self) | touching(self)
        if self.case.parts:
            from softmark.interpreter.verification.region_error import region_border_errors

            found |= region_border_errors(self)
        if not self.case.uniform:
            from softmark.interpreter.verification.heterogeneous_constants_check import heterogeneity_errors

            found |= heterogeneity_errors(self)
        if (missing := missing_of(self.result.loads)) is not None:
            own, verifier = missing, verifier_of(self.declared.thing)
            found["loads"] = lambda seen: verifier.remaining_load_error(self, seen, own) * seen.size
        found |= facet_errors(self)
        if isinstance(self.case.analysis, Quasistatic) and self.case.has_material_history:
            longer = 2.0 * self._time_step <= self.case.analysis.since_output * (1.0 + SAME)
            found["time"] = lambda seen: self._time_step_error_by_refinement(seen, 2.0, longer)
        return found | ({"time": self._time_step_error} if isinstance(self.case.analysis, Dynamic) else {})

    def _discretisation_error(self, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error. Raises NoErrorEstimate."""
        verifier = verifier_of(self.declared.thing)
        if not isinstance(seen.metric, TensorMetric):
            self._refuse_singular_results(seen)
            return self._mesh_error(verifier, seen)
        from softmark.interpreter.verification.stress_singularities import converged_mesh_error
        from softmark.interpreter.verification.surface_traction_check import mismatch

        found = converged_mesh_error(self, seen, verifier)
        if seen.stress is None:
            return found
        # finer cells may miss the same surface loads; the balance with tractions does not
        surface = mismatch(seen.metric, self.case, seen.place, seen.stress(), seen.at_rest)
        return found if surface is None else max(found, surface.error)

    def _mesh_error(self, verifier: Verifier, seen: ProbeResultUnderTest) -> float:
        """Return the mesh error, at least the amount by which contact areas and pressures contradict their force."""
        if not self.case.contacts:
            return verifier.discretisation(self, seen)
        from softmark.interpreter.verification.contact_error import least_error

        least = least_error(seen)
        try:
            return max(verifier.discretisation(self, seen), least or 0.0)
        except NoErrorEstimate:
            if least is None:
                raise
            return least

    def _refuse_singular_results(self, seen: ProbeResultUnderTest) -> None:
        """Raise NoErrorEstimate for singular results: pressure at sharp edges, results at point and line forces."""
        if self.case.contacts:
            from softmark.interpreter.verification.contact_singularities import singular_pressure

            if place := singular_pressure(seen.metric, self.case, seen.at_rest, seen.X):
                raise NoErrorEstimate(
                    f"the metric is evaluated at {place}, where the pressure grows with every mesh refinement"
                )
        if not any(load.thing.action.points for load in self.case.loads):
            return
        from softmark.interpreter.verification.stress_singularities import (
            load_of_unbounded_displacement,
            load_of_unbounded_work,
            place_of,
        )

        if seen.metric is None or seen.metric.statistic_name != "max":
            return
        mesh, last = self.prepared.mesh, slice(-1 if seen.metric.last else 0, None)
        if seen.metric.measured_from is None and (
            load := load_of_unbounded_work(seen.metric, self.case, mesh, seen.size)
        ):
            raise NoErrorEstimate(
                f"the metric depends on the work of `{load.name}`, which grows with every mesh refinement"
            )
        if load := load_of_unbounded_displacement(self.case, mesh, seen.X[last], seen.u[..., last, :]):
            raise NoErrorEstimate(
                f"the metric is evaluated at {place_of(load)}, where displacements grow with every mesh refinement"
            )

    def _model_error(self, seen: ProbeResultUnderTest) -> float:
        return verifier_of(self.declared.thing).model(self, seen)

    def _rounding_error(self, seen: ProbeResultUnderTest) -> float:
        return rounding_error.rounding_error(
            self.result, self.case, self.mesh, verifier_of(self.declared.thing).cells(self), seen
        )

    def _solver_error(self, seen: ProbeResultUnderTest) -> float:
        """Return the change of a result by the next Newton step with the full tangent.

        For a reduced model this is a step of the full model.
        """
        residual = float(self.result.solve.get("residual") or 0.0)
        beyond, relative = self._reduction_error(seen)
        if isinstance(self.case.analysis, Dynamic):
            return LEFT * beyond + 10.0 * residual * seen.size
        if seen.is_about_forces:
            return 100.0 * residual * seen.acting
        step: Floats | None = self.once("step", self.next_step)
        if step is None:
            return LEFT * beyond + 100.0 * residual * seen.acting
        most = _largest_change(seen, step)
        if most is not None and (most <= TRIFLE * seen.acting or not self.asked):
            left = LEFT * most
        else:
            left = LEFT * seen.apart(seen.moved(self._nodal_step_field(step)))
        if left > COARSE * seen.comparison_scale(left):
            change = 100 * left / LEFT / seen.comparison_scale(left)
            raise NoErrorEstimate(
                f"the state is not in equilibrium: the next Newton step would change it by {change:.2g} %"
            )
        return left + LEFT * relative * beyond  # the second term is of second order, like the error after one step

    def _reduction_error(self, seen: ProbeResultUnderTest) -> tuple[float, float]:
        """Return the largest displacement error due to model reduction, in the metric's unit, and its relative value.

        Both are zero for a model without reduction. Raises NoErrorEstimate.
        """
        if self.declared.thing.reduces is None:
            return 0.0, 0.0
        known = self.result.solve.get("reduced") or {}
        relative, largest = known.get("estimated_error"), known.get("estimated_error_m")
        if relative is None or largest is None:
            raise NoErrorEstimate("the residual of the reduced model in the equations of the full model is not known")
        return (largest if seen.unit == "m" and not seen.is_about_forces else relative * seen.size), relative

    def _nodal_step_field(self, step: Floats) -> NodalDisplacementField:
        from softmark.interpreter.models.shared.deformed_mesh import displacement_of

        if self.mesh is None:
            raise NoErrorEstimate("the nodal displacements are not known")
        return displacement_of(self.mesh.mesh, step)

    def _time_step_error(self, seen: ProbeResultUnderTest) -> float:
        """Return the error due to the time step of a motion, at least that of the vibrations at the probe.

        The convergence order is that of the integrator. It is 1 where contacts open and close, since motions are not
        smooth there.
        """
        analysis: Any = self.case.analysis
        smooth = not (self.case.contacts or self.case.pairs) and analysis.integrator not in FIRST_ORDER
        # a longer step that does not resolve an amplitude may miss it as this one does
        longer = not analysis.explicit and is_resolved_by_step(self.case, 2.0 * analysis.step)
        return max(
            self._time_step_error_by_refinement(seen, 2.0 if smooth else 1.0, longer),
            self._time_step_error_of_modes(seen),
        )

    def _time_step_error_of_modes(self, seen: ProbeResultUnderTest) -> float:
        """Return the error due to the time step in the vibrations at the probe.

        It is a lower bound, because solutions with two different steps may agree by chance. It is 0 if viscoelasticity
        damps vibrations within the analysis, since the modes are those of the undamped elastic body.
        """
        from softmark.interpreter.verification.motion_errors import has_fading_vibrations, time_step_error_of

        if has_fading_vibrations(self.case):
            return 0.0
        found = None if seen.view is None else time_step_error_of(seen.view, seen.metric, seen.probe)
        if found is None:
            return 0.0
        own = found.length if seen.unit == "m" and not seen.is_about_forces else None
        return MODAL * (found.relative * seen.size if own is None else own)

    def _time_step_error_by_refinement(self, seen: ProbeResultUnderTest, order: float, longer: bool = True) -> float:
        """Return the error due to the time step, from a solution with half the step. Raises NoErrorEstimate.

        If that costs too much, solutions with steps two and four times as long are used. With `longer` false, only half
        the step is used.
        """
        twice = self._result_with_time_step(seen, 2.0) if longer else None
        try:
            with self.budget.reserving(LONGEST):
                half = self._result_with_time_step(seen, 0.5)
        except BudgetExceeded:
            if twice is None:
                raise
            near = self._step_distance(seen, twice, "another step")
            try:
                farther = twice.apart(self._result_with_time_step(seen, 4.0))
            except NoErrorEstimate:
                farther = None
            return grid_convergence.convergence_index(near, 2.0, order, farther)
        near = self._step_distance(seen, half, "half the step")
        return grid_convergence.error_from_finer(near, 2.0, order, None if twice is None else twice.apart(seen))

    def _result_with_time_step(self, seen: ProbeResultUnderTest, times: float) -> ProbeResultUnderTest:
        """Return the result of a solution with a time step `times` as long. Raises NoErrorEstimate."""
        analysis: Any = self.case.analysis
        case = replace(self.case, analysis=replace(analysis, step=times * self._time_step))
        return seen.of(self.solve_other_model(f"step {times:g}", self.declared, case, 1.0 / times)[0])

    @property
    def _time_step(self) -> float:
        """Time step of the solution, s; in a quasistatic analysis at most the time since the previous output."""
        analysis: Any = self.case.analysis
        step: float = analysis.step
        return min(step, analysis.since_output) if isinstance(analysis, Quasistatic) else step

    def _step_distance(self, seen: ProbeResultUnderTest, other: ProbeResultUnderTest, another: str) -> float:
        """Return the distance between results with two time steps. Raises NoErrorEstimate if it is too large."""
        apart, size = seen.apart(other), max(seen.size, seen.acting)
        if apart > COARSE * size:
            raise NoErrorEstimate(
                f"the time step is too long for an error estimate: the result with {another} differs by "
                f"{100 * apart / size:.2g} %"
            )
        return apart


def _largest_change(seen: ProbeResultUnderTest, step: Floats) -> float | None:
    """Return the largest displacement of a Newton step `step` (n, 3), m, over all nodes, in the unit of the metric.

    The result is None for metrics that do not measure displacements.
    """
    if not seen.is_about_displacements or seen.unit == "s":
        return None
    largest = float(np.linalg.norm(step, axis=1).max(initial=0.0))
    if seen.unit == "m":
        return largest
    size = float(np.sqrt(np.mean(np.sum(np.square(seen.u), axis=-1))))
    return largest / size if size > 0.0 else None


# ------------------------------------------------------------------ errors of all results of a model


def estimate_errors(
    scene: Scene,
    declared: Declared,
    view: View,
    prepared: Prepared,
    result: ModelResult,
    measured: Mapping[str, Any],
    warnings: Sequence[Diagnostic],
    views: Mapping[str, View],
    asked: bool = True,
    before: Sequence[tuple[View, Mapping[str, StatedError]]] = (),
    estimates: dict[str, ErrorEstimate] | None = None,
) -> dict[str, StatedError]:
    """Return the stated error of every metric and probe of a model, by name; empty without an answer.

    `views` are the models that metrics compare with. `before` are the errors stated in the previous states. `estimates`
    are the error estimates of each model in the previous state; the new estimate replaces that of this model. If
    `asked` is false, nobody requested the errors, and only nearly free parts are computed.
    """
    if result.status not in SOLVED:
        return {}
    estimates = {} if estimates is None else estimates
    earlier = estimates.get(declared.name)
    whole = ErrorEstimate(scene, declared, view.case, prepared, result, measured, result.mesh, asked, earlier)
    doubts, found = accuracy_warning_codes(scene, declared, warnings), {}
    void = next((f"{code}: {DOUBTS[code]}" for code in VOID if code in doubts), None)
    for name, seen in _requested_results(scene, result, view, measured, views, asked).items():
        said = _estimate_safely(whole, seen) if void is None else StatedError(reason=void)
        found[name] = replace(said, doubts=tuple(doubts))
    if any(isinstance(m.thing, CurveMetric) for m in scene.of_kind("metric").values()):
        from softmark.interpreter.verification.curve_errors import static_curve_errors

        found |= static_curve_errors(scene, [*before, (view, found)], measured)
    whole.earlier, estimates[declared.name] = None, whole
    return found | _errors_of_given_values(scene, found, measured)


def _errors_of_given_values(
    scene: Scene, found: Mapping[str, StatedError], measured: Mapping[str, Any]
) -> dict[str, StatedError]:
    """Return the stated errors of `value_error` metrics, which compare another metric with a given value.

    Such an error is the stated error of the compared metric, divided by the same number as the difference.
    """
    stated = {}
    for name, metric in scene.of_kind("metric").items():
        thing = metric.thing
        if not isinstance(thing, ErrorOfValue) or thing.of not in found or thing.against not in measured:
            continue
        own = found[thing.of]
        try:
            size = thing.size(measured[thing.against])
        except Undefined as undefined:
            stated[name] = StatedError(reason=str(undefined))
            continue
        parts = {part: None if value is None else value / size for part, value in own.parts.items()}
        stated[name] = replace(own, value=None if own.value is None else own.value / size, unit="1", parts=parts)
    return stated


def _estimate_safely(whole: ErrorEstimate, seen: ProbeResultUnderTest) -> StatedError:
    """Return the stated error of a result; if the estimate fails, the failure becomes the reason for stating none."""
    try:
        return whole.of(seen)
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        reason = f"the error estimate stopped with an error ({type(error).__name__}: {error})"
        return StatedError(reason=reason)


def _requested_results(
    scene: Scene,
    result: ModelResult,
    view: View,
    measured: Mapping[str, Any],
    views: Mapping[str, View],
    asked: bool,
) -> dict[str, ProbeResultUnderTest]:
    """Return the results whose error is estimated, by name: those of metrics and of probes.

    Metrics that use the model itself as reference are included, to show its own accuracy as a reference.
    """
    found: dict[str, ProbeResultUnderTest] = {}
    for name, metric in scene.of_kind("metric").items():
        if isinstance(metric.thing, CurveMetric):
            from softmark.interpreter.verification.curve_errors import history_answer

            if (course := history_answer(scene, metric, view, measured)) is not None:
                found[name] = course
            continue
        if isinstance(metric.thing, Frequency):
            from softmark.interpreter.verification.frequency_errors import frequency_of_view

            if asked and view.vibrations is not None and metric.thing.body_in(scene) == view.body:
                found[name] = frequency_of_view(metric.thing, view)
            continue
        probe = metric.thing.probe_name
        if probe in result.probes:
            right = views.get(metric.thing.measured_from or "")
            seen = _result_under_test(result.probes[probe], metric.thing, view)
            found[name] = seen if right is None else replace(seen, right=right.stress)
        elif _is_about_forces(scene, metric.thing, view):
            nothing = np.zeros((0, 3))
            found[name] = _result_under_test(ProbeResult(nothing, nothing), metric.thing, view)
    return found | {name: _result_under_test(probe, None, view) for name, probe in result.probes.items()}


def _is_about_forces(scene: Scene, metric: Any, view: View) -> bool:
    """Return whether a metric evaluates forces that are known in the results `view` of a model."""
    if not isinstance(metric, ForceMetric) or view.at_rest is None or not view.at_rest.knows(metric.subject_name):
        return False
    return metric.body_in(scene) in (None, view.body)


def _result_under_test(probe: ProbeResult, metric: Any, view: View) -> ProbeResultUnderTest:
    course = probe.course is not None and (metric is None or isinstance(metric, TrajectoryError))
    u, times = (probe.course, probe.times) if course else (probe.displacement, None)
    assert u is not None
    known = (view.history, view.stress, view.at_rest)
    return ProbeResultUnderTest(probe.points, u, times, metric, view.displacement, probe, view, *known)
