"""Materials that vary in space, from scenes: forces found again by other formulas, integrals, refusals, and no cost."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from loaded_modules import loaded_by
from scipy.integrate import quad

import softmark
from softmark.interpreter.cli.main import main
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.pipeline.run_pipeline import run_scene

SOLID = """
material gel  = {law}(young = 10 kPa * (1 + (z / 4 cm)^2 * exp(x / 1 cm)), poisson = 0.2 + 0.2 * z / 4 cm,
                      density = 1000 kg/m^3 * (1 + sin(z / 1 cm * 1 rad)^2))
body     bar  = solid(box(size = (2, 2, 4) cm), gel)
support  low  = fixed(bar, where = z <= 0 mm)
load     side = gravity(9.81 m/s^2, direction = +x)
load     pull = traction(bar, where = z >= 4 cm, vector = (0, 0, 100) Pa)
probe    tip  = point(bar, at = (0, 0, 4) cm)
metric   far  = displacement(tip, along = +x)
"""
QUICK = [
    "tet4, strain = corotational", "hex8, strain = finite, integration = selective",
    "tet10, strain = small, formulation = mixed",
]  # fmt: skip
ALL = [
    f"{element}, strain = {strain}{more}"
    for strain in ("small", "corotational", "finite")
    for element, more in (
        ("tet4", ""), ("tet10", ""), ("hex8", ""), ("hex20", ""), ("hex27", ""), ("hex8", ", integration = selective"),
        ("hex8", ", formulation = mean_dilatation"), ("hex8", ", formulation = mixed"),
        ("tet10", ", formulation = mixed"),
    )
]  # fmt: skip


def judged(models: list[str], law: str = "neo_hookean") -> dict[str, Any]:
    """The models of the solid by their words; each has an answer whose forces were found again."""
    lines = [f"model m{i} = fem({words}, size = 10 mm)" for i, words in enumerate(models)]
    report = softmark.loads(SOLID.format(law=law) + "\n".join(lines)).run()
    for words, model in zip(models, report.models.values(), strict=True):
        assert model.status == "converged", (words, model.message)
        checks = model.solve["checks"]
        assert checks["residual"] is not None, (words, checks.get("reason"))
        assert checks["residual"] < 1e-8, words
    return {words: model.metrics["far"].value for words, model in zip(models, report.models.values(), strict=True)}


@pytest.mark.slow
@pytest.mark.long
def test_forces_are_found_again_by_other_formulas() -> None:
    """E, nu and density vary, none of them as a polynomial; the check has stress of its own, and densities."""
    judged(QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["neo_hookean", "neo_hookean_isochoric", "st_venant_kirchhoff", "stable_neo_hookean"])
def test_forces_of_every_element_and_law_are_found_again(law: str) -> None:
    """A pressure that is eliminated is the same as one that is solved for: the two agree to the solver's tolerance.

    Where strain is small, turned or not, all laws are Hooke's: one is tried.
    """
    strains = ("small", "corotational", "finite") if law == "neo_hookean" else ("finite",)
    found = judged([words for words in ALL if any(f"strain = {strain}" in words for strain in strains)], law)
    for strain in strains:
        mean, mixed = (found[f"hex8, strain = {strain}, formulation = {f}"] for f in ("mean_dilatation", "mixed"))
        assert mean == pytest.approx(mixed, rel=1e-8)


PLANE = """
material gel = neo_hookean(young = 10 kPa * (1 + y / 4 cm), poisson = 0.2 + 0.2 * y / 4 cm, density = 1000 kg/m^3)
body     bar = {body}
support  low = fixed(bar, where = y <= 0 mm)
load     up  = traction(bar, where = y >= 4 cm, vector = (0, 100, 0) Pa)
model    one = fem(quad4, strain = small, size = 10 mm)
model    two = fem(quad9, strain = finite, size = 10 mm)
probe    tip = point(bar, at = (1, 4, 0) cm)
metric   far = displacement(tip, along = +y)
metric   syy = stress(tip, component = yy)
"""
REGION = "quadrilateral((1, 0, 0) cm, (2, 0, 0) cm, (2, 4, 0) cm, (1, 4, 0) cm)"


@pytest.mark.slow
@pytest.mark.parametrize(
    "body", [f"plane_stress({REGION}, gel, thickness = 1 mm)", f"axisymmetric({REGION}, gel)",
             f"plane_strain({REGION}, gel, thickness = 1 mm)"],
)  # fmt: skip
def test_plane_bodies_may_vary(body: str) -> None:
    report = softmark.loads(PLANE.format(body=body)).run()
    for model in report.models.values():
        assert model.status == "converged", model.message
        assert model.solve["checks"]["residual"] < 1e-8, model.solve["checks"]


BAR = """
material gel = {material}
body     bar = solid(box(size = (10, 10, 40) mm), gel)
support  low = fixed(bar, where = z <= 0 mm)
load     up  = traction(bar, where = z >= 40 mm, vector = (0, 0, 100) Pa)
{more}
probe    end = point(bar, at = (5, 5, 40) mm)
metric   far = displacement(end, along = +z)
"""


def bar(
    young: str = "10 kPa", more: str = "", nu: str = "0", rho: str = "1000 kg/m^3", law: str = "linear_elastic"
) -> str:
    """A bar that is pulled along z."""
    return BAR.format(material=f"{law}(young = {young}, poisson = {nu}, density = {rho})", more=more)


def far(text: str) -> dict[str, float]:
    """What the models and references of a scene find, m."""
    report = softmark.loads(text).run()
    for result in (*report.models.values(), *report.references.values()):
        assert result.status == "converged", result.message
    return {n: float(r.metrics["far"].value or 0.0) for n, r in (*report.models.items(), *report.references.items())}


@pytest.mark.slow
def test_elements_come_to_the_integral_in_their_order() -> None:
    """u = p int dz / E, E = E0 exp(3 z / L), by scipy. Halved cells: four times less of it is missed by linear elements
    (h^2), and at least eight times by quadratic ones, which reach h^4 at ends."""
    models = [
        f"model {name}{size} = fem({words}, size = {size} mm)"
        for name, words in (("hex", "hex8, strain = small"), ("ten", "hex20, strain = small"))
        for size in (5, 10)
    ]
    found = far(bar("10 kPa * exp(3 * z / 40 mm)", "\n".join(models)))
    exact = quad(lambda z: 100.0 / (1e4 * math.exp(3.0 * z / 0.04)), 0.0, 0.04, epsabs=0.0)[0]
    missed = {name: abs(u / exact - 1.0) for name, u in found.items()}
    assert missed["hex5"] < 0.02
    assert missed["hex10"] / missed["hex5"] == pytest.approx(4.0, rel=0.15)
    assert missed["ten10"] / missed["ten5"] > 8.0


def test_tetrahedra_of_one_point_integrate_what_varies_within_them() -> None:
    """A cell-wise constant strain sees the mean of E over each cell: with E = z^2 sampled at centroids alone the energy
    of a given motion would be off by h^2, and is exact by four points."""
    more = """support top = displaced(bar, where = z >= 40 mm, by = (0, 0, 1) mm, components = z)
support guided = fixed(bar, where = x < 100 mm, components = (x, y))
model  t = fem(tet4, strain = small, size = 5 mm)
metric W = strain_energy(bar)"""
    text = bar("10 kPa + 10 kPa * (x / 10 mm)^2", more).replace("load     up", "#")
    report = softmark.loads(text).run()
    strain, volume = 1.0 / 40.0, 4e-6
    exact = 0.5 * strain**2 * volume * (1e4 + 1e4 / 3.0)
    # E does not vary along z: every section is stretched alike, and the energy is that of the mean of E
    assert report.models["t"].metrics["W"].value == pytest.approx(exact, rel=1e-10)


def test_the_reference_is_an_integral_and_says_where_it_does_not_hold() -> None:
    """With weight and a density that varies: N = p + g int rho, by nested quadratures of scipy."""
    more = "load w = gravity(9.81 m/s^2, direction = +z)\nreference exact = graded_bar(bar)"
    found = far(bar("10 kPa * (1 + z / 40 mm)^2", more, rho="1000 kg/m^3 * (1 + z / 40 mm)"))["exact"]
    above = lambda z: quad(lambda t: 1000.0 * (1.0 + t / 0.04), z, 0.04)[0]  # noqa: E731
    exact = quad(lambda z: (100.0 + 9.81 * above(z)) / (1e4 * (1.0 + z / 0.04) ** 2), 0.0, 0.04)[0]
    assert found == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize(
    ("young", "nu", "more", "reason"),
    [
        ("10 kPa * (1 + x / 1 cm)", "0", "", "varies over the cross-section"),
        ("10 kPa * (1 + z / 1 cm)", "0.3", "", "contract by different amounts"),
        ("10 kPa * (1 + z / 1 cm)", "0.1 * z / 40 mm", "", "Poisson's ratio varies"),
        ("10 kPa * (1 + z / 1 cm)", "0", "load g = gravity(9.81 m/s^2, direction = +x)", "along the axis"),
        ("10 kPa * (1 + z / 1 cm)", "0", "load q = pressure(bar, where = z >= 40 mm, magnitude = 1 Pa)", "neither"),
        ("10 kPa * (1 + z / 1 cm)", "0", "support t = fixed(bar, where = z >= 40 mm)", "both ends"),
        ("10 kPa * (1 + z / 1 cm)", "0", "load t = traction(bar, where = z >= 20 mm, vector = (0, 0, 1) Pa)", "whole"),
        ("10 kPa * (1 + z / 1 cm)", "0", "analysis a = dynamic(duration = 1 s, step = 0.1 s)", "dynamic"),
    ],
)  # fmt: skip
def test_the_reference_refuses_other_bars(young: str, nu: str, more: str, reason: str) -> None:
    text = bar(young, more + "\nreference exact = graded_bar(bar)\nmetric off = max_error(end, against = exact)", nu)
    with pytest.raises(softmark.SceneError, match=reason):
        softmark.loads(text + "model m = fem(hex8, strain = small, size = 5 mm)")


@pytest.mark.long
@pytest.mark.slow
def test_steps_too_fine_for_the_integral_are_no_reference() -> None:
    """Two thousand waves along the bar: panels and QUADPACK differ, and it says so."""
    more = "model m = fem(hex8, strain = small, size = 10 mm)\nreference exact = graded_bar(bar)"
    with pytest.raises(softmark.SceneError, match="two quadratures"):
        softmark.loads(bar("10 kPa * (1.01 + sin(z / 40 mm * 12566 rad))", more)).run()


@pytest.mark.slow
def test_a_region_may_vary_too() -> None:
    """Two layers behind one another, each with E of its own along the bar: compliances add up."""
    more = """material stiff = linear_elastic(young = 50 kPa * exp(z / 40 mm), poisson = 0, density = 1000 kg/m^3)
region top = part(bar, where = z >= 20 mm, material = stiff)
model m = fem(hex20, strain = small, size = 5 mm)
model t = fem(tet4, strain = corotational, size = 2.5 mm)"""
    found = far(bar("10 kPa * (1 + z / 40 mm)", more))
    soft, stiff = math.log(1.5), math.exp(-0.5) - math.exp(-1.0)
    exact = 100.0 * 0.04 * (soft / 1e4 + stiff / 5e4)
    assert found["m"] == pytest.approx(exact, rel=1e-5)
    assert found["t"] == pytest.approx(exact, rel=5e-3)


@pytest.mark.slow
@pytest.mark.long
def test_what_a_look_misses_is_found_where_it_is_solved() -> None:
    """A dip of E between the places that are looked at, at z = 22.5 mm, and a ratio that comes to 0.5 there."""
    dip = "exp(-((z - 22.5 mm) / 1 mm)^2)"
    loaded = softmark.loads(bar(f"10 kPa * (1 - 1.5 * {dip})", "model m = fem(hex8, strain = small, size = 2.5 mm)"))
    with pytest.raises(softmark.SceneError, match="everywhere in `bar`, `young` must be greater than 0"):
        loaded.run()
    nu = f"min(0.4 + 0.2 * {dip}, 0.5)"
    loaded = softmark.loads(bar("10 kPa", "model m = fem(hex8, strain = small, size = 2.5 mm)", nu))
    with pytest.raises(softmark.SceneError, match="incompressible at some points"):
        loaded.run()
    mixed = bar("10 kPa", "model m = fem(tet10, strain = small, size = 5 mm, formulation = mixed)", nu)
    assert far(mixed)["m"] == pytest.approx(4e-4, rel=0.05)  # nu hardly matters to a bar that is pulled


@pytest.mark.slow
@pytest.mark.long
def test_a_coarse_mesh_is_said_and_its_quadrature_stated() -> None:
    text = bar("10 kPa * (1 + 9 * exp(-((z - 20 mm) / 2 mm)^2))", "model m = fem(hex8, strain = small, size = 10 mm)")
    loaded = softmark.loads(text)
    report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))
    assert "W337" in {w.code for w in report.warnings}
    said = report.models["m"].solve["graded"]["bar.young"]
    assert said["within_cells"] > 5.0
    assert said["integral_lost"] < 1e-3  # cells have points of their own
    parts = report.models["m"].stated["far"].parts
    assert parts["constants"] >= said["integral_lost"] * abs(report.models["m"].metrics["far"].value)


def test_files_for_paraview_have_the_constants(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Means over cells: of what is linear, the value in the middle."""
    monkeypatch.chdir(tmp_path)
    more = "model m = fem(hex8, strain = small, size = 5 mm)"
    Path("a.scene").write_text(bar("10 kPa * (1 + z / 40 mm)", more, rho="1000 kg/m^3 * (1 + x / 10 mm)"))
    assert main(["run", "a.scene", "--vtu", "--out", "out"]) == 0
    mesh = meshio.read("out/vtu/m.vtu")
    middle = mesh.points[mesh.cells[0].data].mean(axis=1)
    assert mesh.cell_data["young"][0] == pytest.approx(1e4 * (1.0 + middle[:, 2] / 0.04))
    assert mesh.cell_data["density"][0] == pytest.approx(1e3 * (1.0 + middle[:, 0] / 0.01))
    known = json.loads(Path("out/report.json").read_text())["models"]["m"]["solve"]["graded"]
    assert known["bar.young"]["mean"] == pytest.approx(1.5e4)


def test_weights_are_integrals_of_the_density() -> None:
    """What the support carries under gravity along the bar: A g int rho dz."""
    more = "load w = gravity(9.81 m/s^2, direction = +z)\nmodel m = fem(hex8, strain = small, size = 5 mm)"
    report = softmark.loads(bar("10 kPa", more, rho="1000 kg/m^3 * exp(z / 40 mm)")).run()
    force = report.models["m"].reactions["low"].reaction.force[2]
    assert -force == pytest.approx(1e-4 * (100.0 + 9.81 * 1000.0 * 0.04 * (math.e - 1.0)), rel=1e-6)


@pytest.mark.slow
def test_frequencies_are_those_of_a_horn() -> None:
    """The slowest frequency of a bar, stretched along its axis alone: f = c / 4 L of constant E and rho; with both
    growing alike c is the same, and so are the frequencies of a Webster horn of that form, which scipy finds."""
    from scipy.optimize import brentq

    more = """support guided = fixed(bar, where = x < 100 mm, components = (x, y))
model m = fem(hex20, strain = corotational, size = 5 mm)
metric f = frequency(bar)"""
    grow = "exp(z / 40 mm)"
    report = softmark.loads(
        bar(f"10 kPa * {grow}", more, rho=f"1000 kg/m^3 * {grow}").replace("load     up", "#")
    ).run()
    # (e^s u')' + k^2 e^s u = 0, u(0) = 0, u'(1) = 0: u = e^(-s/2) sin(b s), tan b = 2 b, b^2 = k^2 - 1/4
    b = brentq(lambda b: math.tan(b) - 2.0 * b, 1.0, 1.5)
    exact = math.sqrt(b * b + 0.25) * math.sqrt(10.0) / 0.04 / (2.0 * math.pi)
    assert report.models["m"].metrics["f"].value == pytest.approx(exact, rel=1e-4)


@pytest.mark.slow
def test_motions_keep_their_energy() -> None:
    """The midpoint rule of a bar that is let go, of which all constants vary: next to nothing is gained."""
    more = """analysis drop = dynamic(duration = 50 ms, step = 0.5 ms, integrator = midpoint)
model h = fem(hex8, strain = finite, size = 10 mm, integration = selective)
model e = fem(hex8, strain = small, size = 10 mm)
model m = fem(hex8, strain = finite, size = 10 mm, formulation = mean_dilatation)"""
    grow = "(1 + z / 40 mm)^2"
    text = bar(f"10 kPa * {grow}", more, "0.2 + 0.2 * z / 40 mm", f"1000 kg/m^3 * {grow}", "neo_hookean")
    report = softmark.loads(text.replace("(0, 0, 100) Pa", "(20, 0, 100) Pa")).run()
    for model in report.models.values():
        assert model.status == "converged", model.message
        assert abs(model.solve["energy"]["drift"]) < 1e-5, model.solve[
            "energy"
        ]  # 2.6e-6 is the worst, of finite strain


@pytest.mark.slow
def test_precision_may_be_single() -> None:
    more = "\n".join(
        f"model {n} = fem(hex8, strain = finite, size = 5 mm{m})" for n, m in (("a", ""), ("b", ", precision = single"))
    )
    found = far(bar("10 kPa * (1 + z / 40 mm)", more, law="neo_hookean", nu="0.3"))
    assert found["a"] == pytest.approx(found["b"], rel=1e-5)


@pytest.mark.slow
def test_a_scene_without_any_loads_none_of_this() -> None:
    more = "param soft = 5 kPa\nmodel m = fem(hex8, strain = finite, size = 10 mm)"
    scene = bar("2 * soft", more, law="neo_hookean")
    words = ("graded", "heterogene", "varying", "field_files", "profile", "bar_theory", "field_words")
    assert {m for m in loaded_by(scene) if any(w in m for w in words)} <= {"references.graded_bar"}


def test_energies_of_strains_take_the_moduli_of_each_point() -> None:
    """w (lam tr(E)^2 + 2 mu E : E) of the strain I, with E = 1 + z and nu of a part of its own: 9 lam + 6 mu."""
    from softmark.interpreter.metrics.energy_norm_error import _squared_energy_norm
    from softmark.interpreter.problem.body_case import case_of

    more = """material other = linear_elastic(young = 30 kPa, poisson = 0.2 + 0.1 * z / 40 mm, density = 1000 kg/m^3)
region rear = part(bar, where = z >= 20 mm, material = other)
model  m = fem(hex8, strain = small, size = 10 mm)"""
    case = case_of(softmark.loads(bar("10 kPa * (1 + z / 40 mm)", more, nu="0.25")).scene, "bar")
    X = np.array([[0.005, 0.005, 0.01], [0.005, 0.005, 0.03]])
    exact = sum(
        e / (1.0 + nu) * (9.0 * nu / (1.0 - 2.0 * nu) + 3.0) * w
        for e, nu, w in ((12.5e3, 0.25, 2.0), (30e3, 0.275, 3.0))
    )
    assert _squared_energy_norm(np.stack([np.eye(3)] * 2), np.array([2.0, 3.0]), case, X) == pytest.approx(
        exact, rel=1e-12
    )


def test_names_of_kinds_are_still_free() -> None:
    """No new reserved words: things may be called `field` and `young`."""
    text = bar("young", "param young = 10 kPa\nmodel field = fem(hex8, strain = small, size = 10 mm)")
    assert far(text)["field"] == pytest.approx(4e-4, rel=1e-9)


def test_arrays_and_coordinates_agree_with_python() -> None:
    """Everything that an expression may hold, against Python's own arithmetic at a place."""
    young = (
        "10 kPa * (1.5 + sin(x / 1 mm * 1 rad) * cos(y / 2 mm * 1 rad) / (2 + abs(z / 1 mm - 3))^1.7"
        " + min(x, y, z) / 1 m + max(x * 2, 3 mm)^2 / (1 m)^2 + sqrt(z * z) / 1 m"
        " + log(2 + z / 1 mm) - tan(x / 1 m * 1 rad))"
    )
    scene = softmark.loads(bar(young, "model m = fem(hex8, strain = small, size = 10 mm)")).scene
    profile = scene.declared["gel"].thing.young
    X = np.array([[0.001, 0.002, 0.003], [0.004, 0.001, 0.03], [0.0, 0.01, 0.0]])
    for (x, y, z), found in zip(X.tolist(), profile.values(X, None), strict=True):
        expected = 1e4 * (
            1.5 + math.sin(x / 1e-3) * math.cos(y / 2e-3) / (2 + abs(z / 1e-3 - 3)) ** 1.7 + min(x, y, z)
            + max(2 * x, 3e-3) ** 2 + abs(z) + math.log(2 + z / 1e-3) - math.tan(x)
        )  # fmt: skip
        assert found == pytest.approx(expected, rel=1e-13)
        assert profile.value((x, y, z)) == pytest.approx(expected, rel=1e-13)


def test_a_part_that_no_support_touches_may_vary() -> None:
    """Supports are looked at from the cells around them: of a part that has none of these nothing is asked."""
    more = """material other = linear_elastic(young = 30 kPa * exp(z / 40 mm), poisson = 0, density = 1000 kg/m^3)
region top = part(bar, where = z >= 20 mm, material = other)
model  m = fem(hex8, strain = small, size = 10 mm)"""
    report = softmark.loads(bar("10 kPa * (1 + z / 40 mm)", more)).run()
    assert report.models["m"].solve["checks"]["residual"] < 1e-10
    held = report.models["m"].reactions["low"].reaction
    assert held is not None
    assert held.force[2] == pytest.approx(-100.0 * 1e-4, rel=1e-9)


TUBE = """
material gel  = linear_elastic(young = {young}, poisson = {nu}, density = 1000 kg/m^3)
body     hose = solid(tube(length = 20 mm, radius = 12 mm, inner = 9 mm), gel)
support  low  = fixed(hose, where = x <= 0 mm)
load     side = gravity(1 m/s^2, direction = -z)
model    m    = fem(hex8, strain = small, size = 6 mm)
"""


@pytest.mark.long
@pytest.mark.slow
def test_what_lies_beside_the_body_does_not_count() -> None:
    """In the bore and in the corners of its box young is 1e30 Pa and more, and poisson above 0.5."""
    from softmark.interpreter.models.shared.material_regions import representative_materials
    from softmark.interpreter.problem.body_case import case_of

    r = "((y^2 + z^2) / (12 mm)^2)"
    loaded = softmark.loads(TUBE.format(young=f"10 kPa * {r}^(-20)", nu=f"0.495 * {r}"))
    case = case_of(loaded.scene, "hose")
    assert case.largest_poisson == pytest.approx(0.495)  # it was 0.3, as of a solid of which nothing is known
    assert "W301" in {w.code for w in loaded.warnings}
    (known,) = representative_materials(case, case.shape.mesh("hex8", 3e-3))
    assert 1e4 < known.young < 1e4 * (12.0 / 9.0) ** 40
    assert known.poisson == pytest.approx(0.495)


def test_cells_of_triangles_are_looked_at_within() -> None:
    """Poisson's ratio is in its range in the body alone, and a linear constant is integrated to the last digits.

    The finer rule was that of hexahedra, with points beyond the longest side of each triangle.
    """
    text = """
material gel  = linear_elastic(young = 10 kPa * (1 + x / 1 cm), poisson = 0.499 * x / 1 cm, density = 1000 kg/m^3)
body     leaf = plane_strain(quadrilateral((0, 0, 0) mm, (1, 0, 0) cm, (1, 1, 0) cm, (0, 1, 0) cm), gel,
                             thickness = 1 mm)
support  left = symmetric(leaf, where = x <= 0 mm)
support  low  = symmetric(leaf, where = y <= 0 mm)
load     pull = traction(leaf, where = x >= 1 cm, vector = (10, 0, 0) Pa)
model    a    = fem(tri3, strain = small, size = 5 mm)
model    b    = fem(tri6, strain = small, size = 5 mm)
"""
    report = softmark.loads(text).run()
    for model in report.models.values():
        assert model.status == "converged", model.message
        said = model.solve["graded"]["leaf.young"]
        assert said["integral_lost"] < 1e-12
        assert said["mean"] == pytest.approx(1.5e4)
        assert (said["least"], said["most"]) == pytest.approx((1e4, 2e4))


@pytest.mark.slow
def test_a_poisson_ratio_counts_by_what_it_does_to_moduli() -> None:
    """From 0.01 to 0.09 nothing changes; from 0.4 to 0.495 what resists a change of volume does, eighteen times."""
    model = "model m = fem(hex8, strain = small, size = 10 mm, integration = selective)"
    small, large = (softmark.loads(bar("10 kPa", model, nu)).run() for nu in (
        "0.05 + 0.04 * sin(z / 1 mm * 3.1 rad)", "0.4 + 0.095 * z / 40 mm",
    ))  # fmt: skip
    assert "W337" not in {w.code for w in small.warnings}
    assert small.models["m"].solve["graded"]["bar.poisson"]["integral_lost"] < 0.05
    assert "W337" in {w.code for w in large.warnings}
    mixed = softmark.loads(
        bar("10 kPa", "model m = fem(hex8, strain = small, size = 10 mm, formulation = mixed)", "0.4 + 0.1 * z / 4 cm")
    ).run()
    assert "W337" not in {w.code for w in mixed.warnings}  # pressures take any
    assert math.isfinite(mixed.models["m"].solve["graded"]["bar.poisson"]["within_cells"])


@pytest.mark.slow
@pytest.mark.usefixtures("ample_budget")
def test_stated_errors_know_what_files_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Constants of a file and the same ones in the text have one stated error: locking is seen in both."""
    monkeypatch.chdir(tmp_path)
    corners = np.array([[x, y, z] for z in (0.0, 40.0) for x, y in ((0, 0), (10, 0), (10, 10), (0, 10))])
    data = {"E": np.full(8, 10.0), "nu": np.full(8, 0.49)}
    meshio.Mesh(corners, [("hexahedron", np.arange(8)[None])], point_data=data).write("a.vtu")
    read = 'field("a.vtu", array = "{}", unit = {}, length = 1 mm)'
    more = """load side = gravity(1 m/s^2, direction = +x)
metric out = displacement(end, along = +x)
metric f = frequency(bar)
model m = fem(hex20, strain = small, size = 10 mm)"""
    found = []
    for young, nu in (("10 kPa", "0.49"), (read.format("E", "1 kPa"), read.format("nu", "1"))):
        loaded = softmark.loads(bar(young, more, nu))
        report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=()))
        assert "W301" in {w.code for w in report.warnings}
        found.append({n: (s.value, s.reason) for n, s in report.models["m"].stated.items()})
    for name in ("out", "f"):
        assert found[0][name][1] == found[1][name][1]
        if found[0][name][0] is not None:
            assert found[1][name][0] == pytest.approx(found[0][name][0], rel=1e-3)


@pytest.mark.parametrize("text", ["", "<VTK"])
def test_a_file_that_is_no_mesh_is_said(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library that reads meshes ends the whole process then."""
    monkeypatch.chdir(tmp_path)
    Path("a.vtu").write_text(text)
    young = 'field("a.vtu", unit = 1 kPa, length = 1 mm)'
    with pytest.raises(softmark.SceneError, match="cannot be used"):
        softmark.loads(bar(young, "model m = fem(hex8, strain = small, size = 10 mm)")).run()


def test_huge_constants_have_a_mean() -> None:
    softmark.loads(bar("1e306 Pa * exp(z / 20 mm)", "model m = fem(hex8, strain = small, size = 10 mm)"))
