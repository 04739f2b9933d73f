"""Round inclusion or hole (the core) in a round body under uniform remote stress: a closed form for any size.

The tractions T n at the border of the body, of radius b, are those of a uniform stress T. With b infinite the solutions
are the sphere of Goodier (1933) and Eshelby (1957) and the hole of Kirsch (1898). With b finite the same functions of
the radius satisfy two more conditions, so that a body of finite size also has an exact solution, and the effect of its
size is known. In n dimensions, 2 or 3, with m = tr T / n, S = T - m I, q = x.S x, and r in units of the core's radius:

    u = P x / (n lam + 2 mu) + C x / r^n   of the mean m,       u = F(r) S x + G(r) q x   of the deviator S,
    F = sum c f r^p, G = sum c g r^(p - 2)   over p in 2, 0, -n, -n - 2, of which a core has the first two

with (f, g) from Navier's equation (1 - 2 nu) lap u + grad div u = 0 for each p (`_displacement_modes`). The
coefficients c make displacements and tractions continuous at the core, and the tractions equal to T n at the border of
the body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.straight_cantilever import NotApplicable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

ROUNDING = 16.0 * 2.0**-52  # relative, of a displacement, where equations are well-conditioned
ALONG = 1e-9  # relative to the core's radius: closer points lie on its border
Mode = tuple[int, float, float, float]  # p, f, g and lam (p f + (p + n) g) / mu


@dataclass(frozen=True)
class Hookean:
    """Linear elastic solid; in plane stress `poisson` is the effective in-plane ratio, nu / (1 + nu)."""

    shear_modulus: float  # Pa
    poisson: float  # 1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.shear_modulus) and self.shear_modulus > 0.0):
            raise NotApplicable(f"the shear modulus is {self.shear_modulus:g} Pa", "it must be positive")
        if not -1.0 < self.poisson <= 0.5:
            raise NotApplicable(f"Poisson's ratio is {self.poisson:g}", "it lies between -1 and 0.5")

    def softness(self, n: int) -> float:
        """Return 1 / (n lam + 2 mu), 1/Pa, in n dimensions: 0 for an incompressible solid."""
        return (1.0 - 2.0 * self.poisson) / (2.0 * self.shear_modulus * (1.0 + (n - 2) * self.poisson))


def _displacement_modes(n: int, nu: float) -> tuple[Mode, Mode, Mode, Mode]:
    """Return the four solutions of Navier's equation under a deviatoric stress, as powers p of the radius r.

    p is 2, 0, -n and -n - 2 in n dimensions, for Poisson's ratio nu. The first two solutions are finite at the centre,
    and
    the last two vanish at infinity. F and G of the module docstring are their sums.
    """
    k = 1.0 - 2.0 * nu
    grown = (2.0 * k + 2.0 + n, -k * (2.0 + n) - 2.0)
    return (
        (2, *grown, -2.0 * nu * ((2 + n) * grown[0] + 2.0 * grown[1])),
        (0, 1.0, 0.0, 0.0),
        (-n, 2.0 * k, float(n), -4.0 * n * nu),
        (-n - 2, 2.0, -float(n + 2), 0.0),
    )


@dataclass(frozen=True)
class BodyWithRoundCore:
    """Linear elastic sphere (n = 3) or slice of a cylinder (n = 2) with a round core or hole. SI units.

    Raises NotApplicable for inconsistent values.
    """

    n: int
    core: Hookean | None  # None of a hole
    matrix: Hookean
    inner: float  # m, radius of the core
    outer: float  # m, radius of the body; infinite of an unbounded one
    stress: tuple[float, float, float]  # Pa, from afar: along x, y and z; of a slice along x and y, the third 0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m
    thin: float | None = None  # of a slice in plane stress: Poisson's ratio of the solid itself

    def __post_init__(self) -> None:
        if not 0.0 < self.inner < self.outer:
            raise NotApplicable(
                f"the radii of core and body are {self.inner:g} and {self.outer:g} m",
                "the core must be smaller than the body",
            )
        if not all(map(math.isfinite, self.stress)):
            raise NotApplicable("the remote stress is not finite", "give finite tensions")

    # ------------------------------------------------------------------ coefficients

    @property
    def _mean_stress(self) -> float:
        return sum(self.stress[: self.n]) / self.n

    @cached_property
    def _mean_stress_coefficients(self) -> tuple[float, float, float]:
        """Coefficients of the mean stress: P of the core and of the matrix, Pa, and C of the matrix."""
        stiff = 2.0 * (self.n - 1) * self.matrix.shear_modulus
        soft = self.matrix.softness(self.n)
        if self.core is None:
            share = 1.0 / stiff
        else:
            own = self.core.softness(self.n)
            share = (own - soft) / (1.0 + stiff * own)
        matrix = self._mean_stress / (1.0 - stiff * share * (self.inner / self.outer) ** self.n)
        return matrix * (1.0 - stiff * share), matrix, share * matrix

    @cached_property
    def _deviator_coefficients(self) -> tuple[tuple[tuple[float, Mode], ...], tuple[tuple[float, Mode], ...], float]:
        """Coefficients c of the deviator, 1/Pa, with their modes, for the core and for the matrix.

        The third item is the amplification of rounding errors.
        """
        n, end = self.n, self.outer / self.inner
        mine = [] if self.core is None else list(_displacement_modes(n, self.core.poisson)[:2])
        theirs = _displacement_modes(n, self.matrix.poisson)
        known = [] if math.isfinite(end) else [(0.5 / self.matrix.shear_modulus, theirs[1])]
        sought = [m for m in theirs if m[0] < 0 or not known]
        rows = [_mode_at_radius(m, self.core, 1.0) for m in mine] + [
            -_mode_at_radius(m, self.matrix, 1.0) for m in sought
        ]
        alike = np.array([1.0, 1.0, *[1.0 / self.matrix.shear_modulus] * 2])  # one unit for all rows
        A = (alike * np.array(rows)).T[0 if mine else 2 :]
        right = sum((c * alike * _mode_at_radius(m, self.matrix, 1.0) for c, m in known), np.zeros(4))[
            0 if mine else 2 :
        ]
        if not known:
            border = np.zeros((2, A.shape[1]))
            border[:, len(mine) :] = np.array([_mode_at_radius(m, self.matrix, end)[2:] for m in sought]).T
            A, right = np.vstack([A, border]), np.append(right, [1.0, 0.0])
        widths = np.abs(A).max(axis=0)  # with r^p at the border, which is large where that is far
        heights = np.abs(A / widths).max(axis=1)
        even = A / heights[:, None] / widths
        c = (np.linalg.solve(even, right / heights) / widths).tolist()
        matrix = [*known, *zip(c[len(mine) :], sought, strict=True)]
        return tuple(zip(c, mine, strict=False)), tuple(matrix), float(np.linalg.cond(even))

    # ------------------------------------------------------------------ fields

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        found = np.zeros((len(as_points(X)), 3))
        for some, x, inside in self._points_by_side(X):
            found[some] = self.inner * self._scaled_displacements(x, inside)
        return found

    def fields(self, X: Array) -> tuple[Array, Array]:
        """Return the displacement gradient and the stress, Pa, at points X (n, 3), m, each (n, 3, 3).

        At the border of the core they are those of the side with the larger stress.
        """
        H, sigma = np.zeros((2, len(as_points(X)), 3, 3))
        for some, x, inside in self._points_by_side(X):
            H[some], sigma[some] = self._scaled_gradient_and_stress(x, inside)
        return H, sigma

    def gradient(self, X: Array) -> Array:
        """Return the displacement gradient (n, 3, 3) at points X (n, 3), m."""
        return self.fields(X)[0]

    def stress_at(self, X: Array) -> Array:
        """Return the stress (n, 3, 3), Pa, at points X (n, 3), m."""
        return self.fields(X)[1]

    def on_border(self, X: Array) -> NDArray[np.bool_]:
        """Return whether each of the points X (n, 3), m, lies on the border of the core (n,)."""
        near: NDArray[np.bool_] = np.abs(np.linalg.norm(self._scaled_coordinates(X), axis=1) - 1.0) <= ALONG
        return near if self.core is not None else np.zeros_like(near)

    @property
    def estimated_error(self) -> float:
        """Rounding error of a displacement, m."""
        ends = [self.inner, self.outer if math.isfinite(self.outer) else self.inner]
        far = np.concatenate([r * np.eye(3)[: self.n] for r in ends]) + np.array(self.centre)
        return ROUNDING * self._deviator_coefficients[2] * float(np.abs(self.displacement(far)).max())

    @cached_property
    def size_matters(self) -> float:
        """Relative effect of the body's finite size on the stress at the border of the core.

        It is the largest norm of the difference from an unbounded body, on both sides of the border and over directions
        between the axes, relative to the remote stress.
        """
        if not math.isfinite(self.outer) or not any(self.stress):
            return 0.0
        away, free, most = self._octant_directions, replace(self, outer=math.inf), 0.0
        for inside in self._border_sides:
            apart = (
                self._scaled_gradient_and_stress(away, inside)[1] - free._scaled_gradient_and_stress(away, inside)[1]
            )
            most = max(most, float(np.linalg.norm(apart, axis=(1, 2)).max()))
        return most / math.hypot(*self.stress)

    @cached_property
    def largest_gradient(self) -> float:
        """Largest norm of the displacement gradient at the borders of core and body.

        At the border of the core both sides count.
        """
        ends = [self._scaled_gradient_and_stress(self._octant_directions, inside)[0] for inside in self._border_sides]
        if math.isfinite(self.outer):
            ends.append(self._scaled_gradient_and_stress(self.outer / self.inner * self._octant_directions, False)[0])
        return max(float(np.linalg.norm(H, axis=(1, 2)).max()) for H in ends)

    @property
    def _border_sides(self) -> tuple[bool, ...]:
        """Sides of the core's border that have material, as flags that are true for the inner side.

        A hole has only the outer side.
        """
        return (False,) if self.core is None else (False, True)

    @property
    def _octant_directions(self) -> Array:
        """Unit vectors (k, 3) in directions between the axes."""
        t = np.linspace(0.0, 0.5 * math.pi, 13)
        turn, tilt = (a.ravel() for a in np.meshgrid(t, t if self.n == 3 else t[:1]))
        return np.stack([np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)], axis=1)

    def _scaled_coordinates(self, X: Array) -> Array:
        """Return coordinates (n, 3) from the centre in units of the core's radius; for a slice z is 0."""
        x: Array = (as_points(X) - np.array(self.centre)) / self.inner
        if self.n == 2:
            x[:, 2] = 0.0
        return x

    def _points_by_side(self, X: Array) -> Iterator[tuple[NDArray[np.bool_], Array, bool]]:
        """Yield matrix and core, each with a mask (n,) of its points and their scaled coordinates (k, 3).

        The last item is whether it is the core.
        """
        x, on = self._scaled_coordinates(X), self.on_border(X)
        within = (np.linalg.norm(x, axis=1) < 1.0) & (self.core is not None)
        if on.any():
            outside, inside = (
                np.linalg.norm(self._scaled_gradient_and_stress(x[on], side)[1], axis=(1, 2)) for side in (False, True)
            )
            within[on] = inside > outside
        for side in (False, True):
            some = within == side
            if some.any():
                yield some, x[some], side

    @property
    def _axis_mask(self) -> Array:
        """One for each axis of the problem, zero for the others (3,)."""
        return np.array([1.0, 1.0, float(self.n == 3)])

    def _coefficients_of_side(self, inside: bool) -> tuple[Hookean, float, float, tuple[tuple[float, Mode], ...]]:
        """Return the solid of core or matrix, its P and C of the mean stress, and its c with modes of the deviator."""
        core, matrix, beyond = self._mean_stress_coefficients
        if inside and self.core is not None:
            return self.core, core, 0.0, self._deviator_coefficients[0]
        return self.matrix, matrix, beyond, self._deviator_coefficients[1]

    def _scaled_displacements(self, x: Array, inside: bool) -> Array:
        """Return displacements (k, 3) at scaled points x (k, 3), in units of the core's radius."""
        solid, P, C, modes = self._coefficients_of_side(inside)
        S, r = self._deviator, np.linalg.norm(x, axis=1)
        q = (x**2 @ S)[:, None]
        u = P * solid.softness(self.n) * x
        if C:
            u = u + C * x / r[:, None] ** self.n
        for c, (p, f, g, _) in modes:
            u = u + c * f * _radius_power(r, p)[:, None] * S * x
            if g:
                u = u + c * g * _radius_power(r, p - 2)[:, None] * q * x
        found: Array = u
        return found

    def _scaled_gradient_and_stress(self, x: Array, inside: bool) -> tuple[Array, Array]:
        """Return the displacement gradient and the stress, Pa, (k, 3, 3) each, at scaled points x (k, 3)."""
        solid, P, C, modes = self._coefficients_of_side(inside)
        mu, r, eye = solid.shear_modulus, np.linalg.norm(x, axis=1), np.diag(self._axis_mask)
        H = np.broadcast_to(P * solid.softness(self.n) * eye, (len(x), 3, 3)).copy()
        pressed = np.full(len(x), P - 2.0 * mu * P * solid.softness(self.n))  # lam times the change of volume, Pa
        if C:
            away = x / r[:, None]
            H += (C / r**self.n)[:, None, None] * (eye - self.n * away[:, :, None] * away[:, None, :])
        S = self._deviator
        q, Sx, xx = x**2 @ S, S * x, x[:, :, None] * x[:, None, :]
        for c, (p, f, g, grown) in modes:
            H += c * (f * _radius_power(r, p))[:, None, None] * np.diag(S)
            if p:
                H += c * (f * p * _radius_power(r, p - 2))[:, None, None] * Sx[:, :, None] * x[:, None, :]
            if g:
                whole = 2.0 * x[:, :, None] * Sx[:, None, :] + q[:, None, None] * eye
                H += c * (g * _radius_power(r, p - 2))[:, None, None] * whole
            if g and p != 2:
                H += c * (g * (p - 2) * q * _radius_power(r, p - 4))[:, None, None] * xx
            pressed += c * mu * grown * q * _radius_power(r, p - 2) if grown else 0.0
        sigma = pressed[:, None, None] * eye + mu * (H + H.swapaxes(1, 2))
        if self.n == 2:
            self._set_normal_components(H, sigma, solid)
        return H, sigma

    def _set_normal_components(self, H: Array, sigma: Array, solid: Hookean) -> None:
        """Set the components of H and sigma normal to a slice, as plane strain or plane stress requires."""
        both = sigma[:, 0, 0] + sigma[:, 1, 1]
        if self.thin is None:
            sigma[:, 2, 2] = solid.poisson * both
        else:
            H[:, 2, 2] = -self.thin * both / (2.0 * solid.shear_modulus * (1.0 + self.thin))

    @property
    def _deviator(self) -> Array:
        """Diagonal of the remote stress deviator (3,), Pa."""
        found: Array = (np.array(self.stress) - self._mean_stress) * self._axis_mask
        return found


def _radius_power(r: Array, p: int) -> Array:
    """Return r^p; for p = 0 it is 1, also at the centre."""
    found: Array = r**p if p else np.ones_like(r)
    return found


def _mode_at_radius(mode: Mode, solid: Hookean | None, r: float) -> Array:
    """Return displacements and tractions (4,) of a mode with c = 1 at a radius r, in units of the core's radius.

    With the unit normal m of the sphere of radius r and the deviator S, they are the coefficients of the displacements
    along S m and (m.S m) m, and those of the tractions along both, Pa.
    """
    assert solid is not None
    p, f, g, grown = mode
    mu = solid.shear_modulus
    return np.array([
        r ** (p + 1) * f, r ** (p + 1) * g,
        mu * r**p * ((2 + p) * f + 2.0 * g), mu * r**p * (grown + p * (f + 2.0 * g)),
    ])  # fmt: skip
