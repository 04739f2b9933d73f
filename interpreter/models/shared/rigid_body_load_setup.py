"""Loads on rigid bodies: weight and point forces, and the mass that they need."""

from __future__ import annotations

from functools import partial
from typing import Any

from softmark.interpreter.problem.body_case import RigidBodyContact
from softmark.solvers.contact.rigid_mass_properties import mass_properties_of
from softmark.solvers.contact.signed_distance import gap_of


def driving_force(touch: RigidBodyContact) -> float:
    """Return the force on a rigid body along its free direction, N: the sum of weight and point forces."""
    assert touch.along is not None
    total = 0.0
    for load in touch.loads:
        acting = load.thing.action.on_rigid_body(partial(mass_of_rigid_body, touch.rigid.thing))
        total += acting[0][touch.along] if acting else 0.0
    return total


def mass_of_rigid_body(thing: Any) -> float:
    """Return the mass of a rigid body, kg; 0 if none is declared."""
    if thing.mass is not None or thing.density is None:
        return float(thing.mass or 0.0)
    gap = gap_of(thing.shape)
    volume = None if gap is None else mass_properties_of(gap)
    assert volume is not None  # refused when the scene is checked
    return float(thing.density * volume.V)
