"""Scene of a robustness study with changed values: its errors, and the tasks that solve its models."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import field, replace

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import parameter_overrides
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.scene_states import in_last_state
from softmark.interpreter.planning.robustness_plan import ResolvedStudy
from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject, task_of
from softmark.interpreter.study.configurations.configuration_task import is_about
from softmark.interpreter.study.configurations.task_outcome import PointTask, TruthRequest
from softmark.interpreter.study.robustness.point_classification import ABOUT_REFERENCES
from softmark.interpreter.study.robustness.reference_uncertainty import beam_theory_error
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint
from softmark.interpreter.validation.scene_checks import apply_overrides
from softmark.records import dataclass

COMPILING = 600.0  # minimum CPU s for the first point of a model, which compiles kernels

Values = tuple[tuple[str, Value], ...]  # of quantities, in their order


@dataclass(frozen=True)
class SceneAtValues:
    """Scene with changed values, with the errors of its validation.

    `theory` is the relative modelling error of its reference. `doubt` is the reason if the reference is invalid,
    else None.
    """

    scene: Scene
    errors: tuple[Diagnostic, ...]
    theory: float = 0.0
    doubt: str | None = None


@dataclass
class VariedScene:
    """Scene of one robustness study, which can be built with any values of the varied quantities."""

    subject: SceneSubject
    asked: ResolvedStudy
    _sites: dict[Values, SceneAtValues] = field(default_factory=dict)
    _tasks: dict[tuple[Values, str], PointTask] = field(default_factory=dict)

    def quantity(self, name: str) -> WalkedQuantity:
        """Return the varied quantity with this name."""
        return next(q for q in self.asked.quantities if q.name == name)

    def values(self, changed: Mapping[str, Value]) -> Values:
        """Return those of the given values that differ from the scene, in the order of the study's quantities."""
        named = ((q, changed.get(q.name, q.nominal)) for q in self.asked.quantities)
        return tuple((q.name, v) for q, v in named if v != q.nominal)

    def texts(self, values: Values) -> dict[str, str]:
        """Return each value as the text of an override, by the name of the quantity."""
        return {name: self.quantity(name).written(v) for name, v in values}

    def scene_at(self, values: Values) -> SceneAtValues:
        """Return the scene with changed values, compiled once for all models."""
        if values not in self._sites:
            self._sites[values] = self._compile_scene(values)
        return self._sites[values]

    def _compile_scene(self, values: Values) -> SceneAtValues:
        given = [parameter_overrides.read_override(self.quantity(n).override(v), []) for n, v in values]
        scene, found = apply_overrides(self.subject.scene, [o for o in given if o is not None])
        errors = tuple(d for d in found if d.severity == "error")
        if self.asked.against not in scene.declared:
            return SceneAtValues(scene, errors)
        return SceneAtValues(scene, errors, *beam_theory_error(in_last_state(scene), self.asked.against))

    def task(self, values: Values, model: str) -> PointTask:
        """Return the task of a model in the scene with changed values.

        Its key covers the configuration and the requested results.
        """
        if (values, model) not in self._tasks:
            task = task_of(self.subject, self.scene_at(values).scene, model)
            truth = self._reference_model()
            asked = "stated" if truth is None else f"stated, and {truth.model} by {truth.metric}"
            key = hashlib.sha256(f"{task.key} {asked}".encode()).hexdigest()
            first = None if values else COMPILING
            self._tasks[values, model] = replace(task, key=key, limit_s=first, truth=truth, stated=True, alone=True)
        return self._tasks[values, model]

    def _reference_model(self) -> TruthRequest | None:
        """Return the model that serves as the reference, and its metric; None if the reference is not a model."""
        known = self.subject.scene.declared.get(self.asked.against)
        if known is None or known.kind != "model":
            return None
        return TruthRequest(self.asked.against, self.asked.metric)

    def refusal(self, values: Values, model: str) -> ClassifiedPoint | None:
        """Return the class of a model that validation refuses at these values; None without errors about it."""
        site = self.scene_at(values)
        if not site.errors:
            return None
        own = [d for d in site.errors if not _is_about_another_model(site.scene, self.subject.scene, d, model)]
        of_truth = [d for d in site.errors if self._is_about_reference_model(site.scene, d)]
        if not own and not of_truth and model in site.scene.declared:
            return None  # errors of other models do not matter here
        worst = (own or of_truth or list(site.errors))[0]
        message = f"{worst.code}: {worst.message}" + (f"; {worst.help}" if worst.help else "")
        if not own:
            return ClassifiedPoint("unjudged", message=f"the scene cannot be built there: {message}", code=worst.code)
        word = "unjudged" if is_about(self.subject.scene.of_kind("reference").values(), worst) else "refused"
        word = "unjudged" if worst.code in ABOUT_REFERENCES else word
        return ClassifiedPoint(word, message=message, code=worst.code)

    def _is_about_reference_model(self, scene: Scene, error: Diagnostic) -> bool:
        """Return whether an error concerns the model that serves as the reference."""
        if self._reference_model() is None:
            return False
        known = [s.declared.get(self.asked.against) for s in (scene, self.subject.scene)]
        return is_about([d for d in known if d is not None], error)


def _is_about_another_model(scene: Scene, nominal: Scene, error: Diagnostic, model: str) -> bool:
    """Return whether an error concerns a model other than `model`."""
    others = [d for s in (scene, nominal) for n, d in s.of_kind("model").items() if n != model]
    return is_about(others, error)
