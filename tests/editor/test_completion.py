"""What is offered, said and shown at a place of a text, finished or not."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("lsprotocol")

from editor_texts import SCENE, completed, hovered, marked, signed
from lsprotocol import types

from softmark.interpreter.language import units
from softmark.interpreter.language_server.code_completion import remove_placeholders
from softmark.interpreter.language_server.text_document import Document
from softmark.interpreter.validation.constructor_registry import CATALOGUE

pytestmark = pytest.mark.slow


def labels(text: str, folder: Path = Path()) -> list[str]:
    return [item.label for item in completed(SCENE + text, folder)]


@pytest.mark.parametrize(
    ("text", "some", "none"),
    [
        ("|", ["material", "param", "expect", "use"], ["L", "gel"]),
        ("mat|", ["material"], []),
        ("material a = |", ["neo_hookean", "gel"], ["fem", "L"]),
        ("material a = neo|", ["neo_hookean", "gel"], ["fem"]),
        ("material a = neo_hookean(|", ["young =", "poisson =", "density ="], []),
        ("material a = neo_hookean(young = 3 kPa, |", ["poisson =", "density ="], ["young ="]),
        ("material a = neo_hookean(|, young = 3 kPa)", ["poisson ="], ["young ="]),
        ("model m = fem(|", ["element =", "tet4", "hex8"], ["small"]),
        ("model m = fem(tet4, strain = |", ["small", "corotational", "finite"], ["tet4", "L"]),
        ("model m = fem(tet4, strain = sm|\nmodel n = beam6dof(segments = 8)", ["small"], ["tet4"]),
        ("model m = fem(tet4, size = |", ["L"], ["gel", "rod"]),
        ("model m = beam6dof(shear = |", ["yes", "no"], ["L"]),
        ("support s = fixed(|", ["body =", "beam"], ["gel", "rod", "L"]),
        ("support s = fixed(beam, where = |", ["x", "y", "z", "not"], ["gel"]),
        ("support s = fixed(beam, components = (|", ["x", "y", "z"], ["L", "not"]),
        ("load w = gravity(9.81 m/s^2, direction = |", ["-z", "+x"], ["L"]),
        ("body b = solid(box(size = (1, 1, 1) mm), |", ["gel", "neo_hookean"], ["b", "beam"]),
        ("metric m = displacement(|", ["end"], ["beam", "rod"]),
        ("study s = sweep(|", ["L", "gel.young", "rod.segments"], ["gel", "end"]),
        ("study s = sweep(L, over = [1] mm, models = [|", ["rod"], ["gel"]),
        ("expect |", ["rod.drop", "L"], ["gel"]),
        ("expect rod.|", ["rod.drop"], ["L"]),
        ("param M = |", ["L", "sqrt", "pi"], ["M", "gel"]),
        ("# mat|", [], ["material"]),
        ('use "std/materials/t|" as t', ["std/materials/tissues.scene"], []),
        ("param M = 3 mm |", [], ["L", "mm"]),
        ("body new|", [], ["beam"]),
    ],
)
def test_what_is_offered(text: str, some: list[str], none: list[str]) -> None:
    found = labels(text)
    assert set(some) <= set(found)
    assert not set(none) & set(found)


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("material a = neo_hookean(young = 60 |", units.PRESSURE),
        ("material a = neo_hookean(young = 60 k|", units.PRESSURE),
        ("material a = neo_hookean(young = 60 |, poisson = 0.3)", units.PRESSURE),
        ("material a = neo_hookean(60 |", units.PRESSURE),
        ("material a = neo_hookean(young = min(60 |", units.PRESSURE),
        ("material a = neo_hookean(poisson = 60 |", units.NONE),
        ("material a = neo_hookean(density = 60 |", (-3, 1, 0, 0, 0)),
        ("body b = solid(box(size = (1, 2, 3) |", units.LENGTH),
        ("body b = solid(box(size = (1 |", units.LENGTH),
        ("load w = gravity(9.81 |", (1, 0, -2, 0, 0)),
        ("support s = fixed(beam, where = x <= 0 |", units.LENGTH),
        ("expect rod.drop < 5 |", units.LENGTH),
        ("expect abs(rod.drop - 5 |", units.LENGTH),
        ("param M = 60 kPa in 1 |", units.PRESSURE),
        ("param M = sin(60 |", units.ANGLE),
        ("study s = sweep(L, over = [1, 2] |", units.LENGTH),
        ("study s = sweep(gel.young, over = [1, 2] |", units.PRESSURE),
    ],
)
def test_units_are_those_of_the_dimension_that_is_due(text: str, dimension: units.Dimension) -> None:
    found = labels(text)
    assert found
    assert {units.parse_unit(unit).dimension for unit in found} == {dimension}


@pytest.mark.parametrize("text", ["param M = 60 |", "material a = neo_hookean(young = 2 * 60 |"])
def test_where_any_unit_may_stand_those_of_all_dimensions_are_offered(text: str) -> None:
    assert {"mm", "kPa", "s"} <= set(labels(text))


def test_the_word_that_is_begun_is_written_over() -> None:
    (item,) = [i for i in completed(SCENE + "expect rod.dr|") if i.label == "rod.drop"]
    assert isinstance(item.text_edit, types.TextEdit)
    assert item.text_edit.range.start.character == len("expect ")
    assert item.text_edit.new_text == "rod.drop"


def test_a_call_comes_with_its_fields_and_what_is_declared() -> None:
    (item,) = [i for i in completed(SCENE + "body b = s|") if i.label == "solid"]
    assert isinstance(item.text_edit, types.TextEdit)
    assert item.text_edit.new_text.endswith("material = ${2:gel})$0")
    assert item.insert_text_format == types.InsertTextFormat.Snippet


@pytest.mark.parametrize(
    ("snippet", "text"),
    [("fem(element = ${1:tet4}, strain = ${2:small})$0", "fem(element = tet4, strain = small)"), ("sin($1)", "sin()")],
)
def test_an_editor_without_snippets_gets_their_text(snippet: str, text: str) -> None:
    assert remove_placeholders(snippet) == text


def test_files_are_those_of_the_folder_of_the_scene(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "part.stl").touch()
    (tmp_path / "other.scene").touch()
    assert "inner/" in labels('body b = solid(tetrahedralized("|', tmp_path)
    assert "inner/part.stl" in labels('body b = solid(tetrahedralized("inner/p|', tmp_path)
    assert "other.scene" in labels('use "|', tmp_path)
    assert "inner/part.stl" not in labels('use "inner/|', tmp_path)


def test_every_constructor_can_be_completed_hovered_and_signed() -> None:
    for kind in CATALOGUE:
        for name in CATALOGUE[kind]:
            constructor = CATALOGUE.constructor(kind, name)
            assert constructor is not None
            text = f"{kind} a = {name}(|"
            found = [item.label for item in completed(text)]
            assert all(f"{f.name} =" in found for f in constructor.fields), text
            assert constructor.summary[:20].split("`")[0] in hovered(f"{kind} a = {name}|(").replace("\\", ""), text
            assert signed(text)[0].startswith(f"{name}("), text


# ------------------------------------------------------------------ hover and signatures


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("param M = L|", "178 mm"),
        ("param M = L|", "0.178 m"),
        ("param M = L|", "between 10 mm and 1 m"),
        ("param M = 5|0 mm", "0.05 m"),
        ("param M = 50 m|m", "a length"),
        ("material a = neo_hookean(yo|ung = 60 kPa)", "greater than 0"),
        ("material a = neo_hookean(yo|ung = 60 kPa)", "Young's modulus"),
        ("model m = fem(tet4, strain = sm|all)", "a choice for `strain`"),
        ("model m = fem(te|t4)", "Four-node"),
        ("model m = fem(tet4, mass = |lumped)", "default"),
        ("mod|el m = fem(tet4)", "declared as"),
        ("expect rod.dr|op < 5 mm", "beam6dof"),
        ("expect rod.dr|op < 5 mm", "displacement(end"),
        ("exp|ect rod.drop < 5 mm", "condition"),
        ("param M = si|n(30 deg)", "sine"),
        ("body b = solid(box(size = (1, 1, 1) mm), ge|l)", "neo_hookean(young"),
        ("body b| = solid(", ""),
        ("# L| is", ""),
        ("|", ""),
    ],
)
def test_what_a_word_means(text: str, said: str) -> None:
    found = hovered(SCENE + text).replace("\\", "")
    assert said in found
    assert bool(said) == bool(found)


@pytest.mark.parametrize(
    ("text", "call", "field"),
    [
        ("material a = neo_hookean(|", "neo_hookean(young, poisson, density)", "young"),
        ("material a = neo_hookean(60 kPa, |", "neo_hookean(young, poisson, density)", "poisson"),
        ("material a = neo_hookean(density = 1 |", "neo_hookean(young, poisson, density)", "density"),
        ("body b = solid(box(|", "box(size, [origin])", "size"),
        ("body b = solid(box(size = (1, 2, 3) mm), |", "solid(shape, material)", "material"),
        ("param M = min(1, |", "min(a, b)", "b"),
        ("param M = unknown(|", "", ""),
        ("material a = neo_hookean(1, 2, 3, 4, |", "neo_hookean(young, poisson, density)", ""),
        ("|", "", ""),
    ],
)
def test_the_call_that_is_written_shows_its_fields(text: str, call: str, field: str) -> None:
    assert signed(SCENE + text) == (call, field)


def test_places_count_in_utf_16(tmp_path: Path) -> None:
    document, at = marked('scene "𝐱é"  # 𝐲\nparam L = 5 |mm')
    assert at == types.Position(1, 12)
    assert document.offset(types.Position(0, 9)) == document.text.index("é")
    assert document.position(document.text.index("é")) == types.Position(0, 9)
    assert Document("", tmp_path).offset(types.Position(7, 7)) == 0
