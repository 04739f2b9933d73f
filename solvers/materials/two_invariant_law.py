"""Laws of two invariants of F, I1 = tr F^T F and J = det F, evaluated from a few numbers per point."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.solvers.materials.hyperelastic import Hyperelastic
from softmark.solvers.materials.tensor_components import (
    add_identity,
    add_outer,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
    inner,
    set_outer,
    trace,
    volume_change,
)
from softmark.solvers.runtime.scalar_or_array import expm1

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array
    from softmark.solvers.materials.principal_axes_law import Principal


class TwoInvariantLaw(Hyperelastic):
    """Base class of laws psi(I1, J), evaluated from a few numbers per point.

    P = a F + s C, dP/dF = a 1 + s dC/dF + c (F (x) C + C (x) F) + d C (x) C, with C = cof F. A subclass computes a, s,
    c, d from I1 - 3 and j = J - 1, which are known without cancellation. An energy may use these numbers instead of
    tensors.
    """

    @abstractmethod
    def energy(self, stretch: Array, j: Array) -> Array:
        """Return psi (m,), J/m^3, from I1 - 3 (m,) and J - 1 (m,); +inf if J <= 0."""

    @abstractmethod
    def slopes(self, stretch: Array, j: Array) -> tuple[Array, Array]:
        """Return a = 2 dpsi/dI1 and s = dpsi/dJ (m,), Pa."""

    @abstractmethod
    def curvatures(self, stretch: Array, j: Array) -> tuple[Array | None, Array]:
        """Return c = 2 d2psi/dI1 dJ, or None if zero, and d = d2psi/dJ2 (m,), Pa; psi is linear in I1."""

    def _psi(self, f: Array) -> Array:
        return self.energy(*shifted_invariants(f))

    def _P(self, f: Array) -> Array:
        a, s = self.slopes(*shifted_invariants(f))
        P = cofactor(f)
        P *= s
        P += a * f
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        stretch, j = shifted_invariants(f)
        (a, s), (c, d) = self.slopes(stretch, j), self.curvatures(stretch, j)
        C, rows = cofactor(f).reshape(9, -1), f.reshape(9, -1)
        set_outer(H, C, d * C if c is None else d * C + c * rows)
        if c is not None:
            add_outer(H, c * rows, C)
        add_tensor_cross_product(H, s * f)
        add_identity(H, a)

    def principal(self, e: Sequence[Any]) -> Principal:
        """Return psi, tau and d tau/de for logarithmic principal stretches e (principal_axes_law.py)."""
        x, j = [expm1(2.0 * a) for a in e], expm1(e[0] + e[1] + e[2])
        stretch, J, own = x[0] + x[1] + x[2], 1.0 + j, [1.0 + a for a in x]
        (a, s), (c, d) = self.slopes(stretch, j), self.curvatures(stretch, j)
        rest, bend = a + s * J, (s + d * J) * J
        coupled = 0.0 if c is None else c * J
        bent = [[bend + coupled * (one + other) for other in own] for one in own]
        for k in range(3):
            bent[k][k] = bent[k][k] + 2.0 * a * own[k]
        return self.energy(stretch, j), [a * one + rest for one in x], bent


def shifted_invariants(f: Array) -> tuple[Array, Array]:
    """Return I1 - 3 and J - 1 (m,)."""
    h = displacement_gradient(f)
    return 2.0 * trace(h) + inner(h, h), volume_change(h)
