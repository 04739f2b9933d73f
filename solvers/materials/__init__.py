"""Materials, and the constitutive laws made from them.

A material is a word of a scene: constants with units. A law is a set of functions psi, P and dPdF of a batch of
deformation gradients (constitutive_law.py); `law_for` makes one from a material and the strain measure of a model.

To add a material, write one file with a dataclass, and add one line to MATERIALS. If its constants are two elastic
moduli, derive it from `Isotropic` (hyperelastic.py describes its law). If it has constants of its own, derive it from
`IsochoricInvariantMaterial` or `PrincipalStretchMaterial` (isochoric_split.py). Constants may be arrays, one value per
evaluation point, so do not branch on them with `if`.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from softmark.solvers.materials.active_strain import ActiveStrain
from softmark.solvers.materials.active_stress import Active
from softmark.solvers.materials.arruda_boyce import ArrudaBoyce
from softmark.solvers.materials.biphasic import Biphasic
from softmark.solvers.materials.constitutive_law import Law, project
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.materials.damping_tangent import DampingTangent
from softmark.solvers.materials.fung import Fung
from softmark.solvers.materials.fung_orthotropic import FungOrthotropic
from softmark.solvers.materials.gent import Gent
from softmark.solvers.materials.guccione import Guccione
from softmark.solvers.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from softmark.solvers.materials.holzapfel_ogden import HolzapfelOgden
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.linear_elastic import LinearElastic
from softmark.solvers.materials.mooney_rivlin import MooneyRivlin
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.materials.neo_hookean_isochoric import NeoHookeanIsochoric
from softmark.solvers.materials.ogden import Ogden
from softmark.solvers.materials.small_strain import SmallStrain
from softmark.solvers.materials.st_venant_kirchhoff import StVenantKirchhoff
from softmark.solvers.materials.stable_neo_hookean import StableNeoHookean
from softmark.solvers.materials.transversely_isotropic import TransverselyIsotropic
from softmark.solvers.materials.veronda_westmann import VerondaWestmann
from softmark.solvers.materials.viscoelastic import Viscoelastic
from softmark.solvers.materials.volumetric_constraints import CorotationalDilatation, Dilatation, MixedSplit
from softmark.solvers.materials.yeoh import Yeoh

if TYPE_CHECKING:
    import numpy as np
else:
    from softmark.solvers.runtime.lazy_modules import np

__all__ = [
    "DIRECTED", "MATERIALS", "STRAINS", "WORDS", "Isotropic", "Law", "NoFiniteLaw", "drags_for", "law_for", "mixed_for",
    "parts_for", "project",
]  # fmt: skip

MATERIALS: dict[str, type[Isotropic]] = {
    "linear_elastic": LinearElastic,
    "neo_hookean": NeoHookean,
    "neo_hookean_isochoric": NeoHookeanIsochoric,
    "st_venant_kirchhoff": StVenantKirchhoff,
    "stable_neo_hookean": StableNeoHookean,
    "mooney_rivlin": MooneyRivlin,
    "ogden": Ogden,
    "yeoh": Yeoh,
    "gent": Gent,
    "arruda_boyce": ArrudaBoyce,
    "fung": Fung,
    "veronda_westmann": VerondaWestmann,
}

DIRECTED: dict[str, type[Any]] = {  # anisotropic materials
    "transversely_isotropic": TransverselyIsotropic,
    "holzapfel_gasser_ogden": HolzapfelGasserOgden,
    "holzapfel_ogden": HolzapfelOgden,
    "guccione": Guccione,
    "fung_orthotropic": FungOrthotropic,
    "active": Active,
    "active_strain": ActiveStrain,
}

# words for materials in scenes: laws, and materials that wrap another one
WORDS: Mapping[str, type[Any]] = ChainMap({"viscoelastic": Viscoelastic, "biphasic": Biphasic}, DIRECTED, MATERIALS)


class NoFiniteLaw(Exception):
    """Error raised if a material has no law at finite strain."""

    def __init__(self, material: Isotropic) -> None:
        super().__init__(f"{type(material).__name__} has no finite-strain law; use small or corotational strain")
        self.material = material


def _small_strain_law(material: Isotropic) -> Law:
    """Return the small-strain law with the moduli of the material at rest."""
    return SmallStrain(material.shear_modulus, material.lame_lambda)


def _corotational_law(material: Isotropic) -> Law:
    """Return the corotational law with the moduli of the material at rest."""
    return Corotational(material.shear_modulus, material.lame_lambda)


def _finite_strain_law(material: Isotropic) -> Law:
    """Return the finite-strain law of the material. Raises NoFiniteLaw if it has none."""
    law = material.finite_law()
    if law is None:
        raise NoFiniteLaw(material)
    return law


STRAINS: dict[str, Callable[[Isotropic], Law]] = {
    "small": _small_strain_law,
    "corotational": _corotational_law,
    "finite": _finite_strain_law,
}


def law_for(material: Isotropic, strain: str) -> Law:
    """Return the law of `material` for a model with the strain measure `strain`, a key of STRAINS.

    The laws for `small` and `corotational` strain use the moduli at rest of any material; for `finite` strain it is the
    material's finite-strain law. For a plate the result is the law in plane stress. Raises NoFiniteLaw if the material
    has no finite-strain law, and KeyError for a strain that is not in STRAINS.
    """
    law = STRAINS[strain](material)
    if material.thin:
        from softmark.solvers.materials.plane_stress import PlaneStress

        law = PlaneStress(law)
    found: Law = _heterogeneous_law(material, law)
    return found


def _heterogeneous_law(material: Isotropic, law: Any) -> Any:
    """Return the law, or damping tangent, wrapped in `HeterogeneousLaw` if constants of the material are arrays.

    Otherwise the law itself is returned.
    """
    if not material.sampled:
        return law
    from softmark.solvers.materials.heterogeneous import HeterogeneousLaw, iterate_arrays

    known = next(iterate_arrays(law), None)  # the moduli at rest do not depend on directions
    return law if known is None else HeterogeneousLaw(law)


def shear_and_volume_laws(material: Isotropic, strain: str) -> tuple[Law, Law] | None:
    """Return two laws whose sum is `law_for`: the shear part, proportional to mu, and the volume part.

    The volume part is proportional to lam, or to the bulk modulus if the law is written with it. Return None if the law
    cannot be split.
    """
    if material.thin:
        return None
    parts = _shear_volume_laws(material, strain)
    return None if parts is None else (_heterogeneous_law(material, parts[0]), _heterogeneous_law(material, parts[1]))


def _shear_volume_laws(material: Isotropic, strain: str) -> tuple[Law, Law] | None:
    """Return the two laws of `shear_and_volume_laws`, without constants that differ from point to point."""
    mu, lam = material.shear_modulus, material.lame_lambda
    if strain == "small":
        return SmallStrain(mu, 0.0), SmallStrain(0.0, lam)
    if strain == "corotational":
        return Corotational(mu, 0.0), Corotational(0.0, lam)
    return material.finite_parts()


def mixed_for(material: Isotropic, strain: str) -> MixedSplit | None:
    """Return `law_for` split into a shape law and a volume constraint, for elements with pressures.

    The split is valid for every Poisson's ratio, including 0.5. Return None if the law cannot be split.
    """
    if material.thin:
        return None
    mu, K = material.shear_modulus, material.bulk_modulus
    if strain == "small":
        return MixedSplit(_heterogeneous_law(material, SmallStrain(mu, -2.0 / 3.0 * mu)), Dilatation(), K)
    if strain == "corotational":
        return MixedSplit(_heterogeneous_law(material, Corotational(mu, -2.0 / 3.0 * mu)), CorotationalDilatation(), K)
    parts = material.finite_mixed()
    if parts is None:
        return None
    shape, constraint = parts
    return MixedSplit(_heterogeneous_law(material, shape), constraint, material.pressure_modulus)


def damping_tangents_for(material: Isotropic, strain: str) -> tuple[DampingTangent, DampingTangent] | None:
    """Return the damping tangents of the whole law and of its volume part (the second of `shear_and_volume_laws`).

    Return None for small strains, whose tangent contains no stress, or if the law cannot be split.
    """
    laws: Any = None if material.thin else _shear_volume_laws(material, strain)
    if strain == "small" or laws is None:
        return None
    mixed = mixed_for(material, strain)
    if mixed is None:
        return None
    modulus = _volume_modulus(_heterogeneous_law(material, laws[1]))
    drags = DampingTangent(laws[0], mixed.constraint, modulus), DampingTangent(None, mixed.constraint, modulus)
    return _heterogeneous_law(material, drags[0]), _heterogeneous_law(material, drags[1])


def _volume_modulus(law: Any) -> Any:
    """Return the modulus M of a volume law M/2 g^2, Pa, for each point if it varies.

    It is read from the stiffness at rest, because dg/dF is the identity there for every g.
    """
    if hasattr(law, "at_rest"):
        return law.at_rest(lambda A: A[:, 0, 0, 0, 0])
    return float(law.dPdF(np.eye(3)[None])[0, 0, 0, 0, 0])
