"""Plane cells of a shape as scikit-fem has them."""

from __future__ import annotations

from typing import Any

from softmark.solvers.mesh.plane_regions import Slice


def skfem_mesh(region: Slice, element: str, size: float) -> Any:
    """The triangles or quadrilaterals that cells of an element have, with straight sides."""
    import skfem

    corners = 3 if element.startswith("tri") else 4
    made = region.mesh("tri3" if corners == 3 else "quad4", size)
    lower = made.points[:, 2] < 0
    return (skfem.MeshTri if corners == 3 else skfem.MeshQuad)(made.points[lower, :2].T, made.cells[:, :corners].T)


def skfem_element(element: str) -> Any:
    """One that has displacements as an element of ours."""
    import skfem

    kinds = {"quad4": skfem.ElementQuad1, "quad8": skfem.ElementQuadS2, "quad9": skfem.ElementQuad2,
             "tri3": skfem.ElementTriP1, "tri6": skfem.ElementTriP2}  # fmt: skip
    return skfem.ElementVector(kinds[element]())
