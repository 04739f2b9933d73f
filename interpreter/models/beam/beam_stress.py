"""Static stress at any point of beams and frames, from section forces and moments by the theory of sections.

Section forces of an element follow from its nodal forces. The force is that at the middle of the element, and
moments are interpolated between its ends; both are exact if forces act only at nodes. Gravity and line loads
act between nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.records import dataclass
from softmark.solvers.energies.rod_rotation import interpolate_rotation, rotation
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.shape import Swept
from softmark.solvers.stress_recovery.analytic_stress_field import AnalyticField
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC
from softmark.solvers.stress_recovery.section_stress import section_stress, tapered_section_stress
from softmark.solvers.stress_recovery.stress_measures import Tensors

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Section

AROUND = 1e-9  # of the length: a point so little beyond the end counts as at the end


@dataclass(frozen=True)
class MemberAxisState:
    """Axis of one beam or frame member, straight or curved, with its state and its element forces.

    `stations` (k,), m, are the positions of its nodes along the axis; `rest` and `now` (k, 7) are their undeformed and
    deformed positions and quaternions. `ends` (k - 1, 12) are the forces and moments at both ends of each element,
    forces in space, N, and moments about the axes of the nodes, N m. `lines` (k - 1, 3) are the line loads along each
    element, N/m.
    """

    shape: Swept
    stations: Floats
    rest: Floats
    now: Floats
    ends: Floats
    lines: Floats

    def carried(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Return section forces and moments N, V2, V3, T, M2, M3 (n, 6) at stations s (n,), m, and the section axes.

        The axes (n, 3, 3), as columns, are undeformed and deformed.
        """
        e = np.clip(np.searchsorted(self.stations, s, side="right") - 1, 0, len(self.stations) - 2)
        a, b = self.stations[e], self.stations[e + 1]
        t = np.clip((s - a) / (b - a), 0.0, 1.0)
        x = self.now[:, :3]
        tangent = (x[e + 1] - x[e]) / (b - a)[:, None]
        R, start = (rotation(interpolate_rotation(q[e, 3:], q[e + 1, 3:], t)) for q in (self.now, self.rest))
        force = self.ends[e, 6:9] - ((t - 0.5) * (b - a))[:, None] * self.lines[e]
        first, last = self._moments
        moment = (1.0 - t)[:, None] * first[e] + t[:, None] * last[e]
        moment -= (0.5 * t * (1.0 - t) * (b - a) ** 2)[:, None] * np.cross(tangent, self.lines[e])
        own = [np.einsum("nij,ni->nj", R, vector) for vector in (force, moment)]
        return np.concatenate(own, axis=1), start, R

    @cached_property
    def _moments(self) -> tuple[Floats, Floats]:
        """Return the section moments at the first and the last node of each element, (k - 1, 3) each, N m in space.

        They act on the part of the axis before the section.
        """
        R = rotation(self.now[:, 3:])
        first = -np.einsum("nij,nj->ni", R[:-1], self.ends[:, 3:6])
        return first, np.einsum("nij,nj->ni", R[1:], self.ends[:, 9:])


@dataclass(frozen=True)
class SectionStresses(AnalyticField):
    """Stress field of beams made of one material.

    `pieces` are the axes of the beams. `nearest` is a function that returns, for points (n, 3), m, the index of the
    nearest axis (n,).
    """

    pieces: Sequence[MemberAxisState]
    case: Case
    nearest: Callable[[Floats], Any]

    def at(self, X: Floats) -> Tensors:
        """Return stress and displacement gradient at points X (n, 3), m, of the undeformed body."""
        six, H, own = np.zeros((len(X), 6)), np.zeros((len(X), 9)), self.nearest(X)
        for number in np.unique(own).tolist():
            here = own == number
            six[here], H[here] = self._stress_and_displacement_gradient(self.pieces[number], X[here])
        return Tensors(six, H, False)

    def _stress_and_displacement_gradient(self, piece: MemberAxisState, X: Floats) -> tuple[Floats, Floats]:
        """Return the stress (n, 6), Pa, and the gradient du/dX (n, 9) at points X (n, 3), m, of one beam axis."""
        s, u, v = piece.shape.coordinates(X)
        carried, start, R = piece.carried(s)
        along = self._section_stress_components(piece.shape, s, carried, u, v)
        E, nu, G = self.case.material.young, self.case.material.poisson, self.case.material.shear_modulus
        stress, strain = np.zeros((len(X), 3, 3)), np.zeros((len(X), 3, 3))
        stress[:, 0] = along
        stress[:, :, 0] = along
        strain[:, 0] = strain[:, :, 0] = along / (2.0 * G)
        strain[:, 0, 0] = along[:, 0] / E
        strain[:, 1, 1] = strain[:, 2, 2] = -nu * along[:, 0] / E
        turned, F = R @ stress @ R.swapaxes(1, 2), R @ (np.eye(3) + strain) @ start.swapaxes(1, 2)
        return np.stack([turned[:, i, j] for i, j in SYMMETRIC], axis=1), (F - np.eye(3)).reshape(-1, 9)

    def _section_stress_components(self, shape: Swept, s: Floats, carried: Floats, u: Floats, v: Floats) -> Floats:
        """Return the stresses sigma_11, sigma_12 and sigma_13 (n, 3), Pa, from section forces `carried` (n, 6).

        u and v (n,), m, are coordinates in the section at stations s (n,), m.
        """
        nu = self.case.material.poisson
        if not shape.tapered:
            return section_stress(shape.section, nu, carried, u, v)
        found, places = np.zeros((len(s), 3)), np.clip(s, 0.0, shape.length)
        for place in np.unique(places).tolist():
            here = places == place
            section, known = shape.section_at(place), (carried[here], u[here], v[here])
            found[here] = tapered_section_stress(section, _taper_rates(shape, section), nu, *known)
        return found

    @cached_property
    def usual(self) -> tuple[float, float, float]:
        """Root mean squares of stress, Pa, strain and deviatoric stress, Pa, over points midway along elements."""
        at = [self.at(_section_sample_points(piece.shape, piece.stations)) for piece in self.pieces]
        sigma = np.concatenate([tensors.cauchy for tensors in at])
        strain = np.concatenate([tensors.strain("green") for tensors in at])
        s = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
        stress, strained, deviator = (float(np.sqrt((t**2).sum(axis=(1, 2)).mean())) for t in (sigma, strain, s))
        return stress, strained, deviator


def _taper_rates(shape: Swept, section: Section) -> tuple[float, float]:
    """Return the relative growth, 1/m, of both sides of a section along a tapered body."""
    ends = zip(shape.section_at(0.0).extents, shape.section_at(shape.length).extents, section.extents, strict=True)
    first, second = ((last - begin) / (shape.length * here) for begin, last, here in ends)
    return first, second


def _section_sample_points(shape: Swept, stations: Floats) -> Floats:
    """Return sample points (n, 3), m, in the sections midway between these stations, m."""
    found = []
    for s in (0.5 * (stations[1:] + stations[:-1])).tolist():
        _, first, second = np.array(shape.frame(s))
        places = np.array(shape.section_at(s).samples())
        found.append(np.array(shape.centre(s)) + places @ np.stack([first, second]))
    return np.concatenate(found)


def element_line_loads(
    case: Case, shape: Swept, stations: Floats, covers: Callable[[LineForce], tuple[float, float] | None]
) -> Floats:
    """Return the line loads on each element (k - 1, 3), N/m: gravity and line forces.

    `covers` returns the stations, m, between which a line force acts on this axis; None if it acts elsewhere.
    """
    middle, found = 0.5 * (stations[1:] + stations[:-1]), np.zeros((len(stations) - 1, 3))
    for load in case.loads:
        match load.thing.action:
            case BodyForce(acceleration=g):
                areas = np.array([shape.section_at(s).area for s in middle.tolist()])
                found += case.material.density * areas[:, None] * np.array(g)
            case LineForce(force=q) as line if (ends := covers(line)) is not None:
                low, high = (np.clip(s, stations[:-1], stations[1:]) for s in sorted(ends))
                found += ((high - low) / np.diff(stations))[:, None] * np.array(q)
    return found
