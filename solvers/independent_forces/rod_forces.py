"""Independent forces and moments of a rod solution, from rotation matrices instead of quaternions.

Let theta be the rotation vector from one node's frame R_a to the next, in the axes of the first, J its left Jacobian (I
+ ... [theta] + ...) and R_m = R_a exp(theta / 2) the frame in the middle. An element of length l carries the force N =
R_m C_N (R_m^T d / l - e1) and the moment M = R_a J^-T C_M theta / l, with d the vector from node to node. Virtual
rotations w_a, w_b of the nodes rotate the middle by (I - A) w_a + A w_b, with A = R_a J(theta / 2) J^-1(theta) R_a^T /
2. So the nodal forces are -N and N, and the nodal moments are -M - (I - A)^T (d x N) and M - A^T (d x N).
Source: Crisfield and Jelenic (1999), equations of the two-node element; the Jacobian of rotations: Sola, Deray and
Atchuthan (2018), appendix B.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from softmark.records import dataclass
from softmark.solvers.independent_forces.solid_forces import EPS, Floats


@dataclass(frozen=True)
class CheckedRod:
    """A rod solution under test: node positions `x` (n, 3), m, and frames `R` (n, 3, 3) with columns e1, e2, e3.

    `natural` are positions and frames at rest, if the rod is not straight. `l` (n - 1,), m, are the lengths of the
    elements at rest. `C` are the stiffnesses EA, GA2, GA3 (N), GJ, EI2, EI3 (N m^2): (6,), or (n - 1, 6) for each
    element. Modes in `rigid` are constrained; their internal forces are unknown and chosen so that the other forces
    balance best. The strains `relaxed_strains` (n - 1, 6), which have relaxed in a viscoelastic rod, are
    subtracted from the strains.
    """

    x: Floats
    R: Floats
    l: Floats
    C: Floats
    rigid: tuple[int, ...] = ()
    natural: tuple[Floats, Floats] | None = None
    relaxed_strains: Floats | None = None

    @cached_property
    def _rest_shape(self) -> tuple[Floats, Floats]:
        """Gamma + e1 and the rotation vectors of the elements at rest, (n - 1, 3) each."""
        if self.natural is None:
            return np.array([1.0, 0.0, 0.0]), np.zeros(3)
        X, R = self.natural
        turns = rotation_vector(R[:-1].transpose(0, 2, 1) @ R[1:])
        middle = R[:-1] @ exponential(0.5 * turns)
        return np.einsum("eki,ek->ei", middle, np.diff(X, axis=0)) / self.l[:, None], turns

    def forces(self) -> tuple[Floats, Floats]:
        """Return the internal forces, N, and moments, N m, at the nodes (n, 6), in space.

        The second result (n, 6, elements, modes) is their derivative by the internal forces of the constrained modes.
        """
        e, Ra = len(self.l), self.R[:-1]
        _, inverse, middle, d, A = self._element_kinematics
        left = self.strains if self.relaxed_strains is None else self.strains - self.relaxed_strains
        carried = left[:, :3] * self.C[..., :3]
        carried[:, list(self.rigid)] = 0.0
        M = np.einsum("eij,ekj,ek->ei", Ra, inverse, left[:, 3:] * self.C[..., 3:])
        g = self._sum_at_nodes(np.einsum("eij,ej->ei", middle, carried)[:, None], M[:, None], d, A)[:, :, 0]
        unit = np.zeros((e, len(self.rigid), 3)) + middle[:, :, list(self.rigid)].transpose(0, 2, 1)
        by = np.zeros((e + 1, 6, e, len(self.rigid)))
        if self.rigid:
            ends = self._element_end_forces(unit, np.zeros_like(unit), d, A)
            for side in (0, 1):
                by[np.arange(e) + side, :, np.arange(e)] += ends[side].transpose(0, 2, 1)
        return g, by

    @cached_property
    def _element_kinematics(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Quantities theta, J^-1, R_m, d and A of every element (see the module docstring)."""
        Ra, d = self.R[:-1], np.diff(self.x, axis=0)
        theta = self._relative_rotations
        inverse: Floats = np.asarray(np.linalg.inv(left_jacobian(theta)), dtype=np.float64)
        A = 0.5 * Ra @ left_jacobian(0.5 * theta) @ inverse @ Ra.transpose(0, 2, 1)
        return theta, inverse, Ra @ exponential(0.5 * theta), d, A

    def tendon_forces(self, tension: Floats, arms: Floats, slopes: Floats) -> Floats:
        """Return the forces, N, and moments, N m, of a tendon on the nodes (n, 6), in space.

        The `tension` (e,), N, and the position of the tendon are given at the element centres: `arms` (e, 3), m, and
        their `slopes` (e, 3), no unit, in the axes of the element. The tangent vector of the tendon is R_m (R_m^T d / l
        + K x a + a'). Sections carry the opposite of the tension along it.
        """
        theta, inverse, middle, d, A = self._element_kinematics
        across = np.cross(theta / self.l[:, None], arms) + slopes
        way = d / self.l[:, None] + np.einsum("eij,ej->ei", middle, across)
        pull = tension[:, None] * way / np.linalg.norm(way, axis=1)[:, None]
        own = np.cross(arms, np.einsum("eji,ej->ei", middle, pull))  # about the axes of the middle
        turning = np.einsum("eij,ekj,ek->ei", self.R[:-1], inverse, own)
        return -self._sum_at_nodes(pull[:, None], turning[:, None], d, A)[:, :, 0]

    def strain(self, arms: Floats) -> tuple[float, float]:
        """Return the largest strain by twist and curvatures, and the largest strain by stretch and shear.

        The first is the strain of fibres at distances `arms` (3,), m, from the axis.
        """
        middle = self.R[:-1] @ exponential(0.5 * self._relative_rotations)
        Gamma = np.einsum("eki,ek->ei", middle, np.diff(self.x, axis=0)) / self.l[:, None] - self._rest_shape[0]
        bent = np.linalg.norm(arms * self.curvatures, axis=1)
        return float(bent.max()), float(np.linalg.norm(Gamma, axis=1).max())

    @property
    def strains(self) -> Floats:
        """Stretch and shears, no unit, and twist and bending curvatures, 1/m, of each element (n - 1, 6)."""
        _, _, middle, d, _ = self._element_kinematics
        Gamma = np.einsum("eki,ek->ei", middle, d) / self.l[:, None] - self._rest_shape[0]
        return np.concatenate([Gamma, self.curvatures], axis=1)

    @property
    def curvatures(self) -> Floats:
        """Twist and curvatures of each element about e1, e2 and e3 (n - 1, 3), 1/m, minus those at rest."""
        found: Floats = (self._relative_rotations - self._rest_shape[1]) / self.l[:, None]
        return found

    @property
    def _relative_rotations(self) -> Floats:
        """Rotation vector from each node to the next, in the axes of the first (n - 1, 3), rad."""
        return rotation_vector(self.R[:-1].transpose(0, 2, 1) @ self.R[1:])

    def _element_end_forces(self, N: Floats, M: Floats, d: Floats, A: Floats) -> tuple[Floats, Floats]:
        """Return forces and moments at the first and the second node of each element, (e, k, 6) each.

        N and M (e, k, 3) are the force and moment of the element, for k cases.
        """
        arm = np.cross(d[:, None], N)
        first = -M - arm + np.einsum("eji,ekj->eki", A, arm)
        second = M - np.einsum("eji,ekj->eki", A, arm)
        return np.concatenate([-N, first], axis=2), np.concatenate([N, second], axis=2)

    def _sum_at_nodes(self, N: Floats, M: Floats, d: Floats, A: Floats) -> Floats:
        """Return the sums at the nodes (n, 6, k) of the forces and moments of elements (see `_element_end_forces`)."""
        first, second = self._element_end_forces(N, M, d, A)
        g = np.zeros((len(self.x), 6, N.shape[1]))
        g[:-1] += first.transpose(0, 2, 1)
        g[1:] += second.transpose(0, 2, 1)
        return g

    def rounding(self, arm: float) -> float:
        """Return the rounding error of the forces, N, if frames were computed from points at a distance `arm`, m."""
        away = EPS * float(np.abs(self.x).max() + self.l.sum())
        weakest = np.linalg.norm(1.0 / self.l)
        turn = away / arm
        own = np.setdiff1d(np.arange(3), self.rigid)
        along = self.C[..., own].max(initial=0.0) * (away * weakest + turn * np.sqrt(len(self.l)))
        return float(along + self.C[..., 3:].max() * turn * weakest / self.l.sum())


def rotation_vector(R: Floats) -> Floats:
    """Return the rotation vectors theta (n, 3), rad, with exp(theta) = R, for rotations below 180 degrees."""
    axial = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    sine, cosine = np.linalg.norm(axial, axis=1), 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0)
    angle = np.arctan2(sine, cosine)
    ratio = np.where(sine > 1e-8, angle / np.maximum(sine, 1e-300), 1.0)
    found: Floats = ratio[:, None] * axial
    return found


def cross_matrix(v: Floats) -> Floats:
    """Return the cross-product matrices [v]x (n, 3, 3) of v (n, 3)."""
    found = np.zeros((len(v), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i, j], found[:, j, i] = -v[:, k], v[:, k]
    return found


def _rotation_series(theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return [theta]x, sin t / t, (1 - cos t) / t^2 and (t - sin t) / t^3, with t = |theta|."""
    t = np.linalg.norm(theta, axis=1)
    safe, small = np.where(t > 1e-3, t, 1.0), t <= 1e-3
    a = np.where(small, 1.0 - t**2 / 6.0, np.sin(safe) / safe)
    b = np.where(small, 0.5 - t**2 / 24.0, 2.0 * np.sin(0.5 * safe) ** 2 / safe**2)
    c = np.where(small, 1.0 / 6.0 - t**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    return cross_matrix(theta), a[:, None, None], b[:, None, None], c[:, None, None]


def exponential(theta: Floats) -> Floats:
    """Return the rotation matrices exp(theta) (n, 3, 3) of vectors theta (n, 3), by Rodrigues' formula."""
    W, a, b, _ = _rotation_series(theta)
    found: Floats = np.eye(3) + a * W + b * (W @ W)
    return found


def left_jacobian(theta: Floats) -> Floats:
    """Return the left Jacobian J (n, 3, 3): exp(theta + d) = exp(J d) exp(theta) to first order in d."""
    W, _, b, c = _rotation_series(theta)
    found: Floats = np.eye(3) + b * W + c * (W @ W)
    return found


def frames_from_arms(ends: Floats, length: Floats) -> Floats:
    """Return rotations (n, 3, 3) that map arms along e2 and e3 to `ends` (n, 2, 3), m.

    `length` (2,), m, are the lengths of the arms.
    """
    e2, e3 = ends[:, 0] / length[0], ends[:, 1] / length[1]
    found: Floats = np.stack([np.cross(e2, e3), e2, e3], axis=2)
    return found
