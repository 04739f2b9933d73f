"""Fung orthotropic material: exponential of a quadratic form of Green's strain in three directions."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.materials.anisotropic_material import (
    Anisotropic,
    Bulk,
    Density,
    Fibres,
    Sheets,
    dyad,
    transform_direction,
)
from softmark.solvers.materials.tensor_components import (
    add_diagonal,
    add_geometric_stiffness,
    add_outer,
    cofactor,
    displacement_gradient,
    green_strain,
    product,
    volume_change,
)

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # index pairs of f, s and n


class ExponentialStrainLaw(Anisotropic):
    """Exponential law psi = C/2 (exp Q - 1) of a quadratic form Q of Green's strain E in material axes.

    Q = sum b_ab E_ab^2 over the axes a, b of fibres f, sheets s and normals n, with E_ab = a . E b.
    """

    stiffness: float

    @property
    @abstractmethod
    def exponents(self) -> tuple[float, ...]:
        """Coefficients b_ab in the order of PAIRS."""

    @property
    def shear_modulus(self) -> float:
        """Shear modulus C (2 (b_ff + b_ss + b_nn) + 3 (b_fs + b_fn + b_sn)) / 30, Pa."""
        b = self.exponents
        return self.stiffness * (2.0 * sum(b[:3]) + 3.0 * sum(b[3:])) / 30.0

    def _strains(self, f: Array, axes: Array) -> list[Array]:
        """Return the strains E_ab (m,) in the order of PAIRS, accurate near rest."""
        E = green_strain(displacement_gradient(f))
        turned = [transform_direction(E, d) for d in axes]
        return [sum(axes[a][i] * turned[b][i] for i in range(3)) for a, b in PAIRS]

    def _quadratic_form(self, e: list[Array]) -> Array:
        """Return the quadratic form Q (m,) of strains e in the order of PAIRS."""
        found: Array = sum(  # type: ignore[assignment]
            (1.0 if a == b else 2.0) * w * x * x for (a, b), w, x in zip(PAIRS, self.exponents, e, strict=True)
        )
        return found

    def _half_form_derivative(self, e: list[Array], axes: Array) -> Array:
        """Return T = dQ/dE / 2 (3, 3, m)."""
        rows: list[list[Array | float]] = [[0.0] * 3 for _ in range(3)]
        for (a, b), w, x in zip(PAIRS, self.exponents, e, strict=True):
            rows[a][b] = rows[b][a] = w * x
        each = [sum(rows[a][b] * axes[b] for b in range(3)) for a in range(3)]
        found: Array = sum(axes[a][:, None] * each[a][None] for a in range(3))
        return found

    def waves(self, f: Array, directions: Array, bulk: Any, tension: float) -> Array:
        """Return F^-1 Q(n) F^-T / (C exp Q), the scaled acoustic tensor, for f (3, 3, m), in fibre axes.

        The shape is (d, 3, 3, m) for the d `directions`, and no stiffness is formed. With S = C exp(Q) T, C' = F^T F
        and an additional volume stiffness `bulk` K, Pa, it is (n.T n) C'^-1 + D(n) + 2 T n (x) T n + K J^2/(C exp Q)
        C'^-1 n (x) C'^-1 n, where D v.v = sum b_ab e_ab^2 of e = sym(v (x) n). It is positive definite where Q(n) is. A
        `tension`, Pa, acts along the fibres.
        """
        e = self._strains(f, self.frame.axes(f.dtype))
        c = self.stiffness * np.exp(self._quadratic_form(e))
        T, E = np.empty((2, 3, 3, f.shape[2]), dtype=f.dtype)
        for (a, b), w, x in zip(PAIRS, self.exponents, e, strict=True):
            T[a, b] = T[b, a] = w * x
            E[a, b] = E[b, a] = x
        J = 1.0 + volume_change(displacement_gradient(f))
        inverse = cofactor(add_diagonal(2.0 * E, 1.0)) / (J * J)
        K = (self._volume_term_modulus + bulk) * J * J / c
        found = np.empty((len(directions), *f.shape), dtype=f.dtype)
        for n, W in zip(directions, found, strict=True):
            v = transform_direction(T, n)
            stress = n[0] * v[0] + n[1] * v[1] + n[2] * v[2] + tension / c * n[0] ** 2
            W[...] = stress * inverse + 2.0 * v[:, None] * v
            W += self._direction_form_matrix(n)[:, :, None]
            through = transform_direction(inverse, n)
            W += K * through[:, None] * through
        return found

    def _direction_form_matrix(self, n: Array) -> Array:
        """Return D(n) (3, 3), with D v.v = sum b_ab e_ab^2 of e = sym(v (x) n) over all a and b."""
        found = np.zeros((3, 3))
        for (a, b), w in zip(PAIRS, self.exponents, strict=True):
            if a == b:
                found[a, a] += w * n[a] ** 2
            else:  # 2 b e^2, e = (v_a n_b + v_b n_a)/2
                part = np.zeros(3)
                part[a], part[b] = n[b], n[a]
                found += 0.5 * w * np.outer(part, part)
        return found

    def elliptic(self, f: Array) -> Array:
        """Return for which f (3, 3, m) strong ellipticity is proved by a lower bound (m,).

        It is proved where half the least exponent b times 1 - 2 |E| exceeds |T|. Reason: for e = sym(F^T a (x) n),
        |e|^2 >= |F^T a|^2 / 2, the form a n : A : a n = |a|^2 n.S n + d2psi/dE2 e e, with S = C exp(Q) T, is then
        positive; the term K (J - 1)^2 only adds to it.
        """
        e = self._strains(f, self.frame.axes(f.dtype))
        rest = [(1.0 if a == b else 2.0) * x * x for (a, b), x in zip(PAIRS, e, strict=True)]
        size = np.sqrt(sum(rest))
        stress = np.sqrt(sum(w * w * x for w, x in zip(self.exponents, rest, strict=True)))
        return np.asarray(0.5 * min(self.exponents) * (1.0 - 2.0 * size) > stress)

    def _shape_psi(self, f: Array, axes: Array) -> Array:
        return 0.5 * self.stiffness * np.expm1(self._quadratic_form(self._strains(f, axes)))

    def _shape_P(self, f: Array, axes: Array) -> Array:
        e = self._strains(f, axes)
        return product(f, (self.stiffness * np.exp(self._quadratic_form(e))) * self._half_form_derivative(e, axes))

    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        """Write delta_ik S_JL + c (2 (F T) (x) (F T) + sum b_ab G_ab (x) G_ab), c = C exp Q, G_ab = sym(F a (x) b)."""
        e = self._strains(f, axes)
        c, T = self.stiffness * np.exp(self._quadratic_form(e)), self._half_form_derivative(e, axes)
        H[...] = 0.0
        add_geometric_stiffness(H, c * T)
        through = product(f, T).reshape(9, -1)
        add_outer(H, (2.0 * c) * through, through)
        moved = [transform_direction(f, d) for d in axes]
        for (a, b), w in zip(PAIRS, self.exponents, strict=True):
            if a == b:
                G = dyad(moved[a], axes[a])
                add_outer(H, (w * c) * G, G)
            else:
                G = dyad(moved[a], axes[b]) + dyad(moved[b], axes[a])
                add_outer(H, (0.5 * w * c) * G, G)


@dataclass(frozen=True)
class FungOrthotropic(ExponentialStrainLaw):
    """Fung's orthotropic tissue: exponential stiffening with separate constants along fibres, sheets and their normal.

    psi = C/2 (exp Q - 1) + K/2 (J - 1)^2, with Green's strain E along fibres f, sheets s and n = f x s Q = bff
    Eff^2 + bss Ess^2 + bnn Enn^2 + 2 bfs Efs^2 + 2 bfn Efn^2 + 2 bsn Esn^2 Compression is resisted like
    tension. Without `bulk` J = 1, and `formulation = mixed` finds the pressure.
    Source: Fung, Fronek, Patitucci (1979), "Pseudoelasticity of arteries and the choice of its mathematical
    expression"; Costa, Holmes, McCulloch (2001), "Modelling cardiac mechanical properties in three
    dimensions", without terms that couple normal strains.
    """

    sheeted = True

    stiffness: Annotated[float, "Pa in (0, inf)", "C, factor of all stresses"]
    bff: Annotated[float, "1 in (0, inf)", "coefficient in Q of the strain along the fibres"]
    bss: Annotated[float, "1 in (0, inf)", "coefficient in Q of the strain along the sheets"]
    bnn: Annotated[float, "1 in (0, inf)", "coefficient in Q of the strain along their normal"]
    bfs: Annotated[float, "1 in (0, inf)", "coefficient in Q of the shear between fibres and sheets"]
    bfn: Annotated[float, "1 in (0, inf)", "coefficient in Q of the shear between fibres and normal"]
    bsn: Annotated[float, "1 in (0, inf)", "coefficient in Q of the shear between sheets and normal"]
    density: Density
    fibres: Fibres
    sheets: Sheets = None
    bulk: Bulk = None

    @property
    def exponents(self) -> tuple[float, ...]:
        """Coefficients b_ab in the order of PAIRS."""
        return self.bff, self.bss, self.bnn, self.bfs, self.bfn, self.bsn
