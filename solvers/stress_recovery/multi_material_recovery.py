"""Stress and strain of a solid of several materials, recovered separately in the cells of each material.

Stress and strain jump where two materials meet, and a polynomial over cells of both would smooth the jump. A point on
an interface has a stress on each side (method `sides`). Pictures and files need one value per point (method `at`) and
use the side with the larger stress.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.element_interpolation import PointLocations, cache_locations, locate_points
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.mesh_groups import known_row_mask
from softmark.solvers.stress_recovery.sampling_point_stress import DeformedState
from softmark.solvers.stress_recovery.stress_field import Chosen, Number, Part, Stresses, tensor_norm
from softmark.solvers.stress_recovery.stress_measures import TensorsBySide

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from softmark.solvers.materials import Isotropic
    from softmark.solvers.mesh.mesh import Ints

    Bools = NDArray[np.bool_]

ASIDE = 1e-4  # relative to a piece of a line: distance from its ends at which its material is evaluated
HALVED = 40  # number of bisections: a crossing is then known to 1e-12 of the line
EDGE = 1e-9  # relative to a triangle or a line: tolerance at its edge
AT = 1e-9  # smaller shape functions count as zero: the point then lies on a face of its cell


@dataclass(frozen=True)
class MultiMaterialStresses(Stresses):
    """Stress field of a solid of several materials, with one recovered field for the cells of each material.

    All fields share the nodes of the mesh. `state` is the deformed state of the whole mesh, and `each` has the field of
    each material.
    """

    each: tuple[Stresses, ...] = ()

    @staticmethod
    def of(state: DeformedState, materials: tuple[Isotropic, ...], owners: Ints) -> MultiMaterialStresses:
        """Return the stress field of a state; `owners` (m,) are the numbers of the materials of the cells."""
        found = []
        for number, material in enumerate(materials):
            which = np.flatnonzero(owners == number)
            if len(which):
                mesh = Mesh(state.mesh.points, state.mesh.cells[which], state.mesh.kind)
                pressures = None if state.pressures is None else state.pressures[which]
                found.append(Stresses(replace(state, mesh=mesh, material=material, pressures=pressures)))
        return MultiMaterialStresses(state, tuple(found))

    def values(self, X: Floats) -> Floats:
        """Return the 22 recovered values (n, 22) at points X (n, 3), m, as `Stresses.values`.

        At points on interfaces they are those of the side with the larger stress.
        """
        found, size = np.zeros((len(X), 0)), np.full(len(X), -1.0)
        for _, own, here in self._materials_with_points(X):
            values = own.values(X[here])
            found = found if found.size else np.full((len(X), values.shape[1]), np.nan)
            own_size = _stress_norm(values)
            larger = own_size > size[here]
            found[here[larger]] = values[larger]
            size[here] = np.maximum(size[here], own_size)
        return found

    def sides(self, X: Floats) -> TensorsBySide:
        """Return stress and deformation at points X (n, 3), m, with a row for each material at a point.

        Points on an interface have several rows.
        """
        rows, numbers, values = [], [], []
        for number, own, here in self._materials_with_points(X):
            rows.append(here)
            numbers.append(np.full(len(here), number))
            values.append(own.values(X[here]))
        row, material = np.concatenate(rows), np.concatenate(numbers)
        order = np.lexsort((material, row))
        return TensorsBySide(row[order], material[order], self._tensors(np.concatenate(values)[order]))

    def interface_crossings(self, begin: Floats, end: Floats) -> Floats:
        """Return the sorted fractions (k,) of a line from `begin` (3,) to `end` (3,), m, at which the material changes.

        The material changes where the line passes through a facet between cells of different materials. Curved facets
        are represented by flat triangles, so the fractions are refined by bisection.
        """
        t = find_triangle_crossings(self._interface_triangles, begin, end)
        t = np.unique(np.concatenate([[0.0], t, [1.0]]))
        t = t[np.concatenate([[True], np.diff(t) > 1e-12])]
        return self._bisect_crossings(t, begin, end)[1:-1]

    @cached_property
    def _interface_triangles(self) -> Floats:
        """Triangles (t, 3, 3), m, of the facets that bound the cells of each material.

        They include the boundary of the body, which a line inside the body does not cross.
        """
        return np.concatenate([own.state.mesh.points[own.state.mesh.faces] for own in self.each])

    def _bisect_crossings(self, t: Floats, begin: Floats, end: Floats) -> Floats:
        """Return the sorted fractions `t` (k,) of a line, with further material changes between them.

        `t` are the crossings found so far, with both ends. Where the material differs between the ends of an interval,
        the change is found by bisection.
        """
        width = np.diff(t)
        low, high = t[:-1] + ASIDE * width, t[1:] - ASIDE * width
        first, last = (self._first_material(begin + s[:, None] * (end - begin)) for s in (low, high))
        left = np.flatnonzero(first != last)
        if not len(left):
            return t
        low, high, first = low[left], high[left], first[left]
        for _ in range(HALVED):
            middle = 0.5 * (low + high)
            same = self._first_material(begin + middle[:, None] * (end - begin)) == first
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return np.unique(np.concatenate([t, 0.5 * (low + high)]))

    def _first_material(self, X: Floats) -> Ints:
        """Return the lowest number of a material at each point X (n, 3), m, shape (n,)."""
        found = np.full(len(X), len(self.each), dtype=np.int64)
        for number, _, here in self._materials_with_points(X):
            found[here] = np.minimum(found[here], number)
        return found

    def peaks(self, number: Number, chosen: Chosen, surface: bool = False) -> Floats:
        """Return the nodes (k, 3), m, of the cells in which the scalar `number` is largest, for each material.

        The arguments are those of `Stresses.peaks`.
        """
        found = np.concatenate([own.peaks(number, chosen) for own in self.each])
        return found if not surface else self._on_boundary(found)

    def values_at_nodes(self) -> Floats:
        """Return the 22 recovered values (nodes, 22) at every node, as `Stresses.values_at_nodes`.

        At nodes on interfaces they are those of the side with the larger stress.
        """
        found = [own.values_at_nodes() for own in self.each]
        size = np.stack([_stress_norm(values) for values in found])
        picked: Floats = np.stack(found)[size.argmax(axis=0), np.arange(size.shape[1])]
        return picked

    def unresolved(self, X: Floats) -> Floats:
        """Return how far cell stresses around points X (n, 3), m, differ from the recovered stress, (n,), Pa.

        At an interface it is the largest difference of all sides.
        """
        return self._largest_over_materials(X, lambda own, here: own.unresolved(here))

    def relative_fit_residual(self, X: Floats, of: Part) -> Floats:
        """Return the relative difference (n,) between cell tensors around points X (n, 3), m, and recovered tensors.

        At an interface it is the largest difference of all sides. `of` selects the tensor, as in
        `Stresses.disagreement`.
        """
        return self._largest_over_materials(X, lambda own, here: own.relative_fit_residual(here, of))

    def _largest_over_materials(self, X: Floats, of: Callable[[Stresses, Floats], Floats]) -> Floats:
        """Return the largest value (n,) over the materials at points X (n, 3), m.

        `of` returns the values of the stress field of one material at its points.
        """
        found = np.zeros(len(X))
        for _, own, here in self._materials_with_points(X):
            found[here] = np.maximum(found[here], of(own, X[here]))
        return found

    def count_interface_points(self, X: Floats) -> int:
        """Return the number of points X (n, 3), m, that lie on interfaces."""
        count = np.zeros(len(X), dtype=np.int64)
        for _, _, here in self._materials_with_points(X):
            count[here] += 1
        return int((count > 1).sum())

    def sampled(self) -> None:
        """Compute the stress in every cell once. Raises StressUnavailable if it is not available or not finite."""
        for own in self.each:
            own.sampled()

    @cached_property
    def usual(self) -> tuple[float, float, float]:
        """Typical norms: root mean squares over the body of stress, Pa, strain, and deviatoric stress, Pa."""
        sizes = np.array([float(np.abs(own.state.mesh.volumes).sum()) for own in self.each])
        squares = np.array([own.usual for own in self.each]) ** 2
        stress, strain, shape = np.sqrt(sizes @ squares / sizes.sum()).tolist()
        return stress, strain, shape

    def _moved(self, step: Floats) -> MultiMaterialStresses:
        """Return the stress field with displacements `step` (n, 3), m, added at the nodes."""
        moved = tuple(own.moved(step) for own in self.each)
        return MultiMaterialStresses(replace(self.state, u=self.state.u + step), moved)

    def _materials_with_points(self, X: Floats) -> Iterator[tuple[int, Stresses, Ints]]:
        """Yield the number and the stress field of each material, and the indices of the points X (n, 3) in it.

        Points outside the mesh belong to the nearest cell. The result for each X is cached.
        """
        key = X.tobytes()
        if key not in self._material_mask_cache:
            self._material_mask_cache[key] = self._material_mask(X)
        for number, (own, here) in enumerate(zip(self.each, self._material_mask_cache[key], strict=True)):
            if here.any():
                yield number, own, np.flatnonzero(here)

    @cached_property
    def _material_mask_cache(self) -> dict[bytes, Bools]:
        """Cache of `_material_mask` by the bytes of the points."""
        return {}

    @cached_property
    def _nodes_of_materials(self) -> Bools:
        """Mask (r, nodes) of the nodes that belong to cells of each of the r materials."""
        found = np.zeros((len(self.each), len(self.state.mesh.points)), dtype=np.bool_)
        for row, own in zip(found, self.each, strict=True):
            row[own.state.mesh.cells] = True
        return found

    def _material_mask(self, X: Floats) -> Bools:
        """Return a mask (r, n) of the r materials at points X (n, 3), m: those of all cells that contain a point.

        If a point lies on a face, an edge or a corner of its cell, only the shape functions of the nodes there are not
        zero. The materials of the cells with these nodes meet at the point.
        """
        where = locate_points(self.state.mesh, X)
        found = np.stack([known_row_mask(own.state.mesh.cells, where.nodes) for own in self.each])
        alone = found.copy()
        counts = np.abs(where.N) > AT
        several = (self._nodes_of_materials[:, where.nodes] | ~counts).all(axis=2).sum(axis=0) > 1
        for point in np.flatnonzero(several & ~counts.all(axis=1)).tolist():
            nodes = where.nodes[point][counts[point]]
            for row, own in zip(found, self.each, strict=True):
                row[point] |= bool(np.isin(own.state.mesh.cells, nodes).sum(axis=1).max() == len(nodes))
        for own, row, here in zip(self.each, found, alone, strict=True):
            if row.any() and (row == here).all():  # all locations are in cells of this material
                cache_locations(
                    own.state.mesh, X[row], PointLocations(where.nodes[row], where.N[row], where.outside[row])
                )
        return found


def _stress_norm(values: Floats) -> Floats:
    """Return the norm of the stress (n,), Pa, of recovered values (n, 22); -1 where a material has no value."""
    norm = tensor_norm(values[:, :6])
    return np.where(np.isnan(norm), -1.0, norm)


def find_triangle_crossings(triangles: Floats, begin: Floats, end: Floats) -> Floats:
    """Return the fractions (k,), unsorted, of a line at which it crosses triangles (t, 3, 3), m.

    The line leads from `begin` (3,) to `end` (3,), m. Triangles that contain the line are not crossed.

    Source: Moeller and Trumbore (1997), J. Graphics Tools 2:21.
    """
    way = end - begin
    a, b, c = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(b, c)
    slope = normal @ way
    steep = np.abs(slope) > AT * np.linalg.norm(normal, axis=1) * np.linalg.norm(way)
    a, b, c, normal, slope = a[steep], b[steep], c[steep], normal[steep], slope[steep]
    t = np.einsum("ti,ti->t", normal, a - begin) / slope
    from_a = begin + t[:, None] * way - a
    area = (normal**2).sum(axis=1)
    v = np.einsum("ti,ti->t", np.cross(from_a, c), normal) / area
    w = np.einsum("ti,ti->t", np.cross(b, from_a), normal) / area
    inside = (v > -EDGE) & (w > -EDGE) & (v + w < 1.0 + EDGE) & (t > EDGE) & (t < 1.0 - EDGE)
    found: Floats = t[inside]
    return found
