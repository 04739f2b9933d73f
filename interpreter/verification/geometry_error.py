"""Error due to flat facets in place of the curved sides of combined shapes.

Finer spaces over the same cells have the same facets, so they do not show this error. The volume error of the facets is
known. A bending stiffness grows with the square of a section's area, so it has twice that relative error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from softmark.solvers.mesh.surface_bodies import SurfaceBody

if TYPE_CHECKING:
    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest

STIFFER = 2.0  # factor on the relative volume error


def facet_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to flat facets, as {part name: function of a probe result}.

    It is empty for bodies without such facets.
    """
    shape = whole.case.shape
    if not isinstance(shape, SurfaceBody):
        return {}
    from softmark.interpreter.models.shared.filled_mesh_notes import filled_mesh_report

    known = filled_mesh_report(shape, whole.prepared.mesh).get("filled", {})
    share = abs(known["facets_m3"]) / known["surface_m3"] if known else 0.0
    return {"facets": lambda seen: STIFFER * share * seen.size} if share > 1e-9 else {}
