"""Textbook cantilever under small deflection: the limit of models for small strain and small rotation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import CentreLine
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import Cantilever

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np


@dataclass(frozen=True)
class SmallDeflection(Reference):
    """The cantilever under its own weight, Bernoulli-Euler theory of small deflections.

    v(x) = w x^2 (6 L^2 - 4 L x + x^2) / (24 EI) along gravity, w L^4 / (8 EI) at the tip; nothing along the axis. A
    point at the offset y below the centre line moves by -y v'(x) along the axis.

    It assumes rotations so small that the lever arm of the load is constant: relative to the large-deflection theory
    the error grows as k^2, with k = w L^3 / (EI), and is about 1 % at k = 1. No shear, no stretch.
    Source: Timoshenko 1955, Strength of Materials, part I, chapter 5 (uniformly loaded cantilever).
    """

    body: Annotated[Any, "body", "straight beam, clamped at one end, bent by gravity"]

    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Timoshenko 1955, Strength of Materials, part I, chapter 5"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equation exactly"

    def solve(self, cantilever: Cantilever) -> CentreLine:
        """Return the deformed centre line, exact up to rounding."""
        k, L = cantilever.load_parameter, cantilever.length
        return CentreLine(
            cantilever,
            axial=np.zeros_like,
            transverse=_polynomial(L * k / 24, (0, 0, 6, -4, 1), L),
            rotation=_polynomial(k / 6, (0, 3, -3, 1), L),
            root_curvature=k / (2 * L),
            estimated_error=16 * float(np.finfo(float).eps) * k * L,
            linearised=True,
        )


def _polynomial(scale: float, coefficients: tuple[int, ...], L: float) -> np.polynomial.Polynomial:
    """Return `scale` times the polynomial in x / L with these coefficients."""
    return np.polynomial.Polynomial(scale * np.array(coefficients), domain=[0, L], window=[0, 1])
