"""Error in the energy norm of finite element theory."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

from softmark.interpreter.metrics.measurement import Measurement
from softmark.interpreter.metrics.metric_base import Metric
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Field, Floats, MetricInput
    from softmark.interpreter.problem.body_case import Case
else:
    from softmark.solvers.runtime.lazy_modules import np

STEP = 1e-4  # finite difference step relative to the body's extent


@dataclass(frozen=True)
class EnergyNormError(Metric):
    """Relative error in the energy norm: strain errors weighted by stiffness, over a volume.

    eta = sqrt(sum w dE : C : dE) / sqrt(sum w E : C : E), with E = (F^T F - I) / 2 the Green-Lagrange strain of the
    reference, dE its difference from the model's strain, w the volume of each point of the probe, and C the isotropic
    stiffness at rest, A : C : A = lam tr(A)^2 + 2 mu A : A. For small strains this is the energy norm of finite element
    theory, |e|^2 = integral of eps(e) : C : eps(e), whose square is twice the strain energy of the error (Zienkiewicz
    and Zhu 1987). At finite strain it remains a norm of the strain error, but is no longer the energy of a material.

    E does not change under a rigid motion, so a rotation of either solution is not an error here. This norm detects
    wrong strains, and `tip_error` detects wrong positions. The "relative energy norm error" of Marchal et al. (2008),
    here `relative_l2_error`, is an l2 norm of displacements: it has no stiffness weights, grows with any rigid motion,
    and depends on where the points lie.

    F = I + du/dX by central differences over 1e-4 of the body's extent. Their error is of second order, 1e-8 relative
    for a field that varies over the extent, and rounding adds 1e-12. The step is much shorter than a cell, so few
    differences cross a face of a piecewise field (those take the mean of both sides). Linear tetrahedra have a constant
    strain in each cell: expect eta to fall with the first power of the cell size. A beam theory with rigid
    cross-sections has no lateral strain: compared with a solid that is a model error, and as a reference solids cannot
    reach it.

    The report also gives error_energy_J and reference_energy_J (half the two sums), volume_m3, points, step_m and
    strain_max (largest norm of E in the reference, which shows whether strains are small).
    """

    probe: Annotated[str, "probe", "a probe of the volume"]
    against: Annotated[str, "reference or model", "solution taken as correct, with a displacement field"]
    unit: ClassVar[str] = "1"
    uncertain: ClassVar[bool] = False

    def measure(self, seen: MetricInput) -> Measurement:
        """Return the relative error eta.

        Raises Undefined without a volume, a reference field, moduli, or any strain in the reference.
        """
        w, u, known = _weights_and_displacement_fields(seen)
        step = STEP * float(np.linalg.norm(np.ptp(seen.X, axis=0)))
        if step == 0.0:
            raise Undefined("all points of the probe are at one place")
        E = green_lagrange(known, seen.X, step)
        dE = green_lagrange(u, seen.X, step) - E
        error, size = (
            _squared_energy_norm(dE, w, seen.case, seen.X),
            _squared_energy_norm(E, w, seen.case, seen.X),
        )
        if size == 0.0:
            raise Undefined("the reference is not strained, so there is no relative error")
        details = {
            "error_energy_J": 0.5 * error,
            "reference_energy_J": 0.5 * size,
            "volume_m3": float(w.sum()),
            "points": len(w),
            "step_m": step,
            "strain_max": float(np.linalg.norm(E, axis=(1, 2)).max()),
        }
        return Measurement(math.sqrt(error / size), details)


def _weights_and_displacement_fields(seen: MetricInput) -> tuple[Floats, Field, Field]:
    """Return the volume weights of the points, the model's displacement field and the reference's.

    Raises Undefined if one of them is missing.
    """
    if seen.weights is None:
        raise Undefined("an integral over the body needs a volume probe")
    if seen.displacement is None:
        raise Undefined("it has no displacement field to compute strains from")
    if seen.known is None or seen.known.displacement is None:
        raise Undefined("the reference is not a displacement field, so it has no strains")
    return seen.weights, seen.displacement, seen.known.displacement


def green_lagrange(u: Field, X: Floats, step: float) -> Floats:
    """Return the Green-Lagrange strain E = (F^T F - I) / 2 (n, 3, 3) of a displacement field at points X (n, 3), m.

    Gradients are central differences over `step`, m.
    """
    grad = np.empty((len(X), 3, 3))  # grad[:, i, J] = du_i/dX_J
    for J, e in enumerate(step * np.eye(3)):
        grad[:, :, J] = (u(X + e) - u(X - e)) / (2.0 * step)
    turned = grad.swapaxes(1, 2)
    E: Floats = 0.5 * (grad + turned + turned @ grad)  # not F^T F - I, which would cancel for small strains
    return E


def _squared_energy_norm(E: Floats, w: Floats, case: Case, X: Floats) -> float:
    """Return sum w E : C : E, J, with the elastic moduli C at rest of the material at each point X (n, 3)."""
    materials = case.materials
    if not all(isinstance(material, Isotropic) for material in materials):
        raise Undefined("the material has no initial shear modulus and no initial Lamé constant")
    each = [_lame_moduli(material, X) for material in materials]
    mu, lam = each[0]
    if case.parts:
        from softmark.interpreter.problem.material_layers import material_numbers
        from softmark.interpreter.problem.mesh_group_conditions import point_membership

        at = material_numbers(case, X, point_membership(case, X)), np.arange(len(X))
        mu, lam = np.array([own[0] for own in each])[at], np.array([own[1] for own in each])[at]
    if not np.isfinite(lam).all():
        raise Undefined("the material is incompressible, so the energy of a volume change is infinite")
    trace = np.trace(E, axis1=1, axis2=2)
    return float(w @ (lam * trace**2 + 2.0 * mu * (E**2).sum(axis=(1, 2))))


def _lame_moduli(material: Isotropic, X: Floats) -> tuple[Floats, Floats]:
    """Return Lame's moduli mu and lam (n,), Pa, of a material at points X (n, 3)."""
    if not material.uniform:
        from softmark.interpreter.problem.field_files import material_at

        material = material_at(material, X)
    mu, lam = (np.broadcast_to(modulus, len(X)) for modulus in (material.shear_modulus, material.lame_lambda))
    return mu, lam
