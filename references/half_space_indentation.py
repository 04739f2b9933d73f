"""Frictionless indentation of a half-space by a rigid body of revolution, with the solution at every point.

The solution uses Green's and Collins's complex potential (Barber 2010, Elasticity, ch. 30). With zeta = z + i t, z the
depth in the body, d the indentation depth and a the contact radius,

    dphi/dz = Re int_0^a g(t) / sqrt(r^2 + zeta^2) dt,    g(t) = -(E*/pi) (d - c t^n),    E* = E / (1 - nu^2),
    2 G u_z = -2 (1 - nu) dphi/dz + z d2phi/dz2,    2 G u_r = (1 - 2 nu) dphi/dr + z d2phi/drdz,
    p = d2phi/dz2 where z = 0,

where c t^n is t^2/R for a sphere, t pi/(2 tan(angle)) for a cone and 0 for a flat punch. These integrals are
elementary.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.references.layer_integral_equation import Layer

    Array = NDArray[np.float64]
    Complex = NDArray[np.complexfloating]
else:
    from softmark.references.lazy_imports import np

ON_AXIS = 1e-5  # relative to the contact radius: closer to the axis the radial displacement is rounding
ROUNDING = 1e-13  # relative, of a displacement


@dataclass(frozen=True)
class Tip:
    """Tip of a rigid body of revolution: the indentation depth is c t^n for a contact radius t.

    `power` is n and `rate` is c. `edge` is the radius of a flat punch, m.
    """

    power: int  # n
    rate: float  # c, m^(1-n)
    edge: float | None = None  # m
    span: float = math.inf  # m: radius of a sphere, for the check of the depth
    rim: float = 0.0  # m, of a punch: the radius that its edge is rounded by
    blunt: float = 0.0  # m, of a cone: by how much it ends before the tip that it would have

    @classmethod
    def sphere(cls, radius: float) -> Tip:
        """Return the tip of a sphere of this radius, m, approximated by a paraboloid."""
        _check_positive("radius", radius)
        return cls(2, 1.0 / radius, span=radius)

    @classmethod
    def cone(cls, angle: float, blunt: float = 0.0) -> Tip:
        """Return the tip of a cone with this angle between axis and side, rad.

        `blunt` is the height of the tip that is lost by rounding, m.
        """
        if not 0.0 < angle < 0.5 * math.pi:
            raise NotApplicable(
                f"the half-angle of the cone is {math.degrees(angle):g} degrees", "it is between 0 and 90"
            )
        return cls(1, 0.5 * math.pi / math.tan(angle), blunt=blunt)

    @classmethod
    def punch(cls, radius: float, rim: float = 0.0) -> Tip:
        """Return the flat end of a punch of this radius, m; `rim` is the rounding radius of its edge, m."""
        _check_positive("radius", radius)
        return cls(0, 0.0, radius, rim=rim)

    def relative_errors(self, depth: float) -> dict[str, float]:
        """Return estimated relative errors of the force by name of the neglected effect, for an indentation `depth`, m.

        `depth`: depth divided by the radius of a sphere, which the theory takes as small. `rim`: radius of the rounded
        edge
        of a flat punch, relative to that of the punch. `tip`: rounding of the tip of a cone.
        """
        found = {"depth": depth / self.span} if math.isfinite(self.span) else {}
        if self.rim and self.edge:
            found["rim"] = self.rim / self.edge
        return found | ({"tip": self.force_exponent * self.blunt / depth} if self.blunt else {})

    @property
    def force_exponent(self) -> float:
        """Exponent of the depth in the force on a half-space."""
        return 1.0 if self.edge is not None else 1.0 + 1.0 / self.power

    def at(self, t: Array) -> Array:
        """Return the indentation depths c t^n, m, at contact radii t, m."""
        return self.rate * t**self.power

    def radius(self, depth: float) -> float:
        """Return the contact radius with a half-space, m."""
        return self.edge if self.edge is not None else float((depth / self.rate) ** (1.0 / self.power))


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise NotApplicable(f"the {name} is {value:g}", "it must be positive")


@dataclass(frozen=True)
class Surroundings:
    """Distances from the contact to the ends of the indented body, m, and the support of its far face.

    `bonded` is true if the far face is fixed; otherwise it slides without friction.
    """

    thickness: float = math.inf
    width: float = math.inf  # from the axis to the nearest free side
    bonded: bool = True


@dataclass(frozen=True)
class HalfSpace:
    """Half-space indented by a tip to a given depth. SI units. Raises NotApplicable for invalid values."""

    tip: Tip
    depth: float  # m, that the tip has moved since it touched
    young: float  # Pa
    poisson: float  # 1
    at: Vector = (0.0, 0.0, 0.0)  # m, point of first contact
    normal: Vector = (0.0, 0.0, 1.0)  # unit vector, out of the body
    around: Surroundings = Surroundings()

    def __post_init__(self) -> None:
        _check_positive("Young's modulus", self.young)
        if not -1.0 < self.poisson <= 0.5:
            raise NotApplicable(f"Poisson's ratio is {self.poisson:g}", "it is above -1 and at most 0.5")
        if not math.isfinite(self.depth):
            raise NotApplicable("the depth is not finite", "give a finite travel")

    @property
    def touches(self) -> bool:
        """True if there is contact."""
        return self.depth > 0.0

    @property
    def gap(self) -> float:
        """Remaining gap, m; 0 in contact."""
        return max(-self.depth, 0.0)

    @property
    def modulus(self) -> float:
        """Contact modulus E* = E / (1 - nu^2), Pa, for contact with a rigid body."""
        return self.young / (1.0 - self.poisson**2)

    @property
    def radius(self) -> float:
        """Contact radius, m."""
        return self.tip.radius(self.depth) if self.touches else 0.0

    @property
    def area(self) -> float:
        """Contact area, m^2."""
        return math.pi * self.radius**2

    @property
    def push(self) -> float:
        """Force into the body, N: 2 pi int -g dt."""
        a, n = self.radius, self.tip.power
        if not self.touches:
            return 0.0
        return 2.0 * self.modulus * (self.depth * a - self.tip.rate * a ** (n + 1) / (n + 1))

    @property
    def largest_pressure(self) -> float:
        """Largest contact pressure, Pa: at the centre for a sphere, infinite for a cone or a punch."""
        if not self.touches:
            return 0.0
        return 2.0 * self.modulus * self.tip.rate * self.radius / math.pi if self.tip.power == 2 else math.inf

    @property
    def energy(self) -> float:
        """Stored energy, J: the integral of the force over the depth."""
        return self.push * self.depth / (1.0 + self.tip.force_exponent)

    def pressure(self, r: Array) -> Array:
        """Return the contact pressure (n,), Pa, at distances r from the axis (n,), m."""
        x = np.abs(np.asarray(r, dtype=float)) / (self.radius or 1.0)
        inside = (x < 1.0) & self.touches
        y = np.where(inside, x, 0.0)
        match self.tip.power:
            case 2:
                found = self.largest_pressure * np.sqrt(1.0 - y**2)
            case 1:
                with np.errstate(divide="ignore"):
                    found = self.modulus * self.tip.rate / math.pi * np.arccosh(1.0 / y)
            case _:
                found = self.modulus * self.depth / (math.pi * self.radius or 1.0) / np.sqrt(1.0 - y**2)
        return np.where(inside, found, 0.0)

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        from_touch, n = as_points(X) - np.asarray(self.at), np.asarray(self.normal)
        if not self.touches:
            return np.zeros_like(from_touch)
        z = np.maximum(-(from_touch @ n), 0.0)
        across = from_touch - (from_touch @ n)[:, None] * n
        r = np.linalg.norm(across, axis=1)
        outward, inward = self.moved(r, z)
        way = across / np.where(r > 0.0, r, 1.0)[:, None]
        found: Array = outward[:, None] * way - inward[:, None] * n
        return found

    def moved(self, r: Array, z: Array) -> tuple[Array, Array]:
        """Return displacements (n,), m, away from the axis and into the body, at radius r and depth z (n,), m."""
        a, nu, G = self.radius, self.poisson, 0.5 * self.young / (1.0 + self.poisson)
        share, power = self.modulus / math.pi, self.tip.power
        near, r = r < ON_AXIS * a, np.maximum(r, ON_AXIS * a)
        out, into = np.zeros(len(r)), np.zeros(len(r))
        for n, g in ((0, -share * self.depth), (power, share * self.tip.rate)):
            by_r, by_z, by_rz, by_zz = potential_derivatives(n, a, r, z)
            out += g * ((1.0 - 2.0 * nu) * by_r + z * by_rz) / (2.0 * G)
            into += g * (-2.0 * (1.0 - nu) * by_z + z * by_zz) / (2.0 * G)
        return np.where(near, 0.0, out), into

    # ------------------------------------------------------------------ how far the body is from a half-space

    @property
    def estimated_error(self) -> float:
        """Error of a displacement, m: the displacement of the half-space at the ends of the real body.

        It is at least the rounding error.
        """
        if not self.touches:
            return 0.0
        return max(ROUNDING * abs(self.depth), self._far_face_displacement, self._side_displacement)

    @property
    def _far_face_displacement(self) -> float:
        """Displacement of the half-space at the depth of the real body's far face, m."""
        h = self.around.thickness
        return 0.0 if math.isinf(h) else float(self.moved(np.zeros(1), np.array([h]))[1][0])

    @property
    def _side_displacement(self) -> float:
        """Displacement of the half-space's surface at the distance of the real body's nearest side, m."""
        w = self.around.width
        return 0.0 if math.isinf(w) else float(self.moved(np.array([w]), np.zeros(1))[1][0])

    @cached_property
    def layer(self) -> Layer:
        """Layer that has the thickness of the real body and is indented in the same way."""
        from softmark.references.layer_integral_equation import Layer

        around = self.around
        return Layer(self.tip, self.depth, self.young, self.poisson, around.thickness, around.bonded)

    @cached_property
    def relative_errors(self) -> dict[str, float]:
        """Estimated errors of the force, relative to the force, by name of the effect that the half-space theory
        neglects.

        `thickness`: finite thickness of the body, from the integral equation of a layer. `sides`: finite width of the
        body,
        an order of magnitude from the displacement that a layer has at the sides. `depth`, `rim` and `tip` are those of
        `Tip.relative_errors`.
        """
        if not self.touches:
            return {"thickness": 0.0, "sides": 0.0}
        thickness, beside = 0.0, self._side_displacement
        if math.isfinite(self.around.thickness):
            thickness = self.layer.push / self.push - 1.0
            beside = 0.0 if math.isinf(self.around.width) else abs(self.layer.surface_displacement(self.around.width))
        return {
            "thickness": thickness,
            "sides": -self.tip.force_exponent * beside / self.depth,
            **self.tip.relative_errors(self.depth),
        }


@dataclass(frozen=True)
class ForceTheory:
    """Base class of other theories of indentation, which give forces and pressures but no displacements. SI units."""

    pressed: HalfSpace

    @property
    def at(self) -> Vector:
        """Point of first contact, m."""
        return self.pressed.at

    @property
    def gap(self) -> float:
        """Remaining gap, m; 0 in contact."""
        return self.pressed.gap

    displacement = None


def potential_derivatives(n: int, a: float, r: Array, z: Array) -> tuple[Array, Array, Array, Array]:
    """Return dphi/dr, dphi/dz, d2phi/drdz and d2phi/dz2 (k,) of the potential for g(t) = t^n, n <= 2.

    g is zero beyond the contact radius a. The derivatives are evaluated at radii r > 0 and depths z >= 0 (k,), m.
    """
    first, last = z + 0j, z + 1j * a
    sums = _potential_integrals(n + 1, a, r, z)

    def ends(high: Complex, low: Complex) -> Complex:  # [t^n f]
        return a**n * high - low if n == 0 else a**n * high

    s0, s1 = (_complex_distance(r, zeta) for zeta in (first, last))
    with_zeta = [z * sums[k] + 1j * sums[k + 1] for k in range(n + 1)]
    by_r: Array = (a ** (n + 1) / (n + 1) - with_zeta[n].real) / r
    by_zz = -1j * ends(1.0 / s1, 1.0 / s0)
    by_rz = 1j * ends(last / (r * s1), first / (r * s0))
    if n:
        by_zz = by_zz + 1j * n * sums[n - 1]
        by_rz = by_rz - 1j * n * with_zeta[n - 1] / r
    by_z: Array = np.asarray(sums[n].real, dtype=np.float64)
    rz: Array = np.asarray(by_rz.real, dtype=np.float64)
    zz: Array = np.asarray(by_zz.real, dtype=np.float64)
    return by_r, by_z, rz, zz


def _complex_distance(r: Array, zeta: Complex) -> Complex:
    """Return sqrt(r^2 + zeta^2) on the branch that equals r at zeta = 0; it is never 0."""
    found = np.sqrt(r**2 + zeta**2 + 0j)
    return np.where(np.abs(found) < 1e-12 * r, 1e-12 * r, found)


def _potential_integrals(most: int, a: float, r: Array, z: Array) -> list[Complex]:
    """Return int_0^a t^n / sqrt(r^2 + (z + i t)^2) dt (k,) for n = 0 to `most`, as sums of elementary integrals."""
    ends = []
    for zeta in (z + 0j, z + 1j * a):
        s = _complex_distance(r, zeta)
        log = np.log(zeta + s)
        ends.append([log, s, 0.5 * (zeta * s - r**2 * log), s**3 / 3.0 - r**2 * s])
    whole = [last - first for first, last in zip(*ends, strict=True)]
    return [
        (-1j) ** (n + 1) * sum(math.comb(n, k) * (-z) ** (n - k) * whole[k] for k in range(n + 1))
        for n in range(most + 1)
    ]
