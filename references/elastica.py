"""Large-deflection Bernoulli-Euler beam, the theory in figure 3 and table 1 of Marchal et al. (2008)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import CentreLine
from softmark.references.elastica_collocation import solve_rod
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import Cantilever

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class Elastica(Reference):
    """The cantilever under its own weight, large-deflection Bernoulli-Euler theory.

    phi'' = -(w / EI) (L - s) cos(phi), phi(0) = 0, phi'(L) = 0, with phi the slope at the arc length s, w = rho A g the
    weight per length and EI the bending stiffness. The centre line follows from x' = cos(phi) along the axis and y' =
    sin(phi) along gravity; points off it rotate with their cross-section.

    It assumes a straight uniform beam, clamped at one end and horizontal there, linear in its curvature, without
    stretch or shear, which causes an error of order (depth / length)^2, several per cent for a thick beam. It holds for
    every load parameter k = w L^3 / (EI); solved for k up to 1e5.
    Source: Marchal, Allard, Duriez and Cotin 2008, ISBMS, LNCS 5104:176, equation (3).
    """

    body: Annotated[Any, "body", "straight beam, clamped at one end, bent by gravity"]
    young: Annotated[
        float | None, "Pa in (0, inf)", "Young's modulus to use instead of the body's, for example to identify it"
    ] = None

    means: ClassVar[str] = "ordinary differential equation"
    source: ClassVar[str] = "Marchal, Allard, Duriez and Cotin 2008, ISBMS, LNCS 5104:176, equation (3)"
    error_meaning: ClassVar[str] = (
        "numerical error of the displacement, m: the change between the last two resolutions, plus rounding"
    )

    def solve(self, cantilever: Cantilever) -> CentreLine:
        """Return the deformed centre line. Raises NotSolved if a relative accuracy of 1e-10 is not reached."""
        return solve_rod(Inextensible(cantilever.load_parameter), cantilever)


@dataclass(frozen=True)
class Inextensible:
    """Inextensible rod that only bends, scaled by its length; load parameter k = w L^3 / (EI)."""

    k: float

    def bending(self, s: Array, phi: Array) -> Array:
        """Return the scaled bending load g = k (1 - s) cos(phi) (n,). Source: Marchal et al. 2008, equation (3)."""
        return self.k * (1 - s) * np.cos(phi)

    def bending_slope(self, s: Array, phi: Array) -> Array:
        """Return the derivative dg/dphi = -k (1 - s) sin(phi) (n,)."""
        return -self.k * (1 - s) * np.sin(phi)

    def strain(self, s: Array, phi: Array) -> tuple[Array, Array]:
        """Return x' - 1 = cos(phi) - 1, computed without cancellation, and y' = sin(phi)."""
        return -2 * np.sin(phi / 2) ** 2, np.sin(phi)
