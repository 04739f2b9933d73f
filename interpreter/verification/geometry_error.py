"""The error that comes of flat facets in the place of the curved sides of shapes that are combined.

Finer spaces over the same cells have the same facets, and know nothing of them. What facets miss of the volume is
known; a bending stiffness, which goes with the square of a section's area, is off by twice that share.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from softmark.solvers.mesh.surface_bodies import SurfaceBody

if TYPE_CHECKING:
    from softmark.interpreter.verification.probe_errors import ProbeAnswer
    from softmark.interpreter.verification.solution_under_test import Answer

STIFFER = 2.0  # times the share of the volume


def facets(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of facets; none where the mesh is not made of them, or none is curved."""
    shape = whole.case.shape
    if not isinstance(shape, SurfaceBody):
        return {}
    from softmark.interpreter.models.shared.filled_mesh_notes import facts

    known = facts(shape, whole.prepared.mesh).get("filled", {})
    share = abs(known["facets_m3"]) / known["surface_m3"] if known else 0.0
    return {"facets": lambda seen: STIFFER * share * seen.size} if share > 1e-9 else {}
