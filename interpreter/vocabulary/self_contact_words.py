"""Contacts of bodies that both deform: a body with itself, or with another piece of it; and what is glued together."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.records import dataclass

REACH = 1e-2  # of the size: surfaces that are no farther apart are tied


@dataclass(frozen=True)
class Itself:
    """Keeps the surface of a body clear of itself: pieces of `apart(...)` of each other, one piece of its own folds.

    Both deform, and nothing passes through anything: no triangle of the surface cuts another, in any state on the way.
    A barrier does it (the incremental potential, Li et al. 2020): it has no pressure beyond the `distance`, and ever
    more as the gap closes, so that a gap of less than the distance is left, which is part of the stated error. It is
    integrated over both surfaces, whose meshes need not match; facets are split `parts` times along each side for that,
    and a uniform pressure is uniform the better the more there are. Surfaces must be apart at the start, be it by
    little: the distance is then no more than their gap. Finite elements take it, at rest and in motion by implicit
    steps, in space, in the plane and of revolution, with the package ipctk (the extra `contact`: `pip install
    "softmark[contact]"`). In motion it acts at the end of every step, as rigid bodies do, and keeps momentum. Take
    finite strain where surfaces slide along each other: in small strain their forces leave a moment, and are refused.
    `force(NAME, along = +z)` is the force on all pieces but the first.

    With `friction` surfaces stick up to friction times pressure, and slide beyond: Coulomb's law at points of both, by
    return mapping. What sticks gives way by a part of the distance: friction times pressure over ten stiffnesses of the
    barrier. What slides depends on the way there: each of the `states` of a static analysis is one step from the state
    before, so that more states are a finer path; without states all of the load is one step. `slip(NAME)` and
    `stick_area(NAME)` say what slides, `dissipation(BODY)` what has become heat. In motion each time step goes on from
    the one before; its heat is in the balance of energies, and the report tells what slides.
    """

    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "which part of its surface may touch, by coordinates before deformation"] = (
        EVERYWHERE
    )
    friction: Annotated[float, "1 in [0, 10]", "Coulomb's coefficient of friction"] = 0.0
    distance: Annotated[float | None, "m in (0, inf)", "where the barrier begins; by default a thousandth of the size,"
                        " or the least gap"] = None  # fmt: skip
    stiffness: Annotated[float | None, "Pa in (0, inf)", "of the barrier: a quarter of its pressure at half the"
                         " distance; by default a tenth of Young's modulus"] = None  # fmt: skip
    parts: Annotated[int | None, "1 in [1, 16]", "parts of a side of a facet; by default 3, and 4 of facets with"
                     " nodes between corners"] = None  # fmt: skip


@dataclass(frozen=True)
class Tied:
    """Glues pieces of `apart(...)` where they lie on each other at the start, whose meshes need not match.

    Springs between the two surfaces, integrated over what their facets have in common, which is cut out exactly: a
    uniform stress goes through as it is. A stress s opens the joint by s / stiffness, part of the stated error.
    `force(NAME, along = +z)` is the force on all pieces but the first.
    """

    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "which part of its surface is glued, by coordinates before deformation"] = (
        EVERYWHERE
    )
    stiffness: Annotated[float | None, "Pa/m in (0, inf)", "of the joint; by default 10 000 times Young's modulus over"
                         " the size of the body"] = None  # fmt: skip
    reach: Annotated[float | None, "m in (0, inf)", "how far apart surfaces may be that lie on each other; by default a"
                     " hundredth of the size of the body"] = None  # fmt: skip
