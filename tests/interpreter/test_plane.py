"""Plane strain and plane stress in scenes: against programs of plane elements, and against closed forms."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from flat_cells import skfem_element, skfem_mesh
from loaded_modules import loaded_by

import softmark
from softmark.interpreter.results.run_report import ModelResult
from softmark.solvers.mesh.plane_regions import Quadrilateral, Slice

CORNERS = "(0, 0, 0) mm, (48, 44, 0) mm, (48, 60, 0) mm, (0, 44, 0) mm"
PANEL = Slice(Quadrilateral((0.0, 0.0, 0.0), (0.048, 0.044, 0.0), (0.048, 0.06, 0.0), (0.0, 0.044, 0.0)), 0.003)
E, NU, PULL, THICK = 1e6, 0.3, 1e4, 3e-3
SCENE = f"""
material gel   = neo_hookean(young = 1 MPa, poisson = {NU}, density = 1000 kg/m^3)
body     panel = KIND(quadrilateral({CORNERS}), gel, thickness = 3 mm)
support  wall  = fixed(panel, where = x <= 0 mm)
load     shear = traction(panel, where = x >= 48 mm, vector = (0, 10, 0) kPa)
probe    tip   = point(panel, at = (48, 52, 0) mm)
metric   rise  = displacement(tip, along = +y)
"""


def solved(text: str, kind: str = "plane_strain") -> softmark.Report:
    """The report of the scene with more in it."""
    return softmark.loads(SCENE.replace("KIND", kind) + text).run()


def nodes(model: ModelResult) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the lower layer (n, 2), m, and their displacements (n, 2), m; those of other layers are the same."""
    assert model.status == "converged", model.message
    mesh: Any = model.mesh
    X, u = mesh.mesh.points, mesh.displacement
    lower = np.flatnonzero(X[:, 2] < -0.4 * THICK)
    assert not u[:, 2].any()
    for layer in np.unique(X[:, 2]):
        own = np.flatnonzero(np.abs(X[:, 2] - layer) < 1e-9)
        places = [np.flatnonzero(np.linalg.norm(X[lower, :2] - x, axis=1) < 1e-9)[0] for x in X[own, :2]]
        # a time step is solved to 1e-8 of its forces, and what is left need not be the same through the thickness
        assert u[own] == pytest.approx(u[lower][places], rel=0, abs=1e-8 * np.abs(u).max())
    return X[lower, :2], u[lower, :2]


def by_skfem(element: str, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and displacements of linear plane elasticity on the same cells, by scikit-fem."""
    import skfem
    from skfem.helpers import ddot, sym_grad, trace
    from skfem.models.elasticity import lame_parameters

    mesh = skfem_mesh(PANEL, element, 0.008)
    order = {"quad4": 3, "tri3": 1, "tri6": 2}.get(element, 5)  # more would be another integral on trapezia
    basis = skfem.Basis(mesh, skfem_element(element), intorder=order)
    lam, mu = lame_parameters(E, NU)
    lam = 2 * lam * mu / (lam + 2 * mu) if kind == "plane_stress" else lam

    @skfem.BilinearForm
    def stiffness(u: Any, v: Any, w: Any) -> Any:
        return 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * trace(sym_grad(u)) * trace(sym_grad(v))

    @skfem.LinearForm
    def pull(v: Any, w: Any) -> Any:
        return PULL * v[1]

    right = mesh.facets_satisfying(lambda x: x[0] > 0.048 - 1e-9)
    f = pull.assemble(skfem.FacetBasis(mesh, basis.elem, facets=right, intorder=5))
    wall = basis.get_dofs(lambda x: x[0] < 1e-9)
    u = skfem.solve(*skfem.condense(stiffness.assemble(basis), f, D=wall))
    return basis.doflocs[:, 0::2].T, np.stack([u[0::2], u[1::2]], axis=1)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("kind", ["plane_strain", "plane_stress"])
@pytest.mark.parametrize("element", ["quad4", "quad8", "quad9", "tri3", "tri6"])
def test_linear_answers_are_those_of_scikit_fem(element: str, kind: str) -> None:
    """Node by node to 1e-8 of the largest: both solve the same equations, to residuals far below."""
    model = solved(f"model own = fem({element}, strain = small, size = 8 mm)", kind).models["own"]
    X, u = nodes(model)
    theirs, known = by_skfem(element, kind)
    assert len(theirs) == len(X)
    for x, value in zip(X, u, strict=True):
        nearest = np.linalg.norm(theirs - x, axis=1).argmin()
        assert known[nearest] == pytest.approx(value, rel=0, abs=1e-8 * np.abs(u).max())


def by_felupe(law: Any, element: str) -> np.ndarray:
    """Displacements (n, 2) of linear cells in plane strain, by FElupe."""
    import felupe

    made, few = PANEL.mesh(element, 0.008), element == "tri3"
    points = made.points[made.points[:, 2] < 0, :2]
    mesh = felupe.Mesh(points, made.cells[:, : 3 if few else 4], "triangle" if few else "quad")
    region = felupe.RegionTriangle if few else felupe.RegionQuad
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        field = felupe.FieldContainer([felupe.FieldPlaneStrain(region(mesh), dim=2)])
        clamp = {"wall": felupe.Boundary(field[0], fx=0.0)}
        dof0, dof1 = felupe.dof.partition(field, clamp)
        right = np.flatnonzero(mesh.points[:, 0] > 0.048 - 1e-9)
        share = np.ones(len(right))
        ends = np.argsort(mesh.points[right, 1])[[0, -1]]
        share[ends] = 0.5
        force = np.outer(share / share.sum(), [0.0, PULL * 0.016])
        load = felupe.PointLoad(field, right, values=force)
        felupe.newtonraphson(items=[felupe.SolidBody(law, field), load], x0=field, dof0=dof0, dof1=dof1,
                             ext0=felupe.dof.apply(field, clamp, dof0), tol=1e-11, verbose=0)  # fmt: skip
    found: np.ndarray = field[0].values
    return found


@pytest.mark.slow
@pytest.mark.parametrize("element", ["quad4", "tri3"])
def test_rubber_in_plane_strain_is_that_of_felupe(element: str) -> None:
    """The same law, cells and load (linear sides: a trapezoidal rule is exact); node by node to 1e-8."""
    import felupe

    mu, lam = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    model = solved(f"model own = fem({element}, strain = finite, size = 8 mm)").models["own"]
    _, u = nodes(model)
    known = by_felupe(felupe.NeoHookeCompressible(mu=mu, lmbda=lam), element)
    assert known == pytest.approx(u, rel=0, abs=1e-8 * np.abs(u).max())


STRIP = """
material gel   = LAW(young = 1 MPa, poisson = 0.4, density = 1000 kg/m^3)
body     strip = KIND(quadrilateral((0, 0, 0) mm, (20, 0, 0) mm, (20, 10, 0) mm, (0, 10, 0) mm), gel, thickness = 2 mm)
support  left  = symmetric(strip, where = x <= 0 mm)
support  below = symmetric(strip, where = y <= 0 mm)
support  pull  = displaced(strip, where = x >= 20 mm, by = (8, 0, 0) mm, components = x)
model    own   = fem(quad4, strain = finite, size = 5 mm)
probe    end   = point(strip, at = (20, 10, 0) mm)
metric   side  = displacement(end, along = +y)
metric   grip  = force(pull, along = +x)
metric   thin  = stretch(end, component = z)
metric   sxx   = stress(end, component = xx)
metric   szz   = stress(end, component = zz)
metric   saved = strain_energy(strip)
"""


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("law", ["neo_hookean", "neo_hookean_isochoric", "stable_neo_hookean", "st_venant_kirchhoff"])
def test_a_pulled_strip_in_plane_stress(law: str) -> None:
    """At stretch 1.4 as narrow as thin, and force, stress and energy those of a bar, by root finding and the law."""
    from scipy.optimize import brentq

    from softmark.solvers.materials import MATERIALS

    solid: Any = MATERIALS[law](1e6, 0.4, 1000.0).finite_law()
    narrow = brentq(lambda s: float(solid.P(np.diag([1.4, s, s])[None])[0, 1, 1]), 0.5, 1.0, xtol=1e-14)
    F = np.diag([1.4, narrow, narrow])[None]
    P = float(solid.P(F)[0, 0, 0])
    report = softmark.loads(STRIP.replace("KIND", "plane_stress").replace("LAW", law)).run()
    found = {name: m.value for name, m in report.models["own"].metrics.items()}
    assert found["side"] == pytest.approx(0.01 * (narrow - 1), rel=1e-7)
    assert found["thin"] == pytest.approx(narrow, rel=1e-7)
    assert found["grip"] == pytest.approx(P * 0.01 * 0.002, rel=1e-7)
    assert found["sxx"] == pytest.approx(P / narrow**2, rel=1e-7)
    assert found["szz"] == pytest.approx(0.0, abs=1e-6 * P)
    assert found["saved"] == pytest.approx(float(solid.psi(F)[0]) * 0.02 * 0.01 * 0.002, rel=1e-7)
    checks = report.models["own"].solve["checks"]
    assert checks["residual"] < 1e-8
    assert checks["reactions"]["apart"] < 1e-8


def test_a_pulled_strip_in_plane_strain() -> None:
    """The same between planes that let nothing through: F33 = 1, and a stress that keeps it so."""
    from scipy.optimize import brentq

    from softmark.solvers.materials import MATERIALS

    solid: Any = MATERIALS["neo_hookean"](1e6, 0.4, 1000.0).finite_law()
    narrow = brentq(lambda s: float(solid.P(np.diag([1.4, s, 1.0])[None])[0, 1, 1]), 0.5, 1.0, xtol=1e-14)
    P = solid.P(np.diag([1.4, narrow, 1.0])[None])[0]
    report = softmark.loads(STRIP.replace("KIND", "plane_strain").replace("LAW", "neo_hookean")).run()
    found = {name: m.value for name, m in report.models["own"].metrics.items()}
    assert found["side"] == pytest.approx(0.01 * (narrow - 1), rel=1e-7)
    assert found["thin"] == pytest.approx(1.0, abs=1e-12)
    assert found["grip"] == pytest.approx(P[0, 0] * 0.01 * 0.002, rel=1e-7)
    assert found["szz"] == pytest.approx(P[2, 2] / (1.4 * narrow), rel=1e-7)


@pytest.mark.parametrize("element", ["quad4", "quad9"])
def test_stress_does_not_know_the_thickness(element: str) -> None:
    """From a tenth of a cell to a hundred cells: recovered in the plane, whatever lies before or behind."""
    text = f"model own = fem({element}, strain = small, size = 8 mm)\nmetric held = stress(tip, component = zz)"
    found = []
    for thick in ("1 mm", "1 m"):
        scene = (SCENE + text).replace("KIND", "plane_strain").replace("thickness = 3 mm", f"thickness = {thick}")
        metrics = softmark.loads(scene).run().models["own"].metrics
        found.append([metrics[name].value for name in ("rise", "held")])
    assert found[0] == pytest.approx(found[1], rel=1e-7)


@pytest.mark.slow
def test_forces_are_those_of_the_thickness_and_nothing_else_is() -> None:
    """Twice as thick with the same traction moves as far, and carries twice as much."""
    text = "model own = fem(quad8, strain = finite, size = 16 mm)\nmetric held = force(wall, along = -y)"
    one = solved(text).models["own"].metrics
    both = softmark.loads(
        (SCENE + text).replace("KIND", "plane_strain").replace("thickness = 3 mm", "thickness = 6 mm")
    ).run()
    two = both.models["own"].metrics
    assert two["rise"].value == pytest.approx(one["rise"].value, rel=1e-8)
    assert two["held"].value == pytest.approx(2.0 * one["held"].value, rel=1e-8)
    assert one["held"].value == pytest.approx(PULL * 0.016 * THICK, rel=1e-8)
    assert list(both.models["own"].reactions) == ["wall"]  # the plane is nobody's support


@pytest.mark.parametrize(
    "model",
    [
        "quad4",
        pytest.param("tri6", marks=pytest.mark.slow),
        pytest.param("tri3, mass = lumped", marks=pytest.mark.slow),
        pytest.param("tri3, mass = uniform", marks=pytest.mark.slow),
    ],
)
def test_a_motion_stays_in_the_plane(model: str) -> None:
    """Dynamics of a slice: the same through the thickness, and its mean is where it rests (undamped, one period)."""
    text = f"""
    analysis swing = dynamic(duration = 20 ms, step = 1 ms)
    model own = fem({model}, strain = finite, size = 8 mm)
    """
    X, u = nodes(solved(text).models["own"])
    assert np.abs(u).max() > 1e-5
    assert len(X) == len(u)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "kind"),
    [
        ("quad9, strain = finite", "plane_strain"),
        ("quad4, strain = small", "plane_stress"),
        ("tri3, strain = corotational", "plane_strain"),
        ("tri6, strain = finite", "plane_stress"),
    ],
)
def test_a_stated_error_holds_the_true_one(model: str, kind: str) -> None:
    """True: away from finite strain on cells of 4 mm; that of `rise` at 10 kPa bends by some degrees."""
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.pipeline.run_pipeline import CheckedScene, run_to_report

    text = f"model own = fem({model}, size = 8 mm)\nmodel fine = fem(quad9, strain = finite, size = 4 mm)"
    scene = softmark.loads(SCENE.replace("KIND", kind) + text)
    report = run_to_report(CheckedScene(scene.scene, scene.warnings), RunOptions(draw=False, stated=("own",)))
    own, fine = (report.models[n].metrics["rise"].value for n in ("own", "fine"))
    said = report.models["own"].stated["rise"]
    assert own is not None
    assert fine is not None
    assert said.value is not None, said.reason
    assert abs(own - fine) <= said.value


def test_walks_along_elements_stay_with_those_of_the_body() -> None:
    """Others would be refused at every step; a solid's are asserted in test_stress_quantities."""
    from softmark.interpreter.planning.varied_quantities import quantity_of

    text = SCENE.replace("KIND", "plane_strain") + "model own = fem(quad4, strain = small, size = 16 mm)"
    assert quantity_of(softmark.loads(text).scene, "own.element").options == (
        "quad4", "quad8", "quad9", "tri3", "tri6",
    )  # fmt: skip


def test_a_page_shows_the_plane() -> None:
    """x to the right, y upward, whatever gravity says; a solid beside it is seen as solids are."""
    from softmark.interpreter.report.run.report_summary import ReportSummary
    from softmark.interpreter.report.view3d.still_picture import axes_of
    from softmark.interpreter.report.view3d.view_camera import view_of

    report = solved("model own = fem(quad4, strain = small, size = 16 mm)")
    shapes = [m.shape for m in report.models.values() if m.shape is not None]
    assert axes_of(view_of(ReportSummary(report), shapes)) == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.slow
def test_solids_load_nothing_of_plates() -> None:
    """A scene of a solid builds nothing of plane problems, and loads no law of plates."""
    scene = """
material gel  = neo_hookean(young = 60 kPa, poisson = 0.4, density = 1000 kg/m^3)
body     beam = solid(box(size = (40, 10, 10) mm), gel)
support  wall = fixed(beam, where = x <= 0 mm)
load     weight = gravity(9.81 m/s^2)
model    own  = fem(hex8, strain = small, size = 5 mm)
probe    tip  = point(beam, at = (40, 5, 5) mm)
metric   sag  = displacement(tip, along = -z)
"""
    assert "solvers.materials.plane_stress" not in loaded_by(scene)


@pytest.mark.parametrize("element", ["quad4", "quad8", "quad9", "tri3", "tri6"])
def test_a_point_force_is_one_of_the_plane(element: str) -> None:
    """Every layer moves as the others (asserted in `nodes`), and the force is counted again by another rule.

    Put at z = 0 alone it pulled the middle of the slice 1.7e-3 (quad9) and 3.1e-4 (quad8) of the largest motion away.
    """
    report = solved(f"""load push = point_force(panel, at = (48, 60, 0) mm, vector = (0, 3, 0) mN)
                    model own = fem({element}, strain = small, size = 8 mm)""")
    nodes(report.models["own"])
    assert report.models["own"].loads["push"].force == pytest.approx((0.0, 3e-3, 0.0), rel=0, abs=1e-15)


@pytest.mark.parametrize("element", ["quad4", "tri6"])
def test_where_stress_has_no_limit_is_said_of_plane_bodies_too(element: str) -> None:
    """At the end of a clamp and where two materials end on the edge; not along the clamp, nor along their border.

    All points of a plane body are held along z: that had hidden it.
    """
    report = softmark.loads(f"""
material gel  = linear_elastic(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
material iron = linear_elastic(young = 9 MPa, poisson = 0.3, density = 1000 kg/m^3)
shape    area = quadrilateral((0, 0, 0) mm, (48, 0, 0) mm, (48, 16, 0) mm, (0, 16, 0) mm)
body     bar  = plane_strain(area, gel, thickness = 1 m)
region   far  = part(bar, where = x >= 24 mm, material = iron)
support  wall = fixed(bar, where = x <= 0 mm)
load     pull = traction(bar, where = x >= 48 mm, vector = (100, 0, 0) Pa)
model    own  = fem({element}, strain = small, size = 4 mm)
probe    rim  = point(bar, at = (0, 16, 0) mm)
probe    mid  = point(bar, at = (0, 8, 0) mm)
probe    end  = point(bar, at = (24, 0, 0) mm)
probe    seam = point(bar, at = (24, 8, 0) mm)
metric   s_rim  = stress(rim, component = xx)
metric   s_mid  = stress(mid, component = xx)
metric   s_end  = stress(end, component = xx)
metric   s_seam = stress(seam, component = xx)
""").run()
    said = [w.message for w in report.warnings if w.code == "W388"]
    assert [next(m for m in ("rim", "mid", "end", "seam") if f"`s_{m}`" in text) for text in said] == ["rim", "end"]
