"""Forces in a beam, computed independently of its solver from the displaced positions of its points."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_declaration import Beam6Dof, axis_station
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import coverage, selects_whole_sections
from softmark.interpreter.verification.by_model.solid_forces_check import LEFT
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution
from softmark.interpreter.verification.reaction_balance import sum_by_support
from softmark.interpreter.verification.unverified_model_error import NoIndependentFormula
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.records import dataclass
from softmark.solvers.independent_forces import solid_forces
from softmark.solvers.independent_forces.rod_forces import CheckedRod, frames_from_arms
from softmark.solvers.independent_forces.solid_forces import Floats, ForceBalance
from softmark.solvers.mesh.shape import Prism, Section, Swept


@dataclass(frozen=True)
class BeamLine:
    """Axis, cross-sections and nodes of a beam model, built independently of its solver."""

    model: Beam6Dof
    case: Case
    s: Floats  # stations (n,), m

    @property
    def axes(self) -> Floats:
        """Axes e1, e2, e3 of the undeformed cross-section at the start of the beam, as rows (3, 3)."""
        return np.array(self.case.prism.frame(0.0))

    @cached_property
    def at_rest(self) -> tuple[Floats, Floats]:
        """Return the undeformed nodes (n, 3), m, and their axes e1, e2 and e3 as rows (n, 3, 3)."""
        shape, s = self.case.prism, self.s.tolist()
        return np.array([shape.centre(at) for at in s]), np.array([shape.frame(at) for at in s])

    @property
    def stiffness(self) -> Floats:
        """Section stiffnesses EA, GA2, GA3, GJ, EI2, EI3 (6,); for a tapered beam those of each element (e, 6)."""
        return stiffness_along(self.case.prism, self.s, self.case.material)

    def rod(self, displacement: Any) -> tuple[CheckedRod, float]:
        """Return the deformed rod and the distance from the axis, m, at which its cross-sections are sampled.

        Node positions and section axes follow from displacements of points on the axis and at that distance from it.
        """
        shape = self.case.prism
        arm, (X, axes) = sampling_distance(shape.section), self.at_rest
        x, R = deformed_nodes_and_axes(X, axes[:, 1:], arm, displacement)
        rigid = (() if self.model.axial else (0,)) + (() if self.model.shear else (1, 2))
        l, natural = np.diff(self.s), None
        if not isinstance(shape, Prism):
            l, natural = np.linalg.norm(np.diff(X, axis=0), axis=1), (X, axes.transpose(0, 2, 1))
        return CheckedRod(x, R, l, self.stiffness, rigid, natural), arm

    def loads(self, rod: CheckedRod) -> Floats:
        """Return forces and moments at the nodes of the deformed rod (n, 6), N and N m in space.

        Raises NoIndependentFormula.
        """
        shape, both, l = self.case.prism, np.zeros((len(self.s), 6)), np.diff(self.s)
        f, m = both[:, :3], both[:, 3:]
        for load in self.case.loads:
            match load.thing.action:
                case BodyForce(acceleration=g):
                    w = self.case.material.density * np.array(g)
                    if shape.tapered:
                        f += np.outer(
                            integrate_hats(self.s, 0.0, shape.length, lambda at: shape.section_at(at).area), w
                        )
                        continue
                    w *= shape.section.area
                    f[:-1] += 0.5 * l[:, None] * w
                    f[1:] += 0.5 * l[:, None] * w
                case SurfaceTraction(where=where, traction=traction):
                    end = 0 if coverage(where, shape, 0.0) == "all" else -1
                    f[end] += shape.section_at(self.s[end]).area * np.array(traction)
                case MomentLoad(where=where, moment=moment):
                    m[0 if coverage(where, shape, 0.0) == "all" else -1] += np.array(moment)
                case LineForce(begin=begin, end=end, force=q):
                    f += self._lumped_lengths(np.array(begin), np.array(end))[:, None] * np.array(q)
                case TendonLoad(guides=int(count)) as tendon:
                    both += self._guided_tendon_forces(tendon, count, rod)
                case TendonLoad() as tendon:
                    low, high = sorted(shape.section_coordinates(p)[0] for p in (tendon.begin, tendon.end))
                    ends = np.clip(self.s, low, high)
                    arms, slopes = self._tendon_arms_and_slopes(tendon, 0.5 * (ends[1:] + ends[:-1]))
                    both += rod.tendon_forces(tendon.tension * np.diff(ends) / np.diff(self.s), arms, slopes)
                case PointLoad(at=at, force=force) if axis_station(self.case, at) is None:
                    X, axes = self.at_rest
                    off = np.array(at) - X
                    node = int(np.abs(self.s - shape.section_coordinates(at)[0]).argmin())
                    f[node] += np.array(force)
                    m[node] += np.cross(rod.R[node] @ (axes[node] @ off[node]), np.array(force))
                case PointLoad(at=at, force=force):
                    s = axis_station(self.case, at) or 0.0
                    for node in range(len(self.s)):
                        f[node] += np.interp(s, self.s, np.eye(len(self.s))[node]) * np.array(force)
                case _:
                    raise NoIndependentFormula(f"no independent formula is available for the load `{load.name}`")
        return both

    def _lumped_lengths(self, begin: Floats, end: Floats) -> Floats:
        """Return the part of an interval of the axis, m, that belongs to each node, shape (n,)."""
        low, high = sorted(float((p - np.array(self.case.prism.root)) @ self.axes[0]) for p in (begin, end))
        return integrate_hats(self.s, low, high)

    def _tendon_arms_and_slopes(self, tendon: TendonLoad, s: Floats) -> tuple[Floats, Floats]:
        """Return the lever arms, m, and slopes of a tendon, each (k, 3) in section axes, at stations s (k,), m.

        The slopes are derivatives by complex steps.
        """
        shape = self.case.prism
        (low, *first), (high, *last) = sorted(shape.section_coordinates(p) for p in (tendon.begin, tendon.end))
        z = (s - low) / (high - low)
        turn, begin = 1j * tendon.winding, complex(*first)
        line = complex(*last) * np.exp(-turn) - begin
        arm = np.exp(turn * z) * (begin + line * z)
        slope = (np.exp(turn * z) * line + turn * arm) / (high - low)
        arms, slopes = (np.stack([0.0 * z, f.real, f.imag], axis=1) for f in (arm, slope))
        return arms, slopes

    def _guided_tendon_forces(self, tendon: TendonLoad, count: int, rod: CheckedRod) -> Floats:
        """Return nodal forces and moments (n, 6), N and N m in space, of a tendon that is straight between guides."""
        low, high = sorted(self.case.prism.section_coordinates(p)[0] for p in (tendon.begin, tendon.end))
        found, places = np.zeros((len(self.s), 6)), np.linspace(low, high, count)
        nodes = [int(np.abs(self.s - place).argmin()) for place in places]
        arms = self._tendon_arms_and_slopes(tendon, places)[0]
        arms[:, 0] = places - self.s[nodes]
        points = [rod.x[k] + rod.R[k] @ arm for k, arm in zip(nodes, arms, strict=True)]
        for (i, p), (j, q) in itertools.pairwise(zip(nodes, points, strict=True)):
            pull = tendon.tension * (q - p) / np.linalg.norm(q - p)
            found[i] += [*pull, *np.cross(p - rod.x[i], pull)]
            found[j] -= [*pull, *np.cross(q - rod.x[j], pull)]
        return found

    def held(self) -> NDArray[np.bool_]:
        """Return a mask of the nodal force and moment components (n, 6) that all supports of the beam carry.

        At a supported section all three moments are masked, even if the support holds only some displacement
        components.
        """
        found = np.zeros((len(self.s), 6), dtype=np.bool_)
        for support in self.case.supports:
            found |= self._components_in_selection(support, [*support.thing.components, 3, 4, 5])
        return found

    def carried_components(self, support: Declared) -> NDArray[np.bool_]:
        """Return a mask of the nodal force and moment components (n, 6) that one support carries.

        A moment component is included if the support prevents rotations about its axis.
        """
        held = [*support.thing.components]
        way = np.abs(np.cross(self.axes[1:, None], np.eye(3)[held])).max(axis=(0, 1))  # omega . (r x e_c), r across
        turns = np.flatnonzero((way > 0.5) | (len(held) == 3))
        return self._components_in_selection(support, [*held, *(3 + turns)])

    def _components_in_selection(self, support: Declared, which: Sequence[int]) -> NDArray[np.bool_]:
        """Return a mask (n, 6) of the components `which` (0 to 5) at nodes whose whole section a support selects."""
        where = selects_whole_sections(support.thing.where, self.case.prism, tuple(self.s.tolist()))
        return np.outer(where, np.isin(np.arange(6), which))


def stiffness(section: Section, material: Any) -> Floats:
    """Return the section stiffnesses EA, GA2, GA3, GJ, EI2, EI3 (6,)."""
    E, G = material.young, material.young / (2.0 * (1.0 + material.poisson))
    shear = section.shear_factor(material.poisson) * G * section.area
    return np.array([E * section.area, shear, shear, G * section.torsion, *(E * I for I in section.moments)])


FINE, COARSE_RULE, MANY = 64, 16, 8  # quadrature intervals in an element; COARSE_RULE from MANY stations on


def stiffness_along(shape: Swept, s: Floats, material: Any) -> Floats:
    """Return the section stiffnesses EA, GA2, GA3, GJ, EI2, EI3 (6,) along a body.

    For a tapered body they are those of each element (e, 6): harmonic means, that is means of 1 / C.
    """
    if not shape.tapered:
        return stiffness(shape.section, material)
    at, weights = clenshaw_curtis(FINE if len(s) < MANY else COARSE_RULE)
    fine = s[:-1, None] + np.diff(s)[:, None] * at
    each = [[stiffness(shape.section_at(place), material) for place in row] for row in fine.tolist()]
    found: Floats = 1.0 / np.einsum("g,egc->ec", weights, 1.0 / np.array(each))
    return found


def clenshaw_curtis(n: int) -> tuple[Floats, Floats]:
    """Return points and weights (n + 1,) of the Clenshaw-Curtis quadrature rule on [0, 1]; n is even.

    Source: Clenshaw and Curtis (1960).
    """
    turn, k = np.pi * np.arange(n + 1) / n, np.arange(1, n // 2 + 1)
    b = np.where(k == n // 2, 1.0, 2.0)
    weights = 1.0 - np.cos(2.0 * np.outer(turn, k)) @ (b / (4.0 * k**2 - 1.0))
    weights[[0, -1]] *= 0.5
    return 0.5 * (1.0 - np.cos(turn)), weights / n


def sampling_distance(section: Section) -> float:
    """Return the distance from the axis, m, at which displacements are sampled."""
    return max(max(abs(u), abs(v)) for u, v in section.samples())


def deformed_nodes_and_axes(X: Floats, across: Floats, arm: float, displacement: Any) -> tuple[Floats, Floats]:
    """Return the deformed positions (n, 3), m, and section axes (n, 3, 3) of nodes X (n, 3), m.

    `displacement` maps points to their displacements. It is evaluated at the nodes and at points at the distance `arm`,
    m, along the two section axes `across` (n, 2, 3).
    """
    beside = X[:, None] + arm * across
    x = X + displacement(X)
    tips = (beside + displacement(beside.reshape(-1, 3)).reshape(beside.shape)) - x[:, None]
    return x, frames_from_arms(tips, np.full(2, arm))


def integrate_hats(s: Floats, low: float, high: float, size: Callable[[float], float] = lambda s: 1.0) -> Floats:
    """Return integrals of size(s) times the hat function of each node, from `low` to `high`, m, shape (n,).

    The nodes are at s (n,), m. Simpson's rule between kinks is exact for polynomials up to degree 3, and so also for
    hat functions times the area of a tapered section.
    """
    kinks = np.unique(np.clip(np.concatenate([[low, high], s]), low, high))
    a, b = kinks[:-1], kinks[1:]
    places = np.concatenate([a, 0.5 * (a + b), b])
    weights = np.concatenate([b - a, 4.0 * (b - a), b - a]) / 6.0 * [size(at) for at in places.tolist()]
    found: Floats = np.array([np.interp(places, s, row) for row in np.eye(len(s))]) @ weights
    return found


def beam_line_of(found: VerifiedSolution) -> BeamLine:
    """Return the beam of a solution as a line with the stations of its nodes, for independent formulas."""
    return BeamLine(found.declared.thing, found.case, np.array(found.declared.thing.stations(found.case)))


def rod_of(found: VerifiedSolution) -> tuple[CheckedRod, float]:
    """Return the deformed rod of a solution, and the distance from the axis at which it is sampled, m."""
    if rod_of not in found.known:
        line, displacement = beam_line_of(found), found.solution.displacement
        rod, arm = line.rod(displacement)
        if found.case.has_material_history:
            from softmark.interpreter.verification.viscoelastic_forces_check import relaxed_strain

            rod = replace(
                rod,
                relaxed_strains=relaxed_strain(
                    found.case.material, displacement, lambda moved: line.rod(moved)[0].strains
                ),
            )
        found.known[rod_of] = rod, arm
    known: tuple[CheckedRod, float] = found.known[rod_of]
    return known


def balance_of(found: VerifiedSolution) -> ForceBalance:
    """Compute the force balance of a beam. Raises NoIndependentFormula."""
    return worse_balance(*_internal_and_external_forces(found))


def worse_balance(inside: Floats, outside: Floats, fixed: NDArray[np.bool_], noise: float) -> ForceBalance:
    """Return the force balance with the larger residual: that of forces only, or that of forces and moments.

    `inside` and `outside` (n, 6) are the internal and external nodal forces, N, with moments scaled to forces. `fixed`
    (n, 6) is a mask of supported components, and `noise`, N, the rounding error.
    """
    result = solid_forces.force_balance(inside[:, :3], outside[:, :3], fixed[:, :3], noise, None)
    whole = solid_forces.force_balance(inside, outside, fixed, noise, None)
    return whole if whole.residual >= result.residual else result


def reactions_of(found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
    """Return the reaction of every support by name, and their rounding error, N. Raises NoIndependentFormula."""
    inside, outside, _, noise = _internal_and_external_forces(found)
    beam, left = beam_line_of(found), (inside - outside) / _moment_scaling(found)
    masks = {support.name: beam.carried_components(support) for support in beam.case.supports}
    return sum_by_support(masks, left, rod_of(found)[0].x), LEFT * noise


def _moment_scaling(found: VerifiedSolution) -> Floats:
    """Return factors (6,) that divide the moments by the beam's length, so that all six components are forces."""
    return np.array([1.0, 1.0, 1.0, *[1.0 / found.case.prism.length] * 3])


def _internal_and_external_forces(found: VerifiedSolution) -> tuple[Floats, Floats, NDArray[np.bool_], float]:
    """Return internal and external nodal forces (n, 6), N, a mask of supported components, and the rounding, N.

    Moments are divided by the length. The forces are computed once per solution. Raises NoIndependentFormula.
    """
    if _internal_and_external_forces not in found.known:
        found.known[_internal_and_external_forces] = _compute_forces(found)
    known: tuple[Floats, Floats, NDArray[np.bool_], float] = found.known[_internal_and_external_forces]
    return known


def _compute_forces(found: VerifiedSolution) -> tuple[Floats, Floats, NDArray[np.bool_], float]:
    """Compute the forces of `_internal_and_external_forces`. Raises NoIndependentFormula."""
    beam, model = beam_line_of(found), found.declared.thing
    if found.solution.displacement is None or (len(beam.s) > 200 and not (model.shear and model.axial)):
        raise NoIndependentFormula("the model has too many elements for the constraint forces to be verified")
    rod, arm = rod_of(found)
    inside, by = rod.forces()
    scale, fixed = _moment_scaling(found), beam.held()
    outside = beam.loads(rod) * scale
    inside, by = inside * scale, by * scale[:, None, None]
    if rod.rigid:
        inside = inside + _constraint_forces(inside - outside, by, fixed)
    return inside, outside, fixed, rod.rounding(arm)


def _constraint_forces(left: Floats, by: Floats, fixed: NDArray[np.bool_]) -> Floats:
    """Return the constraint forces (n, 6) that best balance the residual forces at free components, by least squares.

    `left` (n, 6) are the residual forces, `by` the constraint directions, `fixed` (n, 6) the supported components.
    """
    B = by.reshape(left.size, -1)
    free = ~fixed.ravel()
    best, *_ = np.linalg.lstsq(B[free], -left.ravel()[free], rcond=None)
    return (B @ best).reshape(left.shape)
