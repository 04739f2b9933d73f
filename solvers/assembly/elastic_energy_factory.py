"""Construction of the elastic energy of a mesh from a material and a strain measure, in its fastest form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from softmark.solvers.assembly.pressure_predictor import ElasticWithGivenPressures, is_volumetric
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic, ElasticLaw, EnergySum
from softmark.solvers.energies.energy import Energy
from softmark.solvers.materials import Isotropic, damping_tangents_for, law_for, shear_and_volume_laws
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, mean_gradients
from softmark.solvers.mesh.mesh import Mesh


def elastic_energy(mesh: Mesh, elastic: Elastic, material: Isotropic, strain: str, selective: bool = False) -> Energy:
    """Return the elastic energy of a material in a strain measure, over the cells and points of `elastic`.

    If `selective`, the volume part is integrated once per cell (see `elastic_parts`).
    """
    parts = elastic_parts(mesh, elastic, material, strain, selective)
    first, *others = (_with_pressure_prediction(part, material, strain) for part in parts)
    if others:
        return EnergySum((first, *others))
    if isinstance(first.law, Corotational) and mesh.element.constant:
        return CorotationalTets(first.cells, first.dNdX, first.w, first.law)
    return first


def elastic_parts(
    mesh: Mesh, elastic: Elastic, material: Isotropic, strain: str, selective: bool = False
) -> tuple[Elastic, ...]:
    """Return the elastic energy of a material as one energy, or as two for selective integration.

    If `selective`, shear is integrated at all points, and the volume part once per cell with the mean gradient. A law
    that cannot be split is integrated at all points. The volume part is the energy proportional to lambda. At small
    strain this is B-bar with the mean volumetric strain (Hughes 1980). At finite strain it is psi_lambda of the mean of
    F, which has an energy and a symmetric tangent, unlike F-bar (de Souza Neto et al. 1996).
    """
    laws = shear_and_volume_laws(material, strain) if selective else None
    if laws is None:
        whole, _ = damping_tangents_for(material, strain) or (None, None)
        return (replace(elastic, law=law_for(material, strain), drag=whole),)
    once, mean = mean_gradients(mesh, type(elastic) is not Elastic), _with_mean_moduli(material, elastic)
    of_volume, (_, volume) = (
        shear_and_volume_laws(mean, strain) or laws,
        damping_tangents_for(mean, strain) or (None, None),
    )
    return replace(elastic, law=laws[0], drag=None), energy_at_other_points(elastic, mesh, once, of_volume[1], volume)


def _with_mean_moduli(material: Isotropic, elastic: Elastic) -> Isotropic:
    """Return the material with one value of each modulus per cell: the mean if it varies within cells."""
    if not material.sampled:
        return material
    from softmark.solvers.materials.heterogeneous import average_moduli

    return average_moduli(material, elastic.w)


def energy_at_other_points(
    elastic: Elastic, mesh: Mesh, at: IntegrationPoints, law: ElasticLaw, drag: Any = None
) -> Elastic:
    """Return the energy of a law over the cells of `elastic`, at the integration points `at`.

    It is axisymmetric if `elastic` is. `drag` is the law used for stiffness-proportional damping.
    """
    made = Elastic(mesh.cells, at.dNdX, at.w, law, drag=drag)
    if type(elastic) is Elastic:
        return made
    from softmark.solvers.energies.axisymmetric import AxisymmetricElastic

    return (
        AxisymmetricElastic.of(made, at.N, mesh.points, elastic.depth)
        if isinstance(elastic, AxisymmetricElastic)
        else made
    )


def _with_pressure_prediction(part: Elastic, material: Isotropic, strain: str) -> Elastic:
    """Return the energy in a form whose tangent can use predicted pressures; unchanged if it has no volumetric part."""
    laws = shear_and_volume_laws(material, strain) if strain == "finite" else None
    if laws is None or not is_volumetric(laws[1]) or part.law == laws[0] or type(part) is not Elastic:
        return part
    volume = part.law if is_volumetric(part.law) else laws[1]
    return ElasticWithGivenPressures(part.cells, part.dNdX, part.w, part.law, drag=part.drag, volume=volume)
