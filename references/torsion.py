"""Torsion of a cylinder of incompressible rubber by any angle: a closed form with a torque and a thrust."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.cantilever import Refused, Vector
from softmark.references.centre_line import points_of
from softmark.references.reference import About, Reference

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.deferred import np

INCOMPRESSIBLE = 0.5
ROUNDING = 16.0 * 2.0**-52  # relative, of a displacement


@dataclass(frozen=True)
class TwistedCylinder:
    """A solid circular cylinder of a neo-Hookean solid that keeps its volume, one end held, the other turned. SI units.

    Every section turns by tau z about the axis, z from the held end, and nothing else moves (Rivlin 1949):

        psi = mu/2 (I1 - 3), I1 - 3 = tau^2 r^2
        torque = mu tau pi R^4 / 2, thrust = mu tau^2 pi R^4 / 4, energy = mu tau^2 pi R^4 L / 4

    with the side free of tractions. The thrust is what the ends press with: free, the cylinder grows longer (Poynting).
    Raises Refused where the cylinder is not of that kind.
    """

    length: float  # m
    radius: float  # m
    shear_modulus: float  # Pa
    poisson: float  # 1
    root: Vector  # m, the centre of the held end
    axis: Vector  # unit vector, from the held end to the turned one
    angle: float  # rad, right-handed about the axis

    def __post_init__(self) -> None:
        for name, value in (("length", self.length), ("radius", self.radius), ("shear modulus", self.shear_modulus)):
            if not (math.isfinite(value) and value > 0.0):
                raise Refused(f"the {name} is {value:g}", "it must be positive")
        if self.poisson != INCOMPRESSIBLE:
            raise Refused(f"a Poisson's ratio of {self.poisson:g} lets the volume change",
                          "the closed form is that of `poisson = 0.5`, which `formulation = mixed` takes")  # fmt: skip
        if not math.isfinite(self.angle):
            raise Refused("the angle is not finite", "give a finite angle")

    @property
    def twist(self) -> float:
        """tau, rad/m."""
        return self.angle / self.length

    @property
    def torque(self) -> float:
        """Of the turned end about the axis, N m."""
        return 0.5 * math.pi * self.shear_modulus * self.twist * self.radius**4

    @property
    def thrust(self) -> float:
        """What both ends press the cylinder together with, N."""
        return 0.25 * math.pi * self.shear_modulus * self.twist**2 * self.radius**4

    @property
    def energy(self) -> float:
        """That is stored, J."""
        return 0.5 * self.torque * self.angle

    @property
    def estimated_error(self) -> float:
        """Rounding of a displacement, m."""
        return ROUNDING * (self.length + self.radius)

    def displacement(self, X: Array) -> Array:
        """Of points X (n, 3) of the undeformed body (n, 3), m: sections turn. Raises Refused for what is no point."""
        from_root = points_of(X) - np.asarray(self.root)
        n = np.asarray(self.axis)
        angle = self.twist * (from_root @ n)
        across = np.cross(n, from_root)
        circles = np.sin(angle)[:, None] * across + (1.0 - np.cos(angle))[:, None] * np.cross(n, across)
        found: Array = circles
        return found


@dataclass(frozen=True)
class Torsion(Reference):
    """A cylinder of incompressible neo-Hookean rubber that is twisted by any angle: displacements, torque and thrust.

    Every section turns in its plane by its share of the angle; the ends carry a torque mu tau pi R^4 / 2 and a thrust
    mu tau^2 pi R^4 / 4, tau the angle by the length. Metrics `moment`, `force` and `strain_energy` may be held against
    them. It takes a solid cylinder with `poisson = 0.5` of `neo_hookean` or `neo_hookean_isochoric`, one end of it
    `fixed` and the other `turned` about the cylinder's axis, both whole, and nothing else that holds or loads it.
    Source: Rivlin 1949, Large elastic deformations of isotropic materials VI, Phil. Trans. R. Soc. A 242, 173-195.
    """

    body: Annotated[Any, "body", "the cylinder"]

    about: ClassVar[About] = "torsion"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Rivlin 1949, Phil. Trans. R. Soc. A 242, 173-195"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equation exactly"

    def solve(self, cylinder: TwistedCylinder) -> TwistedCylinder:
        """What it says: the closed form is that of the cylinder itself."""
        return cylinder
