"""An elastic law of which a part has relaxed: what a step in time makes of a viscoelastic solid.

Over a step from n to n + 1 the stress of branch i goes from H to exp(-h/tau) H + g f(h/tau) (S(F) - S_n), where f(z) =
(1 - exp(-z)) / z is the exact mean of exp(-(t - s)/tau) over the step, so that all is exact where S grows in proportion
to time. Together they are a law again, with an energy: of the state at the end, with a stress `held` that the past has
left.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials import law_for
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.maxwell_branch_energy import OfAny, of_first
from softmark.solvers.materials.small_strain import SmallStrain
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff
from softmark.solvers.materials.strain_measures import Green, Shape, Small, Turned

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.maxwell_branch_energy import OfFirst
    from softmark.solvers.materials.strain_measures import Measure
    from softmark.solvers.materials.viscoelastic import Viscous
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True, eq=False)
class Relaxing:
    """psi = whole - lost part + held : E, over all points at once: `held` (m, q, 3, 3), Pa, is of each.

    Its `part` lacks the share `lost`; E is strain in a `measure`.
    """

    whole: Law
    part: Law
    lost: float
    held: Array
    measure: Measure

    @property
    def law(self) -> Relaxing:
        """As `Varying` has its own: this one has no constants to hand on."""
        return self

    def of(self, which: Any, kind: Any = None) -> Relaxing:
        """The same of some cells."""
        return Relaxing(self.whole, self.part, self.lost, self.held[which], self.measure)

    def at_rest(self, measure: Callable[[Array], Array]) -> Array:
        """What `measure` makes of dP/dF of the whole at rest, at every point (m, q)."""
        found: Array = np.broadcast_to(measure(self.whole.dPdF(np.eye(3)[None])), self.held.shape[:2])
        return found

    def psi(self, F: Array) -> Array:
        """Energy of the step per volume, J/m^3 (n,); +inf outside the domain of the law."""
        found = self.whole.psi(F) - self.lost * self.part.psi(F)
        found += np.einsum("nij,nij->n", self._held, self.measure.strain(F))
        return np.where(np.isnan(found), np.inf, found)

    def P(self, F: Array) -> Array:
        """First Piola-Kirchhoff stress, Pa (n, 3, 3)."""
        return self.whole.P(F) - self.lost * self.part.P(F) + self.measure.pulled(F, self._held)

    def dPdF(self, F: Array) -> Array:
        """dP_iJ/dF_kL, Pa (n, 3, 3, 3, 3): the stress of the past turns with F."""
        A = self.whole.dPdF(F) - self.lost * self.part.dPdF(F)
        self.measure.add_tangent(F, self._held, A)
        return A

    def dPdF_projected(self, F: Array) -> Array:
        """The positive semi-definite 9x9 matrix nearest to dPdF, Pa (n, 3, 3, 3, 3)."""
        return self.dPdF(F) if isinstance(self.measure, Small) else project(self.dPdF(F))

    @property
    def _held(self) -> Array:
        return self.held.reshape(-1, 3, 3)


@dataclass(frozen=True, eq=False)
class Series:
    """What relaxes, and how: the law of its stress, shares `g` (k,) and times `tau` (k,), s.

    `mu` and `bulk` are its moduli at rest in Pa, infinite where no change of volume is of it. `springs` says what those
    of a law store and lose whose stress does not go with strain in the measure.
    """

    part: Law
    g: Array
    tau: Array
    mu: float
    bulk: float
    measure: Measure
    springs: OfFirst | OfAny | None = None

    def compliant(self, S: Array) -> Array:
        """S : C^-1 : S (...), J/m^3, by the moduli at rest: twice what S (..., 3, 3) stores in a small strain."""
        square = np.einsum("...ij,...ij->...", S, S)
        if np.isinf(self.bulk):
            found: Array = square / (2.0 * self.mu)
            return found
        tr = np.einsum("...ii->...", S)
        whole: Array = (square - tr**2 / 3.0) / (2.0 * self.mu) + tr**2 / (9.0 * self.bulk)
        return whole

    def stress(self, F: Array) -> Array:
        """The stress of what relaxes that works with its strain, Pa (n, 3, 3)."""
        return self.measure.stress(self.part, F)

    def energy(self, F: Array) -> Array:
        """Its energy, J/m^3 (n,)."""
        return self.part.psi(F)

    def strain(self, F: Array) -> Array:
        """The strain that works with it (n, 3, 3)."""
        return self.measure.strain(F)

    def relaxed(self, whole: Law, decay: Array, mean: Array, H: Array, S: Array, shape: tuple[int, int]) -> Relaxing:
        """The law of a step from stresses H (k, n, 3, 3) of branches and S (n, 3, 3), Pa, at points (m, q).

        Over it exp(-s/tau) falls to `decay` (k,), and is `mean` (k,).
        """
        held = np.einsum("k,knij->nij", decay, H) - (self.g @ mean) * S
        return Relaxing(whole, self.part, float(self.g @ (1.0 - mean)), held.reshape(*shape, 3, 3), self.measure)


def part_of(material: Viscous, strain: str) -> Law | None:
    """The law of the stress that relaxes, in a measure of strain; None where a material has no such part."""
    elastic: Any = material.law
    if material.of == "whole":
        return None if elastic.incompressible else law_for(elastic, strain)
    if strain != "finite":
        mu = elastic.shear_modulus
        return (SmallStrain if strain == "small" else Corotational)(mu, -2.0 / 3.0 * mu)
    found: Law | None = elastic.isochoric()
    return found


def series_of(material: Viscous, strain: str) -> Series:
    """The series of a material. Raises ValueError where its law has no part that relaxes."""
    if (part := part_of(material, strain)) is None:
        raise ValueError(f"no part of it relaxes in {strain} strain")
    g, tau = (np.array(column) for column in zip(*material.branches, strict=True))
    whole = material.of == "whole"
    bulk = material.bulk_modulus if whole else np.inf
    measures: dict[str, Measure] = {"small": Small(), "corotational": Turned(), "finite": Green() if whole else Shape()}
    linear = strain != "finite" or (whole and isinstance(material.law, StVenantKirchhoff))
    first = None if linear or whole else of_first(material.law)
    springs = None if linear else first or OfAny(part, material.shear_modulus, not whole)
    return Series(part, g, tau, material.shear_modulus, bulk, measures[strain], springs)
