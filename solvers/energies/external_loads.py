"""External loads: dead nodal forces and forces of rotation, which have a potential; pressure and moments have none."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements import moment_fitted_quadrature
from softmark.solvers.elements.boundary_facets import FACETS
from softmark.solvers.energies.energy import Energy, Floats, Ints, no_stencils
from softmark.solvers.energies.local_blocks import add_blocks, cross_matrix


@dataclass(frozen=True)
class DeadForces(Energy):
    """Dead nodal forces `f` (dofs,), N, which keep their direction in space: E = -f . x."""

    f: Floats
    conservative: bool = True

    @property
    def stencils(self) -> Ints:
        """Empty stencils: this load has no Hessian."""
        return no_stencils()

    def value(self, x: Floats) -> float:
        """Return the potential of the forces, J."""
        return -float(self.f @ x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the forces: g -= scale f."""
        g -= scale * self.f

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Do nothing: the forces are constant."""

    def rounding(self, x: Floats) -> float:
        """Return zero: the forces are constant."""
        return 0.0


@dataclass(frozen=True)
class AffineMassForces(Energy):
    """Force per mass a(x) = constant + gradient x, m/s^2, that is affine in the current positions x, m.

    With the nodal mass couplings M_ab = int rho N_a N_b dV of each cell, the force on node a is
    sum_b M_ab (constant + gradient x_b). The gradient is symmetric, so there is an energy: E = -int rho (constant . x +
    x . gradient x / 2) dV, less its value in the undeformed body.
    """

    points: Floats  # (n, 3) undeformed
    cells: Ints  # (m, a)
    masses: Floats  # (m, a, a), kg
    constant: Floats  # (3,), m/s^2
    gradient: Floats  # (3, 3), 1/s^2
    conservative: bool = True

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom for each node of a cell (m, 3 a)."""
        return (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), -1)

    def value(self, x: Floats) -> float:
        """Return the potential relative to the undeformed body, J."""
        u = x.reshape(-1, 3)[self.cells]
        middle = self.points[self.cells] + 0.5 * u  # the work of an affine force is that of its mean
        return -float(np.einsum("mai,mab,mbi->", u, self.masses, self.constant + middle @ self.gradient.T))

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the nodal forces, N."""
        places = (self.points + x.reshape(-1, 3))[self.cells]
        forces = self.masses @ (self.constant + places @ self.gradient.T)
        np.subtract.at(g.reshape(-1, 3), self.cells, scale * forces)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Subtract the load stiffness M_ab `gradient`, N/m, unless `projected`: that tangent must stay definite."""
        if not projected:
            blocks = np.einsum("mab,ij->maibj", self.masses, -scale * self.gradient)
            add_blocks(blocks.reshape(slots.shape), slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the loaded body."""
        return 0.0


@dataclass(frozen=True)
class FollowerPressure(Energy):
    """Follower pressure `p`, Pa, on facets `faces` (f, k) along the current inward normal.

    Facets have three, six or four nodes. The force on node a is -p int N_a (dx/dxi x dx/deta) dxi deta, by exact
    quadrature. The tangent is not symmetric on a surface with a free edge (Bonet and Wood 2008, section 9.5), so there
    is no potential. If the pressure acts on parts of facets, `weights` are the quadrature weights of these parts, at
    the points of elements/moment_fitted_quadrature.py, which integrate parts exactly too.
    """

    points: Floats  # (n, 3) undeformed
    faces: Ints
    p: float
    weights: Floats | None = None  # (f, q)
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom for each node of a facet (f, 3 k)."""
        return (3 * self.faces[:, :, None] + np.arange(3)).reshape(len(self.faces), -1)

    @cached_property
    def _rule(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Shape functions N, derivatives dN/dxi and dN/deta (q, k), and quadrature weights (1 or f, q)."""
        nodes = self.faces.shape[1]
        facet = FACETS[nodes]
        xi, weights = facet.quadrature()
        if self.weights is not None:
            xi, weights = moment_fitted_quadrature.point_positions(nodes), self.weights
        dN = facet.gradient(xi)
        return facet.shape(xi), dN[:, :, 0], dN[:, :, 1], np.atleast_2d(weights)

    def value(self, x: Floats) -> float:
        """Raise TypeError: a follower pressure on an open surface has no potential."""
        raise TypeError("a follower load has no energy")

    def _tangents(self, x: Floats) -> tuple[Floats, Floats]:
        """Return dx/dxi and dx/deta (f, q, 3)."""
        _, first, second, _ = self._rule
        y = (self.points + x.reshape(-1, 3))[self.faces]
        return np.einsum("qk,fki->fqi", first, y), np.einsum("qk,fki->fqi", second, y)

    def _weights_at(self, x: Floats) -> Floats:
        """Return the quadrature weights (1 or f, q) in the state x; here they do not depend on x."""
        return self._rule[3]

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the nodal forces of the pressure, N, from g."""
        areas = self._weights_at(x)[:, :, None] * np.cross(*self._tangents(x))
        minus_force = np.einsum("qa,fqi->fai", self._rule[0], areas)
        minus_force *= scale * self.p
        np.add.at(g.reshape(-1, 3), self.faces, minus_force)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the load stiffness, which is not symmetric, unless `projected`: that tangent must stay definite."""
        if projected:
            return
        block = self._unit_pressure_stiffness(x)
        block *= scale * self.p
        keep = slots >= 0
        np.add.at(data, slots[keep], block.reshape(slots.shape)[keep])

    def _unit_pressure_stiffness(self, x: Floats) -> Floats:
        """Return the derivative of minus the nodal forces under unit pressure (f, a, 3, b, 3), m."""
        N, first, second, _ = self._rule
        w = self._weights_at(x)[:, :, None]
        a, b = (w * tangent for tangent in self._tangents(x))
        # d(a x b) = -[b]x da + [a]x db
        block: Floats = np.einsum("qa,qb,fqij->faibj", N, second, cross_matrix(a), optimize=True)
        block -= np.einsum("qa,qb,fqij->faibj", N, first, cross_matrix(b), optimize=True)
        return block

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the loaded body."""
        return 0.0


@dataclass(frozen=True)
class FaceMoment(Energy):
    """Moment on part of a surface, applied as a traction t = c x (x - middle) per undeformed area.

    x are current positions, and `middle` is their mean over the area. `nodes` (k,) are the nodes of the facets, and
    `products` (k, k) the integrals of N_a N_b over the undeformed area, m^2. Let m be `products` without the part that
    moves with the middle, y = m x, and J = int |r|^2 I - r r^T, with r = x - middle. Then

        f_a = c x y_a,  J c = moment:

    the resultant force is zero and the resultant moment is `moment` in every state. Coupling elements with equal
    weights per area apply the same moment. The moment is fixed in space, so it has no potential. The tangent couples
    every pair of nodes and is not symmetric.
    """

    points: Floats  # (n, 3) undeformed
    nodes: Ints
    products: Floats
    moment: Floats  # (3,) N m
    conservative: bool = False

    @cached_property
    def stencils(self) -> Ints:
        """Three degrees of freedom of every node of the surface part (1, 3 k)."""
        found: Ints = (3 * self.nodes[:, None] + np.arange(3)).reshape(1, -1)
        return found

    @cached_property
    def _centred_product_matrix(self) -> Floats:
        """Matrix m (k, k), m^2, of the class docstring."""
        n = self.products.sum(axis=1)
        found: Floats = self.products - np.outer(n, n) / n.sum()
        return found

    def _traction_kinematics(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return y (k, 3), J (3, 3) and c (3,) of the class docstring."""
        r = (self.points + x.reshape(-1, 3))[self.nodes]
        y = self._centred_product_matrix @ r
        spread = y.T @ r
        J = np.trace(spread) * np.eye(3) - spread
        return y, J, np.linalg.solve(J, self.moment)

    def value(self, x: Floats) -> float:
        """Raise TypeError: a moment fixed in space has no potential, because its work depends on the path."""
        raise TypeError("a moment that stays in space has no energy")

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the nodal forces of the moment, N, from g."""
        y, _, c = self._traction_kinematics(x)
        g.reshape(-1, 3)[self.nodes] -= scale * np.cross(c, y)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the load stiffness, N/m, unless `projected`: that tangent must stay definite.

        Its block of nodes a and b is -[c]x m_ab - [y_a]x J^-1 (2 c y_b^T - (y_b . c) I - y_b c^T).
        """
        if projected:
            return
        y, J, c = self._traction_kinematics(x)
        changes = 2.0 * np.einsum("i,bj->bij", c, y) - np.einsum("bi,j->bij", y, c)
        changes -= (y @ c)[:, None, None] * np.eye(3)
        across = cross_matrix(y)
        block = -np.einsum("aik,bkj->aibj", across, np.linalg.inv(J) @ changes, optimize=True)
        block -= np.einsum("ab,ij->aibj", self._centred_product_matrix, cross_matrix(c))
        add_blocks(scale * block.reshape(slots.shape), slots, data)

    def rounding(self, x: Floats) -> float:
        """Return zero: the rounding error of this load is far below that of the loaded body."""
        return 0.0


@dataclass(frozen=True)
class ScaledLoad(Energy):
    """A load multiplied by a factor that changes in time."""

    energy: Energy
    share: float

    @property
    def conservative(self) -> bool:
        """True if the load is conservative."""
        return self.energy.conservative

    @property
    def stencils(self) -> Ints:
        """Stencils of the load."""
        return self.energy.stencils

    def value(self, x: Floats) -> float:
        """Return the potential of the scaled load, J."""
        return self.share * self.energy.value(x)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Subtract the scaled forces, N, from g."""
        self.energy.add_gradient(x, g, self.share * scale)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of the scaled load, N/m."""
        self.energy.add_hessian(x, data, slots, self.share * scale, projected)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N."""
        return abs(self.share) * self.energy.rounding(x)
