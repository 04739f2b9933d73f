"""Section properties of rods, and their integrals over elements of tapered rods.

An element of two nodes and one point carries constant forces and moments. For each of the six stiffnesses C of
a section, the stiffness of an element is its length divided by the integral of 1 / C. The extension and twist
of a tapered bar are then exact for any number of elements. Masses are distributed to nodes by hat functions.
Integrals use Gauss's rule of 24 points in each element: if one end is a tenth of the other, 1 / C is exact to
thirteen digits. With many elements 6 points are enough.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.solvers.energies.energy import Floats
from softmark.solvers.energies.rod_section import RodSection

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Section, Swept

MANY = 32  # number of elements from which each tapers so little that fewer points give the same digits


def section_properties(section: Section, material: Any) -> RodSection:
    """Return the properties of a cross-section of a material; e2 and e3 are its first and second axis."""
    I2, I3 = section.moments  # about its first and its second axis: about e2 the distance is X3
    kappa = section.shear_factor(material.poisson)
    return RodSection(section.area, I2, I3, section.torsion, kappa, kappa, material.young, material.shear_modulus)


def inertia(section: Section) -> list[float]:
    """Return mass and moments of inertia of a section about e1, e2 and e3, divided by density and length."""
    return [section.area, sum(section.moments), *section.moments]


def stiffnesses(shape: Swept, stations: Floats, material: Any) -> Floats:
    """Return EA, GA2, GA3, GJ, EI2, EI3 of each element (e, 6), N and N m^2, between stations (e + 1,), m."""
    if not shape.tapered:
        return np.tile(_section_stiffnesses(shape.section, material), (len(stations) - 1, 1))
    C = _properties_at_gauss_points(
        shape, stations, lambda section: _section_stiffnesses(section, material)
    )  # (e, g, 6)
    found: Floats = 1.0 / np.einsum("g,egc->ec", _element_quadrature(len(C))[1], 1.0 / C)
    return found


def integrate_at_nodes(shape: Swept, stations: Floats, of: Callable[[Section], Any]) -> Floats:
    """Return the integrals of section properties, weighted by the hat function of each node (e + 1, c).

    `of` returns the c properties of a section.
    """
    l, (parts, shares) = np.diff(stations), _element_quadrature(len(stations) - 1)
    values = _properties_at_gauss_points(shape, stations, of) * l[:, None, None]
    before, behind = (np.einsum("g,egc->ec", shares * part, values) for part in (1.0 - parts, parts))
    none = np.zeros((1, values.shape[2]))
    found: Floats = np.concatenate([before, none]) + np.concatenate([none, behind])
    return found


def _element_quadrature(count: int) -> tuple[Floats, Floats]:
    """Return quadrature points and weights (g,) on the interval from 0 to 1, for a `count` of elements."""
    return _gauss(24 if count < MANY else 6)


@cache
def _gauss(places: int) -> tuple[Floats, Floats]:
    """Return Gauss points and weights on the interval from 0 to 1."""
    x, w = np.polynomial.legendre.leggauss(places)
    return 0.5 * (1.0 + x), 0.5 * w


def _properties_at_gauss_points(shape: Swept, stations: Floats, of: Callable[[Section], Any]) -> Floats:
    """Return section properties at the Gauss points of each element (e, g, c); `of` returns those of a section."""
    s = stations[:-1, None] + np.diff(stations)[:, None] * _element_quadrature(len(stations) - 1)[0]
    if not shape.tapered:
        return np.tile(of(shape.section), (*s.shape, 1)).astype(np.float64)
    return np.array([[of(shape.section_at(at)) for at in row] for row in s.tolist()], dtype=np.float64)


def _section_stiffnesses(section: Section, material: Any) -> Floats:
    """Return the six stiffnesses EA, GA2, GA3, GJ, EI2, EI3 of a section."""
    return section_properties(section, material).stiffness.diagonal
