"""Coulomb friction between two deformable surfaces, by return mapping with a regularised stick stiffness.

Every sample of a surface has its own normal force and slides on the nearest faces of the other surface. Its slip since
the last state is its displacement minus that of the closest point of the face, projected onto the tangent plane. The
displacement that a rotation of the face causes across the gap is subtracted as well, so that friction causes no moment
(`TangentialCoupling`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from softmark.records import dataclass
from softmark.solvers.contact.closest_face_points import (
    closest_point_weights,
    nearest_pair_of_each,
    vectors_from_closest_points,
)
from softmark.solvers.contact.contact_surface import ContactSurface
from softmark.solvers.contact.deformable_contact import HALF, IpcContact
from softmark.solvers.contact.interaction_state import FrictionState, InteractionState
from softmark.solvers.contact.rigid_friction import TINY, DualTractions, Slip
from softmark.solvers.energies.energy import DynamicPatternEnergy, Floats, Ints

PRESSED = 1e-12  # of the largest force: smaller values are no contact
BLEND = 1e-2  # of the distance to the nearest face: faces farther by no more than that share the friction of a sample
EDGE_ON = 1e-12  # least weight of a face: one seen at an angle below 1e-6 has none
STRIDE = 0.25  # of an edge length: longest slip in one step
GRIP = 10.0  # stick stiffness over barrier stiffness per barrier distance


@dataclass(frozen=True)
class FrictionHistory:
    """Friction history at the end of a state.

    `u` (dofs,), m, are the displacements. `s` (p, d), m, is the elastic slip of all samples, tangential to the surface
    with normals `n` (p, d).
    """

    u: Floats
    s: Floats
    n: Floats


@dataclass(frozen=True)
class TangentialCoupling:
    """Surface samples in contact in one state, and the linear map from displacements to their slip.

    m samples are in contact. `which` (m,) are their indices, `N` (m,), N, the normal forces on them, and `n` (m, d) the
    normals of the surface on which they lie. `faces` (m,) are the faces of the other surface that are nearest to them,
    and `far` (m,), m, the distances to these faces. `spring` (m,), N/m, is the stick stiffness of each sample. In a
    state
    with displacements x (dofs,), the slips (m d,), m, are `start` + `W` x. The transpose of `W` maps friction forces on
    the samples to nodal forces.
    """

    which: Ints
    N: Floats
    n: Floats
    far: Floats
    W: Any
    start: Floats
    spring: Floats
    faces: Ints

    def slip_vectors(self, x: Floats) -> Floats:
        """Return the slip (m, d), m, of each sample in a state x, including the elastic slip from its history."""
        found: Floats = (self.start + self.W @ np.asarray(x, dtype=np.float64)[: self.W.shape[1]]).reshape(self.n.shape)
        return found

    def slip(self, x: Floats, friction: float) -> Slip:
        """Return the slip state in a state x for a friction coefficient; its traction `t` (m,) is a force, N."""
        return Slip.of(self.slip_vectors(x), friction * self.N, self.spring)


@dataclass(frozen=True)
class DeformableFriction(DynamicPatternEnergy):
    """Contact `pressing` between deformable surfaces with the coefficient `friction`.

    A spring with the stick stiffness, Pa/m, holds each sample in contact until its traction reaches the friction
    coefficient times the pressure. This is elastic-perfectly plastic friction (Wriggers 2006, ch. 5). It continues from
    the history `since` of the last state. Friction with the present pressures has no energy, and its tangent is not
    symmetric. With a `lag`, the contact state of an earlier iterate, normal forces and directions are constant, and
    friction has an energy (Li et al. 2020).
    """

    pressing: IpcContact
    friction: float
    since: FrictionHistory | None = None
    lag: TangentialCoupling | None = None
    dual: DualTractions | None = None
    conservative: bool = False

    @cached_property
    def _cached_coupling(self) -> dict[str, Any]:
        """Cache with the last state (key `x`) and the tangential coupling computed for it (key `hold`)."""
        return {}

    @property
    def has_friction(self) -> bool:
        """True if friction depends on the present pressure, so that it has no energy (there is no lag)."""
        return self.lag is None

    @property
    def skin(self) -> ContactSurface:
        """Contact surface of the bodies."""
        return self.pressing.skin

    @property
    def distance(self) -> float:
        """Barrier distance, m."""
        return self.pressing.distance

    @property
    def reaction_nodes(self) -> NDArray[np.bool_] | None:
        """Mask (n,) of the nodes of all mesh pieces except the first."""
        found: NDArray[np.bool_] | None = self.pressing.reaction_nodes
        return found

    @property
    def spring(self) -> float:
        """Stick stiffness, Pa/m: ten times the barrier stiffness divided by the barrier distance."""
        return GRIP * self.pressing.stiffness / self.pressing.distance

    @property
    def largest_support_step(self) -> float:
        """Longest slip allowed in one step, m: a quarter of the median edge length.

        With slips of a whole edge, half of all corners interlock.
        """
        skin = self.skin
        return STRIDE * float(np.median(np.linalg.norm(np.diff(skin.X[skin.edges], axis=1), axis=2)))

    # ------------------------------------------------------------------ contact and slip

    def tangential_coupling(self, x: Floats) -> TangentialCoupling:
        """Return the samples in contact in a state x, with their tangential coupling.

        The result for the last state is cached.
        """
        if self._cached_coupling.get("x") is not x:
            self._cached_coupling["x"], self._cached_coupling["hold"] = x, self._compute_tangential_coupling(x)
        found: TangentialCoupling = self._cached_coupling["hold"]
        return found

    def _compute_tangential_coupling(self, x: Floats) -> TangentialCoupling:
        """Compute the samples in contact in a state x, their nearest faces and their tangential coupling."""
        skin, V = self.skin, self.skin.places(x)
        n = _face_normals(V[skin.faces[skin.own]])
        N = np.abs(np.einsum("pi,pi->p", n, self.pressing.forces(x)[skin.corners :]))
        pairs = self.pressing.nearby_sample_face_pairs(x)
        pairs = pairs[N[pairs[:, 0] - skin.corners] > PRESSED * N.max(initial=0.0)]
        chosen, of, weights, nearest, far = _weigh_nearest_faces(pairs, V[pairs[:, 0]], V[skin.faces[pairs[:, 1]]])
        which, faces = pairs[nearest, 0] - skin.corners, skin.faces[pairs[chosen, 1]]
        samples, d = pairs[chosen, 0], V.shape[1]
        each = _slip_matrix(samples, faces, V[samples], V[faces], n[samples - skin.corners], len(V))
        mean = sparse.csr_matrix((weights, (of, np.arange(len(of)))), shape=(len(which), len(of)))
        W = sparse.kron(mean, sparse.identity(d), format="csr") @ each @ skin.M
        spring = HALF * self.spring * skin.A[which]
        return TangentialCoupling(
            which, N[which], n[which], far, W, self._constant_slip(which, n[which], W), spring, pairs[nearest, 1]
        )

    def _constant_slip(self, which: Ints, n: Floats, W: Any) -> Floats:
        """Return the constant part (m d,), m, of the slip of samples `which` (m,), from the history.

        It is the elastic slip at the end of the last state, rotated from the old normals to the new ones n (m, d),
        minus the slip W u of the displacements u at that time.
        """
        if self.since is None:
            return np.zeros(n.size)
        s, was = self.since.s[which], self.since.n[which]
        along = np.einsum("mi,mi->m", s, n) / np.maximum(1.0 + np.einsum("mi,mi->m", was, n), TINY)
        turned = np.where(np.einsum("mi,mi->m", was, n)[:, None] > 0.0, s - along[:, None] * (was + n), 0.0)
        found: Floats = turned.ravel() - W @ self.since.u
        return found

    def lagged(self, x: Floats, before: DeformableFriction | None = None, grips: bool = False) -> DeformableFriction:
        """Return the same friction with constant normal forces, so that it has an energy.

        The normal forces are those of the contact `before`, or of this one, in the state x. The argument `grips` has no
        effect here.
        """
        return replace(self, lag=(before or self).tangential_coupling(x), dual=DualTractions(), conservative=True)

    def with_lagged_pressures(self, x: Floats, before: DeformableFriction) -> DeformableFriction:
        """Return the same friction with constant normal forces and a primal-dual tangent, for one minimisation from x.

        The normal forces are those of the contact `before` in the state x.
        """
        return self.lagged(x, before)

    def with_scaled_stiffness(self, soft: float) -> DeformableFriction:
        """Return this friction unchanged: a barrier between deformable bodies needs no softening."""
        return self

    def holds(self, x: Floats) -> bool:
        """Return whether at least one sample in contact sticks."""
        hold = self.lag or self.tangential_coupling(x)
        return bool(np.any(~hold.slip(x, self.friction).slides))

    # ------------------------------------------------------------------ end of a state

    def final_history(self, x: Floats) -> tuple[FrictionHistory, Floats, float]:
        """Return the history at the end of a state x, the sliding distance of samples (points,), m, and the heat, J.

        Sliding distance and heat are those of this state, counted from the last one.
        """
        hold, skin = self.tangential_coupling(x), self.skin
        slip = hold.slip(x, self.friction)
        s, n = np.zeros((2, skin.points, skin.X.shape[1]))
        s[hold.which] = slip.along(slip.elastic_slip)
        n[hold.which] = hold.n
        slid = np.zeros(skin.points)
        slid[hold.which] = slip.slid
        u = np.array(x, dtype=np.float64)[: skin.M.shape[1]]
        return FrictionHistory(u, s, n), slid, float(slip.t @ slip.slid)

    def interaction_state(self, x: Floats, before: InteractionState | None) -> InteractionState:
        """Return the history of the samples, their sliding distances and the heat in a solved state x."""
        history, slid, lost = self.final_history(x)
        if before is not None and before.friction is not None:
            slid = before.friction.slid + slid
        work = (0.0 if before is None else before.friction_work) + lost
        return InteractionState(friction=FrictionState(history, slid, work, lost))

    def resumed(self, state: InteractionState, x: Floats) -> Self:
        """Return the same friction, continued from the history in `state`."""
        return self if state.friction is None else self.with_history(state.friction.anchors)

    def with_history(self, since: FrictionHistory) -> Self:
        """Return the same friction, continued from the history `since` of another state."""
        return replace(self, since=since)

    def lost(self, x: Floats) -> float:
        """Return the heat dissipated by friction since the last state, J; it is never negative."""
        slip = self.tangential_coupling(x).slip(x, self.friction)
        return float(slip.t @ slip.slid)

    def samples_in_contact(self, x: Floats) -> NDArray[np.bool_]:
        """Return a mask (points,) of the samples in contact."""
        return self.pressing.samples_in_contact(x)

    # ------------------------------------------------------------------ energy

    def stored(self, x: Floats) -> float:
        """Return the recoverable energy of the barrier and of the stick springs, J."""
        slip = self.tangential_coupling(x).slip(x, self.friction)
        return self.pressing.value(x) + 0.5 * float(slip.t @ slip.elastic_slip)

    def value(self, x: Floats) -> float:
        """Return the energy of the barrier and, with a lag, of friction, J; infinite if surfaces intersect."""
        found = self.pressing.value(x)
        if self.lag is None or not np.isfinite(found):
            return found
        return found + float(self.lag.slip(x, self.friction).energy.sum())

    def add_gradient(self, x: Floats, g: Floats, scale: float = 1.0) -> None:
        """Add `scale` times the negative forces of contact and friction on nodes, N, to g (dofs,)."""
        self.pressing.add_gradient(x, g, scale)
        hold = self.lag or self.tangential_coupling(x)
        slip = hold.slip(x, self.friction)
        f = hold.W.T @ slip.along(slip.t).ravel()
        g[: len(f)] += scale * f

    def matrix(self, x: Floats, projected: bool = False) -> Any:
        """Return the tangent of contact and friction, sparse (dofs, dofs), N/m.

        It is symmetric with a lag, or if `projected`.
        """
        hold = self.lag or self.tangential_coupling(x)
        slip = hold.slip(x, self.friction)
        u = slip.s / np.maximum(slip.size, TINY)[:, None]
        d, most = hold.n.shape[1], self.friction * hold.N
        t = u
        if self.lag is not None and self.dual is not None:
            t = self.dual.at(slip.s, slip.size, most, hold.spring) / np.maximum(most, TINY)[:, None]
        both = 0.5 * (t[:, :, None] * u[:, None, :] + u[:, :, None] * t[:, None, :])
        stiff = np.where(slip.slides, slip.t / np.maximum(slip.size, TINY), hold.spring)
        blocks = stiff[:, None, None] * (np.eye(d) - np.where(slip.slides[:, None, None], both, 0.0))
        K = hold.W.T @ (_block_diagonal(blocks) @ hold.W)
        if self.lag is None and not projected:
            K = K + hold.W.T @ self._tangent_by_normal_force(x, hold, slip, u)
        K = K.tocsr()
        K.resize((len(x), len(x)))
        return self.pressing.matrix(x, projected) + K

    def _tangent_by_normal_force(self, x: Floats, hold: TangentialCoupling, slip: Slip, u: Floats) -> Any:
        """Return the derivative (m d, dofs), N/m, of friction forces through the normal forces they depend on."""
        m, d = hold.n.shape
        v, rows = len(self.skin.X), np.repeat(np.arange(m), d)
        at = (d * (self.skin.corners + hold.which)[:, None] + np.arange(d)).ravel()
        n = sparse.csr_matrix((hold.n.ravel(), (rows, at)), shape=(m, d * v))
        sign = -np.sign(np.einsum("mi,mi->m", hold.n, self.pressing.forces(x)[self.skin.corners + hold.which]))
        N = -sparse.diags(sign) @ (n @ self.pressing.sample_barrier_hessian(x)) @ self.skin.M
        way = np.where(slip.slides[:, None], self.friction * u, 0.0)
        return sparse.csr_matrix((way.ravel(), (np.arange(m * d), rows)), shape=(m * d, m)) @ N

    def limit(self, x: Floats, d: Floats) -> float:
        """Return the largest fraction of a step d (dofs,) from x for which no two faces meet."""
        return self.pressing.limit(x, d)

    def rounding(self, x: Floats) -> float:
        """Return the error of contact and friction forces due to rounding of positions, N."""
        hold = self.lag or self.tangential_coupling(x)
        size = float(np.abs(self.skin.X).max())
        return self.pressing.rounding(x) + float(np.finfo(np.float64).eps * size * np.linalg.norm(hold.spring))


def _weigh_nearest_faces(pairs: Ints, p: Floats, t: Floats) -> tuple[Ints, Ints, Floats, Ints, Floats]:
    """Return pairs that carry friction (c,), their samples (c,), weights (c,), and the main pair of each sample (m,).

    `pairs` (a, 2) are samples and faces, `p` (a, d), m, the samples and `t` (a, d, d), m, the faces. The last result is
    the distance (m,), m, of each main pair, which has the largest weight. The nearest face and all that are nearly as
    near share the friction of a sample. Their weights fall to zero as they become farther, or are seen edge-on. If only
    the nearest face counted, friction would jump where a sample passes from face to face, and there might be no
    equilibrium.
    """
    r = vectors_from_closest_points(p, t)
    far = np.linalg.norm(r, axis=1)
    looks = np.abs(np.einsum("ci,ci->c", r, _face_normals(t))) / np.maximum(far, TINY)
    of = np.unique(pairs[:, 0], return_inverse=True)[1].ravel()
    least = far[nearest_pair_of_each(of, far)][of]
    weights = looks**2 * np.maximum(1.0 - (far / least - 1.0) / BLEND, 0.0)
    nearest = nearest_pair_of_each(of, -weights)
    weights[nearest] = np.maximum(weights[nearest], TINY)  # the main pair always counts
    chosen = np.flatnonzero((weights > EDGE_ON) | np.isin(np.arange(len(of)), nearest))
    of, weights = of[chosen], weights[chosen]
    return chosen, of, weights / np.bincount(of, weights)[of], nearest, far[nearest]


def _face_normals(t: Floats) -> Floats:
    """Return unit normals (c, d) of faces (c, d, d)."""
    a = t[:, 1] - t[:, 0]
    n = np.stack([a[:, 1], -a[:, 0]], axis=1) if t.shape[2] == 2 else np.cross(a, t[:, 2] - t[:, 0])
    found: Floats = n / np.linalg.norm(n, axis=1, keepdims=True)
    return found


def _slip_matrix(samples: Ints, faces: Ints, p: Floats, t: Floats, n: Floats, v: int) -> Any:
    """Return the sparse matrix (m d, v d) from displacements of all v points to the tangential slip of samples.

    Samples with the numbers `samples` (m,) are at p (m, d), m. Their `faces` (m, k) have corners at t (m, k, d), m. The
    slip is P (u_p - sum R_j u_j + sum C_j (r . u_j)), with R the shape functions at the closest point, r the vector
    from it to the sample, and P the projection onto the plane normal to n. Since sum C_j = 0 and sum x_j C_j = 1 except
    along r, a rigid rotation of sample and face together causes no slip.
    """
    m, k, d = t.shape
    R = closest_point_weights(p, t)
    r = p - np.einsum("mk,mki->mi", R, t)
    sides = np.concatenate([t[:, 1:] - t[:, :1], -(r / np.linalg.norm(r, axis=1, keepdims=True))[:, None]], axis=1)
    C = np.linalg.inv(sides.swapaxes(1, 2))[:, : k - 1]  # (m, k - 1, d)
    C = np.concatenate([-C.sum(axis=1, keepdims=True), C], axis=1)
    one = np.broadcast_to(np.eye(d), (m, d, d))
    each = C[:, :, :, None] * r[:, None, None, :] - R[:, :, None, None] * one[:, None]
    P = one - n[:, :, None] * n[:, None, :]
    blocks = np.einsum("mij,mkjl->mkil", P, np.concatenate([one[:, None], each], axis=1))
    places = np.concatenate([samples[:, None], faces], axis=1)
    rows = np.broadcast_to((d * np.arange(m)[:, None] + np.arange(d))[:, None, :, None], blocks.shape)
    columns = np.broadcast_to((d * places[:, :, None] + np.arange(d))[:, :, None, :], blocks.shape)
    return sparse.csr_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(m * d, v * d))


def _block_diagonal(blocks: Floats) -> Any:
    """Return a sparse block-diagonal matrix of blocks (m, d, d)."""
    m, d, _ = blocks.shape
    return sparse.bsr_matrix((blocks, np.arange(m), np.arange(m + 1)), shape=(m * d, m * d)).tocsr()
