"""Part of the surface of a mesh that a load or an elastic foundation acts on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.problem.body_case import fault
from softmark.interpreter.problem.surface_selection.loaded_surface_part import LoadedSurface, find_loaded_surface

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.language.coordinate_conditions import Condition
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.mesh import Mesh


def surface_of(case: Case, acting: Declared, where: Condition, mesh: Mesh) -> LoadedSurface:
    """Return the surface that a load or a foundation acts on.

    Raises Fault if the surface has no area or, for a plane body, is not an edge of its plane.
    """
    found = find_loaded_surface(case.shape, mesh, where)
    if found.empty:
        raise fault(
            "E302",
            acting.at("where"),
            f"`{acting.name}` selects no part of the surface of `{case.body.name}`",
            "selects nothing",
            "write a condition that holds on a part of the surface with an area",
        )
    if case.planar:
        _check_selects_edges(case, acting, mesh.points[found.selected_facets])
    return found


def _check_selects_edges(case: Case, load: Declared, X: Floats) -> None:
    """Raise Fault if a load on a plane body selects its faces rather than its edges.

    X (f, k, 3), m, are the nodes of the selected facets.
    """
    z = X[..., 2]
    if bool((np.ptp(z, axis=1) <= 1e-9 * np.ptp(z)).any()):
        raise fault(
            "E544",
            load.at("where"),
            f"`{load.name}` acts on the faces of the plane body `{case.body.name}`, which can be loaded "
            "only on its edge",
            "also holds inside the region",
            "write a condition that holds only on the edge, such as `x >= 48 mm` for a body that ends there",
        )
