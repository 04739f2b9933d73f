"""Export of a deck for PolyFEM (.json, json-specs/input-spec.json of 2024 and later), never run in PolyFEM here.

Units are SI. Cells are linear tetrahedra or straight quadratic ones. The mesh file has only corners, as in
`exporters/gmsh_exporter.py`, with materials as volumes, and `discr_order` creates the mid-edge nodes. Surfaces are
selected by spheres around the centres of facets, with one number for each set of conditions. Imposed displacements
apply to whole facets. Loads are a body force on all materials and tractions on whole facets. The body force is written
to `rhs`, which PolyFEM subtracts, so that gravity g is written as -g. A pressure at small strain, which keeps its
direction, is written as the traction of each facet, because `pressure_boundary` follows the body. Loads are identified
from their nodal forces, and refused if these are of neither kind.
Source: PolyFEM's JSON specification, and docs/tutorials/getting_started.md; laws as in LinearElasticity.cpp,
SaintVenantElasticity.cpp and NeoHookeanElasticity.cpp.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.external.adapters import PROGRAMS
from softmark.interpreter.models.external.exporters import gmsh_exporter
from softmark.records import dataclass
from softmark.solvers.elements.tet10 import EDGES
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import Floats, Ints, Problem

FILE = "model.json"
ANSWER, STATISTICS = "answer.vtu", "statistics.json"
LAWS = {"linear_elastic": "LinearElasticity", "neo_hookean": "NeoHookean", "st_venant_kirchhoff": "SaintVenant"}
ORDERS = {"tet4": 1, "tet10": 2}
SAME = 1e-9  # relative to the largest: tolerance of forces and positions


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return features of a problem that PolyFEM does not have, or defines differently."""
    if problem.element not in ORDERS:
        return [(problem.element, f"its quadrature may differ; tested elements are {', '.join(ORDERS)}")]
    found = []
    if (why := PROGRAMS["polyfem"].save.get((problem.element, problem.strain))) is not None:
        found.append((f"{problem.element} at {problem.strain} strain", why))
    if problem.element == "tet10" and not _has_straight_edges(problem):
        found.append(("curved edges", "its mesh is defined by corner nodes only"))
    if len(problem.shares) > 1:
        found.append(("several states", "its loads are those of one state"))
    for stuff in problem.stuff:
        if stuff.law not in LAWS:
            found.append((stuff.law, f"of the laws of softmark it has {', '.join(LAWS)}"))
    if _whole_facet_displacements(problem, _boundary_facets(problem)) is None:
        found.append(("the supports", "it holds whole facets only, with one displacement for each"))
    return found


def unsupported_loads(problem: Problem, named: NamedParts) -> list[tuple[str, str]]:
    """Return loads that are neither a force on the whole body nor a traction on whole facets."""
    facets = _boundary_facets(problem)
    why = "its forces act on the whole body, or as uniform tractions or pressures on whole facets"
    acting = {name: _convert_load(problem, named, name, facets) for name in named.loads}
    found = [(f"load `{name}`", why) for name, own in acting.items() if own is None]
    told = sum(named.loads.values(), np.zeros_like(problem.points))
    return found if found or _are_nearly_equal(told, problem.forces) else [("the loads", why)]


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the mesh and the PolyFEM deck into a folder, and return the names of the written files."""
    corners, names = _reduce_to_corner_nodes(problem, named)
    mesh = gmsh_exporter.export(corners, names, folder)
    text = json.dumps(deck(problem, named), indent=1)
    (folder / FILE).write_text(text + "\n", encoding="ascii")
    return [FILE, *mesh]


def deck(problem: Problem, named: NamedParts) -> dict[str, Any]:
    """Return the deck of a problem whose features and loads are all supported."""
    facets = _boundary_facets(problem)
    held = _whole_facet_displacements(problem, facets)
    assert held is not None
    body, tractions = np.zeros(3), np.zeros((len(facets), 3))
    for name in named.loads:
        own = _convert_load(problem, named, name, facets)
        assert own is not None
        body, tractions = body + own.body, tractions + own.tractions
    most = np.abs(tractions).max(initial=np.finfo(float).tiny)
    tractions = np.round(tractions / most, 12) * most + 0.0  # nearly equal conditions count as one
    kinds = np.concatenate([np.nan_to_num(held, nan=np.inf), tractions], axis=1)
    which, numbers = np.unique(kinds, axis=0, return_inverse=True)
    numbers = numbers.reshape(-1) + 1
    plain = (np.isinf(which[:, :3]) & (which[:, 3:] == 0.0)).all(axis=1)
    acted = {number: own for number, own in enumerate(which.tolist(), start=1) if not plain[number - 1]}
    return {
        "units": {"length": "m", "mass": "kg", "time": "s"},
        "geometry": [_geometry_entry(problem, facets, numbers, acted)],
        "materials": [_material(i, problem) for i in range(len(problem.stuff))],
        "space": {"discr_order": ORDERS[problem.element]},
        "boundary_conditions": _conditions(body, acted),
        "output": {"json": STATISTICS, "paraview": {"file_name": ANSWER}},
    }


def _conditions(body: Floats, acted: Mapping[int, list[float]]) -> dict[str, Any]:
    """Return the boundary conditions of numbered facet sets: imposed displacements and tractions.

    `acted` has, by number of the set, three displacements, m (inf where free), and three tractions, Pa. `body` is
    the acceleration of the body force.
    """
    dirichlet, neumann = [], []
    for number, own in acted.items():
        dimension = [bool(np.isfinite(value)) for value in own[:3]]
        if any(dimension):
            values = [value if held else 0.0 for value, held in zip(own[:3], dimension, strict=True)]
            dirichlet.append({"id": number, "value": values, "dimension": dimension})
        if any(own[3:]):
            neumann.append({"id": number, "value": own[3:]})
    found: dict[str, Any] = {"rhs": (0.0 - body).tolist()} if body.any() else {}
    return (
        found
        | ({"dirichlet_boundary": dirichlet} if dirichlet else {})
        | ({"neumann_boundary": neumann} if neumann else {})
    )


def _geometry_entry(problem: Problem, facets: Ints, numbers: Ints, acted: Mapping[int, Any]) -> dict[str, Any]:
    """Return the mesh with its volumes, and a sphere around the centre of each selected facet to number it."""
    X = problem.points[facets[:, :3]]
    middles, short = X.mean(axis=1), np.linalg.norm(X - np.roll(X, 1, axis=1), axis=2).min(axis=1)
    spheres = [{"id": number, "center": middle, "radius": 1e-3 * edge}
               for number, middle, edge in zip(numbers.tolist(), middles.tolist(), short.tolist(), strict=True)
               if number in acted]  # fmt: skip
    return {"mesh": gmsh_exporter.FILE, "volume_selection": {"id_offset": 0}, "surface_selection": spheres}


def _material(index: int, problem: Problem) -> dict[str, Any]:
    """Return the deck entry of the material with index `index` in a problem."""
    stuff = problem.stuff[index]
    return {"id": index + 1, "type": LAWS[stuff.law], "E": stuff.constants["young"], "nu": stuff.constants["poisson"],
            "rho": stuff.density or 0.0}  # fmt: skip


# ------------------------------------------------------------------ what is meant


@dataclass(frozen=True)
class BodyAndFacetLoad:
    """Load as an acceleration `body` (3,), m/s^2, of the whole body and `tractions` on facets (f, 3), Pa."""

    body: Floats
    tractions: Floats


def _convert_load(problem: Problem, named: NamedParts, name: str, facets: Ints) -> BodyAndFacetLoad | None:
    """Return the load `name` as a body force or facet tractions; None if its nodal forces are of neither kind."""
    F, none = named.loads[name], BodyAndFacetLoad(np.zeros(3), np.zeros((len(facets), 3)))
    if not F.any():
        return none
    if name not in named.facets:
        w = _body_force_masses(problem)
        a = F.sum(axis=0) / w.sum() if w.sum() else np.zeros(3)
        return replace(none, body=a) if _are_nearly_equal(w[:, None] * a, F) else None
    touched = {tuple(sorted(own)) for own in named.facets[name][:, :3].tolist()}
    on = np.array([tuple(sorted(own)) in touched for own in facets[:, :3].tolist()])
    areas = _areas(problem, facets) * on[:, None]
    uniform = np.where(on[:, None], F.sum(axis=0) / np.linalg.norm(areas, axis=1).sum(), 0.0)
    whole = _uniform_facet_forces(problem, facets, areas)
    pressed = areas / np.maximum(np.linalg.norm(areas, axis=1), np.finfo(float).tiny)[:, None]
    for tractions in (uniform, float((F * whole).sum() / (whole * whole).sum()) * pressed):
        if _are_nearly_equal(
            _uniform_facet_forces(problem, facets, tractions * np.linalg.norm(areas, axis=1)[:, None]), F
        ):
            return replace(none, tractions=tractions)
    return None


def _are_nearly_equal(one: Floats, other: Floats) -> bool:
    """Return whether two arrays are equal up to rounding."""
    return bool(np.abs(one - other).max(initial=0.0) <= SAME * np.abs(other).max(initial=0.0))


def _body_force_masses(problem: Problem) -> Floats:
    """Return the mass (n,), kg, by which each node takes part in a body force.

    A linear shape function has 1/4 of the mass of a cell; a quadratic one has -1/20 at a corner and 1/5 at a
    mid-edge node.
    """
    found, corners = np.zeros(len(problem.points)), Mesh(problem.points, problem.cells[:, :4])
    shares = np.full(4, 0.25) if problem.element == "tet4" else np.array([-0.05] * 4 + [0.2] * 6)
    for stuff in problem.stuff:
        masses = (stuff.density or 0.0) * corners.volumes[stuff.cells]
        np.add.at(found, problem.cells[stuff.cells], masses[:, None] * shares)
    return found


def _uniform_facet_forces(problem: Problem, facets: Ints, forces: Floats) -> Floats:
    """Return the nodal forces (n, 3), N, of uniformly distributed forces on facets (f, 3), N.

    A third of the force acts at each corner of a linear facet, or at each mid-edge node of a quadratic one.
    """
    found, own = np.zeros_like(problem.points), facets[:, -3:]
    np.add.at(found, own, forces[:, None, :] / 3.0)
    return found


def _areas(problem: Problem, facets: Ints) -> Floats:
    """Return the outward area vectors (f, 3), m^2, of facets."""
    X = problem.points[facets[:, :3]]
    found: Floats = 0.5 * np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    return found


def _boundary_facets(problem: Problem) -> Ints:
    """Return the nodes of the boundary facets (f, 3) or (f, 6), oriented outwards."""
    return Mesh(problem.points, problem.cells, problem.element).facets


def _whole_facet_displacements(problem: Problem, facets: Ints) -> Floats | None:
    """Return the imposed displacements of whole facets (f, 3), m, NaN where free.

    The result is None if a support holds nodes that are not whole facets, or displaces a facet unevenly.
    """
    values = np.full(problem.points.shape, np.nan)
    values[tuple(problem.held.T)] = problem.values
    on = values[facets]
    found = np.where((on == on[:, :1]).all(axis=1), on[:, 0], np.nan)  # NaN is never equal
    covered = np.zeros(values.shape, dtype=np.bool_)
    for own, held in zip(facets, np.isfinite(found), strict=True):
        covered[own] |= held
    return found if np.array_equal(covered, np.isfinite(values)) else None


def _has_straight_edges(problem: Problem) -> bool:
    """Return whether all edges are straight, with mid-edge nodes in the middle."""
    X = problem.points[problem.cells]
    return _are_nearly_equal(X[:, np.array(EDGES)].mean(axis=2), X[:, 4:])


def _reduce_to_corner_nodes(problem: Problem, named: NamedParts) -> tuple[Problem, NamedParts]:
    """Return the problem and its named parts with only corner nodes, renumbered."""
    used, cells = np.unique(problem.cells[:, :4], return_inverse=True)
    number = np.full(len(problem.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    facets = {name: number[own[:, :3]] for name, own in named.facets.items()}
    supports = {name: number[np.intersect1d(own, used)] for name, own in named.supports.items()}
    mesh = replace(problem, points=problem.points[used], cells=cells.reshape(-1, 4).astype(np.int64), element="tet4")
    return mesh, replace(named, facets=facets, supports=supports)
