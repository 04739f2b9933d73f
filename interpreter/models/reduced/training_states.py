"""Training states of a reduced model: the full model solved at fractions of the load, over the values of a sweep."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem import fem_builder
from softmark.interpreter.models.reduced.reduced_declaration import ADVICE
from softmark.interpreter.models.reduced.training_scenes import scenes
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.models.spring_network.stiffness_calibration import scale_case
from softmark.interpreter.planning.sweep_expansion import value_of
from softmark.interpreter.problem.body_case import Case, case_for, fault
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats
from softmark.solvers.runtime.work_count import count_seconds, counted, seconds_since
from softmark.solvers.statics.static_equilibrium import NotConverged, equilibrium

if TYPE_CHECKING:
    from softmark.interpreter.models.reduced.reduced_declaration import Pod
    from softmark.solvers.mesh.mesh import Mesh

SAME = 1e-9  # of a range: values so little outside count as inside


@dataclass(frozen=True)
class Training:
    """Training states of the full model x (s, dofs), m, with the displacements imposed in each, and a report.

    `ranges` are the values of the varied quantities: numbers, lists of numbers or texts. `failed` are settings
    without an equilibrium. `seconds` are wall and CPU time, and
    `nominal` is the nominal CPU time, s.
    """

    states: Floats
    settings: tuple[str, ...]
    ranges: dict[str, list[Any]]
    failed: tuple[str, ...]
    seconds: tuple[float, float]
    nominal: float


def train(model: Pod, declared: Declared, case: Case, mesh: Mesh, workshop: BuildContext) -> Training:
    """Return the training states of a model, computed once for all models with the same training. Raises Fault."""
    scene = scene_of(workshop, declared)
    key: Any = ("training", model.of, model.parts, model.over)
    if key not in workshop.meshes:
        workshop.meshes[key] = _compute_training(model, declared, case, mesh, scene, workshop)
        return stored_training(workshop, key)
    found = stored_training(workshop, key)
    count_seconds(found.nominal)
    workshop.borrowed = (
        workshop.borrowed[0] + found.seconds[0],
        workshop.borrowed[1] + found.seconds[1],
    )
    return found


def stored_training(workshop: BuildContext, key: Any) -> Training:
    """Return the training that is stored in a workshop under a key."""
    found: Training = workshop.meshes[key]
    return found


def scene_of(workshop: BuildContext, declared: Declared) -> Scene:
    """Return the scene that is being run. Raises Fault if there is none."""
    if workshop.scene is None:
        raise fault(
            "E532",
            declared.at("of"),
            f"`{declared.name}` was built without a scene, so that `{declared.thing.of}` cannot be looked up",
        )
    return workshop.scene


def _compute_training(
    model: Pod, declared: Declared, case: Case, mesh: Mesh, scene: Scene, workshop: BuildContext
) -> Training:
    """Return the training states of a model, computed for every setting and fraction of the load."""
    wall, cpu, before = time.perf_counter(), time.process_time(), counted()
    states, settings, failed = [], [], []
    ranges: dict[str, list[Any]] = {"load": sorted(set(model.parts))}
    for setting in scenes(model.over, scene):
        for target, one in setting.values.items():
            seen = ranges.setdefault(target, [])
            seen += [] if one in seen else [one]
        full = setting.scene.declared[model.of]
        own = case_for(setting.scene, full)
        # of one mesh, as validation has checked
        bench = BuildContext({full.thing.meshed_as(own): mesh}, scene=workshop.scene, measured=workshop.measured)
        for part in dict.fromkeys(model.parts):
            words = f"{100 * part:g} % of the load{setting.words}"
            static, _ = fem_builder.build_static(full.thing, full, scale_case(own, part), bench)
            try:
                states.append(equilibrium(static.problem).x)
                settings.append(words)
            except NotConverged as failure:
                failed.append(f"{words}: {failure.reason}")
    spent = time.perf_counter() - wall, time.process_time() - cpu
    u = np.array(states).reshape(-1, mesh.points.size)
    return Training(u, tuple(settings), ranges, tuple(failed), spent, seconds_since(before))


# ------------------------------------------------------------------ beyond the training


def values_outside_training(training: Training, scene: Scene) -> list[str]:
    """Return the names of values of the scene outside the range of the training: `load`, or targets of the sweep."""
    here = _values_of_scene(training, scene)
    return [name for name, seen in training.ranges.items() if not _is_in_range(here[name], seen)]


def _values_of_scene(training: Training, scene: Scene) -> dict[str, Any]:
    """Return the values of the scene for the quantities that the training varied."""
    return {name: 1.0 if name == "load" else value_of(scene, name) for name in training.ranges}


def is_in_training_set(training: Training, scene: Scene) -> bool:
    """Return whether the training set contains the scene itself.

    The error of the reduced model then shows only how well it reproduces a state that it was trained on.
    """
    here = _values_of_scene(training, scene)
    return not training.failed and all(
        any(_is_in_range(here[name], [one]) for one in seen) for name, seen in training.ranges.items()
    )


def _is_in_range(here: Any, seen: list[Any]) -> bool:
    """Return whether a value lies in the range of training values, by components; a text must equal one of them."""
    if isinstance(here, str):
        return here in seen
    low, high = np.min(np.array(seen, dtype=float), axis=0), np.max(np.array(seen, dtype=float), axis=0)
    slack = SAME * np.maximum(np.abs(low), np.abs(high))
    return bool(np.all(low - slack <= here) and np.all(here <= high + slack))


def extrapolation_warnings(declared: Declared, found: list[str]) -> tuple[Diagnostic, ...]:
    """Return a warning if the scene lies outside the sweep that the model was trained on.

    `found` are the names of values outside the training range. The load is not reported, because validation does so.
    """
    targets = [f"`{name}`" for name in found if name != "load"]
    if not targets:
        return ()
    at, verb = declared.at("over"), "lies" if len(targets) == 1 else "lie"
    return (
        diagnostic(
            "W331",
            at,
            f"`{declared.name}` extrapolates: {' and '.join(targets)} {verb} outside the training range",
            "not in the training range",
            ADVICE,
        ),
    )
