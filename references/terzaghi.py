"""Terzaghi's consolidation: a saturated porous column loaded along its axis without lateral expansion."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.diffusion_modes import ModalResponse, count_needed_modes, require_convergence
from softmark.references.prony import Amplitude
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

ROUNDING = 1e-13  # relative, of sums of modes
Drains = Literal["driven", "held", "both"]  # which ends are open


@dataclass(frozen=True)
class ConfinedColumn:
    """Base class of laterally confined porous columns with one held and one driven end. SI units.

    The columns are drained at one end or at both.
    """

    length: float  # m
    area: float  # m^2
    root: Vector  # m, the centre of the held end
    axis: Vector  # unit vector, from there to the driven one
    drains: Drains

    @property
    def longest_drainage_path(self) -> float:
        """Longest drainage path, m."""
        return 0.5 * self.length if self.drains == "both" else self.length

    def _outward(self, y: Array) -> Array:
        """Return displacements (k,) away from the impermeable plane, m, at distances y (k,) from it."""
        raise NotImplementedError(f"{type(self).__name__} does not say how it moves")

    def _impermeable_plane_distances(self, X: Array) -> tuple[Array, Array, bool]:
        """Return distances from the impermeable plane (n,), m, signs (n,), and whether the plane moves.

        They are those of points X (n, 3), m. The plane is the held end, the driven end, or the middle between two
        drained ends. With w the displacement away from the plane, the axial displacement of a point is its sign times
        w. If the plane moves, the displacement of the plane is added, which is w at the open end. Raises
        NotApplicable for invalid points.
        """
        z = (as_points(X) - np.asarray(self.root)) @ np.asarray(self.axis)
        if self.drains == "driven":
            return z, np.ones_like(z), False
        if self.drains == "held":
            return self.length - z, -np.ones_like(z), True
        return np.abs(z - 0.5 * self.length), np.sign(z - 0.5 * self.length), True

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        y, sign, moves = self._impermeable_plane_distances(X)
        w = self._outward(np.append(y, self.longest_drainage_path))
        found: Array = (sign * w[:-1] + (w[-1] if moves else 0.0))[:, None] * np.asarray(self.axis)
        return found

    @property
    def travel(self) -> float:
        """Present displacement of the driven end, m."""
        w = self._outward(np.array([self.longest_drainage_path]))
        return float(w[0]) * (2.0 if self.drains == "both" else 1.0)

    @property
    def lost(self) -> float:
        """Volume of fluid that has left since the start, m^3."""
        return -self.area * self.travel


@dataclass(frozen=True)
class Column(ConfinedColumn):
    """Porous column, held at one end along its axis and loaded at the other by a plate. SI units.

    The plate is porous or impermeable. Strain is small and axial only. The fluid pressure p diffuses along the axis z:
    p_t = c p_zz - sigma_t, where subscripts denote derivatives, c = k HA with permeability k and drained confined
    modulus HA, and sigma = HA u_z - p is the uniform total stress. Under a prescribed force, the drainage path is an
    odd multiple of a quarter wavelength of each mode. Under a prescribed displacement, u_t = c u_zz between two
    prescribed ends, and the path is a multiple of half a wavelength.
    """

    modulus: float  # Pa, HA = lambda + 2 mu of the drained skeleton
    permeability: float  # m^4/(N s)
    force: bool
    amount: float  # N or m along the axis, of the driven end
    driven: Amplitude
    now: float  # s

    @property
    def time(self) -> float:
        """Diffusion time along the longest drainage path, s."""
        return self.longest_drainage_path**2 / (self.modulus * self.permeability)

    @cached_property
    def _wave_numbers(self) -> Array:
        """Wave numbers of the modes times the longest drainage path (n,)."""
        count = count_needed_modes(self.driven, self.now, self.time, kinks=not self.force)
        first = 0.5 if self.force else 1.0
        found: Array = np.pi * np.linspace(first, first + count - 1.0, count)
        return found

    @property
    def _decay_rates(self) -> Array:
        rates: Array = self._wave_numbers**2 / self.time
        return rates

    @property
    def _final_strain(self) -> float:
        """Axial strain in the final equilibrium under the full force or displacement."""
        return self.amount / (self.area * self.modulus) if self.force else self.amount / self.length

    def _displacement_response(self, y: Array) -> ModalResponse:
        """Return the response of the modes as displacements, m, away from the impermeable plane.

        The displacements are those at distances y (k,), m, from this plane.
        """
        M, h = self._wave_numbers, self.longest_drainage_path
        sign = np.where(np.arange(len(M)) % 2 == 0, 1.0, -1.0)
        shape = np.sin(M * (y / h)[:, None])
        shares = -shape * (2.0 * sign / M**2) if self.force else -shape * (2.0 * sign / M)
        at_once = np.zeros_like(y) if self.force else np.where(y >= h, h, 0.0)
        return ModalResponse(self._final_strain * y, self._final_strain * h * shares, self._final_strain * at_once)

    def _outward(self, y: Array) -> Array:
        return self._displacement_response(y).at(self.driven, self._decay_rates, self.now)

    def pressure(self, X: Array) -> Array:
        """Return the fluid pressure (n,), Pa, at points X (n, 3), m."""
        y, _, _ = self._impermeable_plane_distances(X)
        M, none = self._wave_numbers, np.zeros_like(y)
        sign = np.where(np.arange(len(M)) % 2 == 0, 1.0, -1.0)
        shape = np.cos(M * (y / self.longest_drainage_path)[:, None])
        inside = np.where(y < self.longest_drainage_path, 1.0, 0.0)
        shares = -shape * (2.0 * sign / M) if self.force else -2.0 * (shape * sign + 1.0)
        scale = self.modulus * self._final_strain
        moments = None if self.force else 0.5 * scale * self.time * ((y / self.longest_drainage_path) ** 2 - 1.0)
        own = ModalResponse(none, scale * shares, -scale * inside if self.force else none, moments)
        return own.at(self.driven, self._decay_rates, self.now)

    @property
    def pull(self) -> float:
        """Present force on the driven end along the axis, N."""
        if self.force:
            return self.amount * self.driven.hereditary_integral(0.0, self.now)
        modes = ModalResponse(
            np.ones(1), np.full((1, len(self._wave_numbers)), 2.0), np.zeros(1), np.full(1, self.time / 3.0)
        )
        return (
            self.area * self.modulus * self._final_strain * float(modes.at(self.driven, self._decay_rates, self.now)[0])
        )

    @property
    def estimated_error(self) -> float:
        """Error of a displacement, m, due to modes beyond the last and to rounding."""
        places = np.linspace(0.0, self.longest_drainage_path, 9)[1:]
        missed = self._displacement_response(places).missed(self.driven, self._decay_rates, self.now)
        return missed + ROUNDING * abs(self._final_strain) * self.length

    @property
    def strained(self) -> float:
        """Magnitude of the axial strain in the final equilibrium under the full force or displacement."""
        return abs(self._final_strain)


@dataclass(frozen=True)
class Terzaghi(Reference):
    """Consolidation of a saturated porous column, laterally confined and loaded along its axis, in small strain.

    Fluid and solid are incompressible, so that the fluid carries a load at first; it leaves through the open ends, and
    the column settles as the pressure diffuses, c = k HA with the drained modulus of confined compression. It is a sum
    over modes for any amplitude of ramps, smooth ramps, sines, pulses, tables and steps, of the force or of the travel:
    settlement (creep), relaxation (Mow 1980), fluid pressure. It applies to a box, a cylinder, or a plane or revolved
    rectangle of one `biphasic(...)` material; its sides held across them and sealed, one end held along the axis, the
    other displaced along it or under a `traction`, and one end or both `drained`; and a `quasistatic` analysis. It can
    be compared with the metrics `displacement`, `force`, `pore_pressure` and `outflow`.
    Source: Terzaghi 1923; Verruijt 2016, "Theory and Problems of Poroelasticity", chapter 2; Mow, Kuei, Lai and
    Armstrong 1980, J. Biomech. Eng. 102:73.
    """

    body: Annotated[Any, "body", "the column"]

    problem_kind: ClassVar[str] = "porous_column"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Terzaghi 1923; Mow, Kuei, Lai and Armstrong 1980, J. Biomech. Eng. 102:73"
    error_meaning: ClassVar[str] = "omitted modes and rounding of the displacement, m"

    def solve(self, column: Column) -> Column:
        """Return the column itself, whose class contains the sums over modes. Raises NotSolved just after a jump."""
        require_convergence(column.driven, column.now, column.time, moved=not column.force)
        return column
