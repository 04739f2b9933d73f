"""What the sections of a member come to over its elements: integrals along the axis, of tapered members too.

An element of two nodes and one point carries forces and moments that do not change along it. Its stiffness to each is
what these find of it: length over the integral of 1 / C. A bar that tapers is then as long, and as far twisted, as its
closed form says, however few elements it has. Masses go to nodes by hat functions. Integrals are by Gauss's rule of
24 points in each element: where one end is a tenth of the other, 1 / C is exact to thirteen digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.models.beam.sections import of_section
from softmark.solvers.energies.energy import Floats

if TYPE_CHECKING:
    from softmark.solvers.mesh.frame import Member
    from softmark.solvers.mesh.shape import Section

PLACES, WEIGHTS = np.polynomial.legendre.leggauss(24)
PARTS, SHARES = 0.5 * (1.0 + PLACES), 0.5 * WEIGHTS  # of an element


def stiffnesses(member: Member, stations: Floats, material: Any) -> Floats:
    """EA, GA2, GA3, GJ, EI2, EI3 of each element (e, 6), N and N m^2, between stations (e + 1,), m."""
    if not member.tapered:
        return np.tile(_diagonal(member.section, material), (len(stations) - 1, 1))
    C = _sampled(member, stations, lambda section: _diagonal(section, material))  # (e, 24, 6)
    found: Floats = 1.0 / np.einsum("g,egc->ec", SHARES, 1.0 / C)
    return found


def at_nodes(member: Member, stations: Floats, of: Callable[[Section], Any]) -> Floats:
    """Integrals of something of the section, numbers (c,), with the hat functions of the nodes (e + 1, c)."""
    l = np.diff(stations)
    values = _sampled(member, stations, of) * l[:, None, None]
    before, behind = (np.einsum("g,egc->ec", SHARES * part, values) for part in (1.0 - PARTS, PARTS))
    none = np.zeros((1, values.shape[2]))
    found: Floats = np.concatenate([before, none]) + np.concatenate([none, behind])
    return found


def _sampled(member: Member, stations: Floats, of: Callable[[Section], Any]) -> Floats:
    """Numbers of the sections at Gauss's places in each element (e, 24, c)."""
    s = stations[:-1, None] + np.diff(stations)[:, None] * PARTS
    if not member.tapered:
        return np.tile(of(member.section), (*s.shape, 1)).astype(np.float64)
    return np.array([[of(member.section_at(at)) for at in row] for row in s.tolist()], dtype=np.float64)


def _diagonal(section: Section, material: Any) -> Floats:
    """Of a section; e2 and e3 lie along its first and second axis."""
    return of_section(section, material).stiffness.diagonal
