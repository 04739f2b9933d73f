"""Frames under small loads: the stiffness method, with members whose flexibility is integrated along them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.cantilever import Refused, Vector
from softmark.references.centre_line import points_of
from softmark.references.reference import About, Reference

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Of = Callable[[Array], Array]
else:
    from softmark.references.deferred import np

PLACES, FEW = 24, 4  # of Gauss's rules: for 1 / C, and for loads, which go with areas at most
SMALL = 0.1  # turns, and axial forces against those that buckle: a state beyond is not one of small loads
ROUNDING = 1e-9  # of the largest displacement
LOOSE = 1e-13  # of the largest stiffness: less is none


@dataclass(frozen=True)
class FrameMember:
    """A straight stretch from one node to another, `axes` as rows: along it, and those of its section.

    `stiffness` of stations (n,) is EA, GA2, GA3, GJ, EI2, EI3 (n, 6), `load` what acts along it in space (n, 3), N/m.
    """

    nodes: tuple[int, int]
    length: float  # m
    axes: tuple[Vector, Vector, Vector]
    stiffness: Of
    load: Of

    @cached_property
    def frame(self) -> Array:
        """Its axes (3, 3), as rows."""
        return np.array(self.axes)

    def moved(self, s: Array, force: Array) -> Array:
        """Displacements and turns at stations s (n,) of a cantilever with `force` (6, k) at its end alone: (n, 6, k).

        In its own axes, held where it begins: u = int (gamma + kappa x (s - t)) dt, theta = int kappa dt.
        """
        t, w = _rule(PLACES)
        places, weights = s[:, None] * t, s[:, None] * w  # (n, g)
        arm = _along(self.length - places)  # (n, g, 3, 3)
        n = np.broadcast_to(force[:3], (*places.shape, *force[:3].shape))
        return self._integrated(s, places, weights, n, force[3:] + arm @ n)

    def sagged(self, s: Array) -> Array:
        """The same of its load alone (n, 6)."""
        t, w = _rule(PLACES)
        places, weights = s[:, None] * t, s[:, None] * w
        beyond, also = _rule(FEW)
        rest = self.length - places
        there = places[..., None] + rest[..., None] * beyond  # (n, g, f)
        q = (self.load(there.ravel()) @ self.frame.T).reshape(*there.shape, 3)
        share = rest[..., None] * also
        n = np.einsum("ngf,ngfi->ngi", share, q)
        m = np.einsum("ngf,ngfij,ngfj->ngi", share, _along(there - places[..., None]), q)
        return self._integrated(s, places, weights, n[..., None], m[..., None])[..., 0]

    def _integrated(self, s: Array, places: Array, weights: Array, n: Array, m: Array) -> Array:
        C = self.stiffness(places.ravel()).reshape(*places.shape, 6, 1)
        gamma, kappa = n / C[..., :3, :], m / C[..., 3:, :]
        lever = -_along(s[:, None] - places)  # kappa x (s - t) e1
        u = np.einsum("ng,ngik->nik", weights, gamma + lever @ kappa)
        return np.concatenate([u, np.einsum("ng,ngik->nik", weights, kappa)], axis=1)

    @cached_property
    def flexibility(self) -> Array:
        """What its end moves by under forces and moments there (6, 6), held where it begins."""
        found: Array = self.moved(np.array([self.length]), np.eye(6))[0]
        return found

    @cached_property
    def carried(self) -> Array:
        """What its load comes to about where it begins (6,), in its own axes."""
        t, w = _rule(FEW)
        q = self.load(self.length * t) @ self.frame.T
        moments = np.einsum("f,fij,fj->i", self.length * w, _along(self.length * t), q)
        found: Array = np.concatenate([self.length * w @ q, moments])
        return found

    @cached_property
    def shift(self) -> Array:
        """What its end does where its beginning moves and turns, rigidly (6, 6)."""
        found = np.eye(6)
        found[:3, 3:] = -_along(np.array([self.length]))[0]
        return found

    @cached_property
    def turned(self) -> Array:
        """From space to its own axes, of displacements and turns (6, 6)."""
        found: Array = np.asarray(np.kron(np.eye(2), self.frame), dtype=np.float64)
        return found


def _rule(count: int) -> tuple[Array, Array]:
    """Places and weights of Gauss's rule from 0 to 1."""
    x, w = np.polynomial.legendre.leggauss(count)
    places: Array = 0.5 * (1.0 + x)
    weights: Array = 0.5 * w
    return places, weights


def _along(d: Array) -> Array:
    """The matrices of d e1 x (..., 3, 3)."""
    found: Array = np.zeros((*d.shape, 3, 3))
    found[..., 1, 2], found[..., 2, 1] = -d, d
    return found


@dataclass(frozen=True)
class Frame:
    """Nodes (n, 3), m, with forces and moments on them (n, 6), the members between them, and what holds them.

    `held` are rows (c, 6 n) over displacements and turns in space that are `imposed` (c,), m or rad. `nearest` says of
    points which member they go with, and where its axis begins is `begin` (members, 3).
    """

    X: Array
    forces: Array
    members: tuple[FrameMember, ...]
    held: Array
    imposed: Array
    nearest: Callable[[Array], tuple[Array, Array]]

    def balanced(self) -> FramedAnswer:
        """The equilibrium. Raises Refused where it is free, or not one of small loads."""
        size = 6 * len(self.X)
        K, P = np.zeros((size, size)), self.forces.ravel().copy()
        for member in self.members:
            at = np.concatenate([6 * n + np.arange(6) for n in member.nodes])
            k, p = _of(member)
            K[np.ix_(at, at)] += k
            P[at] += p
        d = self._solved(K, P)
        answer = FramedAnswer(self, d.reshape(-1, 6))
        if not answer.strayed <= SMALL:
            raise Refused(
                f"its turns, and axial forces against those that buckle, come to {100 * answer.strayed:.2g} %",
                "the theory is one of small loads: take smaller ones, or compare two models",
            )
        return answer

    def _solved(self, K: Array, P: Array) -> Array:
        """K d = P in all that the held rows leave free. Raises Refused."""
        extent = float(np.linalg.norm(np.ptp(self.X, axis=0)))
        scale = np.tile([1.0, 1.0, 1.0, *[1.0 / extent] * 3], len(self.X))  # d = scale * y
        A = self.held * scale
        U, s, Vt = np.linalg.svd(A)
        rank = int(np.sum(s > 1e-12 * s.max(initial=0.0)))
        y = Vt[:rank].T @ ((U.T @ self.imposed)[:rank] / s[:rank])
        if np.abs(A @ y - self.imposed).max(initial=0.0) > 1e-9 * max(np.abs(self.imposed).max(initial=0.0), 1e-300):
            raise Refused("its supports contradict each other", "hold each point once")
        Z, own = Vt[rank:].T, K * np.outer(scale, scale)
        free = Z.T @ own @ Z
        values = np.linalg.eigvalsh(free)
        if values.size and values[0] <= LOOSE * values[-1]:
            raise Refused("its supports leave it free", "hold it whole")
        y = y + Z @ np.linalg.solve(free, Z.T @ (scale * P - own @ y))
        found: Array = scale * y
        return found


def _of(member: FrameMember) -> tuple[Array, Array]:
    """The stiffness of a member over both its nodes in space (12, 12), and what its load is there (12,)."""
    stiff, T = np.linalg.inv(member.flexibility), member.shift
    B = np.concatenate([-T, np.eye(6)], axis=1)  # of its end against where its beginning would carry it
    to = np.kron(np.eye(2), member.turned)
    end = B.T @ stiff @ member.sagged(np.array([member.length]))[0]
    own = end + np.concatenate([member.carried, np.zeros(6)])
    return to.T @ (B.T @ stiff @ B) @ to, to.T @ own


@dataclass(frozen=True)
class FramedAnswer:
    """Displacements and turns of the nodes of a frame (n, 6), m and rad."""

    frame: Frame
    d: Array

    def end(self, member: FrameMember) -> tuple[Array, Array]:
        """In the axes of a member what its beginning does, and the forces and moments at its end (6,)."""
        first, last = (member.turned @ self.d[n] for n in member.nodes)
        sag = member.sagged(np.array([member.length]))[0]
        return first, np.linalg.solve(member.flexibility, last - member.shift @ first - sag)

    @cached_property
    def strayed(self) -> float:
        """How far from small it is: its largest turn, and axial forces against those that buckle a mast as long."""
        pressed = 0.0
        for member in self.frame.members:
            bending = member.stiffness(np.array([0.0, member.length]))[:, 4:].min()
            pressed = max(pressed, abs(float(self.end(member)[1][0])) * 4.0 * member.length**2 / (math.pi**2 * bending))
        return float(np.abs(self.d[:, 3:]).max()) + pressed

    @cached_property
    def estimated_error(self) -> float:
        """Of the displacement of any point, m: what grows with the square of loads, by its order, and rounding."""
        return float((self.strayed + ROUNDING) * np.linalg.norm(self.d[:, :3], axis=1).max())

    def displacement(self, X: Array) -> Array:
        """Of points X (n, 3) of the undeformed frame (n, 3), m. Raises Refused for what is no point."""
        points = points_of(X)
        which, begin = self.frame.nearest(points)
        found: Array = np.zeros_like(points)
        for number in np.unique(which).tolist():
            here, member = which == number, self.frame.members[number]
            local = (points[here] - begin[here]) @ member.frame.T
            s = np.clip(local[:, 0], 0.0, member.length)
            first, force = self.end(member)
            moved = member.moved(s, force[:, None])[..., 0] + member.sagged(s)
            moved[:, :3] += first[:3] + np.cross(first[3:], np.outer(s, [1.0, 0.0, 0.0]))
            moved[:, 3:] += first[3:]
            local[:, 0] -= s
            found[here] = (moved[:, :3] + np.cross(moved[:, 3:], local)) @ member.frame
        return found


@dataclass(frozen=True)
class FrameTheory(Reference):
    """A network of beams under small loads: the stiffness method, exact for its members.

    Members are straight, with stretch, bending, torsion and shear, joined rigidly; of those that taper the flexibility
    is integrated. Gravity, forces and lines of force on axes and torques at points act on the undeformed frame, and
    supports hold points, or move them; a member that is held all along is so at every sixteenth. It is linear: its
    error is what turns and axial forces of second order come to, by their order, and it refuses a state in which these
    are a tenth. It shares no code with models.
    Source: Livesley, "Matrix Methods of Structural Analysis" (1964); Przemieniecki (1968), chapter 5; Cowper (1966).
    """

    body: Annotated[Any, "body", "the network"]

    wired: ClassVar[bool] = True
    about: ClassVar[About] = "frame"
    means: ClassVar[str] = "linear"
    source: ClassVar[str] = "Livesley 1964, Matrix Methods of Structural Analysis"
    error_meaning: ClassVar[str] = "of the displacement of any point, m: what is of second order in the load"

    def solve(self, frame: Frame) -> FramedAnswer:
        """What it says. Raises Refused."""
        return frame.balanced()
