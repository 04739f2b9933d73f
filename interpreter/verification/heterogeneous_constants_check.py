"""Independent check of material constants that vary in space.

Constants from images are read by other code than the solver's, and cell integrals are compared with adaptive
quadrature.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.models.shared.material_regions import mesh_of_cells
from softmark.interpreter.models.shared.prepared_model import DeformedMesh
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.field_files import Image, load_field, read_field
from softmark.interpreter.verification.cell_materials_check import split_by_material
from softmark.interpreter.vocabulary.field_words import Field
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.solid_forces import Floats

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest

LOOKED = 32  # points of each look-up at which arithmetic on arrays is done again, one by one
AGREE = 1e-12


def read_field_again(field: Field, X: Floats) -> Floats:
    """Return the values of a field at points X (n, 3), m; images are interpolated by linear splines of scipy."""
    known = load_field(field)
    if not isinstance(known, Image):
        return read_field(field, X)
    at = np.linalg.inv(np.linalg.inv(known.inverse)) @ (X - known.centre).T
    found: Floats = field.unit.value * ndimage.map_coordinates(known.numbers, at, order=1, mode="nearest")
    return found


def constant_values(constant: Any, X: Floats) -> Floats:
    """Return the values (n,) of a material constant at points X (n, 3), m.

    Raises ValueError if evaluation of all points at once differs from evaluation point by point.
    """
    if not isinstance(constant, Profile):
        return np.full(len(X), float(constant))
    found: Floats = constant.values(X, read_field_again)
    if not constant.fields:
        some = np.linspace(0, len(X) - 1, min(LOOKED, len(X))).astype(int)
        plain = np.array([constant.value(tuple(map(float, X[i]))) for i in some])
        if not np.allclose(found[some], plain, rtol=AGREE, atol=0.0):
            raise ValueError(
                f"`{constant.name}` has different values when evaluated point by point and for all points at once"
            )
    return found


def elastic_constants_function(case: Case) -> Any:
    """Return a function of points (n, 3) that gives Young's modulus and Poisson's ratio of a case."""
    material = case.material
    return lambda X: (constant_values(material.young, X), constant_values(material.poisson, X))


def density_of(case: Case) -> Any:
    """Return the density of a case, kg/m^3: a number, or a function of points (n, 3), m."""
    rho = case.material.density
    return (lambda X: constant_values(rho, X)) if isinstance(rho, Profile) else rho


# ------------------------------------------------------------------ integrals by another quadrature

LOOKED_AT = (6, 4)  # cells of each material that are integrated again: with points of their own, and others
BOXES = 5  # along each direction of a cell, to begin with, or more where centres of voxels lie in planes between
MOST = 6_000  # boxes of a cell; the error that they leave is allowed for
VOXELS = 12_000  # boxes between centres of voxels: of more in a cell, they are not distinguished
PARALLEL = 1e-9  # relative: voxels and cells that are turned by less have parallel faces
ROUNDS = 40  # times that boxes are halved
CLOSE = 1e-3  # of the size of an integral: when boxes are small enough
OFF = 5e-3  # of an integral: the error that the element's quadrature may have


def check_integrals(case: Case, mesh: DeformedMesh, pressures: bool) -> tuple[dict[str, Any], str | None]:
    """Compare integrals of constants over a sample of cells with adaptive quadrature.

    Returns the deviation, and the reason if it is too large, else None. The adaptive rule divides the cube that is
    mapped to each cell into boxes. Points of the model only show where features may be, and do not enter the integrals.
    Integrands are each constant, and each constant times each local coordinate.
    """
    worst, reason = 0.0, None
    for own, which in split_by_material(case, mesh):
        part = mesh_of_cells(mesh.mesh, which)
        for name, rows, seen, images in _integrands(own, part, pressures):
            off = _largest_volume_error(seen, part)
            worst = max(worst, off)
            if off > OFF and reason is None:
                reason = f"the quadrature points of `{name}` miss the volume of a cell by {100 * off:.2g} %"
            for cell in _sample_cells(seen, len(part.cells)):
                off, allowed = _compare_cell(rows, seen, images, part, cell)
                worst = max(worst, off)
                if off > allowed and reason is None:
                    reason = (f"the integral of `{name}` over a cell differs by {100 * off:.2g} % from that "
                              "of an independent quadrature")  # fmt: skip
    return {"integrals_off": worst}, reason


def _integrands(
    case: Case, mesh: Any, pressures: bool
) -> Iterator[tuple[str, Callable[[Floats], Floats], Any, list[Image]]]:
    """Yield the name of a constant, its integrands (g, n) at points (n, 3), the model's quadrature, and the images."""
    from softmark.interpreter.models.shared import heterogeneous_material

    material = case.material
    if (seen := heterogeneous_material.density_quadrature(case, mesh)) is not None:
        yield "density", lambda X: constant_values(material.density, X)[None], seen, _images(material.density)
    if (seen := heterogeneous_material.stiffness_of(case, mesh, pressures)) is None:
        return
    active = next((n for n in heterogeneous_material.ACTIVE if isinstance(getattr(material, n, None), Profile)), None)
    if active is not None:
        constant = getattr(material, active)
        yield active, lambda X: constant_values(constant, X)[None], seen, _images(constant)
        return

    def moduli(X: Floats) -> Floats:
        E, nu = constant_values(material.young, X), np.minimum(constant_values(material.poisson, X), 0.5 - 1e-9)
        if not isinstance(material.poisson, Profile):
            return np.stack([E, 1.0 / E] if pressures else [E])
        K = E / (3.0 - 6.0 * nu)
        return np.stack([E / (2.0 + 2.0 * nu), 1.0 / K if pressures else K])

    images = _images(material.young, material.poisson)
    yield "young" if isinstance(material.young, Profile) else "poisson", moduli, seen, images


def _images(*constants: Any) -> list[Image]:
    """Return the images that constants depend on."""
    fields = [f for constant in constants if isinstance(constant, Profile) for f in constant.fields]
    return [image for image in map(load_field, fields) if isinstance(image, Image)]


def _largest_volume_error(seen: Any, mesh: Any) -> float:
    """Return the largest relative error of cell volumes by quadrature, among cells with special quadrature points."""
    if seen.rule is None:
        return 0.0
    own = np.flatnonzero(seen.rule.special)
    xi, w = solid_forces.quadrature_rule(mesh.kind)
    V = np.abs(solid_forces.gradients(mesh.points, mesh.cells[own], mesh.kind, xi)[1]) @ w
    return float(np.abs(seen.rule.w[own].sum(axis=1) / V - 1.0).max(initial=0.0))


def _sample_cells(seen: Any, count: int) -> Any:
    """Return the numbers of a random sample of cells: first those with special quadrature points, then others."""
    own = np.zeros(count, dtype=bool) if seen.rule is None else seen.rule.special
    rng = np.random.default_rng(count)
    return np.concatenate(
        [rng.permutation(np.flatnonzero(which))[:n] for which, n in zip((own, ~own), LOOKED_AT, strict=True)]
    )


def _compare_cell(
    rows: Callable[[Floats], Floats], seen: Any, images: list[Image], mesh: Any, cell: int
) -> tuple[float, float]:
    """Return the deviation of a cell's integrals, relative to the size of the integrands, and the allowed deviation."""
    corners, kind = mesh.points[mesh.cells[[cell]]], mesh.kind
    if seen.rule is None or not seen.rule.special[cell]:
        xi, w = seen.own
    else:
        xi, w = (each[cell] for each in seen.rule.local(mesh))

    def integrals(xi: Floats, w: Floats) -> tuple[Floats, Floats]:
        X = (solid_forces.shape_functions(kind, xi) @ corners)[0]
        c, v = rows(X), w * solid_forces.gradients(mesh.points, mesh.cells[[cell]], kind, xi)[1][0]
        return np.stack([c @ v, *(c @ (v * t) for t in xi.T)]), np.abs(c) @ np.abs(v)

    found, size = integrals(xi, w)
    hints = seen.fine.xi[seen.fine.cell == cell]
    f, kinks = _weighted_integrands(rows, images, kind, corners[0])
    fine, left = integrate_by_boxes(kind, f, hints, CLOSE * size, kinks)
    scale = size + 1e-3 * seen.total / len(mesh.cells)
    off = (np.abs(found - fine) / scale)[: 1 if mesh.element.constant else None]  # one strain: no moments
    allowed = OFF + (left + seen.missed[cell] * seen.total) / scale
    worst = int(np.argmax(off.max(axis=0) - allowed))
    return float(off[:, worst].max()), float(allowed[worst])


def _weighted_integrands(
    rows: Callable[[Floats], Floats], images: list[Image], kind: str, corners: Floats
) -> tuple[Callable[[Floats], Floats], list[Floats]]:
    """Return the integrands times the Jacobian determinant of the cell, and where they have kinks.

    The former are a function (g, n) of local points (n, 3), the latter coordinates of planes along each axis of the
    unit cube that is mapped to the cell.
    """
    known = solid_forces.affine_map(kind, corners)
    if known is not None:
        b, A = known
        det = float(np.linalg.det(A))
        return lambda xi: rows(xi @ A.T + b) * det, _voxel_planes(images, kind, A, b)

    def weighted(xi: Floats) -> Floats:
        columns = np.moveaxis(solid_forces.shape_derivatives(kind, xi), 2, 0) @ (corners - corners[0])
        det = np.linalg.det(np.moveaxis(columns, 0, 2))
        found: Floats = rows(solid_forces.shape_functions(kind, xi) @ corners) * det
        return found

    return weighted, [np.zeros(0)] * 3


def _voxel_planes(images: list[Image], kind: str, A: Floats, b: Floats) -> list[Floats]:
    """Return coordinates (n,) of planes through voxel centres, for each axis of the unit cube normal to them.

    The cube is mapped to a cell with positions A xi + b. Between these planes an image is linear along each axis.
    """
    found: list[Floats] = [np.zeros(0)] * 3
    for image in images:
        slopes, start = image.inverse @ A, image.inverse @ (b - image.centre)  # of voxel indices over xi
        for along, first, count in zip(slopes, start, image.numbers.shape, strict=True):
            (axes,) = np.nonzero(np.abs(along) > PARALLEL * np.abs(along).max())
            axis = int(axes[0])
            if len(axes) > 1 or not _is_cube_axis(kind, axis):
                continue
            xi = np.zeros((count, 3))
            xi[:, axis] = (np.arange(count) - first) / along[axis]
            found[axis] = np.concatenate([found[axis], cell_to_cube(kind, xi)[:, axis]])
    return found


def _is_cube_axis(kind: str, axis: int) -> bool:
    """Return whether a local coordinate of a cell depends only on the same coordinate of the unit cube."""
    return solid_forces.is_tensor_product(kind) or axis == 0 or (axis == 2 and solid_forces.is_wedge(kind))


def integrate_by_boxes(
    kind: str, f: Callable[[Floats], Floats], hints: Floats, close: Floats, kinks: Sequence[Floats] | None = None
) -> tuple[Floats, Floats]:
    """Return integrals (4, g) over a reference cell: of functions f (g, n), and of f times each local coordinate.

    The second result is an error estimate (g,). It compares three Gauss points per direction of a box with two, and
    with Simpson's rule, which detects features beyond the outermost Gauss points. Boxes end at `kinks`, coordinates
    along each axis of the unit cube. They are halved until the summed error is at most `close` (g,), and until no value
    at the local points `hints` (n, 3) is outside the range found in its box.
    """
    edges = [_box_edges(()) if kinks is None else _box_edges(kinks[axis]) for axis in range(3)]
    if math.prod(len(own) - 1 for own in edges) > VOXELS:
        edges = [_box_edges(())] * 3
    low, size = (
        np.stack(np.meshgrid(*own, indexing="ij"), axis=-1).reshape(-1, 3)
        for own in ([e[:-1] for e in edges], [np.diff(e) for e in edges])
    )
    at, told = cell_to_cube(kind, hints), f(hints)
    owner = _initial_box_numbers(at, edges)
    total, error = np.zeros((4, len(close))), np.zeros(len(close))
    taken = 0
    for turn in range(ROUNDS + 1):
        values, own, off, bend = _integrate_boxes(kind, f, low, size)
        surprise = _excess_over_box_range(values, told, owner)
        if turn == 0 and surprise.any():  # what is seen in one place may be as narrow all along a layer of boxes
            more = _points_in_layers(at, surprise.max(axis=0), low + 0.5 * size, edges)
            at, told = np.concatenate([at, more]), np.concatenate([told, f(cube_to_cell(kind, more)[0])], axis=1)
            owner = _initial_box_numbers(at, edges)
            surprise = _excess_over_box_range(values, told, owner)
        beyond, some = np.zeros((len(close), len(low))), np.flatnonzero(surprise.any(axis=0))
        for g in range(len(close)):
            np.maximum.at(beyond[g], owner, surprise[g])
        for axis in range(3):  # a feature between the points of a box does not show in them which way it varies
            moved = at[some]
            moved[:, axis] = (low + 0.5 * size)[owner[some], axis]
            change = np.abs(f(cube_to_cell(kind, moved)[0]) - told[:, some]) / np.maximum(surprise[:, some], 1e-300)
            np.maximum.at(
                bend[:, axis], owner[some], 100.0 * np.where(surprise[:, some] > 0.0, change, 0.0).max(axis=0)
            )
        volume = np.prod(size, axis=1)
        beyond = beyond * volume
        rough = np.asarray(((off + beyond) > close[:, None] / (taken + len(low))).any(axis=0))
        if turn == ROUNDS or taken + len(low) + int(rough.sum()) > MOST:
            rough[:] = False
        total += own[:, :, ~rough].sum(axis=2)
        error += (off + beyond)[:, ~rough].sum(axis=1)
        taken += int((~rough).sum())
        if not rough.any():
            break
        inside = rough[owner]
        at, told, owner = at[inside], told[:, inside], (np.cumsum(rough) - 1)[owner[inside]]
        axis = bend[rough].argmax(axis=1)
        low, size = low[rough], size[rough].copy()
        rows = np.arange(len(low))
        size[rows, axis] *= 0.5
        up = low.copy()
        up[rows, axis] += size[rows, axis]
        owner = owner + len(low) * (at[np.arange(len(at)), axis[owner]] > up[owner, axis[owner]])
        low, size = np.concatenate([low, up]), np.concatenate([size, size])
    return total, error


def _box_edges(kinks: Sequence[float] | Floats) -> Floats:
    """Return the edges (n + 1,) of the initial boxes along one axis of the unit cube: at kinks, and BOXES or more."""
    inner = np.sort([k for k in kinks if PARALLEL < k < 1.0 - PARALLEL])
    inner = inner[np.diff(inner, prepend=-1.0) > PARALLEL]
    found = [0.0]
    for end in (*inner, 1.0):
        start, parts = found[-1], math.ceil((end - found[-1]) * BOXES - PARALLEL)
        found += [start + (end - start) * (i / parts) for i in range(1, parts + 1)]
    return np.array(found)


def _layers(x: Floats, edges: Floats) -> Any:
    """Return the number of the layer of initial boxes that contains each coordinate `x` (n,) of the unit cube."""
    return np.searchsorted(edges[1:-1], x, side="right")


def _initial_box_numbers(at: Floats, edges: Sequence[Floats]) -> Any:
    """Return the number of the initial box that contains each point `at` (n, 3) of the unit cube, shape (n,)."""
    each = tuple(map(_layers, at.T, edges))
    return np.ravel_multi_index(each, tuple(len(e) - 1 for e in edges))


def _excess_over_box_range(values: Floats, told: Floats, owner: Any) -> Floats:
    """Return by how much the values `told` (g, n) lie outside the range of `values` in their boxes.

    The result (g, n) is zero unless the excess is larger than the range itself. `owner` is the box of each point.
    """
    least, most = values.min(axis=2), values.max(axis=2)
    above = np.maximum(told - most[:, owner], least[:, owner] - told)
    return np.where(above > np.maximum((most - least)[:, owner], 0.0), above, 0.0)


def _points_in_layers(at: Floats, surprise: Floats, centres: Floats, edges: Sequence[Floats]) -> Floats:
    """Return additional points (n, 3) in each layer of boxes, across an axis, that contains an unexpected value.

    They lie at the height of the point of the layer with the largest `surprise`.
    """
    found = []
    for axis in range(3):
        own, other = (_layers(X[:, axis], edges[axis]) for X in (at, centres))
        for k in np.unique(own[surprise > 0.0]):
            layer = centres[other == k]
            layer[:, axis] = at[np.where(own == k, surprise, -1.0).argmax(), axis]
            found.append(layer)
    return np.concatenate(found)


def _integrate_boxes(
    kind: str, f: Callable[[Floats], Floats], low: Floats, size: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return values (g, n, 62), integrals (4, g, n), errors (g, n) and variation per axis (n, 3) in n boxes."""

    def at(t: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        many = len(t)
        points = 0.5 + 0.5 * np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
        cube = (low[:, None] + points * size[:, None]).reshape(-1, 3)
        xi, w = cube_to_cell(kind, cube)
        found = f(xi).reshape(-1, len(low), many**3)
        w = w.reshape(len(low), -1) * 0.125 * np.einsum("i,j,k->ijk", v, v, v).ravel() * np.prod(size, axis=1)[:, None]
        return found, w, xi.reshape(len(low), -1, 3)

    gauss = np.polynomial.legendre.leggauss
    seen = [at(*gauss(3)), at(*gauss(2)), at(np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3.0)]
    own, coarse, simpson = (
        np.stack([(c * w).sum(axis=2), *((c * w * xi[..., i]).sum(axis=2) for i in range(3))]) for c, w, xi in seen
    )
    off = np.maximum(np.abs(own - coarse), np.abs(own - simpson)).max(axis=0)
    values = np.concatenate([c for c, *_ in seen], axis=2)
    largest = np.maximum(np.abs(values).max(axis=(1, 2)), 1e-300)[:, None, None, None, None]
    bend = np.zeros((len(low), 3))
    for c, *_ in (seen[0], seen[2]):  # what bends between the last Gauss point and the end of a box shows in the second
        cube = c.reshape(-1, len(low), 3, 3, 3) / largest
        bend += np.stack([np.abs(np.diff(cube, axis=a)).sum(axis=(0, 2, 3, 4)) for a in (2, 3, 4)], axis=1)
    return values, own, off, bend + 1e-9 * size


def cube_to_cell(kind: str, cube: Floats) -> tuple[Floats, Floats]:
    """Map points of the unit cube (n, 3) to local points (n, 3); also return the Jacobian determinants (n,)."""
    a, b, c = cube.T
    if solid_forces.is_tensor_product(kind):
        return 2.0 * cube - 1.0, np.full(len(cube), 8.0)
    if solid_forces.is_wedge(kind):
        return np.stack([a, (1.0 - a) * b, 2.0 * c - 1.0], axis=1), 2.0 * (1.0 - a)
    return np.stack([a, (1.0 - a) * b, (1.0 - a) * (1.0 - b) * c], axis=1), (1.0 - a) ** 2 * (1.0 - b)


def cell_to_cube(kind: str, xi: Floats) -> Floats:
    """Map local points (n, 3) of a cell to points of the unit cube (n, 3); the inverse of `cube_to_cell`."""
    x, y, z = xi.T
    if solid_forces.is_tensor_product(kind):
        return 0.5 * (xi + 1.0)
    b = y / np.maximum(1.0 - x, 1e-12)
    if solid_forces.is_wedge(kind):
        return np.stack([x, b, 0.5 * (z + 1.0)], axis=1)
    return np.stack([x, b, z / np.maximum((1.0 - x) * (1.0 - b), 1e-12)], axis=1)


# ------------------------------------------------------------------ stated error


def heterogeneity_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the part of the error from constants that vary within cells, as {part name: function of a probe result}.

    If quadrature errors change every stiffness by at most some fraction, a result changes by at most that
    fraction. A body may also be softer than its cells, by the bounds of layers in series, or stiffer than cells
    with pressures (stiffness_bounds.py).
    """
    from softmark.interpreter.models.shared.material_regions import largest_quadrature_error as of_mesh
    from softmark.interpreter.models.shared.material_regions import softer_by, stiffer_by

    mesh = None if whole.prepared is None else whole.prepared.mesh
    left = 0.0 if mesh is None else of_mesh(whole.case, mesh)
    if mesh is not None and whole.mesh is not None and len(whole.mesh.points) == len(mesh.points):
        formulation = getattr(whole.declared.thing, "formulation", "displacement")
        u = np.asarray(whole.mesh.displacement, dtype=np.float64)
        share = softer_by(whole.case, mesh, u, formulation != "displacement")
        left += share / (1.0 - share)
        if formulation != "displacement":
            left += stiffer_by(whole.case, mesh, u, whole.mesh.pressures)
    return {"constants": lambda seen: left * seen.size} if left else {}
