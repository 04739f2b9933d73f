"""Saturated porous slab or cylinder between two rigid frictionless plates, sides open (Mandel; Armstrong).

Both have a uniform axial strain e(t), and a lateral displacement u(r) in n = 1 or 2 dimensions. Fluid and solid are
incompressible. The volume strain t = e + r^(1-n) (r^(n-1) u)' then diffuses, t_t = k HA r^(1-n) (r^(n-1) t')', and
lateral equilibrium makes the fluid pressure HA (t - t(a)). On the open side, with g = G / HA and <> the mean over the
section,

    slab: t(a) = 2 g e, mean stress 2 G (2 e - <t>);   cylinder: t(a) = g (e + <t>), mean stress G (3 e - <t>).

In Laplace's domain t is A C(q r/a), C = cosh or I0, q^2 = s a^2 / (k HA), and the poles at q = i x are the roots of

    moved:   slab cos x = 0,                cylinder J0(x) = 2 g J1(x)/x        (Armstrong, Lai and Mow 1984)
    pressed: slab cos x = g sin(x)/x,       cylinder 3 J0(x) = 8 g J1(x)/x      (Mandel 1953)

for plates with a prescribed displacement (moved) or a prescribed force (pressed).
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.diffusion_modes import ModalResponse, count_needed_modes
from softmark.references.prony import Amplitude
from softmark.references.straight_cantilever import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

ROUNDING = 1e-12  # relative, of sums of modes
HALVINGS = 60


@dataclass(frozen=True)
class CompressedPorousBody:
    """Porous slab (`dimension` 1) or cylinder (2) between plates, with an open side, in small strain. SI units.

    The plates approach by the amplitude `driven` times `amount`, m, or they are loaded by it if `force` is true, N. The
    size of the body is its half-width or radius.
    """

    dimension: int
    half: float  # m, half-width of the slab, or radius
    length: float  # m, between the plates
    area: float  # m^2, of the section that the plates press
    root: Vector  # m, of the axis, on the held plate
    axis: Vector  # unit vector, from there to the driven plate
    across: Vector  # unit vector across a slab; of a cylinder it plays no part
    shear: float  # Pa, G of the drained skeleton
    modulus: float  # Pa, HA = lambda + 2 G
    permeability: float  # m^4/(N s)
    force: bool
    amount: float  # N or m along the axis
    driven: Amplitude
    now: float  # s

    @property
    def g(self) -> float:
        """Ratio g = G / HA of shear modulus and confined modulus, below 3/4."""
        return self.shear / self.modulus

    @property
    def time(self) -> float:
        """Diffusion time across the body, s."""
        return self.half**2 / (self.modulus * self.permeability)

    @property
    def _drive_amplitude(self) -> float:
        """Prescribed axial strain, or prescribed mean axial stress over the shear modulus."""
        return self.amount / (self.area * self.shear) if self.force else self.amount / self.length

    @cached_property
    def roots(self) -> Array:
        """Roots x (n,) of the modes."""
        count = count_needed_modes(self.driven, self.now, self.time)
        return find_mode_roots(self.dimension, self.g, self.force, count)

    @cached_property
    def _residue_denominators(self) -> Array:
        """Denominators (n,) of the residues at the poles: -x^2 D'(s)."""
        x, g = self.roots, self.g
        if self.dimension == 1:
            if not self.force:
                return -0.5 * x * np.sin(x)
            return -0.5 * x * (np.sin(x) + g * np.cos(x) / x - g * np.sin(x) / x**2)
        j0, j1 = _mode_functions(2, x)
        a, b = (3.0, 8.0) if self.force else (1.0, 2.0)
        found: Array = -0.5 * (a * x * j1 - b * g * (2.0 * j1 / x - j0))
        return found

    @property
    def _decay_rates(self) -> Array:
        rates: Array = self.roots**2 / self.time
        return rates

    def _volume_strain_response(self, shape: Array, at_once: Array) -> ModalResponse:
        """Return the modal response of k volume strains, from mode shapes (k, n) and instantaneous response (k,)."""
        g = self.g
        if self.dimension == 1:
            part, end = (0.5 * g, 0.5 * g / (1.0 - g)) if self.force else (2.0 * g, 2.0 * g)
        else:
            part, end = (g, g / (3.0 - 4.0 * g)) if self.force else (g, g / (1.0 - g))
        return ModalResponse(np.full(len(shape), end), part * shape / self._residue_denominators, at_once)

    def _axial_strain_response(self) -> ModalResponse:
        """Modal response of the axial strain."""
        one = np.ones(1)
        if not self.force:
            return ModalResponse(one, np.zeros((1, len(self.roots))), one)
        x, g = self.roots, self.g
        if self.dimension == 1:
            return ModalResponse(
                one / (4.0 * (1.0 - g)), (0.25 * np.cos(x) / self._residue_denominators)[None], one / 4.0
            )
        j0, j1 = _mode_functions(2, x)
        share = (j0 - 2.0 * g * j1 / x) / self._residue_denominators
        return ModalResponse(one * (1.0 - g) / (3.0 - 4.0 * g), share[None], one / 3.0)

    def _mode_shapes(self, r: Array) -> Array:
        """Return the mode shapes (k, n) at distances r from the axis or middle plane (k,), m."""
        return _mode_functions(self.dimension, self.roots * (r / self.half)[:, None])[0]

    def _mean_mode_shapes(self, r: Array) -> Array:
        """Return the means (k, n) of the mode shapes over the region within distances r (k,), m."""
        arguments = self.roots * (r / self.half)[:, None]
        small = arguments == 0.0
        safe = np.where(small, 1.0, arguments)
        found: Array = np.where(small, 1.0, self.dimension * _mode_functions(self.dimension, safe)[1] / safe)
        return found

    def _present_response(self, followed: ModalResponse) -> Array:
        return self._drive_amplitude * followed.at(self.driven, self._decay_rates, self.now)

    @property
    def axial(self) -> float:
        """Present axial strain."""
        return float(self._present_response(self._axial_strain_response())[0])

    def _mean_volume_strain(self, r: Array) -> Array:
        """Return the mean volume strain (k,) of the region within distances r (k,), m."""
        return self._present_response(self._volume_strain_response(self._mean_mode_shapes(r), np.zeros_like(r)))

    def _side_volume_strain(self) -> float:
        """Volume strain at the open side."""
        if self.dimension == 1:
            return 2.0 * self.g * self.axial
        return self.g * (self.axial + float(self._mean_volume_strain(np.array([self.half]))[0]))

    def pressure(self, X: Array) -> Array:
        """Return the fluid pressure (n,), Pa, at points X (n, 3), m."""
        r = self._lateral_vectors(as_points(X))[1]
        own = self._present_response(
            self._volume_strain_response(self._mode_shapes(r), np.where(r < self.half, 0.0, np.nan))
        )
        side = self._side_volume_strain()
        found: Array = self.modulus * np.where(r >= self.half, 0.0, own - side)
        return found

    def _lateral_vectors(self, points: Array) -> tuple[Array, Array]:
        """Return the lateral vectors (n, 3), m, from axis or middle plane to points (n, 3), and their lengths (n,)."""
        off = points - np.asarray(self.root)
        if self.dimension == 1:
            n = np.asarray(self.across)
            away: Array = (off @ n)[:, None] * n
        else:
            n = np.asarray(self.axis)
            away = off - (off @ n)[:, None] * n
        return away, np.sqrt((away**2).sum(axis=1))

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        points = as_points(X)
        n, e = np.asarray(self.axis), self.axial
        away, r = self._lateral_vectors(points)
        grows = (self._mean_volume_strain(r) - e) / self.dimension
        along = (points - np.asarray(self.root)) @ n
        found: Array = e * along[:, None] * n + grows[:, None] * away
        return found

    @property
    def pull(self) -> float:
        """Present force on the driven plate along the axis, N."""
        if self.force:
            return self.amount * self.driven.hereditary_integral(0.0, self.now)
        e, mean = self.axial, float(self._mean_volume_strain(np.array([self.half]))[0])
        stress = 2.0 * (2.0 * e - mean) if self.dimension == 1 else 3.0 * e - mean
        return self.area * self.shear * stress

    @property
    def lost(self) -> float:
        """Volume of fluid that has left since the start, m^3."""
        return -self.area * self.length * float(self._mean_volume_strain(np.array([self.half]))[0])

    @property
    def estimated_error(self) -> float:
        """Error of a displacement, m, due to modes beyond the last and to rounding."""
        swells = self._volume_strain_response(self._mean_mode_shapes(np.array([self.half])), np.zeros(1))
        missed = [f.missed(self.driven, self._decay_rates, self.now) for f in (swells, self._axial_strain_response())]
        size = abs(self._drive_amplitude) / (3.0 if self.force else 1.0)
        return abs(self._drive_amplitude) * (self.half * sum(missed) + self.length * missed[1]) + ROUNDING * size * (
            self.length + self.half
        )

    @property
    def strained(self) -> float:
        """Magnitude of the axial strain in the final equilibrium under the full force or displacement."""
        return abs(self._drive_amplitude) * float(np.abs(self._axial_strain_response().lasting[0]))


def find_mode_roots(dimension: int, g: float, force: bool, count: int) -> Array:
    """Return the first `count` positive roots x (count,) of the poles.

    For a cylinder the equation is x J0(x) / J1(x) = b g / a, whose left side falls from 2 to minus infinity between two
    zeros of J1. For a slab it is x cot x = g or 0, whose left side falls from 1 between two zeros of sin x. Each
    interval contains one root. The first interval contains one if the right side is below 2 or 1.
    """
    if dimension == 1:
        ends = np.pi * np.arange(count + 1)
        right = g if force else 0.0
    else:
        ends = np.concatenate([[0.0], _bessel_zeros(count)])
        right = 8.0 * g / 3.0 if force else 2.0 * g
    low, high = ends[:-1] + 1e-13, ends[1:] * (1.0 - 1e-15)
    sign = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)  # of sin x or J1 within the interval
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        even, odd = _mode_functions(dimension, middle)
        positive = sign * (middle * even - right * odd) > 0.0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    found: Array = 0.5 * (low + high)
    return found


def _bessel_zeros(count: int) -> Array:
    """Return the zeros of J1 (count,): the first ones from a table, later ones by McMahon's expansion."""
    from scipy.special import jn_zeros

    exact = min(count, 200)
    b = np.pi * (np.arange(1, count + 1) + 0.25)
    far: Array = b - 3.0 / (8.0 * b) + 3.0 / (128.0 * b**3) - 1179.0 / (5120.0 * b**5)
    far[:exact] = jn_zeros(1, exact)
    return far


def _mode_functions(dimension: int, x: Array) -> tuple[Array, Array]:
    """Return cos x and sin x for a slab, or J0(x) and J1(x) for a cylinder."""
    if dimension == 1:
        return np.cos(x), np.sin(x)
    from scipy.special import j0, j1

    return j0(x), j1(x)
