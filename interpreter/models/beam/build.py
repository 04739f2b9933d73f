"""Building and solving a beam model: everything here is arrays."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.beam.rigid import AXES, point_rows
from softmark.interpreter.models.beam.words import Beam6Dof, station
from softmark.interpreter.models.shared import outcome
from softmark.interpreter.models.shared.disturbing import Disturbance, disturbance_of, of_rod
from softmark.interpreter.models.shared.holding import Held, moved_by
from softmark.interpreter.models.shared.prepared import Solution, Workshop
from softmark.interpreter.problem.case import Case, fault
from softmark.interpreter.problem.stretches import coverage
from softmark.interpreter.vocabulary.loads import Gravity, PointForce, Traction
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod import RodElastic, RodLoad
from softmark.solvers.energies.rod_section import RodStiffness, Section
from softmark.solvers.energies.rod_state import RodChain, chain, displacement_at, rod_at_rest
from softmark.solvers.linear import factorisations
from softmark.solvers.mesh.shapes import transverse
from softmark.solvers.statics.equilibrium import Equilibrium, Statics, equilibrium

if TYPE_CHECKING:
    from softmark.solvers.statics.equilibrium import Watch


@dataclass(frozen=True)
class PreparedBeam:
    """A rod at rest and its static problem."""

    declared: Declared
    rest: Floats
    elastic: RodElastic
    problem: Statics
    size: dict[str, int]
    notes: tuple[Diagnostic, ...] = ()
    disturbance: Disturbance | None = None
    applied: tuple[tuple[Declared, RodLoad], ...] = ()  # every load by itself

    @property
    def points(self) -> Floats:
        """Nodes of the axis (n, 3), undeformed, m."""
        return self.rest.reshape(-1, 7)[:, :3]

    def warm(self) -> None:
        """Nothing to compile, beams are numpy; but libraries and classes are made at their first use."""
        factorisations.warm(len(self.problem.assembly.tangent(self.rest, 1.0, projected=True).data))
        _solve_one_segment()

    def solve(self, watch: Watch) -> Solution:
        """Static equilibrium from rest."""
        problem = replace(self.problem, watch=watch)
        return outcome.solution(
            lambda: self._equilibrium(problem), "try more segments or a smaller load", self._finish
        )

    def _equilibrium(self, problem: Statics) -> Equilibrium:
        """The equilibrium; modes that are switched off lose their last strain in a second solution from the first."""
        put = self.disturbance
        found = equilibrium(problem) if put is None else of_rod(put, problem, self.rest)
        if not self.elastic.stiffness.rigid:
            return found
        stiff = problem.assembly.with_internal([self.elastic.tightened(found.x)])
        still = np.zeros_like(problem.target)
        again = equilibrium(replace(problem, assembly=stiff, rest=found.x, target=still, path="load"))
        known = {**found.facts, **again.facts}
        history = found.history + again.history
        return replace(again, history=history, facts=known, critical=found.critical or again.critical)

    def _finish(self, found: Equilibrium) -> Solution:
        solution = outcome.found(found, lambda X: displacement_at(found.x, self.rest, X))
        return replace(solution, notes=outcome.doubts(self.declared, found))


@cache
def _solve_one_segment() -> None:
    """One of a metre, held at its root, under a force that hardly bends it: once in a process."""
    rest, fixed = rod_at_rest(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])), np.arange(6)
    elastic = RodElastic(rest, chain(2), Section(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0).stiffness)
    assembly = Assembly(12, fixed, [elastic], [RodLoad(rest, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-3]]))])
    space = RodChain(rest, np.array([[True] * 3, [False] * 3]))
    equilibrium(Statics(assembly, space, rest, fixed, np.zeros(6), bold=False))


def load(model: Beam6Dof) -> None:
    """All that building needs is imported with this module."""


def prepare(model: Beam6Dof, declared: Declared, case: Case, workshop: Workshop) -> PreparedBeam:
    """Everything that solving needs. Raises Fault."""
    shape = case.shape
    stations = np.array(model.stations(case))
    points = np.array(shape.root) + stations[:, None] * np.array(shape.axis)
    rest = rod_at_rest(points, np.array(transverse(shape.axis)[1]))
    nodes = len(points)
    fixed, target = _supports(case, stations, points)
    elastic = RodElastic(rest, chain(nodes), _stiffness(model, case))
    held = np.zeros((nodes, 6), dtype=bool)
    held.ravel()[fixed] = True
    applied = _loads(case, rest, stations)
    forces = sum((energy.forces for _, energy in applied), np.zeros((nodes, 3)))
    assembly = Assembly(6 * nodes, fixed, [elastic], [RodLoad(rest, forces)])
    problem = Statics(
        assembly,
        RodChain(rest, held[:, :3]),
        rest,
        fixed,
        target,
        case.analysis.tolerance,
        case.analysis.max_iterations,
        bold=False,
        extent=shape.length,
        weights=np.tile([1.0, 1.0, 1.0, *[1.0 / shape.length] * 3], nodes),
        path=getattr(case.analysis, "path", "load"),
    )
    size = {"nodes": nodes, "elements": model.segments, "dofs": len(assembly.free)}
    return PreparedBeam(declared, rest, elastic, problem, size, disturbance=disturbance_of(case), applied=applied)


def _stiffness(model: Beam6Dof, case: Case) -> RodStiffness:
    """Stiffnesses of the section; e2 and e3 lie along the transverse axes of the shape."""
    section, material = case.shape.section, case.material
    # `moments` are about the first and the second transverse axis: about e2 the distance is X3
    I2, I3 = section.moments
    kappa = section.shear_factor(material.poisson)
    whole = Section(
        section.area, I2, I3, section.torsion, kappa, kappa, material.young, material.shear_modulus
    )
    return whole.stiffness.without(case.shape.length, shear=model.shear, axial=model.axial)


def _supports(case: Case, stations: Floats, points: Floats) -> tuple[Ints, Floats]:
    """Held degrees of freedom of the rod (c,) and their values (c,), m or rad. Raises Fault."""
    held = Held(case, case.shape.length, points.mean(axis=0))
    for support in case.supports:
        components = support.thing.components
        turns = _held_turns(case.shape.axis, components)
        for node, s in enumerate(stations.tolist()):
            if coverage(support.thing.where, case.shape, s) != "all":
                continue
            held.rows.append(point_rows(points[node : node + 1] - held.centre, components))
            held.rows.append(np.eye(6)[[3 + t for t in turns]] * case.shape.length)
            for c in components:
                held.impose(6 * node + c, moved_by(support)[c], support, points[node], AXES[c])
            for turn in _body_axes(case.shape.axis, turns):
                held.impose(6 * node + 3 + turn, 0.0, support, points[node], AXES[turn])
    return held.finished()


def _held_turns(axis: tuple[float, float, float], components: tuple[int, ...]) -> list[int]:
    """Rotations about x, y, z that a rigid section cannot make while `components` of all its points are held.

    A rotation omega moves a point r of the section by omega x r; component c of that is omega . (r x e_c), so holding c
    takes away the rotations along r x e_c for every r across the axis.
    """
    if len(components) == 3:
        return [0, 1, 2]
    taken = [np.abs(np.cross(r, np.eye(3)[c])) for r in transverse(axis) for c in components]
    return [t for t in range(3) if any(v[t] > 0.5 for v in taken)]


def _body_axes(axis: tuple[float, float, float], turns: list[int]) -> list[int]:
    """The same rotations as degrees of freedom, which are about the rod's own axes e1, e2, e3."""
    if len(turns) == 3:
        return [0, 1, 2]
    frame = np.array([axis, *transverse(axis)])
    return [int(np.argmax(np.abs(frame[:, t]))) for t in turns]


def _loads(case: Case, rest: Floats, stations: Floats) -> tuple[tuple[Declared, RodLoad], ...]:
    """Every load with its forces on the axis. Raises Fault."""
    return tuple((load, RodLoad(rest, _forces(case, load, rest, stations))) for load in case.loads)


def _forces(case: Case, load: Declared, rest: Floats, stations: Floats) -> Floats:
    """Of one load, at the nodes (n, 3), N. Raises Fault."""
    shape, forces = case.shape, np.zeros((len(stations), 3))
    match load.thing:
        case Gravity(magnitude=magnitude, direction=direction):
            w = case.material.density * shape.section.area * magnitude * np.array(direction)
            return RodLoad.uniform(rest, chain(len(stations)), w).forces
        case Traction(where=where, vector=vector):
            node = 0 if coverage(where, shape, 0.0) == "all" else -1
            forces[node] = shape.section.area * np.array(vector)
        case PointForce(at=at, vector=vector):
            node, share = _place(station(case, at) or 0.0, stations)
            forces[node : node + 2] = np.outer([1 - share, share], vector)
        case _:
            raise fault("E501", load.location, f"no beam model knows the load `{load.name}`")
    return forces


def _place(s: float, stations: Floats) -> tuple[int, float]:
    """The element that holds a station, and how far along it the station lies, from 0 to 1."""
    node = int(np.clip(np.searchsorted(stations, s, side="right") - 1, 0, len(stations) - 2))
    return node, float((s - stations[node]) / (stations[node + 1] - stations[node]))
