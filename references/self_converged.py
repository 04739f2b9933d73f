"""Limit of a scene's own models under refinement, for problems without a closed form."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.reference_base import How, Reference


@dataclass(frozen=True)
class SelfConverged(Reference):
    """The limit of two or more of the scene's own models under mesh refinement, for problems without a theory.

    Each model named is solved again with every one of the `sizes`, instead of its own size, for the same case, and its
    displacements are extrapolated to h = 0: u = u1 + (u1 - u2) / (r^p - 1), with r the ratio of the finest two cell
    sizes and p the order that the finest three meshes show in the L2 norm over the body. The estimate of the error is
    that of the grid convergence index, 1.25 |u - u1| at the point where it is largest, with p no more than the
    element's own order. If p is not between 0.5 and half an order above that, if cells do not shrink by one ratio in
    all directions, or if neighbouring meshes differ by less than 1.3, nothing is extrapolated: the finest solution is
    used, and the estimate is three times the largest difference between the meshes. The reference is the model of the
    smallest estimate. Its error is that estimate, or its distance from the other models if that is larger. It is
    refused if two models are farther apart than twice the sum of their estimates, and if the error is above 5 % of the
    largest displacement.

    It shares the solver, the material law and the loads with the models that it is compared with: it shows how much of
    an error comes from the mesh, but not whether the code or the model is right. The models must be `fem` with a
    `size`, with different elements or integration, of the same strain measure and material. Sizes must divide the body
    evenly: a cylinder's radius divided by 2.5, 5 and 7.5, a box's shortest edge by 2, 4 and 6. Static analyses only.
    Every size of every model is solved: this may take longer than the scene itself.
    Source: Roache 1994, J. Fluids Eng. 116:405; Celik et al. 2008, J. Fluids Eng. 130:078001; Eca and Hoekstra 2014;
    Oberkampf and Roy 2010, section 8.8.
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
