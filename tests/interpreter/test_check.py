"""Checks of the physics that need no mesh: that they speak, and that they are silent about good scenes."""

from __future__ import annotations

from pathlib import Path

import pytest

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.scenes import ROOT

BEAM = """material gel = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body beam = solid(cylinder(length = 200 mm, radius = 20 mm), gel)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2)
model rod = beam6dof(segments = 20)
probe tip = point(beam, at = (200, 0, 0) mm)
"""
TET = "model tet = fem(tet4, strain = corotational, size = 10 mm)\n"
THEORY = "reference theory = elastica(beam)\n"


def found(text: str) -> list[Diagnostic]:
    return load_scene(Source("text", text), Path(), None)[1]


def codes(text: str) -> list[str]:
    return [d.code for d in found(text)]


def changed(*changes: tuple[str, str], more: str = "") -> str:
    """The beam with parts of its text replaced, each of which must be there."""
    text = BEAM
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text + more


def test_a_good_scene_is_not_complained_about() -> None:
    assert codes(BEAM) == []
    judged = "metric eta = relative_l2_error(tip, against = theory)\nexpect rod.eta < 5 %\n"
    assert codes(BEAM + TET + THEORY + judged) == []


MEANT = {  # scenes about these warnings
    "beam-at-the-extremes": {"W302", "W322"},
    "pressure-vessels": {"W301"},
    "cooks-membrane": {"W301"},
    "silicone-beam": {"W301", "W302", "W321", "W322"},
    "silicone-beam-as-published": {"W301", "W302", "W321", "W323"},
    "silicone-beam-refined": {"W301"},
    "silicone-beam-filled": {"W301"},
    "silicone-beam-by-others": {"W301", "W302", "W710"},  # of what others do alike, and of what one does not
    "silicone-beam-release": {"W301", "W321", "W322"},
    "silicone-beam-trade": {"W301", "W302", "W321", "W322"},
    "uniaxial-stretch": {"W301"},
    "rubber-vessels": {"W301"},  # what locks is shown
    "rubber-laws": {"W301"},  # at nu = 0.49, stretched evenly: nothing bends
    "creeping-cantilevers": {"W312"},  # two quadratic cells across, which bend as well
    "ventricle-contracting": {"W312"},  # the coarsest of its meshes, from which finer ones start
    "pin-on-a-membrane": {"W312"},  # of a membrane, whose bending is next to nothing
    "pin": {"W312"},
    "line-of-force": {"W312", "W335"},  # a slice in plane strain, one cell thick; half of a force
}


@pytest.mark.parametrize("file", sorted(ROOT.rglob("*.scene")), ids=lambda p: p.stem)
def test_no_false_alarm_about_scenes_that_come_with_softmark(file: Path) -> None:
    source = Source(file.name, file.read_text(encoding="utf-8"))
    warned = {d.code for d in load_scene(source, file.parent, file)[1]}
    assert warned == MEANT.get(file.stem, set())


# ------------------------------------------------------------------ values that are doubtful


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("density = 1000 kg/m^3", "density = 1 kg/m^3", "W303"),
        ("density = 1000 kg/m^3", "density = 1000 g/cm^3", "W303"),
        ("young = 60 kPa", "young = 60 mPa", "W310"),
        ("young = 60 kPa", "young = 60 TPa", "W310"),
        ("9.81 m/s^2", "9810 m/s^2", "W307"),
    ],
)
def test_values_off_by_a_factor(old: str, new: str, code: str) -> None:
    assert codes(changed((old, new))) == [code]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("density = 1000 kg/m^3", "density = 25 kg/m^3"),  # polystyrene foam
        ("density = 1000 kg/m^3", "density = 19300 kg/m^3"),  # gold
        ("young = 60 kPa", "young = 100 Pa"),  # a soft hydrogel
        ("young = 60 kPa", "young = 1100 GPa"),  # diamond
        ("9.81 m/s^2", "24.8 m/s^2"),  # Jupiter
        ("9.81 m/s^2", "0 m/s^2"),
    ],
)
def test_values_of_real_things(old: str, new: str) -> None:
    assert codes(changed((old, new))) == []


def test_a_material_inside_a_body_is_looked_at_as_well() -> None:
    inline = "neo_hookean(young = 60 mPa, poisson = 0.4, density = 1 kg/m^3)"
    text = changed((BEAM.split("\n")[0] + "\n", ""), (", gel)", f", {inline})"))
    assert codes(text) == ["W303", "W310"]
    assert {d.source.text[d.span.start : d.span.end] for d in found(text) if d.source and d.span} == {inline}


@pytest.mark.parametrize(
    ("poisson", "locks"), [(0.0, False), (0.3, False), (0.449, False), (0.45, True), (0.49, True), (0.4999, True)]
)
def test_linear_tetrahedra_near_incompressibility(poisson: float, locks: bool) -> None:
    text = changed(("poisson = 0.4", f"poisson = {poisson}"), more=TET)
    assert codes(text) == ["W301"] * locks
    assert codes(changed(("poisson = 0.4", f"poisson = {poisson}"))) == []  # a beam model does not lock


@pytest.mark.parametrize(
    ("young", "strain", "warned"),
    [
        # w L^3 / (6 EI) = 9.81 * 1000 * pi R^2 * L^3 / (6 E pi R^4 / 4) = 1.308e5 Pa / E, with R = 20 mm and
        # L = 200 mm: 0.1 rad at 1.308 MPa
        ("60 kPa", "small", True),
        ("1.30 MPa", "small", True),
        ("1.32 MPa", "small", False),
        ("60 kPa", "corotational", False),
        ("60 kPa", "finite", False),
    ],
)
def test_small_strain_under_a_large_rotation(young: str, strain: str, warned: bool) -> None:
    text = changed(("young = 60 kPa", f"young = {young}"), more=TET.replace("corotational", strain))
    assert codes(text) == ["W302"] * warned


def test_small_strain_under_an_end_force() -> None:
    """P L^2 / (2 EI) = 0.1 rad at P = 0.2 * 60e3 * pi/4 * 0.02^4 / 0.2^2 = 0.0377 N, and gravity off."""
    force = "load weight = point_force(beam, at = (200, 0, 0) mm, vector = (0, 0, {}) N)"
    for newton, warned in (("-0.037", False), ("-0.039", True), ("0.039", True)):
        text = changed(
            ("load weight = gravity(9.81 m/s^2)", force.format(newton)), more=TET.replace("corotational", "small")
        )
        assert codes(text) == ["W302"] * warned
    along = force.replace("(0, 0, {})", "(100, 0, 0)")
    assert codes(changed(("load weight = gravity(9.81 m/s^2)", along), more=TET.replace("corotational", "small"))) == []


@pytest.mark.parametrize(("length", "crude"), [(119, True), (121, False)])
def test_a_beam_that_is_not_slender(length: int, crude: bool) -> None:
    """Three depths of 40 mm are 120 mm."""
    text = changed(("length = 200 mm", f"length = {length} mm"), ("(200, 0, 0) mm", "(0, 0, 0) mm"))
    assert codes(text) == ["W304"] * crude


# ------------------------------------------------------------------ what cannot be


@pytest.mark.parametrize(
    ("where", "code"),
    [
        ("x < 0 mm", "E302"), ("x > 200 mm", "E302"), ("x >= 200 m", "E302"), ("y^2 + z^2 > 1 m^2", "E302"),
        ("x >= 0 mm", "E303"),
        ("x <= 200 mm", "E303"), ("abs(x) < 1 m", "E303"), ("not x < 0 mm", "E303"),
    ],
)  # fmt: skip
def test_supports_that_select_nothing_or_everything(where: str, code: str) -> None:
    """One error, and nothing of what follows from it, whatever models and references there are."""
    assert codes(changed(("x <= 0 mm", where), more=TET + THEORY)) == [code]


def test_a_load_may_act_everywhere() -> None:
    assert (
        codes(
            changed(
                ("gravity(9.81 m/s^2)", "pressure(beam, where = x >= 0 mm, magnitude = 1 Pa)"),
                ("beam6dof(segments = 20)", "fem(tet4, strain = finite, size = 10 mm)"),
            )
        )
        == []
    )


def test_a_body_that_nothing_holds_is_reported_once() -> None:
    text = changed(("support wall = fixed(beam, where = x <= 0 mm)\n", ""), more=TET + THEORY)
    assert codes(text) == ["E306"]


def test_every_model_without_a_clear_body_is_reported() -> None:
    other = "body other = solid(box(size = (10, 10, 99) mm), gel)\nreference theory = elastica(other)\n"
    assert codes(BEAM + TET + other).count("E221") == 2


def test_what_holds_for_several_models_is_said_once() -> None:
    push = "load push = pressure(beam, where = z >= 0 mm, magnitude = 1 Pa)\n"
    (error,) = found(BEAM + push + "model euler = beam6dof(segments = 9, shear = no)\n")
    assert error.code == "E501"
    assert error.notes == ("the same applies to `euler`",)


def test_points_outside_are_reported_at_both_ends() -> None:
    text = changed(("point(beam, at = (200, 0, 0) mm)", "line(beam, from = (-1, 0, 0) mm, to = (201, 0, 0) mm)"))
    assert codes(text) == ["E504", "E504"]


def test_points_on_the_surface_are_inside() -> None:
    for point in ("(0, 0, 0) mm", "(200, 20, 0) mm", "(100, 12, 16) mm", "(0.2 m, 0 m, -0.02 m)"):
        assert codes(changed(("(200, 0, 0) mm", point))) == []


REFUSED = [
    ("gravity(9.81 m/s^2)", "pressure(beam, where = z >= 0 mm, magnitude = 1 Pa)", "not gravity"),
    ("gravity(9.81 m/s^2)", "traction(beam, where = x >= 200 mm, vector = (0, 0, -1) Pa)", "not gravity"),
    ("gravity(9.81 m/s^2)", "gravity(9.81 m/s^2, direction = +x)", "0 degrees"),
    ("gravity(9.81 m/s^2)", "gravity(9.81 m/s^2, direction = (1, 0, -1))", "45 degrees"),
    ("gravity(9.81 m/s^2)", "gravity(0 m/s^2)", "there is no gravity"),
    ("where = x <= 0 mm", "where = x <= 0 mm and z <= 0 mm", "does not clamp exactly one end face"),
    ("where = x <= 0 mm", "where = x <= 50 mm", "does not clamp exactly one end face"),
    ("where = x <= 0 mm", "where = x <= 0 mm, components = (x, y)", "not a clamp"),
    ("where = x <= 0 mm", "where = x <= 0 mm or x >= 200 mm", "does not clamp exactly one end face"),
    ("x <= 0 mm)\n", "x <= 0 mm)\nsupport far = fixed(beam, where = x >= 200 mm)\n", "more than one end"),
]


@pytest.mark.parametrize("reference", ["elastica", "simo_reissner", "small_deflection"])
@pytest.mark.parametrize(("old", "new", "reason"), REFUSED, ids=[r[1][:50] for r in REFUSED])
def test_references_that_do_not_hold(old: str, new: str, reason: str, reference: str) -> None:
    theory = THEORY.replace("elastica", reference)
    text = changed((old, new), ("model rod = beam6dof(segments = 20)\n", theory))
    (error,) = found(text)
    assert error.code == "E503"
    assert reason in error.message


def test_a_clamp_at_the_other_end_is_as_good() -> None:
    text = changed(("x <= 0 mm", "x >= 200 mm"), ("(200, 0, 0)", "(0, 0, 0)"), more=THEORY)
    assert codes(text) == []


# ------------------------------------------------------------------ what nothing asks for


def test_a_library_is_not_told_that_nothing_uses_it() -> None:
    assert codes("param L = 3 mm\n" + BEAM.split("\n")[0]) == []


def test_names_that_nothing_uses() -> None:
    text = BEAM + "param L = 3 mm\nparam used = 2 * L\nmaterial other = gel\n"
    text += "shape spare = box(size = (1, 1, 1) mm)\n"
    assert [(d.code, d.source.text[d.span.start : d.span.end])
            for d in found(text) if d.source and d.span] == [
        ("W309", "used"), ("W309", "other"), ("W309", "spare"),
    ]  # fmt: skip


def test_a_model_that_nothing_asks_for() -> None:
    assert codes(changed(("probe tip = point(beam, at = (200, 0, 0) mm)\n", ""))) == ["W308"]


def test_warnings_are_no_errors() -> None:
    scene, warned = load_scene(Source("text", changed(("young = 60 kPa", "young = 60 mPa"))), Path(), None)
    assert scene is not None
    assert [d.severity for d in warned] == ["warning"]


@pytest.mark.parametrize(("components", "both"), [("x", []), ("(x, z)", ["E657"])])
def test_a_rigid_body_may_be_held_where_another_support_leaves_it_free(components: str, both: list[str]) -> None:
    """A displacement has no part in directions that its support leaves free."""
    assert codes(
        "material gel = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)\n"
        "body block = solid(box(size = (20, 20, 20) mm), gel)\n"
        "body ball = rigid(sphere(radius = 5 mm, origin = (10, 10, 25) mm))\n"
        "support floor = fixed(block, where = z <= 0 mm)\n"
        "support still = fixed(ball, components = (y, z))\n"
        f"support hand = displaced(ball, by = (1, 0, -1) mm, components = {components})\n"
        "contact touch = rigid_contact(ball, block)\n"
        "model bricks = fem(hex8, strain = finite, size = 5 mm)\n"
        "metric push = force(touch, along = -z)\n"
    ) == both  # fmt: skip
