"""Poroelastic solids in quasistatic analyses: drained surfaces, fluid pressure, outflow and fluid balance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem import element_formulations
from softmark.interpreter.models.fem.fem_builder import build_static
from softmark.interpreter.models.fem.fem_relaxation import SolidWithHistory, fields_of, support_of_each_dof
from softmark.interpreter.models.postprocessing import nodal_forces
from softmark.interpreter.models.procedures.quasistatic_analysis import Loads, QuasistaticAnalysis
from softmark.interpreter.models.procedures.quasistatic_times import SAME, LoadAndSupportAmplitudes, case_at_full_size
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared, Solution
from softmark.interpreter.models.shared.support_constraints import SAME as ALIKE
from softmark.interpreter.models.shared.support_selection import select_support
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.symmetry_planes import must_not_act_on_axis, must_not_act_on_plane
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.elements import element_of
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.poroelastic import INNER, PoreFluid, PoroelasticSolid, find_pore_fluid
from softmark.solvers.energies.viscoelastic_memory import BodyHistory
from softmark.solvers.linear.linear_solver import LinearSolverOptions
from softmark.solvers.mesh.element_interpolation import locate_points
from softmark.solvers.mesh.mesh import Mesh, facet_areas

if TYPE_CHECKING:
    from softmark.interpreter.models.fem.fem_builder import PreparedSolid
    from softmark.interpreter.models.fem.fem_declaration import Fem
    from softmark.solvers.statics.quasistatic_history import StateInTime
    from softmark.solvers.statics.static_equilibrium import Equilibrium

TIGHT = 1e-12  # of loads and reactions: tolerance of states with fluid, so that no fluid is lost
COARSE = 0.3  # of the moved fluid: larger differences of methods of first and second order cause a warning
BALANCED = 1e-10  # of the moved volume: largest error of the fluid balance


@dataclass(frozen=True)
class Fluid:
    """Fluid in a mesh: the volume that has left through each drained support, m^3, and nodal pressures, Pa."""

    mesh: Mesh
    nodes: Floats  # (n,) Pa, positive in compression; between corners their mean
    outflows: Mapping[str, float]

    @property
    def pressures(self) -> tuple[float, float]:
        """Smallest and largest pressure, Pa."""
        return float(self.nodes.min()), float(self.nodes.max())

    def pressure(self, point: tuple[float, float, float]) -> float:
        """Return the pressure, Pa, at a material point (x, y, z), m."""
        found = locate_points(self.mesh, np.array([point])).interpolate(self.nodes[:, None])
        return float(found[0, 0])


@dataclass(frozen=True)
class SolidWithFluid(SolidWithHistory):
    """Poroelastic solid.

    `drains` has, by the name of each drained support, the indices of the pressure unknowns (b,) that it prescribes.
    """

    inner_stages: ClassVar[tuple[float, ...]] = (INNER,)
    drains: tuple[tuple[str, Ints], ...] = ()
    smallest: float = 0.0  # s: steps below show pressures that oscillate

    def solution_in_time(self, found: Equilibrium, state: StateInTime, acting: Loads) -> Solution:
        """Return the solution with fluid results; its status is not converged if the fluid balance is violated."""
        solution, pores = super().solution_in_time(found, state, acting), find_pore_fluid(state.memories)
        shown = {
            "balance": pores.fluid_balance_error,
            "moved_m3": pores.moved + pores.passed,
            "outflow_m3": self._outflows(pores),
            "smallest_step_s": self.smallest,
            "unresolved": pores.unresolved,
        }
        facts = solution.facts | {"fluid": shown}
        if pores.fluid_balance_error <= BALANCED:
            moved: Any = solution.mesh
            seen = replace(moved, pore_pressure=nodal_pressures(self.mesh, pores.energy, state.x))
            notes = (*solution.notes, *self._flow_resolution_warnings(pores, state.time))
            return replace(solution, facts=facts, mesh=seen, notes=notes)
        error = pores.fluid_balance_error
        reason = f"the fluid volume is not conserved: {error:.1e} of the fluid that moved is lost or gained"
        return Solution("not_converged", reason, facts)

    def _flow_resolution_warnings(self, pores: PoreFluid, time: float) -> Iterator[Diagnostic]:
        """Yield a warning if the last step, which ends at a `time`, s, is too long to resolve the fluid flow."""
        if pores.unresolved <= COARSE:
            return
        shown = units.format_value(float(f"{time:.4g}"), units.TIME)
        yield diagnostic(
            "W394",
            self.declared.at(),
            f"the step of `{self.declared.name}` that ends at {shown} is too long to resolve the fluid flow",
            "error of about 5 % of the moved fluid",
            "use shorter steps, or evaluate later times: the first step after a load change is inaccurate",
        )

    def _outflows(self, pores: PoreFluid) -> dict[str, float]:
        """Return the volume that has left through each drained support, m^3."""
        return {name: float(pores.out[which].sum()) for name, which in self.drains}

    def nodal_forces_in_time(self, state: StateInTime, u: Floats, acting: Loads) -> nodal_forces.NodalForces:
        """Return the nodal forces in a state, including the forces of the fluid pressure."""
        found, pores = super().nodal_forces_in_time(state, u, acting), find_pore_fluid(state.memories)
        return replace(
            found, fluid=Fluid(self.mesh, nodal_pressures(self.mesh, pores.energy, state.x), self._outflows(pores))
        )


def nodal_pressures(mesh: Mesh, energy: PoroelasticSolid, x: Floats) -> Floats:
    """Return fluid pressures at all nodes (n,), Pa, positive in compression; linear between corners of cells."""
    each = -energy.unit * x[energy.pressures] @ element_of(mesh.element.linear).shape(mesh.element.places()).T
    found = np.zeros(len(mesh.points))
    found[mesh.cells] = each  # the same from every cell
    return found


# ------------------------------------------------------------------ building


def prepare(model: Fem, declared: Declared, case: Case, workshop: BuildContext) -> Prepared:
    """Build the quasistatic analysis of a poroelastic solid whose fluid is initially at rest. Raises Fault."""
    whole = case_at_full_size(case)
    static, _ = build_static(model, declared, whole, workshop)
    own: Any = static.problem.assembly.internal[0]
    held, drained = _pressure_supports(whole, static.mesh, own)
    problem, old = static.problem, static.problem.assembly
    places = np.array(sorted(held), dtype=np.int64)
    values = np.array([held[b].thing.pressure for b in places.tolist()])
    fixed = np.concatenate([problem.fixed, 3 * own.nodes + places])
    target = np.concatenate([problem.target, -values / own.unit])
    which = np.zeros(own.dofs - 3 * own.nodes, dtype=np.bool_)
    which[places] = True
    memories = BodyHistory((PoreFluid.at_rest(own, which), *static.beds.values()))
    loads = static.unknowns.loads([energy for _, energy in static.amplitude_scaled_energies])
    internal = dict(zip(old.names[0], memories.energies, strict=True))
    assembly = Assembly(old.dofs, fixed, internal, loads, old.points)
    linear = replace(element_formulations.saddle_point_solver(LinearSolverOptions(), assembly), halved=True)
    tolerance = min(problem.tolerance, TIGHT)
    owners = [*support_of_each_dof(whole, static.mesh, workshop, problem.fixed), *(held[b] for b in places.tolist())]
    problem = replace(problem, assembly=assembly, fixed=fixed, target=target, twin=None, linear=linear,
                      tolerance=tolerance)  # fmt: skip
    drains = tuple((d.name, np.array([b for b in places.tolist() if held[b] is d], dtype=np.int64))
                   for d in whole.drains)  # fmt: skip
    timed = LoadAndSupportAmplitudes.of(whole, static.amplitude_scaled_energies, owners, target)
    smallest = _smallest_smooth_step(case, static.mesh, drained)
    notes = (*static.notes, *_short_step_warning(static, timed, smallest))
    known = fields_of(static) | {"problem": problem, "notes": notes}
    return QuasistaticAnalysis(SolidWithFluid(**known, drains=drains, smallest=smallest), case, memories, timed)


def _pressure_supports(case: Case, mesh: Mesh, energy: PoroelasticSolid) -> tuple[dict[int, Declared], Ints]:
    """Return the support of each prescribed pressure unknown, by index, and the drained facets (f,). Raises Fault."""
    number = np.full(len(mesh.points), -1)
    number[mesh.cells[:, : energy.pressures.shape[1]]] = energy.pressures - 3 * energy.nodes
    found: dict[int, Declared] = {}
    drained = [np.zeros(0, dtype=np.int64)]
    for drain in case.drains:
        drained.append(facets_of(drain, case, mesh))
        nodes = mesh.facets[drained[-1]]
        for node in np.unique(nodes[number[nodes] >= 0]).tolist():
            known = found.setdefault(int(number[node]), drain)
            _must_agree(known, drain, mesh.points[node])
        if not any(known is drain for known in found.values()):
            raise fault(
                "E376",
                drain.at("where"),
                f"the whole surface of `{drain.name}` belongs to another drained support declared before it",
                "has no surface of its own",
                "remove one of them, or select another part of the surface",
            )
    return found, np.concatenate(drained)


def facets_of(drain: Declared, case: Case, mesh: Mesh) -> Ints:
    """Return the indices of the surface facets (f,) that a support drains. Raises Fault if there are none."""
    chosen = select_support(drain.thing.where, mesh).nodes
    facets: Ints = np.flatnonzero(chosen[mesh.facets].all(axis=1))
    if not len(facets):
        raise fault(
            "E376",
            drain.at("where"),
            f"`{drain.name}` contains no whole surface facet of `{case.body.name}`",
            "drains nothing",
            "select more of the surface, or use a finer mesh: only whole facets are drained",
        )
    X = mesh.points[mesh.facets[facets]]
    must_not_act_on_plane(case, drain, X, mesh.points)
    must_not_act_on_axis(case, drain, X, mesh.points, partly=True)
    return facets


def _must_agree(known: Declared, other: Declared, place: Floats) -> None:
    """Raise Fault if two supports prescribe different pore pressures at the same point `place` (3,), m."""
    one, two = known.thing, other.thing
    far = abs(one.pressure - two.pressure) > ALIKE * max(abs(one.pressure), abs(two.pressure))
    if known is other or (not far and (one.amplitude == two.amplitude or not one.pressure)):
        return
    raise fault("E376", other.at("where"), f"`{known.name}` and `{other.name}` prescribe different pore "
                                           "pressures at the same points", "contradicts the other",
                "select other parts of the surface; both contain "
                f"{units.format_vector(place.tolist(), units.LENGTH)}")  # fmt: skip


# ------------------------------------------------------------------ steps that are too short


def _short_step_warning(
    static: PreparedSolid, timed: LoadAndSupportAmplitudes, smallest: float
) -> Iterator[Diagnostic]:
    """Yield a warning if time steps are shorter than the `smallest` one, s, without oscillations."""
    times = [t for t, _ in timed.grid()]
    steps = [b - a for a, b in pairwise(times) if b - a > SAME * timed.analysis.step]
    if not steps or min(steps) >= smallest * (1.0 - SAME):
        return
    shown = units.format_value(float(f"{smallest:.3g}"), units.TIME)
    yield diagnostic(
        "W393",
        static.declared.at("size" if static.model.size else "element"),
        f"a step of {units.format_value(float(f'{min(steps):.3g}'), units.TIME)} is too short for the "
        f"cell size of `{static.declared.name}` at the drained surface",
        "pressures may oscillate",
        f"use steps of {shown} or more, or smaller cells at the surface: just after a load change the "
        "drained layer is thinner than a cell",
    )


def _smallest_smooth_step(case: Case, mesh: Mesh, drained: Ints) -> float:
    """Return the smallest step without oscillations, s: h^2 / (6 c) over the implicit part of a stage.

    h is the height of cells at drained facets and c = k (lam + 2 mu) the consolidation coefficient.

    Source: Vermeer and Verruijt (1981), "An accuracy condition for consolidation by finite elements", Int. J. Numer.
    Anal. Methods Geomech. 5:1.
    """
    material = case.material
    c: float = material.permeability * (material.lame_lambda + 2.0 * material.shear_modulus)
    h = float(_cell_heights_at_facets(mesh, drained).max(initial=0.0))
    return h**2 / (6.0 * c * INNER)


def _cell_heights_at_facets(mesh: Mesh, which: Ints) -> Floats:
    """Return the heights, m, of the cells behind boundary facets `which` (f,), normal to these facets."""
    part = {4: 3.0, 6: 2.0, 8: 1.0}[mesh.element.corners]  # pyramids, wedges on a side, bricks
    own = facet_areas(mesh, *mesh.element.facet.quadrature())
    found: Floats = part * mesh.volumes[mesh.facet_cells[which]] / own[which]
    return found
