"""Elastic law of one time step of a viscoelastic solid, in which part of the stress has relaxed.

Over a step from n to n + 1 the stress of branch i changes from H to exp(-h/tau) H + g f(h/tau) (S(F) - S_n), where f(z)
= (1 - exp(-z)) / z is the exact mean of exp(-(t - s)/tau) over the step. So the result is exact if S grows linearly in
time. The sum of all stresses at the end of the step is again a law with an energy. It contains the stress `held` that
remains from the past.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials import law_for
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.maxwell_branch_energy import IsotropicBranch, first_invariant_branch
from softmark.solvers.materials.small_strain import SmallStrain
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff
from softmark.solvers.materials.strain_measures import BiotStrain, GreenStrain, IsochoricStrain, SmallStrainMeasure

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.maxwell_branch_energy import FirstInvariantBranch
    from softmark.solvers.materials.strain_measures import StrainMeasure
    from softmark.solvers.materials.viscoelastic import Viscoelastic
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True, eq=False)
class ViscoelasticStepLaw:
    """Law of a viscoelastic step: psi = psi of `whole` - `lost` times psi of `part` + `held` : E.

    `whole` is the instantaneous law, and `part` the law of its relaxing part, of which the fraction `lost` has relaxed.
    `held` (m, q, 3, 3), Pa, is the stress that remains from the past at each point. E is the strain in a `measure`.
    """

    whole: Law
    part: Law
    lost: float
    held: Array
    measure: StrainMeasure

    @property
    def law(self) -> ViscoelasticStepLaw:
        """The law itself, for code that reads the wrapped law of a `HeterogeneousLaw`.

        Its own constants do not differ from point to point.
        """
        return self

    def of(self, which: Any, kind: Any = None) -> ViscoelasticStepLaw:
        """Return the law of the cells `which`, in the floating-point type `kind` if given."""
        return ViscoelasticStepLaw(self.whole, self.part, self.lost, self.held[which], self.measure)

    def at_rest(self, measure: Callable[[Array], Array]) -> Array:
        """Return a measure (m, q) of the stiffness of the undeformed material, by the whole law, at every point.

        `measure` maps tensors dP/dF (k, 3, 3, 3, 3), Pa, to numbers (k,).
        """
        found: Array = np.broadcast_to(measure(self.whole.dPdF(np.eye(3)[None])), self.held.shape[:2])
        return found

    def psi(self, F: Array) -> Array:
        """Return the energy of the step per volume, J/m^3 (n,); +inf outside the domain of the law."""
        found = self.whole.psi(F) - self.lost * self.part.psi(F)
        found += np.einsum("nij,nij->n", self._remaining_stress, self.measure.strain(F))
        return np.where(np.isnan(found), np.inf, found)

    def P(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, Pa (n, 3, 3)."""
        return self.whole.P(F) - self.lost * self.part.P(F) + self.measure.first_piola_stress(F, self._remaining_stress)

    def dPdF(self, F: Array) -> Array:
        """Return dP_iJ/dF_kL, Pa (n, 3, 3, 3, 3), including the contribution of the remaining stress `held`."""
        A = self.whole.dPdF(F) - self.lost * self.part.dPdF(F)
        self.measure.add_tangent(F, self._remaining_stress, A)
        return A

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (n, 3, 3, 3, 3)."""
        return self.dPdF(F) if isinstance(self.measure, SmallStrainMeasure) else project(self.dPdF(F))

    @property
    def _remaining_stress(self) -> Array:
        return self.held.reshape(-1, 3, 3)


@dataclass(frozen=True, eq=False)
class PronySeries:
    """Prony series of a material: the relaxing law `part`, with fractions `g` (k,) and times `tau` (k,), s.

    `mu` and `bulk` are the moduli at rest of the material, Pa; `bulk` is infinite if only the isochoric stress relaxes.
    `springs` is the branch energy of a law whose stress is not linear in the strain measure.
    """

    part: Law
    g: Array
    tau: Array
    mu: float
    bulk: float
    measure: StrainMeasure
    springs: FirstInvariantBranch | IsotropicBranch | None = None

    def twice_complementary_energy(self, S: Array) -> Array:
        """Return S : C^-1 : S (...), J/m^3, of stresses S (..., 3, 3), Pa, with C the elasticity tensor at rest.

        It is twice the small-strain energy of S.
        """
        square = np.einsum("...ij,...ij->...", S, S)
        if np.isinf(self.bulk):
            found: Array = square / (2.0 * self.mu)
            return found
        tr = np.einsum("...ii->...", S)
        whole: Array = (square - tr**2 / 3.0) / (2.0 * self.mu) + tr**2 / (9.0 * self.bulk)
        return whole

    def stress(self, F: Array) -> Array:
        """Return the relaxing stress that is work-conjugate to `strain`, Pa (n, 3, 3)."""
        return self.measure.stress(self.part, F)

    def energy(self, F: Array) -> Array:
        """Return the energy of the relaxing stress, J/m^3 (n,)."""
        return self.part.psi(F)

    def strain(self, F: Array) -> Array:
        """Return the strain that is work-conjugate to `stress` (n, 3, 3)."""
        return self.measure.strain(F)

    def make_step_law(
        self, whole: Law, decay: Array, mean: Array, H: Array, S: Array, shape: tuple[int, int]
    ) -> ViscoelasticStepLaw:
        """Return the law of a step from branch stresses H (k, n, 3, 3) and stress S (n, 3, 3), Pa, at its start.

        Over the step exp(-s/tau) falls to `decay` (k,) and has the mean `mean` (k,). `shape` is (m, q), for q points in
        m cells.
        """
        held = np.einsum("k,knij->nij", decay, H) - (self.g @ mean) * S
        return ViscoelasticStepLaw(
            whole, self.part, float(self.g @ (1.0 - mean)), held.reshape(*shape, 3, 3), self.measure
        )


def relaxing_part(material: Viscoelastic, strain: str) -> Law | None:
    """Return the law of the relaxing part of the stress for a strain measure; None if there is no such part."""
    elastic: Any = material.law
    if material.of == "whole":
        return None if elastic.incompressible else law_for(elastic, strain)
    if strain != "finite":
        mu = elastic.shear_modulus
        return (SmallStrain if strain == "small" else Corotational)(mu, -2.0 / 3.0 * mu)
    found: Law | None = elastic.isochoric()
    return found


def prony_series(material: Viscoelastic, strain: str) -> PronySeries:
    """Return the Prony series of a material. Raises ValueError if no part of its stress relaxes."""
    if (part := relaxing_part(material, strain)) is None:
        raise ValueError(f"no part of its stress relaxes in {strain} strain")
    g, tau = (np.array(column) for column in zip(*material.branches, strict=True))
    whole = material.of == "whole"
    bulk = material.bulk_modulus if whole else np.inf
    measures: dict[str, StrainMeasure] = {
        "small": SmallStrainMeasure(),
        "corotational": BiotStrain(),
        "finite": GreenStrain() if whole else IsochoricStrain(),
    }
    linear = strain != "finite" or (whole and isinstance(material.law, StVenantKirchhoff))
    first = None if linear or whole else first_invariant_branch(material.law)
    springs = None if linear else first or IsotropicBranch(part, material.shear_modulus, not whole)
    return PronySeries(part, g, tau, material.shear_modulus, bulk, measures[strain], springs)
