"""What an element says of itself besides its shape functions, over the registry; a class and a line suffice."""

from __future__ import annotations

from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

from softmark.interpreter.models.spring_network.spring_declaration import MassSpring
from softmark.solvers.elements import CELLS, ELEMENTS, UnknownElement, element_of, finer_element
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.elements.element import Element, Facet
from softmark.solvers.elements.hex20 import Hex20
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.mesh.files.mesh_reader import convert_cells
from softmark.solvers.mesh.mesh import Mesh, jacobians
from softmark.solvers.mesh.mesh_refinement import build_finer_space
from softmark.solvers.mesh.shapes import Box

EVERY = pytest.mark.parametrize("kind", [*CELLS])
# Local points of the nodes after the corners, as VTK's code has them (vtkQuadraticHexahedron.cxx and
# vtkTriQuadraticHexahedron.cxx, its HexEdges and HexFaces), on [-1, 1]^3.
VTK_EDGES = [
    (0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1), (0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1),
    (-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0),
]  # fmt: skip
VTK_FACES = [(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1), (0, 0, 0)]


@EVERY
def test_it_says_all_that_there_is_to_say(kind: str) -> None:
    element = CELLS[kind]
    assert element.name == kind
    for protocol, one in ((Element, element), (Facet, element.facet)):
        words = {*protocol.__annotations__, *(word for word in vars(protocol) if not word.startswith("_"))}
        missing = [word for word in words if not hasattr(one, word)]
        assert missing == []
    assert FACETS[element.facet.nodes] is element.facet
    assert element.linear in CELLS
    assert finer_element(element) is element or finer_element(element).order > element.order
    assert len(element.monomials) == len(set(element.monomials)) == element.nodes == len(element.places())


@EVERY
def test_meshio_has_its_cells(kind: str) -> None:
    import meshio

    assert meshio._mesh.topological_dimension.get(CELLS[kind].meshio, 3) == 3  # it leaves wedges of 15 nodes out
    assert meshio._common.num_nodes_per_cell[CELLS[kind].meshio] == CELLS[kind].nodes


@pytest.mark.parametrize(("kind", "more"), [("hex20", VTK_EDGES), ("hex27", [*VTK_EDGES, *VTK_FACES])])
def test_nodes_of_quadratic_hexahedra_are_in_the_order_of_vtk(kind: str, more: list[tuple[int, int, int]]) -> None:
    np.testing.assert_array_equal(CELLS[kind].places()[8:], more)


def test_nodes_of_quadratic_wedges_are_in_the_order_of_vtk() -> None:
    """As vtkQuadraticWedge.cxx has the middles of its edges, on the triangle from (0, 0) to (1, 0) and (0, 1)."""
    h = 0.5
    flat = [(h, 0), (h, h), (0, h)]
    more = [*((x, y, -1) for x, y in flat), *((x, y, 1) for x, y in flat), (0, 0, 0), (1, 0, 0), (0, 1, 0)]
    np.testing.assert_array_equal(CELLS["wedge15"].places()[6:], more)


@EVERY
def test_a_mirrored_cell_is_turned_back(kind: str) -> None:
    element = CELLS[kind]
    mirrored = element.places() * [-1.0, 1.0, 1.0]
    turned = Mesh(mirrored, np.array([element.mirrored_nodes]), kind)
    assert jacobians(turned, element.quadrature()[0]).min() > 0.0
    assert turned.volumes.sum() == pytest.approx(element.volume, rel=1e-14)


@EVERY
def test_bernstein_polynomials_hold_the_determinant(kind: str) -> None:
    """Of a cell whose nodes are anywhere: from values on the lattice to values anywhere, to rounding."""
    element, rng = CELLS[kind], np.random.default_rng(0)
    if element.constant:
        return
    mesh = Mesh(element.places() + 0.3 * rng.standard_normal((element.nodes, 3)), np.arange(element.nodes)[None], kind)
    at, xi = element.lattice(element.warp), element.random_points(rng, 20)
    found = element.bernstein(element.warp, xi) @ np.linalg.solve(
        element.bernstein(element.warp, at), jacobians(mesh, at)[0]
    )
    np.testing.assert_allclose(found, jacobians(mesh, xi)[0], atol=1e-10)


@EVERY
def test_masses_are_integrated_exactly(kind: str) -> None:
    """Products of shape functions over the reference cell, against a rule of ten points along each direction."""
    element = CELLS[kind]
    t, w = np.polynomial.legendre.leggauss(10)
    a, b, c = (x.ravel() for x in np.meshgrid(t, t, t))
    weights = np.prod([x.ravel() for x in np.meshgrid(w, w, w)], axis=0)
    xi = np.stack([a, b, c], axis=1)
    if element.family == "tetrahedra":  # folded (Duffy 1982)
        a, b, c, weights = 0.5 * (a + 1), 0.5 * (b + 1), 0.5 * (c + 1), weights / 8
        xi, weights = np.stack([a, b * (1 - a), c * (1 - a) * (1 - b)], axis=1), weights * (1 - a) ** 2 * (1 - b)
    if element.family == "wedges":
        a, b, weights = 0.5 * (a + 1), 0.5 * (b + 1), weights / 4
        xi, weights = np.stack([a, b * (1 - a), c], axis=1), weights * (1 - a)
    own, v = element.mass_quadrature()
    exact = np.einsum("q,qa,qb->ab", weights, element.shape(xi), element.shape(xi))
    np.testing.assert_allclose(np.einsum("q,qa,qb->ab", v, element.shape(own), element.shape(own)), exact, atol=1e-13)


def test_networks_of_springs_are_those_that_elements_make() -> None:
    hints = get_type_hints(MassSpring, include_extras=True)["network"]
    words = get_args(get_args(hints)[0])
    assert set(words) == {kind for kind, element in ELEMENTS.items() if element.springs}


def test_an_unknown_element_is_refused_everywhere(tmp_path: Path) -> None:
    box = Box((1.0, 1.0, 1.0))
    known = box.mesh("hex8", 0.5)
    stray = Mesh(known.points, known.cells, "hex21")
    said = "there is no element `hex21`: elements are " + ", ".join(ELEMENTS)
    for asked in (
        lambda: element_of("hex21"), lambda: box.mesh("hex21", 0.5), lambda: convert_cells(known, "hex21", "five"),
        lambda: build_finer_space(stray), lambda: stray.volumes, lambda: stray.facets,
    ):  # fmt: skip
        with pytest.raises(UnknownElement) as error:
            asked()
        assert str(error.value) == said


def test_another_class_and_a_line_make_an_element(monkeypatch: pytest.MonkeyPatch) -> None:
    """A twin of `hex20` under another name is meshed, refined and checked as that, and nothing else is told."""

    class Twin(Hex20):
        """Another."""

        name, finer = "twin", "twin"

    monkeypatch.setitem(ELEMENTS, "twin", Twin)
    box = Box((2.0, 1.0, 1.0))
    mesh, usual = box.mesh("twin", 0.5), box.mesh("hex20", 0.5)
    np.testing.assert_array_equal(mesh.points, usual.points)
    assert build_finer_space(mesh).mesh.kind == "twin"
    u = 0.1 * np.random.default_rng(0).standard_normal(mesh.points.shape)
    term = (solid_forces.StressTerm(solid_forces.small_strain_stress(1.0, 1.0)),)
    forces = [
        solid_forces.CheckedBody(m.points, m.cells, m.kind, u, term, 1.0).forces(m.cells)[0] for m in (mesh, usual)
    ]
    np.testing.assert_array_equal(*forces)
