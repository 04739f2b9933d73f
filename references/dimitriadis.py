"""Indentation of a thin layer by a rigid sphere without friction: the series of Dimitriadis and others."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.half_space_indentation import ForceTheory
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    from softmark.references.indentation import Indentation

BONDED = (1.0, 1.133, 1.283, 0.769, 0.0975)
SLIDING = (1.0, 0.884, 0.781, 0.386, 0.0048)
LEAST = 0.49  # Poisson's ratio, below which a layer keeps its volume too badly
FARTHEST = 1.0  # sqrt(R d) over the thickness, up to which it was shown


@dataclass(frozen=True)
class LayerSeriesSolution(ForceTheory):
    """Force F = 16/9 E sqrt(R) d^(3/2) (1 + c1 x + ... + c4 x^4) with x = sqrt(R d) / h, for nu = 0.5. SI units.

    R is the radius of the sphere, d the depth and h the thickness of the layer.
    """

    @property
    def x(self) -> float:
        """Dimensionless contact size sqrt(R d) / h."""
        return self.pressed.radius / self.pressed.around.thickness

    @property
    def push(self) -> float:
        """Force into the layer, N."""
        own = self.pressed
        if not own.touches:
            return 0.0
        more = sum(c * self.x**n for n, c in enumerate(BONDED if own.around.bonded else SLIDING))
        return 16.0 / 9.0 * own.young * math.sqrt(own.tip.span * own.depth) * own.depth * more

    @property
    def area(self) -> float:
        """NaN, since the series gives no contact radius."""
        return math.nan

    @property
    def largest_pressure(self) -> float:
        """NaN, since the series gives no pressure."""
        return math.nan

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated errors of the force, relative to the force, by name of the effect that the series neglects.

        `series`: difference of the force from that of the integral equation of the layer. `depth`: depth of the
        indentation
        divided by the radius of the sphere, which the theory takes as small.
        """
        own = self.pressed
        if not own.touches:
            return {"series": 0.0, "depth": 0.0}
        return {"series": own.layer.push / self.push - 1.0, **own.tip.relative_errors(own.depth)}

    @property
    def estimated_error(self) -> float:
        """Error of the indentation depth for the given force, m."""
        return abs(self.relative_errors["series"]) * abs(self.pressed.depth) / self.pressed.tip.force_exponent


@dataclass(frozen=True)
class Dimitriadis(Reference):
    """Indentation of an incompressible layer by a rigid sphere without friction: the force, by a series.

    F = 16/9 E sqrt(R) d^(3/2) (1 + 1.133 x + 1.283 x^2 + 0.769 x^3 + 0.0975 x^4) with x = sqrt(R d)/h if the layer is
    bonded to its base (its far face fixed), and 1 + 0.884 x + 0.781 x^2 + 0.386 x^3 + 0.0048 x^4 if it slides (held
    along its normal only). The series holds for Poisson's ratio 0.5: below 0.49 it is refused, as is x > 1. Its error
    by the integral equation of the same layer is in the report (`off`): for a sliding layer the exact first coefficient
    is 0.744, not 0.884. `pressed_layer` solves that equation, for any Poisson's ratio.

    It applies to the same cases as `hertz`. It can be compared with the metric `force`.
    Source: Dimitriadis, Horkay, Maresca, Kachar and Chadwick 2002, Biophys. J. 82, 2798-2810.
    """

    body: Annotated[Any, "body", "the layer"]

    problem_kind: ClassVar[str] = "indentation"
    with_displacements: ClassVar[bool] = False
    means: ClassVar[str] = "series"
    source: ClassVar[str] = "Dimitriadis et al. 2002, Biophys. J. 82, 2798-2810"
    error_meaning: ClassVar[str] = (
        "error of the force relative to the integral equation, as an indentation depth, m, and rounding"
    )

    def must_hold(self, pressed: Indentation) -> None:
        """Raise NotApplicable if the case violates an assumption of the series."""
        pressed.must_slip_freely()
        pressed.must_be_shallow()
        if pressed.kind != "sphere":
            raise NotApplicable(
                f"the indenter is a {pressed.kind}", "it applies only to spheres: use `pressed_layer(...)`"
            )
        if pressed.poisson < LEAST:
            raise NotApplicable(f"Poisson's ratio is {pressed.poisson:g}; the series holds for 0.5",
                          "use `pressed_layer(...)`, which accepts any Poisson's ratio")  # fmt: skip
        x = self.solve_unchecked(pressed).x
        if x > FARTHEST:
            raise NotApplicable(f"sqrt(R d) is {x:.3g} times the thickness", "use a thicker layer or a smaller depth")
        pressed.must_be_wide()

    def solve(self, pressed: Indentation) -> LayerSeriesSolution:
        """Return the solution. Raises NotApplicable if the case violates an assumption."""
        self.must_hold(pressed)
        return self.solve_unchecked(pressed)

    def solve_unchecked(self, pressed: Indentation) -> LayerSeriesSolution:
        """Return the solution without a check of the assumptions."""
        return LayerSeriesSolution(pressed.half_space)
