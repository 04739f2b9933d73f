"""Stress in the cross-section of a straight bar under tension, bending, torsion and shear: Saint-Venant's theory.

The axial stress is that of Navier, N / A + M2 X3 / I2 - M3 X2 / I3. The shear stress of torsion and of a transverse
force is exact for sections that are free to warp; for a transverse force it depends on Poisson's ratio. Its resultants
are T, V2 and V3, and it has no component normal to the border. The theory holds at a distance of about one width from
supports and loads (Saint-Venant 1855). Sections are circles, rings and rectangles, with coordinates X2 and X3, m, along
their axes.

Sources: Love (1927), "A treatise on the mathematical theory of elasticity", sections 221 (torsion) and 231 (flexure);
Timoshenko and Goodier (1970), "Theory of elasticity", sections 109 and 124.
"""

from __future__ import annotations

import numpy as np

from softmark.solvers.mesh.cross_sections import Rectangle
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import CircularSection, Section

TERMS = 200  # terms of the series with odd numbers: the truncation error at corners is a thousandth


def section_stress(section: Section, poisson: float, carried: Floats, X2: Floats, X3: Floats) -> Floats:
    """Return the stresses sigma_11, sigma_12 and sigma_13 (n, 3), Pa, at positions X2, X3 (n,), m, of a section.

    `carried` (n, 6) are the internal forces N, V2, V3, in N, and moments T, M2, M3, in N m. Raises TypeError for a
    section without a known theory.
    """
    N, V2, V3, T, M2, M3 = carried.T
    I2, I3 = section.moments
    along = N / section.area + M2 / I2 * X3 - M3 / I3 * X2
    twist = _torsion_stress(section, X2, X3)
    first, second = _flexure_stress(section, poisson, X2, X3), _flexure_stress(section, poisson, X2, X3, second=True)
    across = T[:, None] * twist + V2[:, None] * first + V3[:, None] * second
    found: Floats = np.column_stack([along, across])
    return found


def tapered_section_stress(
    section: Section, rates: tuple[float, float], poisson: float, carried: Floats, X2: Floats, X3: Floats
) -> Floats:
    """Return the stresses (n, 3), Pa, in a tapered bar, to first order in its taper; see `section_stress`.

    The sides of the section grow along the axis at the relative `rates` c2 and c3, 1/m. Axial fibres follow the sides,
    with the stress sigma_11 (1, c2 X2, c3 X3), so that no traction crosses an inclined border. The fibres carry c3 M2
    of V3 and -c2 M3 of V2; the remaining shear force is distributed as in a straight bar. So equilibrium is satisfied,
    and in a wedge bent by a force at its tip no shear force remains (Michell 1900). Raises TypeError for a section
    without a known theory.
    """
    c2, c3 = rates
    own = carried.copy()
    own[:, 1] += c2 * carried[:, 5]
    own[:, 2] -= c3 * carried[:, 4]
    found = section_stress(section, poisson, own, X2, X3)
    found[:, 1] += found[:, 0] * c2 * X2
    found[:, 2] += found[:, 0] * c3 * X3
    return found


def _torsion_stress(section: Section, X2: Floats, X3: Floats) -> Floats:
    """Return the shear stresses (n, 2), Pa, along X2 and X3 for a torque of 1 N m. Raises TypeError."""
    if isinstance(section, CircularSection):
        return np.stack([-X3, X2], axis=1) / section.torsion
    if not isinstance(section, Rectangle):
        raise TypeError(f"no stress theory is available for the section {type(section).__name__}")
    if section.width <= section.height:
        return _rectangle_torsion_stress(0.5 * section.width, 0.5 * section.height, section.torsion, X2, X3)
    turned = _rectangle_torsion_stress(0.5 * section.height, 0.5 * section.width, section.torsion, X3, -X2)
    return np.stack([-turned[:, 1], turned[:, 0]], axis=1)


def _rectangle_torsion_stress(a: float, b: float, J: float, x: Floats, y: Floats) -> Floats:
    """Return the shear stresses (n, 2) of torsion along x and y in a rectangle, for a torque of 1 N m, Pa.

    They are derivatives of Prandtl's stress function. The half sides are a <= b along x and y, m, and J is the torsion
    constant, m^4.
    """
    n = 2.0 * np.arange(TERMS) + 1.0
    k: Floats = np.asarray(0.5 * np.pi * n / a, dtype=np.float64)
    sign = (-1.0) ** np.arange(TERMS)
    sine, cosine = _scaled_hyperbolic_functions(k, y, b)
    weight = 16.0 * a / np.pi**2 * sign / n**2
    along_x = -(weight * sine * np.cos(np.outer(x, k))).sum(axis=1)
    along_y = 2.0 * x - (weight * cosine * np.sin(np.outer(x, k))).sum(axis=1)
    return np.stack([along_x, along_y], axis=1) / J


def _scaled_hyperbolic_functions(k: Floats, y: Floats, b: float) -> tuple[Floats, Floats]:
    """Return sinh(k y) / cosh(k b) and cosh(k y) / cosh(k b), shape (n, terms), for |y| <= b, without overflow."""
    up, down = np.exp(np.outer(y - b, k)), np.exp(np.outer(-y - b, k))
    whole = 1.0 + np.exp(-2.0 * b * k)
    return (up - down) / whole, (up + down) / whole


def _flexure_stress(section: Section, poisson: float, X2: Floats, X3: Floats, second: bool = False) -> Floats:
    """Return the shear stresses (n, 2), Pa, along X2 and X3 for a transverse force of 1 N.

    The force acts along X2, or along X3 if `second` is True. Raises TypeError.
    """
    x, y = (X3, X2) if second else (X2, X3)
    I = section.moments[0 if second else 1]
    if isinstance(section, CircularSection):
        own = _ring_flexure_stress(section.radius, section.hole_radius or 0.0, poisson, I, x, y)
    elif isinstance(section, Rectangle):
        a, b = (0.5 * e for e in (section.extents[::-1] if second else section.extents))
        own = _rectangle_flexure_stress(a, b, poisson, I, x, y)
    else:
        raise TypeError(f"no stress theory is available for the section {type(section).__name__}")
    return own[:, ::-1] if second else own


def _ring_flexure_stress(a: float, b: float, nu: float, I: float, x: Floats, y: Floats) -> Floats:
    """Return the shear stresses (n, 2), Pa, along x and y in a ring for a force of 1 N along x.

    The ring has radii a > b, m.
    Source: Love's flexure function, section 231.
    """
    r2 = np.maximum(x * x + y * y, np.finfo(np.float64).tiny)
    c, inside = 0.75 + 0.5 * nu, (a * b) ** 2 / r2**2 if b else np.zeros_like(x)
    along = c * (a * a + b * b + inside * (y * y - x * x)) - 0.75 * (x * x - y * y)
    along -= 0.5 * nu * x * x + (1.0 - 0.5 * nu) * y * y
    across = -(2.0 * c * inside - 1.5 + 2.0 + nu) * x * y
    return np.stack([along, across], axis=1) / (2.0 * (1.0 + nu) * I)


def _rectangle_flexure_stress(a: float, b: float, nu: float, I: float, x: Floats, y: Floats) -> Floats:
    """Return the shear stresses (n, 2), Pa, along x and y for a force of 1 N along x, in a rectangle.

    The half sides are a along the force and b across it, m. The stress is a parabola plus a term with Poisson's ratio.
    This term follows from a function phi with nabla^2 phi = nu y / (I (1 + nu)) that is zero on the border; without its
    series it is that of a wide rectangle.
    """
    n = np.arange(1.0, TERMS + 1.0)
    k, weight = n * np.pi / b, 12.0 * (-1.0) ** n / (n * np.pi) ** 2
    sine, cosine = _scaled_hyperbolic_functions(k, x, a)
    c = nu / (6.0 * I * (1.0 + nu))
    by_y = 3.0 * y * y - b * b - b * b * (weight * cosine * np.cos(np.outer(y, k))).sum(axis=1)
    by_x = -b * b * (weight * sine * np.sin(np.outer(y, k))).sum(axis=1)
    return np.stack([0.5 * (a * a - x * x) / I + c * by_y, -c * by_x], axis=1)
