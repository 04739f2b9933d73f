"""One implicit Euler step of a corotational beam: CPU time of each frame of a release under gravity, one core.

    python tests/benchmarks/realtime_step.py [--seconds 1] [--cells 1000 5000 20000] [--tolerance 1e-6]

The beam of 178 mm by 19 mm radius, E = 60 kPa, nu = 0.49, 1070 kg/m^3, lumped mass, clamped at one end, is let go
at t = 0; dt = 10 ms. Ways of taking the step:

* `lagged`: the state is extrapolated, one tangent with the pressures of the last two states is factorised there
  in single precision, and its factor is used until the out-of-balance force is at most the tolerance times the
  weight (with Anderson's acceleration over two steps);
* `newton`: the same predictor and tolerance, the exact tangent of every iteration, systems solved to 1e-6 by
  `LinearSolver`; from the last state where the extrapolated one has an indefinite tangent;
* `linear`: one Newton iteration from the last state, its system solved to 1e-6: what most real-time codes do. It
  does not balance the forces; the table says by how much.

Compilation, mesh and analysis of the pattern are left out. The tip after 0.25 s is compared with the
solution of the same equations to 1e-10. A measurement, not a test: nothing is asserted.
"""
# ruff: noqa: E402 - threads must be set before anything that reads their number is imported

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"

import argparse
import time
from dataclasses import dataclass, field
from math import comb

import numpy as np

from softmark.solvers.assembly import Assembly
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.energy import Floats
from softmark.solvers.materials.corotational import Corotational
from softmark.solvers.mesh.splits import split
from softmark.solvers.mesh.structured import disc, extrude
from softmark.solvers.sparse.cholesky import Cholesky
from softmark.solvers.sparse.solver import LinearSolver
from softmark.solvers.sparse.symbolic import analyse

L, R, E, NU, RHO, DOWN = 0.178, 0.019, 60e3, 0.49, 1070.0, 9.81
SIZES = {1000: (0.010, 18), 5000: (0.006, 32), 20000: (0.005, 48)}  # edges across (m), layers along
ORDER = 5  # of the extrapolation
DEPTH = 2  # of Anderson's acceleration
LIMIT = 30


class Beam:
    """Energy, mass and load of the clamped beam; `g` (dofs,) the weight."""

    def __init__(self, cells: int) -> None:
        across, layers = SIZES[cells]
        mesh = split(*extrude(disc(R, across), L, L / layers))
        self.points = np.ascontiguousarray(mesh.points[:, [2, 0, 1]])
        edges = self.points[mesh.cells[:, 1:]] - self.points[mesh.cells[:, :1]]  # (m, 3, 3), rows
        volumes = np.linalg.det(edges) / 6.0
        inner = np.linalg.inv(edges).transpose(0, 2, 1)
        dNdX = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)[:, None]
        law = Corotational(E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU)))
        self.energy = CorotationalTets(mesh.cells, np.ascontiguousarray(dNdX), volumes[:, None].copy(), law)
        held = np.flatnonzero(np.repeat(self.points[:, 0] < 1e-9, 3))
        self.assembly = Assembly(self.points.size, held, [self.energy], [])
        nodal = np.bincount(mesh.cells.ravel(), np.repeat(0.25 * RHO * volumes, 4))
        self.mass = np.repeat(nodal, 3)
        self.weight = np.zeros(self.points.size)
        self.weight[2::3] = -DOWN * nodal
        self.free = self.assembly.free
        self.scale = float(np.linalg.norm(self.weight[self.free]))
        self.tip = 3 * int(np.argmin(np.linalg.norm(self.points - [L, 0, 0], axis=1)))


@dataclass
class Release:
    """States at equal steps from rest, the latest first, and what each step took."""

    beam: Beam
    dt: float = 0.01
    tolerance: float = 1e-6
    states: list[Floats] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    iterations: list[int] = field(default_factory=list)
    residuals: list[float] = field(default_factory=list)
    tips: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        beam = self.beam
        pattern = beam.assembly.pattern
        self.data = np.zeros(len(pattern.indices))
        self.K = pattern.matrix(self.data)
        row = np.repeat(np.arange(pattern.size), np.diff(pattern.indptr))
        self.diagonal = np.flatnonzero(row == pattern.indices)
        self.slots = pattern.slots[0]
        self.inertia = beam.mass / self.dt**2
        self.inner = self.inertia[beam.free]
        rest = np.zeros(beam.points.size)
        self.states = [rest, rest]  # implicit Euler begins with no velocity
        self.traces = [
            np.zeros(len(beam.energy.cells)) for _ in range(3)
        ]  # of the last two states, and of this one

    def predicted(self, order: int) -> Floats:
        """Extrapolation of that order over the states there are."""
        order = min(order, len(self.states) - 2)
        weights = [(-1) ** k * comb(order + 1, k + 1) for k in range(order + 1)]
        x: Floats = np.array(weights, dtype=np.float64) @ np.array(self.states[: order + 1])
        return x

    def ballistic(self) -> Floats:
        """x_n + dt v_n: what the inertial force is measured from."""
        return 2.0 * self.states[0] - self.states[1]

    def load(self, x: Floats, free_flight: Floats) -> Floats:
        """Inertial force less weight (dofs,): what the elastic forces are added to."""
        return self.inertia * (x - free_flight) - self.beam.weight

    def relative(self, r: Floats) -> float:
        """Size of a residual in weights."""
        return float(np.linalg.norm(r)) / self.beam.scale

    def frame(self) -> None:
        """One step, timed."""
        start = time.process_time()
        x, iterations, residual = self.step()
        self.states = [x, *self.states[: ORDER + 1]]
        self.seconds.append(time.process_time() - start)
        self.iterations.append(iterations)
        self.residuals.append(residual)
        self.tips.append(x[self.beam.tip : self.beam.tip + 3].copy())

    def step(self) -> tuple[Floats, int, float]:
        """The new state, iterations and relative residual."""
        raise TypeError("a Release knows no way of taking a step")


class Lagged(Release):
    """One factor a step, of a tangent with the pressures of the last states."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.cholesky = Cholesky(analyse(self.K), "single")

    def step(self) -> tuple[Floats, int, float]:
        beam, free = self.beam, self.beam.free
        x, flight = self.predicted(ORDER), self.ballistic()
        g = self.load(x, flight)
        last, earlier, now = self.traces
        self.data[:] = 0.0
        beam.energy.add_both_lagged(x, g, self.data, self.slots, 2.0 * last - earlier)
        self.data[self.diagonal] += self.inner
        self.cholesky.factorise(self.data)
        r = g[free]
        mixer = Mixer()
        for number in range(LIMIT):
            residual = self.relative(r)
            if residual <= self.tolerance and number:
                self.traces = [now, last, earlier]
                return x, number, residual
            x[free] += mixer.step(self.cholesky.solve(r))
            g = self.load(x, flight)
            beam.energy.add_gradient_kept(x, g, now)
            r = g[free]
        raise ArithmeticError(f"no balance in {LIMIT} iterations")


class Mixer:
    """Anderson's acceleration (1965; Walker and Ni 2011) of x <- x - z(x)."""

    def __init__(self) -> None:
        self.steps: list[Floats] = []
        self.changes: list[Floats] = []
        self.z = np.zeros(0)

    def step(self, z: Floats) -> Floats:
        """What to add to x."""
        d = -z
        if self.steps:
            self.changes = [*self.changes, z - self.z][-DEPTH:]
            A, D = np.array(self.changes), np.array(self.steps)
            d = d - np.linalg.solve(A @ A.T, A @ z) @ (D - A)
        self.z = z
        self.steps = [*self.steps, d][-DEPTH:]
        return d


class Newton(Release):
    """The exact tangent in every iteration."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.solver = LinearSolver()

    def step(self) -> tuple[Floats, int, float]:
        fallbacks = self.solver.statistics.indefinite
        x, number, residual = self.iterate(self.predicted(ORDER), LIMIT, fallbacks)
        if not residual <= self.tolerance:
            x, more, residual = self.iterate(self.states[0].copy(), LIMIT, -1)
            number += more
        if not residual <= self.tolerance:
            raise ArithmeticError(f"no balance in {LIMIT} iterations")
        return x, number, residual

    def iterate(self, x: Floats, limit: int, indefinite: int) -> tuple[Floats, int, float]:
        """Newton from x; gives up where more matrices than `indefinite` are not definite, unless that is -1."""
        free, flight = self.beam.free, self.ballistic()
        r = self.tangent(x, flight)
        for number in range(limit):
            residual = self.relative(r)
            if residual <= self.tolerance and number:
                return x, number, residual
            x[free] -= self.solver.solve(self.K, r, max(1e-6, min(1e-3, 0.3 * self.tolerance / residual)))
            if 0 <= indefinite < self.solver.statistics.indefinite:
                return x, number + 1, np.inf
            r = self.tangent(x, flight)
        return x, limit, self.relative(r)

    def tangent(self, x: Floats, flight: Floats) -> Floats:
        """The residual (free,); the tangent into K."""
        g = self.load(x, flight)
        self.data[:] = 0.0
        self.beam.energy.add_both(x, g, self.data, self.slots)
        self.data[self.diagonal] += self.inner
        return g[self.beam.free]


class Linear(Newton):
    """One Newton iteration from the last state. Its residual is taken outside the clock."""

    def step(self) -> tuple[Floats, int, float]:
        x = self.states[0].copy()
        r = self.tangent(x, self.ballistic())
        x[self.beam.free] -= self.solver.solve(self.K, r, 1e-6)
        return x, 1, np.nan

    def frame(self) -> None:
        flight = self.ballistic()
        super().frame()
        g = self.load(self.states[0], flight)
        self.beam.energy.add_gradient(self.states[0], g)
        self.residuals[-1] = self.relative(g[self.beam.free])


WAYS = {"lagged": Lagged, "newton": Newton, "linear": Linear}


def run(release: Release, frames: int) -> Release:
    """A release of so many frames."""
    for _ in range(frames):
        release.frame()
    return release


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--cells", type=int, nargs="+", default=list(SIZES), choices=list(SIZES))
    parser.add_argument("--tolerance", type=float, default=1e-6)
    options = parser.parse_args()
    frames = round(options.seconds / 0.01)
    small = Beam(1000)
    for way in WAYS.values():
        run(way(small), 3)  # compiles
    for cells in options.cells:
        beam = Beam(cells)
        print(f"\n{len(beam.energy.cells)} tetrahedra, {len(beam.points)} nodes, {len(beam.free)} unknowns")
        print("CPU ms      median     p95     p99   worst   its  most  residual  tip at 0.25 s, mm")
        tight = run(Newton(beam, tolerance=1e-10), min(25, frames)).tips
        for name, way in WAYS.items():
            done = run(way(beam, tolerance=options.tolerance), frames)
            ms = 1e3 * np.array(done.seconds)
            tip = 1e3 * done.tips[len(tight) - 1]
            off = np.linalg.norm(tip / 1e3 - tight[-1]) / np.linalg.norm(tight[-1])
            print(
                f"{name:<10}{np.median(ms):>8.2f}{np.percentile(ms, 95):>8.2f}"
                f"{np.percentile(ms, 99):>8.2f}{ms.max():>8.2f}"
                f"{np.median(done.iterations):>6.0f}{max(done.iterations):>6}{max(done.residuals):>10.0e}"
                f"  {tip[0]:.3f} {tip[2]:.3f}, off by {off:.0e}"
            )


if __name__ == "__main__":
    main()
