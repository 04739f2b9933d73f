"""Names, fields, overrides and `use`: from text to typed objects, and where a mistake in them is shown."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.language import scene_sources
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.expression_evaluation import PREDEFINED, Quantity
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.safe_files import open_regular

GEL = "material gel = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)\n"
BEAM = f"""{GEL}body beam = solid(cylinder(length = 200 mm, radius = 20 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 20)
probe tip = point(beam, at = (0, 0, 0) mm)
"""


def compiled(text: str, *overrides: str, folder: Path = Path()) -> tuple[Scene | None, list[Diagnostic]]:
    """The scene of a text and what is said about it."""
    return load_scene(Source("text", text), folder, None, overrides)


def valid(text: str, *overrides: str, folder: Path = Path()) -> Scene:
    scene, found = compiled(text, *overrides, folder=folder)
    assert scene is not None, found
    return scene


def wrong(text: str, *overrides: str, folder: Path = Path()) -> list[tuple[str, str]]:
    """Codes of the errors, and what each underlines."""
    _, found = compiled(text, *overrides, folder=folder)
    return [
        (d.code, d.source.text[d.span.start : d.span.end])
        for d in found
        if d.severity == "error" and d.source and d.span
    ]


def value(scene: Scene, name: str) -> float:
    found = scene.parameters[name].value
    assert isinstance(found, Quantity)
    return found.value


# ------------------------------------------------------------------ fields


def test_fields_are_typed_and_in_si() -> None:
    declared = valid(BEAM).declared
    assert (declared["gel"].thing.young, declared["gel"].thing.density) == (60e3, 1000.0)
    assert declared["beam"].thing.shape.length == 0.2
    assert declared["weight"].thing.direction == (0.0, 0.0, -1.0)
    assert declared["wall"].thing.components == (0, 1, 2)
    assert declared["rod"].thing.segments == 20


@pytest.mark.parametrize(
    ("direction", "expected"),
    [("-y", (0, -1, 0)), ("+x", (1, 0, 0)), ("z", (0, 0, 1)), ("(0, 0, -2)", (0, 0, -1)),
     ("(3, 0, 4)", (0.6, 0, 0.8)),
     ("down", (0, 0.6, -0.8)), ("-1 * down", (0, -0.6, 0.8))],
)  # fmt: skip
def test_directions_have_unit_length(direction: str, expected: tuple[float, ...]) -> None:
    text = BEAM.replace("9.81 m/s^2", f"9.81 m/s^2, direction = {direction}") + "param down = (0, 3, -4)\n"
    if direction == "down":  # a word that people try: a scene that declares it may not use it for a direction
        assert wrong(text) == [("E207", "down")]
    else:
        assert valid(text).declared["weight"].thing.direction == pytest.approx(expected, abs=1e-15)


def test_components_are_a_set() -> None:
    text = BEAM.replace("x <= 0 mm", "x <= 0 mm, components = (z, x, z)")
    text += "\nsupport rest = fixed(beam, where = x <= 0 mm, components = y)\n"  # nothing is free to slide
    assert valid(text).declared["wall"].thing.components == (0, 2)


def test_the_order_of_declarations_does_not_matter() -> None:
    lines = [*BEAM.strip().split("\n"), "param a = b + 1 mm", "param b = c", "param c = 3 mm"]
    for seed in range(5):
        random.Random(seed).shuffle(lines)
        scene = valid("\n".join(lines))
        assert value(scene, "a") == pytest.approx(4e-3, rel=1e-15)


@pytest.mark.slow
def test_a_long_chain_of_parameters_in_either_order() -> None:
    """No recursion: five thousand parameters, each from the next."""
    lines = ["param a0 = 1", *(f"param a{i + 1} = a{i} + 1" for i in range(5000))]
    assert value(valid("\n".join(lines)), "a5000") == 5001.0
    assert value(valid("\n".join(reversed(lines))), "a5000") == 5001.0


def field_names() -> list[str]:
    """Every field of every constructor."""
    kinds = CATALOGUE
    found = (CATALOGUE.constructor(kind, name) for kind in kinds for name in kinds[kind])
    names = {field.name for c in found if c is not None for field in c.fields}
    # of frames, which direction of a file is the scene's x, and axes of curves; and what the scene here declares itself
    return sorted(names - {"x", "y", "z", "tip"})


@pytest.mark.parametrize("name", field_names())
def test_every_field_name_can_name_something(name: str) -> None:
    """None of them is a function, a constant or a reserved word; coordinates name fields of frames and axes alone."""
    scene = valid(f"param {name} = 3 mm\nparam twice = 2 * {name}\n" + BEAM)
    assert value(scene, "twice") == pytest.approx(6e-3, rel=1e-15)


def test_words_of_the_vocabulary_can_name_something() -> None:
    kinds = CATALOGUE
    words = {
        *kinds,
        *(n for table in kinds.values() for n in table),
        *CATALOGUE.words(),
        "small",
        "finite",
        "corotational",
    }
    own = words - PREDEFINED - {"tip"}  # of which the beam has a probe
    scene = valid("".join(f"param {word} = 3 mm\n" for word in sorted(own)) + BEAM)
    assert len(scene.parameters) == len(own)


# ------------------------------------------------------------------ what does not follow from something else


@pytest.mark.parametrize(
    "text",
    [
        "materal gel = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)",
        "material gel = neo_hookean(young = 60, poisson = 0.4, density = 1000 kg/m^3)",
        "material gel = neo_hookean(young: 60 kPa, poisson = 0.4, density = 1000 kg/m^3)",
        "material gel = neo_hookean(poisson = 0.4, density = 1000 kg/m^3)",
        "material gel = neo_hook(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)",
        "material gel = other",
        "material gel = gel",
    ],
)
def test_one_mistake_one_error(text: str) -> None:
    """What refers to a declaration in error is not complained about."""
    assert len(wrong(BEAM.replace(GEL.strip(), text))) == 1


def test_all_independent_mistakes_in_one_pass() -> None:
    text = """param L = 178 mn
material gel = linear_elastic(young = 60 mm, poisson = 0.6, density = 1070)
body bar = solid(cylinder(lenght = 3 mm, radius = 2), gell)
support wall = fixed(bar, where = x <= 0)
probe axis = line(bar, from = (0, 0, 0), to = (0, 0 mm))
expect rod.eta < 5 mm
load push: gravity(9.81 m/s^2)
"""
    assert wrong(text) == [
        ("E106", ":"), ("E209", "mn"), ("E204", "60 mm"), ("E301", "0.6"), ("E204", "1070"),
        ("E205", "lenght"), ("E204", "2"),
        ("E201", "gell"), ("E204", "0"), ("E204", "(0, 0, 0)"), ("E218", "0 mm"), ("E201", "rod.eta"),
    ]  # fmt: skip


def test_physics_is_checked_beside_names() -> None:
    text = BEAM.replace("x <= 0 mm", "x < 0 mm").replace("(0, 0, 0) mm", "(1, 0, 0) m")
    text += "param a = b\nanalysis s = static()\nanalysis t = static()\n"
    assert {code for code, _ in wrong(text)} == {"E201", "E302", "E504", "E222"}


# ------------------------------------------------------------------ overrides


def test_overrides_replace_parameters_and_fields() -> None:
    text = BEAM.replace("200 mm", "L") + "param L = 200 mm in 10 mm .. 1 m\n"
    scene = valid(text, "L=120mm", "gel.young=30kPa", "rod.segments=7", "wall.where=x <= 1 mm")
    assert value(scene, "L") == pytest.approx(0.12, rel=1e-15)
    assert scene.parameters["L"].overridden
    assert scene.parameters["L"].text == "120mm"
    assert scene.declared["beam"].thing.shape.length == pytest.approx(0.12, rel=1e-15)
    assert (scene.declared["gel"].thing.young, scene.declared["rod"].thing.segments) == (30e3, 7)


def test_the_last_override_of_a_name_counts() -> None:
    assert value(valid("param L = 1 mm", "L=2 mm", "L=3 mm"), "L") == pytest.approx(3e-3, rel=1e-15)


def test_an_override_may_name_parameters() -> None:
    assert value(valid("param a = 1 mm\nparam b = 2 mm", "a=3 * b"), "a") == pytest.approx(6e-3, rel=1e-15)


@pytest.mark.parametrize(
    ("override", "code", "place"),
    [
        ("L", "E220", "L"), ("L=", "E220", ""), ("=3 mm", "E220", ""), ("L=120", "E204", "120"),
        ("L=3 kPa", "E204", "3 kPa"),
        ("L=2 m", "E214", "2 m"), ("L=(1, 2) mm", "E204", "(1, 2) mm"), ("L=3 mn", "E209", "mn"),
        ("L=3 mm +", "E129", ""), ("M=3 mm", "E201", "M"),
        ("L=2 * L", "E210", "L"), ("L=k", "E201", "k"), ("gel=3", "E213", "gel"),
        ("gel.yung=3 kPa", "E205", "gel.yung"),
        ("gel.young=3", "E204", "3"), ("gel.poisson=0.6", "E301", "0.6"), ("rod.segments=2.5", "E204", "2.5"),
        ("wall.where=x < 0 mm", "E302", "x < 0 mm"), ("wall.where=x", "E207", "x"),
        ("beam.material=weight", "E213", "weight"),
        ("soft.young=3 kPa", "E205", "soft.young"), ("a.b.c=3", "E201", "a.b.c"), ("L=1\0", "E125", "\0"),
    ],
)  # fmt: skip
def test_a_mistake_in_an_override_is_shown_in_the_argument(override: str, code: str, place: str) -> None:
    text = BEAM + "param L = 200 mm in 10 mm .. 1 m\nmaterial soft = gel\n"
    _, found = compiled(text, override)
    (error,) = (d for d in found if d.severity == "error")
    assert error.source is not None
    assert error.span is not None
    assert (error.source.name, error.source.text) == (f"-p {override}", override)
    assert (error.code, override[error.span.start : error.span.end]) == (code, place)
    assert (error.span.line, error.span.column) == (1, error.span.start + 1)


@given(st.text(max_size=20))
def test_any_override_is_taken_or_refused_with_an_error(text: str) -> None:
    scene, found = compiled("param L = 200 mm\n", f"L={text}")
    assert (scene is None) == any(d.severity == "error" for d in found)


# ------------------------------------------------------------------ use


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "lib").mkdir()
    files = {
        "lib/tissues.scene": 'use "base.scene" as base\nparam k = 5 kPa in 1 kPa .. 9 kPa\n'
        "material liver = neo_hookean(young = k, poisson = 0.45, density = base.rho)\n",
        "lib/base.scene": "param rho = 1060 kg/m^3\n",
        "lib/a.scene": 'use "b.scene" as b\nparam k = 1\n',
        "lib/b.scene": 'use "a.scene" as a\nparam k = 1\n',
        "lib/broken.scene": "param good = 1 mm\nparam bad = 1 mm + 2\nparam worse = = 3\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_names_arrive_with_their_prefix(folder: Path) -> None:
    text = 'use "lib/tissues.scene" as tissue\nmaterial soft = tissue.liver\n'
    text += "param twice = 2 * tissue.k\nparam heavy = tissue.base.rho\n"
    scene = valid(text, folder=folder)
    assert scene.declared["soft"].thing is scene.declared["tissue.liver"].thing
    assert scene.declared["soft"].thing.density == 1060.0
    assert (value(scene, "twice"), value(scene, "heavy"), value(scene, "tissue.k")) == (1e4, 1060.0, 5e3)
    assert set(scene.of_kind("material")) == {"soft"}


def test_names_of_a_scene_that_is_used_can_be_overridden(folder: Path) -> None:
    scene = valid('use "lib/tissues.scene" as tissue\n', "tissue.k=2 kPa", "tissue.liver.poisson=0.3", folder=folder)
    assert (scene.declared["tissue.liver"].thing.young, scene.declared["tissue.liver"].thing.poisson) == (2e3, 0.3)
    assert wrong('use "lib/tissues.scene" as tissue\n', "tissue.k=20 kPa", folder=folder) == [("E214", "20 kPa")]


def test_a_scene_may_be_used_twice(folder: Path) -> None:
    scene = valid('use "lib/tissues.scene" as a\nuse "lib/tissues.scene" as b\n', "a.k=2 kPa", folder=folder)
    assert (value(scene, "a.k"), value(scene, "b.k")) == (2e3, 5e3)


def test_std_is_the_standard_library(folder: Path) -> None:
    scene = valid('use "std/materials/silicones.scene" as silicone\n', folder=folder)
    assert scene.declared["silicone.truth_cube"].kind == "material"


@pytest.mark.parametrize(
    ("text", "errors"),
    [
        ('use "lib/a.scene" as a', [("E402", '"a.scene"')]),
        ('use "lib/nothing.scene" as a', [("E401", '"lib/nothing.scene"')]),
        ('use "lib" as a', [("E401", '"lib"')]),
        ('use "std/nothing.scene" as a', [("E401", '"std/nothing.scene"')]),
        ('use "std/../../pyproject.scene" as a', [("E401", '"std/../../pyproject.scene"')]),
        ('use "../../../../../../etc/passwd" as a', [("E401", '"../../../../../../etc/passwd"')]),
        ('use "/etc/passwd" as a', [("E401", '"/etc/passwd"')]),
        ('use "' + "a" * 300 + '.scene" as a', [("E401", '"' + "a" * 300 + '.scene"')]),
        ('use "lib/base.scene" as sin', [("E217", "sin")]),
        ('use "lib/base.scene" as a\nparam a = 3', [("E208", "a")]),
        ('use "lib/base.scene" as a\nparam b = a', [("E201", "a")]),
        ('use "lib/base.scene" as a\nparam b = a.roh', [("E201", "a.roh")]),
        ('use "lib/base.scene" as a\nparam b = c.rho', [("E201", "c.rho")]),
        ('use "lib/nothing.scene" as a\nparam b = a.rho', [("E401", '"lib/nothing.scene"')]),
        ('use "lib/broken.scene" as a\nparam b = a.good + a.bad', [("E129", "="), ("E218", "1 mm + 2")]),
        ('use "lib/broken.scene" as a\nparam b = a.worse', [("E129", "="), ("E218", "1 mm + 2")]),
        ('use "lib/broken.scene" as a\nuse "lib/broken.scene" as b', [("E129", "="), ("E218", "1 mm + 2")]),
    ],
)
def test_what_cannot_be_used(folder: Path, text: str, errors: list[tuple[str, str]]) -> None:
    assert wrong(text, folder=folder) == errors


def test_a_mistake_in_a_used_scene_is_shown_in_its_file(folder: Path) -> None:
    _, found = compiled('use "lib/broken.scene" as a', folder=folder)
    assert {d.source.name for d in found if d.source} == {str(folder / "lib/broken.scene")}


def test_scenes_that_use_each_other_without_end_are_refused(tmp_path: Path) -> None:
    """Each scene uses the next one twice: 2^60 scenes, if nobody counted."""
    for i in range(60):
        (tmp_path / f"s{i}.scene").write_text(
            f'use "s{i + 1}.scene" as a\nuse "s{i + 1}.scene" as b\n', encoding="utf-8"
        )
    found = wrong('use "s0.scene" as a', folder=tmp_path)
    assert {code for code, _ in found} == {"E402", "E131"}  # so many that not all are looked for
    assert len(found) < 100


def test_nothing_else_is_read(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A check opens the files that `use` names and no others: meshes are looked for, and not read."""
    (folder / "beam.msh").write_bytes(b"\0" * 100)
    read: list[str] = []
    monkeypatch.setattr(scene_sources, "open_regular", lambda path: (read.append(path.name), open_regular(path))[1])
    valid('use "lib/base.scene" as base\nshape s = mesh("beam.msh", unit = 1 mm)\n', folder=folder)
    assert read == ["base.scene"]


# ------------------------------------------------------------------ ten thousand lines


def generated(lines: int) -> str:
    """A valid scene of many beams; parameters refer to later ones, and expectations to everything."""
    text = ["softmark 1", 'scene "Generated"']
    count = (lines - 3) // 12
    for i in range(count):
        text += [
            f"param L{i} = {100 + i % 90} mm in 10 mm .. 500 mm",
            f"param r{i} = L{i} / {10 + i % 3}",
            f"param d{i} = d{i + 1} * 1",
            f"material m{i} = neo_hookean(young = {10 + i % 50} MPa, poisson = 0.3, density = d{i})",
            f"body b{i} = solid(cylinder(length = L{i}, radius = r{i}, axis = +x), m{i})",
            f"support s{i} = fixed(b{i}, where = x <= 0 mm)",
            f"load f{i} = traction(b{i}, where = x >= L{i}, vector = (0, 0, -{1 + i % 5}) Pa)",
            f"model rod{i} = beam6dof(segments = {10 + i % 30}, body = b{i})",
            f"model tet{i} = fem(tet4, strain = finite, size = r{i} / 3, body = b{i})",
            f"probe p{i} = line(b{i}, from = (0, 0, 0) mm, to = (L{i}, 0 mm, 0 mm), points = 11)",
            f"metric sag{i} = displacement(p{i}, along = -z)",
            f"expect rod{i}.sag{i} < 5 mm and tet{i}.sag{i} > -1 mm  # of body {i}",
        ]
    text.append(f"param d{count} = 1000 kg/m^3")
    return "\n".join(text) + "\n"


@pytest.mark.long
@pytest.mark.slow
def test_ten_thousand_lines() -> None:
    """Nothing grows with the square of the length: a check takes some 2 s of CPU, most of it for parsing."""
    text = generated(10_000)
    assert text.count("\n") > 9_980
    scene, found = compiled(text)
    assert [d.code for d in found] == []
    # numbers, since a failure must not print the scene
    sizes = (len(scene.declared), len(scene.expectations)) if scene else (0, 0)
    assert sizes == (8 * 833, 833)
