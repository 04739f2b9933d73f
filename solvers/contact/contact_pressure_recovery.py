"""Recovery of the contact pressure and the contact area from the contact forces at nodes."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.elements.element import Facet

Bools = NDArray[np.bool_]
PRESSED = 1e-6  # of the largest force per area: smaller values are no contact
POINTS = 4  # Gauss points per direction, for linear shape functions on facets that are not flat
LEAST = 1e-200  # Pa^2: lower bound that avoids a division by zero
FACING = 0.5  # cosine of the largest inclination of a loaded facet to neighbouring facets in contact
NEWTON = 12  # iterations for the border on a side, which is a cubic with one root


@dataclass(frozen=True)
class ContactPressure:
    """Contact pressure recovered from normal forces f (n,), N, at nodes x (n, 3), m, of facets (k, nodes per facet).

    The force at a node divided by the area of that node is no pressure: on quadratic facets a uniform pressure gives no
    force at the corners of triangles. So each force at the middle of a side is moved to the corners at its ends, half
    to each. Then the force at a corner is exactly the integral of the pressure times the linear shape function of this
    corner. Divided by the integral of this shape function it is a mean pressure around the corner. This mean is never
    negative, is second-order accurate, and keeps the total force. (A consistent mass matrix would undo the averaging
    and amplify the errors of a coarse mesh.)

    Areas are those of the surface at the positions `x`. For an axisymmetric model `depth` is the thickness of the slice
    that is meshed, m; forces and areas are then those of whole rings.

    At an edge of the body a node belongs to facets with different directions. The normals of the facets whose nodes are
    all in contact give the direction of the pressure there. A facet inclined too much to this direction receives no
    force from the shared node.

    Nodes with the same number in `alike` (n,) move together, such as nodes through the thickness of a slice, and share
    one pressure. The gaps g (n,), m, and `modulus`, E / (1 - nu^2), Pa, locate the border of contact between two nodes.
    A node is in contact if it has a force; a mask `on` (n,) replaces this criterion if `f` includes forces between the
    nodes.
    """

    facets: Ints
    x: Floats
    f: Floats
    g: Floats
    modulus: float
    depth: float = 0.0
    alike: Ints | None = None
    on: Bools | None = None

    @cached_property
    def corners(self) -> Ints:
        """Corner nodes of each facet (k, c)."""
        found: Ints = self.facets[:, : self._facet_class.corners]
        return found

    @property
    def _facet_class(self) -> type[Facet]:
        """Facet class of the facets."""
        return FACETS[self.facets.shape[1]]

    @property
    def plain(self) -> type[Facet]:
        """Facet class of linear facets with the same corners as the facets."""
        return FACETS[self._facet_class.corners]

    @cached_property
    def _forces_at_corners(self) -> Floats:
        """Forces at all nodes (n,), N, with those at the middles of sides moved to the corners, half to each end."""
        found, first, done = self.f.copy(), self._facet_class.corners, np.zeros(len(self.f), dtype=np.bool_)
        for i, ends in enumerate(
            self._facet_class.between
        ):  # a side shared by two facets may have another number in each
            nodes, at = np.unique(self.facets[:, first + i], return_index=True)
            nodes, at = nodes[~done[nodes]], at[~done[nodes]]
            np.add.at(found, self.facets[at][:, list(ends)], (self.f[nodes] / len(ends))[:, None])
            found[nodes], done[nodes] = 0.0, True
        return found

    @cached_property
    def _corner_areas(self) -> Floats:
        """Integrals (k, c), m^2, of linear corner shape functions over facets; zero where a facet gets no force."""
        xi, w = moment_fitted_quadrature.gauss_rule(self._facet_class.corners, POINTS)
        X, N = self.x[self.corners], self.plain.shape(xi)
        t = np.einsum("qaj,kai->jkqi", self.plain.gradient(xi), X)
        dA = w * np.linalg.norm(np.cross(t[0], t[1]), axis=-1)
        if self.depth:
            from softmark.solvers.energies.axisymmetric import circumference_in_slices

            dA = dA * circumference_in_slices(np.abs(X[:, :, 0]) @ N.T, self.depth)
        found: Floats = (dA @ N) * self._assigned_corners
        return found

    @cached_property
    def _assigned_corners(self) -> Bools:
        """Mask (k, c) of the facet corners whose contact force acts on that facet."""
        c = self.x[self.corners]
        n = np.cross(
            c[:, 1] - c[:, 0], c[:, -1] - c[:, 0]
        )  # for a quadrilateral the normal at its first corner is enough
        whole: Bools = np.asarray(self.contact_node_mask[self.facets].all(axis=1))
        ways = np.zeros_like(self.x)
        np.add.at(ways, self.corners[whole], n[whole, None])
        leans = np.einsum("ki,kci->kc", n, ways[self.corners])
        size = np.linalg.norm(n, axis=1)[:, None] * np.linalg.norm(ways, axis=1)[self.corners]
        found: Bools = np.asarray(whole[:, None] | (size == 0.0) | (leans > FACING * size))
        return found

    @cached_property
    def _contact_area_triangles(self) -> Ints:
        """Triangles (t, 3) of the facets that count for the contact area.

        These are the facets on which contact forces act, and the facets that have no corner in contact.
        """
        some = (self._assigned_corners & self.contact_node_mask[self.corners]).any(axis=1) | ~self.contact_node_mask[
            self.corners
        ].any(axis=1)
        found: Ints = self.facets[some][:, np.array(self._facet_class.triangles)].reshape(-1, 3)
        return found

    @cached_property
    def pressures(self) -> Floats:
        """Contact pressure at all nodes (n,), Pa: positive in contact and zero elsewhere."""
        F = self._forces_at_corners
        area: Floats = np.bincount(self.corners.ravel(), self._corner_areas.ravel(), minlength=len(F)).astype(
            np.float64
        )
        if self.alike is not None:
            F = np.bincount(self.alike, F).astype(np.float64)[self.alike]
            area = np.bincount(self.alike, area).astype(np.float64)[self.alike]
        on = area > 0.0
        p: Floats = np.where(on, np.maximum(F, 0.0) / np.where(on, area, 1.0), 0.0)
        if self.depth and self.alike is not None and not self._facet_class.between:
            from softmark.solvers.contact.axis_pressure_correction import correct_axis_pressures

            p = correct_axis_pressures(p, area, self.corners, np.abs(self.x[:, 0]), self.alike)
        for i, ends in enumerate(self._facet_class.between):
            p[self.facets[:, self._facet_class.corners + i]] = p[self.facets[:, list(ends)]].mean(axis=1)
        return p

    @cached_property
    def largest(self) -> float:
        """Largest nodal pressure, Pa."""
        return float(self.pressures.max(initial=0.0))

    @cached_property
    def contact_node_mask(self) -> Bools:
        """Mask (n,) of nodes in contact.

        A node is in contact if a contact force acts on it. On quadratic facets a corner is also in contact if all
        adjacent mid-side nodes are.
        """
        each = np.bincount(self.facets.ravel(), minlength=len(self.f)) > 0
        found: Bools = each & (self.f > PRESSED * self.f.max(initial=0.0) if self.on is None else self.on)
        free = np.zeros(len(found), dtype=np.bool_)
        for i, ends in enumerate(self._facet_class.between):
            apart = self.facets[~found[self.facets[:, self._facet_class.corners + i]]]
            free[apart[:, list(ends)]] = True
        if self._facet_class.between:
            corner = np.zeros(len(found), dtype=np.bool_)
            corner[self.corners] = True
            found = found | (corner & ~free)
        return found

    @cached_property
    def area(self) -> float:
        """Contact area, m^2.

        The border of contact lies between a node in contact and one without contact. Where contact ends smoothly, the
        pressure at a distance s inside the border is p = k s^(1/2), and the gap at s outside is g = 4 k / (3 E')
        s^(3/2), with E' = E / (1 - nu^2). This holds for an elastic body on any smooth rigid body: it is the crack-tip
        field with no stress intensity. So p at the one node and g at the other give k and the position of the border.
        Where contact ends at an edge the error is less than one facet.

        Source: Johnson 1985, "Contact mechanics", 5.1.
        """
        triangles = self._contact_area_triangles
        on = self.contact_node_mask[triangles]
        own = self._triangle_areas(triangles)
        total = float(own[on.all(axis=1)].sum())
        for lone, sign in ((1, 1.0), (2, -1.0)):  # one corner of three in contact, or two
            cut = on.sum(axis=1) == lone
            tri, is_on = triangles[cut], on[cut]
            alone = np.argmax(is_on if lone == 1 else ~is_on, axis=1)
            rows = np.arange(len(tri))
            tip = tri[rows, alone]
            part = np.ones(len(tri))
            for k in (1, 2):
                other = tri[rows, (alone + k) % 3]
                part *= (
                    self._contact_fraction_of_edges(tip, other)
                    if lone == 1
                    else 1.0 - self._contact_fraction_of_edges(other, tip)
                )
            total += float(own[cut] @ (part if sign > 0.0 else 1.0 - part))
        return total

    @cached_property
    def border(self) -> float:
        """Area of the triangles that are partly in contact, m^2: the uncertainty of the contact area."""
        triangles = self._contact_area_triangles
        on = self.contact_node_mask[triangles]
        return float(self._triangle_areas(triangles)[on.any(axis=1) & ~on.all(axis=1)].sum())

    def _triangle_areas(self, triangles: Ints) -> Floats:
        """Return the areas of triangles (t,), m^2."""
        a, b, c = (self.x[triangles[:, i]] for i in range(3))
        found: Floats = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        if self.depth:
            from softmark.solvers.energies.axisymmetric import circumference_in_slices

            found = found * circumference_in_slices(np.abs(self.x[triangles, 0]).mean(axis=1), self.depth)
        return found

    def _contact_fraction_of_edges(self, touching: Ints, free: Ints) -> Floats:
        """Return the fraction in contact, in (0, 1], of lines from a node in contact to a node without contact.

        `touching` and `free` (m,) are the numbers of the two nodes. With c = k^(-2/3), for the k of `area`, and the
        length h of a line, p^2 c^3 + (3 E' g / 4)^(2/3) c = h; the first term divided by h is the fraction.
        """
        way = self.x[touching] - self.x[free]
        h = np.linalg.norm(way if self.alike is None else way[:, :2], axis=1)  # uniform through a slice
        a = np.maximum(np.maximum(self.pressures[touching], PRESSED * self.largest) ** 2, LEAST)
        g = np.where(np.isfinite(self.g[free]), np.maximum(self.g[free], 0.0), 0.0)  # fixed nodes have no gap
        b = (0.75 * self.modulus * g) ** (2.0 / 3.0)
        c = np.minimum(np.cbrt(h / a), h / np.maximum(b, 1e-300))
        for _ in range(NEWTON):
            c = c - (a * c**3 + b * c - h) / (3.0 * a * c * c + b)
        found: Floats = np.clip(a * c**3 / h, 0.0, 1.0)
        return found
