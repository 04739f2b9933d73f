"""Amplitudes of the loads, supports and rigid bodies of a case."""

from __future__ import annotations

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.amplitude_tables import table_fault
from softmark.interpreter.problem.body_case import Case, Fault, RigidBodyContact
from softmark.solvers.dynamics.load_amplitudes import Amplitude, Constant


def check_amplitudes(case: Case, duration: float) -> None:
    """Raise Fault if the table of an amplitude cannot be read or is shorter than the analysis, of `duration`, s."""
    pulling = (load for touch in case.contacts for load in touch.loads)  # on rigid bodies
    for moved in (*case.loads, *case.muscles, *case.supports, *pulling):
        if (wrong := table_fault(moved, duration)) is not None:
            raise Fault(wrong)


def amplitude_of(load: Declared) -> Amplitude:
    """Return the amplitude of a load or support; by default it is 1 from the start."""
    course: Amplitude | None = load.thing.amplitude
    return course or Constant()


def amplitude_of_rigid(touch: RigidBodyContact) -> Amplitude:
    """Return the amplitude of the supports of a rigid body; a constant if the rigid body does not move."""
    first = next((s for s in touch.moved if s.thing.moves), None)
    return Constant() if first is None else amplitude_of(first)


def support_amplitude(case: Case) -> Amplitude:
    """Return the common amplitude of all moving supports. Validation refuses scenes with different amplitudes."""
    moving = (s for s in case.supports if s.thing.follows_amplitude)
    first = next(moving, None)
    return Constant() if first is None else amplitude_of(first)
