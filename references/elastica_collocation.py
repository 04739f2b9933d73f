"""Slope of a bent rod, by Chebyshev collocation of its integral equation.

Lengths are scaled by the length of the rod, so s is in [0, 1]. A clamped rod under dead weight obeys

    phi'' = -g(s, phi),   phi(0) = 0,   phi'(1) = 0,

which is equivalent to phi(s) = integral of min(s, t) g(t, phi(t)) dt. This second integral is collocated instead of the
differential equation. The matrix then stays as well conditioned as the rod itself, and rounding costs a few ulps, where
second derivatives would cost n^4 of them (Greengard 1991, SIAM J. Numer. Anal. 28:1071).

Newton's method starts from phi = pi/2, a rod that hangs down. Where g is concave in phi on [0, pi/2] and zero at pi/2,
every tangent lies above g, so every iterate lies above the solution and below the previous iterate. Newton's method
then converges for any load without continuation. Where g falls with phi, the energy is convex and [0, pi/2] contains no
second solution. A rod that curls back may have other solutions, which a beam loaded from its straight shape does not
reach.

To add a rod, write a class with the members of `PlanarRod`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

from softmark.records import dataclass
from softmark.references.beam_centre_line import CentreLine
from softmark.references.straight_cantilever import Cantilever

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

ACCURACY = 1e-10
"""Largest change between two resolutions, relative to the largest value, that counts as solved."""

RESOLUTIONS = (16, 32, 64, 128, 256, 512)
NEWTON_STEPS = 60
SMALLEST = 1e-300  # rad: a first iterate may round to zero under a load of nothing


class NotSolved(Exception):
    """Error when the accuracy was not reached; `history` holds the relative changes in their order."""

    def __init__(self, message: str, history: tuple[float, ...]) -> None:
        super().__init__(message)
        self.history = history


class PlanarRod(Protocol):
    """Interface of a planar rod scaled by its length: s in [0, 1], phi (n,) the angle from axis to gravity, rad."""

    def bending(self, s: Array, phi: Array) -> Array:
        """Return g = -phi'' (n,), the scaled moment per length of the weight beyond s."""

    def bending_slope(self, s: Array, phi: Array) -> Array:
        """Return the derivative dg/dphi (n,)."""

    def strain(self, s: Array, phi: Array) -> tuple[Array, Array]:
        """Return x' - 1 and y' (n,), the derivatives of the displacements along the axis and along gravity."""


@dataclass(frozen=True)
class Grid:
    """Chebyshev points on [0, 1] and linear operators on values at these points."""

    s: Array  # (n,)
    coefficients: Array  # (n, n): values to Chebyshev coefficients
    G: Array  # (n, n): values of g to values of phi, the integral of min(s, t) g(t)


@dataclass(frozen=True)
class RodShape:
    """Solution on one grid: Chebyshev coefficients over [0, 1] of rotation and displacements, scaled by the length."""

    phi: Array  # (n + 2,)
    curvature: Array  # (n + 1,), phi'
    axial: Array  # (n + 1,)
    transverse: Array  # (n + 1,)

    def at(self, s: Array) -> Array:
        """Return the rotation and both displacements, shape (3, m), at positions s (m,) in [0, 1]."""
        z = 2 * s - 1
        return np.stack([_chebyshev_value(z, c) for c in (self.phi, self.axial, self.transverse)])


def solve_rod(rod: PlanarRod, cantilever: Cantilever) -> CentreLine:
    """Return the deformed centre line of `cantilever` by the equations of `rod`.

    The resolution doubles until rotation and displacements change by less than ACCURACY, relative. The finer solution
    is returned. Its estimated error is that last change, which is the error of the coarser solution, plus rounding.
    Raises NotSolved.
    """
    shape = _solve_shape(rod, RESOLUTIONS[0])
    changes: list[float] = []
    for n in RESOLUTIONS[1:]:
        finer = _solve_shape(rod, n)
        change, size = _largest_change(shape, finer)
        changes.append(change / size)
        if changes[-1] <= ACCURACY:
            _check_slope_range(finer, changes)
            return _make_centre_line(finer, cantilever, change + 64 * float(np.finfo(float).eps) * size)
        shape = finer
    raise NotSolved(
        f"with {RESOLUTIONS[-1]} Chebyshev points the relative change is {changes[-1]:.1e}, above {ACCURACY:.0e}: at "
        f"the load parameter {cantilever.load_parameter:.3g} the curvature at the root is too large",
        tuple(changes),
    )


def _solve_shape(rod: PlanarRod, n: int) -> RodShape:
    grid = _make_grid(n)
    phi = _solve_rotations(rod, grid)
    curvature = _integrate_to_tip(grid.coefficients @ rod.bending(grid.s, phi))
    axial, transverse = (_integrate_from_root(grid.coefficients @ rate) for rate in rod.strain(grid.s, phi))
    return RodShape(_integrate_from_root(curvature), curvature, axial, transverse)


def _solve_rotations(rod: PlanarRod, grid: Grid) -> Array:
    phi = np.full(len(grid.s), np.pi / 2)
    steps: list[float] = []
    for _ in range(NEWTON_STEPS):
        residual = phi - grid.G @ rod.bending(grid.s, phi)
        J = np.eye(len(phi)) - grid.G * rod.bending_slope(grid.s, phi)  # (n, n)
        step: Array = np.asarray(np.linalg.solve(J, residual), dtype=float)
        phi = phi - step
        steps.append(float(np.abs(step).max()) / max(float(np.abs(phi).max()), SMALLEST))
        if steps[-1] <= 1e-8:  # the next step would be its square, below rounding
            return phi
    raise NotSolved(f"Newton's method did not converge in {NEWTON_STEPS} iterations", tuple(steps))


def _check_slope_range(shape: RodShape, changes: list[float]) -> None:
    """Raise NotSolved unless the slope is in the range of uniqueness, 0 to pi/2, which a coarse grid may overshoot."""
    phi = _chebyshev_value(np.linspace(-1, 1, 401), shape.phi)
    if phi.min() < -ACCURACY or phi.max() > np.pi / 2 + ACCURACY:
        raise NotSolved("the rotation exceeds the angle between the axis and gravity", tuple(changes))


@lru_cache(maxsize=len(RESOLUTIONS))
def _make_grid(n: int) -> Grid:
    z = -np.cos(np.pi * (np.arange(n) + 0.5) / n)
    T = np.polynomial.chebyshev.chebvander(z, n - 1)  # (n, n)
    coefficients = T.T * np.where(np.arange(n) == 0, 1.0, 2.0)[:, None] / n  # discrete orthogonality
    G = _chebyshev_value(z, _integrate_from_root(_integrate_to_tip(coefficients))).T
    return Grid((1 + z) / 2, coefficients, G)


def _integrate_to_tip(g: Array) -> Array:
    """Return the Chebyshev series of the integral of the series g from s to 1."""
    return -np.asarray(np.polynomial.chebyshev.chebint(g, lbnd=1, scl=0.5), dtype=float)


def _integrate_from_root(rate: Array) -> Array:
    """Return the Chebyshev series of the integral of the series `rate` from 0 to s."""
    return np.asarray(np.polynomial.chebyshev.chebint(rate, lbnd=-1, scl=0.5), dtype=float)


def _chebyshev_value(z: Array, series: Array) -> Array:
    return np.asarray(np.polynomial.chebyshev.chebval(z, series), dtype=float)


def _largest_change(coarse: RodShape, fine: RodShape) -> tuple[float, float]:
    """Return the largest difference between two shapes, and the largest value, both scaled by the length."""
    s = (1 - np.cos(np.linspace(0, np.pi, 401))) / 2  # denser at the ends, where a stiff load bends the rod
    values = fine.at(s)
    return float(np.abs(coarse.at(s) - values).max()), float(np.abs(values).max())


def _make_centre_line(shape: RodShape, cantilever: Cantilever, error: float) -> CentreLine:
    L = cantilever.length

    def along(series: Array, scale: float) -> np.polynomial.Chebyshev:
        return np.polynomial.Chebyshev(scale * series, domain=[0, L])

    return CentreLine(
        cantilever,
        axial=along(shape.axial, L),
        transverse=along(shape.transverse, L),
        rotation=along(shape.phi, 1.0),
        root_curvature=float(_chebyshev_value(np.array([-1.0]), shape.curvature)[0]) / L,
        estimated_error=error * L,
    )
