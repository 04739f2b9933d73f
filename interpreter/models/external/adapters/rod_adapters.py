"""Functions shared by adapters of rods: nodal axes from axes of segments, and a check of energy against work."""

from __future__ import annotations

import numpy as np

from softmark.interpreter.models.external.external_problem import ExternalNotConverged, Floats

MADE = 0.05  # of the largest work of the loads: energy beyond that work


def must_not_gain_energy(energies: Floats, work: Floats, step: float) -> None:
    """Raise ExternalNotConverged if the energy of a rod exceeds the work of its loads, because steps are too long.

    `energies` (t,), J, and the `work` (t,), J, of dead loads are those since the start at rest. Steps that are too
    long create energy long before numbers overflow. Steps that are short enough create at most the fraction MADE of
    the largest work.
    """
    most = float(np.abs(work).max())
    made = float((energies - work).max())
    if not made <= MADE * most:
        if most == 0.0:
            raise ExternalNotConverged(
                f"it is unstable with steps of {step:g} s: the rod moves although no load does work"
            )
        found = f"{made / most:.3g} times the work of its loads"
        raise ExternalNotConverged(f"it is unstable: with steps of {step:g} s it gains energy, {found}")


def nodal_axes(own: Floats) -> Floats:
    """Return section axes e1, e2, e3 at nodes as columns (n, 3, 3), from the axes `own` (n - 1, 3, 3) of segments.

    They are halfway between the axes of both segments at a node; at an end they are those of its segment.
    """
    both = np.concatenate([own[:1], 0.5 * (own[:-1] + own[1:]), own[-1:]])
    u, _, v = np.linalg.svd(both)  # the rotation nearest to a mean of two
    found: Floats = u @ v
    return found
