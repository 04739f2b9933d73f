"""What every word of the vocabulary keeps to: functions that take a class, yours or ours, and assert it.

    check_word      documented, frozen, each field with its range and meaning, explained by `dsl explain`, a stable text
    check_shape     it makes meshes and surfaces of what it says that it is; a prism is one in all that it says
    check_load      it says how it acts, and less of it at a part of its size
    check_support   it selects components of a body, and what it imposes shrinks with its part
    check_probe     it finds its points in a body
    check_metric    it measures, or says why not; zero against itself where it is an error
    check_model     it says what it is, and refuses what it does not take; what it takes it builds, and solves
A class is tried under a name of its own in its table: `with added(LOADS, "magnet", Magnet): ...`.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count, product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from along_an_axis import check_swept

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.cli.conformance import Breach
from softmark.interpreter.cli.conformance.load_contracts import load_breaches
from softmark.interpreter.cli.conformance.metric_contracts import metric_breaches
from softmark.interpreter.cli.conformance.trial_scenes import CLAMP, LOADED, LOOK
from softmark.interpreter.cli.conformance.word_contracts import repr_breaches, word_breaches
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models import MODELS
from softmark.interpreter.models.model_builders import build, load
from softmark.interpreter.models.shared.capabilities import NETWORKS
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.problem.body_case import Case, case_for, case_of
from softmark.interpreter.problem.probe_points import find_probe_points
from softmark.interpreter.results.run_report import ModelKind, ModelResult
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.interpreter.verification.by_model import verifier_of
from softmark.interpreter.verification.by_model.verifier import Verifier
from softmark.interpreter.vocabulary import LOADS, SUPPORTS
from softmark.interpreter.vocabulary.loads.load import Action, Load
from softmark.interpreter.vocabulary.supports.support import Support
from softmark.records import dataclass
from softmark.solvers.mesh.shape import Prism, Section, Shape, Swept, transverse

HERE = Path(__file__).parent  # for the tables that words name
SIZE = (0.04, 0.02, 0.02)  # m, of the body that words are tried on
BODY = """softmark 1
scene "contract"
material gel = neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (40, 20, 20) mm, origin = (0, -10, -10) mm), gel)
"""
NETWORK = BODY.replace(
    "solid(box(size = (40, 20, 20) mm, origin = (0, -10, -10) mm), gel)",
    "network([(0, 0, 0), (20, 0, 0), (40, 0, 0)] mm, members = [(1, 2), (2, 3)], material = gel, side = 20 mm)",
)
BEADS = 'reference beads = markers("beads.csv", unit = 1 mm, uncertainty = 0.1 mm)\n'

SUPPORTED = {
    "fixed": "fixed(bar, where = x >= 40 mm, components = (y, z))",
    "displaced": "displaced(bar, where = x >= 40 mm, by = (0, 0, 1) mm)",
    "rotated": "rotated(bar, where = x >= 40 mm, axis = +x, angle = 10 deg)",
    "symmetric": "symmetric(bar, where = y <= -10 mm)",
    "measured_motion": "measured_motion(bar, where = x >= 40 mm, of = beads, reach = 15 mm)",
    "elastic_foundation": "elastic_foundation(bar, where = z <= 0 mm, stiffness = 1 kPa/mm)",
    "rigid_plate": "rigid_plate(bar, where = x >= 40 mm)",
    "drained": "drained(bar, where = x >= 40 mm)",
    "pore_pressure": "pore_pressure(bar, where = x >= 40 mm, value = 1 kPa)",
    "pinned": "pinned(bar, where = x >= 40 mm, by = (0, 0, 1) mm, components = z)",
}
ANALYSED = {
    "rest": "",
    "path": "analysis a = static(path = arc_length)\n",
    "disturbed": "analysis a = static(disturbed = scrambled, amount = 0.1)\n",
    "implicit": "analysis a = dynamic(duration = 2 ms, step = 1 ms)\n",
    "explicit": "analysis a = dynamic(duration = 20 us, step = 10 us, integrator = central_differences)\n",
}
_number = count()


@contextmanager
def added(table: dict[str, Any], name: str, thing: Any) -> Iterator[str]:
    """A word that is in a table for a while, under a name that nothing else has had."""
    own = f"{name}_{next(_number)}"
    table[own] = thing
    try:
        yield own
    finally:
        del table[own]


def scene_of(text: str) -> tuple[Any, list[Diagnostic]]:
    """A scene, None of one in error, and what is said of it, in the folder of the tables."""
    scene: Scene | None
    scene, found = load_scene(Source("contract", text), HERE, HERE / "contract.scene", [])
    return scene, found


def errors(found: list[Diagnostic]) -> list[str]:
    """Codes of the errors among diagnostics."""
    return [d.code for d in found if d.severity == "error"]


# ------------------------------------------------------------------ every word


def kept(breaches: Iterable[Breach]) -> None:
    """Nothing breaks the contract."""
    assert [b.what for b in breaches if not b.untried] == []


def check_word(cls: type[Any], kind: str, name: str) -> None:
    """Documented, frozen, annotated, explained."""
    kept(word_breaches(cls, kind, name))


def check_text(thing: Any) -> None:
    """Its text is that of its values, the same in every process: results are known by it."""
    kept(repr_breaches(thing))


# ------------------------------------------------------------------ shapes


def check_shape(shape: Shape, size: float) -> None:
    """Derived from Shape; its mesh and its surface with cells of `size` (m) are those of what it says of itself."""
    assert isinstance(shape, Shape)
    said = {n for base in (Shape, Swept, Prism, Section) for n in vars(base) if not n.startswith("_")}
    hidden = said & {f.name for f in dataclasses.fields(shape)}  # type: ignore[arg-type]
    assert not hidden, f"these say what a shape is, and are no fields: {hidden}"
    check_text(shape)
    mesh, (X, triangles) = shape.mesh("tet4", size), shape.surface(size)
    volume = float(mesh.volumes.sum())
    near = 1e-3 if shape.enclosed else 1e-9  # its surface is that of the file, which the mesh is next to
    a, b, c = (X[triangles[:, i]] for i in range(3))
    assert np.isclose(np.einsum("ti,ti->", a, np.cross(b, c)) / 6.0, volume, rtol=near), "closed, and outward"
    slack = 1e-9 * mesh.extent
    if shape.bounds is None:
        assert shape.diagonal == 0.0
        assert shape.coordinate_ranges == {}
    else:
        low, high = (np.array(end) for end in shape.bounds)
        assert np.isclose(shape.diagonal, np.linalg.norm(high - low), rtol=1e-12)
        for points in (mesh.points, X):
            assert np.all(points >= low - slack)
            assert np.all(points <= high + slack)
        for ends in product(*shape.coordinate_ranges.values()) if shape.coordinate_ranges else ():
            place = np.array(shape.place(**dict(zip(shape.coordinate_ranges, ends, strict=True))))
            assert np.all(place >= low - slack)
            assert np.all(place <= high + slack)
    assert shape.volume is None or abs(volume / shape.volume - 1.0) < 0.1, "of a mesh this fine"
    counts, finer = (shape.counts(h) for h in (size, size / 2.0))
    assert (counts is None) == (finer is None) == (shape.enclosed or shape.prebuilt)
    assert counts is None or finer is None or all(0 < n <= m for n, m in zip(counts, finer, strict=True))
    assert shape.file or not shape.prebuilt
    corners = mesh.points[mesh.facets]
    owned = np.zeros(len(corners))
    for side in shape.sides:
        own = side.of(corners)
        assert own.shape == (len(corners),)
        assert own.any()
        owned += own
        there = corners[own].reshape(-1, 3)
        np.testing.assert_allclose(np.stack(side.project_points(tuple(there.T)), axis=1), there, atol=slack)
    assert np.all(owned <= 1), "a facet is of one side"
    assert all(shape.contains(tuple(c)) for c in mesh.points[mesh.cells[:: len(mesh.cells) // 300 + 1]].mean(axis=1))
    if isinstance(shape, Swept):
        check_swept(shape)
    if isinstance(shape, Prism):
        root, axis = np.array(shape.root), np.array(shape.axis)
        end, reach = root + shape.length * axis, np.array(shape.section.reach(shape.axis))
        ends = np.minimum(root, end) - reach, np.maximum(root, end) + reach
        np.testing.assert_allclose(shape.bounds, ends, atol=1e-12)
        np.testing.assert_array_equal(shape.frame(0.0)[1:], transverse(shape.axis))


# ------------------------------------------------------------------ loads


def check_load(cls: type[Any], words: str) -> None:
    """It derives from Load, and acts in a way that somebody knows; at half its size half as much."""
    assert issubclass(cls, Load)
    name = next(n for n, c in LOADS.items() if c is cls)
    taker = "beam6dof(segments = 4)" if name == "tendon" else "fem(hex8, strain = small, size = 10 mm)"
    scene, found = scene_of(f"{BODY}{CLAMP}{LOOK}load push = {words}\nmodel m = {taker}\n")
    assert errors(found) == [], name
    push = scene.declared["push"].thing
    assert push.strength in {f.name for f in dataclasses.fields(cls)}, "which field says how much?"
    assert isinstance(push.action, Action)
    kept(load_breaches(push))
    case = case_for(scene, scene.declared["m"])
    prepared = build(scene.declared["m"], case, BuildContext(scene=scene))
    ((who, forces),) = prepared.forces()
    assert who.name == "push"
    assert _of_nodes(forces, prepared.points)
    assert np.linalg.norm(forces) > 0.0
    assert np.all(np.isfinite(forces))


def _of_nodes(forces: Any, points: Any) -> bool:
    """Forces at points, or with moments, as sections of beams take them."""
    return len(forces) == len(points) and forces.shape[1] in (3, 6)


# ------------------------------------------------------------------ supports


def check_support(cls: type[Any], words: str) -> None:
    """It derives from Support, selects components of a body, and imposes half as much at half its size."""
    assert issubclass(cls, Support)
    assert {"body", "where"} <= {f.name for f in dataclasses.fields(cls)}
    scene, found = scene_of(f"{BODY}{CLAMP}{LOOK}{BEADS}support s = {words}\n")
    assert errors(found) == []
    thing = scene.declared["s"].thing
    assert set(thing.components) <= {0, 1, 2}
    np.testing.assert_array_equal(thing.part(0.5).displacement, 0.5 * np.array(thing.displacement))
    assert thing.moves or not any(thing.displacement)
    assert thing.tracked is None or scene.declared[thing.tracked].kind == "reference"


# ------------------------------------------------------------------ probes


def check_probe(cls: type[Any], words: str) -> None:
    """It finds points of the body, over which there are triangles or volumes, if any, and says how many in the plan."""
    scene, found = scene_of(f"{BODY}{CLAMP}{BEADS}probe p = {words}\nmodel m = beam6dof(segments = 2)\n")
    assert errors(found) == []
    probe = scene.declared["p"]
    assert isinstance(probe.thing, cls)
    data = scene.declared["beads"].thing.load()
    place = find_probe_points(probe, case_of(scene, "bar"), lambda name: data.X)
    low, high = (np.array(b) for b in scene.declared["bar"].thing.shape.bounds)
    assert place.X.ndim == 2
    assert place.X.shape[1] == 3
    assert len(place.X) > 0
    assert np.all(low - 1e-3 <= place.X)
    assert np.all(high + 1e-3 >= place.X)
    assert place.triangles is None or place.triangles.max() < len(place.X)
    if place.weights is not None:
        assert np.isclose(place.weights.sum(), np.prod(SIZE), rtol=1e-9)


# ------------------------------------------------------------------ metrics


def check_metric(cls: type[Any], metric: Any, case: Case) -> None:
    """A finite number with a unit or a reason; an error is zero of what agrees, and more of what does not."""
    kept(metric_breaches(cls, metric, case))


# ------------------------------------------------------------------ models


def check_model(cls: type[Any], words: str, before: str = "") -> set[str]:
    """Everything that is asked of a model; `before` are declarations that its words name. What it took, in words."""
    assert issubclass(cls, Model)
    own = {n for n in vars(Model) if not n.startswith("_")}
    hidden = own & {f.name for f in dataclasses.fields(cls)}
    assert not hidden, f"these say what a model is, and are no fields: {hidden}"
    assert isinstance(verifier_of(_made(before, words)[0].thing), Verifier)
    _says(*_made(before, words))
    refuses_foreign(words, before)
    taken = set()
    for (load_word, push), (held, grip), (how, analysis) in product(LOADED.items(), [("", ""), *SUPPORTED.items()],
                                                                    ANALYSED.items()):  # fmt: skip
        if grip and load_word != "gravity":
            continue  # each load, and each support: not each pair
        text = f"{_body(words)}{CLAMP}{LOOK}{BEADS}{analysis}load push = {push}\n"
        text += f"support grip = {grip}\n" if grip else ""
        what = f"{load_word}, {held or 'a clamp'}, {how}"
        if _takes(f"{text}{before}model m = {words}\n", what):
            taken.add(what)
    assert taken, "it takes nothing"
    return taken


def _body(words: str) -> str:
    """The body that a model is tried on."""
    return NETWORK if NETWORKS in MODELS[words.partition("(")[0]].capabilities else BODY


def _made(before: str, words: str) -> tuple[Declared, Case]:
    scene, found = scene_of(f"{_body(words)}{CLAMP}{LOOK}load push = gravity(1 m/s^2)\n{before}model m = {words}\n")
    assert errors(found) == []
    return scene.declared["m"], case_for(scene, scene.declared["m"])


def _says(declared: Declared, case: Case) -> None:
    """What it says of itself hangs together."""
    thing: Model = declared.thing
    outline, kind = thing.outline(case), thing.kind(case)
    assert len(outline) > 5
    assert "\n" not in outline
    if kind is not None:
        assert isinstance(kind, ModelKind)
        assert kind.size.split(" ")[0] in outline
        assert all(part.strip() in outline for part in kind.words.split(", "))
    fields = {f.name for f in dataclasses.fields(declared.constructor.cls)}
    assert set(thing.resolution_fields) <= fields
    assert set(thing.orders()) <= set(thing.resolution_fields)
    assert all(order >= 1 for order in thing.orders().values())
    assert set(thing.shortcuts) <= fields
    assert thing.plain().shortcuts == ()
    assert thing.iteration_cap is None or (thing.may_be_unconverged and thing.shortcuts)
    assert thing.own_mesh is None or isinstance(thing.own_mesh, Shape)
    assert thing.plain() == thing.plain().plain()
    assert type(thing.plain()) is type(thing)
    key = thing.mesh_key()
    assert (key is None) == (thing.mesh_words(case) == "")
    hash(key)
    check_text(thing)


def refuses_foreign(words: str, before: str = "") -> None:
    """A load that acts as nothing known, and a support that is none of the known: an error each, no exception."""
    with added(LOADS, "magnet", Magnet) as magnet, added(SUPPORTS, "cushion", Cushion) as cushion:
        for line, who in ((f"load push = {magnet}(bar, 1 N)", "push"),
                          (f"support pad = {cushion}(bar, where = x >= 40 mm)", "pad")):  # fmt: skip
            body = _body(words)
            _, found = scene_of(f"{body}{CLAMP}{LOOK}load w = gravity(1 m/s^2)\n{line}\n{before}model m = {words}\n")
            said = [d for d in found if d.code == "E501" and f"`{who}`" in d.message]
            assert len(said) >= 1, (who, [d.message for d in found])
            assert all(d.label and d.help and d.span for d in said)


def _takes(text: str, what: str) -> bool:
    """Whether it is built: it is refused when it is checked, or says all that a prepared model says."""
    scene, found = scene_of(text)
    if errors(found):
        assert all(d.message and d.span is not None for d in found if d.severity == "error"), what
        return False
    declared = scene.declared["m"]
    measured: Mapping[str, Any] = {"beads": scene.declared["beads"].thing.load()}
    case = case_for(scene, declared)
    load(declared.thing)
    prepared = build(declared, case, BuildContext(scene=scene, measured=measured))
    assert {"nodes", "elements", "dofs"} <= set(prepared.size), what
    assert all(isinstance(n, int) and n >= 0 for n in prepared.size.values()), what
    assert all(isinstance(note, Diagnostic) for note in prepared.notes), what
    assert prepared.points.shape[1] == 3, what
    applied = prepared.forces()
    assert [d.name for d, _ in applied] == [d.name for d in case.loads], what
    assert all(_of_nodes(f, prepared.points) for _, f in applied), what
    assert prepared.outside(np.array([[0.02, 0.0, 0.0]])) == 0.0, what
    if prepared.assembly is not None:
        assert prepared.assembly.dofs >= prepared.points.size, what
    if "gravity" in what:  # all of it, on solids of straight edges
        weight = 1000.0 * np.prod(SIZE)
        np.testing.assert_allclose(applied[0][1][:, :3].sum(axis=0), [0.0, 0.0, -weight], rtol=1e-9, atol=1e-15)
    return True


def check_result(words: str, before: str = "", analysis: str = "") -> ModelResult:
    """A run of a model: its entry of the report has its keys, and nothing but JSON's own types."""
    body = _body(words)
    scene, found = scene_of(f"{body}{CLAMP}{LOOK}{analysis}load push = gravity(1 m/s^2)\n"
                            f"metric sag = displacement(tip, along = -z)\n{before}model m = {words}\n")  # fmt: skip
    assert errors(found) == []
    report = run_scene(scene, found, RunOptions(draw=False, stated=()))
    own = report.to_json()["models"]["m"]
    json.dumps(own, allow_nan=False)
    assert {"status", "message", "outline", "size", "solve", "time", "probes", "metrics", "loads"} <= set(own)
    assert own["status"] == "converged", own["message"]
    assert own["metrics"]["sag"]["value"] > 0.0
    assert set(own["loads"]) == {"push"}
    assert "checks" in own["solve"]
    assert {"value", "unit", "parts", "reason", "doubts"} <= set(own["stated"]["sag"])
    result: ModelResult = report.models["m"]
    return result


@dataclass(frozen=True)
class Torque(Action):
    """A way to act that no model knows."""

    moment: float


@dataclass(frozen=True)
class Magnet(Load):
    """Acts in a way that no model knows."""

    strength = "pull"

    body: Annotated[str, "body", "the body that is loaded"]
    pull: Annotated[float, "N", "how strong it is"]

    @property
    def action(self) -> Torque:
        """How it acts."""
        return Torque(self.pull)


@dataclass(frozen=True)
class Cushion(Support):
    """Gives way under what rests on it, as no model knows how to."""

    body: Annotated[str, "body", "the body that is held"]
    where: Annotated[Any, "condition", "which of its points"]
    components: Annotated[tuple[int, ...], "components", "directions in which it is"] = (0, 1, 2)
