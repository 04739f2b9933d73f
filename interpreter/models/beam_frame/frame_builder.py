"""Construction and solution of frame models: members, joints and loads, and the static equilibrium."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.beam_nodal_forces import forces_in_space, nodal_forces_of_rods
from softmark.interpreter.models.beam.load_lumping import lump_force, lump_line
from softmark.interpreter.models.beam.rod_model import RodModel
from softmark.interpreter.models.beam.tapered_sections import integrate_at_nodes, stiffnesses
from softmark.interpreter.models.beam_frame import frame_selection
from softmark.interpreter.models.beam_frame.frame_declaration import Frame6Dof
from softmark.interpreter.models.beam_frame.frame_displacements import FrameDisplacementField
from softmark.interpreter.models.beam_frame.frame_layout import Layout
from softmark.interpreter.models.postprocessing.vibrations import frequencies_about
from softmark.interpreter.models.shared import static_result
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.interpreter.vocabulary.loads.point_force import PointLoad
from softmark.interpreter.vocabulary.loads.torque import MomentLoad
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.geometrically_exact_rod import RodElastic, RodForces
from softmark.solvers.energies.rod_joints import JointedRods
from softmark.solvers.energies.rod_section import VaryingStiffness
from softmark.solvers.linear import factorisations
from softmark.solvers.statics.rod_frame_state import RodNetwork
from softmark.solvers.statics.static_equilibrium import Equilibrium, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.interpreter.models.postprocessing.nodal_forces import NodalForces
    from softmark.solvers.mesh.frame_shapes import Network
    from softmark.solvers.statics.static_equilibrium import Watch


@dataclass(frozen=True)
class PreparedNetwork(RodModel):
    """Frame model: the undeformed network and its static problem."""

    declared: Declared
    layout: Layout
    elastic: RodElastic  # elastic energy of all members
    problem: Statics
    size: dict[str, int]
    applied: tuple[tuple[Declared, Energy], ...]  # each load separately

    @property
    def points(self) -> Floats:
        """Undeformed points of the network (p, 3), m, at which loads act."""
        return self.layout.X

    def forces(self) -> list[tuple[Declared, Floats]]:
        """Return each load with its forces and moments in space (p, 6), N and N m, on the undeformed frame."""
        return forces_in_space(self.applied, self.layout.rest, self.layout.axes)

    def warm(self) -> None:
        """Load libraries before timing; there is nothing to compile."""
        factorisations.warm_up(len(self.problem.assembly.tangent(self.layout.rest, 1.0, projected=True).data))

    def solve(self, watch: Watch) -> Solution:
        """Return the static equilibrium, starting from rest."""
        problem = replace(self.problem, watch=watch)
        return static_result.solve_static(
            lambda: equilibrium(problem), "use more segments or a smaller load", self._make_solution
        )

    def displacement_field(self, x: Floats) -> FrameDisplacementField:
        """Return the displacement field of the frame in a state x (nodes * 7,)."""
        return FrameDisplacementField(self.layout, x)

    def _make_solution(self, found: Equilibrium) -> Solution:
        """Return the solution of an equilibrium, with functions for its results."""
        solution = static_result.solution_of(found, self.displacement_field(found.x))
        modes = frequencies_about(self.problem.assembly, found.x, self.layout.mass, self.problem.linear)
        seen = replace(
            solution,
            notes=static_result.uniqueness_warnings(self.declared, found),
            vibrations=modes if found.solved else None,
        )
        carried = cache(lambda: self._nodal_forces(found.x))
        return replace(seen, carried=carried, stress=cache(lambda: self._section_stress_field(found.x)))

    def _section_stress_field(self, x: Floats) -> Any:
        """Return the stress field of the members' sections in a state x (n * 7,)."""
        from softmark.interpreter.models.beam.beam_stress import MemberAxisState, SectionStresses, element_line_loads

        layout, network, case = self.layout, self.layout.network, self.layout.case
        rest, now, ends = layout.rest.reshape(-1, 7), x.reshape(-1, 7), self.elastic.local_forces(x)
        ends, pieces = ends.reshape(len(network.members), -1, 12), []
        for i, member in enumerate(network.members):
            stations, nodes = layout.stations(i), layout.nodes(i)
            lines = element_line_loads(case, member, stations, partial(_loaded_interval_of_member, network, i))
            pieces.append(MemberAxisState(member, stations, rest[nodes], now[nodes], ends[i], lines))
        return SectionStresses(pieces, case, network.nearest)

    def _nodal_forces(self, x: Floats) -> NodalForces:
        """Return forces and moments at the points in a state x (n * 7,), with moments about the axes of the points."""
        layout, assembly = self.layout, self.problem.assembly
        energy, now = sum(e.value(x) for e in assembly.internal), x.reshape(-1, 7)[layout.first, :3]
        return nodal_forces_of_rods(self.problem, x, self.applied, float(energy), layout.X, now, layout.frames(x))


def _loaded_interval_of_member(network: Network, member: int, line: LineForce) -> tuple[float, float] | None:
    """Return the stations, m, between which a line load acts on a member (counted from 0), else None."""
    own, first, last = frame_selection.locate_line_on_member(network, line.begin, line.end) or (-1, 0.0, 0.0)
    return (first, last) if own == member else None


def load(model: Frame6Dof) -> None:
    """Do nothing, because importing this module has already imported all libraries that `prepare` needs."""


def prepare(model: Frame6Dof, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Return the frame model of a case: a static one, or a dynamic one for a dynamic analysis. Raises Fault."""
    layout = Layout.of(case, model.segments)
    fixed, target = layout.held()
    held = np.zeros((layout.count, 6), dtype=bool)
    held.ravel()[fixed] = True
    joints, extent = layout.joints, layout.network.diagonal
    elastic, alone = rods(layout), tuple((load, _load(layout, load)) for load in case.loads)
    applied = tuple((load, JointedRods(energy, joints)) for load, energy in alone)
    assembly = Assembly(6 * layout.count, fixed, [JointedRods(elastic, joints)], [energy for _, energy in applied])
    space = RodNetwork(layout.rest, layout.elements, joints, held[:, :3])
    problem = Statics(
        assembly,
        space,
        layout.rest,
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        jumped=space.has_rotation_jump,
        bold=bool(np.any(target)),  # in a closed loop an imposed displacement bends all members at once
        extent=extent,
        weights=np.tile([1.0, 1.0, 1.0, *[1.0 / extent] * 3], layout.count),
        path=case.analysis.path,
    )
    size = {"nodes": layout.count, "elements": len(layout.elements), "dofs": len(assembly.free)}
    static = PreparedNetwork(declared, layout, elastic, problem, size, applied)
    if not isinstance(case.analysis, Dynamic):
        return static
    from softmark.interpreter.models.beam_frame.frame_dynamics import frame_dynamics
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis

    return DynamicAnalysis(static, declared, case, frame_dynamics(case, layout, elastic, problem, alone))


def rods(layout: Layout) -> RodElastic:
    """Return the elastic energy of all members."""
    found = [
        stiffnesses(member, layout.stations(number), layout.case.material)
        for number, member in enumerate(layout.network.members)
    ]
    return RodElastic(layout.rest, layout.elements, VaryingStiffness(np.concatenate(found)))


def _load(layout: Layout, load: Declared) -> Energy:
    """Return the energy of one load: nodal forces, or a moment on one section."""
    forces = np.zeros((len(layout.point_of_node), 3))
    match load.thing.action:
        case MomentLoad(where=where, moment=moment):
            from softmark.solvers.energies.rod_loads import RodMoments

            node = int(layout.first[frame_selection.select_points_and_members(where, layout.network)[0][0]])
            return RodMoments(np.array([node]), np.array([moment]))
        case BodyForce(acceleration=g):
            for number, member in enumerate(layout.network.members):
                areas = integrate_at_nodes(member, layout.stations(number), lambda section: [section.area])
                forces[layout.nodes(number)] += areas * layout.case.material.density * np.array(g)
        case PointLoad(at=at, force=force):
            number, s = frame_selection.locate_on_member(layout.network, at) or (0, 0.0)
            nodes, shares = lump_force(s, force, layout.stations(number))
            forces[layout.nodes(number)][nodes] += shares
        case LineForce(begin=begin, end=end, force=q):
            number, first, last = frame_selection.locate_line_on_member(layout.network, begin, end) or (0, 0.0, 0.0)
            forces[layout.nodes(number)] += np.outer(lump_line(first, last, layout.stations(number)), q)
        case unknown:  # refused when a scene is checked
            raise TypeError(f"frames do not support loads of the type {type(unknown).__name__}")
    return RodForces(layout.rest, forces)
