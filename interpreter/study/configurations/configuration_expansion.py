"""From scenes, their sweeps and `--vary` to configurations: one model of one scene under one set of overrides.

Every sweep makes a family of configurations around the scene as it is declared; `--vary` makes one family and takes the
place of the sweeps; without either there is the scene as it is. Models that no sweep varies are there as declared.
A configuration's key is a digest of all that decides its result: configurations of one key are computed once.
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
from softmark.interpreter.pipeline.run_environment import describe
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.planning.sweep_expansion import chain, override_of, value_in
from softmark.interpreter.results.state_results import percent
from softmark.interpreter.study.analysis.comparison_point import said_values
from softmark.interpreter.study.configurations.configuration_keys import key_of, key_of_text, needed_models
from softmark.interpreter.study.configurations.configuration_task import told
from softmark.interpreter.study.configurations.task_outcome import PointTask
from softmark.interpreter.validation.requested_names import at_name, unknown_models
from softmark.interpreter.validation.scene_checks import apply_overrides
from softmark.interpreter.vocabulary.study_words import Stability, Sweep
from softmark.records import dataclass

MOST = 100_000  # configurations of one comparison
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
    """One model of one scene under one set of overrides; `task` is what performing it needs."""

    key: str
    scene: str
    model: str
    study: str | None
    variation: Mapping[str, str]
    numbers: Mapping[str, float]
    task: PointTask
    reason: str | None = None  # why it cannot be computed: the scene is in error with these values

    @property
    def label(self) -> str:
        """`corot_tet, h = 5 mm`; for display alone, what it is stands in `variation`."""
        return ", ".join((self.model, *said_values(self.model, self.variation)))

    def described(self) -> dict[str, Any]:
        """The part of a point that says what it is."""
        return {
            "key": self.key, "scene": self.scene, "model": self.model, "label": self.label, "study": self.study,
            "variation": dict(self.variation), "numbers": dict(self.numbers),
        }  # fmt: skip


@dataclass(frozen=True)
class SceneSubject:
    """A scene that takes part: its short name, and the folder that its files are relative to."""

    name: str
    scene: Scene
    folder: Path
    models: tuple[str, ...] = ()  # that take part; all of them without

    def described(self) -> dict[str, Any]:
        """Its entry among the results: what it is called, its text, and what it was made with."""
        known = describe(self.scene)
        if states := states_of(self.scene):  # of which a study looks at the last
            known["title"] = f"{known['title']}, in the last of {len(states)} states, {percent(states[-1])}"
        return {"name": self.name, **{n: known[n] for n in DESCRIBED if n in known}}


def subject_of(scene: Scene, taken: Sequence[str] = ()) -> SceneSubject:
    """A scene under a name that none has taken: that of its file, with a number if need be."""
    stem = Path(scene.path).stem if scene.path else "scene"
    names = (stem, *(f"{stem}-{i}" for i in range(2, len(taken) + 3)))
    folder = scene.table.modules[0].folder if scene.table else Path()
    return SceneSubject(next(n for n in names if n not in taken), scene, folder)


class TooMany(ValueError):
    """More configurations than one comparison may have."""


@dataclass(frozen=True)
class Vary:
    """`--vary h=10mm,5mm`: a name, and the overrides that put each value in its place."""

    name: str
    values: tuple[Override, ...]


@dataclass(frozen=True)
class Additions:
    """What the command line asks for beyond the scenes; `models` empty: all."""

    vary: tuple[Vary, ...] = ()
    models: tuple[str, ...] = ()
    study: str | None = None
    plain: bool = False  # scenes as they are declared, without what their studies vary


# ------------------------------------------------------------------ the command line


def read_vary(texts: Sequence[str]) -> tuple[tuple[Vary, ...], tuple[str, ...]]:
    """The variations of `--vary` options, and the models that `model=a,b` names. Raises SceneError."""
    diagnostics: list[Diagnostic] = []
    found: list[Vary] = []
    models: list[str] = []
    for text in texts:
        name, equals, values = (part.strip() for part in text.partition("="))
        if name == "model" and values.strip(", "):
            models += [v.strip() for v in values.split(",") if v.strip()]
            continue
        parts = split(values) or [""]
        read = [parameter_overrides.read_override(f"{name}{equals}{part}", diagnostics, "--vary") for part in parts]
        found.append(Vary(name, tuple(v for o in read if o is not None for v in _opened(o))))
    names = [v.name for v in found]
    twice = [n for n in names if names.count(n) > 1]
    if twice:
        help = f"give all values at once: `--vary {twice[0]}=VALUE,VALUE`"
        diagnostics.append(at_name("--vary", twice[0], "E220", f"`{twice[0]}` is varied twice", "again", help))
    if diagnostics:
        raise SceneError(diagnostics)
    return tuple(found), tuple(models)


def split(text: str) -> list[str]:
    """The values between commas; those inside brackets and quotes do not count."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        depth += 0 if quoted else (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]


def _opened(override: Override) -> Iterator[Override]:
    """A list as its values, `h=[10, 5]mm` as two; anything else as itself."""
    node = override.node
    if not isinstance(node, tree.List):
        yield _written(override, node)
        return
    for item in node.items:
        plain = isinstance(item, tree.Number | tree.Unary)
        yield _written(override, with_unit(item, node.unit) if node.unit and plain else item)


def _written(override: Override, node: tree.Expression) -> Override:
    return replace(override, node=node, text=f"{override.name}={source_layout.flat(node)}")


# ------------------------------------------------------------------ families


@dataclass(frozen=True)
class _Family:
    study: str | None
    steps: tuple[tuple[Override, ...], ...]  # the combinations of values
    models: tuple[str, ...]


def expand(subjects: Sequence[SceneSubject], asked: Additions) -> list[Configuration]:
    """Every configuration that is asked for, once for each family and key. Raises SceneError for a wrong request."""
    found: list[Configuration] = []
    for subject in subjects:
        _known_names(subject, asked)
        members = [c for family in _families(subject, asked) for c in _distinct(_members(subject, family))]
        own = _settled(members)
        found += own + _beside(subject, asked, own)
    if len(found) > MOST:
        raise TooMany(f"{len(found)} configurations are more than the {MOST} that one comparison may have")
    return found


def _known_names(subject: SceneSubject, asked: Additions) -> None:
    """Raise SceneError for a model, a study, a name or a value of the command line that cannot be meant."""
    problems = unknown_models(subject.scene, asked.models)
    for vary in asked.vary:
        problems += _wrong_values(subject.scene, vary)
    studies = subject.scene.of_kind("study")
    if asked.study is not None and asked.study not in studies:
        known = f"studies: {', '.join(studies)}" if studies else "it declares no study; `--vary h=10mm,5mm` needs none"
        message = f"`{asked.study}` is not a study of the scene"
        problems.append(at_name("--study", asked.study, "E201", message, "not found", known))
    elif asked.study is not None and isinstance(studies[asked.study].thing, Stability):
        message = f"`{asked.study}` is a study of stability, which varies nothing that is compared"
        help = f"carry it out with `dsl stress --study {asked.study}`"
        problems.append(at_name("--study", asked.study, "E213", message, "not compared", help))
    if problems:
        raise SceneError(list(dict.fromkeys(problems)))


def _wrong_values(scene: Scene, vary: Vary) -> Iterator[Diagnostic]:
    """The first error at each value of a variation; one for all values where it is at their name."""
    for override in vary.values:
        errors = (d for d in apply_overrides(scene, [override])[1] if d.severity == "error")
        own = next((d for d in errors if d.source is override.place.source), None)
        if own is not None:
            yield own
            if own.span == override.name_span:
                return


def _families(subject: SceneSubject, asked: Additions) -> list[_Family]:
    models = tuple(asked.models or subject.scene.of_kind("model"))
    if asked.vary:
        return [_Family(None, tuple(product(*(v.values for v in asked.vary))), models)]
    if asked.plain:
        return []
    found = []
    for name, sweep in _sweeps(subject.scene, asked.study).items():
        links = chain(subject.scene, sweep)
        values = [[override_of(link.thing, v) for v in link.thing.over] for link in links]
        allowed = [set(link.thing.models) for link in links if link.thing.models]
        own = tuple(m for m in models if all(m in names for names in allowed))
        found.append(_Family(name, tuple(product(*values)), own))
    return found


def _sweeps(scene: Scene, only: str | None) -> dict[str, Declared]:
    """The sweeps to carry out; those that others are combined with, or models trained on, are no families unasked."""
    studies = scene.of_kind("study")
    if only is not None:
        asked = studies[only]
        name = only if isinstance(asked.thing, Sweep) else asked.thing.over
        return {name: studies[name]} if name in studies else {}
    sweeps = {n: d for n, d in studies.items() if isinstance(d.thing, Sweep)}
    inner = {d.thing.with_ for d in sweeps.values()} | set(with_dependencies(scene, scene.of_kind("model")))
    wanted = {d.thing.over for d in studies.values() if not isinstance(d.thing, Sweep | Stability)}
    return {n: d for n, d in sweeps.items() if n not in inner or n in wanted}


def _settled(members: list[Configuration]) -> list[Configuration]:
    """Models that do not depend on what a study varies belong to none, and are there once."""
    known = {c.key for c in members if c.variation}
    alone = {c.key: replace(c, study=None) for c in members if not c.variation and c.key not in known}
    kept = [c for c in members if c.variation]
    return [*alone.values(), *kept]


def _beside(subject: SceneSubject, asked: Additions, found: Sequence[Configuration]) -> list[Configuration]:
    """Models that are in no family, as the scene declares them."""
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
            reason = next((told([d]) for d in diagnostics if d.severity == "error"), None)
        values = {o.name: o.text.partition("=")[2] for o in step}
        for model in family.models:
            task = task_of(subject, scene, model)
            variation = {n: v for n, v in values.items() if _concerns(subject.scene, n, task.models)}
            numbers = {} if reason else {n: v for n in variation if (v := value_in(scene, n)) is not None}
            yield Configuration(task.key, subject.name, model, family.study, variation, numbers, task, reason)


def _concerns(scene: Scene, varied: str, needed: Sequence[str]) -> bool:
    """Whether what is varied is anything to models that are needed: a field of another model is not."""
    owner = varied.partition(".")[0]
    return owner in needed or owner not in scene.of_kind("model")


def _distinct(members: Iterator[Configuration]) -> list[Configuration]:
    """One configuration for each key; its variation keeps what all of that key have in common."""
    kept: dict[str, Configuration] = {}
    for member in members:
        first = kept.setdefault(member.key, member)
        same = {n: t for n, t in first.variation.items() if member.variation.get(n) == t}
        if len(same) < len(first.variation):
            numbers = {n: v for n, v in first.numbers.items() if n in same}
            kept[member.key] = replace(first, variation=same, numbers=numbers)
    return list(kept.values())


def task_of(subject: SceneSubject, scene: Scene, model: str) -> PointTask:
    """What performing one configuration needs: the text of the scene and the overrides."""
    sound = model in scene.declared
    return PointTask(
        key_of(scene, model) if sound else key_of_text(scene, model), subject.name, model,
        needed_models(scene, model) if sound else (model,), scene.source.text, scene.source.name,
        str(Path(scene.path).resolve()) if scene.path else None, str(subject.folder.resolve()), scene.overrides,
        plugins=tuple(p.asked for p in scene.vocabulary.plugins),
    )  # fmt: skip
