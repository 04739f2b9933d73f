"""Plan of a robustness study: the study with all its defaults filled in, and the errors in its declaration."""

from __future__ import annotations

import re
from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic, did_you_mean
from softmark.interpreter.language.compiled_scene import Declared, Location, Scene
from softmark.interpreter.language.foreign_words import find_misspelling
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.sweep_values import SweepTarget
from softmark.interpreter.metrics.metric_base import DerivedMetric, DisplacementMetric, ForceMetric
from softmark.interpreter.metrics.value_error import ErrorOfValue
from softmark.interpreter.planning.parameter_walk import Until
from softmark.interpreter.planning.varied_quantities import Unwalkable, WalkedQuantity, default_quantities, quantity_of
from softmark.interpreter.problem.body_case import Fault, body_of
from softmark.interpreter.problem.theories import theory_setup_of
from softmark.interpreter.vocabulary.study_words import RobustnessStudy
from softmark.records import dataclass
from softmark.references.measured_curve import CurveFromFile
from softmark.references.published_values import GivenValues

TOLD = CurveFromFile | GivenValues  # given data: valid only for the unchanged body, unless a closed form
NUMERICAL = {  # fields that are numerical settings, not part of the problem
    "analysis": ("step", "tolerance", "max_iterations"),
    "contact": ("distance", "stiffness", "parts", "reach"),
}
MAPPED = 3  # quantities up to which `maps = auto` maps every pair


@dataclass(frozen=True)
class ResolvedStudy:
    """Robustness study with all defaults filled in.

    `against` is the reference of its metric, and `probe` the probe of its metric, "" if the metric has none.
    """

    name: str
    metric: str
    against: str
    probe: str
    within: float
    until: Until
    models: tuple[str, ...]
    quantities: tuple[WalkedQuantity, ...]
    mapped: bool


def resolve_study(scene: Scene, study: Declared | None, only: tuple[str, ...] = ()) -> ResolvedStudy:
    """Return a robustness study with all defaults filled in; by default one over all numbers of the scene.

    `only` restricts the models. The scene must have no errors in its studies.
    """
    thing = RobustnessStudy() if study is None else study.thing
    name = "everything" if study is None else study.name
    metric = scene.declared[thing.metric or next(find_judging_metrics(scene), "")]
    if thing.over is None:
        quantities = tuple(q for q in default_quantities(scene) if follows_quantity(scene, metric, q))
    else:
        quantities = tuple(quantity_of(scene, target.name) for target in thing.over)
    mapped = thing.maps == "pairs" or (thing.maps == "auto" and len(quantities) <= MAPPED)
    return ResolvedStudy(
        name, metric.name, metric.thing.against, metric.thing.probe_name or "", thing.within, thing.until,
        _studied_models(scene, metric, only or thing.models or ()), quantities, mapped,
    )  # fmt: skip


def find_judging_metrics(scene: Scene) -> Iterator[str]:
    """Yield the metrics that can judge a model: relative errors for which the error of the reference is known."""
    for metric in scene.of_kind("metric").values():
        thing = metric.thing
        relative = thing.measured_from and (thing.probe_name or thing.subject_name) and thing.unit == "1"
        if relative and _is_reference_error_known(scene, metric):
            yield metric.name


def _is_reference_error_known(scene: Scene, metric: Declared) -> bool:
    """Return whether the error of the reference is known in the same quantity as the metric.

    References state their error as a displacement, and values have their own uncertainty. Theories of contact state the
    neglected part of forces, and models estimate the error of the metric.
    """
    against = scene.declared.get(metric.thing.against)
    if isinstance(metric.thing, DisplacementMetric):
        return True
    if isinstance(metric.thing, ErrorOfValue):
        return metric.thing.relative_to == "value" and against is not None and is_closed_form(scene, against)
    if against is None:
        return False
    if isinstance(metric.thing, ForceMetric) and against.kind == "reference":
        return theory_setup_of(against).estimates_force_error
    return against.kind == "model"


def is_closed_form(scene: Scene, reference: Declared) -> bool:
    """Return whether the values of a reference are an expression of parameters, so that they follow every change."""
    if not isinstance(reference.thing, GivenValues) or reference.thing.kind != "theory":
        return False
    words = re.findall(r"[A-Za-z_]\w*", reference.at("values").text)
    return any(name.rpartition(".")[2] in words for name in scene.parameters)


def follows_quantity(scene: Scene, metric: Declared, quantity: WalkedQuantity) -> bool:
    """Return whether the true value of a metric follows a varied quantity.

    A closed form follows only its own parameters.
    """
    if not isinstance(metric.thing, ErrorOfValue) or quantity.name in scene.parameters:
        return True
    owner, _, attribute = quantity.name.rpartition(".")
    kind = scene.declared[owner].kind
    return kind == "model" or attribute in NUMERICAL.get(kind, ())


def _studied_models(scene: Scene, metric: Declared, asked: tuple[str, ...]) -> tuple[str, ...]:
    """Return the models of the metric's body that the study solves, without the model that is the reference."""
    body = metric.thing.body_in(scene)
    found = []
    for name, model in scene.of_kind("model").items():
        try:
            own = body in (None, body_of(scene, model))
        except Fault:
            continue
        if (
            own
            and not model.thing.reason_without_robustness
            and name != metric.thing.against
            and (not asked or name in asked)
        ):
            found.append(name)
    return tuple(found)


# ------------------------------------------------------------------ errors


def find_study_errors(scene: Scene, study: Declared) -> Iterator[Diagnostic]:
    """Yield the errors in the declaration of a robustness study, for a scene without other errors."""
    yield from _find_metric_errors(scene, study)
    seen: set[str] = set()
    judge = scene.declared.get(study.thing.metric or next(find_judging_metrics(scene), ""))
    for target in study.thing.over or ():
        found = _target_error(scene, study, target, target.name in seen, judge)
        seen.add(target.name)
        if found is not None:
            yield found
    for name in study.thing.models or ():
        if scene.declared[name].kind != "model" or "." in name:
            yield diagnostic(
                "E512",
                study.at("models"),
                f"`{name}` is not a model of this scene",
                "not declared here",
                "name models of this scene, or leave `models` out",
            )
        elif why := scene.declared[name].thing.reason_without_robustness:
            yield diagnostic("E512", study.at("models"), f"`{name}` cannot be tested in a robustness study: {why}",
                             "cannot be tested", "name models that are solved here, or leave `models` out")  # fmt: skip


def no_judge_error(scene: Scene, at: Location | None, name: str) -> Diagnostic:
    """Return the error about a scene without a metric that can decide whether models are right."""
    references = {n: r for n, r in scene.of_kind("reference").items() if not isinstance(r.thing, TOLD)}
    against = next(iter(references), "theory")
    help = f"declare one: `metric eta = relative_l2_error(PROBE, against = {against})`"
    help += "" if references else ", and a reference such as `reference theory = simo_reissner(BODY)`"
    errors = {n: m.thing.measured_from for n, m in scene.of_kind("metric").items() if m.thing.measured_from}
    lacks = "the scene has none"
    if errors:
        first = next(iter(errors))
        lacks = f"`{first}` cannot decide it: {_reason_metric_cannot_judge(scene, first)}"
    message = f"`{name}` needs a relative error to decide whether a model is right, but {lacks}"
    source, span = (at.source, at.span) if at else (None, None)
    return Diagnostic("E513", message, source, span, "no relative error" if at else "", help)


def _reason_metric_cannot_judge(scene: Scene, name: str) -> str:
    """Return the reason why a metric cannot decide whether models are right."""
    thing = scene.declared[name].thing
    against = thing.measured_from
    if thing.unit != "1":
        return f"it is in {thing.unit}, not a relative error"
    if against is None:
        return "it has no reference"
    if not isinstance(thing, DerivedMetric):
        return f"the uncertainty of `{against}` is known for its displacements, not for this metric"
    known = scene.declared[against].thing.kind
    if known == "theory":
        return "it is relative to the uncertainty of the value, not to the value itself"
    how = "agreed on" if known == "consensus" else "measured"
    return f"`{against}` was {how} for this body and is not valid for varied parameters"


def _find_metric_errors(scene: Scene, study: Declared) -> Iterator[Diagnostic]:
    """Yield the errors about the metric of a study."""
    usable = list(find_judging_metrics(scene))
    name = study.thing.metric
    if name is None:
        if not usable:
            yield no_judge_error(scene, study.at(), study.name)
    elif name not in usable:
        help = f"metrics that can: {', '.join(usable)}" if usable else no_judge_error(scene, None, study.name).help
        problem = f"`{name}` cannot decide whether a model is right: {_reason_metric_cannot_judge(scene, name)}"
        yield diagnostic("E513", study.at("metric"), problem, "cannot judge", help)


def _target_error(
    scene: Scene, study: Declared, target: SweepTarget, again: bool, judge: Declared | None
) -> Diagnostic | None:
    """Return the error about a quantity that the study cannot vary, or None."""
    at = Location(study.at("over").source, target.span)
    if again:
        return diagnostic(
            "E512", at, f"`{study.name}` varies `{target.name}` twice", "varied again", "name each quantity once"
        )
    try:
        quantity = quantity_of(scene, target.name)
    except Unwalkable as unfit:
        return diagnostic("E512", at, str(unfit), "cannot be varied", unfit.help)
    except KeyError:
        return _unknown_field_error(scene, at, target.name)
    if not quantity.ladders and len(quantity.options) < 2:
        return diagnostic("E512", at, f"`{target.name}` cannot be varied: its range contains no other value",
                          "cannot be varied",
                          "widen its range: `param h = 10 mm in 1 mm .. 100 mm`")  # fmt: skip
    if judge is not None and not follows_quantity(scene, judge, quantity):
        truth = judge.thing.against
        return diagnostic("E512", at, f"`{target.name}` cannot be varied: the values of `{truth}` do not depend on it",
                          "the reference stays the same",
                          f"declare a `param`, use it here and in `{truth}`, and vary the parameter")  # fmt: skip
    return None


def _unknown_field_error(scene: Scene, at: Location, name: str) -> Diagnostic:
    """Return the error message for an unknown field."""
    owner, _, attribute = name.rpartition(".")
    constructor = scene.declared[owner].constructor
    close = find_misspelling(attribute, [f.name for f in constructor.fields])
    fields = ", ".join(f.name for f in constructor.fields) or "none"
    help = did_you_mean(close, f"{owner}.{close}") if close else f"fields of `{constructor.name}`: {fields}"
    return diagnostic("E205", at, f"`{constructor.name}` has no field `{attribute}`", "not a field", help)
