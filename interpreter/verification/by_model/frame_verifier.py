"""Verifier of beam networks: computes the forces of each member and sums them at the joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam import flat_strips
from softmark.interpreter.models.beam_frame import frame_selection
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification.by_model.beam_forces_check import (
    deformed_nodes_and_axes,
    integrate_hats,
    sampling_distance,
    stiffness_along,
    worse_balance,
)
from softmark.interpreter.verification.by_model.beam_verifier import BENT, STRETCHED, TAPERED, BeamVerifier
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution
from softmark.interpreter.verification.grid_convergence import COARSE
from softmark.interpreter.verification.probe_errors import NoErrorEstimate
from softmark.interpreter.verification.reaction_balance import sum_by_support
from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.records import dataclass
from softmark.solvers.independent_forces.rod_forces import CheckedRod
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance
from softmark.solvers.mesh.frame_shapes import Member, Network
from softmark.solvers.mesh.shape import Swept, transverse

ALIGNED = 1e-9  # difference of unit vectors below which two hinge axes are the same
JOINED = 3.0  # times half the depth of what a member ends in, over its length: bending goes with the cube of length


@dataclass(frozen=True)
class DeformedNetwork:
    """Deformed beam network, built independently of its solver from the displacements of points.

    Each member has nodes (k, 3), m. Nodes of members that meet at a joint share one place.
    """

    found: VerifiedSolution

    @property
    def network(self) -> Network:
        """Geometry of the undeformed network."""
        return _network(self.found.case)

    @cached_property
    def X(self) -> list[Floats]:
        """Undeformed nodes of each member, (k, 3), m."""
        t = np.linspace(0.0, 1.0, self.found.declared.thing.segments + 1)[:, None]
        return [(1.0 - t) * np.array(m.begin) + t * np.array(m.end) for m in self.network.members]

    @cached_property
    def at(self) -> tuple[Floats, NDArray[np.int64]]:
        """Distinct positions of the nodes (p, 3), m, called places, and the index of the place of every node (n,).

        Nodes closer than a thousandth of a segment share a place.
        """
        every = np.concatenate(self.X)
        least = min(m.length for m in self.network.members) / self.found.declared.thing.segments
        known: dict[tuple[int, ...], int] = {}
        own = np.zeros(len(every), dtype=np.int64)
        for i, cell in enumerate(np.rint(every / (1e-3 * least)).astype(np.int64).tolist()):
            own[i] = known.setdefault(tuple(cell), len(known))
        places_ = np.zeros((len(known), 3))
        places_[own] = every
        return places_, own

    @cached_property
    def rods(self) -> list[CheckedRod]:
        """Deformed members, from displacements of points on their axes and at a distance from them."""
        return [self._deform_member(i, member) for i, member in enumerate(self.network.members)]

    def _deform_member(self, number: int, member: Member) -> CheckedRod:
        X, across = self.X[number], np.array(member.frame(0.0))[None, 1:]
        shifts: Any = self.found.solution.displacement  # its method `of` gives that of one member
        x, R = deformed_nodes_and_axes(X, across, sampling_distance(member.section), partial(shifts.of, number))
        C = stiffness_along(member, np.linspace(0.0, member.length, len(X)), self.found.case.material)
        return CheckedRod(x, R, np.linalg.norm(np.diff(X, axis=0), axis=1), C)

    @cached_property
    def x(self) -> Floats:
        """Deformed positions of the places (p, 3), m."""
        found = np.zeros_like(self.at[0])
        found[self.at[1]] = np.concatenate([rod.x for rod in self.rods])
        return found

    def joined(self, parts: list[Floats]) -> Floats:
        """Return the sums over members of nodal values at the joints and other nodes of the network (p, 6).

        `parts` has the nodal values (k, 6) of each member.
        """
        found = np.zeros((len(self.at[0]), 6))
        np.add.at(found, self.at[1], np.concatenate(parts))
        return found

    def inside(self) -> Floats:
        """Return the internal forces and moments at the places (p, 6), N and N m, in space axes."""
        return self.joined([rod.forces()[0] for rod in self.rods])

    def outside(self) -> Floats:
        """Return the forces and moments of loads at the places (p, 6), N and N m. Raises NoIndependentFormula."""
        return self.joined(
            [np.sum([*self._member_load_forces(i, m)], axis=0) for i, m in enumerate(self.network.members)]
        )

    def _member_load_forces(self, number: int, member: Member) -> Iterator[Floats]:
        """Yield the forces and moments of every load at the nodes of a member (k, 6), N and N m."""
        X = self.X[number]
        s = np.linspace(0.0, member.length, len(X))
        yield np.zeros((len(X), 6))
        for load in self.found.case.loads:
            found = np.zeros((len(X), 6))
            match load.thing.action:
                case BodyForce(acceleration=g):
                    w = self.found.case.material.density * np.array(g)
                    found[:, :3] = np.outer(
                        integrate_hats(s, 0.0, member.length, lambda at: member.section_at(at).area), w
                    )
                case LineForce(begin=begin, end=end, force=q):
                    if frame_selection.locate_line_on_member(self.network, begin, end)[0] == number:  # type: ignore[index]  # E345 refuses others
                        low, high = sorted(
                            float(np.dot(np.subtract(p, member.begin), member.axis)) for p in (begin, end)
                        )
                        found[:, :3] = np.outer(integrate_hats(s, low, high), q)
                case PointLoad(at=at, force=force):
                    if frame_selection.locate_on_member(self.network, at)[0] == number:  # type: ignore[index]  # E345 refuses others
                        here = float(np.dot(np.subtract(at, member.begin), member.axis))
                        found[:, :3] = np.outer([np.interp(here, s, row) for row in np.eye(len(X))], force)
                case MomentLoad(where=where, moment=moment):
                    at = self.network.points[frame_selection.select_points_and_members(where, self.network)[0][0]]
                    ends = [i for i in (0, -1) if np.allclose(X[i], at, rtol=0.0, atol=1e-9 * member.length)]
                    if ends and number == self._first_member_at(at):
                        found[ends[0], 3:] = moment
                case _:
                    raise NoIndependentFormula(f"no independent formula is available for the load `{load.name}`")
            yield found

    def _first_member_at(self, point: tuple[float, float, float]) -> int:
        near = (i for i, m in enumerate(self.network.members) if point in (m.begin, m.end))
        return next(near)

    def carried_components(self, support: Declared) -> NDArray[np.bool_]:
        """Return a mask of the force and moment components (p, 6), in space axes, that one support carries.

        At a hinge it includes the moment about the hinge axis, which `held` removes.
        """
        points, whole, _ = frame_selection.select_points_and_members(support.thing.where, self.network)
        near = [np.array([self.network.points[i] for i in points]).reshape(-1, 3), *(self.X[m] for m in whole)]
        held = np.concatenate(near)
        apart = np.linalg.norm(self.at[0][:, None] - held[None], axis=2).min(axis=1)
        own = [*support.thing.components, *((3, 4, 5) if support.thing.carries_moments else ())]
        return np.outer(apart <= 1e-9 * self.network.diagonal, np.isin(np.arange(6), own))

    @cached_property
    def hinge_axes_by_place(self) -> dict[int, Floats]:
        """Axis of the hinge at each place and two axes normal to it, as rows (3, 3), by index of the place.

        If a place has several hinges, the first one counts.
        """
        found: dict[int, Floats] = {}
        for support in self.found.case.supports:
            if (axis := support.thing.hinge_axis) is None:
                continue
            for i in np.flatnonzero(self.carried_components(support).any(axis=1)).tolist():
                found.setdefault(i, np.array([axis, *transverse(axis)]))
        return found

    def resolve_hinge_moments(self, forces: Floats) -> Floats:
        """Return forces and moments (p, 6), with moments at hinges as components along and normal to the hinge axis."""
        found = forces.copy()
        for i, rows in self.hinge_axes_by_place.items():
            found[i, 3:] = rows @ forces[i, 3:]
        return found

    def held(self) -> NDArray[np.bool_]:
        """Return a mask of the force and moment components (p, 6) that all supports together carry.

        Moments at hinges have components as in `resolve_hinge_moments`; the component about the hinge axis is not
        carried.
        """
        found = np.zeros((len(self.at[0]), 6), dtype=np.bool_)
        for support in self.found.case.supports:
            own = self.carried_components(support)
            if support.thing.hinge_axis is not None:
                for i in np.flatnonzero(own.any(axis=1)).tolist():
                    one = np.linalg.norm(np.cross(support.thing.hinge_axis, self.hinge_axes_by_place[i][0])) <= ALIGNED
                    own[i, 3] = own[i, 3] and not one
            found |= own
        return found


def frame_of(found: VerifiedSolution) -> DeformedNetwork:
    """Return the deformed network of a solution; computed once."""
    if frame_of not in found.known:
        found.known[frame_of] = DeformedNetwork(found)
    known: DeformedNetwork = found.known[frame_of]
    return known


def _internal_and_external_forces(found: VerifiedSolution) -> tuple[Floats, Floats, NDArray[np.bool_], float]:
    """Return internal and external forces (p, 6), N, a mask of supported components, and the rounding, N.

    Moments are divided by the extent of the network.
    """
    if found.solution.displacement is None:
        raise NoIndependentFormula("there is no solution")
    if _internal_and_external_forces not in found.known:
        frame, scale = frame_of(found), _moment_scaling(found)
        noise = max(
            rod.rounding(sampling_distance(m.section)) for rod, m in zip(frame.rods, frame.network.members, strict=True)
        )
        inside, outside = frame.inside() * scale, frame.outside() * scale
        found.known[_internal_and_external_forces] = inside, outside, frame.held(), noise * len(frame.rods) ** 0.5
    known: tuple[Floats, Floats, NDArray[np.bool_], float] = found.known[_internal_and_external_forces]
    return known


def _moment_scaling(found: VerifiedSolution) -> Floats:
    """Return factors (6,) that divide the moments by the network's extent, so that all six components are forces."""
    return np.array([1.0, 1.0, 1.0, *[1.0 / found.case.shape.diagonal] * 3])


class FrameVerifier(BeamVerifier):
    """Verifier of beam networks, member by member."""

    theory = "frames"

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the largest bending and axial strains, and the largest curvature of a member."""
        if found.solution.displacement is None:
            return {}
        bent, stretched, curvature = 0.0, 0.0, 0.0
        frame = frame_of(found)
        for rod, member in zip(frame.rods, frame.network.members, strict=True):
            u, v = (max(abs(p[i]) for p in member.section.samples()) for i in (0, 1))
            own = rod.strain(np.array([sampling_distance(member.section), v, u]))
            bent, stretched = max(bent, own[0]), max(stretched, own[1])
            curvature = max(curvature, float(np.hypot(rod.curvatures[:, 1], rod.curvatures[:, 2]).max()))
        return {
            "largest_strain": bent + stretched, "bending_strain": bent, "axial_strain": stretched,
            "curvature_per_m": curvature,
        }  # fmt: skip

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Return the force balance, summed at joints by the formulas of rod_forces.py, and the residual of the solver.

        Raises NoIndependentFormula.
        """
        inside, outside, fixed, noise = _internal_and_external_forces(found)
        inside, outside = (frame_of(found).resolve_hinge_moments(forces) for forces in (inside, outside))
        return worse_balance(inside, outside, fixed, noise), found.solution.facts.get("residual")

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Return the reaction of each support, computed independently by rod_forces.py, and a tolerance, N.

        Differences below the tolerance may be due to rounding. Raises NoIndependentFormula.
        """
        inside, outside, _, noise = _internal_and_external_forces(found)
        frame = frame_of(found)
        masks = {support.name: frame.carried_components(support) for support in found.case.supports}
        return sum_by_support(masks, (inside - outside) / _moment_scaling(found), frame.x), LEFT * noise

    def left_out(self, answer: SolutionUnderTest) -> float:
        """Return the relative error of beam theory: the largest of all members, plus the effect of the largest strains.

        Raises NoErrorEstimate if the members are too thick or too strained.
        """
        checks = answer.result.solve.get("checks") or {}
        names = "bending_strain", "axial_strain", "curvature_per_m"
        bent, stretched, curvature = (float(checks.get(n) or 0.0) for n in names)
        network, poisson = _network(answer.case), answer.case.material.poisson
        missing = max(_member_theory_error(network, i, poisson, curvature) for i in range(len(network.members)))
        strained = BENT * bent**2 + STRETCHED * stretched
        if missing + strained > COARSE:
            raise NoErrorEstimate(
                "a member is too thick for beam theory"
                if missing > strained
                else "the strain is too large for beam theory"
            )
        return missing + strained

    def pieces(self, case: Case) -> Sequence[Swept]:
        """Return the members as bodies along an axis."""
        return _network(case).members


def _network(case: Case) -> Network:
    assert isinstance(case.shape, Network)
    return case.shape


def _member_theory_error(network: Network, number: int, poisson: float, curvature: float) -> float:
    """Return the relative theory error of one member, due to its section and to the size of the joints at its ends."""
    member, (run, ends) = network.members[number], network.run(number)
    section = member.section
    length = sum(network.members[i].length for i in run)
    others = [[i for i in network.at(end) if i not in run] for end in ends]
    deep = sum(max((max(network.members[i].section.extents) for i in here), default=0.0) for here in others)
    found = flat_strips.clamp_effect_on_bending(section, length, poisson, max(1, sum(map(bool, others))), True)
    found += flat_strips.strip_stiffening(section, poisson, curvature) + flat_strips.ovalling_softening(
        section, poisson, curvature
    )
    return found + JOINED * 0.5 * deep / length + TAPERED * member.taper_slope**2


VERIFIER = FrameVerifier()
