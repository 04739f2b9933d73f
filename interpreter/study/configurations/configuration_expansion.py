"""Expansion of scenes, their sweeps and `--vary` to configurations.

A configuration is one model of one scene with one set of overrides. Every sweep gives a family of configurations around
the declared scene. `--vary` gives one family and replaces the sweeps. Without either there is only the declared scene.
Models that no sweep varies are included as declared. The key of a configuration is a digest of everything that decides
its result, and each key is computed only once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from softmark.grammar import source_layout, tree
from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import parameter_overrides
from softmark.interpreter.language.compiled_scene import Declared, Scene, SceneError
from softmark.interpreter.language.parameter_overrides import Override
from softmark.interpreter.language.scene_states import states_of
from softmark.interpreter.language.sweep_values import with_unit
from softmark.interpreter.pipeline.run_environment import describe_scene
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.planning.sweep_expansion import combined_sweeps, override_of, value_in
from softmark.interpreter.results.state_results import format_state
from softmark.interpreter.study.analysis.comparison_point import format_values
from softmark.interpreter.study.configurations.configuration_keys import invalid_scene_key, key_of, needed_models
from softmark.interpreter.study.configurations.configuration_task import format_diagnostics
from softmark.interpreter.study.configurations.task_outcome import PointTask
from softmark.interpreter.validation.requested_names import at_name, unknown_models
from softmark.interpreter.validation.scene_checks import apply_overrides
from softmark.interpreter.vocabulary.study_words import RobustnessStudy, Sweep
from softmark.records import dataclass

MOST = 100_000  # maximum number of configurations of one comparison
DESCRIBED = (
    "title",
    "file",
    "standard",
    "sha256",
    "text",
    "parameters",
    "overrides",
    "plugins",
)  # of a scene, with results


@dataclass(frozen=True)
class Configuration:
    """One model of one scene with one set of overrides; `task` is the input for computing it."""

    key: str
    scene: str
    model: str
    study: str | None
    variation: Mapping[str, str]
    numbers: Mapping[str, float]
    task: PointTask
    reason: str | None = None  # error of the scene with these values, if any

    @property
    def label(self) -> str:
        """Label for display, such as `corot_tet, h = 5 mm`; the exact values are in `variation`."""
        return ", ".join((self.model, *format_values(self.model, self.variation)))

    def identity_entries(self) -> dict[str, Any]:
        """Return the JSON entries that identify the configuration in a comparison."""
        return {
            "key": self.key, "scene": self.scene, "model": self.model, "label": self.label, "study": self.study,
            "variation": dict(self.variation), "numbers": dict(self.numbers),
        }  # fmt: skip


@dataclass(frozen=True)
class SceneSubject:
    """Scene of a comparison, with a short unique name and the folder of its files."""

    name: str
    scene: Scene
    folder: Path
    models: tuple[str, ...] = ()  # selected models; empty: all

    def scene_entries(self) -> dict[str, Any]:
        """Return the JSON entry of the scene in a comparison: name, text and origin."""
        known = describe_scene(self.scene)
        if states := states_of(self.scene):  # a study uses the last state
            known["title"] = f"{known['title']}, in the last of {len(states)} states, {format_state(states[-1])}"
        return {"name": self.name, **{n: known[n] for n in DESCRIBED if n in known}}


def subject_of(scene: Scene, taken: Sequence[str] = ()) -> SceneSubject:
    """Return a scene with a unique name, different from the names in `taken`.

    The name is that of its file, with a number if necessary.
    """
    stem = Path(scene.path).stem if scene.path else "scene"
    names = (stem, *(f"{stem}-{i}" for i in range(2, len(taken) + 3)))
    folder = scene.table.modules[0].folder if scene.table else Path()
    return SceneSubject(next(n for n in names if n not in taken), scene, folder)


class TooManyConfigurations(ValueError):
    """Error: a comparison has more configurations than are allowed."""


@dataclass(frozen=True)
class Variation:
    """Variation given on the command line, such as `--vary h=10mm,5mm`: a name, and an override for each value."""

    name: str
    values: tuple[Override, ...]


@dataclass(frozen=True)
class CommandLineAdditions:
    """Selection of models and studies, and variations, given on the command line; empty `models` means all models."""

    vary: tuple[Variation, ...] = ()
    models: tuple[str, ...] = ()
    study: str | None = None
    plain: bool = False  # scenes as they are declared, without what their studies vary


# ------------------------------------------------------------------ the command line


def read_vary(texts: Sequence[str]) -> tuple[tuple[Variation, ...], tuple[str, ...]]:
    """Return the variations that `--vary` options describe, and the models in `--vary model=a,b`. Raises SceneError."""
    diagnostics: list[Diagnostic] = []
    found: list[Variation] = []
    models: list[str] = []
    for text in texts:
        name, equals, values = (part.strip() for part in text.partition("="))
        if name == "model" and values.strip(", "):
            models += [v.strip() for v in values.split(",") if v.strip()]
            continue
        parts = split_values(values) or [""]
        read = [parameter_overrides.read_override(f"{name}{equals}{part}", diagnostics, "--vary") for part in parts]
        found.append(Variation(name, tuple(v for o in read if o is not None for v in _expand_list(o))))
    names = [v.name for v in found]
    twice = [n for n in names if names.count(n) > 1]
    if twice:
        help = f"give all values at once: `--vary {twice[0]}=VALUE,VALUE`"
        diagnostics.append(at_name("--vary", twice[0], "E220", f"`{twice[0]}` is varied twice", "varied again", help))
    if diagnostics:
        raise SceneError(diagnostics)
    return tuple(found), tuple(models)


def split_values(text: str) -> list[str]:
    """Split values at commas, except inside brackets and quotes."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        depth += 0 if quoted else (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]


def _expand_list(override: Override) -> Iterator[Override]:
    """Yield one override for each value of a list, such as two for `h=[10, 5]mm`; other overrides unchanged."""
    node = override.node
    if not isinstance(node, tree.List):
        yield _override_with_value(override, node)
        return
    for item in node.items:
        plain = isinstance(item, tree.Number | tree.Unary)
        yield _override_with_value(override, with_unit(item, node.unit) if node.unit and plain else item)


def _override_with_value(override: Override, node: tree.Expression) -> Override:
    return replace(override, node=node, text=f"{override.name}={source_layout.format_on_one_line(node)}")


# ------------------------------------------------------------------ families


@dataclass(frozen=True)
class _Family:
    """Family of configurations: the combinations of varied values of one study, for some models."""

    study: str | None
    steps: tuple[tuple[Override, ...], ...]  # the combinations of values
    models: tuple[str, ...]


def expand(subjects: Sequence[SceneSubject], asked: CommandLineAdditions) -> list[Configuration]:
    """Return all requested configurations of some scenes. Raises SceneError, TooManyConfigurations.

    Within a family, configurations with equal keys are merged to one.
    """
    found: list[Configuration] = []
    for subject in subjects:
        _check_names(subject, asked)
        members = [c for family in _families(subject, asked) for c in _remove_duplicates(_members(subject, family))]
        own = _merge_independent(members)
        found += own + _unvaried_models(subject, asked, own)
    if len(found) > MOST:
        raise TooManyConfigurations(f"there are {len(found)} configurations; a comparison may have at most {MOST}")
    return found


def _check_names(subject: SceneSubject, asked: CommandLineAdditions) -> None:
    """Check the models, studies, names and values given on the command line. Raises SceneError."""
    problems = unknown_models(subject.scene, asked.models)
    for vary in asked.vary:
        problems += _value_errors(subject.scene, vary)
    studies = subject.scene.of_kind("study")
    if asked.study is not None and asked.study not in studies:
        known = f"studies: {', '.join(studies)}" if studies else "it declares no study; use `--vary h=10mm,5mm`"
        message = f"`{asked.study}` is not a study of the scene"
        problems.append(at_name("--study", asked.study, "E201", message, "not found", known))
    elif asked.study is not None and isinstance(studies[asked.study].thing, RobustnessStudy):
        message = f"`{asked.study}` is a robustness study, which cannot be compared"
        help = f"run it with `dsl robustness --study {asked.study}`"
        problems.append(at_name("--study", asked.study, "E213", message, "not compared", help))
    if problems:
        raise SceneError(list(dict.fromkeys(problems)))


def _value_errors(scene: Scene, vary: Variation) -> Iterator[Diagnostic]:
    """Yield the first error of each value of a variation.

    If the varied name is wrong, yield only one error.
    """
    for override in vary.values:
        errors = (d for d in apply_overrides(scene, [override])[1] if d.severity == "error")
        own = next((d for d in errors if d.source is override.place.source), None)
        if own is not None:
            yield own
            if own.span == override.name_span:
                return


def _families(subject: SceneSubject, asked: CommandLineAdditions) -> list[_Family]:
    models = tuple(asked.models or subject.scene.of_kind("model"))
    if asked.vary:
        return [_Family(None, tuple(product(*(v.values for v in asked.vary))), models)]
    if asked.plain:
        return []
    found = []
    for name, sweep in _select_sweeps(subject.scene, asked.study).items():
        links = combined_sweeps(subject.scene, sweep)
        values = [[override_of(link.thing, v) for v in link.thing.over] for link in links]
        allowed = [set(link.thing.models) for link in links if link.thing.models]
        own = tuple(m for m in models if all(m in names for names in allowed))
        found.append(_Family(name, tuple(product(*values)), own))
    return found


def _select_sweeps(scene: Scene, only: str | None) -> dict[str, Declared]:
    """Return the sweeps to run, by name.

    A sweep that is part of another sweep, or training data of a model, is run only if a study uses it or `only` names
    it.
    """
    studies = scene.of_kind("study")
    if only is not None:
        asked = studies[only]
        name = only if isinstance(asked.thing, Sweep) else asked.thing.over
        return {name: studies[name]} if name in studies else {}
    sweeps = {n: d for n, d in studies.items() if isinstance(d.thing, Sweep)}
    inner = {d.thing.with_ for d in sweeps.values()} | set(with_dependencies(scene, scene.of_kind("model")))
    wanted = {d.thing.over for d in studies.values() if not isinstance(d.thing, Sweep | RobustnessStudy)}
    return {n: d for n, d in sweeps.items() if n not in inner or n in wanted}


def _merge_independent(members: list[Configuration]) -> list[Configuration]:
    """Return the configurations, with a single one for each model that no varied value affects.

    Such a configuration belongs to no study.
    """
    known = {c.key for c in members if c.variation}
    alone = {c.key: replace(c, study=None) for c in members if not c.variation and c.key not in known}
    kept = [c for c in members if c.variation]
    return [*alone.values(), *kept]


def _unvaried_models(
    subject: SceneSubject, asked: CommandLineAdditions, found: Sequence[Configuration]
) -> list[Configuration]:
    """Return configurations, as declared, of the models that are in no family."""
    if asked.study is not None and found:
        return []
    varied_ = {c.model for c in found}
    wanted = asked.models or subject.models or subject.scene.of_kind("model")
    models = tuple(m for m in wanted if m not in varied_)
    return list(_members(subject, _Family(None, ((),), models)))


def _members(subject: SceneSubject, family: _Family) -> Iterator[Configuration]:
    for step in family.steps:
        scene, reason = subject.scene, None
        if step:
            scene, diagnostics = apply_overrides(subject.scene, step)
            reason = next((format_diagnostics([d]) for d in diagnostics if d.severity == "error"), None)
        values = {o.name: o.text.partition("=")[2] for o in step}
        for model in family.models:
            task = task_of(subject, scene, model)
            variation = {n: v for n, v in values.items() if _affects_models(subject.scene, n, task.models)}
            numbers = {} if reason else {n: v for n in variation if (v := value_in(scene, n)) is not None}
            yield Configuration(task.key, subject.name, model, family.study, variation, numbers, task, reason)


def _affects_models(scene: Scene, varied: str, needed: Sequence[str]) -> bool:
    """Return whether a varied name can affect the models `needed`; fields of other models cannot."""
    owner = varied.partition(".")[0]
    return owner in needed or owner not in scene.of_kind("model")


def _remove_duplicates(members: Iterator[Configuration]) -> list[Configuration]:
    """Return one configuration for each key.

    Its variation keeps only the values that all configurations with this key have in common.
    """
    kept: dict[str, Configuration] = {}
    for member in members:
        first = kept.setdefault(member.key, member)
        same = {n: t for n, t in first.variation.items() if member.variation.get(n) == t}
        if len(same) < len(first.variation):
            numbers = {n: v for n, v in first.numbers.items() if n in same}
            kept[member.key] = replace(first, variation=same, numbers=numbers)
    return list(kept.values())


def task_of(subject: SceneSubject, scene: Scene, model: str) -> PointTask:
    """Return the task of computing a model of a scene: its key, the text of the scene and the overrides."""
    sound = model in scene.declared
    return PointTask(
        key_of(scene, model) if sound else invalid_scene_key(scene, model), subject.name, model,
        needed_models(scene, model) if sound else (model,), scene.source.text, scene.source.name,
        str(Path(scene.path).resolve()) if scene.path else None, str(subject.folder.resolve()), scene.overrides,
        plugins=tuple(p.asked for p in scene.vocabulary.plugins),
    )  # fmt: skip
