"""Loss of Drucker stability in Hencky strain: d tau : d ln V <= 0 for some strain increment.

The Kirchhoff stress tau of an isotropic law is the derivative of its energy by ln V. Drucker's postulate requires that
this energy is convex. In principal axes, e_a = ln s_a, this means two things: d tau_a/d e_b is positive definite, and
(tau_a - tau_b)/(e_a - e_b) is positive, for increments that rotate the axes. The criterion is stricter than strong
ellipticity, because it applies to all strain increments, not only waves. It is also weaker, because it ignores the
stress that rotates with the material. Neither implies the other. For incompressible solids only isochoric increments
count. Abaqus reports the same criterion for hyperelastic constants.
Sources: Drucker (1959), "A definition of stable inelastic material", J. Appl. Mech. 26:101; Hill (1968), "On
constitutive inequalities for simple materials", J. Mech. Phys. Solids 16:229.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.materials.batched_stability import (
    STIFF,
    Bools,
    VolumePressure,
    evaluate_by_law,
    evaluate_in_blocks,
)
from softmark.solvers.materials.polar_decomposition import stretches
from softmark.solvers.materials.tensor_components import components, displacement_gradient, volume_change
from softmark.solvers.materials.volumetric_constraints import VolumeRatioConstraint

if TYPE_CHECKING:
    from softmark.solvers.materials.constitutive_law import Array

FLAT = 1e-6  # fraction of the longest stretch: below it derivatives by ln s (about s^2) are rounding noise
NEAR = 1e-5  # logarithmic stretches closer than this count as equal


def find_instability(law: Any, F: Array, held: VolumePressure | None = None) -> Bools | None:
    """Return for which states F (m, 3, 3) a law is not Drucker-stable (m,); None for an anisotropic law.

    States outside the law's domain, which have no stress, are not counted. Neither are flattened ones (`FLAT`). `held`
    is the separate volume constraint, or None.
    """
    return evaluate_by_law(_find_instability_of_law, law, F, held)


def _find_instability_of_law(law: Any, F: Array, held: VolumePressure | None) -> Bools | None:
    """Return for which states F (m, 3, 3) one law is not Drucker-stable (m,); None for an anisotropic law."""
    return evaluate_in_blocks(_is_stability_lost, law, F, held) if hasattr(law, "principal") else None


def _is_stability_lost(law: Any, F: Array, held: VolumePressure | None) -> Bools:
    """Return for which states F (m, 3, 3) of an isotropic law Drucker stability is lost (m,)."""
    f = components(F)
    s = stretches(f)
    e = np.log(s)
    known = (volume_change(displacement_gradient(f)) > -1.0) & (s.min(axis=0) > FLAT * s.max(axis=0))
    e[0] += np.where(known, 0.0, np.nan)
    _, tau, bent = law.principal(tuple(e))
    if held is not None and not isinstance(held.constraint, VolumeRatioConstraint):
        _add_green_constraint(held, s, bent)
        held = None
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = bent
    # in the plane perpendicular to (1, 1, 1): along (1, -1, 0) and (1, 1, -2), and mixed
    a = 0.5 * (xx + yy) - xy
    c = (xx + yy + 2.0 * xy - 4.0 * (xz + yz) + 4.0 * zz) / 6.0
    b = (xx - yy - 2.0 * (xz - yz)) / 12.0**0.5
    found = (a <= 0.0) | (a * c <= b * b)
    if held is None or np.any(np.isfinite(held.modulus)):
        u = (xx - yy + xz - yz) / 6.0**0.5
        w = (xx + yy + 2.0 * xy - xz - yz - 2.0 * zz) / 18.0**0.5
        whole = (xx + yy + zz + 2.0 * (xy + yz + xz)) / 3.0 + 3.0 * _volume_terms(e, held)
        found |= whole * (a * c - b * b) <= c * u * u - 2.0 * b * u * w + a * w * w
    for one, other in ((0, 1), (1, 2), (2, 0)):
        apart = e[one] - e[other]
        found |= (np.abs(apart) > NEAR) & ((tau[one] - tau[other]) * apart <= 0.0)
    return np.asarray(found & np.isfinite(a) & np.isfinite(c), dtype=np.bool_)


def _add_green_constraint(held: VolumePressure, s: Array, bent: list[list[Array]]) -> None:
    """Add the contribution of a volume constraint on tr E to the tangent `bent` = d tau_a/d e_b, Pa, in place.

    tau are the principal Kirchhoff stresses, e the logarithms of the principal stretches s (3, m), and E is Green's
    strain. The derivatives of tr E by e are the squared stretches.
    """
    most = STIFF * np.abs(bent).max(axis=(0, 1))
    own = s * s
    M = np.minimum(held.modulus, most / (own * own).sum(axis=0))
    for a in range(3):
        for b in range(3):
            bent[a][b] = bent[a][b] + M * own[a] * own[b] + (2.0 * held.pressure * own[a] if a == b else 0.0)


def _volume_terms(e: Array, held: VolumePressure | None) -> Any:
    """Return the contribution of a volume constraint and its pressure to every tangent entry d tau_a/d e_b, Pa.

    tau are the principal Kirchhoff stresses, and e (3, m) the logarithms of the principal stretches. The contribution
    is the same for all a and b; it is zero if `held` is None.
    """
    if held is None:
        return 0.0
    j = np.expm1(e.sum(axis=0))
    assert isinstance(held.constraint, VolumeRatioConstraint)
    _, first, second = held.constraint.of(j)
    slope = first * (1.0 + j)
    more = slope if second is None else slope + second * (1.0 + j) ** 2
    return held.pressure * more + held.modulus * slope * slope
