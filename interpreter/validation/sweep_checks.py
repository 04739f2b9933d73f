"""Checks of the studies of a scene, which try every value of a sweep.

The scene is compiled again with each value, so the checks and messages are the same as for the scene itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import field_schema
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.sweep_values import SweepTarget, Variant
from softmark.interpreter.planning import robustness_plan
from softmark.interpreter.planning.sweep_expansion import combined_sweeps, override_of, value_in
from softmark.interpreter.validation.scene_checks import apply_overrides
from softmark.interpreter.vocabulary.study_words import Convergence, RobustnessStudy, Sweep
from softmark.records import dataclass

MOST = 50  # largest number of sweeps of a scene
TRIED, TEXT = 200, 2_000_000  # limits for checking all sweeps: values to compile, and total characters
FEWEST = 3  # least number of values for an observed order: Celik et al. (2008)


def check(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of the studies of a scene that has no other errors; duplicates are possible."""
    studies = scene.of_kind("study")
    sweeps = {n: s.thing for n, s in studies.items() if isinstance(s.thing, Sweep)}
    if len(sweeps) > MOST:
        last = list(sweeps)[MOST]
        yield diagnostic("E510", studies[last].at(), f"the scene has {len(sweeps)} sweeps", "one sweep too many",
                         f"write several scenes: a scene has at most {MOST} sweeps")  # fmt: skip
        return
    size = scene.table.size if scene.table else 0
    each = max(FEWEST, min(TRIED, TEXT // (size + 1)) // max(1, len(sweeps)))
    tried = {
        n: [_compile_with_value(scene, sweep, v) for v in _pick_values(sweep.over, each)] for n, sweep in sweeps.items()
    }
    for name, study in studies.items():
        if name in tried:
            yield from _check_sweep(scene, study, tried[name])
        elif isinstance(study.thing, RobustnessStudy):
            yield from robustness_plan.find_study_errors(scene, study)
        else:
            yield from _check_sweep_user(scene, study, tried)


@dataclass(frozen=True)
class _TriedValue:
    """Value of a sweep as a number in SI units, with the errors of the scene that uses it."""

    variant: Variant
    number: float | None
    errors: list[Diagnostic]


def _pick_values(over: Sequence[Variant], most: int) -> Sequence[Variant]:
    """Return all values of a sweep, or at most `most` of them including both ends; a comparison checks the others."""
    if len(over) <= most:
        return over
    return [over[round(i * (len(over) - 1) / (most - 1))] for i in range(most)]


def _compile_with_value(scene: Scene, sweep: Sweep, variant: Variant) -> _TriedValue:
    """Return the scene's errors if it is compiled with one value of a sweep."""
    other, diagnostics = apply_overrides(scene, [override_of(sweep, variant)])
    return _TriedValue(variant, value_in(other, sweep.target.name), [d for d in diagnostics if d.severity == "error"])


def _check_sweep(scene: Scene, study: Declared, tried: Sequence[_TriedValue]) -> Iterator[Diagnostic]:
    """Yield the errors that the values of one sweep cause in the scene."""
    if study.thing.with_ is not None:
        yield from _check_names_sweep(scene, study, "with")
    links = combined_sweeps(scene, study)
    targets = [link.thing.target.name for link in links if isinstance(link.thing, Sweep)]
    twice = next((name for name in targets if targets.count(name) > 1), None)
    if twice is not None:
        yield diagnostic("E510", study.at("with"), f"`{study.name}` varies `{twice}` twice", "varied again",
                         "remove one of them, or sweep something else")  # fmt: skip
    for name in study.thing.models or ():
        if scene.declared[name].kind != "model" or "." in name:
            yield diagnostic(
                "E510", study.at("models"), f"`{name}` is not a model of this scene", "not declared here", ""
            )
    for one in tried:
        if one.errors:
            yield _variant_error(study.thing.target, one)


def _variant_error(target: SweepTarget, tried: _TriedValue) -> Diagnostic:
    """Return one error of the scene with a value of a sweep, placed at this value.

    An error about the value itself is preferred to an error that it causes elsewhere.
    """
    places, source = (tried.variant.at.span, target.span), tried.variant.at.source
    own = (d for d in tried.errors if d.source is source and d.span is not None
           and any(p.start <= d.span.start and d.span.end <= p.end for p in places))  # fmt: skip
    return next(own, None) or _error_at_sweep_value(target.name, tried.variant, tried.errors[0])


def _error_at_sweep_value(name: str, variant: Variant, error: Diagnostic) -> Diagnostic:
    """Return an error elsewhere in the scene, placed at the value of the sweep that causes it."""
    note = ""
    if error.span is not None and error.source is not None:
        note = f"{error.code} in {error.source.name}, line {error.span.line}"
    message = f"the scene is invalid with `{name} = {variant.text}`: {error.message}"
    notes = (note,) if note else ()
    return diagnostic("E511", variant.at, message, "invalid value", error.help, notes)


def _check_sweep_user(
    scene: Scene, study: Declared, tried: Mapping[str, Sequence[_TriedValue]]
) -> Iterator[Diagnostic]:
    """Check that a convergence study or Pareto front refers to a usable sweep."""
    if study.thing.over is None:
        return
    found = list(_check_names_sweep(scene, study, "over"))
    yield from found
    if found or not isinstance(study.thing, Convergence):
        return
    sweep = scene.declared[study.thing.over]
    values = tried.get(sweep.name)
    if values is None:  # sweep of another scene file
        values = [_compile_with_value(scene, sweep.thing, v) for v in _pick_values(sweep.thing.over, 20)]
    numbers = {one.number for one in values if one.number is not None}
    if len(numbers) < FEWEST:
        message = f"`{study.name}` needs at least {FEWEST} different numbers to find an order of convergence"
        yield diagnostic("E510", study.at("over"), message, f"`{sweep.name}` has {len(numbers)}",
                         "add values to the sweep, such as halves of the last")  # fmt: skip


def _check_names_sweep(scene: Scene, study: Declared, field: str) -> Iterator[Diagnostic]:
    name = study.value(field)
    other = scene.declared[name]
    if not isinstance(other.thing, Sweep):
        word = other.constructor.name
        sweeps = [n for n, d in scene.of_kind("study").items() if isinstance(d.thing, Sweep)]
        example = "declare one: `study NAME = sweep(h, over = [10, 5] mm)`"
        help = f"sweeps: {field_schema.join_names(sweeps)}" if sweeps else example
        yield diagnostic("E213", study.at(field), f"expected a sweep, found the {word} `{name}`", f"a {word}", help)
