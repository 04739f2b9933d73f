"""What every package is given and gives back: arrays of a mesh in, displacements and costs out.

A package runs in a process of its own, with one thread: `python by_NAME.py MESH.npz WARM.npz OUT STEPS`. It solves
WARM.npz first, a coarse mesh under a hundredth of the load, so that whatever it compiles or caches is there; then
MESH.npz in STEPS equal load steps. OUT.json gets the costs and OUT.npy the displacements (n, 3) of the mesh's points.
"""
# ruff: noqa: E402 - threads must be set before anything that reads their number is imported

from __future__ import annotations

import os

for name in (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "NGS_NUM_THREADS",
):
    os.environ[name] = "1"

import json
import resource
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cache
from typing import Any

import numpy as np

TOLERANCE = 1e-8  # out-of-balance force over the larger of load and reactions
BETWEEN = 1e-3  # the same in load steps before the last: nobody needs those to rounding
CAP = 40  # iterations after which a load step has failed


class NotConverged(Exception):
    """The package found no equilibrium with these load steps."""


@dataclass(frozen=True)
class Problem:
    """The clamped beam under its own weight, SI units."""

    points: Any  # (n, 3) m
    cells: Any  # (m, 4) or (m, 10), nodes in the order of VTK
    young: float
    poisson: float
    density: float
    gravity: float

    @property
    def quadratic(self) -> bool:
        """Whether the cells have ten nodes."""
        return bool(self.cells.shape[1] == 10)

    @property
    def mu(self) -> float:
        """Shear modulus, Pa."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def lam(self) -> float:
        """Lame's first modulus, Pa."""
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    @property
    def corners(self) -> int:
        """How many points are corners; they come first."""
        return int(self.cells[:, :4].max()) + 1

    @property
    def clamped(self) -> Any:
        """Points of the wall."""
        return np.nonzero(self.points[:, 0] < 1e-9)[0]

    @property
    def rule(self) -> tuple[Any, Any]:
        """Integration points (q, 3) and weights (q,) on the unit tetrahedron: those that we use."""
        if not self.quadratic:
            return np.full((1, 3), 0.25), np.array([1 / 6])
        a = (5 - 5**0.5) / 20
        places = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        return a + (1 - 4 * a) * places, np.full(4, 1 / 24)


@dataclass
class Found:
    """Displacements (n, 3) m, the clock when set-up was done, and what it took."""

    u: Any
    ready: float  # process time
    iterations: int
    steps: int
    version: str
    note: str = ""
    aside: float = 0.0  # wall seconds of a compiler, to leave out
    outside: dict[str, float] = field(default_factory=dict)  # costs of a program that was run: cpu, wall, peak_mb


def read(path: str) -> Problem:
    """A problem from its file."""
    with np.load(path) as data:
        scalars = {name: float(data[name]) for name in ("young", "poisson", "density", "gravity")}
        return Problem(data["points"], data["cells"], **scalars)


def balanced(free: Any, fixed: Any, load: Any, tolerance: float) -> bool:
    """Whether a residual is small. Raises NotConverged where it is not finite."""
    size = float(np.linalg.norm(free))
    if not np.isfinite(size):
        raise NotConverged
    return size <= tolerance * max(float(np.linalg.norm(fixed)), float(np.linalg.norm(load)))


def tolerance_at(part: float) -> float:
    """The tolerance of a load step that ends at this part of the load."""
    return TOLERANCE if part == 1.0 else BETWEEN


@cache
def symmetric_pardiso() -> Callable[[Any, Any], Any]:
    """A solver by MKL Pardiso of symmetric matrices, half of pypardiso's default cost."""
    import scipy.sparse as sp
    from pypardiso import PyPardisoSolver

    pardiso = PyPardisoSolver(mtype=-2)

    def solve(A: Any, b: Any) -> Any:
        if not np.all(np.isfinite(b)):
            raise NotConverged
        upper = sp.triu(A, format="csr")
        pardiso._check_A(upper)
        pardiso.set_phase(13)
        return pardiso._call_pardiso(upper, pardiso._check_b(upper, b))

    return solve


def main(solve: Callable[[Problem, int], Found]) -> None:
    """Warm up, solve, write."""
    mesh, warm, out, steps = sys.argv[1:5]
    warnings.simplefilter("ignore")
    problem = read(mesh)
    try:
        solve(read(warm), 1)
        wall, cpu = time.perf_counter(), time.process_time()
        found = solve(problem, int(steps))
        wall, total = time.perf_counter() - wall, time.process_time() - cpu
    except Exception as error:  # packages give up in many ways
        with open(out + ".json", "w") as file:
            json.dump({"converged": False, "message": f"{type(error).__name__}: {error}"[:300]}, file)
        return
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    row = asdict(found) | {
        "converged": True,
        "cpu": total,
        "wall": wall - found.aside,
        "peak_mb": peak,
        "setup": found.ready - cpu,
    }
    row |= found.outside
    for name in ("u", "ready", "outside"):
        del row[name]
    np.save(out + ".npy", found.u)
    with open(out + ".json", "w") as file:
        json.dump(row, file)
