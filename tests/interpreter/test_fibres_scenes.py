"""Materials with fibres, from scenes: forces found again, directions by expressions and rules, muscle, and no cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from loaded_modules import loaded_by
from scipy.optimize import brentq

import softmark
from softmark.interpreter.verification.fiber_directions_check import helix_vectors
from softmark.interpreter.vocabulary.fiber_words import Helix
from softmark.solvers.materials.material_axes import InvalidDirection

HEART = "guccione(stiffness = 2 kPa, bf = 8, bt = 2, bfs = 4, density = 1000 kg/m^3, fibres = {fibres}{more})"
LAWS = {
    "guccione": HEART,
    "fung": "fung_orthotropic(stiffness = 2 kPa, bff = 8, bss = 4, bnn = 2, bfs = 4, bfn = 3, bsn = 2, density ="
    " 1000 kg/m^3, fibres = {fibres}, sheets = +z{more})",
    "tendon": "transversely_isotropic(shear = 2 kPa, k1 = 10 kPa, k2 = 2, density = 1000 kg/m^3,"
    " fibres = {fibres}{more})",
    "artery": "holzapfel_gasser_ogden(c = 4 kPa, k1 = 5 kPa, k2 = 3, angle = 40 deg, kappa = 0.1,"
    " density = 1000 kg/m^3, fibres = {fibres}, sheets = +z{more})",
    "heart": "holzapfel_ogden(a = 2 kPa, b = 2, a_f = 6 kPa, b_f = 3, a_s = 3 kPa, b_s = 2, a_fs = 1 kPa, b_fs = 2,"
    " density = 1000 kg/m^3, fibres = {fibres}, sheets = +z{more})",
}  # fmt: skip
STRIP = """
material tissue = {law}
{active}
body     bar  = solid(box(size = (2, 2, 4) cm), {made_of})
support  low  = fixed(bar, where = z <= 0 mm)
load     pull = traction(bar, where = z >= 4 cm, vector = (50, 0, 300) Pa)
probe    tip  = point(bar, at = (0, 0, 4) cm)
metric   far  = displacement(tip, along = +z)
"""
TIGHT = ("hex8, formulation = mixed", "tet10, formulation = mixed")
LOOSE = ("hex8", "tet4", "tet10", "hex8, formulation = mean_dilatation")


def judged(law: str, fibres: str, bulk: str, models: tuple[str, ...], tension: str = "") -> dict[str, float]:
    """What models find, m; each is an equilibrium by other formulas too. The tolerance is that of the solver."""
    active = f"material muscle = active(tissue, tension = {tension})" if tension else ""
    text = STRIP.format(law=LAWS[law].format(fibres=fibres, more=bulk), active=active,
                        made_of="muscle" if tension else "tissue")  # fmt: skip
    lines = [f"model m{i} = fem({words}, strain = finite, size = 10 mm)" for i, words in enumerate(models)]
    report = softmark.loads(text + "\n".join(lines)).run()
    for words, model in zip(models, report.models.values(), strict=True):
        assert model.status == "converged", (words, model.message)
        checks = model.solve["checks"]
        assert checks["residual"] is not None, (words, checks.get("reason"))
        assert checks["residual"] < 1e-8, words
    return {
        words: float(m.metrics["far"].value or 0.0) for words, m in zip(models, report.models.values(), strict=True)
    }


def test_forces_are_found_again_by_other_formulas() -> None:
    """Fibres that turn from place to place, with and without a volume that can change."""
    judged("guccione", "(1 cm, z, x)", "", TIGHT[:1])
    judged("heart", "(1 cm, z, 0 cm)", ", bulk = 20 kPa", LOOSE[:1])


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("fibres", ["(1, 1, 0.2)", "(1 cm, z, x)"])
@pytest.mark.parametrize("tension", ["", "1 kPa"])
def test_forces_of_every_law_are_found_again(law: str, fibres: str, tension: str) -> None:
    judged(law, fibres, "", TIGHT, tension)
    judged(law, fibres, ", bulk = 20 kPa", LOOSE, tension)


@pytest.mark.slow
@pytest.mark.long
def test_expressions_that_are_the_same_everywhere_are_a_direction() -> None:
    """Arrays of points and one direction for all come to the same state: to rounding."""
    one = judged("guccione", "(1, 2, 3)", "", TIGHT[:1])
    many = judged("guccione", "(1 cm + 0 * x, 2 cm, 3 cm)", "", TIGHT[:1])
    assert many == pytest.approx(one, rel=1e-9)


WALL = {"inner": 0.007, "inner_along": 0.017, "outer": 0.010, "outer_along": 0.020}
PLACED = {"axis": (0.0, 0.6, -0.8), "origin": (0.1, -0.2, 0.3)}


def points(rule: Helix, n: int = 200) -> np.ndarray[Any, Any]:
    """Points of the wall that a helix is of (n, 3), m, at any depth."""
    rng = np.random.default_rng(3)
    t, u, v = rng.uniform(0.0, 1.0, n), rng.uniform(0.2, 3.0, n), rng.uniform(-3.0, 3.0, n)
    a = rule.inner + t * (rule.outer - rule.inner)
    b = rule.inner_along + t * (rule.outer_along - rule.inner_along)
    e3 = np.array(rule.axis)
    e1 = np.cross(e3, [1.0, 0.0, 0.0])
    e1 /= np.linalg.norm(e1)
    Y = np.stack([a * np.sin(u) * np.cos(v), a * np.sin(u) * np.sin(v), b * np.cos(u)], axis=1)
    return np.asarray(Y @ np.stack([e1, np.cross(e3, e1), e3]) + np.array(rule.origin))


@pytest.mark.parametrize("more", [{}, PLACED], ids=["along z", "anywhere"])
def test_a_helix_is_that_of_the_paper(more: dict[str, Any]) -> None:
    """f = n(dx/du) sin a + n(dx/dv) cos a, a from 90 to -90 degrees: by tangents of the parametrisation."""
    rule = Helix(0.5 * np.pi, -0.5 * np.pi, **WALL, **more)
    X = points(rule)
    (f, s), (other, normal) = rule.at(X), helix_vectors(rule, X)
    np.testing.assert_allclose(f, other, atol=1e-9)
    np.testing.assert_allclose(s, normal, atol=1e-9)
    np.testing.assert_allclose(np.einsum("ni,ni->n", f, s), 0.0, atol=1e-12)


def test_a_positive_angle_is_a_right_handed_screw() -> None:
    """On the equator at 30 degrees: around the axis counter-clockwise, and up it."""
    rule = Helix(np.pi / 6.0, np.pi / 6.0, **WALL)
    f, s = rule.at(np.array([[0.007, 0.0, 0.0], [0.0, 0.0085, 0.0]]))
    np.testing.assert_allclose(f, [[0.0, 0.75**0.5, 0.5], [-(0.75**0.5), 0.0, 0.5]], atol=1e-12)
    np.testing.assert_allclose(s, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)


def test_a_helix_has_no_direction_on_its_axis_and_outside() -> None:
    rule = Helix(0.5, -0.5, **WALL)
    for place in ((0.0, 0.0, -0.018), (0.0, 0.03, 0.0)):
        with pytest.raises(InvalidDirection) as refused:
            rule.at(np.array([[0.008, 0.0, 0.0], place]))
        assert refused.value.place == place


def test_muscle_that_is_free_shortens_to_where_its_tension_is_carried() -> None:
    """Guccione's law along fibres, S + T = 0 with J = 1: one cell, to the tolerance of the solver."""
    text = """
material tissue = guccione(stiffness = 2 kPa, bf = 8, bt = 2, bfs = 4, density = 1000 kg/m^3, fibres = +x)
material muscle = active(tissue, tension = 5 kPa)
body     cube   = solid(box(size = (10, 10, 10) mm), muscle)
support  left   = fixed(cube, where = x <= 0 mm, components = x)
support  front  = fixed(cube, where = y <= 0 mm, components = y)
support  below  = fixed(cube, where = z <= 0 mm, components = z)
model    one    = fem(hex8, strain = finite, size = 10 mm, formulation = mixed)
probe    end    = point(cube, at = (10, 10, 10) mm)
metric   less   = displacement(end, along = -x)
metric   sigma  = stress(end, component = xx)
"""

    def stress(stretch: float) -> float:
        """Along fibres, less that across them, Pa: with the tension."""
        along, across = 0.5 * (stretch**2 - 1.0), 0.5 * (1.0 / stretch - 1.0)
        c = 2e3 * np.exp(8.0 * along**2 + 4.0 * across**2)
        return float(stretch**2 * (8.0 * c * along + 5e3) - 2.0 * c * across / stretch)

    scene = softmark.loads(text)
    assert "W313" not in {d.code for d in scene.warnings}  # it does not stay at rest
    model = scene.run().models["one"]
    assert model.metrics["less"].value == pytest.approx(0.01 * (1.0 - brentq(stress, 0.5, 1.0, xtol=1e-14)), rel=1e-7)
    assert abs(float(model.metrics["sigma"].value or 0.0)) < 1e-3  # Pa, of a tension of 5000


@pytest.mark.slow
def test_nothing_of_it_is_imported_for_other_scenes() -> None:
    text = STRIP.format(law="neo_hookean(young = 10 kPa, poisson = 0.3, density = 1000 kg/m^3)", active="",
                        made_of="tissue") + "model one = fem(hex8, strain = finite, size = 20 mm)"  # fmt: skip
    found = loaded_by(text)
    others = (
        "interpreter.problem.anisotropy_limits",
        "interpreter.verification.fiber_directions_check",
        "interpreter.vocabulary.fiber_words",
        "solvers.independent_forces.fiber_axes_by_differences",
        "solvers.materials.heterogeneous",
    )
    assert not found & set(others)


HALVED = """
material tissue = {law}
material muscle = active(tissue, tension = 1 kPa{own})
body     bar   = solid(box(size = (40, {wide}, 10) mm, origin = (0, {low}, 0) mm), {made_of})
support  wall  = fixed(bar, where = x <= 0 mm)
{mirror}
load     pull  = traction(bar, where = x >= 40 mm, vector = (200, 0, 0) Pa)
model    cubes = fem(hex8, strain = finite, size = 5 mm)
probe    tip   = point(bar, at = (40, 10, 0) mm)
metric   far   = displacement(tip, along = +x)
metric   side  = displacement(tip, along = +y)
"""
LOOSELY = ", bulk = 20 kPa"
RUBBER = "neo_hookean(young = 10 kPa, poisson = 0.4, density = 1000 kg/m^3)"


def halved(law: str, own: str = "", whole: bool = False) -> dict[str, float]:
    """What half of a bar finds, or the whole of it, m; with `own` fibres it pulls along them. Raises SceneError."""
    mirror = "" if whole else "support middle = symmetric(bar, where = y <= 0 mm)"
    wide, low = (20, -10) if whole else (10, 0)
    text = HALVED.format(law=law, mirror=mirror, wide=wide, low=low, own=f", own = {own or '+x'}",
                         made_of="muscle" if own else "tissue")  # fmt: skip
    return {name: float(m.value or 0.0) for name, m in softmark.loads(text).run().models["cubes"].metrics.items()}


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("fibres", ["(1, 0, 1)", "(10 mm, y, 0 mm)"])
def test_half_stands_for_the_whole_where_fibres_are_their_own_mirror_image(fibres: str) -> None:
    """The same mesh on both sides: to what the solver leaves of forces."""
    law = LAWS["guccione"].format(fibres=fibres, more=LOOSELY)
    assert halved(law) == pytest.approx(halved(law, whole=True), rel=1e-7)


@pytest.mark.parametrize(("law", "own"), [
    (LAWS["guccione"].format(fibres="(1, 1, 0)", more=LOOSELY), ""),
    (LAWS["guccione"].format(fibres="(y + 1 mm, x, 0 mm)", more=LOOSELY), ""),  # askew in the plane
    (LAWS["guccione"].format(fibres="(10 mm, y^2 / 10 mm, 0 mm)", more=LOOSELY), ""),  # beside it
    (LAWS["artery"].format(fibres="(1, 1, 0)", more=LOOSELY), ""),
    (RUBBER, "(1, 1, 0)"),
])  # fmt: skip
def test_half_does_not_stand_for_the_whole_where_they_are_not(law: str, own: str) -> None:
    """At 45 degrees the end of the half went 0.05 mm to the side, and that of the whole goes 0.34 mm."""
    with pytest.raises(softmark.SceneError) as refused:
        halved(law, own)
    assert [d.code for d in refused.value.diagnostics] == ["E369"]


def test_fibres_in_all_directions_alike_have_any_mirror_image() -> None:
    """Dispersion of a third, and two families that a mirror makes of each other."""
    halved(LAWS["artery"].replace("kappa = 0.1", "kappa = 0.3333333333333333").format(fibres="(1, 1, 0)", more=LOOSELY))
    crossed = LAWS["artery"].replace("sheets = +z", "sheets = +y")
    halved(crossed.format(fibres="+x", more=LOOSELY))


WOUND = """
fibres   winding = helix(endo = {angle}, epi = {angle}, {wall})
material muscle  = {law}
body     part    = solid(box(size = (2, 2, 2) mm, origin = (7.3, 0, 0) mm), muscle)
support  base    = fixed(part, where = z >= 2 mm)
support  middle  = symmetric(part, where = y <= 0 mm)
load     pull    = traction(part, where = z <= 0 mm, vector = (0, 0, -100) Pa)
model    cubes   = fem(hex8, strain = finite, size = 2 mm)
probe    tip     = point(part, at = (9, 2, 0) mm)
metric   far     = displacement(tip, along = -z)
"""


@pytest.mark.parametrize(("angle", "codes"), [("0 deg", []), ("90 deg", []), ("30 deg", ["E369"])])
def test_the_mirror_image_of_a_screw_is_another(angle: str, codes: list[str]) -> None:
    """A plane through the axis of a helix: rings and meridians go on beyond it, a right-handed screw does not."""
    law = HEART.format(fibres="winding", more=LOOSELY)
    wall = "inner = 7 mm, inner_along = 17 mm, outer = 10 mm, outer_along = 20 mm"
    scene = softmark.loads(WOUND.format(angle=angle, law=law, wall=wall))
    found: list[str] = []
    try:
        scene.run()
    except softmark.SceneError as refused:
        found = [d.code for d in refused.diagnostics]
    assert found == codes
