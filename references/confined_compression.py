"""Confined compression of a porous column in finite strain along one axis, by collocation."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.elastica_collocation import NotSolved
from softmark.references.porous_skeletons import Skeleton
from softmark.references.prony import Amplitude
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable
from softmark.references.terzaghi import ConfinedColumn

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

POINTS = (40, 64)  # collocation points of the coarser and of the returned solution
TOLERANCES = (1e-6, 1e-8)  # relative, of the integration in time, of both
KEPT = 64  # solutions that are remembered: a column at one time after another
ROUNDING = 1e-13
SURE = 0.01  # relative difference of the two solutions in travel and force


@dataclass(frozen=True)
class Permeability:
    """Permeability k = k0 ((J - s)/(1 - s))^exponent exp(stiffening (J^2 - 1)/2), m^4/(N s) (Holmes and Mow 1990).

    J is the volume ratio, k0 the permeability `at_rest`, and s the volume fraction of the `solid`.
    """

    at_rest: float
    exponent: float = 0.0
    stiffening: float = 0.0
    solid: float = 0.0

    def at(self, J: Array) -> Array:
        """Return the permeability (n,), m^4/(N s), at volume ratios J (n,); NaN if no pores are left."""
        pores = np.where(self.solid < J, J - self.solid, np.nan) / (1.0 - self.solid)
        found: Array = self.at_rest * pores**self.exponent * np.exp(0.5 * self.stiffening * (J * J - 1.0))
        return found


@dataclass(frozen=True)
class DrainingLayer:
    """Part of a porous column between an impermeable plane and its open end, in one dimension.

    Lengths are relative to the height h; other quantities are in SI. With u the displacement and J = 1 + u_Y the
    stretch, the outflow of fluid gives u_t = k(J)/J P(J)_Y / h^2, where P is the stress of the skeleton. The fluid
    pressure is P minus the total stress, and the total stress equals P at the open end. The displacement or the stress
    of the open end is prescribed.
    """

    height: float  # m
    skeleton: Skeleton
    permeability: Permeability
    force: bool
    amount: float  # Pa, or of the height
    driven: Amplitude

    def consolidation_coefficient(self, J: Array) -> Array:
        """Return the consolidation coefficient k P' / (J h^2) at stretches J (n,), 1/s."""
        found: Array = self.permeability.at(J) * self.skeleton.slope(J) / (J * self.height**2)
        return found

    @property
    def size(self) -> float:
        """Typical magnitude of displacements, relative to the height."""
        moved = self.skeleton.stretch(self.amount) - 1.0 if self.force else self.amount
        return min(1.0, abs(moved)) or 1.0

    def end_condition(self, t: float) -> float:
        """Return the displacement of the open end at time t, s, or its stretch if a force is prescribed."""
        share = self.amount * self.driven.hereditary_integral(0.0, t)
        return self.skeleton.stretch(share) if self.force else share


def chebyshev_matrix(count: int) -> tuple[Array, Array]:
    """Return n Chebyshev points Y (n,) from 0 to 1, and their differentiation matrix (n, n).

    Source: Trefethen 2000, "Spectral Methods in MATLAB", chapter 6.
    """
    n = count - 1
    x = np.cos(np.pi * np.arange(count) / n)
    c = np.where((np.arange(count) == 0) | (np.arange(count) == n), 2.0, 1.0) * (-1.0) ** np.arange(count)
    apart = 2.0 * np.sin(0.5 * np.pi * (np.arange(count)[:, None] + np.arange(count)) / n)
    apart *= np.sin(
        0.5 * np.pi * (np.arange(count) - np.arange(count)[:, None]) / n
    )  # x_i - x_j without loss of digits
    D = np.outer(c, 1.0 / c) / (apart + np.eye(count))
    D -= np.diag(D.sum(axis=1))
    return 0.5 * (1.0 - x), -2.0 * D


@dataclass(frozen=True)
class CollocatedLayer:
    """Equation of a draining layer, collocated at Chebyshev points.

    The unknowns are the displacements u (n - 2,) between the ends. The displacement at the impermeable plane is zero.
    """

    layer: DrainingLayer
    count: int

    @cached_property
    def _collocation_matrices(self) -> tuple[Array, Array, Array]:
        Y, D = chebyshev_matrix(self.count)
        return Y, D, D @ D

    def whole(self, t: float, inner: Array) -> Array:
        """Return the displacements u (n,) at all points at time t, s, from those between the ends, `inner`."""
        _, D, _ = self._collocation_matrices
        end = self.layer.end_condition(t)
        if self.layer.force:  # u_Y there is given
            end = (end - 1.0 - float(D[-1, 1:-1] @ inner)) / D[-1, -1]
        return np.concatenate([[0.0], inner, [end]])

    def rate(self, t: float, inner: Array) -> Array:
        """Return the rate of displacement u_t between the ends (n - 2,), 1/s."""
        _, D, D2 = self._collocation_matrices
        u = self.whole(t, inner)
        found: Array = (self.layer.consolidation_coefficient(1.0 + D @ u) * (D2 @ u))[1:-1]
        return found

    def jacobian(self, t: float, inner: Array) -> Array:
        """Return the derivative of the rate by the unknowns (n - 2, n - 2), 1/s."""
        _, D, D2 = self._collocation_matrices
        u = self.whole(t, inner)
        J = 1.0 + D @ u
        h = 1e-6
        steeper = (self.layer.consolidation_coefficient(J + h) - self.layer.consolidation_coefficient(J - h)) / (
            2.0 * h
        )
        by_u = self.layer.consolidation_coefficient(J)[:, None] * D2 + (steeper * (D2 @ u))[:, None] * D
        found: Array = by_u[1:-1, 1:-1].copy()
        if self.layer.force:
            found -= np.outer(by_u[1:-1, -1], D[-1, 1:-1] / D[-1, -1])
        return found


@dataclass(frozen=True)
class Profile:
    """Displacements u (n,) of a layer at its Chebyshev points, relative to its height."""

    u: Array

    def at(self, Y: Array) -> tuple[Array, Array]:
        """Return displacement and stretch (k,) each at positions Y (k,) from 0 to 1, by polynomial interpolation."""
        n = len(self.u)
        points, D = chebyshev_matrix(n)
        weights = np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 0.5, 1.0) * (-1.0) ** np.arange(n)
        off = Y[:, None] - points
        hit = np.abs(off) < 1e-14
        terms = weights / np.where(hit, 1.0, off)
        rows = np.where(hit.any(axis=1, keepdims=True), hit.astype(float), terms)
        rows /= rows.sum(axis=1, keepdims=True)
        return rows @ self.u, rows @ (1.0 + D @ self.u)


@lru_cache(maxsize=KEPT)
def integrate(layer: DrainingLayer, which: int, breaks: tuple[float, ...]) -> Profile:
    """Return the displacements of a layer at the last of the times `breaks`, s, ascending from 0.

    The equation is integrated from each of these times to the next. `which` selects the coarser (0) or the finer (1)
    solution. Raises NotSolved.
    """
    from scipy.integrate import solve_ivp

    own, tolerance = CollocatedLayer(layer, POINTS[which]), TOLERANCES[which]
    if len(breaks) < 2:
        return Profile(own.whole(breaks[-1], np.zeros(own.count - 2)))
    before = integrate(layer, which, breaks[:-1])
    begin, end = breaks[-2:]
    inside = 0.5 * (begin + end)

    def inwards(t: float) -> float:  # at a jump the course is that of the side on which the integration is
        return min(max(t, math.nextafter(begin, inside)), math.nextafter(end, inside))

    def known(t: float, values: Array) -> Array:
        if not np.isfinite(values).all():
            raise NotSolved(
                f"at {t:.6g} s the pores at the open end are closed, or the law is undefined at that stretch", (t,)
            )
        return values

    with np.errstate(all="ignore"):
        found = solve_ivp(
            lambda t, y: own.rate(inwards(t), y), (begin, end), before.u[1:-1], method="Radau", rtol=tolerance,
            jac=lambda t, y: known(t, own.jacobian(inwards(t), y)), atol=0.1 * tolerance * layer.size,
        )  # fmt: skip
    if found.status != 0:
        raise NotSolved(f"the time integration stopped at {found.t[-1]:.6g} s: {found.message}", (begin, end))
    return Profile(own.whole(end, known(end, found.y[:, -1])))


@dataclass(frozen=True)
class PressedColumn(ConfinedColumn):
    """Porous column of one material in finite strain, held at one end and moved or loaded along its axis. SI units.

    `amount` is the displacement of the driven end along the axis, m, or its nominal stress, Pa; `times` are the output
    times up to `now`, s. Raises NotApplicable if the material law loses stability in confined compression, or if the
    end is displaced instantaneously.
    """

    skeleton: Skeleton
    permeability: Permeability
    force: bool
    amount: float
    driven: Amplitude
    now: float  # s
    times: tuple[float, ...] = ()  # s

    def __post_init__(self) -> None:
        if not self.force and any(size for _, size in self.driven.jumps):
            raise NotApplicable(
                "the end is displaced instantaneously",
                "the boundary layer there would have no thickness: use `amplitude = ramp(...)`",
            )

    @cached_property
    def layer(self) -> DrainingLayer:
        """Layer that is solved: the whole column, or one of two equal halves."""
        amount = self.amount if self.force else self.amount / self.length
        course = Amplitude(tuple(self.driven.jumps), tuple(self.driven.swings))  # that solutions are remembered by
        return DrainingLayer(self.longest_drainage_path, self.skeleton, self.permeability, self.force, amount, course)

    def profile(self, which: int = 1) -> Profile:
        """Return the present displacements from the coarser (`which` = 0) or the finer solution (1)."""
        ends = {at for s in self.driven.swings for at in (s.begin, s.end)} | {at for at, _ in self.driven.jumps}
        breaks = sorted({0.0, self.now, *(t for t in (*ends, *self.times) if 0.0 < t < self.now)})
        return integrate(self.layer, which, tuple(breaks))

    def _displacements_and_stretches(self, y: Array, which: int = 1) -> tuple[Array, Array]:
        """Return displacements away from the impermeable plane (k,), m, and stretches (k,).

        They are evaluated at distances y (k,), m, from the plane.
        """
        u, J = self.profile(which).at(np.clip(y / self.longest_drainage_path, 0.0, 1.0))
        return self.longest_drainage_path * u, J

    def _outward(self, y: Array) -> Array:
        return self._displacements_and_stretches(y)[0]

    def pressure(self, X: Array) -> Array:
        """Return the fluid pressure (n,), Pa, at points X (n, 3), m."""
        y, _, _ = self._impermeable_plane_distances(X)
        _, J = self._displacements_and_stretches(y)
        found: Array = self.skeleton.stress(J) - self._total_stress()
        return found

    def _total_stress(self, which: int = 1) -> float:
        """Return the total stress of skeleton and fluid, Pa, which is the stress of the skeleton at the open end."""
        if self.force:
            return self.amount * self.driven.hereditary_integral(0.0, self.now)
        _, J = self._displacements_and_stretches(np.array([self.longest_drainage_path]), which)
        return float(self.skeleton.stress(J)[0])

    @property
    def pull(self) -> float:
        """Present force on the driven end along the axis, N."""
        return self.area * self._total_stress()

    @cached_property
    def estimated_error(self) -> float:
        """Error of a displacement, m: the difference from a solution on a coarser grid with larger time steps."""
        y = np.linspace(0.0, self.longest_drainage_path, 33)
        apart = float(
            np.abs(self._displacements_and_stretches(y)[0] - self._displacements_and_stretches(y, 0)[0]).max()
        )
        return apart * (2.0 if self.drains == "both" else 1.0) + ROUNDING * self.length

    @property
    def pull_error(self) -> float:
        """Error of the force, N: the difference from a solution on a coarser grid with larger time steps."""
        return self.area * abs(self._total_stress() - self._total_stress(0))


@dataclass(frozen=True)
class Confined(Reference):
    """Confined compression of a porous column by one-dimensional equations of finite strain.

    u_t = k(J)/J dP(J)/dX with J = 1 + u_X: the outflow of fluid equals the volume loss of the column, P is the stress
    of the drained skeleton in confined compression and k constant or that of Holmes and Mow. Solved at Chebyshev points
    and by Radau's method in time; the error is the difference from a coarser solution. Displacement by any amplitude of
    ramps, smooth ramps, sines and tables, or a traction, also instantaneous. It applies to the same cases as
    `terzaghi`, with `neo_hookean`, `neo_hookean_isochoric`, `stable_neo_hookean`, `st_venant_kirchhoff` or rubber with
    a bulk modulus (`mooney_rivlin`, `ogden`, `yeoh`, `gent`, `fung`, `veronda_westmann`, `arruda_boyce`). It can be
    compared with the metrics `displacement`, `force`, `pore_pressure` and `outflow`.
    Source: Holmes 1986, J. Biomech. Eng. 108:372; Holmes and Mow 1990, J. Biomech. 23:1145; Trefethen 2000, "Spectral
    Methods in MATLAB", chapter 6.
    """

    body: Annotated[Any, "body", "the column"]

    problem_kind: ClassVar[str] = "finite_porous_column"
    means: ClassVar[str] = "collocation in one dimension"
    source: ClassVar[str] = "Holmes 1986, J. Biomech. Eng. 108:372; Holmes and Mow 1990, J. Biomech. 23:1145"
    error_meaning: ClassVar[str] = "difference of the displacement from a coarser solution, m"

    def solve(self, column: PressedColumn) -> PressedColumn:
        """Return the column, integrated immediately. Raises NotSolved, also if its two solutions differ too much."""
        away, off = column.estimated_error, column.pull_error
        if away > SURE * abs(column.travel) or off > SURE * abs(column.pull):
            raise NotSolved(
                "two solutions differ too much: the boundary layer at the open end is too thin", (away, off)
            )
        return column
