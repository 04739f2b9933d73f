"""Coulomb friction between a deformable surface and a rigid body, by return mapping with an elastic stick spring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import RigidMotion
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

if TYPE_CHECKING:
    from softmark.solvers.contact.surface_points import AddedContactPoints

Bools = NDArray[np.bool_]
PRESSED = 1e-6  # of the largest pressure: what is less is no contact
TINY = 1e-300  # m: a slip of which the direction is not asked


@dataclass(frozen=True)
class LaggedFriction:
    """Friction limits and normals of an earlier iterate, with which friction has an energy.

    `most` (m,) is friction times pressure, Pa; `n` (m, 3) are normals.
    """

    most: Floats
    n: Floats


class DualTractions:
    """Dual variable of the friction tangent: tractions t (m, 3), Pa, predicted by the iterate before.

    The law times its denominator, w t = most s with w = max(|s|, most / k), is smooth enough to be linearised: a node
    that has just begun to slide keeps some stiffness along its slip (Chan, Golub and Mulet 1999, SIAM J. Sci. Comput.
    20:1964, eq. 4.6). Near the solution t is the traction, and the tangent is exact.
    """

    def __init__(self) -> None:
        self.known: tuple[Floats, Floats, Floats, Floats] | None = None  # s, t, u, w of the iterate before

    def at(self, s: Floats, size: Floats, most: Floats, spring: float | Floats) -> Floats:
        """Return the tractions (m, 3) for a tangent at slips s (m, 3), m, and store them for the next."""
        w = np.maximum(np.maximum(size, most / spring), TINY)
        u = np.where((spring * size > most)[:, None], s / np.maximum(size, TINY)[:, None], 0.0)
        if self.known is None:
            t = most[:, None] * s / w[:, None]
        else:
            s0, t0, u0, w0 = self.known
            t = (most[:, None] * s - t0 * np.einsum("ij,ij->i", u0, s - s0)[:, None]) / w0[:, None]
            t *= np.minimum(1.0, most / np.maximum(np.linalg.norm(t, axis=1), TINY))[:, None]
        self.known = s, t, u, w
        return t


@dataclass(frozen=True)
class Slip:
    """Slip of points relative to their anchors.

    `s` (m, 3) is the slip along the surface, m, `size` (m,) its length, `t` (m,) the opposing traction, Pa, `slides`
    (m,) whether that is the friction limit, and `spring` the stick stiffness, Pa/m.
    """

    s: Floats
    size: Floats
    t: Floats
    slides: Bools
    spring: Floats | float

    @classmethod
    def of(cls, s: Floats, most: Floats, spring: Floats | float) -> Slip:
        """Return the slip state of slips s (m, 3), m, with friction limits `most` (m,), Pa."""
        size = np.linalg.norm(s, axis=1)
        elastic = spring * size
        return cls(s, size, np.minimum(elastic, most), elastic > most, spring)

    def along(self, f: Floats) -> Floats:
        """Return vectors with magnitudes f (m,) along the slips (m, 3)."""
        found: Floats = (f / np.maximum(self.size, TINY))[:, None] * self.s
        return found

    @property
    def stretched(self) -> Floats:
        """Elastic part of the slip (m,), m."""
        return self.t / self.spring

    @property
    def slid(self) -> Floats:
        """Sliding distance of points since they last stuck (m,), m."""
        return np.where(self.t > 0.0, np.maximum(self.size - self.stretched, 0.0), 0.0)

    @property
    def energy(self) -> Floats:
        """Energy with lagged limits (m,), J/m^2: elastic energy, and work of sliding."""
        return self.t * (self.size - 0.5 * self.stretched)


@dataclass(frozen=True)
class RigidFriction(RigidContact):
    """Rigid contact with friction: traction -k s at points, s their slip from anchors along the surface, or -mu p
    s/|s|.

    It is elastic and perfectly plastic, by return mapping (Simo and Laursen 1992; Wriggers 2006, ch. 5). `anchors` (p,
    3) are points of the rigid body: they move with it, and are constant within a state; a state ends with those of
    `settled`. The `spring` k, Pa/m, lets a sticking point move by mu p / k at most, less than the barrier distance.
    With the present p there is a force and an unsymmetric tangent, but no energy; with a `lag`, from an earlier
    iterate, there are both.
    """

    friction: float = 0.0
    spring: float = 0.0
    carries: Callable[[float], RigidMotion] = lambda share: RigidMotion()
    anchors: Floats | None = None  # (p, 3) m, in the body as it is declared; None: where the points are at rest
    lag: LaggedFriction | None = None
    dual: DualTractions | None = None
    conservative: bool = False
    gone: Floats | float = 0.0  # (p,) m: how far points had slid before

    each: ClassVar[tuple[str, ...]] = ("sunk", "anchors", "gone")

    def joining(self, extra: AddedContactPoints | None, x: Floats) -> Self:
        """Return the contact with other added points: new ones are anchored where they were, known ones keep their
        slip.
        """
        found = super().joining(extra, x)
        if self.anchors is None or found.anchors is None or extra is None:
            return found
        pose, new = getattr(self.earlier, "pose", RigidMotion()), found.lasting
        anchors, gone = found.anchors.copy(), np.broadcast_to(found.gone, len(found.A)).copy()
        there = anchors[new:] = pose.back(found.places(x)[new:])
        if self.extra is not None:
            _, i, j = np.intersect1d(self.extra.which, extra.which, return_indices=True)
            before = pose.back(self.places(x)[new:])
            anchors[new + j] = self.anchors[new + i] + there[j] - before[i]
            gone[new + j] = np.broadcast_to(self.gone, len(self.A))[new + i]
        return replace(found, anchors=anchors, gone=gone)

    @property
    def rubs(self) -> bool:
        """True if friction follows the present pressure (without a lag), so that there is no energy."""
        return self.lag is None

    @cached_property
    def pose(self) -> RigidMotion:
        """Present position and orientation of the rigid body."""
        return self.carries(self.share)

    @cached_property
    def held(self) -> Floats:
        """Present positions of the anchors (p, 3), m."""
        return self.pose.moved(self.at_rest if self.anchors is None else self.anchors)

    def softened(self, soft: float) -> RigidFriction:
        """Return the same contact `soft` times as stiff, also along the surface, with a new dual variable."""
        softer: Any = super().softened(soft)
        found: RigidFriction = replace(softer, spring=soft * self.spring, dual=DualTractions())
        return found

    def lagged(self, x: Floats, before: RigidFriction | None = None, grips: bool = False) -> RigidFriction:
        """Return the same contact with an energy, with pressures and normals of the state x under the law `before`.

        With `grips` all points within the barrier distance stick, whatever the pressure.
        """
        g, n, _ = (before or self).look(x)
        p = np.where(g < self.barrier.distance, np.inf, 0.0) if grips else (before or self).barrier.pressure(g)
        return replace(self, lag=LaggedFriction(self.friction * p, n), conservative=True)

    def known(self, x: Floats, before: RigidFriction) -> RigidFriction:
        """Return the same contact with an energy and a primal-dual tangent, for one minimisation."""
        return replace(self.lagged(x, before), dual=DualTractions())

    def towing(self, x: Floats, way: Floats) -> RigidFriction:
        """Return the contact with the rigid body where the solution starts from, and all points within the barrier
        sticking.

        Sets the rows of `way` (dofs,), m, of the surface nodes to their motion with the body since then, if that is
        known.
        """
        was: Any = self.before()
        if self.earlier is not None:
            old, own = getattr(self.earlier, "pose", RigidMotion()), 3 * self.nodes[:, None] + np.arange(3)
            there = self.X + x[own]
            way[own] = self.pose.moved(old.back(there)) - there
        found: RigidFriction = was.lagged(x, grips=True)
        return found

    def stiffer(self, factor: float) -> RigidFriction:
        """Return the same contact with the stiffnesses of barrier and spring multiplied by a factor."""
        return replace(self, barrier=self.barrier.stiffer(factor), spring=factor * self.spring)

    def holds(self, x: Floats) -> bool:
        """Return whether a point in contact sticks."""
        return bool(np.any((self.pressures(x) > 0.0) & ~self.slip(x).slides))

    def way(self, x: Floats, n: Floats) -> tuple[Floats, Floats]:
        """Return vectors from anchors to points (p, 3), m: in full, and projected across normals n (p, 3)."""
        d = self.places(x) - self.held
        if self.flat:
            d[:, 2] = 0.0
        s: Floats = d - np.einsum("ij,ij->i", n, d)[:, None] * n
        return d, s

    def slip(self, x: Floats) -> Slip:
        """Return the slip of the points relative to their anchors in a state."""
        g, n, _ = self.look(x)
        return Slip.of(self.way(x, n)[1], self.friction * self.barrier.pressure(g), self.spring)

    def sticking(self, x: Floats) -> tuple[Bools, Bools, float]:
        """Return masks of points in contact (p,) and of sticking points (p,), and the fraction of the contact area that
        sticks.

        It is a fraction because points at the border also represent some area outside. Added points have no area of
        their own.
        """
        p = self.pressures(x)
        on = p > PRESSED * p.max(initial=0.0)
        sticks, own = on & ~self.slip(x).slides, self.A * (np.arange(len(p)) < self.lasting)
        whole = float(own[on].sum())
        return on, sticks, float(own[sticks].sum()) / whole if whole else 0.0

    def settled(self, x: Floats) -> Floats:
        """Return the anchors at the end of a state (p, 3), m: dragged by sliding points, reset by separated ones."""
        slip = self.slip(x)
        return self.pose.back(self.places(x) - slip.along(slip.stretched))

    def holding(self, anchors: Floats, gone: Floats | float = 0.0) -> RigidFriction:
        """Return the same contact with other anchors (p, 3), m, and sliding distances so far (p,), m."""
        return replace(self, anchors=anchors, gone=gone)

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy, including that of the stick springs, J."""
        return super().value(x) + float(self.A @ self.slip(x).t ** 2) / (2.0 * self.spring)

    def work(self, x: Floats, since: RigidContact) -> float:
        """Return the work of the rigid body, including that of friction on anchors that move with it, J."""
        was: Any = since
        _, n, _ = self.look(x)
        t = self._traction(x, n, self.friction * self.pressures(x))
        return super().work(x, since) - float(self.A @ np.einsum("ij,ij->i", t, self.held - was.held))

    def slid(self, x: Floats) -> Floats:
        """Return the sliding distance of each point since the anchors were set (p,), m."""
        return self.slip(x).slid

    def lost(self, x: Floats) -> float:
        """Return the heat dissipated by friction since the anchors were set, J: never negative."""
        slip = self.slip(x)
        return float(self.A @ (slip.t * slip.slid))

    def pushes(self, x: Floats) -> Floats:
        """Return the forces of the rigid body on the points (p, 3), N."""
        g, n, _ = self.look(x)
        p = self.barrier.pressure(g)
        return self.A[:, None] * (p[:, None] * n - self._traction(x, n, self.friction * p))

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier, with a lag also of friction, J."""
        found = super().value(x)
        if self.lag is None:
            return found
        return found + float(self.A @ Slip.of(self.way(x, self.lag.n)[1], self.lag.most, self.spring).energy)

    def bending(self, g: Floats) -> Floats:
        """Return pressures limited to that at touch: far behind the surface the tangent would turn away from it."""
        return np.minimum(super().bending(g), self.barrier.touch_pressure)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent with friction; if `projected`, only its symmetric part, for a flat surface."""
        super().add_hessian(x, data, slots, scale, projected)
        on, blocks = self.stiffness(x, projected)
        add_blocks(self.coupled(on, scale * self.A[on, None, None] * blocks), slots[on], data)

    def stiffness(self, x: Floats, projected: bool) -> tuple[Ints, Floats]:
        """Return points with friction (k,), and derivatives of tractions by displacements (k, 3, 3), Pa/m."""
        g, n, H = self.look(x)
        p = self.barrier.pressure(g)
        most = self.friction * p
        if self.lag is not None:
            n, most = self.lag.n, self.lag.most
        d, s = self.way(x, n)
        slip = Slip.of(s, most, self.spring)
        blocks = np.eye(3) - n[:, :, None] * n[:, None, :]
        if self.lag is None and not projected:
            blocks = blocks - n[:, :, None] * np.einsum("mi,mij->mj", d, H)[:, None, :]
            blocks = blocks - np.einsum("mi,mi->m", n, d)[:, None, None] * H
        u = s / np.maximum(slip.size, TINY)[:, None]
        across = blocks - u[:, :, None] * np.einsum("mi,mij->mj", u, blocks)[:, None, :]
        if self.lag is not None and self.dual is not None and np.isfinite(most).all():
            t = self.dual.at(s, slip.size, most, self.spring) / np.maximum(most, TINY)[:, None]
            both = t[:, :, None] * u[:, None, :]
            across = blocks - 0.5 * (both + both.swapaxes(1, 2))
        stiff = np.where(slip.slides, slip.t / np.maximum(slip.size, TINY), self.spring)[:, None, None]
        blocks = stiff * np.where(slip.slides[:, None, None], across, blocks)
        if self.lag is None and not projected:
            falls = np.where(slip.slides, self.friction * self.barrier.slope(g), 0.0)
            blocks = blocks - falls[:, None, None] * u[:, :, None] * n[:, None, :]
        on = np.flatnonzero(most > 0.0)
        return on, blocks[on]

    def rounding(self, x: Floats) -> float:
        """Return the error of the forces due to rounding of positions, with friction, N."""
        size = float(np.abs(self.places(x)).max(initial=0.0))
        stiff = self.A[self.gaps(x) < self.barrier.distance] * self.spring
        return super().rounding(x) + float(np.finfo(np.float64).eps * size * np.linalg.norm(stiff))

    def _traction(self, x: Floats, n: Floats, most: Floats) -> Floats:
        """Return the tractions that oppose the slip (p, 3), Pa."""
        if self.lag is not None:
            n, most = self.lag.n, self.lag.most
        slip = Slip.of(self.way(x, n)[1], most, self.spring)
        return slip.along(slip.t)


def add_friction(touching: RigidContact, friction: float, carries: Callable[[float], RigidMotion]) -> RigidFriction:
    """Return a contact with friction, as stiff as the barrier: sticking points move less than its distance."""
    known = {f.name: getattr(touching, f.name) for f in fields(touching) if f.name != "conservative"}
    spring = touching.barrier.stiffness / touching.barrier.distance
    return RigidFriction(**known, friction=friction, spring=spring, carries=carries)
