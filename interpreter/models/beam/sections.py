"""What a rod knows of a cross-section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.solvers.energies.rod_section import RodSection

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Section


def of_section(section: Section, material: Any) -> RodSection:
    """Of a shape, along whose first and second axis e2 and e3 lie, made of a material."""
    I2, I3 = section.moments  # about its first and its second axis: about e2 the distance is X3
    kappa = section.shear_factor(material.poisson)
    return RodSection(section.area, I2, I3, section.torsion, kappa, kappa, material.young, material.shear_modulus)
