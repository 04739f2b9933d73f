"""Frames of beams under small loads: the stiffness method, with the flexibility of members by integration."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Of = Callable[[Array], Array]
else:
    from softmark.references.lazy_imports import np

PLACES, FEW = 24, 4  # of Gauss's rules: for 1 / C, and for loads, which go with areas at most
SMALL = 0.1  # turns, and axial forces against those that buckle: a state beyond is not one of small loads
ROUNDING = 1e-9  # relative to the largest displacement
LOOSE = 1e-13  # relative to the largest stiffness: smaller stiffness counts as zero


@dataclass(frozen=True)
class FrameMember:
    """Straight member of a frame from one node to another.

    The rows of `axes` are the unit vectors along the member and along the two axes of its section. `stiffness` returns
    EA, GA2, GA3, GJ, EI2, EI3 (n, 6) at distances along the member (n,), m; `load` returns the distributed load there
    in space (n, 3), N/m.
    """

    nodes: tuple[int, int]
    length: float  # m
    axes: tuple[Vector, Vector, Vector]
    stiffness: Of
    load: Of

    @cached_property
    def frame(self) -> Array:
        """Unit vectors of the member's axes as rows (3, 3)."""
        return np.array(self.axes)

    def moved(self, s: Array, force: Array) -> Array:
        """Return displacements and rotations (n, 6, k) at distances s (n,), m, under `force` (6, k) at the end.

        The member is a cantilever clamped at its start: u = int (gamma + kappa x (s - t)) dt, theta = int kappa dt.
        Results are in the axes of the member.
        """
        t, w = _gauss_rule(PLACES)
        places, weights = s[:, None] * t, s[:, None] * w  # (n, g)
        arm = _axial_cross_matrices(self.length - places)  # (n, g, 3, 3)
        n = np.broadcast_to(force[:3], (*places.shape, *force[:3].shape))
        return self._integrate_motions(s, places, weights, n, force[3:] + arm @ n)

    def motions_under_own_load(self, s: Array) -> Array:
        """Return displacements and rotations (n, 6) at distances s (n,), m, under the distributed load only.

        The member is a cantilever clamped at its start.
        """
        t, w = _gauss_rule(PLACES)
        places, weights = s[:, None] * t, s[:, None] * w
        beyond, also = _gauss_rule(FEW)
        rest = self.length - places
        there = places[..., None] + rest[..., None] * beyond  # (n, g, f)
        q = (self.load(there.ravel()) @ self.frame.T).reshape(*there.shape, 3)
        share = rest[..., None] * also
        n = np.einsum("ngf,ngfi->ngi", share, q)
        m = np.einsum("ngf,ngfij,ngfj->ngi", share, _axial_cross_matrices(there - places[..., None]), q)
        return self._integrate_motions(s, places, weights, n[..., None], m[..., None])[..., 0]

    def _integrate_motions(self, s: Array, places: Array, weights: Array, n: Array, m: Array) -> Array:
        C = self.stiffness(places.ravel()).reshape(*places.shape, 6, 1)
        gamma, kappa = n / C[..., :3, :], m / C[..., 3:, :]
        lever = -_axial_cross_matrices(s[:, None] - places)  # kappa x (s - t) e1
        u = np.einsum("ng,ngik->nik", weights, gamma + lever @ kappa)
        return np.concatenate([u, np.einsum("ng,ngik->nik", weights, kappa)], axis=1)

    @cached_property
    def flexibility(self) -> Array:
        """Flexibility matrix (6, 6) of the member's end, with its start clamped."""
        found: Array = self.moved(np.array([self.length]), np.eye(6))[0]
        return found

    @cached_property
    def end_motion_under_load(self) -> Array:
        """Displacement and rotation (6,) of the member's end under its distributed load, with its start clamped."""
        found: Array = self.motions_under_own_load(np.array([self.length]))[0]
        return found

    @cached_property
    def carried(self) -> Array:
        """Resultant force and moment (6,) of the distributed load about the start, in the member's axes."""
        t, w = _gauss_rule(FEW)
        q = self.load(self.length * t) @ self.frame.T
        moments = np.einsum("f,fij,fj->i", self.length * w, _axial_cross_matrices(self.length * t), q)
        found: Array = np.concatenate([self.length * w @ q, moments])
        return found

    @cached_property
    def rigid_motion_matrix(self) -> Array:
        """Matrix (6, 6) from a motion of the member's start to the rigid motion of its end."""
        found = np.eye(6)
        found[:3, 3:] = -_axial_cross_matrices(np.array([self.length]))[0]
        return found

    @cached_property
    def turned(self) -> Array:
        """Matrix (6, 6) from displacements and rotations in space to those in the axes of the member."""
        found: Array = np.asarray(np.kron(np.eye(2), self.frame), dtype=np.float64)
        return found

    @cached_property
    def relative_motion_matrix(self) -> Array:
        """Matrix (6, 12) from the motions of both nodes in space to the motion of the end relative to the start."""
        found: Array = np.concatenate([-self.rigid_motion_matrix @ self.turned, self.turned], axis=1)
        return found

    @cached_property
    def relative_motion_stiffness(self) -> Array:
        """Matrix (12, 6) from the motion of the end relative to the start to nodal forces and moments in space."""
        found: Array = self.relative_motion_matrix.T @ np.linalg.inv(self.flexibility)
        return found

    @cached_property
    def matrix(self) -> Array:
        """Stiffness matrix (12, 12) of the member for the motions of both nodes in space."""
        found: Array = self.relative_motion_stiffness @ self.relative_motion_matrix
        return found

    @cached_property
    def equivalent_nodal_loads(self) -> Array:
        """Equivalent nodal loads (12,) of the distributed load."""
        begin = np.concatenate([self.turned.T @ self.carried, np.zeros(6)])
        found: Array = self.relative_motion_stiffness @ self.end_motion_under_load + begin
        return found

    def turns(self, first: Array, force: Array) -> Array:
        """Return rotations (n, 3), rad, at positions along the member, in its axes.

        `first` is the motion of its start, and `force` the force and moment on its end.
        """
        s = self.length * _gauss_rule(FEW)[0]
        s = np.concatenate([[0.0], s, [self.length]])
        found: Array = (self.moved(s, force[:, None])[..., 0] + self.motions_under_own_load(s))[:, 3:] + first[3:]
        return found

    def compute_lengthening(self, turns: Array) -> float:
        """Return the second-order lengthening of the member's axis, m, due to `turns`, rotations along the member."""
        w = _gauss_rule(FEW)[1]
        found: Array = 0.5 * self.length * w @ (turns[1:-1, 1:] ** 2).sum(axis=1)
        return float(found)

    def geometric_stiffness(self, force: Array, loaded: bool = True) -> Array:
        """Return the geometric stiffness (12, 12) of internal forces, for the motions of both nodes in space.

        `force` is the force and moment on the end. For sections rotated by exp(theta), theta = (phi, -w', v'), with
        Hermite bending, it is the second derivative of N (v'^2 + w'^2) / 2 + (V2 w' - V3 v') phi / 2 - M . (theta x
        theta') / 2.
        """
        t, weights = _gauss_rule(FEW)
        found, L = np.zeros((12, 12)), self.length
        for place, weight in zip(t.tolist(), (L * weights).tolist(), strict=True):
            N, V2, V3, T, M2, M3 = self._internal_forces(place, force, loaded)
            B, S = _hermite_matrix(place, L), np.zeros((6, 6))  # of v', w', phi, v'', w'', phi'
            S[0, 0] = S[1, 1] = 0.5 * N
            S[1, 2], S[0, 2] = 0.5 * V2, -0.5 * V3
            S[1, 3], S[0, 4] = 0.5 * T, -0.5 * T
            S[0, 5], S[2, 3] = -0.5 * M2, 0.5 * M2
            S[2, 4], S[1, 5] = 0.5 * M3, -0.5 * M3
            found += weight * B.T @ (S + S.T) @ B
        to = np.kron(np.eye(2), self.turned)
        return np.asarray(to.T @ found @ to, dtype=np.float64)

    def _internal_forces(self, place: float, force: Array, loaded: bool) -> Array:
        """Return internal forces and moments (6,) at a fraction `place` of the member's length, in its axes.

        `force` is the force and moment on the end.
        """
        rest = (1.0 - place) * self.length
        n = np.concatenate([force[:3], force[3:] + rest * np.cross([1.0, 0.0, 0.0], force[:3])])
        if not loaded:
            return n
        t, w = _gauss_rule(FEW)
        q = self.load(self.length * place + rest * t) @ self.frame.T
        share = rest * w
        n[:3] += share @ q
        n[3:] += np.einsum("f,fij,fj->i", share, _axial_cross_matrices(rest * t), q)
        return n


def _hermite_matrix(t: float, L: float) -> Array:
    """Return the matrix (6, 12) from motions of both ends to v', w', phi, v'', w'' and phi' at the fraction t."""
    steep = np.array(
        [6.0 * t * (t - 1.0) / L, 1.0 - 4.0 * t + 3.0 * t * t, 6.0 * t * (1.0 - t) / L, 3.0 * t * t - 2.0 * t]
    )
    bent = np.array([(12.0 * t - 6.0) / L, 6.0 * t - 4.0, (6.0 - 12.0 * t) / L, 6.0 * t - 2.0]) / L
    found = np.zeros((6, 12))
    flip = np.array([1.0, -1.0, 1.0, -1.0])  # w' turns about the second axis backwards
    for row, shape in ((0, steep), (3, bent)):
        found[row, [1, 5, 7, 11]], found[row + 1, [2, 4, 8, 10]] = shape, flip * shape
    found[2, [3, 9]], found[5, [3, 9]] = (1.0 - t, t), (-1.0 / L, 1.0 / L)
    return found


@cache
def _gauss_rule(count: int) -> tuple[Array, Array]:
    """Return points and weights of the Gauss rule with `count` points on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    places: Array = 0.5 * (1.0 + x)
    weights: Array = 0.5 * w
    return places, weights


def _axial_cross_matrices(d: Array) -> Array:
    """Return the matrices (..., 3, 3) of the cross product d e1 x, for distances d along the member."""
    found: Array = np.zeros((*d.shape, 3, 3))
    found[..., 1, 2], found[..., 2, 1] = -d, d
    return found


@dataclass(frozen=True)
class Frame:
    """Frame: nodes X (n, 3), m, forces and moments on them (n, 6), members between them, and supports.

    `held` (c, 6 n) are the rows of the support conditions on displacements and rotations in space, and `imposed` (c,)
    their values, m or rad. `nearest` returns the member of each point.
    """

    X: Array
    forces: Array
    members: tuple[FrameMember, ...]
    held: Array
    imposed: Array
    nearest: Callable[[Array], Array]

    def balanced(self) -> FrameSolution:
        """Return the frame in equilibrium. Raises NotApplicable if it is a mechanism, or its loads are not small."""
        P, d = self.forces.ravel().copy(), self._imposed_displacements()
        for member, at in self._members_with_unknowns():
            P[at] += member.equivalent_nodal_loads
        answer = FrameSolution(self, self._solve_free_motions(P, d).reshape(-1, 6))
        if not answer.nonlinearity_measure <= SMALL:
            percent = 100 * answer.nonlinearity_measure
            raise NotApplicable(
                f"its rotations, and its forces relative to buckling loads, reach {percent:.2g} %",
                "the theory holds for small loads: reduce them, or compare two models",
            )
        return answer

    def end_forces_by_lengthening(self, lengthened: list[float]) -> list[Array]:
        """Return the end force and moment (6,) of each member if members lengthen by `lengthened`, m."""
        P, none = np.zeros(6 * len(self.X)), np.zeros(6 * len(self.X))
        strains = [np.array([extra, *[0.0] * 5]) for extra in lengthened]
        for (member, at), strain in zip(self._members_with_unknowns(), strains, strict=True):
            P[at] -= member.relative_motion_matrix.T @ np.linalg.solve(member.flexibility, strain)
        d = self._solve_free_motions(P, none)
        return [
            np.linalg.solve(member.flexibility, member.relative_motion_matrix @ d[at] + strain)
            for (member, at), strain in zip(self._members_with_unknowns(), strains, strict=True)
        ]

    def share(self, forces: list[Array], loaded: bool = True) -> float:
        """Return the largest ratio of internal forces to buckling loads, considering forces of either sign.

        `forces` are the end force and moment (6,) of each member. The distributed loads count only if `loaded`.
        """
        S = np.zeros_like(self._stiffness_matrix)
        for (member, at), force in zip(self._members_with_unknowns(), forces, strict=True):
            S[np.ix_(at, at)] += member.geometric_stiffness(force, loaded)
        Z, root = self._free_motions_with_factor
        eased = np.linalg.solve(root, np.linalg.solve(root, Z.T @ (S * self._scale_products) @ Z).T)
        return float(np.abs(np.linalg.eigvalsh(0.5 * (eased + eased.T))).max(initial=0.0))

    def _members_with_unknowns(self) -> list[tuple[FrameMember, Any]]:
        """Return the members, each with the indices of its nodes' unknowns (12,)."""
        return [(m, np.concatenate([6 * n + np.arange(6) for n in m.nodes])) for m in self.members]

    @cached_property
    def _unknown_scales(self) -> Array:
        """Return the factors (6 n,) that give displacements and rotations comparable magnitudes."""
        extent = float(np.linalg.norm(np.ptp(self.X, axis=0)))
        return np.tile([1.0, 1.0, 1.0, *[1.0 / extent] * 3], len(self.X))

    @cached_property
    def _scale_products(self) -> Array:
        found: Array = np.outer(self._unknown_scales, self._unknown_scales)
        return found

    @cached_property
    def _stiffness_matrix(self) -> Array:
        """Return the stiffness matrix K (6 n, 6 n)."""
        K = np.zeros((6 * len(self.X), 6 * len(self.X)))
        for member, at in self._members_with_unknowns():
            K[np.ix_(at, at)] += member.matrix
        return K

    @cached_property
    def _support_decomposition(self) -> tuple[Array, Array, Array, int]:
        """Return the singular vectors and values of the support conditions, and their rank."""
        U, s, Vt = np.linalg.svd(self.held * self._unknown_scales)
        return U, s, Vt, int(np.sum(s > 1e-12 * s.max(initial=0.0)))

    def _imposed_displacements(self) -> Array:
        """Return displacements that satisfy the support conditions, in scaled unknowns.

        Raises NotApplicable if the conditions conflict.
        """
        U, s, Vt, rank = self._support_decomposition
        y: Array = Vt[:rank].T @ ((U.T @ self.imposed)[:rank] / s[:rank])
        apart = np.abs(self.held * self._unknown_scales @ y - self.imposed).max(initial=0.0)
        if apart > 1e-9 * max(np.abs(self.imposed).max(initial=0.0), 1e-300):
            raise NotApplicable("its supports contradict each other", "constrain each point only once")
        return y

    @cached_property
    def _free_motions_with_factor(self) -> tuple[Array, Array]:
        """Return a basis of the free motions, as columns, and the Cholesky factor of their stiffness.

        Raises NotApplicable if the supports allow rigid motions.
        """
        Z = self._support_decomposition[2][self._support_decomposition[3] :].T
        free = Z.T @ (self._stiffness_matrix * self._scale_products) @ Z
        values = np.linalg.eigvalsh(free)
        if values.size and values[0] <= LOOSE * values[-1]:
            raise NotApplicable("its supports allow rigid motions", "add supports")
        root: Array = np.asarray(np.linalg.cholesky(free), dtype=np.float64)
        return Z, root

    def _solve_free_motions(self, P: Array, y: Array) -> Array:
        """Return displacements d with K d = P in all free motions, added to the imposed displacements y.

        Raises NotApplicable.
        """
        Z, root = self._free_motions_with_factor
        own = self._stiffness_matrix * self._scale_products
        y = y + Z @ np.linalg.solve(root.T, np.linalg.solve(root, Z.T @ (self._unknown_scales * P - own @ y)))
        found: Array = self._unknown_scales * y
        return found


@dataclass(frozen=True)
class FrameSolution:
    """Frame in equilibrium: displacements and rotations d of its nodes (n, 6), m and rad."""

    frame: Frame
    d: Array

    @cached_property
    def start_motions_and_end_forces(self) -> list[tuple[Array, Array]]:
        """Motion of the start node (6,), and force and moment on the end (6,), of each member, in the member's axes."""
        return [self._motion_and_force(member) for member in self.frame.members]

    def _motion_and_force(self, member: FrameMember) -> tuple[Array, Array]:
        first, last = (member.turned @ self.d[n] for n in member.nodes)
        return first, np.linalg.solve(
            member.flexibility, last - member.rigid_motion_matrix @ first - member.end_motion_under_load
        )

    @cached_property
    def turns(self) -> list[Array]:
        """Rotations (n, 3), rad, at positions along each member, in its axes."""
        return [
            member.turns(*end)
            for member, end in zip(self.frame.members, self.start_motions_and_end_forces, strict=True)
        ]

    @cached_property
    def nonlinearity_measure(self) -> float:
        """Measure of nonlinearity: the largest rotation, rad, plus the ratio of internal forces to buckling loads."""
        return float(max((np.abs(turns).max() for turns in self.turns), default=0.0)) + self.buckling_ratio

    @cached_property
    def buckling_ratio(self) -> float:
        """Largest ratio of internal forces to buckling loads.

        It includes the tension that fixed ends cause when members bend. The ratios are the eigenvalues of the
        second-order work relative to the stiffness, of either sign.
        """
        members = zip(self.frame.members, self.turns, strict=True)
        pulled = self.frame.end_forces_by_lengthening([member.compute_lengthening(turns) for member, turns in members])
        return self.frame.share([force for _, force in self.start_motions_and_end_forces]) + self.frame.share(
            pulled, loaded=False
        )

    @cached_property
    def estimated_error(self) -> float:
        """Error of the displacement of any point, m, due to second-order terms and rounding."""
        return float((self.nonlinearity_measure + ROUNDING) * np.linalg.norm(self.d[:, :3], axis=1).max())

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed frame. Raises NotApplicable."""
        points = as_points(X)
        which = self.frame.nearest(points)
        found: Array = np.zeros_like(points)
        for number in np.unique(which).tolist():
            here, member = which == number, self.frame.members[number]
            local = (points[here] - self.frame.X[member.nodes[0]]) @ member.frame.T
            s = np.clip(local[:, 0], 0.0, member.length)
            first, force = self.start_motions_and_end_forces[number]
            moved = member.moved(s, force[:, None])[..., 0] + member.motions_under_own_load(s)
            moved[:, :3] += first[:3] + np.cross(first[3:], np.outer(s, [1.0, 0.0, 0.0]))
            moved[:, 3:] += first[3:]
            local[:, 0] -= s
            found[here] = (moved[:, :3] + np.cross(moved[:, 3:], local)) @ member.frame
        return found


@dataclass(frozen=True)
class FrameTheory(Reference):
    """A frame of beams under small loads: the stiffness method, exact for its members.

    Members are straight, with stretch, bending, torsion and shear, and rigidly connected; the flexibility of tapered
    ones is integrated. Gravity, forces and line forces on axes and torques at points act on the undeformed frame, and
    supports hold or move points; a member that is held along its length is held at every sixteenth. The theory is
    linear: its error is of second order in the load, estimated from rotations and from internal forces as fractions of
    buckling loads, including the tension that held ends cause in bending. A state in which these reach a tenth is
    refused. It shares no code with models.
    Source: Livesley, "Matrix Methods of Structural Analysis" (1964); Przemieniecki (1968), chapter 5; Cowper (1966).
    """

    body: Annotated[Any, "body", "the network"]

    supports_networks: ClassVar[bool] = True
    problem_kind: ClassVar[str] = "frame"
    means: ClassVar[str] = "linear"
    source: ClassVar[str] = "Livesley 1964, Matrix Methods of Structural Analysis"
    error_meaning: ClassVar[str] = "error of the displacement of any point, m: terms of second order in the load"

    def solve(self, make: Callable[[], Frame]) -> FrameSolution:
        """Return the solution of the frame that the function `make` builds. Raises NotApplicable."""
        return make().balanced()
