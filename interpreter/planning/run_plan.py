"""Plan of a run: the tasks that the probes, metrics and expectations of a scene need, and no others.

Probes, metrics and expectations are called questions. A model or reference is solved only if a question is
about it, and a mesh is made only if a model needs it. Each task records the place in the scene that needs it.
"""

from __future__ import annotations

from collections import defaultdict

from softmark.grammar import tree
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Location, Scene
from softmark.interpreter.language.expectation_conditions import find_metrics
from softmark.interpreter.language.scene_states import states_of
from softmark.interpreter.problem.body_case import body_of, case_of
from softmark.records import dataclass


@dataclass(frozen=True)
class Task:
    """One task of a run, such as solving a model or evaluating a metric.

    `asked` is the location in the scene of the metric or expectation that needs the task. `needs` are the names
    of the tasks that must run before it.
    """

    kind: str  # mesh | solve | reference | probe | metric | expect
    name: str
    detail: str
    asked: Location
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """Tasks of a run in a valid order; `idle` are the models and references that nothing in the scene needs."""

    tasks: tuple[Task, ...]
    models: tuple[str, ...]
    references: tuple[str, ...]
    idle: tuple[str, ...]


def plan_of(scene: Scene, only: tuple[str, ...] = ()) -> Plan:
    """Return the plan of a scene; `only` restricts the models. Raises Fault if the body of a model is ambiguous."""
    asked = find_needed(scene)
    models = tuple(n for n in scene.of_kind("model") if n in asked and (not only or n in only))
    references = tuple(n for n in scene.of_kind("reference") if n in asked)
    tasks = (
        *_make_mesh_tasks(scene, models, asked),
        *(_make_solve_task(scene, n, asked[n]) for n in models),
        *(Task("reference", n, _describe_reference(scene.declared[n]), asked[n]) for n in references),
        *_make_evaluation_tasks(scene, models, references),
    )
    idle = tuple(n for n in _models_and_references(scene) if n not in asked)
    return Plan(tasks, models, references, idle)


def find_needed(scene: Scene) -> dict[str, Location]:
    """Return the needed models and references by name, each with the first place in the scene that needs it.

    Raises Fault if a body is ambiguous.
    """
    askers = _first_questions(scene)
    places = {
        n: askers.get(("body", body_of(scene, d))) or askers.get(("name", n))
        for n, d in _models_and_references(scene).items()
    }
    return {n: place for n, place in places.items() if place is not None}


def _models_and_references(scene: Scene) -> dict[str, Declared]:
    """Return all models and references of a scene, by name."""
    return {**scene.of_kind("model"), **scene.of_kind("reference")}


def _first_questions(scene: Scene) -> dict[tuple[str, str], Location]:
    """Return for each subject the first place in the scene with a probe, metric or expectation about it.

    A subject is a pair: `body` and the name of a body, or `name` and the name of a model or reference.
    """
    found: dict[tuple[str, str], Location] = {}
    for question in (*scene.of_kind("probe").values(), *scene.of_kind("metric").values()):
        for body in _bodies_of_question(scene, question):
            found.setdefault(("body", body), question.location)
    for expectation in scene.expectations:
        for name in names_in_expectation(expectation.node):
            found.setdefault(("name", name), expectation.location)
    return found


def _bodies_of_question(scene: Scene, question: Declared) -> tuple[str, ...]:
    """Return the body of a probe or metric; all bodies for a metric such as computing time, which has none."""
    if question.kind == "metric" and question.thing.probe_name is None:
        own = question.thing.body_in(scene)
        return tuple(scene.of_kind("body")) if own is None else (own,)
    probe = question if question.kind == "probe" else scene.declared[question.thing.probe]
    return (probe.thing.body,)


def names_in_expectation(node: tree.Expression) -> set[str]:
    """Return the models and references that an expectation names, as in `rod.eta`."""
    return {name.parts[0] for name in find_metrics(node)}


def _make_mesh_tasks(scene: Scene, models: tuple[str, ...], asked: dict[str, Location]) -> list[Task]:
    """Return the tasks that make meshes, one task for all models that use the same mesh."""
    wanted: dict[tuple[object, ...], list[str]] = {}
    for name in models:
        model = scene.declared[name].thing
        if (key := model.mesh_key()) is not None:
            wanted.setdefault((body_of(scene, scene.declared[name]), *key), []).append(name)
    found = []
    for (body, *_), names in wanted.items():
        model = scene.declared[names[0]].thing
        detail = f"{model.mesh_words(case_of(scene, str(body)))} for {', '.join(names)}"
        found.append(Task("mesh", str(body), detail, asked[names[0]]))
    return found


def _make_solve_task(scene: Scene, name: str, asked: Location) -> Task:
    """Return the task that solves a model; `asked` is the place in the scene that needs it."""
    declared = scene.declared[name]
    body = body_of(scene, declared)
    needs = (f"mesh {body}",) if declared.thing.mesh_key() is not None else ()
    states = states_of(scene)
    each = f", in {len(states)} states" if len(states) > 1 else ""
    return Task("solve", name, declared.thing.outline(case_of(scene, body)) + each, asked, needs)


def _describe_reference(reference: Declared) -> str:
    """Return a description of a reference: `self_converged: quads and hexes at (12, 9, 6) mm, 6 solutions`."""
    if reference.thing.how != "refined":
        return reference.constructor.name
    names, sizes = reference.thing.methods, reference.thing.sizes.values
    each = f"{' and '.join(names)} at {units.format_vector(sizes, units.LENGTH)}"
    return f"{reference.constructor.name}: {each}, {len(names) * len(sizes)} solutions"


def _make_evaluation_tasks(scene: Scene, models: tuple[str, ...], references: tuple[str, ...]) -> list[Task]:
    """Return the tasks that evaluate probes, metrics and expectations."""
    found, workers = [], defaultdict[str, list[str]](list)
    for name in (*models, *references):
        workers[body_of(scene, scene.declared[name])].append(name)
    for probe in scene.of_kind("probe").values():
        owners = workers[probe.thing.body]
        points = _describe_probe_points(probe)
        found.append(
            Task(
                "probe",
                probe.name,
                f"{points} in {', '.join(owners) or 'nothing'}",
                probe.location,
                tuple(owners),
            )
        )
    for metric in scene.of_kind("metric").values():
        over, against = metric.thing.probe_name, metric.thing.measured_from
        compared = (f" against {against}" if against else "") + (f" over {over}" if over else "")
        detail = f"{metric.constructor.name}{compared}"
        needs = tuple(str(name) for name in (over, against) if name)
        found.append(Task("metric", metric.name, detail, metric.location, needs))
    for expectation in scene.expectations:
        needs = tuple(sorted(names_in_expectation(expectation.node)))
        found.append(Task("expect", "", expectation.text, expectation.location, needs))
    return found


def _describe_probe_points(probe: Declared) -> str:
    """Return the number of points of a probe, as text, or the kind of probe."""
    if probe.thing.ends is not None:
        return f"{probe.thing.points} points"
    if probe.thing.stations is None:
        return f"a {probe.constructor.name}" if probe.constructor.name != "markers" else "tracked points"
    count = len(probe.thing.stations)
    return f"{count} point" + ("s" if count > 1 else "")
