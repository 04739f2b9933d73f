"""Torsion of an incompressible rubber cylinder by any angle: a closed form with torque and axial force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.rubber_energies import Rubber, require_incompressible
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

POINTS = 64  # Gauss-Legendre points along the radius: smooth integrands to rounding
ROUNDING = 16.0 * 2.0**-52  # relative, of a displacement


@dataclass(frozen=True)
class TwistedCylinder:
    """Solid circular cylinder of incompressible rubber, held at one end and rotated at the other. SI units.

    Every section rotates by tau z about the axis, with z measured from the held end, without any other displacement
    (Rivlin 1949), for every law. At radius r the material is sheared by g = tau r, with principal stretches exp(e), 1
    and exp(-e), sinh e = g/2, and principal axes in the plane of theta and z. With the stresses t of the law, and a
    side without tractions,

        torque = 2 pi int r^2 t_theta_z dr, thrust = -pi int r (2 (t_zz - t_rr) - (t_theta_theta - t_rr)) dr,

    and energy = 2 pi L int r W dr. For a neo-Hookean solid these are mu tau pi R^4 / 2, mu tau^2 pi R^4 / 4 and mu
    tau^2 pi R^4 L / 4. The thrust is the compressive force on the ends; with free ends the cylinder becomes longer
    (Poynting). Raises NotApplicable if the cylinder is not of that kind.
    """

    length: float  # m
    radius: float  # m
    rubber: Rubber
    poisson: float  # 1
    root: Vector  # m, the centre of the held end
    axis: Vector  # unit vector, from the held end to the turned one
    angle: float  # rad, right-handed about the axis

    def __post_init__(self) -> None:
        for name, value in (("length", self.length), ("radius", self.radius)):
            if not (math.isfinite(value) and value > 0.0):
                raise NotApplicable(f"the {name} is {value:g}", "it must be positive")
        require_incompressible(self.poisson)
        if not math.isfinite(self.angle):
            raise NotApplicable("the angle is not finite", "give a finite angle")

    @property
    def twist(self) -> float:
        """Twist per length tau, rad/m."""
        return self.angle / self.length

    @property
    def torque(self) -> float:
        """Torque on the rotated end about the axis, N m."""
        r, w, e, (along, _, across) = self._quadrature_stresses
        sine = 1.0 / np.cosh(e)  # of twice the angle between theta and the axis that is stretched
        return float(2.0 * math.pi * math.copysign(1.0, self.angle) * w @ (r**2 * 0.5 * (along - across) * sine))

    @property
    def thrust(self) -> float:
        """Compressive force on both ends, N."""
        r, w, e, (along, radial, across) = self._quadrature_stresses
        cosine, mean, half = np.tanh(e), 0.5 * (along + across) - radial, 0.5 * (along - across)
        return float(-math.pi * w @ (r * (2.0 * (mean - half * cosine) - (mean + half * cosine))))

    @property
    def energy(self) -> float:
        """Stored energy, J."""
        r, w, e, _ = self._quadrature_stresses
        W = self.rubber.energy(np.stack([e, 0.0 * e, -e]))
        return float(2.0 * math.pi * self.length * w @ (r * W))

    @property
    def _quadrature_stresses(self) -> tuple[Array, Array, Array, Array]:
        """Gauss radii and weights (n,), m, logarithms of the principal stretch e (n,), and stresses (3, n), Pa."""
        x, w = np.polynomial.legendre.leggauss(POINTS)
        r = 0.5 * self.radius * (x + 1.0)
        e = np.arcsinh(0.5 * abs(self.twist) * r)
        return r, 0.5 * self.radius * w, e, self.rubber.tensions(np.stack([e, 0.0 * e, -e]))

    @property
    def estimated_error(self) -> float:
        """Rounding error of a displacement, m."""
        return ROUNDING * (self.length + self.radius)

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        from_root = as_points(X) - np.asarray(self.root)
        n = np.asarray(self.axis)
        angle = self.twist * (from_root @ n)
        across = np.cross(n, from_root)
        circles = np.sin(angle)[:, None] * across + (1.0 - np.cos(angle))[:, None] * np.cross(n, across)
        found: Array = circles
        return found


@dataclass(frozen=True)
class Torsion(Reference):
    """A cylinder of incompressible rubber twisted by any angle: displacements, torque and thrust.

    Every section rotates in its plane by its share of the angle, for every law; for neo-Hookean rubber the ends carry a
    torque mu tau pi R^4 / 2 and a thrust mu tau^2 pi R^4 / 4, tau the angle per length, and for others integrals over
    the radius. It can be compared with the metrics `moment`, `force` and `strain_energy`. It applies to a solid
    cylinder with `poisson = 0.5` of `neo_hookean`, `neo_hookean_isochoric`, `mooney_rivlin`, `ogden`, `yeoh`, `gent`,
    `fung`, `veronda_westmann` or `arruda_boyce`, one end of it `fixed` and the other `rotated` about the cylinder's
    axis, both whole, without other supports or loads.
    Source: Rivlin 1949, Large elastic deformations of isotropic materials VI, Phil. Trans. R. Soc. A 242, 173-195.
    """

    body: Annotated[Any, "body", "the cylinder"]

    problem_kind: ClassVar[str] = "torsion"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Rivlin 1949, Phil. Trans. R. Soc. A 242, 173-195"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equation exactly"

    def solve(self, cylinder: TwistedCylinder) -> TwistedCylinder:
        """Return the cylinder itself, whose class contains the solution.

        Raises NotApplicable beyond the domain of its law.
        """
        if not math.isfinite(cylinder.torque):
            raise NotApplicable("the twist exceeds the domain of the law", "reduce the angle")
        return cylinder
