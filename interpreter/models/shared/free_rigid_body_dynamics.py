"""Dynamic analyses with free rigid bodies, whose unknowns follow those of the mesh nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from scipy import sparse

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.procedures.case_amplitudes import amplitude_of, amplitude_of_rigid
from softmark.interpreter.models.procedures.derived_model import DerivedModel
from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
from softmark.interpreter.models.procedures.dynamic_discretization import DynamicDiscretization, MotionFields
from softmark.interpreter.models.procedures.trajectory_report import MOMENTS
from softmark.interpreter.problem.body_case import Case, RigidBodyContact
from softmark.interpreter.results.even_thinning import pick_evenly
from softmark.records import dataclass
from softmark.solvers.assembly.assembly import Assembly, number_energies
from softmark.solvers.contact.free_rigid_bodies import FreeBodyChart, FreeRigidBody, make_contact_with_free_body
from softmark.solvers.contact.rigid_body_loads import RigidBodyLoad
from softmark.solvers.contact.rigid_mass_properties import mass_properties_of
from softmark.solvers.contact.signed_distance import gap_of
from softmark.solvers.dynamics.dynamic_problem import DirectStepSolver, Dynamics
from softmark.solvers.dynamics.integrator import Motion
from softmark.solvers.dynamics.load_amplitudes import Amplitude
from softmark.solvers.dynamics.rotational_inertia import RotationalInertia
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.mixed_displacement_pressure import DisplacementEnergy

LOOKED = 50  # number of times at which overlapping bodies are searched for
FINER = 1e-2  # of the tolerance: in N m, moments are smaller than forces in N by the size of a body in m


@dataclass(frozen=True)
class SolidWithRigidBodies(DerivedModel):
    """Deformable body with `dofs` unknowns together with free rigid bodies.

    `names` are the free rigid bodies. The `chart` maps the unknowns of the rigid bodies, in the same order, to
    positions and rotations.
    """

    static: DynamicDiscretization
    case: Case
    chart: FreeBodyChart
    names: tuple[str, ...]
    dofs: int
    mode_field: ClassVar[None] = None  # errors of time steps depend on when and how long bodies are in contact

    @property
    def model_facts(self) -> Mapping[str, Any]:
        """Part of the report that describes the deformable model."""
        return self.static.model_facts

    def stored_state(self, problem: Dynamics, motion: Motion) -> Floats:
        """Return the displacements of the deformable body, followed by 18 numbers for each rigid body.

        The 18 numbers are the centre of mass (3), m, the axes (3 x 3), the velocity (3), m/s, and the spin (3), rad/s.
        """
        told = self.chart.state(motion.x).reshape(-1, 12)
        own = motion.v[self.dofs :].reshape(-1, 2, 3)
        spins = np.einsum("bij,bj->bi", told[:, 3:].reshape(-1, 3, 3), own[:, 1])
        return np.concatenate([motion.x[: self.dofs], np.hstack([told, own[:, 0], spins]).ravel()])

    def motion_fields(self, times: Floats, states: Floats) -> MotionFields:
        """Return the displacement fields of the deformable body, and a report of the motion of the rigid bodies."""
        found, some = self.static.motion_fields(times, states[:, : self.dofs]), pick_evenly(len(times), MOMENTS)
        times, rigid = times[some], states[some, self.dofs :].reshape(len(some), -1, 18)
        each = {name: _report_motion(times, rigid[:, i]) for i, name in enumerate(self.names)}
        return replace(found, facts={"rigid": each}, notes=self._interpenetration_warnings(times, rigid))

    def _interpenetration_warnings(self, times: Floats, states: Floats) -> tuple[Diagnostic, ...]:
        """Return warnings about rigid bodies that pass through each other."""
        touches = {touch.rigid.name: (touch, amplitude_of_rigid(touch)) for touch in self.case.contacts}
        if len(touches) < 2:
            return ()
        from softmark.interpreter.models.shared.rigid_interpenetration import interpenetration_warnings

        some = pick_evenly(len(times), LOOKED)
        return interpenetration_warnings(touches, self.names, times[some], states[some])


def _report_motion(times: Floats, states: Floats) -> dict[str, Any]:
    """Return the motion of one free rigid body for a report, from its states (t, 18) at times (t,), s.

    Rotations are relative to the first state.
    """
    from scipy.spatial.transform import Rotation

    axes = states[:, 3:12].reshape(-1, 3, 3)
    turned = Rotation.from_matrix(axes @ axes[0].T).as_rotvec()
    columns = {"times_s": times, "middle_m": states[:, :3], "rotation_rad": turned,
               "velocity_m_s": states[:, 12:15], "spin_rad_s": states[:, 15:]}  # fmt: skip
    return {name: values.tolist() for name, values in columns.items()}


def add_free_rigid_bodies(motion: DynamicAnalysis) -> DynamicAnalysis:
    """Add the free rigid bodies of its case to a dynamic analysis."""
    case, problem, dofs = motion.case, motion.problem, motion.problem.assembly.dofs
    bodies = {touch.rigid.name: touch for touch in case.contacts if touch.rigid.thing.free}
    made = [_create_free_body(touch, dofs + 6 * i) for i, touch in enumerate(bodies.values())]
    chart, names, known = FreeBodyChart(made), tuple(bodies), problem.assembly
    loads: dict[str, Energy] = {n: DisplacementEnergy(load, dofs) for n, load in known.proportional_loads.items()}
    bodies_of = {touch.name: touch.rigid.name for touch in case.contacts}
    contacts = {
        name: make_contact_with_free_body(c, chart, names.index(body)) if (body := bodies_of[name]) in bodies else c
        for name, c in known.rigid_contacts.items()
    }
    pulls, amplitudes = _rigid_body_loads(chart, bodies)
    assembly = Assembly(
        dofs + 6 * len(made),
        problem.fixed,
        known.internal,
        number_energies("rigid body load", pulls) | loads | contacts,
    )
    sound = problem.sound
    fitted = replace(
        problem,
        assembly=assembly,
        mass=_mass(problem.mass, made),
        rest=np.zeros(assembly.dofs),
        velocity=np.concatenate(
            [problem.velocity, *(_initial_velocity(b, bodies[n]) for b, n in zip(made, names, strict=True))]
        ),
        amplitudes=(*amplitudes, *problem.amplitudes),
        tolerance=FINER * problem.tolerance,
        sound=lambda x: sound(x[:dofs]),
        linear=DirectStepSolver(symmetric=False),
        lagged=False,
        turning=RotationalInertia(
            chart, np.array([b.first + np.arange(3, 6) for b in made]), np.array([b.J for b in made])
        ),
    )
    return replace(motion, static=SolidWithRigidBodies(motion.static, case, chart, names, dofs), problem=fitted)


def _create_free_body(touch: RigidBodyContact, first: int) -> FreeRigidBody:
    """Return a free rigid body with its mass and inertia; `first` is the index of its first unknown."""
    thing: Any = touch.rigid.thing
    gap = gap_of(thing.shape)
    volume = None if gap is None else mass_properties_of(gap)
    assert volume is not None  # refused when the scene is checked
    mass = thing.mass or thing.density * volume.V
    J, axes = volume.principal
    return FreeRigidBody(first, mass, mass * J, axes, volume.middle)


def _initial_velocity(body: FreeRigidBody, touch: RigidBodyContact) -> Floats:
    """Return the initial velocities (6,) of a rigid body.

    They are the velocity of its centre of mass (3), m/s, and its spin in body axes (3), rad/s.
    """
    thing: Any = touch.rigid.thing
    return np.concatenate([thing.velocity, np.array(thing.spin) @ body.axes])


def _rigid_body_loads(
    chart: FreeBodyChart, touches: Mapping[str, RigidBodyContact]
) -> tuple[list[Energy], list[Amplitude]]:
    """Return the loads on free rigid bodies, and the amplitude of each load."""
    pulls, amplitudes = list[Energy](), list[Amplitude]()
    for which, touch in enumerate(touches.values()):
        for load in touch.loads:
            pulls.append(_rigid_body_load(chart, which, load))
            amplitudes.append(amplitude_of(load))
    return pulls, amplitudes


def _rigid_body_load(chart: FreeBodyChart, which: int, load: Declared) -> RigidBodyLoad:
    """Return one load on the rigid body with index `which`: weight at its centre of mass, point force, or moment."""
    body = chart.bodies[which]
    acting = load.thing.action.on_rigid_body(lambda: body.mass)
    if acting is None:  # refused when the scene is checked
        raise TypeError(f"`{load.name}` does not act on rigid bodies")
    force, at, moment = acting
    point = body.middle if at is None else np.array(at)
    return RigidBodyLoad(chart, which, np.array(force), point, np.array(moment))


def _mass(mass: Any, bodies: Sequence[FreeRigidBody]) -> Any:
    """Return the mass of all unknowns of the deformable body (`mass`) and of the rigid bodies, kg and kg m^2.

    The result is a diagonal (dofs,) if `mass` is one, else a sparse matrix.
    """
    own = np.concatenate([[b.mass, b.mass, b.mass, *b.J] for b in bodies])
    if isinstance(mass, np.ndarray):
        return np.concatenate([mass, own])
    return sparse.block_diag([mass, sparse.diags(own)]).tocsr()
