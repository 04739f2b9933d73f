"""What a stability study can walk, of a scene: kinds, limits, overrides that read back, and what is refused."""

from __future__ import annotations

import pytest

import softmark
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.parameter_overrides import read_override
from softmark.interpreter.planning.robustness_plan import resolve_study
from softmark.interpreter.planning.sweep_expansion import value_in
from softmark.interpreter.planning.varied_quantities import Unwalkable, WalkedQuantity, default_quantities, quantity_of
from softmark.interpreter.study.configurations.configuration_expansion import subject_of
from softmark.interpreter.study.configurations.configuration_task import perform
from softmark.interpreter.study.robustness.robustness_points import VariedScene
from softmark.interpreter.validation.scene_checks import apply_overrides

BEAM = """
param    L      = 178 mm in 100 mm .. 400 mm
param    n      = 8
param    nu     = 0.3 in 0 .. 0.4999
param    shift  = 0 mm in -1 mm .. 1 m
param    loose  = 3 mm
param    none   = 0 mm
material gel    = neo_hookean(young = 60 kPa, poisson = nu, density = 1000 kg/m^3)
body     beam   = solid(cylinder(length = L, radius = 19 mm), gel)
support  wall   = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
load     push   = traction(beam, where = x >= L, vector = (0, 2, -4) Pa)
analysis sag    = static()
model    rod    = beam6dof(segments = n)
model    tet    = fem(tet10, strain = finite, size = 20 mm)
reference theory = small_deflection(beam)
probe    axis   = line(beam, from = (0, 0, 0) mm, to = (100, 0, 0) mm, points = 5)
metric   eta    = relative_l2_error(axis, against = rod)
"""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return softmark.loads(BEAM.replace("reference theory = small_deflection(beam)\n", "")).scene


def ends(quantity: WalkedQuantity) -> list[float]:
    return [way.at(way.rungs[-1]) for way in quantity.ladders]


@pytest.mark.parametrize(
    ("name", "kind", "limits", "unit"),
    [
        ("gel.young", "factor", (0.06, 6e10), "Pa"),  # 12 decades
        ("gel.density", "factor", (1.0, 1e6), "kg/m^3"),  # a ratio of 1e6
        ("gel.poisson", "gap", (-0.99, 0.5), "1"),
        ("weight.magnitude", "factor", (9.81e-3, 9810.0), "m/s^2"),  # up to 1000 times
        ("push.vector", "factor", (1e-3, 1e3), "1"),
        ("sag.tolerance", "factor", (1e-12, 1e-2), "1"),  # the range of the field
        ("tet.size", "factor", (0.00125, 0.64), "m"),
        ("rod.segments", "integer", (1.0, 512.0), "1"),
        ("sag.max_iterations", "integer", (1.0, 1000.0), "1"),
        ("L", "factor", (0.1, 0.4), "m"),
        ("loose", "factor", (3e-6, 3.0), "m"),
        ("n", "integer", (1.0, 512.0), "1"),  # segments take whole numbers only
        ("nu", "gap", (0.0, 0.4999), "1"),  # a material's
        ("shift", "reach", (-1e-3, 1.0), "m"),
    ],
)
def test_kinds_and_limits(scene: Scene, name: str, kind: str, limits: tuple[float, float], unit: str) -> None:
    quantity = quantity_of(scene, name)
    assert (quantity.kind, quantity.unit) == (kind, unit)
    assert quantity.limits == pytest.approx(limits, rel=1e-12)
    assert sorted(ends(quantity)) == pytest.approx(sorted(limits), rel=1e-12)


def test_choices_are_all_there(scene: Scene) -> None:
    assert quantity_of(scene, "tet.precision").options == ("double", "single")
    assert set(quantity_of(scene, "tet.element").options) == {"tet4", "tet10", "hex8", "hex20", "hex27"}
    assert quantity_of(scene, "rod.shear").options == ("yes", "no")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("tet.max_iterations", "has no value"),
        ("none", "is zero"),
        ("wall.where", "not a quantity"),
        ("weight.direction", "not a quantity"),
    ],
)
def test_what_cannot_be_walked(scene: Scene, name: str, reason: str) -> None:
    with pytest.raises(Unwalkable, match=reason):
        quantity_of(scene, name)


@pytest.mark.parametrize("name", ["gel.young", "gel.poisson", "L", "shift", "n", "tet.size", "nu"])
def test_every_rung_reads_back_as_the_number_that_it_is(scene: Scene, name: str) -> None:
    """An override is text: the value in the scene is the one that was meant, to the last bit."""
    quantity = quantity_of(scene, name)
    for way in quantity.ladders:
        for t in way.rungs:
            override = read_override(quantity.override(way.at(t)), [])
            assert override is not None
            other, found = apply_overrides(scene, [override])
            if not any(d.severity == "error" for d in found):
                assert value_in(other, name) == way.at(t)


def test_a_vector_is_multiplied(scene: Scene) -> None:
    quantity = quantity_of(scene, "push.vector")
    assert quantity.written(10.0) == "(0, 20, -40) Pa"
    assert (quantity.nominal, quantity.text) == (1.0, "(0, 2, -4) Pa")


def test_the_usual_numbers(scene: Scene) -> None:
    assert [q.name for q in default_quantities(scene)] == [
        "L", "nu", "shift", "gel.young", "gel.poisson", "gel.density", "weight.magnitude", "push.vector", "tet.size",
        "rod.segments", "tet.precision", "sag.tolerance",
    ]  # fmt: skip


def test_a_model_is_refused_for_its_own_errors_alone() -> None:
    """A mesh that is too fine for memory is no affair of the rod, which is computed all the same."""
    text = "\n".join(line for line in BEAM.splitlines() if "push" not in line)
    text = text.replace("against = rod", "against = theory")
    study = softmark.loads(text + "\nstudy s = robustness(over = [gel.density, tet.size, loose])").scene
    ground = VariedScene(subject_of(study), resolve_study(study, study.declared["s"]))
    fine = ground.values({"tet.size": 1e-5})
    refused = ground.refusal(fine, "tet")
    assert refused is not None
    assert (refused.word, refused.code) == ("refused", "E304")
    assert ground.refusal(fine, "rod") is None
    assert perform(ground.task(fine, "rod")).point["status"] == "converged"
    assert ground.refusal((), "tet") is None
    assert ground.task((), "tet").key == ground.task(ground.values({"loose": 1.0}), "tet").key
    assert ground.task((), "tet").stated is True
