"""One material point as a model: beside finite elements in one scene, watched, and said where it does not apply."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from loaded_modules import loaded_by
from scipy.optimize import brentq

import softmark
from softmark.interpreter.models.material_point import material_point_builder
from softmark.interpreter.pipeline import run_pipeline

LAW = "neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)"
BLOCK = "body block = solid(box(size = (30, 20, 10) mm, origin = (5, -4, 3) mm), gel)\n"
ROLLERS = """support left = fixed(block, where = x <= 5 mm, components = x)
support front = fixed(block, where = y <= -4 mm, components = y)
support under = fixed(block, where = z <= 3 mm, components = z)
"""
PULL = "support grip = displaced(block, where = x >= 35 mm, by = (12, 0, 0) mm, components = x)\n"
WIDEN = "support wide = displaced(block, where = y >= 16 mm, by = (0, 8, 0) mm, components = y)\n"
LOOK = """probe tip = point(block, at = (35, 16, 13) mm)
metric ux = displacement(tip, along = +x)
metric uy = displacement(tip, along = +y)
metric uz = displacement(tip, along = +z)
metric force = force(grip, along = +x)
metric cauchy = stress(tip, component = xx)
metric nominal = stress(tip, component = xx, measure = nominal)
metric ratio = stretch(tip, component = volume)
metric energy = strain_energy(block)
"""


def run(text: str, law: str = LAW, **options: Any) -> Any:
    loaded = softmark.loads(f'softmark 1\nscene "point"\nmaterial gel = {law}\n{BLOCK}{text}')
    return run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False, **options))


STATES = {
    "uniaxial": ROLLERS + PULL,
    "equibiaxial": ROLLERS + PULL + WIDEN,
    "planar": ROLLERS + PULL + "support shut = fixed(block, where = y >= 16 mm, components = y)\n",
    "confined": ROLLERS + PULL + "support shut = fixed(block, where = y >= 16 mm or z >= 13 mm, components = (y, z))\n",
}


def same(report: Any, names: tuple[str, ...]) -> None:
    dot, cells = report.models["dot"], report.models["cells"]
    assert (dot.status, cells.status) == ("converged", "converged"), (dot.message, cells.message)
    for name in names:
        own, other = (m.metrics[name].value for m in (dot, cells))
        assert own == pytest.approx(other, rel=2e-7, abs=1e-12), name
    checks = dot.solve["checks"]
    assert checks["residual"] < 1e-8
    assert checks["reactions"]["apart"] < 1e-8
    assert max(checks["reactions"][n] for n in ("force", "moment")) <= checks["reactions"]["allowed"]


ALL = ("ux", "uy", "uz", "force", "cauchy", "nominal", "ratio", "energy")


@pytest.mark.parametrize("state", STATES)
def test_states_of_stretch_are_those_of_one_mesh(state: str) -> None:
    """Rollers leave finite elements homogeneous: their answer, to the tolerance that they are solved with, 1e-10."""
    text = STATES[state]
    if state == "confined":
        text = text.replace("(block, where = y >= 16 mm or z >= 13 mm, components = (y, z))",
                            "(block, where = y >= 16 mm, components = y)\n"
                            "support lid = fixed(block, where = z >= 13 mm, components = z)")  # fmt: skip
    report = run(f"{text}{LOOK}analysis rest = static(tolerance = 1e-10)\nmodel dot = homogeneous({state})\n"
                 "model cells = fem(hex8, strain = finite, size = 10 mm)\n")  # fmt: skip
    if state == "equibiaxial":
        assert report.models["dot"].metrics["uy"].value == pytest.approx(8e-3)
    same(report, ALL)


@pytest.mark.slow
@pytest.mark.parametrize("law", [
    "st_venant_kirchhoff(young = 60 kPa, poisson = 0.3, density = 1 kg/m^3)",
    "stable_neo_hookean(young = 60 kPa, poisson = 0.499, density = 1 kg/m^3)",
])  # fmt: skip
def test_a_force_may_pull(law: str) -> None:
    pull = "load pull = traction(block, where = x >= 35 mm, vector = (15, 0, 0) kPa)\n"
    report = run(f"{ROLLERS}{pull}{LOOK.replace('force(grip', 'force(left')}analysis rest = static(tolerance = 1e-10)\n"
                 "metric done = work(pull)\nmodel dot = homogeneous(uniaxial)\n"
                 "model cells = fem(hex8, strain = finite, size = 10 mm)\n", law)  # fmt: skip
    same(report, (*ALL, "done"))
    assert report.models["dot"].loads["pull"].force == pytest.approx((3.0, 0.0, 0.0), rel=1e-12)


def test_half_a_poisson_ratio_is_that_of_pressures() -> None:
    report = run(f"{ROLLERS}{PULL}{LOOK}analysis rest = static(tolerance = 1e-10)\nmodel dot = homogeneous(uniaxial)\n"
                 "model cells = fem(hex8, strain = finite, formulation = mixed, size = 10 mm)\n",
                 LAW.replace("0.3", "0.5"))  # fmt: skip
    same(report, ALL)


@pytest.mark.slow
@pytest.mark.parametrize("strain", ["small", "corotational"])
def test_measures_of_strain_are_those_of_finite_elements(strain: str) -> None:
    report = run(f"{ROLLERS}{PULL}{LOOK}analysis rest = static(tolerance = 1e-10)\n"
                 f"model dot = homogeneous(uniaxial, strain = {strain})\n"
                 f"model cells = fem(hex8, strain = {strain}, size = 10 mm)\n", stated=("dot",))  # fmt: skip
    same(report, ALL)
    stated = report.models["dot"].stated["force"]  # how far it is from the law of its material
    law = run(f"{ROLLERS}{PULL}{LOOK}model dot = homogeneous(uniaxial)\n").models["dot"].metrics["force"].value
    assert stated.value == pytest.approx(abs(report.models["dot"].metrics["force"].value - law), rel=1e-3)


def test_simple_shear_is_its_closed_form_in_any_direction() -> None:
    for a, b, by in (("x", "z", "(7, 0, 0)"), ("y", "z", "(0, 7, 0)"), ("z", "x", "(0, 0, 21)")):
        low, high = {"z": ("z <= 3 mm", "z >= 13 mm"), "x": ("x <= 5 mm", "x >= 35 mm")}[b]
        report = run(f"support floor = fixed(block, where = {low})\n"
                     f"support grip = displaced(block, where = {high}, by = {by} mm)\n{LOOK}"
                     f"metric slide = force(grip, along = +{a})\nmodel dot = homogeneous(simple_shear)\n")  # fmt: skip
        dot = report.models["dot"]
        area = {"z": 600e-6, "x": 200e-6}[b]
        assert dot.metrics["slide"].value == pytest.approx(60e3 / 2.6 * 0.7 * area, rel=1e-9)  # mu g A
        assert dot.solve["checks"]["residual"] < 1e-9


@pytest.mark.parametrize("shape", ["cylinder(length = 30 mm, radius = 5 mm, axis = -y)",
                                   "tube(length = 30 mm, radius = 5 mm, inner = 3 mm, axis = +y)"])  # fmt: skip
def test_round_bodies_have_the_force_of_their_section(shape: str) -> None:
    high, low = ("y >= 0 mm", "y <= -30 mm") if "-y" in shape else ("y >= 30 mm", "y <= 0 mm")
    area = np.pi * (25e-6 - (9e-6 if "tube" in shape else 0.0))
    text = f"""body rod = solid({shape}, gel)
support foot = fixed(rod, where = {low}, components = y)
support wall = fixed(rod, where = x^2 + z^2 >= 25 mm^2, components = (x, z))
support press = displaced(rod, where = {high}, by = (0, -6, 0) mm, components = y)
metric bears = force(press, along = +y)
probe tip = point(rod, at = (4, {-15 if "-y" in shape else 15}, 0) mm)
metric p = stress(tip, component = yy, measure = nominal)
model shut = homogeneous(confined, body = rod)
"""
    shut = run(text).models["shut"]
    P = (60e3 / 2.6 * (0.64 - 1) + 60e3 * 0.3 / (1.3 * 0.4) * np.log(0.8)) / 0.8
    assert shut.metrics["p"].value == pytest.approx(P, rel=1e-9)
    assert shut.metrics["bears"].value == pytest.approx(P * area, rel=1e-9)
    free = run(text.replace("support wall", "# ").replace("confined", "uniaxial")).models["shut"]
    assert free.metrics["bears"].value > shut.metrics["bears"].value


def test_a_state_that_ends_is_not_converged_and_says_where() -> None:
    law = LAW.replace("neo_hookean", "st_venant_kirchhoff").replace("0.3", "0.49")
    far = PULL.replace("(12, 0, 0)", "(30, 0, 0)")
    dot = run(f"{ROLLERS}{far}{LOOK}model dot = homogeneous(uniaxial)\n", law).models["dot"]
    assert dot.status == "not_converged"
    assert "at stretches of x 1.74" in dot.message  # sqrt(1 + 1/nu), to a thousandth of what is imposed
    press = "load pull = traction(block, where = x >= 35 mm, vector = (-15, 0, 0) kPa)\n"
    dot = run(f"{ROLLERS}{press}{LOOK.replace('force(grip', 'force(left')}model dot = homogeneous(uniaxial)\n", law)
    dot = dot.models["dot"]
    assert dot.status == "not_converged"
    assert "has its maximum" in dot.message


@pytest.mark.slow
def test_grips_that_hold_a_width_leave_no_stated_error() -> None:
    text = (ROLLERS + PULL).replace(", components = x", "").replace("components = (y, z)", "")
    text = "\n".join(line for line in text.splitlines() if "front" not in line and "under" not in line)
    report = run(f"{text}\n{LOOK}model dot = homogeneous(uniaxial)\n", stated=("dot",))
    assert "W365" in {w.code for w in report.warnings}
    stated = report.models["dot"].stated["force"]
    assert stated.value is None
    assert "W365" in stated.doubts
    wide = run(f"{text}\n{LOOK}model dot = homogeneous(planar)\n").models["dot"]  # y is wider than z
    assert wide.solve["stretches"][1] == 1.0


def test_a_watchdog_that_bites(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stress that the energy does not have is no answer."""
    point_of = material_point_builder.build_material_point

    def wrong(case: Any, strain: str) -> Any:
        point = point_of(case, strain)
        law = type("Wrong", (), {"psi": point.law.psi, "P": lambda s, F: 1.001 * point.law.P(F),
                                 "dPdF": lambda s, F: point.law.dPdF(F)})()  # fmt: skip
        return replace(point, law=law)

    monkeypatch.setattr(material_point_builder, "build_material_point", wrong)
    dot = run(f"{ROLLERS}{PULL}{LOOK}model dot = homogeneous(uniaxial)\n").models["dot"]
    assert dot.status == "failed"


def test_a_law_with_directions_beside_the_axes_has_no_such_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """The energy of fibres along (1, 1, 0) in a neo-Hookean solid, k (|F a|^2 - 1)^2: its stress has a shear."""
    point_of, a, k = material_point_builder.build_material_point, np.array([1.0, 1.0, 0.0]) / 2**0.5, 1e3

    def fibred(case: Any, strain: str) -> Any:
        own = point_of(case, strain).law

        def pull(F: Any) -> Any:
            return 4 * k * (((F @ a) ** 2).sum(axis=1) - 1)[:, None, None] * (F @ a)[:, :, None] * a

        def energy(F: Any) -> Any:
            return own.psi(F) + k * (((F @ a) ** 2).sum(axis=1) - 1) ** 2

        law = type("Fibred", (), {"psi": lambda s, F: energy(F), "P": lambda s, F: own.P(F) + pull(F),
                                  "dPdF": lambda s, F: own.dPdF(F)})()  # fmt: skip
        return replace(point_of(case, strain), law=law)

    monkeypatch.setattr(material_point_builder, "build_material_point", fibred)
    dot = run(f"{ROLLERS}{PULL}{LOOK}model dot = homogeneous(uniaxial)\n").models["dot"]
    assert dot.status == "not_converged"
    assert "oblique to the coordinate axes" in dot.message


@pytest.mark.slow
def test_a_scene_of_one_material_point_loads_no_mesh() -> None:
    names = loaded_by(f'softmark 1\nscene "dot"\nmaterial gel = {LAW}\n{BLOCK}{ROLLERS}{PULL}'
                      "metric force = force(grip, along = +x)\nmodel dot = homogeneous(uniaxial)\n")  # fmt: skip
    assert "solvers.statics.material_point" in names
    assert not {"solvers.materials.ellipticity", "interpreter.models.fem.fem_builder"} & names


def test_where_a_solid_gives_way_is_said_with_how_much_of_it() -> None:
    """Two layers spread to 4.5 times their size, of which one is of a law that gives way there; no node is free."""
    text = f"""material foam = {LAW}
region lower = part(block, where = z <= 8 mm, material = foam)
support left = fixed(block, where = x <= 5 mm, components = x)
support front = fixed(block, where = y <= -4 mm, components = y)
support flat = fixed(block, where = z <= 13 mm, components = z)
support grip = displaced(block, where = x >= 35 mm, by = (105, 0, 0) mm, components = x)
support wide = displaced(block, where = y >= 16 mm, by = (0, 70, 0) mm, components = y)
model cells = fem(hex8, strain = finite, size = 60 mm)
{LOOK}"""
    sound = LAW.replace("neo_hookean", "stable_neo_hookean")
    report = run(text, sound)
    known = report.models["cells"].solve["checks"]["gives_way"]
    assert known["share"] == pytest.approx(0.5, rel=1e-6)
    assert known["at_m"][2] < 8e-3
    assert known["stretches"] == pytest.approx([4.5, 4.5, 1.0], rel=1e-9)
    assert {w.code for w in report.warnings} >= {"W366"}
    report = run(text.replace(f"foam = {LAW}", f"foam = {sound}"), sound)
    assert "gives_way" not in report.models["cells"].solve["checks"]


@pytest.mark.slow
@pytest.mark.parametrize("how", [
    "hex8, strain = finite, formulation = mean_dilatation, size = 5 mm",
    "hex8, strain = finite, integration = selective, size = 5 mm",
    "tet10, strain = finite, formulation = mixed, size = 10 mm",
])  # fmt: skip
@pytest.mark.parametrize("nu", ["0.4999", "0.49"])
def test_what_keeps_its_volume_by_cells_gives_no_alarm(how: str, nu: str) -> None:
    """Volumes of points differ from that of their cell, and a law that keeps it takes that for a pressure."""
    law = LAW.replace("neo_hookean", "st_venant_kirchhoff").replace("0.3", nu)
    grips = (ROLLERS + PULL).replace(", components = x", "").replace("(12, 0, 0)", "(3, 0, 0)")
    cells = run(f"{grips}{LOOK}model cells = fem({how})\n", law).models["cells"]
    assert cells.status == "converged", cells.message
    assert "gives_way" not in cells.solve["checks"]


@pytest.mark.slow
@pytest.mark.parametrize(("body", "model"), [
    ("plane_strain(quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm), gel, thickness = 1 mm)",
     "quad8"),
    ("plane_stress(quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm), gel, thickness = 1 mm)",
     "quad4"),
    ("axisymmetric(quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 20, 0) mm, (0, 20, 0) mm), gel)", "quad9"),
])  # fmt: skip
@pytest.mark.parametrize("law", ["neo_hookean", "st_venant_kirchhoff"])
def test_plane_bodies_and_those_of_revolution_are_looked_at(body: str, model: str, law: str) -> None:
    """Squeezed to 0.7, which both laws bear: neither a false alarm nor a check that stops."""
    text = f"""softmark 1
scene "flat"
material gel = {LAW.replace("neo_hookean", law).replace("0.3", "0")}
body flat = {body}
support low = fixed(flat, where = y <= 0 mm)
support high = displaced(flat, where = y >= 20 mm, by = (0, -6, 0) mm)
model cells = fem({model}, strain = finite, size = 10 mm)
probe tip = point(flat, at = (20, 20, 0) mm)
"""
    loaded = softmark.loads(text)
    report = run_pipeline.run_scene(loaded.scene, list(loaded.warnings), run_pipeline.RunOptions(draw=False))
    cells = report.models["cells"]
    checks = cells.solve["checks"]
    assert checks["residual"] is not None, checks
    assert "gives_way" not in checks


@pytest.mark.slow
@pytest.mark.parametrize(("nu", "l"), [
    ("-0.9", 2.0), ("0.499999", 2.0), ("0.49999999", 2.0), ("0.4999999999", 2.0), ("0.45", 1.000000001), ("0.45", 1e-3),
    ("0.45", 1e3), ("0.5", 50.0), ("0.5", 1e-2),
])  # fmt: skip
def test_far_from_rest_and_near_half_errors_are_within_what_is_stated(nu: str, l: float) -> None:
    pull = PULL.replace("12", f"{30.0 * (l - 1.0):.17g}")
    dot = run(f"{ROLLERS}{pull}{LOOK}model dot = homogeneous(uniaxial)\n", LAW.replace("0.3", nu), stated=("dot",))
    dot = dot.models["dot"]
    mu = 60e3 / (2 * (1 + float(nu)))
    if nu == "0.5":
        P = mu * (l - l**-2)
    else:
        lam = 60e3 * float(nu) / ((1 + float(nu)) * (1 - 2 * float(nu)))
        x = brentq(lambda x: mu * math.expm1(2 * x) + lam * (math.log(l) + 2 * x), *((-20, 20) if lam > 0 else (0, 2)),
                   xtol=1e-16)  # fmt: skip
        P = (mu * (l * l - 1) - mu * math.expm1(2 * x)) / l
    assert dot.status == "converged", dot.message
    found, stated = dot.metrics["nominal"].value, dot.stated["nominal"].value
    assert abs(found - P) <= max(stated, 1e-12 * abs(P))
    assert stated < 1e-2 * abs(P)


def test_a_solid_past_its_strength_is_said_to_be_so_before_it_gives_way() -> None:
    """St Venant-Kirchhoff without a lateral strain, squeezed between walls: tau = mu s^2 (s^2 - 1) peaks at 0.707.

    Waves stand still at 0.577 alone. At 0.65 the one is lost in all of the volume, the other nowhere; at 0.8 neither.
    """
    law = LAW.replace("neo_hookean", "st_venant_kirchhoff").replace("0.3", "0")
    walls = STATES["confined"] + "model cells = fem(hex8, strain = finite, size = 60 mm)\n"
    for squeeze, lost in ((0.65, True), (0.8, False)):
        text = walls.replace("12,", f"{30.0 * (squeeze - 1.0):g},")
        report = run(text + LOOK + "model dot = homogeneous(confined)\n", law)
        checks, codes = report.models["cells"].solve["checks"], [w.code for w in report.warnings]
        assert "gives_way" not in checks
        assert "W366" not in codes
        assert codes.count("W385") == (2 if lost else 0)
        assert ("drucker" in checks) == lost
        if lost:
            assert checks["drucker"]["share"] == pytest.approx(1.0, rel=1e-9)
            (at,) = (w.message for w in report.warnings if w.code == "W385" and "`dot`" in w.message)
            assert "0.7071" in at


GENT = "gent(mu = 20 kPa, limit = 30, poisson = 0.5, density = 1000 kg/m^3)"


def test_a_law_that_ends_says_where_when_there_is_no_answer() -> None:
    """t^2 + 2/t - 3 = 30 has its largest root at t = 5.7140; a force that has no maximum is not said to have one."""
    far = PULL.replace("12", "240")
    dot = run(f"{ROLLERS}{far}{LOOK}model dot = homogeneous(uniaxial)\n", GENT).models["dot"]
    assert dot.status == "not_converged"
    assert "a stretch of 5.714" in dot.message
    heave = "load heave = traction(block, vector = (1e6, 0, 0) kPa, where = x >= 35 mm)\n"
    look = "\n".join(line for line in LOOK.split("\n") if "grip" not in line)
    dot = run(f"{ROLLERS}{heave}{look}model dot = homogeneous(uniaxial)\n", GENT).models["dot"]
    assert dot.status == "not_converged"
    assert "a stretch of 5.714" in dot.message
    assert "maximum" not in dot.message
