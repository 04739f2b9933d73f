"""Cauchy stress and displacement gradients at points inside cells, by the law used in the solution."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.energies import displacement_gradient_scaling
from softmark.solvers.materials import Isotropic, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.materials.volumetric_constraints import MixedSplit
from softmark.solvers.mesh.element_interpolation import IntegrationPoints, Rule, integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Floats, Mesh
from softmark.solvers.mesh.pressure_interpolation import build_pressure_space

AXIS = 1e-9  # relative to the extent: closer points lie on the axis
SYMMETRIC = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # xx, yy, zz, xy, yz, zx


class StressUnavailable(Exception):
    """Raised if the model has no law that gives a stress; the message gives the reason."""


@dataclass(frozen=True)
class DeformedState:
    """Deformed mesh with the material of its cells.

    `u` (n, 3), m, are the displacements of its nodes. `way` is the treatment of near-incompressibility: full,
    selective, mean_dilatation or mixed. For `mixed`, `pressures` (m, b), Pa, are the solved pressures, positive in
    tension. In a `plane` model nothing varies along z. A `revolved` mesh is the meridian of a body of revolution about
    the y axis. For a material that varies in space, `at` returns the material with arrays of its constants at the
    points of a quadrature rule.
    """

    mesh: Mesh
    material: Isotropic
    strain: str
    u: Floats
    way: str = "full"
    pressures: Floats | None = None
    plane: bool = False
    revolved: bool = False
    at: Callable[[Isotropic, Mesh, Rule], Isotropic] | None = None

    def _material_at_rule(self, rule: Rule) -> Isotropic:
        """Return the material at the points of a quadrature rule.

        If it varies in space, its constants are arrays over these points.
        """
        return self.material if self.at is None or self.material.uniform else self.at(self.material, self.mesh, rule)

    def _cell_mean_material(self) -> Isotropic:
        """Return the material with one value of each modulus per cell, the mean over the cell."""
        rule = self.mesh.element.quadrature()
        if not (known := self._material_at_rule(rule)).sampled:
            return known
        from softmark.solvers.materials.heterogeneous import average_moduli

        return average_moduli(known, self._point_volumes(rule))

    def _point_volumes(self, rule: Rule) -> Floats:
        """Return the volumes (m, q), m^3, of the points of a quadrature rule.

        For a body of revolution they are multiplied by the radius, m, and so proportional to the volumes of whole
        rings.
        """
        parts = integrate_cells(self.mesh, rule=rule)
        return parts.w * (self.mesh.points[self.mesh.cells, 0] @ parts.N.T) if self.revolved else parts.w

    def sampled(self, rule: Rule) -> tuple[Floats, Floats, Floats]:
        """Return positions, stresses and displacement gradients at the points of a quadrature rule in all cells.

        These are positions (m, q, 3), m, Cauchy stresses (m, q, 6), Pa, ordered as SYMMETRIC, and H = du/dX (m, q, 9).
        Raises StressUnavailable.
        """
        N = self.mesh.element.shape(rule[0])
        X = np.einsum("qa,mai->mqi", N, self.mesh.points[self.mesh.cells])
        H = self._displacement_gradients(rule)
        sigma = self._cauchy_stress(H, rule)
        if not np.all(np.isfinite(sigma)):
            raise StressUnavailable("the stress is not finite in every cell")
        six = np.stack([sigma[..., i, j] for i, j in SYMMETRIC], axis=-1)
        return X, six, H.reshape(*H.shape[:2], 9)

    def _displacement_gradients(self, rule: Rule) -> Floats:
        """Return the displacement gradients du_i/dX_J (m, q, 3, 3) at the points of a rule."""
        H = self._gradients_from_nodes(integrate_cells(self.mesh, rule=rule))
        if self.material.thin:  # plane stress: the thickness changes independently of the nodes
            from softmark.solvers.materials.plane_stress import thickness_stretch

            law = law_for(self._material_at_rule(rule), self.strain)
            H[..., 2, 2] = thickness_stretch(law, _deformation_gradients(H)).reshape(H.shape[:2]) - 1.0
        return H

    def _gradients_from_nodes(self, parts: IntegrationPoints) -> Floats:
        """Return du_i/dX_J (m, q, 3, 3) from the nodal displacements only."""
        H: Floats = np.einsum("mai,mqaJ->mqiJ", self.u[self.mesh.cells], parts.dNdX, optimize=True)
        if self.revolved:  # hoop strain is u_x / x; on the axis it equals the strain along x
            r, out = (parts.at_points(values[self.mesh.cells, 0]) for values in (self.mesh.points, self.u))
            far = r > AXIS * self.mesh.extent
            H[..., 2, 2] = np.where(far, out / np.where(far, r, 1.0), H[..., 0, 0])
        return H

    def _cauchy_stress(self, H: Floats, rule: Rule) -> Floats:
        """Return the Cauchy stress (m, q, 3, 3), Pa, for displacement gradients H. Raises StressUnavailable."""
        laws = shear_and_volume_laws(self._material_at_rule(rule), self.strain) if self.way == "selective" else None
        if laws is not None:  # shear law at the point, volume law with the mean gradient of the cell
            of_volume = (shear_and_volume_laws(self._cell_mean_material(), self.strain) or laws)[1]
            mean = self._gradients_from_nodes(mean_gradients(self.mesh, self.revolved))
            volume = self._push_forward(_piola_stress(of_volume, mean), mean)  # (m, 1, 3, 3)
            return self._push_forward(_piola_stress(laws[0], H), H) + volume
        if self.way in ("full", "selective"):
            return self._push_forward(_piola_stress(law_for(self._material_at_rule(rule), self.strain), H), H)
        return self._stress_with_pressure(H, rule)

    def _stress_with_pressure(self, H: Floats, rule: Rule) -> Floats:
        """Return the Cauchy stress (m, q, 3, 3), Pa, of a formulation with a pressure p for the volume change.

        It follows from the first Piola-Kirchhoff stress P = P_shape + p dg/dF. The pressure is the solved one, or the
        modulus M times the mean of the volume function g over the cell. Raises StressUnavailable.
        """
        split, F = self._mixed_split(rule), _deformation_gradients(H)
        p = self._solved_pressures(rule) if self.way == "mixed" else self._mean_dilatation_pressures()
        P = _piola_stress(split.shape, H) + np.broadcast_to(p, H.shape[:2]).reshape(
            -1, 1, 1
        ) * split.constraint.gradient(F)
        return self._push_forward(P, H)

    def _mixed_split(self, rule: Rule) -> MixedSplit:
        """Return the law split into shape and volume parts at the points of a rule. Raises StressUnavailable."""
        if (split := mixed_for(self._material_at_rule(rule), self.strain)) is None:
            raise StressUnavailable("the material law has no separate volumetric part for the pressure")
        return split

    def _solved_pressures(self, rule: Rule) -> Floats:
        """Return the solved pressures (m, q), Pa, at the points of a rule. Raises StressUnavailable if unknown."""
        if self.pressures is None:
            raise StressUnavailable("the pressures of this state are not known")
        return self.pressures @ build_pressure_space(self.mesh, rule).N.T

    def _mean_dilatation_pressures(self) -> Floats:
        """Return the pressure of each cell (m, 1), Pa: int g dV / int 1/M dV."""
        rule = self.mesh.element.quadrature()
        w, split = self._point_volumes(rule), self._mixed_split(rule)
        H = self._displacement_gradients(rule)
        reach = float(np.abs(H).max(initial=0.0))
        up = displacement_gradient_scaling.find_scale(reach, self.strain == "small", lambda c: c * reach)
        g = split.constraint.value(_deformation_gradients(up * H)).reshape(w.shape) / up
        pressure: Floats = ((w * g).sum(axis=1) / (w * split.compliance).sum(axis=1))[:, None]
        return pressure

    def _push_forward(self, P: Floats, H: Floats) -> Floats:
        """Return the Cauchy stress sigma = P F^T / J (m, q, 3, 3), Pa; for small strains P itself."""
        P = P.reshape(H.shape)
        if self.strain == "small":
            return P
        F = H + np.eye(3)
        sigma: Floats = P @ F.swapaxes(-1, -2) / np.linalg.det(F)[..., None, None]
        return 0.5 * (sigma + sigma.swapaxes(-1, -2))


def _piola_stress(law: Any, H: Floats) -> Floats:
    """Return the first Piola-Kirchhoff stress (m q, 3, 3), Pa, of a law for displacement gradients H (m, q, 3, 3)."""
    return displacement_gradient_scaling.first_piola_stress(law, H.reshape(-1, 3, 3))


def _deformation_gradients(H: Floats) -> Floats:
    """Return the deformation gradients F = 1 + H, shape (m q, 3, 3)."""
    F: Floats = np.ascontiguousarray(H.reshape(-1, 3, 3) + np.eye(3))
    return F


def superconvergent_points(element: type[Element]) -> Rule:
    """Return the quadrature rule at whose points derivatives of an element are more accurate by one order.

    This holds in cells that are nearly parallelepipeds. The points are Gauss points with as many points along each axis
    as the order of the element: for the linear hexahedron its centre. Tetrahedra and wedges have no such points and use
    the rule of the stiffness (Zienkiewicz and Zhu 1992).
    """
    if element.corners != 8:
        return element.quadrature()
    one, _ = np.polynomial.legendre.leggauss(element.order)
    grid = np.stack(np.meshgrid(one, one, one, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid, np.full(len(grid), element.volume / len(grid))
