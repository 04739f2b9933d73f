"""The contracts of the vocabulary, over every table; and that they find what breaks them."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from typing import Annotated, Any, ClassVar, get_args

import pytest
from contracts import (
    BODY,
    CLAMP,
    HERE,
    LOADED,
    LOOK,
    SUPPORTED,
    Cushion,
    Magnet,
    added,
    check_load,
    check_metric,
    check_model,
    check_probe,
    check_result,
    check_shape,
    check_support,
    check_text,
    check_word,
    errors,
    scene_of,
)

from softmark.interpreter.help.word_pages import constructor_page
from softmark.interpreter.language.field_schema import Constructor, _fields_of_class
from softmark.interpreter.metrics import METRICS
from softmark.interpreter.models import MODELS
from softmark.interpreter.models.model_builders import BUILDERS
from softmark.interpreter.models.shared.capabilities import DYNAMICS, Table
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import case_of
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.verification.by_model.verifier import Verifier
from softmark.interpreter.vocabulary import LOADS, PROBES, SUPPORTS
from softmark.interpreter.vocabulary.analysis_words import EXPLICIT
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.load import Load
from softmark.records import dataclass
from softmark.references import REFERENCES
from softmark.references.reference_base import How, Reference
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.mesh.boolean_shapes import BooleanShape
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import SHAPES, Box, Sphere

WORDS = [(kind, name, cls) for kind in CATALOGUE for name, cls in CATALOGUE[kind].items()]
FULL = "model full = fem(hex8, strain = corotational, size = 10 mm, mass = lumped)\n"
MODELLED = {
    "fem": [("fem(hex8, strain = corotational, size = 10 mm)", ""),
            ("fem(tet4, strain = finite, size = 10 mm, mass = lumped, max_iterations = 3)", ""),
            ("fem(tet10, strain = finite, size = 20 mm, formulation = mixed)", "")],
    "beam6dof": [("beam6dof(segments = 4)", "")],
    "frame6dof": [("frame6dof(segments = 4)", "")],
    "mass_spring": [("mass_spring(stiffness = from_material(), size = 10 mm)", "")],
    "modal": [("modal(of = full, modes = 2)", FULL)],
    "pod": [("pod(of = full, training = [1])", FULL)],
}  # fmt: skip
STRICT = {
    "homogeneous",  # whole faces and normal tractions alone: tests/interpreter/test_homogeneous.py
    "external_solver",  # what a program takes: tests/interpreter/test_external_programs.py
    "external_rod",  # the same of rods: tests/interpreter/test_external_rods.py
    "results",  # whatever loads there are: tests/interpreter/test_judge_command.py
}
TAKES = {  # of 75: each load, and each support under gravity, in each of five analyses; lines for all but springs
    "fem(hex8": 56,  # its consistent mass is no explicit one
    "fem(tet4": 40,  # a cap has no part in a path or a disturbed start, nor in a turn at rest
    "fem(tet10": 29,  # pressures have no mass, and no way downhill
    "beam6dof(segments = 4)": 43,  # no pressure, no tracked points; tendons
    "frame6dof(segments = 4)": 18,  # forces, lines, clamps and hinges; torques at rest alone
    "mass_spring(stiffness = from_material()": 56,  # no turns along a path or from a disturbed start
    "modal(of = full": 32,  # turns at rest alone
    "pod(of = full": 32,
}
CASES = [pytest.param(MODELS[name], *words, id=words[0]) for name, all_ in MODELLED.items() for words in all_]
PROBED = {
    "point": "point(bar, at = (40, 0, 0) mm)",
    "line": "line(bar, from = (0, 0, 0) mm, to = (40, 0, 0) mm, points = 5)",
    "surface": "surface(bar, size = 10 mm)",
    "volume": "volume(bar, size = 10 mm)",
    "mesh_nodes": 'mesh_nodes(bar, mesh = mesh("../errors/parts/sound.mesh", unit = 1 mm))',
    "markers": "markers(bar, of = beads)",
}
SHAPED: dict[str, dict[str, Any]] = {
    "disjoint": {
        "one": SHAPES["box"](size=(0.02, 0.04, 0.015)),
        "other": SHAPES["sphere"](radius=0.01, origin=(0.05, 0.0, 0.0)),
    },
    "cylinder": {"length": 0.04, "radius": 0.01},
    "box": {"size": (0.02, 0.04, 0.015)},
    "arc": {"radius": 0.03, "angle": 1.2, "side": 0.015, "height": 0.02},
    "tube": {"length": 0.04, "radius": 0.01, "inner": 0.006},
    "cone": {"length": 0.04, "radius": 0.015},
    "extruded": {"corners": ((0.0, 0.0), (0.04, 0.0), (0.04, 0.01), (0.01, 0.01), (0.01, 0.03)), "height": 0.01},
    "revolved": {
        "corners": ((0.0, 0.0), (0.01, 0.0), (0.01, 0.005), (0.006, 0.005), (0.006, 0.012), (0.0, 0.012)),
    },
    "sphere": {"radius": 0.01},
    "ellipsoid": {"semiaxes": (0.02, 0.01, 0.015)},
    "spherical_shell": {"radius": 0.01, "inner": 0.005},
    "truncated_ellipsoid_shell": {
        "inner": 0.007,
        "inner_along": 0.017,
        "outer": 0.01,
        "outer_along": 0.02,
        "rim": 0.005,
    },
    "truncated_ellipsoid_section": {
        "inner": 0.007,
        "inner_along": 0.017,
        "outer": 0.01,
        "outer_along": 0.02,
        "rim": 0.005,
    },
    "quadrilateral": {
        "first": (0.0, 0.0, 0.0),
        "second": (0.02, 0.01, 0.0),
        "third": (0.02, 0.03, 0.0),
        "fourth": (0.0, 0.02, 0.0),
    },
    "quarter_ring": {"inner": 0.01, "inner_y": 0.005, "outer": 0.02},
    "union": {"one": Box((0.02, 0.02, 0.01)), "other": Sphere(0.006, (0.01, 0.01, 0.01))},
    "difference": {"one": Box((0.02, 0.02, 0.01)), "other": Sphere(0.006, (0.01, 0.01, 0.01))},
    "intersection": {"one": Box((0.02, 0.02, 0.01)), "other": Sphere(0.008, (0.01, 0.01, 0.01))},
    "mesh": {"path": str(HERE.parent / "errors" / "parts" / "sound.mesh"), "unit": 1e-3},
    "tetrahedralized": {"path": str(HERE.parent / "errors" / "parts" / "cube.stl"), "unit": 1e-3},
}
MEASURED: dict[str, dict[str, Any]] = {
    "contact_area": {"of": "touch"},
    "contact_pressure": {"of": "touch"},
    "pressure_along": {"of": "touch"},
    "gap": {"of": "touch"},
    "slip": {"of": "touch"},
    "stick_area": {"of": "touch"},
    "displacement": {"along": (0.0, 0.0, -1.0)},
    "period": {"along": (0.0, 0.0, -1.0)},
    "realtime_factor": {"rate": 25.0},
    "force": {"of": "hold", "along": (0.0, 0.0, 1.0)},
    "moment": {"of": "hold", "along": (0.0, 1.0, 0.0), "about": (0.0, 0.0, 0.1)},
    "work": {"of": "push"},
    "pore_pressure": {"at": (0.0, 0.0, 0.0)},
    "outflow": {"of": "hold"},
    "curve_error": {"of": "sag"},
    "hysteresis": {"of": "sag", "over": "travel"},
    "value_error": {"of": "sag"},
}


@pytest.mark.parametrize(("kind", "name", "cls"), WORDS, ids=[f"{k}-{n}" for k, n, _ in WORDS])
def test_every_word_is_documented_and_annotated(kind: str, name: str, cls: type[Any]) -> None:
    check_word(cls, kind, name)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("shaped", [{}, {"axis": (0.0, 0.6, -0.8)}, {"origin": (1.0, -2.0, 3.0)},
                                    {"part": "half"}, {"part": "octant"},
                                    {"angle": 4.0, "side": None, "height": None, "section_radius": 0.01}],
                         ids=str)  # fmt: skip
def test_shapes(name: str, shaped: dict[str, Any]) -> None:
    cls = SHAPES[name]
    if not cls.meshed:
        pytest.skip("of rigid bodies alone: tests/solvers/test_signed_distance.py")
    if SHAPES[name].enclosed and find_spec("pytetwild") is None:
        pytest.skip("needs the extra `meshing`")
    if issubclass(cls, BooleanShape) and find_spec("manifold3d") is None:
        pytest.skip("needs the extra `solids`")
    if shaped.keys() <= cls.__dataclass_fields__.keys():
        check_shape(cls(**(SHAPED[name] | shaped)), 0.003)


@pytest.mark.parametrize("name", LOADS)
def test_loads(name: str) -> None:
    assert name in LOADED, "add an example of the load to interpreter/cli/conformance/trial_scenes.py:LOADED"
    check_load(LOADS[name], LOADED[name])


@pytest.mark.parametrize("name", SUPPORTS)
def test_supports(name: str) -> None:
    check_support(SUPPORTS[name], SUPPORTED[name])


@pytest.mark.parametrize("name", PROBES)
def test_probes(name: str) -> None:
    check_probe(PROBES[name], PROBED[name])


@pytest.mark.parametrize("name", METRICS)
def test_metrics(name: str) -> None:
    cls = METRICS[name]
    scene, _ = scene_of(BODY + CLAMP)
    own = {n: v for n, v in (("probe", "tip"), ("against", "truth"), ("body", "bar")) if n in cls.__dataclass_fields__}
    metric = cls(**own, **MEASURED.get(name, {}))
    check_text(metric)
    check_metric(cls, metric, case_of(scene, "bar"))


@pytest.mark.parametrize("name", REFERENCES)
def test_references(name: str) -> None:
    """Each says how it is known, by whom, and what its error bounds, before there is one of it."""
    cls = REFERENCES[name]
    assert issubclass(cls, Reference)
    assert cls.how in get_args(How)
    assert all(len(text) > 5 for text in (cls.usually(), cls.source, cls.error_meaning))
    assert f"Source: {cls.source}" in constructor_page(Constructor(name, "reference", cls, _fields_of_class(cls)))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("cls", "words", "before"), CASES)
def test_models(cls: type[Any], words: str, before: str) -> None:
    taken = check_model(cls, words, before)
    assert {f"gravity, {held}, rest" for held in ("a clamp", "displaced")} <= taken
    if cls not in (MODELS["beam6dof"], MODELS["frame6dof"]):
        assert {"pressure, a clamp, rest", "gravity, measured_motion, rest"} <= taken
    assert len(taken) == TAKES[words.partition(",")[0]], sorted(taken)


@pytest.mark.parametrize(("cls", "words", "before"), CASES)
def test_results_of_models(cls: type[Any], words: str, before: str) -> None:
    check_result(words, before)


def test_every_model_has_words_here_and_a_builder() -> None:
    assert set(MODELLED) | STRICT == set(MODELS)
    assert set(BUILDERS) == set(MODELS.values())


def test_which_integrators_are_explicit_is_said_the_same_twice() -> None:
    """A check knows it without the integrators, which need arrays."""
    assert set(EXPLICIT) == {name for name, cls in INTEGRATORS.items() if cls.explicit}


# ------------------------------------------------------------------ somebody else's


@dataclass(frozen=True)
class Wind(Load):
    """Pulls on all of a body along x, as somebody else would have it."""

    strength = "speed"

    speed: Annotated[float, "m/s^2 in [0, inf)", "how strongly"]

    @property
    def action(self) -> BodyForce:
        """How it acts."""
        return BodyForce((self.speed, 0.0, 0.0))


@pytest.fixture
def wind() -> Iterator[str]:
    with added(LOADS, "wind", Wind) as name:
        yield name


def test_a_load_that_acts_in_a_known_way_is_one_class_and_one_line(wind: str) -> None:
    """Every model takes it, its forces are found again by other formulas, and the report says what it comes to."""
    check_word(Wind, "load", wind)
    check_load(Wind, f"{wind}(2 m/s^2)")
    for words in ("fem(hex8, strain = finite, size = 10 mm)", "beam6dof(segments = 2)",
                  "mass_spring(stiffness = from_material(), size = 10 mm)"):  # fmt: skip
        scene, found = scene_of(f"{BODY}{CLAMP}{LOOK}load w = {wind}(2 m/s^2)\nmodel m = {words}\n")
        assert errors(found) == []
        from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

        model = run_scene(scene, found, RunOptions(draw=False)).models["m"]
        assert model.status == "converged"
        assert model.solve["checks"]["residual"] < 1e-8
        assert model.loads["w"].to_json()["force"][0] == pytest.approx(1000 * 0.04 * 0.02 * 0.02 * 2)


@dataclass(frozen=True)
class Brick(Shape):
    """A shape that says nothing of itself but how it is meshed."""

    long: Annotated[float, "m in (0, inf)", "its longest side"]

    @property
    def _box(self) -> Box:
        return Box((self.long, self.long / 2, self.long / 2))

    def mesh(self, kind: str, size: float, cuts: tuple[Any, ...] = ()) -> Mesh:
        """Its cells."""
        return self._box.mesh(kind, size)

    def surface(self, size: float) -> Any:
        """Its surface."""
        return self._box.surface(size)


def test_a_shape_that_says_next_to_nothing_is_meshed_solved_and_drawn() -> None:
    """What it inherits stands for what it does not say; a beam is refused for it."""
    with added(SHAPES, "brick", Brick) as name:
        check_word(Brick, "shape", name)
        body = BODY.replace("box(size = (40, 20, 20) mm, origin = (0, -10, -10) mm)", f"{name}(40 mm)")
        text = f"{body}{CLAMP}{LOOK}load w = gravity(2 m/s^2)\nmetric sag = displacement(tip, along = -z)\n"
        scene, found = scene_of(f"{text}model m = fem(hex8, strain = corotational, size = 10 mm)\n")
        assert errors(found) == []
        from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

        report = run_scene(scene, found, RunOptions())
        model = report.models["m"]
        assert model.status == "converged", model.message
        assert model.shape is not None
        assert model.metrics["sag"].value is not None
        assert model.loads["w"].to_json()["force"][2] == pytest.approx(-1000 * 0.04 * 0.02 * 0.02 * 2)
        _, found = scene_of(f"{text}model m = beam6dof(segments = 4)\n")
        assert errors(found) == ["E501"]


@dataclass(frozen=True)
class Bulky(Brick):
    """A shape that says another volume than it is meshed with."""

    @property
    def volume(self) -> float:
        """Of a cube."""
        return self.long**3


def test_what_breaks_the_contract_of_a_shape_is_found() -> None:
    @dataclass(frozen=True)
    class Filed(Brick):
        """A shape one of whose fields hides what it says."""

        volume: Annotated[float, "m^3", "how much it holds"] = 1.0  # type: ignore[assignment]

    with pytest.raises(AssertionError, match="no fields"):
        check_shape(Filed(0.04), 0.01)

    with pytest.raises(AssertionError, match="this fine"):
        check_shape(Bulky(0.04), 0.01)


@dataclass(frozen=True)
class Guess(Model):
    """A model that has words and nothing else."""

    capabilities: ClassVar[Table] = {DYNAMICS: False}
    loads = (BodyForce,)

    share: Annotated[float, "1 in (0, 1]", "how much of it is believed"] = 0.5
    body: Annotated[str | None, "body", "the body, where a scene has several"] = None

    def outline(self, case: Any) -> str:
        """One line for the plan."""
        return f"a guess of {self.share:g}"


def test_a_model_that_says_next_to_nothing_refuses_what_it_does_not_take() -> None:
    with added(MODELS, "guess", Guess) as name:
        check_word(Guess, "model", name)
        for line, refused in (
            ("load p = pressure(bar, where = z >= 10 mm, magnitude = 1 Pa)", ["E501"]),
            ("load w = gravity(1 m/s^2)", []),
            ("load w = gravity(1 m/s^2)\nanalysis a = dynamic(duration = 1 s, step = 1 ms)", ["E501"]),
        ):
            _, found = scene_of(f"{BODY}{CLAMP}{LOOK}{line}\nmodel m = {name}()\n")
            assert errors(found) == refused, line
    assert isinstance(Verifier(), Verifier)


def test_a_member_by_its_earlier_name_is_refused() -> None:
    """A plugin that says `moves = False` would otherwise be taken to support dynamic analyses."""
    for old in ("moves", "supports_dynamics"):
        with pytest.raises(TypeError, match=rf"`Old` defines `{old}`, which is called `capabilities\[DYNAMICS\]` now"):
            type("Old", (Model,), {old: False})


def test_what_breaks_a_contract_is_found() -> None:
    @dataclass(frozen=True)
    class Mute(Model):
        """A model without an outline, one of whose fields hides what it is."""

        kind: Annotated[str, "what it is"] = "mute"  # type: ignore[assignment]

    with added(MODELS, "mute", Mute) as name, pytest.raises(AssertionError, match="no fields"):
        check_model(Mute, f"{name}()")
    with added(LOADS, "magnet", Magnet) as name, pytest.raises(AssertionError):
        check_load(Magnet, f"{name}(bar, 1 N)")
    with added(SUPPORTS, "cushion", Cushion) as name:
        check_support(Cushion, f"{name}(bar, where = x >= 40 mm)")

    @dataclass(frozen=True)
    class Vague(Load):
        """Pulls"""

        pull: Annotated[float, "N", "how strong."]

    with pytest.raises(AssertionError):
        check_word(Vague, "load", "vague")
