"""Dynamic problem of a body on a mesh, with its contacts and free rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures.case_amplitudes import amplitude_of, amplitude_of_rigid
from softmark.interpreter.models.procedures.dynamic_problem_setup import dynamic_problem_of, initial_velocities
from softmark.interpreter.problem.body_case import Case
from softmark.solvers.assembly.assembly import Assembly, number_energies
from softmark.solvers.energies.energy import DynamicPatternEnergy, Energy, LaggedTangentEnergy

if TYPE_CHECKING:
    from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
    from softmark.solvers.dynamics.dynamic_problem import Dynamics
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.statics.static_equilibrium import Statics


def solid_dynamics(
    declared: Declared,
    case: Case,
    mesh: Mesh,
    static: Statics,
    mass: Any,
    loads: Sequence[tuple[Declared, Energy]],
    pulling: int = 0,
) -> Dynamics:
    """Return the dynamic problem of a body of given mass, kg, from its static problem. Raises Fault.

    The last `pulling` of the `loads` are muscles.
    """
    analysis: Any = case.analysis
    internal = static.assembly.internal
    ways = {touch.name: amplitude_of_rigid(touch) for touch in case.contacts}
    contacts = {
        name: contact.at(ways[name].at(0.0)).without_initial_energy()
        for name, contact in static.assembly.rigid_contacts.items()
    }
    meets = [energy for energy in internal if isinstance(energy, DynamicPatternEnergy)]
    cells = [energy for energy in internal if not isinstance(energy, DynamicPatternEnergy)]
    acting = number_energies("load", [energy for _, energy in loads])
    return dynamic_problem_of(
        case,
        Assembly(mesh.points.size, static.fixed, cells, acting | contacts),
        mass,
        initial_velocities(analysis, mesh.points, mass),
        static,
        (*(amplitude_of(load) for load, _ in loads), *(ways[name] for name in contacts)),
        sound=next((e.has_no_inverted_cells for e in cells if isinstance(e, LaggedTangentEnergy)), static.sound),
        cap=(cap := declared.thing.iteration_cap),
        pulling=pulling,
        lagged=cap is None,  # with a cap on iterations, steps are plain Newton steps, as in other programs
        way=static.way,
        meets=(*meets,),
    )


def include_free_rigid_bodies(motion: DynamicAnalysis) -> DynamicAnalysis:
    """Return the dynamic analysis, extended by the free rigid bodies of its case if there are any."""
    if not any(touch.rigid.thing.free for touch in motion.case.contacts):
        return motion
    from softmark.interpreter.models.shared.free_rigid_body_dynamics import add_free_rigid_bodies

    return add_free_rigid_bodies(motion)
