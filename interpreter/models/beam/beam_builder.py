"""Construction and solution of beam models: mass, stiffness and loads of a rod, and its static equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam import beam_supports
from softmark.interpreter.models.beam.beam_declaration import Beam6Dof, axis_station, section_station
from softmark.interpreter.models.beam.beam_nodal_forces import forces_in_space, nodal_forces_of_beam
from softmark.interpreter.models.beam.load_lumping import lump_force, lump_line
from softmark.interpreter.models.beam.rod_model import RodModel
from softmark.interpreter.models.beam.tapered_sections import (
    inertia,
    integrate_at_nodes,
    section_properties,
    stiffnesses,
)
from softmark.interpreter.models.postprocessing.vibrations import frequencies_about, undefined_frequencies
from softmark.interpreter.models.procedures.dynamic_discretization import DisplacementField
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.perturbed_start import Disturbance, disturbance_of, recover_rod
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import coverage
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.loads.tendon import TendonLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_rotation import rotation
from softmark.solvers.energies.rod_section import RodSection, RodStiffness, VaryingStiffness
from softmark.solvers.energies.rod_state import RodChain, chain_elements, displacement_at, lengths, rod_at_rest
from softmark.solvers.linear import factorisations
from softmark.solvers.mesh.shape import Prism
from softmark.solvers.statics.static_equilibrium import Equilibrium, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.solvers.statics.static_equilibrium import Watch


@dataclass(frozen=True)
class PreparedBeam(RodModel):
    """Beam model: the undeformed rod and its static problem."""

    declared: Declared
    case: Case
    stations: Floats  # stations of the nodes (n,), m
    rest: Floats
    elastic: RodElastic
    problem: Statics
    size: dict[str, int]
    disturbance: Disturbance | None = None
    applied: tuple[tuple[Declared, Energy], ...] = ()  # each load separately

    @property
    def points(self) -> Floats:
        """Undeformed nodes of the axis (n, 3), m."""
        return self.rest.reshape(-1, 7)[:, :3]

    @property
    def along(self) -> Callable[[Floats], Floats] | None:
        """Function from points (k, 3), m, to their stations (k,), m, on a curved axis; None on a straight axis."""
        shape = self.case.prism
        return None if isinstance(shape, Prism) else shape.stations

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Return each load with its forces and moments in space (n, 6), N and N m, on the undeformed beam."""
        return forces_in_space(self.applied, self.rest, rotation(self.rest.reshape(-1, 7)[:, 3:]))

    def warm(self) -> None:
        """Solve a beam of one segment, so that libraries are loaded before timing starts; nothing is compiled."""
        factorisations.warm_up(len(self.problem.assembly.tangent(self.rest, 1.0, projected=True).data))
        _solve_one_segment()

    def solve(self, watch: Watch) -> Solution:
        """Return the static equilibrium, starting from rest."""
        problem, last = replace(self.problem, watch=watch), [self.problem.assembly]
        remedy = "use more segments or a smaller load"
        return static_result.solve_static(
            lambda: self._solve_equilibrium(problem, last), remedy, lambda found: self._make_solution(found, last[-1])
        )

    def _solve_equilibrium(self, problem: Statics, solved: list[Assembly]) -> Equilibrium:
        """Return the equilibrium; a second solution removes the remaining strain of modes that are switched off.

        The assembly of each solution is appended to `solved`.
        """
        put = self.disturbance
        found = equilibrium(problem) if put is None else recover_rod(put, problem, self.rest)
        if not self.elastic.stiffness.rigid:
            return found
        stiff = problem.assembly.with_internal([self.elastic.with_multipliers(found.x)])
        solved.append(stiff)
        still = np.zeros_like(problem.target)
        again = equilibrium(replace(problem, assembly=stiff, rest=found.x, target=still, path="load", way=None))
        known = {**found.facts, **again.facts}
        history = found.history + again.history
        return replace(again, history=history, facts=known, critical=found.critical or again.critical)

    def displacement_field(self, x: Floats) -> DisplacementField:
        """Return the displacement field of the beam in a state x (nodes * 7,)."""
        return lambda X: displacement_at(x, self.rest, X, self.along)

    def _make_solution(self, found: Equilibrium, assembly: Assembly) -> Solution:
        """Return the solution of an equilibrium, with functions for its results."""
        solution = static_result.solution_of(found, self.displacement_field(found.x))
        modes = frequencies_about(self.problem.assembly, found.x, self.mass, self.problem.linear)
        if self.along is not None:
            modes = undefined_frequencies("frequencies of curved beams are not computed: use `fem(...)`")
        notes = (*static_result.uniqueness_warnings(self.declared, found), *self._guide_warnings(found.x))
        seen = replace(solution, notes=notes, vibrations=modes if found.solved else None)
        solved = replace(self.problem, assembly=assembly)
        carried = cache(lambda: nodal_forces_of_beam(solved, found.x, self.applied))
        return replace(seen, carried=carried, stress=cache(lambda: self._section_stress_field(solved, found.x)))

    def _section_stress_field(self, solved: Statics, x: Floats) -> Any:
        """Return the stress field of the beam's sections in a state x (nodes * 7,)."""
        from softmark.interpreter.models.beam.beam_stress import MemberAxisState, SectionStresses, element_line_loads

        shape, stations = self.case.prism, self.stations
        (ends,) = (e.local_forces(x) for e in solved.assembly.internal if isinstance(e, RodElastic))
        lines = element_line_loads(
            self.case,
            shape,
            stations,
            lambda line: (shape.section_coordinates(line.begin)[0], shape.section_coordinates(line.end)[0]),
        )
        piece = MemberAxisState(shape, stations, self.rest.reshape(-1, 7), x.reshape(-1, 7), ends, lines)
        return SectionStresses([piece], self.case, lambda X: np.zeros(len(X), dtype=np.int64))

    def _guide_warnings(self, x: Floats) -> tuple[Diagnostic, ...]:
        """Return warnings if a tendon pulls its guides together in a state x (nodes * 7,)."""
        if not any(isinstance(load.thing.action, TendonLoad) for load, _ in self.applied):
            return ()
        from softmark.interpreter.models.beam.beam_tendons import guide_warnings

        return guide_warnings(self.declared, self.applied, x)

    def mass(self) -> Floats:
        """Masses of the nodes and rotary inertia of their sections (6 n,), kg and kg m^2."""
        return _nodal_inertia(self.case, self.rest, self.stations)[:, [0, 0, 0, 1, 2, 3]].ravel()


@cache
def _solve_one_segment() -> None:
    """Solve one clamped segment of one metre under a small force, once per process."""
    rest, fixed = rod_at_rest(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])), np.arange(6)
    elastic = RodElastic(rest, chain_elements(2), RodSection(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0).stiffness)
    assembly = Assembly(12, fixed, [elastic], [RodForces(rest, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-3]]))])
    space = RodChain(rest, np.array([[True] * 3, [False] * 3]))
    equilibrium(Statics(assembly, space, rest, fixed, np.zeros(6), bold=False))


def load(model: Beam6Dof) -> None:
    """Do nothing, because importing this module has already imported all libraries that `prepare` needs."""


def prepare(model: Beam6Dof, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Return the beam model of a case: a static one, or a dynamic one for a dynamic analysis. Raises Fault."""
    static = build_static(model, declared, case)
    if not isinstance(case.analysis, Dynamic):
        return static
    from softmark.interpreter.models.beam.beam_dynamics import beam_dynamics
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis

    problem = beam_dynamics(case, static.elastic, static.problem, static.mass(), static.applied)
    return DynamicAnalysis(static, declared, case, problem)


def build_static(model: Beam6Dof, declared: Declared, case: Case) -> PreparedBeam:
    """Return the static model of a beam, with its undeformed rod, supports and loads. Raises Fault."""
    shape = case.prism
    stations = np.array(model.stations(case))
    rest, nodes = beam_supports.undeformed_rod(case, stations), len(stations)
    fixed, target, way = beam_supports.constrained_dofs(case, stations.tolist())
    elastic = RodElastic(rest, chain_elements(nodes), _stiffness(model, case, stations))
    held = np.zeros((nodes, 6), dtype=bool)
    held.ravel()[fixed] = True
    applied = _loads(case, rest, stations)
    assembly = Assembly(6 * nodes, fixed, [elastic], _merge_loads(applied, rest))
    space = RodChain(rest, held[:, :3])
    problem = Statics(
        assembly,
        space,
        rest,
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        jumped=space.has_rotation_jump,
        bold=False,
        extent=shape.length,
        weights=np.tile([1.0, 1.0, 1.0, *[1.0 / shape.length] * 3], nodes),
        path=case.analysis.path,
        way=way,
    )
    size = {"nodes": nodes, "elements": model.segments, "dofs": len(assembly.free)}
    return PreparedBeam(declared, case, stations, rest, elastic, problem, size, disturbance_of(case), applied)


def _nodal_inertia(case: Case, rest: Floats, stations: Floats) -> Floats:
    """Return the mass and the moments of inertia about e1, e2 and e3 of each node (n, 4), kg and kg m^2.

    Half of a segment is added to each of its two nodes. A tapered segment is distributed by its linear shape
    functions.
    """
    shape, rho = case.prism, case.material.density
    if shape.tapered:
        tapering: Floats = rho * integrate_at_nodes(shape, stations, inertia)
        return tapering
    half = 0.5 * lengths(rest, chain_elements(len(stations)))
    shares = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
    even: Floats = rho * np.outer(shares, inertia(shape.section))
    return even


def _stiffness(model: Beam6Dof, case: Case, stations: Floats) -> RodStiffness | VaryingStiffness:
    """Return the stiffnesses of the section or, for a tapered beam, of each element.

    The axes e2 and e3 are the transverse axes of the shape.
    """
    shape, flexible = case.prism, {"shear": model.shear, "axial": model.axial}
    if shape.tapered:
        return VaryingStiffness(stiffnesses(shape, stations, case.material)).with_suppressed_modes(
            shape.length, **flexible
        )
    return section_properties(shape.section, case.material).stiffness.with_suppressed_modes(shape.length, **flexible)


def _loads(case: Case, rest: Floats, stations: Floats) -> tuple[tuple[Declared, Energy], ...]:
    """Return the loads of a case, each with its energy on the rod. Raises Fault."""
    return tuple((load, _load(case, load, rest, stations)) for load in case.loads)


def _merge_loads(applied: Sequence[tuple[Declared, Energy]], rest: Floats) -> list[Energy]:
    """Return the energies of all loads, with all nodal forces merged into one energy and all tendons into another."""
    found = [energy for _, energy in applied]
    forces = sum((e.forces for e in found if isinstance(e, RodForces)), np.zeros((rest.size // 7, 3)))
    others = [e for e in found if not isinstance(e, RodForces)]
    if not any(isinstance(load.thing.action, TendonLoad) for load, _ in applied):
        return [RodForces(rest, forces), *others]
    from softmark.solvers.energies.rod_tendons import RodTendons

    tendons = [e for e in others if isinstance(e, RodTendons)]
    one = [reduce(RodTendons.joined, tendons)] if tendons else []
    return [RodForces(rest, forces), *(e for e in others if not isinstance(e, RodTendons)), *one]


def _load(case: Case, load: Declared, rest: Floats, stations: Floats) -> Energy:
    """Return the energy of one load: nodal forces, a moment on one section, or the pull of a tendon."""
    match load.thing.action:
        case TendonLoad() as action:
            from softmark.interpreter.models.beam.beam_tendons import tendon

            return tendon(case, action, rest, stations)
        case MomentLoad(where=where, moment=moment):
            from softmark.solvers.energies.rod_loads import RodMoments

            node = 0 if coverage(where, case.prism, 0.0) == "all" else len(stations) - 1
            return RodMoments(np.array([node]), np.array([moment]))
        case PointLoad(at=at, force=force) if axis_station(case, at) is None:
            from softmark.solvers.energies.rod_loads import EccentricRodForces

            node = int(np.abs(stations - (section_station(case, at) or 0.0)).argmin())
            x = rest.reshape(-1, 7)[node]
            arm = (np.array(at) - x[:3]) @ rotation(x[None, 3:])[0]
            return EccentricRodForces(rest, np.array([node]), arm[None], np.array([force]))
    return RodForces(rest, _nodal_load_forces(case, load, rest, stations))


def _nodal_load_forces(case: Case, load: Declared, rest: Floats, stations: Floats) -> Floats:
    """Return the nodal forces of one load (n, 3), N."""
    shape, forces = case.prism, np.zeros((len(stations), 3))
    match load.thing.action:
        case BodyForce(acceleration=g):
            if shape.tapered:
                areas = integrate_at_nodes(shape, stations, lambda section: [section.area])
                weights: Floats = areas * case.material.density * np.array(g)
                return weights
            w = case.material.density * shape.section.area * np.array(g)
            if isinstance(shape, Prism):
                return RodForces.uniform(rest, chain_elements(len(stations)), w).forces
            half = 0.5 * np.diff(stations)[:, None] * w  # lengths of the arc, because chords are shorter
            forces[:-1] += half
            forces[1:] += half
        case SurfaceTraction(where=where, traction=traction):
            node = 0 if coverage(where, shape, 0.0) == "all" else -1
            forces[node] = shape.section_at(stations[node]).area * np.array(traction)
        case PointLoad(at=at, force=force):
            nodes, shares = lump_force(axis_station(case, at) or 0.0, force, stations)
            forces[nodes] = shares
        case LineForce(begin=begin, end=end, force=q):
            ends = sorted(axis_station(case, p) or 0.0 for p in (begin, end))
            forces += np.outer(lump_line(ends[0], ends[1], stations), q)
        case unknown:  # refused when a scene is checked
            raise TypeError(f"beams do not support loads of the type {type(unknown).__name__}")
    return forces
