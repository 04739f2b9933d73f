"""Limit of a scene's own models under refinement, for problems without a closed form."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import How, Reference


@dataclass(frozen=True)
class SelfConverged(Reference):
    """Limit of the scene's own models under mesh refinement, as reference for problems without a theory.

    Name at least two `fem` models in `methods` and at least three cell sizes in `sizes`. Each model is solved with
    each size in place of its own, which may take longer than the rest of the scene. The models need a `size`,
    different elements or different integration, and the same strain measure and material. Sizes must divide the
    body evenly: for example a cylinder's radius divided by 2.5, 5 and 7.5, or a box's shortest edge divided by 2, 4
    and 6. Only for static analyses.

    The displacements of each model are extrapolated to cell size 0: u = u1 + (u1 - u2) / (r^p - 1). Here u1 and u2
    are the solutions on the finest two meshes, and r is the ratio of their cell sizes. The order of convergence p
    is computed from the finest three meshes in the L2 norm. The estimated error is the grid convergence index, 1.25
    |u - u1| at the point where it is largest, with p at most the order of the element.

    The displacements are not extrapolated in three cases: p is below 0.5 or more than half an order above that of
    the element; cells do not shrink by one ratio in all directions; neighbouring sizes have a ratio below 1.3. The
    solution on the finest mesh is then used, and its estimated error is three times the largest difference between
    the meshes.

    The model with the smallest estimated error becomes the reference. Its stated error is this estimate, or its
    distance from the other models if that is larger. The reference is refused if the distance of two models exceeds
    twice the sum of their estimates, or if the stated error exceeds 5 % of the largest displacement.

    Limits: the reference uses the same solver, material law and loads as the models that are compared with it. It
    shows how much of their error comes from the mesh, but not whether the program or the model is right.
    Source: Roache 1994, J. Fluids Eng. 116:405; Celik et al. 2008, J. Fluids Eng. 130:078001; Eca and Hoekstra
    2014; Oberkampf and Roy 2010, section 8.8.
    """

    methods: Annotated[tuple[str, ...], "models", "two or more `fem` models with different elements or integration"]
    sizes: Annotated[Any, "values", "at least three cell sizes, coarse to fine, such as `[12, 9, 6] mm`"]
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "refined"
    means: ClassVar[str] = "extrapolated"
    source: ClassVar[str] = (
        "the scene's own models and this solver, refined (Celik et al. 2008): checks discretisation, not the code"
    )
    error_meaning: ClassVar[str] = (
        "grid convergence index or difference between the models, m, whichever is larger: discretisation error only, "
        "no rounding"
    )
