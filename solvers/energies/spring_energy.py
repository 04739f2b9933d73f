"""Linear springs between points, and the spring stiffnesses of a network that represents a given modulus.

A network of central forces at rest obeys the Cauchy relation C1122 = C1212 for any spring stiffnesses. So an isotropic
network always has a Poisson ratio of 1/4 (Love 1906, note B; Born and Huang 1954).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Energy, Floats, Ints
from softmark.solvers.runtime.kernel_cache import allocating_kernel


@dataclass(frozen=True)
class Springs(Energy):
    """Spring energy: sum over springs of k/2 (l - l0)^2 with l = |D + u_b - u_a| and l0 = |D|.

    `edges` (n, 2) are the two nodes a, b of each spring, `D` (n, 3) is the vector from a to b at rest in m, and `k`
    (n,) the spring stiffness in N/m. The state x is the displacement (3 nodes,).
    """

    edges: Ints
    D: Floats
    k: Floats
    conservative: bool = True

    @cached_property
    def l0(self) -> Floats:
        """Lengths at rest (n,), m."""
        lengths: Floats = np.linalg.norm(self.D, axis=1)
        return lengths

    @cached_property
    def stencils(self) -> Ints:
        """Degrees of freedom of each spring, three per end (n, 6)."""
        return (3 * self.edges[:, :, None] + np.arange(3)).reshape(len(self.edges), 6)

    def lengths(self, x: Floats) -> Floats:
        """Return the current lengths (n,), m."""
        u = x.reshape(-1, 3)
        found: Floats = np.linalg.norm(self.D + u[self.edges[:, 1]] - u[self.edges[:, 0]], axis=1)
        return found

    @cached_property
    def _nodal_stiffness_sums(self) -> Floats:
        """Sum of the stiffnesses that meet at each node (nodes,), N/m."""
        return np.bincount(self.edges.ravel(), np.repeat(self.k, 2)).astype(float)

    def rounding(self, x: Floats) -> float:
        """Return the norm of the rounding error in the gradient, N.

        It is machine epsilon times the force that a stretch by the largest length or displacement would cause.
        """
        largest = max(float(self.l0.max(initial=0.0)), float(np.abs(x).max(initial=0.0)))
        return float(np.finfo(np.float64).eps * largest * np.linalg.norm(self._nodal_stiffness_sums))

    def value(self, x: Floats) -> float:
        """Return the strain energy, J."""
        return float(0.5 * self.k @ (self.lengths(x) - self.l0) ** 2)

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add the nodal forces, N: k (l - l0) n on b and the opposite on a, with n the direction from a to b."""
        u = np.ascontiguousarray(x).reshape(-1, 3)
        add_spring_forces(u, self.edges, self.D, self.l0, self.k, scale, g.reshape(-1, 3))

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the stiffness k n n^T + k (1 - l0/l) (I - n n^T), N/m.

        The second part is negative in a compressed spring. If `projected`, it is then omitted, so that no negative
        eigenvalue remains.
        """
        u = np.ascontiguousarray(x).reshape(-1, 3)
        add_spring_stiffness(u, self.edges, self.D, self.l0, self.k, scale, projected, slots, data)


def stiffness_from_modulus(young: float, weight: Floats, l0: Floats) -> Floats:
    """Return the spring stiffnesses k = E W / l0^2 (n,), N/m, of a network that represents Young's modulus E, Pa.

    `weight` W (n,), m^3, is the volume of the cells around a spring, each multiplied by a factor. With a factor of 1
    this is the rule of Van Gelder (1998, J. Graphics Tools 3(2):21) for tetrahedra. A tetrahedron has six edges, so the
    sum of k l0^2 is 6 E V. A homogeneously strained network whose springs point equally in all directions then has
    lambda = mu = sum(k l0^2) / 15 V = 2E/5, which is Young's modulus E at nu = 1/4. The factor of the paper is
    therefore right as an average over directions, and not cell by cell.
    """
    stiffness: Floats = young * weight / l0**2
    return stiffness


@allocating_kernel
def add_spring_forces(u: Floats, edges: Ints, D: Floats, l0: Floats, k: Floats, scale: float, g: Floats) -> None:
    """Add the nodal forces of springs, N, to g (nodes, 3): scale k (l - l0) n at end b and the opposite at end a.

    A spring of zero current length has no direction and exerts no force.
    """
    d = np.empty(3)
    for s in range(edges.shape[0]):
        a, b = edges[s, 0], edges[s, 1]
        for i in range(3):
            d[i] = D[s, i] + u[b, i] - u[a, i]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length == 0.0:
            continue
        tension = scale * k[s] * (length - l0[s]) / length
        for i in range(3):
            g[a, i] -= tension * d[i]
            g[b, i] += tension * d[i]


@allocating_kernel
def add_spring_stiffness(
    u: Floats,
    edges: Ints,
    D: Floats,
    l0: Floats,
    k: Floats,
    scale: float,
    projected: bool,
    slots: Ints,
    data: Floats,
) -> None:
    """Add the stiffness of springs to the matrix values: data[slots] += scale [[H, -H], [-H, H]], N/m.

    H = k n n^T + k c (I - n n^T) with c = 1 - l0/l, or max(c, 0) if `projected`. A spring of zero current length has no
    direction and is skipped.
    """
    d = np.empty(3)
    for s in range(edges.shape[0]):
        a, b = edges[s, 0], edges[s, 1]
        for i in range(3):
            d[i] = D[s, i] + u[b, i] - u[a, i]
        square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        if square == 0.0:
            continue
        across = 1.0 - l0[s] / np.sqrt(square)
        if projected and across < 0.0:
            across = 0.0
        for i in range(3):
            for j in range(3):
                value = scale * k[s] * (1.0 - across) * d[i] * d[j] / square
                if i == j:
                    value += scale * k[s] * across
                for end in range(4):
                    slot = slots[s, 3 * (end // 2) + i, 3 * (end % 2) + j]
                    if slot >= 0:
                        data[slot] += value if end in (0, 3) else -value
