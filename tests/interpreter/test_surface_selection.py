"""Parts of surfaces: areas, forces and moments against closed forms, and both ways of finding them against each other.

Two ways are held against each other throughout: what solves cuts triangles and follows rays (`parts`), and the watchdog
sweeps lines (`recounted`); they share no code.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hollow_sphere_octant import octant

from softmark.grammar.diagnostic import Source
from softmark.grammar.parser import parse_expression
from softmark.interpreter.language.condition_syntax import read_condition
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.expression_evaluation import Evaluator, Quantity, SourceErrors
from softmark.interpreter.language.units import LENGTH
from softmark.interpreter.problem.surface_selection.exact_surface import select_surface
from softmark.interpreter.problem.surface_selection.facet_deviation import deviations
from softmark.interpreter.problem.surface_selection.facet_patches import ConditionOnPatches, Patches
from softmark.interpreter.problem.surface_selection.gradient_intervals import Bounds
from softmark.interpreter.problem.surface_selection.loaded_surface_part import (
    find_loaded_surface,
    settled_borders,
    split_by_sides,
)
from softmark.interpreter.validation.constructor_registry import CATALOGUE
from softmark.interpreter.verification.facet_sweep import FacetSweep
from softmark.solvers.elements import ELEMENTS, moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.external_loads import FollowerPressure
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shape import Shape
from softmark.solvers.mesh.shapes import Box, Cylinder

# facets of quadratic hexahedra are integrated in every run, selections on their meshes with the slow tests
BROAD = ("hex20", "hex27")
KINDS = pytest.mark.parametrize("kind", [pytest.param(k, marks=[pytest.mark.slow] * (k in BROAD)) for k in ELEMENTS])
BAR = Box((0.1, 0.02, 0.02), (0.0, -0.01, -0.01))
ROD = Cylinder(0.1, 0.01)
R, D = 0.012, 0.01  # a circle that is cut off by four sides, and how far these are
CUT_OFF = math.pi * R**2 - 4 * (R**2 * math.acos(D / R) - D * math.sqrt(R**2 - D**2))


def condition(text: str) -> Condition:
    node, problems = parse_expression(Source("text", text))
    assert node is not None, problems
    return read_condition(
        node, Evaluator(SourceErrors(Source("text", text), []), lambda name: Quantity(0.2, LENGTH), CATALOGUE)
    )


def swept(where: Condition, shape: Any, mesh: Mesh) -> float:
    """The area that the watchdog finds."""
    corners, total = mesh.points[mesh.facets], 0.0
    settled, settling = settled_borders(shape, mesh, where)
    for own, out in split_by_sides(shape, corners):
        which = np.flatnonzero(own)
        sweep = FacetSweep(where, corners[which], mesh.extent, out, settled[which], settling[which])
        whole, (f, xi, w), _ = sweep.whole_and_parts()
        total += forces(mesh, mesh.facets[which[whole]], mesh.facets[which[f]], xi, w)
    return total


def forces(mesh: Mesh, whole: np.ndarray, f: np.ndarray, xi: np.ndarray, w: np.ndarray) -> float:
    def push(dA: np.ndarray) -> np.ndarray:
        return np.linalg.norm(dA, axis=-1)[..., None] * np.array([1.0, 0.0, 0.0])

    found = solid_forces.surface_forces(mesh.points, whole, push) + solid_forces.part_forces(
        mesh.points, f, xi, w, push
    )
    return float(found[:, 0].sum())


@pytest.mark.slow
@pytest.mark.long
@KINDS
@pytest.mark.parametrize(
    ("text", "area"),
    [
        ("x >= 99.04 mm and x < 100 mm", 4 * 0.02 * 0.96e-3),  # counted on 8 x 8 samples it was 4 x 0.02 x 1.25e-3
        ("x >= 100 mm and z >= 2.3 mm", 0.02 * 7.7e-3),
        ("x >= 100 mm and y + 2*z >= 3.1 mm and y <= 3.3 mm", 9.01075e-5),
        ("x >= 100 mm and y^2 + z^2 <= (7 mm)^2", math.pi * 49e-6),
        ("x >= 100 mm and sqrt(y^2 + z^2) <= 12 mm", CUT_OFF),
        ("x >= 100 mm and not (sqrt(y^2 + z^2) < 12 mm)", 4e-4 - CUT_OFF),
        ("z >= 10 mm and x^2 + y^2 <= (2 mm)^2", math.pi * 2e-6),
        ("z >= 10 mm and (x - 41.3 mm)^2 + (y - 1.7 mm)^2 <= (0.5 mm)^2", math.pi * 0.25e-6),
        ("x >= 100 mm and abs(y) + abs(z) <= 5 mm", 5e-5),
        ("x >= 100 mm and (z > 4 mm or z < -4 mm) and y >= 0 mm", 2 * 6e-3 * 0.01),
    ],
)
def test_areas_on_flat_faces(kind: str, text: str, area: float) -> None:
    """Closed forms of strips and circles; far better than the 1e-8 that is promised.

    Lines are good to 3e-9 of the facets that are cut, of which the smallest circle has a sixteenth.
    """
    mesh, where = BAR.mesh(kind, 0.005), condition(text)
    found = find_loaded_surface(BAR, mesh, where)
    assert found.area == pytest.approx(area, rel=1e-10)
    assert found.remainder < 1e-9 * area  # what is left where a border meets a side: 1e-11 of the facets that are cut
    assert swept(where, BAR, mesh) == pytest.approx(area, rel=1e-8, abs=3e-9 * 2.5e-5)
    true = select_surface(BAR, where)
    assert true is not None
    assert true[0] == pytest.approx(area, rel=1e-9)


@pytest.mark.slow
@pytest.mark.long
@KINDS
def test_bands_and_segments_on_a_cylinder(kind: str) -> None:
    """Where the border runs is that of the cylinder; the area is that of inscribed facets, the shape's own is exact.

    A band of 9.7 mm around n flat strips of equal width has 2 n R sin(pi / n) of the circumference.
    """
    mesh = ROD.mesh(kind, 0.004)
    band = condition("x >= 20 mm and x <= 29.7 mm")
    found, true = find_loaded_surface(ROD, mesh, band), select_surface(ROD, band)
    assert true is not None
    assert true[0] == pytest.approx(2 * math.pi * 0.01 * 0.0097, rel=1e-12)
    n = 16
    flat = 2 * n * 0.01 * math.sin(math.pi / n) * 0.0097
    assert found.area == pytest.approx(flat, rel=1e-9) if ELEMENTS[kind].order == 1 else flat < found.area < true[0]
    assert swept(band, ROD, mesh) == pytest.approx(found.area, rel=1e-7)
    along = find_loaded_surface(ROD, mesh, condition("sqrt(y^2 + z^2) >= 9.999 mm and x > 0 mm and x < 100 mm"))
    assert along.area == pytest.approx(
        find_loaded_surface(ROD, mesh, condition("x > 0 mm and x < 100 mm")).area, rel=1e-12
    )
    assert along.remainder < 1e-14  # m^2, of the ends


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "area", "normal"),
    [
        ("x >= 100 mm and z >= 0 mm", math.pi * 5e-5, (math.pi * 5e-5, 0, 0)),
        ("z >= 0 mm and x > 0 mm and x < 100 mm", math.pi * 1e-3, (0, 0, 2e-3)),
        ("x >= 100 mm and y >= 4 mm", 1e-4 * math.acos(0.4) - 0.004 * math.sqrt(84e-6), None),
        ("x >= 10 mm and x <= 20 mm and z >= 5 mm", 1e-4 * 2 * math.acos(0.5), None),
        ("x - 50 mm <= 2*y and x >= 20 mm", 2 * math.pi * 0.01 * 0.03, None),
    ],
)
def test_the_surface_of_a_cylinder_itself(text: str, area: float, normal: tuple[float, ...] | None) -> None:
    """Segments of discs, strips of the side (z is odd around an oblique cut, so that half of it counts)."""
    true = select_surface(ROD, condition(text))
    assert true is not None
    assert true[0] == pytest.approx(area, rel=1e-8)
    if normal is not None:
        np.testing.assert_allclose(true[1], normal, atol=1e-8 * area)


def random_condition(rng: np.random.Generator) -> str:
    """Planes and circles in x and y, joined at random."""

    def one() -> str:
        a, b, c, r = rng.uniform(-1, 1, 4)
        if rng.random() < 0.5:
            return f"{a:.6f}*x + {b:.6f}*y >= {10 * c:.6f} mm"
        centre = f"(x - {50 + 40 * a:.6f} mm)^2 + (y - {8 * b:.6f} mm)^2"
        return f"sqrt({centre}) {rng.choice(['<=', '>'])} {6 + 4 * r:.6f} mm"

    joined = f" {rng.choice(['and', 'or'])} ".join(one() for _ in range(rng.integers(1, 4)))
    return f"z >= 10 mm and ({joined})"


# some kinds of cells for every change
@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "seed", [s if s in (0, 2, 4, 7) else pytest.param(s, marks=pytest.mark.slow) for s in range(12)]
)
def test_random_selections_are_those_of_samples_and_of_the_watchdog(seed: int) -> None:
    """4 million samples of the face tell its part to about 1e-4 of it; lines and rays agree to 1e-8 of it."""
    rng = np.random.default_rng(seed)
    where, kind = condition(random_condition(rng)), [*ELEMENTS][seed % len(ELEMENTS)]
    mesh, face = BAR.mesh(kind, 0.0067), 0.1 * 0.02
    x, y = np.meshgrid((np.arange(4000) + 0.5) / 4000 * 0.1, (np.arange(1000) + 0.5) / 1000 * 0.02 - 0.01)
    sampled = np.mean(where.holds(x, y, 0.01, mesh.extent)) * face
    found = find_loaded_surface(BAR, mesh, where)
    assert found.area == pytest.approx(sampled, abs=3e-4 * face)
    assert swept(where, BAR, mesh) == pytest.approx(found.area, abs=1e-8 * face)
    assert found.remainder < 1e-9 * face


@KINDS
def test_pressure_on_a_part_of_a_deformed_facet(kind: str) -> None:
    """Weights at fixed points against the part integrated itself, deformed: exact, whatever the deformation."""
    mesh, where = BAR.mesh(kind, 0.009), condition("z >= 10 mm and sqrt((x - 48 mm)^2 + y^2) <= 8.3 mm")
    found = find_loaded_surface(BAR, mesh, where)
    u = np.random.default_rng(1).uniform(-1e-3, 1e-3, mesh.points.shape)
    facets, weights = found.facets_with_weights
    assert weights is not None
    g = np.zeros(mesh.points.size)
    FollowerPressure(mesh.points, facets, 3.0, weights).add_gradient(u.ravel(), g)
    direct = solid_forces.surface_forces(mesh.points + u, found.whole, lambda dA: -3.0 * dA)
    direct += solid_forces.part_forces(mesh.points + u, found.nodes, found.xi, found.w, lambda dA: -3.0 * dA)
    np.testing.assert_allclose(-g.reshape(-1, 3), direct, atol=1e-13 * np.abs(direct).sum())
    step, h = np.random.default_rng(2).normal(size=u.size), 1e-6
    load = FollowerPressure(mesh.points, facets, 3.0, weights)
    ends = [np.zeros_like(g), np.zeros_like(g)]
    for sign, end in zip((1, -1), ends, strict=True):
        load.add_gradient(u.ravel() + sign * h * step, end)
    k = load.stencils.shape[1]
    blocks = np.zeros(load.stencils.size * k)
    load.add_hessian(u.ravel(), blocks, np.arange(blocks.size).reshape(-1, k, k))
    product = np.einsum("fij,fj->fi", blocks.reshape(-1, k, k), step[load.stencils])
    tangent = np.zeros_like(g)
    np.add.at(tangent, load.stencils, product)
    np.testing.assert_allclose(tangent, (ends[0] - ends[1]) / (2 * h), atol=1e-7 * np.abs(tangent).max())


@pytest.mark.parametrize("nodes", FACETS)
def test_fixed_points_integrate_what_a_pressure_needs(nodes: int) -> None:
    """Each polynomial is one at its own point; whole facets have the area of the reference, and its first moments."""
    places = moment_fitted_quadrature.point_positions(nodes)
    np.testing.assert_allclose(
        moment_fitted_quadrature.basis_polynomials(nodes, places), np.eye(len(places)), atol=1e-12
    )
    xi, w = FACETS[nodes].quadrature()
    np.testing.assert_allclose(
        moment_fitted_quadrature.full_facet_weights(nodes),
        w @ moment_fitted_quadrature.basis_polynomials(nodes, xi),
        atol=1e-14,
    )


@pytest.mark.parametrize(
    "text",
    [
        "x*y - z^3/x >= 2 mm^2", "sqrt(x^2 + y^2)/z < 3", "abs(x - y) + z > 1 mm", "1/(x + y) <= 3/(1 mm)",
        "(x - z)^4 > 0 mm^4",
    ],
)  # fmt: skip
def test_bounds_hold(text: str) -> None:
    """Values and slopes at random points of random triangles lie within the bounds over them."""
    rng, where = np.random.default_rng(4), condition(text)
    corners = rng.uniform(-2e-3, 2e-3, (300, 3, 3)) * rng.uniform(0.01, 1.0, (300, 1, 1))
    corners += rng.uniform(-3e-3, 3e-3, (300, 1, 3))
    patches = Patches(corners, 1.0)
    f, tri = patches.triangles
    level, place = where.borders[0].level, patches.bounds(f, tri)
    with np.errstate(all="ignore"):
        found = Bounds.of(level.at(place), place[0])
        L = rng.dirichlet((1, 1, 1), (300, 50))
        X = np.einsum("ntc,nci->nti", L, corners)
        value = level.at(tuple(np.moveaxis(X, 2, 0)))
        h = 1e-7
        sides = corners[:, [1, 2, 0]] - corners
        ends = [[level.at(tuple(np.moveaxis(X + e * h * s[:, None], 2, 0))) for e in (1, -1)]
                for s in np.moveaxis(sides, 1, 0)]  # fmt: skip
        slope = np.stack([(up - down) / (2 * h) for up, down in ends])
    slack = 1e-6 * np.nanmax(np.abs(value), axis=1, initial=1e-12)[:, None]
    assert np.all((value >= found.low[:, None] - slack) & (value <= found.high[:, None] + slack))
    near = np.abs(slope) < 1e3 * np.median(np.abs(slope))  # differences across a kink or a pole say nothing
    low, high = (bound[:, :, None] + e * 1e-4 * np.abs(slope) for bound, e in zip(found.steep, (-1, 1), strict=True))
    kink = "abs" in text
    assert kink or np.mean((slope >= low - 1e-9) & (slope <= high + 1e-9) | ~near) > 0.999


# ------------------------------------------------------------------ curved surfaces of files


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("along", [2, 4])
@KINDS
def test_selections_along_a_sphere_take_all_of_it(kind: str, along: int) -> None:
    """Nodes of a file lie on the sphere, and facets do not: 10.001 and 19.999 mm mean the inner and the outer side.

    Plane faces of the octant have strips of their own that are selected; they are not counted here.
    """
    mesh = octant(0.01, 0.02, along, along, kind)
    r = np.linalg.norm(mesh.points[mesh.facets], axis=2)
    for radius, text in ((0.01, "sqrt(x^2 + y^2 + z^2) <= 10.001 mm"), (0.02, "x^2 + y^2 + z^2 >= (19.999 mm)^2")):
        on = {tuple(row) for row in mesh.facets[(np.abs(r - radius) < 1e-9).all(axis=1)].tolist()}
        found = find_loaded_surface(Shape(), mesh, condition(text))
        assert on <= {tuple(row) for row in found.whole.tolist()}
    none = find_loaded_surface(Shape(), mesh, condition("sqrt(x^2 + y^2 + z^2) <= 9.999 mm"))
    assert not on & {tuple(row) for row in none.nodes.tolist()}
    assert none.leaning == 0.0


@KINDS
def test_borders_across_a_surface_are_not_moved(kind: str) -> None:
    """No facet is settled by a plane through a sphere, nor on flat faces by a hole between their nodes."""
    mesh = octant(0.01, 0.02, 4, 4, kind)
    r = np.linalg.norm(mesh.points[mesh.facets], axis=2)
    flat = ~((np.abs(r - 0.01) < 1e-9).all(axis=1) | (np.abs(r - 0.02) < 1e-9).all(axis=1))
    assert deviations(mesh)[~flat].min() > 0.0
    assert deviations(mesh)[flat].max() == 0.0
    for text in ("z >= 7.7 mm", "x + y - 0.3*z <= 5 mm", "(x - 12 mm)^2 + (y - 9 mm)^2 + z^2 <= (5 mm)^2"):
        mask, _ = settled_borders(Shape(), mesh, condition(text))
        assert not mask.any(), text
    box = BAR.mesh(kind, 0.009)
    mask, _ = settled_borders(Shape(), box, condition("(x - 45 mm)^2 + (y - 1 mm)^2 >= (1 mm)^2"))
    assert not mask.any()


@pytest.mark.slow
@pytest.mark.long
@KINDS
def test_cut_by_a_plane_the_sphere_has_the_area_of_its_facets(kind: str) -> None:
    """Both parts of a cut add up to the whole, and they approach Archimedes' 2 pi R h from inside."""
    mesh, texts = octant(0.01, 0.02, 4, 2, kind), ("sqrt(x^2 + y^2 + z^2) >= 19.999 mm and z {} 7.7 mm",)
    low, high = (find_loaded_surface(Shape(), mesh, condition(texts[0].format(sign))).area for sign in ("<", ">="))
    whole = find_loaded_surface(Shape(), mesh, condition("sqrt(x^2 + y^2 + z^2) >= 19.999 mm")).area
    assert low + high == pytest.approx(whole, rel=1e-7)  # whole facets that are not flat have a rule of fewer points
    assert low == pytest.approx(2 * math.pi * 0.02 * 0.0077 / 4, rel=4e-3 if ELEMENTS[kind].order == 1 else 3e-4)


def test_given_levels_say_what_points_say() -> None:
    """`Condition.given` is `holds`, of levels in place of points."""
    where = condition("not (x <= 1 mm) and (y > 0 mm or 0 mm <= z <= 3 mm) and x != y")
    X = np.random.default_rng(0).choice([-1e-3, 0.0, 1e-3, 2e-3, 3e-3, 4e-3], (3, 500))
    levels = [border.at(*X) for border in where.borders]
    np.testing.assert_array_equal(where.holds_for_levels(levels, 1.0), where.holds(*X, 1.0))


@pytest.mark.slow
def test_a_border_along_the_surface_says_what_is_open() -> None:
    """1 nm beside the axis: rounding decides where it cuts the side, and the remainder says so."""
    mesh = ROD.mesh("tet4", 0.008)
    found = find_loaded_surface(ROD, mesh, condition("sqrt((y - 1 nm)^2 + z^2) >= 10 mm"))
    assert found.remainder > 0.1 * found.area


def test_nothing_extra_is_asked_of_whole_facets() -> None:
    """A load on a whole face has no points but those of its facets' own rule."""
    mesh = BAR.mesh("tet10", 0.005)
    found = find_loaded_surface(BAR, mesh, condition("x >= 100 mm"))
    assert (len(found.nodes), found.facets_with_weights[1]) == (0, None)
    asked = ConditionOnPatches.of(condition("x >= 100 mm"), Patches(mesh.points[mesh.facets], mesh.extent))
    assert not len(asked.crossed_facets())
