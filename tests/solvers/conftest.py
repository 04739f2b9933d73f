"""What the tests of the solvers share: energies, supports and problems of solids, and of a few particles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from equal_moduli import made

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.dynamics import Integrator
from softmark.solvers.dynamics.dynamic_problem import Dynamics
from softmark.solvers.dynamics.trajectory import Trajectory
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.materials import MATERIALS, Law, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.statics.static_equilibrium import Statics


@pytest.fixture(scope="session")
def law() -> Callable[..., Law]:
    """A law by its name: `small`, `corotational`, or a material's own law of finite strain."""

    def make(name: str, young: float = 1.0, poisson: float = 0.3) -> Law:
        if name in MATERIALS:
            return law_for(made(name, young, poisson), "finite")
        return law_for(MATERIALS["linear_elastic"](young, poisson, 1.0), name)

    return make


@pytest.fixture(scope="session")
def elastic() -> Callable[[Mesh, Law], Elastic]:
    """The elastic energy of a law over the cells of a mesh."""

    def make(mesh: Mesh, law: Law) -> Elastic:
        parts = integrate_cells(mesh)
        return Elastic(mesh.cells, parts.dNdX, parts.w, law)

    return make


@pytest.fixture(scope="session")
def weight() -> Callable[[Mesh, tuple[float, float, float]], DeadForces]:
    """Forces of a body force b (N/m^3): a quarter of each cell's to each of its nodes."""

    def make(mesh: Mesh, b: tuple[float, float, float]) -> DeadForces:
        f = np.zeros_like(mesh.points)
        np.add.at(f, mesh.cells, (mesh.volumes / 4)[:, None, None] * np.array(b))
        return DeadForces(f.ravel())

    return make


@pytest.fixture(scope="session")
def problem() -> Callable[..., Statics]:
    """The static problem of an energy: `held` (n,) nodes or (n, 3) components are moved by `to` (n, 3)."""

    def make(
        mesh: Mesh,
        energy: Energy,
        held: np.ndarray,
        loads: Sequence[Energy] = (),
        to: Any = 0.0,
        **options: Any,
    ) -> Statics:
        chosen = np.broadcast_to(held if held.ndim == 2 else held[:, None], mesh.points.shape)
        fixed = np.flatnonzero(chosen.ravel())
        target = np.broadcast_to(to, mesh.points.shape)[chosen]
        dofs = mesh.points.size
        assembly = Assembly(dofs, fixed, [energy], loads)
        rest = options.pop("rest", np.zeros(dofs))
        return Statics(assembly, VectorSpace(dofs), rest, fixed, target, **options)

    return make


@pytest.fixture(scope="session")
def sampled() -> Callable[[Callable[[float], float]], Sampled]:
    """A course from its values."""
    return Sampled


@dataclass(frozen=True)
class Sampled:
    """A smooth course from its values, its means by Gauss's rule of 12 points."""

    at: Callable[[float], float]

    def mean(self, begin: float, end: float) -> float:
        s, w = np.polynomial.legendre.leggauss(12)
        t = begin + 0.5 * (end - begin) * (1.0 + s)
        return 0.5 * sum(float(b) * self.at(float(a)) for a, b in zip(t, w, strict=True))


# ------------------------------------------------------------------ a few particles


@dataclass(frozen=True)
class Spring(Energy):
    """k/2 (|y_b - y_a| - l)^2 between particles; y = `points` + x."""

    points: np.ndarray  # (n, 3)
    pairs: np.ndarray  # (s, 2)
    k: float
    length: float
    cubic: float = 0.0  # of a further cubic/4 (|d| - l)^4
    conservative: bool = True

    @property
    def stencils(self) -> np.ndarray:
        return (3 * self.pairs[:, :, None] + np.arange(3)).reshape(len(self.pairs), 6)

    def _stretch(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        y = (self.points + x.reshape(-1, 3))[self.pairs]
        d = y[:, 1] - y[:, 0]
        return d, np.linalg.norm(d, axis=1) - self.length

    def value(self, x: np.ndarray) -> float:
        e = self._stretch(x)[1]
        return float(np.sum(self.k / 2 * e**2 + self.cubic / 4 * e**4))

    def add_gradient(self, x: np.ndarray, g: np.ndarray, scale: float = 1.0) -> None:
        d, e = self._stretch(x)
        pull = scale * ((self.k * e + self.cubic * e**3) / (e + self.length))[:, None] * d
        np.add.at(g.reshape(-1, 3), self.pairs[:, 1], pull)
        np.add.at(g.reshape(-1, 3), self.pairs[:, 0], -pull)

    def add_hessian(
        self, x: np.ndarray, data: np.ndarray, slots: np.ndarray, scale: float = 1.0, projected: bool = False
    ) -> None:
        d, e = self._stretch(x)
        n = d / (e + self.length)[:, None]
        along = np.einsum("si,sj->sij", n, n)
        across = (self.k * e + self.cubic * e**3) / (e + self.length)
        if projected:
            across = np.maximum(across, 0.0)
        H = along * (self.k + 3 * self.cubic * e**2)[:, None, None] + across[:, None, None] * (np.eye(3) - along)
        block = scale * np.block([[H, -H], [-H, H]]) if len(H) == 1 else scale * np.concatenate(
            [np.concatenate([H, -H], axis=2), np.concatenate([-H, H], axis=2)], axis=1
        )  # fmt: skip
        keep = slots >= 0
        np.add.at(data, slots[keep], block.reshape(slots.shape)[keep])

    def rounding(self, x: np.ndarray) -> float:
        return 1e-16 * self.k * self.length


@dataclass(frozen=True)
class Quadratic(Energy):
    """x . K x / 2 with a dense K."""

    K: np.ndarray
    conservative: bool = True

    @property
    def stencils(self) -> np.ndarray:
        return np.arange(len(self.K))[None]

    def value(self, x: np.ndarray) -> float:
        return float(0.5 * x @ self.K @ x)

    def add_gradient(self, x: np.ndarray, g: np.ndarray, scale: float = 1.0) -> None:
        g += scale * self.K @ x

    def add_hessian(
        self, x: np.ndarray, data: np.ndarray, slots: np.ndarray, scale: float = 1.0, projected: bool = False
    ) -> None:
        keep = slots[0] >= 0
        np.add.at(data, slots[0][keep], scale * self.K[keep])

    def rounding(self, x: np.ndarray) -> float:
        return 1e-16 * float(np.linalg.norm(self.K)) * float(np.linalg.norm(x))


@pytest.fixture(scope="session")
def spring() -> type[Spring]:
    """The energy of springs between particles."""
    return Spring


@pytest.fixture(scope="session")
def quadratic() -> type[Quadratic]:
    """The energy of a dense stiffness."""
    return Quadratic


@pytest.fixture(scope="session")
def oscillators() -> Callable[..., Dynamics]:
    """Two oscillators of mass 1 and angular frequency 1: a cosine and a sine."""

    def make(integrator: Integrator, **options: Any) -> Dynamics:
        assembly = Assembly(2, np.zeros(0, dtype=np.int64), [Quadratic(np.eye(2))], [])
        rest, velocity = np.array([1.0, 0.0]), np.array([0.0, 1.0])
        return Dynamics(assembly, np.ones(2), rest, velocity, integrator=integrator, tolerance=1e-13, **options)

    return make


@pytest.fixture(scope="session")
def states() -> Callable[[Trajectory], np.ndarray]:
    """The states (t, dofs) that a march went through."""
    return lambda path: np.array([motion.x for motion in path.observed])
