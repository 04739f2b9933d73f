"""States that a reduced model is trained on: the full model solved at parts of the load, over the values of a sweep."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compile import recompiled
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.models.fem import build
from softmark.interpreter.models.reduced.words import ADVICE
from softmark.interpreter.models.shared.prepared import Workshop
from softmark.interpreter.models.springs.calibration import scaled
from softmark.interpreter.plan import sweeps
from softmark.interpreter.problem.case import Case, case_for, fault
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.statics.equilibrium import NotConverged, equilibrium

if TYPE_CHECKING:
    from softmark.interpreter.models.reduced.words import Pod
    from softmark.solvers.mesh.mesh import Mesh

SAME = 1e-9  # of a range: values that far outside are within


@dataclass(frozen=True)
class Training:
    """States x (s, dofs) of the full model, m, what was imposed in each, and what the report says of them.

    `ranges` are the values of what was varied, numbers or lists of numbers or texts; `failed` are settings without an
    equilibrium. `seconds` are wall and CPU.
    """

    states: Floats
    settings: tuple[str, ...]
    ranges: dict[str, list[Any]]
    failed: tuple[str, ...]
    seconds: tuple[float, float]


@dataclass(frozen=True)
class Setting:
    """One scene of the sweep, in words and as values by target."""

    words: str
    scene: Scene
    values: dict[str, Any] = field(default_factory=dict)


def trained(model: Pod, declared: Declared, case: Case, mesh: Mesh, workshop: Workshop) -> Training:
    """The training states of a model, computed once for all that share them. Raises Fault."""
    scene = scene_of(workshop, declared)
    key: Any = ("training", model.of, model.parts, model.over)
    if key not in workshop.meshes:
        workshop.meshes[key] = _computed(model, declared, case, mesh, scene, workshop)
        return known(workshop, key)
    found = known(workshop, key)
    workshop.borrowed = (
        workshop.borrowed[0] + found.seconds[0],
        workshop.borrowed[1] + found.seconds[1],
    )
    return found


def known(workshop: Workshop, key: Any) -> Training:
    """What a workshop keeps of a training."""
    found: Training = workshop.meshes[key]
    return found


def scene_of(workshop: Workshop, declared: Declared) -> Scene:
    """The scene that is being run. Raises Fault where there is none."""
    if workshop.scene is None:
        raise fault("E532", declared.at("of"), f"`{declared.name}` has no scene to find `{declared.thing.of}` in")
    return workshop.scene


def _computed(
    model: Pod, declared: Declared, case: Case, mesh: Mesh, scene: Scene, workshop: Workshop
) -> Training:
    wall, cpu = time.perf_counter(), time.process_time()
    states, settings, failed = [], [], []
    ranges: dict[str, list[Any]] = {"load": sorted(set(model.parts))}
    for setting in _settings(model, scene):
        for target, value in setting.values.items():
            seen = ranges.setdefault(target, [])
            seen += [] if value in seen else [value]
        full = setting.scene.declared[model.of]
        own = case_for(setting.scene, full)
        bench = _bench(declared, case, own, mesh, full, workshop)
        for part in dict.fromkeys(model.parts):
            words = f"{100 * part:g} % of the load{setting.words}"
            static, _ = build.at_rest(full.thing, full, scaled(own, part), bench)
            try:
                states.append(equilibrium(static.problem).x)
                settings.append(words)
            except NotConverged as failure:
                failed.append(f"{words}: {failure.reason}")
    spent = time.perf_counter() - wall, time.process_time() - cpu
    return Training(np.array(states).reshape(-1, mesh.points.size), tuple(settings), ranges, tuple(failed), spent)


def _bench(
    declared: Declared, case: Case, own: Case, mesh: Mesh, full: Declared, workshop: Workshop
) -> Workshop:
    """A workshop that holds the one mesh of all training. Raises Fault where the sweep varies it."""
    key = build.mesh_key(full.thing, own)
    same = own.shape == case.shape and key == build.mesh_key(_full(declared, workshop).thing, case)
    if not same:
        raise fault(
            "E532",
            declared.at("over"),
            f"`{declared.thing.over}` varies the mesh of `{full.name}`",
            "another mesh",
            "fields of one mesh say nothing on another: sweep a load, a displacement or a material",
        )
    return Workshop({key: mesh}, scene=workshop.scene, measured=workshop.measured)


def _full(declared: Declared, workshop: Workshop) -> Declared:
    return scene_of(workshop, declared).declared[declared.thing.of]


def _settings(model: Pod, scene: Scene) -> Iterator[Setting]:
    """The scene with each value of the sweep; as it is where none is named."""
    if model.over is None:
        yield Setting("", scene)
        return
    links = sweeps.chain(scene, scene.declared[model.over])
    for chosen in itertools.product(*(link.thing.over for link in links)):
        pairs = [(link.thing, variant) for link, variant in zip(links, chosen, strict=True)]
        other, _ = recompiled(scene, [sweeps.override_of(sweep, variant) for sweep, variant in pairs])
        words = "".join(f", {sweep.target.name} = {variant.text}" for sweep, variant in pairs)
        names = [sweep.target.name for sweep, _ in pairs]
        yield Setting(words, other, {name: value(other, name) for name in names})


def value(scene: Scene, name: str) -> Any:
    """What a parameter or a field is in a scene: a number, a list of numbers, or a text."""
    if name in scene.parameters:
        found: Any = scene.parameters[name].value
        return found.value if hasattr(found, "value") else list(found.values)
    owner, _, attribute = name.rpartition(".")
    declared = scene.declared[owner]
    known_field = declared.constructor.field(attribute)
    thing = getattr(declared.thing, known_field.attribute if known_field else attribute)
    if isinstance(thing, int | float) and not isinstance(thing, bool):
        return float(thing)
    return list(thing) if isinstance(thing, tuple) else str(thing)


# ------------------------------------------------------------------ beyond the training


def beyond(training: Training, scene: Scene) -> list[str]:
    """What of the scene as it is lies outside the range of the training: `load`, or targets of its sweep."""
    here = _here(training, scene)
    return [name for name, seen in training.ranges.items() if not _within(here[name], seen)]


def _here(training: Training, scene: Scene) -> dict[str, Any]:
    """What was varied, as the scene has it."""
    return {name: 1.0 if name == "load" else value(scene, name) for name in training.ranges}


def repeats(training: Training, scene: Scene) -> bool:
    """Whether the scene as it is was itself a setting of the training: its error then says how well it repeats."""
    here = _here(training, scene)
    return not training.failed and all(
        any(_within(here[name], [one]) for one in seen) for name, seen in training.ranges.items()
    )


def _within(here: Any, seen: list[Any]) -> bool:
    """Whether a value lies among those seen: in their range by components; a text is one of them."""
    if isinstance(here, str):
        return here in seen
    low, high = np.min(np.array(seen, dtype=float), axis=0), np.max(np.array(seen, dtype=float), axis=0)
    slack = SAME * np.maximum(np.abs(low), np.abs(high))
    return bool(np.all(low - slack <= here) and np.all(here <= high + slack))


def extrapolates(declared: Declared, found: list[str]) -> tuple[Diagnostic, ...]:
    """A warning where the scene lies outside the sweep that it was trained on; that of loads is known to a check."""
    targets = [f"`{name}`" for name in found if name != "load"]
    if not targets:
        return ()
    at, verb = declared.at("over"), "lies" if len(targets) == 1 else "lie"
    return (
        Diagnostic(
            "W331",
            f"`{declared.name}` extrapolates: {' and '.join(targets)} {verb} outside its training",
            at.source,
            at.span,
            "not seen in training",
            ADVICE,
        ),
    )
