"""Least fraction of a Newton step in a line search with rigid contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from softmark.solvers.energies.energy import Floats

SHORTEST = 1e-5  # least fraction of a step
SHORTEST_INTO_CONTACT = 1e-10  # same into a contact barrier: just outside it the tangent lacks its stiffness


def least_fraction_into_contact(contacts: Sequence[Any], left: Floats | None) -> float:
    """Return the least fraction of a step that may enter contact barriers.

    A body that leaves an unstable equilibrium `left` (dofs,) may land on another contact. If all `contacts` had forces
    there, the body only slips off them, and the least fraction is that without contact.
    """
    slips = left is not None and all(contact.value(left) > 0.0 for contact in contacts)
    return SHORTEST if slips else SHORTEST_INTO_CONTACT
