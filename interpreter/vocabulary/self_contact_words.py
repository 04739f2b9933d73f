"""Contacts between deformable surfaces of one body: self-contact, contact of its separate pieces, and tied surfaces."""

from __future__ import annotations

from typing import Annotated, Any

from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.records import dataclass

REACH = 1e-2  # default largest gap of tied surfaces, as a fraction of the body size


@dataclass(frozen=True)
class SelfContact:
    """Self-contact of a body: separate pieces of `disjoint(...)` with each other, and the folds of one piece.

    Both surfaces deform and nothing penetrates: no triangle of the surface crosses another one, in any intermediate
    state. A barrier enforces this (incremental potential contact, Li et al. 2020). It acts only at gaps below
    `distance` and grows without bound as the gap closes, so a gap smaller than `distance` remains, which is part of the
    stated error. The barrier is integrated over both surfaces, whose meshes need not match. For this each side of a
    facet is divided into `parts`; more parts give a more uniform pressure. Surfaces must not touch at the start, and
    `distance` is never larger than their initial gap. `force(NAME, along = +z)` is the force on all pieces but the
    first.

    Finite elements support it in static analyses and in dynamic ones with implicit steps: in three dimensions, in the
    plane and axisymmetric. It needs the package ipctk (the extra `contact`: `pip install "softmark[contact]"`). In
    motion it acts at the end of every step, like contact with rigid bodies, and conserves momentum. Use finite strain
    if surfaces slide along each other: in small strain their forces would leave a moment, so this is refused.

    `friction` is Coulomb's law at points of both surfaces, by return mapping: surfaces stick up to friction times
    pressure and slide beyond. Sticking points slip elastically by a fraction of `distance`: by friction times pressure,
    divided by ten times the barrier stiffness. Sliding depends on the load path. Each of the `states` of a static
    analysis is one step from the previous state, so more states resolve the path better; without states the full load
    is one step. `slip(NAME)` and `stick_area(NAME)` measure the sliding, `dissipation(BODY)` the heat. In motion each
    time step continues from the previous one; the heat is part of the energy balance, and the report lists the sliding.
    """

    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "part of its surface that may touch, by undeformed coordinates"] = EVERYWHERE
    friction: Annotated[float, "1 in [0, 10]", "Coulomb friction coefficient"] = 0.0
    distance: Annotated[float | None, "m in (0, inf)", "gap below which the barrier acts; default: 1/1000 of the body"
                        " size, or the smallest gap"] = None  # fmt: skip
    stiffness: Annotated[float | None, "Pa in (0, inf)", "barrier stiffness: a quarter of its pressure at half the"
                         " distance; default: a tenth of Young's modulus"] = None  # fmt: skip
    parts: Annotated[int | None, "1 in [1, 16]", "divisions of each side of a facet; default: 3, or 4 for facets with"
                     " midside nodes"] = None  # fmt: skip


@dataclass(frozen=True)
class Tied:
    """Tie constraint between pieces of `disjoint(...)` where they touch at the start; their meshes need not match.

    It consists of springs between the two surfaces, integrated over the exact intersections of their facets, so a
    uniform stress is transmitted exactly. A stress s opens the joint by s / stiffness, which is part of the stated
    error. `force(NAME, along = +z)` is the force on all pieces but the first.
    """

    body: Annotated[str, "body", "the deformable body"]
    where: Annotated[Any, "condition", "part of its surface that is tied, by undeformed coordinates"] = EVERYWHERE
    stiffness: Annotated[float | None, "Pa/m in (0, inf)", "stiffness of the joint; default: 10 000 times Young's"
                         " modulus divided by the body size"] = None  # fmt: skip
    reach: Annotated[float | None, "m in (0, inf)", "largest gap between surfaces that are tied; default: 1/100 of the"
                     " body size"] = None  # fmt: skip
