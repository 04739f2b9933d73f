"""Solid finite elements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter import units
from softmark.interpreter.estimate import bending_angle

if TYPE_CHECKING:
    from softmark.interpreter.case import Case
    from softmark.interpreter.models.prepared import Prepared, Workshop
    from softmark.interpreter.scene import Declared

LOCKING = 0.45  # Poisson's ratio from which linear tetrahedra are visibly too stiff
LARGE_ANGLE = 0.1  # rad: a rotation that small strains misread by 0.5 % strain (1 - cos)


@dataclass(frozen=True)
class Fem:
    """Finite elements over the volume of a body: a choice of element and of how strain is measured.

    `small`: strain is linear in the displacements; right for rotations of a few degrees, grows the body when
    it turns. `corotational`: linear elasticity in the frame of the polar rotation of each integration point,
    with its exact derivatives; right for large rotations and small strains. `finite`: the material's own law,
    right for both.
    The first two take the moduli that the material has at rest.
    """

    element: Annotated[str, "element", "the element: tet4"]
    strain: Annotated[Literal["small", "corotational", "finite"], "how strain is measured"]
    size: Annotated[float, "m in (0, inf)", "edge length that the mesh aims at"]
    body: Annotated[str | None, "body", "the body, where a scene has several"] = None

    def doubts(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """What speaks against this model of this case."""
        found = [
            self._finite_law(declared, case),
            self._locking(declared, case),
            self._rotation(declared, case),
        ]
        return [d for d in (*found, self._coarse(declared, case)) if d is not None]

    def _finite_law(self, declared: Declared, case: Case) -> Diagnostic | None:
        if self.strain != "finite" or case.material.finite_law() is not None:
            return None
        at, body = declared.at("strain"), case.body.name
        return Diagnostic(
            "E502",
            f"the material of `{body}` has no law for finite strain",
            at.source,
            at.span,
            "needs such a law",
            "declare a `neo_hookean(...)` or `st_venant_kirchhoff(...)`, or use `strain = corotational`",
        )

    def _locking(self, declared: Declared, case: Case) -> Diagnostic | None:
        nu = case.material.poisson
        if self.element != "tet4" or nu < LOCKING:
            return None
        at = declared.at("element")
        return Diagnostic(
            "W301",
            f"linear tetrahedra lock at a Poisson's ratio of {nu:g}",
            at.source,
            at.span,
            "too stiff here",
            "it bends too little, the more so the coarser its mesh: refine and compare, or use another model",
        )

    def _rotation(self, declared: Declared, case: Case) -> Diagnostic | None:
        angle = bending_angle(case) if self.strain == "small" else None
        if angle is None or angle < LARGE_ANGLE:
            return None
        at = declared.at("strain")
        return Diagnostic(
            "W302",
            "small strains cannot follow the rotation that this load causes",
            at.source,
            at.span,
            f"about {math.degrees(angle):.0f} deg at the tip" if angle < 1.5 else "far beyond its range",
            "the body will seem to grow as it turns; use `strain = corotational` or `finite`",
        )

    def _coarse(self, declared: Declared, case: Case) -> Diagnostic | None:
        shape = case.shape
        if getattr(shape, "prebuilt", False):
            return None
        low, high = shape.bounds
        at = declared.at("size")
        cells = 5 * shape.volume / self.size**3
        if cells > 2e7:
            size = units.show(self.size, units.LENGTH)
            extent = units.show(max(b - a for a, b in zip(low, high, strict=True)), units.LENGTH)
            return Diagnostic(
                "E304",
                f"a mesh of about {cells:.0e} tetrahedra does not fit in memory",
                at.source,
                at.span,
                f"{size} for a body of {extent}",
                "use a larger size",
            )
        least = min(b - a for a, b in zip(low, high, strict=True))
        if self.size > 0.5 * least * (1 + 1e-9):
            return Diagnostic(
                "W312",
                f"the mesh of `{declared.name}` is coarser than the body",
                at.source,
                at.span,
                f"the body is {units.show(least, units.LENGTH)} across",
                "use a size of a fraction of that; bending needs four cells or more across",
            )
        return None

    def outline(self, case: Case) -> str:
        """One line for the plan."""
        mesh = (
            "of the file"
            if getattr(case.shape, "prebuilt", False)
            else f"of about {units.show(self.size, units.LENGTH)}"
        )
        return f"{self.element} {mesh}, {self.strain} strain"

    def load(self) -> None:
        """Import what building needs, so that no clock counts it."""
        import softmark.interpreter.models.solid
        import softmark.solvers.mesh.structured  # noqa: F401

    def prepare(self, declared: Declared, case: Case, workshop: Workshop) -> Prepared:
        """Mesh, elements, supports and loads as arrays. Raises Fault."""
        from softmark.interpreter.models.solid import prepare

        return prepare(self, declared, case, workshop)


def element_class(name: str) -> Any:
    """The class of an element by its word."""
    from softmark.solvers.elements import ELEMENTS

    return ELEMENTS[name]
