"""Metrics of a contact: contact area, contact pressure and gap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.interpreter.metrics.metric_base import WHEN, ForceMetric, When
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.metric_base import Floats
    from softmark.interpreter.results.reaction_results import ContactNumbers, EquilibriumForces
else:
    from softmark.solvers.runtime.lazy_modules import np


class ContactMetric(ForceMetric):
    """Base class of metrics that evaluate one contact."""

    of_surface = True
    numbers: ClassVar[tuple[str, ...]] = ("pressure",)  # contact results at nodes that reports colour

    if TYPE_CHECKING:
        of: str

    @property
    def subject_name(self) -> str:
        """Name of the contact that the metric evaluates."""
        return self.of

    def contact_numbers(self, rest: EquilibriumForces) -> ContactNumbers:
        """Return area, pressure and gap of the contact. Raises Undefined if only its force is known."""
        if self.of not in rest.touches:
            raise Undefined(f"only the force of the contact `{self.of}` is known, not its area, pressure or gap")
        return rest.touches[self.of]

    def size(self, value: Floats) -> float:
        """Return the magnitude of the first entry of `value`, by which errors are divided."""
        return abs(self._along(value))

    def _along(self, value: Floats) -> float:
        """Return the first entry of `value`, which is the value of the metric."""
        return float(value.flat[0])


@dataclass(frozen=True)
class ContactArea(ContactMetric):
    """Contact area of a body's surface in its deformed shape (with small strain, in its undeformed shape).

    For `self_contact` it is half the area of both surfaces. The edge of the contact lies between a node in contact and
    one out of contact, where pressure and gap place it. On a coarse mesh the area is the least accurate result of a
    contact, and it does not converge if contact opens and closes with the mesh. Against another model or a theory, the
    value is the difference relative to the area of that solution.

    In a dynamic analysis the report also gives largest_in_time_m2 and its time largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "m^2"

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the contact area, m^2. Raises Undefined if the contact has no results."""
        return np.array(self.contact_numbers(rest).area)

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest contact area of all contacts, m^2."""
        return max(touch.area for touch in rest.touches.values())


@dataclass(frozen=True)
class ContactPressure(ContactMetric):
    """Contact pressure on the surface of a body: the largest value, or the value at a point of the surface.

    It is force per deformed area (with small strain, per undeformed area), recovered from the nodal contact forces: the
    field, linear or bilinear on facets, that has the same nodal forces. At the edge of a sharp punch the pressure is
    singular and grows with every refinement; at a rounded edge it converges. Against another model or a theory, the
    value is the difference relative to the pressure of that solution.

    The report also gives largest_Pa; in a dynamic analysis also largest_in_time_Pa and its time largest_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    at: Annotated[
        tuple[float, float, float] | None,
        "m",
        "point of the surface, by its undeformed coordinates; default: the largest",
    ] = None
    over: Annotated[When, WHEN] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "Pa"

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the requested pressure and the largest pressure of the contact, Pa.

        Raises Undefined without contact results.
        """
        touch = self.contact_numbers(rest)
        return np.array([touch.pressure if self.at is None else self._pressure_at_point(touch), touch.pressure])

    def _pressure_at_point(self, touch: ContactNumbers) -> float:
        """Return the contact pressure at the requested point, Pa."""
        if touch.field is None:
            raise Undefined(
                f"only the largest pressure of `{self.of}` is known, not the pressure at a point: remove `at`"
            )
        assert self.at is not None
        found = float(touch.field.pressures(np.array([self.at]))[0])
        if math.isnan(found):
            raise Undefined(f"the undeformed point `at` is not on the surface of the contact `{self.of}`")
        return found

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest contact pressure of all contacts, Pa."""
        return max(touch.pressure for touch in rest.touches.values())

    def details(self, value: Floats) -> dict[str, Any]:
        """Return the report entry of the largest pressure."""
        return {"largest_Pa": float(value[1])}


@dataclass(frozen=True)
class ContactGap(ContactMetric):
    """Least distance between the contact points of a body's surface and a rigid body; always positive.

    Contact points are the nodes, the midpoints of eight-node facets, in 3D also points inside facets that are longer
    than the radius of curvature of the rigid body, and points that were added where facets penetrated. For
    `self_contact` it is the distance between the body's flat facets.

    Before contact it is the initial separation. For a body that may touch itself, it is the distance between parts of
    the surface that face each other within 30 degrees, such as the walls of a slot. In contact it is the gap that the
    barrier leaves, less than the barrier's `distance`. That gap is not a property of the bodies, but it is part of the
    stated error of all other results.

    The report also gives left_m, the mean gap in contact, weighted by the contact forces; in a dynamic analysis also
    least_in_time_m and its time least_at_s.
    """

    of: Annotated[str, "contact", "the contact"]
    over: Annotated[
        Literal["end", "least", "mean"],
        "in a dynamic analysis: value at the end, least value over time, or mean over time",
    ] = "end"
    against: Annotated[str | None, "reference or model", "solution taken as correct"] = None
    natural: ClassVar[str] = "m"
    extreme: ClassVar[str] = "least"
    numbers: ClassVar[tuple[str, ...]] = ()

    def amount(self, rest: EquilibriumForces) -> Floats:
        """Return the least gap and the mean gap in contact, m. Raises Undefined without contact results."""
        touch = self.contact_numbers(rest)
        if touch.gap is None:
            raise Undefined(f"`{self.of}` is not in contact, and no parts of the surface face each other")
        return np.array([touch.gap, touch.left])

    def acting(self, rest: EquilibriumForces) -> float:
        """Return the largest nodal displacement of the body, m."""
        return rest.moved

    def details(self, value: Floats) -> dict[str, Any]:
        """Return the report entry of the mean gap in contact."""
        return {"left_m": float(value[1])}
