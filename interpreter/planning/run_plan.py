"""From a scene to what its questions need, and no more.

Questions are probes, metrics and expectations. A model or reference is worked on because a question is about
it, a mesh because a model is, and each task keeps the place in the scene that asks for it.
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
    """One piece of work: `asked` is the question that needs it, `needs` the tasks that come before it."""

    kind: str  # mesh | solve | reference | probe | metric | expect
    name: str
    detail: str
    asked: Location
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """The tasks in an order in which they can be done; `idle` are declarations that nothing asks for."""

    tasks: tuple[Task, ...]
    models: tuple[str, ...]
    references: tuple[str, ...]
    idle: tuple[str, ...]


def plan_of(scene: Scene, only: tuple[str, ...] = ()) -> Plan:
    """The plan of a scene; `only` restricts the models. Raises Fault for a model of an unclear body."""
    asked = asked_of(scene)
    models = tuple(n for n in scene.of_kind("model") if n in asked and (not only or n in only))
    references = tuple(n for n in scene.of_kind("reference") if n in asked)
    tasks = (
        *_meshes(scene, models, asked),
        *(_solve(scene, n, asked[n]) for n in models),
        *(Task("reference", n, _known(scene.declared[n]), asked[n]) for n in references),
        *_questions(scene, models, references),
    )
    idle = tuple(n for n in _workers(scene) if n not in asked)
    return Plan(tasks, models, references, idle)


def asked_of(scene: Scene) -> dict[str, Location]:
    """Models and references that something asks for, and what does. Raises Fault for one of an unclear body."""
    askers = _askers(scene)
    places = {n: askers.get(("body", body_of(scene, d))) or askers.get(("name", n)) for n, d in _workers(scene).items()}
    return {n: place for n, place in places.items() if place is not None}


def _workers(scene: Scene) -> dict[str, Declared]:
    return {**scene.of_kind("model"), **scene.of_kind("reference")}


def _askers(scene: Scene) -> dict[tuple[str, str], Location]:
    """The first question in the text about a `body`, or about a model or reference by its `name`."""
    found: dict[tuple[str, str], Location] = {}
    for question in (*scene.of_kind("probe").values(), *scene.of_kind("metric").values()):
        for body in _bodies(scene, question):
            found.setdefault(("body", body), question.location)
    for expectation in scene.expectations:
        for name in named_in(expectation.node):
            found.setdefault(("name", name), expectation.location)
    return found


def _bodies(scene: Scene, question: Declared) -> tuple[str, ...]:
    """The body that a probe or metric looks at; all where a metric is about the computation itself."""
    if question.kind == "metric" and question.thing.looked_at is None:
        own = question.thing.body_in(scene)
        return tuple(scene.of_kind("body")) if own is None else (own,)
    probe = question if question.kind == "probe" else scene.declared[question.thing.probe]
    return (probe.thing.body,)


def named_in(node: tree.Expression) -> set[str]:
    """Models and references that an expectation is about: what stands before the dot."""
    return {name.parts[0] for name in find_metrics(node)}


def _meshes(scene: Scene, models: tuple[str, ...], asked: dict[str, Location]) -> list[Task]:
    """One mesh for all models that want the same."""
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


def _solve(scene: Scene, name: str, asked: Location) -> Task:
    declared = scene.declared[name]
    body = body_of(scene, declared)
    needs = (f"mesh {body}",) if declared.thing.mesh_key() is not None else ()
    states = states_of(scene)
    each = f", in {len(states)} states" if len(states) > 1 else ""
    return Task("solve", name, declared.thing.outline(case_of(scene, body)) + each, asked, needs)


def _known(reference: Declared) -> str:
    """What a reference is; `self_converged: quads and hexes at (12, 9, 6) mm, 6 solutions` of one that refines."""
    if reference.thing.how != "refined":
        return reference.constructor.name
    names, sizes = reference.thing.methods, reference.thing.sizes.values
    each = f"{' and '.join(names)} at {units.format_vector(sizes, units.LENGTH)}"
    return f"{reference.constructor.name}: {each}, {len(names) * len(sizes)} solutions"


def _questions(scene: Scene, models: tuple[str, ...], references: tuple[str, ...]) -> list[Task]:
    found, workers = [], defaultdict[str, list[str]](list)
    for name in (*models, *references):
        workers[body_of(scene, scene.declared[name])].append(name)
    for probe in scene.of_kind("probe").values():
        owners = workers[probe.thing.body]
        points = _points(probe)
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
        over, against = metric.thing.looked_at, metric.thing.measured_from
        compared = (f" against {against}" if against else "") + (f" over {over}" if over else "")
        detail = f"{metric.constructor.name}{compared}"
        needs = tuple(str(name) for name in (over, against) if name)
        found.append(Task("metric", metric.name, detail, metric.location, needs))
    for expectation in scene.expectations:
        needs = tuple(sorted(named_in(expectation.node)))
        found.append(Task("expect", "", expectation.text, expectation.location, needs))
    return found


def _points(probe: Declared) -> str:
    """How many points, or what kind."""
    if probe.thing.ends is not None:
        return f"{probe.thing.points} points"
    if probe.thing.stations is None:
        return f"a {probe.constructor.name}" if probe.constructor.name != "markers" else "tracked points"
    count = len(probe.thing.stations)
    return f"{count} point" + ("s" if count > 1 else "")
