"""Coulomb friction between a deformable surface and a rigid body, by return mapping with an elastic stick spring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from softmark.records import dataclass
from softmark.solvers.contact.interaction_state import FrictionState, InteractionState
from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.contact.rigid_transform import RigidMotion
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.local_blocks import add_blocks

if TYPE_CHECKING:
    from softmark.solvers.contact.surface_points import AddedContactPoints

Bools = NDArray[np.bool_]
PRESSED = 1e-6  # of the largest pressure: smaller values are no contact
TINY = 1e-300  # m: avoids a division by zero for points without slip


@dataclass(frozen=True)
class LaggedFriction:
    """Friction limits and normals of an earlier iterate: with constant limits friction has an energy.

    `most` (m,), Pa, is the friction coefficient times the pressure, and `n` (m, 3) are the normals.
    """

    most: Floats
    n: Floats


class DualTractions:
    """Dual variable of the friction tangent: tractions t (m, 3), Pa, predicted from the last iterate.

    The friction law is linearised in the form w t = most s, with slip s, friction limit `most`, stick stiffness k and w
    = max(|s|, most / k). This form is smooth enough that a node that has just begun to slide keeps some stiffness along
    its slip. Near the solution t is the traction, and the tangent is exact.

    Source: Chan, Golub and Mulet 1999, SIAM J. Sci. Comput. 20:1964, eq. 4.6.
    """

    def __init__(self) -> None:
        self.known: tuple[Floats, Floats, Floats, Floats] | None = None  # s, t, u, w of the iterate before

    def at(self, s: Floats, size: Floats, most: Floats, spring: float | Floats) -> Floats:
        """Return the tractions (m, 3), Pa, for the tangent at slips s (m, 3), m, and store them for the next iterate.

        `size` (m,), m, are the lengths of the slips, `most` (m,), Pa, the friction limits and `spring` is the stick
        stiffness, Pa/m.
        """
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
    """Slip of contact points relative to their anchors, with the friction that opposes it.

    `s` (m, 3), m, is the slip along the surface, and `size` (m,), m, its length. `t` (m,), Pa, is the magnitude of the
    opposing traction, `slides` (m,) is true where it is the friction limit, and `spring` is the stick stiffness, Pa/m.
    """

    s: Floats
    size: Floats
    t: Floats
    slides: Bools
    spring: Floats | float

    @classmethod
    def of(cls, s: Floats, most: Floats, spring: Floats | float) -> Slip:
        """Return the slip and friction of points with slips s (m, 3), m, and friction limits `most` (m,), Pa."""
        size = np.linalg.norm(s, axis=1)
        elastic = spring * size
        return cls(s, size, np.minimum(elastic, most), elastic > most, spring)

    def along(self, f: Floats) -> Floats:
        """Return vectors (m, 3) along the slips, with the magnitudes f (m,)."""
        found: Floats = (f / np.maximum(self.size, TINY))[:, None] * self.s
        return found

    @property
    def elastic_slip(self) -> Floats:
        """Elastic part (m,), m, of the slip."""
        return self.t / self.spring

    @property
    def slid(self) -> Floats:
        """Sliding distance (m,), m, since points last stuck: the part of the slip that is not elastic."""
        return np.where(self.t > 0.0, np.maximum(self.size - self.elastic_slip, 0.0), 0.0)

    @property
    def energy(self) -> Floats:
        """Energy (m,), J/m^2, for constant friction limits: elastic energy plus work of sliding."""
        return self.t * (self.size - 0.5 * self.elastic_slip)


@dataclass(frozen=True)
class RigidFriction(RigidContact):
    """Rigid contact with Coulomb friction: each point has a stick spring, limited by mu times pressure.

    A point with the slip s from its anchor along the surface has the traction -k s, or -mu p s/|s| once it slides. This
    is elastic-perfectly plastic friction with return mapping (Simo and Laursen 1992; Wriggers 2006, ch. 5). `anchors`
    (p, 3), m, are points of the rigid body. They move with it and are constant while a state is solved; `final_anchors`
    returns the anchors at the end of the state. A sticking point moves by at most mu p / k, which is less than the
    barrier distance; `spring` is k, Pa/m. With the present pressures p friction has no energy, and the tangent is not
    symmetric. With a `lag`, pressures of an earlier iterate, it has an energy and a symmetric tangent.
    """

    friction: float = 0.0
    spring: float = 0.0
    carries: Callable[[float], RigidMotion] = lambda share: RigidMotion()
    anchors: Floats | None = None  # (p, 3) m, on the body in its declared position; None: the points at rest
    lag: LaggedFriction | None = None
    dual: DualTractions | None = None
    conservative: bool = False
    gone: Floats | float = 0.0  # (p,) m: sliding distance before this state

    each: ClassVar[tuple[str, ...]] = ("sunk", "anchors", "gone")

    def with_added_points(self, extra: AddedContactPoints | None, x: Floats) -> Self:
        """Return the same contact with the added points replaced by `extra`.

        New points are anchored where they are in the state x that the solution starts from. Points that were added
        before keep their slip.
        """
        found = super().with_added_points(extra, x)
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
    def has_friction(self) -> bool:
        """True if friction depends on the present pressure, so that it has no energy (there is no lag)."""
        return self.lag is None

    @cached_property
    def pose(self) -> RigidMotion:
        """Present position and orientation of the rigid body."""
        return self.carries(self.share)

    @cached_property
    def anchor_positions(self) -> Floats:
        """Present positions (p, 3), m, of the anchors."""
        return self.pose.moved(self.at_rest if self.anchors is None else self.anchors)

    def with_scaled_stiffness(self, soft: float) -> RigidFriction:
        """Return the same contact with `soft` times the stiffness of barrier and stick spring.

        It has a new dual variable.
        """
        softer: Any = super().with_scaled_stiffness(soft)
        found: RigidFriction = replace(softer, spring=soft * self.spring, dual=DualTractions())
        return found

    def lagged(self, x: Floats, before: RigidFriction | None = None, grips: bool = False) -> RigidFriction:
        """Return the same contact with constant friction limits and normals, so that it has an energy.

        They are computed from the pressures and normals of the contact `before` (or of this contact) in the state x.
        With `grips` all points within the barrier distance stick, whatever their pressure.
        """
        g, n, _ = (before or self).look(x)
        p = np.where(g < self.barrier.distance, np.inf, 0.0) if grips else (before or self).barrier.pressure(g)
        return replace(self, lag=LaggedFriction(self.friction * p, n), conservative=True)

    def with_lagged_pressures(self, x: Floats, before: RigidFriction) -> RigidFriction:
        """Return the same contact with constant friction limits and a primal-dual tangent, for one minimisation from x.

        The friction limits are those of the contact `before` in the state x.
        """
        return replace(self.lagged(x, before), dual=DualTractions())

    def with_sticking_points(self, x: Floats, way: Floats) -> RigidFriction:
        """Return the contact at the start of the solution, with all points within the barrier distance sticking.

        The function also writes to the rows of `way` (dofs,), m, how far each surface node would move with the rigid
        body, from its initial to its present position. The rows are left unchanged if the initial position is unknown.
        """
        was: Any = self.before()
        if self.earlier is not None:
            old, own = getattr(self.earlier, "pose", RigidMotion()), 3 * self.nodes[:, None] + np.arange(3)
            there = self.X + x[own]
            way[own] = self.pose.moved(old.back(there)) - there
        found: RigidFriction = was.lagged(x, grips=True)
        return found

    def stiffer(self, factor: float) -> RigidFriction:
        """Return the same contact with the stiffness of barrier and stick spring multiplied by a factor."""
        stiffening = factor * self.stiffening
        return replace(self, barrier=self.barrier.stiffer(factor), spring=factor * self.spring, stiffening=stiffening)

    def interaction_state(self, x: Floats, before: InteractionState | None) -> InteractionState:
        """Return the state of the contact with anchors, sliding distances and heat in a solved state x."""
        lost = self.lost(x)
        work = (0.0 if before is None else before.friction_work) + lost
        friction = FrictionState(self.final_anchors(x), self.gone + self.slid(x), work, lost, self.points)
        return replace(super().interaction_state(x, before), friction=friction)

    def resumed(self, state: InteractionState, x: Floats) -> Self:
        """Return the same contact, continued from the rigid body, added points, anchors and slip of `state`."""
        found = super().resumed(state, x)
        if state.friction is None:
            return found
        return replace(found, anchors=state.friction.anchors, gone=state.friction.slid)

    def holds(self, x: Floats) -> bool:
        """Return whether at least one point in contact sticks."""
        return bool(np.any((self.pressures(x) > 0.0) & ~self.slip(x).slides))

    def vectors_from_anchors(self, x: Floats, n: Floats) -> tuple[Floats, Floats]:
        """Return vectors (p, 3), m, from anchors to points, and their components perpendicular to normals n (p, 3)."""
        d = self.places(x) - self.anchor_positions
        if self.flat:
            d[:, 2] = 0.0
        s: Floats = d - np.einsum("ij,ij->i", n, d)[:, None] * n
        return d, s

    def slip(self, x: Floats) -> Slip:
        """Return the slip of the contact points from their anchors in a state x."""
        g, n, _ = self.look(x)
        return Slip.of(self.vectors_from_anchors(x, n)[1], self.friction * self.barrier.pressure(g), self.spring)

    def stick_masks_and_fraction(self, x: Floats) -> tuple[Bools, Bools, float]:
        """Return masks (p,) of points in contact and of sticking points, and the sticking fraction of the contact area.

        The result is a fraction, not an area, because points at the border of contact also represent some area outside.
        Added points have no area of their own.
        """
        p = self.pressures(x)
        on = p > PRESSED * p.max(initial=0.0)
        sticks, own = on & ~self.slip(x).slides, self.A * (np.arange(len(p)) < self.lasting)
        whole = float(own[on].sum())
        return on, sticks, float(own[sticks].sum()) / whole if whole else 0.0

    def final_anchors(self, x: Floats) -> Floats:
        """Return the anchors (p, 3), m, at the end of a state x.

        Sliding points drag their anchors along, and separated points get new ones.
        """
        slip = self.slip(x)
        return self.pose.back(self.places(x) - slip.along(slip.elastic_slip))

    def with_anchors(self, anchors: Floats, gone: Floats | float = 0.0) -> RigidFriction:
        """Return the same contact with new anchors (p, 3), m, and the sliding distances `gone` (p,), m, up to now."""
        return replace(self, anchors=anchors, gone=gone)

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy of the barrier and of the stick springs, J."""
        return super().value(x) + float(self.A @ self.slip(x).t ** 2) / (2.0 * self.spring)

    def work(self, x: Floats, since: RigidContact) -> float:
        """Return the work of the rigid body, J, as it moved from its position in the contact `since`.

        It includes the work of friction, at anchors that move with the body.
        """
        was: Any = since
        _, n, _ = self.look(x)
        t = self._traction(x, n, self.friction * self.pressures(x))
        return super().work(x, since) - float(
            self.A @ np.einsum("ij,ij->i", t, self.anchor_positions - was.anchor_positions)
        )

    def slid(self, x: Floats) -> Floats:
        """Return the sliding distance (p,), m, of each point since the anchors were set."""
        return self.slip(x).slid

    def lost(self, x: Floats) -> float:
        """Return the heat dissipated by friction since the anchors were set, J; it is never negative."""
        slip = self.slip(x)
        return float(self.A @ (slip.t * slip.slid))

    def point_forces(self, x: Floats) -> Floats:
        """Return the forces (p, 3), N, of the rigid body on the contact points, with friction."""
        g, n, _ = self.look(x)
        p = self.barrier.pressure(g)
        return self.A[:, None] * (p[:, None] * n - self._traction(x, n, self.friction * p))

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier and, with a lag, of friction, J."""
        found = super().value(x)
        if self.lag is None:
            return found
        return found + float(
            self.A @ Slip.of(self.vectors_from_anchors(x, self.lag.n)[1], self.lag.most, self.spring).energy
        )

    def gap_hessian_pressures(self, g: Floats) -> Floats:
        """Return the pressures (p,), Pa, that multiply the gap Hessian in the tangent, at gaps g (p,), m.

        They are limited to the pressure at zero gap: far behind the surface Newton steps would otherwise lead away from
        it.
        """
        return np.minimum(super().gap_hessian_pressures(g), self.barrier.touch_pressure)

    def add_hessian(self, x: Floats, data: Floats, slots: Ints, scale: float = 1.0, projected: bool = False) -> None:
        """Add the tangent of contact and friction; if `projected`, only its symmetric part for a flat rigid surface."""
        super().add_hessian(x, data, slots, scale, projected)
        on, blocks = self.stiffness(x, projected)
        add_blocks(self.nodal_stiffness_blocks(on, scale * self.A[on, None, None] * blocks), slots[on], data)

    def stiffness(self, x: Floats, projected: bool) -> tuple[Ints, Floats]:
        """Return the points with friction (k,), and derivatives (k, 3, 3), Pa/m, of their tractions by position."""
        g, n, H = self.look(x)
        p = self.barrier.pressure(g)
        most = self.friction * p
        if self.lag is not None:
            n, most = self.lag.n, self.lag.most
        d, s = self.vectors_from_anchors(x, n)
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
            falls = np.where(slip.slides, self.friction * self.barrier.energy_second_derivative(g), 0.0)
            blocks = blocks - falls[:, None, None] * u[:, :, None] * n[:, None, :]
        on = np.flatnonzero(most > 0.0)
        return on, blocks[on]

    def rounding(self, x: Floats) -> float:
        """Return the error of contact and friction forces due to rounding of positions, N."""
        size = float(np.abs(self.places(x)).max(initial=0.0))
        stiff = self.A[self.gaps(x) < self.barrier.distance] * self.spring
        return super().rounding(x) + float(np.finfo(np.float64).eps * size * np.linalg.norm(stiff))

    def _traction(self, x: Floats, n: Floats, most: Floats) -> Floats:
        """Return the friction tractions (p, 3), Pa, along the slip; they act on the points with the opposite sign.

        n (p, 3) are normals and `most` (p,), Pa, the friction limits; a lag replaces both.
        """
        if self.lag is not None:
            n, most = self.lag.n, self.lag.most
        slip = Slip.of(self.vectors_from_anchors(x, n)[1], most, self.spring)
        return slip.along(slip.t)


def add_friction(touching: RigidContact, friction: float, carries: Callable[[float], RigidMotion]) -> RigidFriction:
    """Return a contact with friction added; `carries` maps a load fraction to the motion of the rigid body.

    The stick stiffness is the barrier stiffness divided by the barrier distance, so that sticking points move by less
    than this distance.
    """
    known = {f.name: getattr(touching, f.name) for f in fields(touching) if f.name != "conservative"}
    spring = touching.barrier.stiffness / touching.barrier.distance
    return RigidFriction(**known, friction=friction, spring=spring, carries=carries)
