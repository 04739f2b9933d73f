"""Data of a straight cantilever, to which the beam references are applied.

References do not know scenes or meshes: the caller reduces the scene to a `Cantilever`. If that is impossible it raises
`NotApplicable`, with the reason and the remedy.

To add a section, write a frozen dataclass with the members of `Section`.
"""

from __future__ import annotations

import math
from typing import Protocol

from softmark.records import dataclass

Vector = tuple[float, float, float]

ALIGNMENT = 1e-9
"""How far from unit length the axis, and from a right angle gravity, may be: well above what rounding does to
a direction, and far too little to bend the beam differently."""


class NotApplicable(Exception):
    """Error when a reference does not apply to a case: `reason` is the cause, `remedy` the change that would help."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason = reason
        self.remedy = remedy


class Section(Protocol):
    """Interface of a beam's cross-section, uniform along the beam and symmetric about the plane of bending."""

    @property
    def extents(self) -> tuple[float, float]:
        """Extents of the section along gravity and across, m."""

    @property
    def area(self) -> float:
        """Area of the section A, m^2."""

    @property
    def second_moment(self) -> float:
        """Second moment I, m^4: the integral over the section of the squared distance from the bending axis."""

    def shear_factor(self, poisson: float) -> float:
        """Return the shear factor kappa: the shear force is kappa G A times the mean shear strain."""


@dataclass(frozen=True)
class Disc:
    """A solid circular section."""

    radius: float  # m

    def __post_init__(self) -> None:
        _check_positive("radius", self.radius)

    @property
    def extents(self) -> tuple[float, float]:
        """Diameter in both directions, m."""
        return 2.0 * self.radius, 2.0 * self.radius

    @property
    def area(self) -> float:
        """Area A = pi R^2, m^2."""
        return math.pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """Second moment I = pi R^4 / 4, m^4."""
        return math.pi * self.radius**4 / 4

    def shear_factor(self, poisson: float) -> float:
        """Return kappa = 6 (1 + nu) / (7 + 6 nu). Source: Cowper 1966, J. Appl. Mech. 33:335."""
        return 6 * (1 + poisson) / (7 + 6 * poisson)


@dataclass(frozen=True)
class Ring:
    """A hollow circular section."""

    radius: float  # m
    inner: float  # m

    def __post_init__(self) -> None:
        _check_positive("inner", self.inner)
        _check_positive("wall", self.radius - self.inner)

    @property
    def extents(self) -> tuple[float, float]:
        """Outer diameter in both directions, m."""
        return 2.0 * self.radius, 2.0 * self.radius

    @property
    def area(self) -> float:
        """Area A = pi (R^2 - r^2), m^2."""
        return math.pi * (self.radius**2 - self.inner**2)

    @property
    def second_moment(self) -> float:
        """Second moment I = pi (R^4 - r^4) / 4, m^4."""
        return math.pi * (self.radius**4 - self.inner**4) / 4

    def shear_factor(self, poisson: float) -> float:
        """Return kappa = 6 (1 + nu) (1 + m^2)^2 / ((7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2), m = r / R.

        Source: Cowper 1966, J. Appl. Mech. 33:335.
        """
        m = self.inner / self.radius
        square = (1 + m * m) ** 2
        return 6 * (1 + poisson) * square / ((7 + 6 * poisson) * square + (20 + 12 * poisson) * m * m)


@dataclass(frozen=True)
class Rectangle:
    """A solid rectangular section, `height` measured along gravity."""

    height: float  # m
    width: float  # m

    def __post_init__(self) -> None:
        _check_positive("height", self.height)
        _check_positive("width", self.width)

    @property
    def extents(self) -> tuple[float, float]:
        """Height and width, m."""
        return self.height, self.width

    @property
    def area(self) -> float:
        """Area A = h b, m^2."""
        return self.height * self.width

    @property
    def second_moment(self) -> float:
        """Second moment I = b h^3 / 12, m^4."""
        return self.width * self.height**3 / 12

    def shear_factor(self, poisson: float) -> float:
        """Return kappa = 10 (1 + nu) / (12 + 11 nu). Source: Cowper 1966, J. Appl. Mech. 33:335."""
        return 10 * (1 + poisson) / (12 + 11 * poisson)


@dataclass(frozen=True)
class Cantilever:
    """Straight uniform beam, clamped at `root`, bent by gravity normal to its axis. SI units.

    Raises NotApplicable if the beam or its load is not of that kind.
    """

    length: float  # m
    section: Section
    young: float  # Pa
    poisson: float  # 1
    density: float  # kg/m^3
    root: Vector  # m, the centre of the clamped section
    axis: Vector  # unit vector, from the root to the tip
    gravity: Vector  # m/s^2

    def __post_init__(self) -> None:
        _check_positive("length", self.length)
        _check_positive("Young's modulus", self.young)
        _check_positive("density", self.density)
        _check_poisson(self.poisson)
        _check_finite("root", self.root)
        _check_axis(self.axis)
        _check_gravity(self.gravity, self.axis)

    @property
    def weight_per_length(self) -> float:
        """Weight w = rho A |g|, N per metre of the undeformed beam."""
        return self.density * self.section.area * math.hypot(*self.gravity)

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)), Pa."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI, N m^2."""
        return self.young * self.section.second_moment

    @property
    def axial_stiffness(self) -> float:
        """Axial stiffness EA, N."""
        return self.young * self.section.area

    @property
    def shear_stiffness(self) -> float:
        """Shear stiffness kappa G A, N."""
        return self.section.shear_factor(self.poisson) * self.shear_modulus * self.section.area

    @property
    def load_parameter(self) -> float:
        """Dimensionless load parameter k = w L^3 / (EI); it alone determines the shape of an inextensible beam."""
        return self.weight_per_length * self.length**3 / self.bending_stiffness

    @property
    def down(self) -> Vector:
        """Unit vector in the direction of gravity."""
        g = math.hypot(*self.gravity)
        return (self.gravity[0] / g, self.gravity[1] / g, self.gravity[2] / g)


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0):
        raise NotApplicable(f"the {name} is {value:g}", f"give a {name} that is finite and above zero")


def _check_finite(name: str, vector: Vector) -> None:
    if not all(map(math.isfinite, vector)):
        raise NotApplicable(f"the {name} is {vector}", f"give a {name} of three finite numbers")


def _check_poisson(poisson: float) -> None:
    if not -1 < poisson <= 0.5:
        raise NotApplicable(f"Poisson's ratio is {poisson:g}", "give one above -1 and at most 0.5")


def _check_axis(axis: Vector) -> None:
    _check_finite("axis", axis)
    if abs(math.hypot(*axis) - 1) > ALIGNMENT:
        raise NotApplicable(f"the axis has length {math.hypot(*axis):.10g}", "normalize it")


def _check_gravity(gravity: Vector, axis: Vector) -> None:
    _check_finite("gravity", gravity)
    g = math.hypot(*gravity)
    if g == 0:
        raise NotApplicable("gravity is zero, so nothing bends the beam", "add a gravity load across the axis")
    along = sum(a * b for a, b in zip(gravity, axis, strict=True)) / g
    if abs(along) > ALIGNMENT:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, along))))
        raise NotApplicable(
            f"gravity is at {angle:.6g} degrees to the axis of the beam, but this reference needs 90",
            "make the beam and gravity perpendicular, or remove this reference",
        )
