"""What `dsl explain` proposes for a word that it does not know: a slip of the finger, and no other word."""

from __future__ import annotations

import re

import pytest

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.help.constructor_examples import sample
from softmark.interpreter.help.word_pages import constructors
from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Constructor
from softmark.solvers.materials import WORDS
from softmark.solvers.mesh.shapes import SHAPES


@pytest.mark.parametrize(("slip", "meant"), [
    ("gravty", "gravity"), ("cylnder", "cylinder"), ("simo_reisner", "simo_reissner"), ("neo_hokean", "neo_hookean"),
    ("energy_nrom_error", "energy_norm_error"),
    ("surface_distnce", "surface_distance"), ("Mpa", "MPa"), ("Cylinder", "cylinder"),
    ("eenrgy_norm_error", "energy_norm_error"), ("beam6dofs", "beam6dof"),
])  # fmt: skip
def test_a_slip_of_the_finger_is_mended(slip: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["explain", slip])
    said = capsys.readouterr()
    assert meant in said.err + said.out


@pytest.mark.parametrize(("field", "said"), [
    ("cylinder(length = 200 mm, diameter = 40 mm)", "use `radius`, which is half the diameter"),
    ("box(size = (1, 1, 1) m, center = (0, 0, 0) m)", "use `origin`, which is not the middle of the shape"),
])  # fmt: skip
def test_a_field_that_is_another_quantity_is_not_called_the_same(field: str, said: str) -> None:
    """`diameter = 40 mm` renamed to `radius = 40 mm` is a beam that is sixteen times as stiff."""
    text = f"material m = neo_hookean(young = 1 kPa, poisson = 0.3, density = 1 kg/m^3)\nbody b = solid({field}, m)\n"
    with pytest.raises(softmark.SceneError) as refused:
        softmark.loads(text)
    assert said in refused.value.diagnostics[0].help


@pytest.mark.parametrize("shape", sorted(set(SHAPES) - {"mesh", "tetrahedralized"}))  # of which there is no file
def test_the_example_of_a_shape_is_one_that_a_body_has(shape: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", shape]) == 0
    example = capsys.readouterr().out.partition(f"Example: shape NAME = {shape}")[2].splitlines()[0]
    gel = "material gel = neo_hookean(young = 1 kPa, poisson = 0.3, density = 1 kg/m^3)\n"
    if not SHAPES[shape].meshed:  # which is a rigid body's
        assert softmark.loads(f"shape s = {shape}{example}\n").scene.declared["s"].thing.fault == ""
        return
    body, thick = ("plane_strain", ", thickness = 1 mm") if SHAPES[shape].flat is True else ("solid", "")
    made = softmark.loads(f"{gel}body b = {body}({shape}{example}, gel{thick})\n")
    assert made.scene.of_kind("body").keys() == {"b"}


@pytest.mark.parametrize("word", ["plane_strain", "plane_stress", "axisymmetric"])
def test_the_example_of_a_plane_body_is_one(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", word]) == 0
    example = capsys.readouterr().out.partition(f"Example: body NAME = {word}")[2].splitlines()[0]
    gel = "material NAME_OF_MATERIAL = neo_hookean(young = 1 kPa, poisson = 0.3, density = 1 kg/m^3)\n"
    assert softmark.loads(f"{gel}body b = {word}{example}\n").scene.of_kind("body").keys() == {"b"}


@pytest.mark.parametrize(
    ("word", "given"),
    [
        ("markers", 'path = "file.csv"'),
        ("table", 'path = "file.csv"'),
        ("tetrahedralized", 'path = "file.stl"'),
        ("torque", "moment = (1, 1, 1) N*m"),
        ("line_load", "vector = (1, 1, 1) N/m"),
    ],
)
def test_an_example_has_files_and_units_as_they_are(word: str, given: str, capsys: pytest.CaptureFixture[str]) -> None:
    main(["explain", word])
    assert given in capsys.readouterr().out


def test_the_example_of_a_curve_says_along_what_it_goes(capsys: pytest.CaptureFixture[str]) -> None:
    """At rest `over` is needed, and the example left it out."""
    assert main(["explain", "curve_error"]) == 0
    example = capsys.readouterr().out.partition("Example: ")[2].splitlines()[0]
    assert example.endswith(
        "curve_error(of = NAME_OF_METRIC, against = NAME_OF_REFERENCE, over = NAME_OF_ANOTHER_METRIC)"
    )


def _measured(text: str) -> tuple[list[float], tuple[int, ...]]:
    """The numbers of an example's value in SI, and their dimension."""
    found = re.fullmatch(r"([\[(].*[\])]|[-\d.e+]+)\s*(\S*)", text)
    assert found is not None, text
    unit = units.parse_unit(found[2]) if found[2] else None
    factor = 1.0 if unit is None else unit.factor
    return [factor * float(x) for x in re.findall(r"[-\d.]+", found[1])], units.NONE if unit is None else unit.dimension


@pytest.mark.parametrize("one", constructors(), ids=lambda one: f"{one.kind}-{one.name}")
def test_what_an_example_gives_is_of_its_dimension_and_in_its_range(one: Constructor) -> None:
    """The times of `viscoelastic` were in mm."""
    for field in one.fields:
        if field.form in ("quantity", "each", "list", "vector", "vectors", "points") and field.dimension is not None:
            values, dimension = _measured(sample(field))
            assert dimension == field.dimension, field.name
            wanted = field.required and field.interval is not None and field.form in ("quantity", "each", "list")
            assert not wanted or all(v in field.interval for v in values), field.name  # type: ignore[operator]


@pytest.mark.parametrize("word", sorted(set(WORDS) - {"active", "active_strain"}))  # around solids with fibres
def test_the_example_of_a_material_is_one(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", word]) == 0
    example = capsys.readouterr().out.partition("Example: ")[2].splitlines()[0]
    gel = "material NAME_OF_MATERIAL = neo_hookean(young = 1 kPa, poisson = 0.3, density = 1 kg/m^3)\n"
    assert "NAME" in softmark.loads(gel + example + "\n").scene.of_kind("material")
