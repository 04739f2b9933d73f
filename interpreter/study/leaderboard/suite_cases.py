"""Cases of a suite with their scenes: the judging metric, its reference, and the models that take part."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from softmark.grammar.diagnostic import Diagnostic
from softmark.grammar.name_suggestions import nearest
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene, SceneError
from softmark.interpreter.language.scene_sources import standard_name
from softmark.interpreter.problem.body_case import body_of, case_of
from softmark.interpreter.study.configurations.configuration_expansion import SceneSubject, subject_of
from softmark.interpreter.study.configurations.configuration_task import format_diagnostics
from softmark.interpreter.study.leaderboard.suite_file import Case, Suite
from softmark.records import dataclass

Load = Callable[[str], tuple[Scene | None, list[Diagnostic]]]


@dataclass(frozen=True)
class Entrant:
    """Model that takes part in a case.

    `name` is its name in the scene. `model` is its description without mesh size, which is the same in all cases.
    """

    name: str
    model: str


@dataclass(frozen=True)
class BoardCase:
    """Case together with its scene; if the scene has errors, `subject` is None and `reason` describes them."""

    case: Case
    subject: SceneSubject | None
    entrants: tuple[Entrant, ...] = ()
    against: str | None = None
    kind: str = ""
    source: str = ""
    unit: str = "1"
    reason: str | None = None

    @property
    def title(self) -> str:
        """Title of the scene, or its name if it could not be read."""
        return self.subject.scene.title if self.subject else self.case.scene


def cases_of_suite(suite: Suite, load: Load) -> tuple[list[BoardCase], list[Diagnostic]]:
    """Return the cases of a suite with their scenes, and the errors of the suite.

    Each scene is loaded once. A case whose scene has errors is returned without a scene.
    """
    found: list[BoardCase] = []
    faults: list[Diagnostic] = []
    known: dict[str, SceneSubject | Diagnostic | str] = {}
    for case in suite.cases:
        own = known.get(case.scene) or _subject(case, suite.folder, load, known)
        known.setdefault(case.scene, own)
        if isinstance(own, Diagnostic):
            faults.append(own)
        elif isinstance(own, str):
            found.append(BoardCase(case, None, reason=own))
        elif (wrong := _check_case(case, own.scene)) is not None:
            faults.append(wrong)
        else:
            found.append(_board_case(case, own))
    return found, faults


def _subject(
    case: Case, folder: Path, load: Load, known: Mapping[str, SceneSubject | Diagnostic | str]
) -> SceneSubject | str | Diagnostic:  # fmt: skip
    """Return the scene of a case under a unique name.

    Return the errors of the scene as text if it has any, or the error of the case if there is no such scene.
    """
    beside = folder / case.scene
    scene, diagnostics = load(str(beside) if beside.is_file() else case.scene)
    if scene is not None:
        return subject_of(scene, [s.name for s in known.values() if isinstance(s, SceneSubject)])
    errors = [d for d in diagnostics if d.severity == "error"]
    if errors[0].code == "E401" and errors[0].span is None:
        return case.fault("E742", "scene", errors[0].message, "no scene", errors[0].help)
    return format_diagnostics(errors)


def case_of_scene(scene: Scene, taken: Sequence[str]) -> BoardCase:
    """Return a scene as a case that is judged by its first error metric, without a tolerance."""
    subject = subject_of(scene, taken)
    errors = [n for n, d in scene.of_kind("metric").items() if d.thing.measured_from in scene.of_kind("reference")]
    file = standard_name(scene.path) or scene.path or subject.name
    case = Case(subject.name, file, errors[0] if errors else None, asks=scene.title)
    return _board_case(case, subject)


def _check_case(case: Case, scene: Scene) -> Diagnostic | None:
    """Return the error of a case that does not fit its scene, such as a metric that the scene lacks; else None."""
    metrics, references = scene.of_kind("metric"), scene.of_kind("reference")
    named = f"`{case.scene}`"
    if case.by not in metrics:
        close = nearest(case.by or "", metrics)
        hint = f"did you mean `{close}`?" if close else f"metrics are {', '.join(metrics) or 'none'}"
        return case.fault("E743", "by", f"{named} has no metric `{case.by}`", "not a metric", hint)
    metric = metrics[case.by]
    if metric.thing.measured_from not in references:
        errors = [n for n, d in metrics.items() if d.thing.measured_from in references]
        hint = f"metrics with a reference: {', '.join(errors)}" if errors else "give the metric `against = ...`"
        return case.fault("E743", "by", f"`{case.by}` has no reference", "not an error", hint)
    kind = references[metric.thing.measured_from].thing.kind
    if case.kind != kind:
        message = (
            f"`{metric.thing.measured_from}`, the reference of `{case.by}`, is of another kind: {_with_article(kind)}"
        )
        return case.fault("E744", "kind", message, "another kind", f"write `kind = {kind.replace(' ', '_')}`")
    if (wanted := units.parse_unit(metric.thing.unit).dimension) != case.dimension:
        given = units.dimension_name(case.dimension)
        message = f"`{case.by}` is {units.dimension_name(wanted)}, but its tolerance is {given}"
        return case.fault("E745", "within", message, "another unit", f"give it in {units.usual_units(wanted)}")
    return None


def _with_article(kind: str) -> str:
    return f"a {kind}" if kind in ("measurement", "consensus") else kind


def subjects_of(cases: Sequence[BoardCase]) -> list[SceneSubject]:
    """Return each scene of some cases once, with the models of all its cases."""
    found: dict[str, SceneSubject] = {}
    for case in cases:
        if case.subject is not None:
            own = found.setdefault(case.subject.name, case.subject)
            names = dict.fromkeys((*own.models, *(e.name for e in case.entrants)))
            found[own.name] = replace(own, models=tuple(names))
    return list(found.values())


# ------------------------------------------------------------------ participating models


def _board_case(case: Case, subject: SceneSubject) -> BoardCase:
    scene = subject.scene
    found = BoardCase(case, subject, entrants_of(scene, case.by))
    metric = None if case.by is None else scene.declared[case.by].thing
    reference = None if metric is None else scene.declared[metric.measured_from]
    if metric is None or reference is None:
        return found
    source = str(vars(reference.thing).get("source_") or reference.thing.source or "")
    return replace(found, against=reference.name, kind=reference.thing.kind, source=source, unit=metric.unit)


def entrants_of(scene: Scene, metric: str | None) -> tuple[Entrant, ...]:
    """Return the models that take part in a case: those of the body that the metric measures."""
    body = None if metric is None else _measured_body(scene, scene.declared[metric])
    models = scene.of_kind("model")
    return tuple(
        Entrant(n, describe_model(scene, d)) for n, d in models.items() if body in (None, _body_or_none(scene, d))
    )


def _measured_body(scene: Scene, metric: Declared) -> str | None:
    """Return the body that a metric measures, directly or through another metric; None for all bodies."""
    of = vars(metric.thing).get("of")
    found: str | None = metric.thing.body_in(scene)
    return found if found or of not in scene.declared else _measured_body(scene, scene.declared[of])


def _body_or_none(scene: Scene, model: Declared) -> str | None:
    try:
        return body_of(scene, model)
    except SceneError:
        return None


def describe_model(scene: Scene, model: Declared) -> str:
    """Return a description of a model without size and body, such as `hex8, finite strain`.

    It identifies the same model in different cases.
    """
    body = _body_or_none(scene, model)
    kind = None if body is None else model.thing.kind(case_of(scene, body))
    if kind is not None:
        return str(kind.words)
    if (of := vars(model.thing).get("of")) in scene.declared:
        return f"{model.constructor.name} of {describe_model(scene, scene.declared[of])}"
    own = vars(model.thing)
    what = own.get("element") or own.get("network") or model.constructor.name.replace("_", " ")
    return f"{what}, {own['strain']} strain" if "strain" in own else str(what)
