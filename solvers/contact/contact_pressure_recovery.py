"""Recovery of the contact pressure, the contact area and its border from the contact forces at nodes."""

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
PRESSED = 1e-6  # of the largest force per area: what is less is no contact
POINTS = 4  # squared: of Gauss, for linear shape functions on facets that are not flat
LEAST = 1e-200  # Pa^2: a pressure that is none
FACING = 0.5  # a cosine: a facet that leans more than that from those beside it which are pressed takes nothing of it
NEWTON = 12  # iterations for the border on a side, which is a cubic with one root


@dataclass(frozen=True)
class ContactPressure:
    """Contact pressure recovered from normal forces f (n,), N, at the nodes x (n, 3), m, of facets (k, m).

    The force of a node divided by its own area is no pressure: on quadratic facets a uniform pressure gives no force at
    the corners of triangles. So forces at mid-sides are moved to the corners at their ends, half each. The force at a
    corner is then exactly the integral of the pressure times the linear shape function of that corner. Divided by the
    integral of that function it is a mean around the corner: never negative, of second order, with the same total
    force. (A consistent mass matrix would undo the mean and amplify errors of a coarse mesh.) Pressures are per area at
    `x`. With the `depth`, m, of a slice through a body of revolution, forces and areas are those of whole rings.

    At an edge of the surface, facets in contact with all their nodes give the direction of the pressure. Another facet
    receives no force of a node that it shares with them if it leans too far from them.

    Nodes with the same number in `alike` (n,) move together, such as those through the thickness of a slice: they share
    one pressure.

    The gaps g (n,), m, and `modulus`, E / (1 - nu^2), Pa, locate the end of contact between two nodes. Nodes in contact
    are found from forces, or given by `on` (n,) if forces between nodes are included in `f`.
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
        found: Ints = self.facets[:, : self._facet.corners]
        return found

    @property
    def _facet(self) -> type[Facet]:
        return FACETS[self.facets.shape[1]]

    @property
    def plain(self) -> type[Facet]:
        """Facet class that has only the corners of these facets."""
        return FACETS[self._facet.corners]

    @cached_property
    def _forces(self) -> Floats:
        """Forces on corners (n,), N: their own, and equal parts of the forces of the nodes between them."""
        found, first, done = self.f.copy(), self._facet.corners, np.zeros(len(self.f), dtype=np.bool_)
        for i, ends in enumerate(self._facet.between):  # a node between two facets is another's in each
            nodes, at = np.unique(self.facets[:, first + i], return_index=True)
            nodes, at = nodes[~done[nodes]], at[~done[nodes]]
            np.add.at(found, self.facets[at][:, list(ends)], (self.f[nodes] / len(ends))[:, None])
            found[nodes], done[nodes] = 0.0, True
        return found

    @cached_property
    def _weights(self) -> Floats:
        """Integrals of the linear corner shape functions over facets (k, c), m^2; zero where a facet is not loaded."""
        xi, w = moment_fitted_quadrature.gauss_rule(self._facet.corners, POINTS)
        X, N = self.x[self.corners], self.plain.shape(xi)
        t = np.einsum("qaj,kai->jkqi", self.plain.gradient(xi), X)
        dA = w * np.linalg.norm(np.cross(t[0], t[1]), axis=-1)
        if self.depth:
            from softmark.solvers.energies.axisymmetric import circumference_in_slices

            dA = dA * circumference_in_slices(np.abs(X[:, :, 0]) @ N.T, self.depth)
        found: Floats = (dA @ N) * self._taking
        return found

    @cached_property
    def _taking(self) -> Bools:
        """Mask of the corners (k, c) whose contact force acts on the facet."""
        c = self.x[self.corners]
        n = np.cross(c[:, 1] - c[:, 0], c[:, -1] - c[:, 0])  # of a quadrilateral that of its first corner is enough
        whole: Bools = np.asarray(self.touching[self.facets].all(axis=1))
        ways = np.zeros_like(self.x)
        np.add.at(ways, self.corners[whole], n[whole, None])
        leans = np.einsum("ki,kci->kc", n, ways[self.corners])
        size = np.linalg.norm(n, axis=1)[:, None] * np.linalg.norm(ways, axis=1)[self.corners]
        found: Bools = np.asarray(whole[:, None] | (size == 0.0) | (leans > FACING * size))
        return found

    @cached_property
    def _triangles(self) -> Ints:
        """Triangles (t, 3) of facets on which contact forces act, or none of whose corners touch."""
        some = (self._taking & self.touching[self.corners]).any(axis=1) | ~self.touching[self.corners].any(axis=1)
        found: Ints = self.facets[some][:, np.array(self._facet.triangles)].reshape(-1, 3)
        return found

    @cached_property
    def pressures(self) -> Floats:
        """Contact pressure at all nodes (n,), Pa: positive in contact and zero elsewhere."""
        F = self._forces
        area: Floats = np.bincount(self.corners.ravel(), self._weights.ravel(), minlength=len(F)).astype(np.float64)
        if self.alike is not None:
            F = np.bincount(self.alike, F).astype(np.float64)[self.alike]
            area = np.bincount(self.alike, area).astype(np.float64)[self.alike]
        on = area > 0.0
        p: Floats = np.where(on, np.maximum(F, 0.0) / np.where(on, area, 1.0), 0.0)
        if self.depth and self.alike is not None and not self._facet.between:
            from softmark.solvers.contact.axis_pressure_correction import correct_axis_pressures

            p = correct_axis_pressures(p, area, self.corners, np.abs(self.x[:, 0]), self.alike)
        for i, ends in enumerate(self._facet.between):
            p[self.facets[:, self._facet.corners + i]] = p[self.facets[:, list(ends)]].mean(axis=1)
        return p

    @cached_property
    def largest(self) -> float:
        """Largest pressure, Pa."""
        return float(self.pressures.max(initial=0.0))

    @cached_property
    def touching(self) -> Bools:
        """Mask of nodes in contact (n,): nodes with a contact force, and corners whose sides all have one."""
        each = np.bincount(self.facets.ravel(), minlength=len(self.f)) > 0
        found: Bools = each & (self.f > PRESSED * self.f.max(initial=0.0) if self.on is None else self.on)
        free = np.zeros(len(found), dtype=np.bool_)
        for i, ends in enumerate(self._facet.between):
            apart = self.facets[~found[self.facets[:, self._facet.corners + i]]]
            free[apart[:, list(ends)]] = True
        if self._facet.between:
            corner = np.zeros(len(found), dtype=np.bool_)
            corner[self.corners] = True
            found = found | (corner & ~free)
        return found

    @cached_property
    def area(self) -> float:
        """Contact area, m^2.

        The border lies between a node in contact and one that is not. Where contact ends smoothly, the pressure at a
        distance s inside the border is p = k s^(1/2), and the gap outside is g = 4 k / (3 E') s^(3/2), E' = E / (1 -
        nu^2), for an elastic body on any smooth rigid one (the crack-tip field with no intensity, Johnson 1985,
        "Contact mechanics", 5.1). So p at one node and g at the other give k and the place of the border between them.
        Where contact ends at an edge the error is less than a facet.
        """
        triangles = self._triangles
        on = self.touching[triangles]
        own = self._areas(triangles)
        total = float(own[on.all(axis=1)].sum())
        for lone, sign in ((1, 1.0), (2, -1.0)):  # the one that touches, or the one that does not
            cut = on.sum(axis=1) == lone
            tri, is_on = triangles[cut], on[cut]
            alone = np.argmax(is_on if lone == 1 else ~is_on, axis=1)
            rows = np.arange(len(tri))
            tip = tri[rows, alone]
            part = np.ones(len(tri))
            for k in (1, 2):
                other = tri[rows, (alone + k) % 3]
                part *= self._share(tip, other) if lone == 1 else 1.0 - self._share(other, tip)
            total += float(own[cut] @ (part if sign > 0.0 else 1.0 - part))
        return total

    @cached_property
    def border(self) -> float:
        """Area of the triangles that are partly in contact, m^2: the uncertainty of the contact area."""
        triangles = self._triangles
        on = self.touching[triangles]
        return float(self._areas(triangles)[on.any(axis=1) & ~on.all(axis=1)].sum())

    def _areas(self, triangles: Ints) -> Floats:
        """Return the areas of triangles (t,), m^2."""
        a, b, c = (self.x[triangles[:, i]] for i in range(3))
        found: Floats = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        if self.depth:
            from softmark.solvers.energies.axisymmetric import circumference_in_slices

            found = found * circumference_in_slices(np.abs(self.x[triangles, 0]).mean(axis=1), self.depth)
        return found

    def _share(self, touching: Ints, free: Ints) -> Floats:
        """Return the fraction in (0, 1] of the lines from touching to free nodes (m,) that is in contact.

        With c = k^(-2/3): p^2 c^3 + (3 E' g / 4)^(2/3) c = h; the first term over h is the fraction.
        """
        way = self.x[touching] - self.x[free]
        h = np.linalg.norm(way if self.alike is None else way[:, :2], axis=1)  # nothing changes through a slice
        a = np.maximum(np.maximum(self.pressures[touching], PRESSED * self.largest) ** 2, LEAST)
        g = np.where(np.isfinite(self.g[free]), np.maximum(self.g[free], 0.0), 0.0)  # what is held beside it has none
        b = (0.75 * self.modulus * g) ** (2.0 / 3.0)
        c = np.minimum(np.cbrt(h / a), h / np.maximum(b, 1e-300))
        for _ in range(NEWTON):
            c = c - (a * c**3 + b * c - h) / (3.0 * a * c * c + b)
        found: Floats = np.clip(a * c**3 / h, 0.0, 1.0)
        return found
