"""CalculiX: *HYPERELASTIC, NEO HOOKE with the same moduli, its own increments and its own control of convergence.

Another law, psi = C10 (J^(-2/3) tr C - 3) + (J - 1)^2 / D1, and a looser tolerance, 0.5 % of the mean force: its
displacements are near ours, not ours. Written in mm, g and s, for it takes forces below 1e-6 for none.
"""

from __future__ import annotations

import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from protocol import Found, NotConverged, Problem, main

from softmark.interpreter.models.external.adapters import calculix


def deck(problem: Problem, first: float) -> str:
    """Its input, with a first increment of the load."""
    bulk = problem.lam + 2 / 3 * problem.mu
    lines = calculix.nodes(1e3 * problem.points, 1, "ALL")
    kind, numbers = "C3D10" if problem.quadratic else "C3D4", range(1, len(problem.cells) + 1)
    lines += calculix.cells(kind, problem.cells, 1, numbers, "BODY")
    lines += [*calculix.cards_of_set("NSET", "WALL", problem.clamped + 1), "*BOUNDARY", "WALL,1,3"]
    lines += ["*MATERIAL, NAME=M", "*HYPERELASTIC, NEO HOOKE", f"{problem.mu / 2:.12e},{2 / bulk:.12e}"]
    lines += ["*DENSITY", f"{1e-6 * problem.density:.12e}", "*SOLID SECTION, ELSET=BODY, MATERIAL=M"]
    lines += ["*STEP, NLGEOM, INC=1000", "*STATIC", f"{first:g},1.,1e-6,{first:g}"]
    lines += ["*DLOAD", f"BODY,GRAV,{1e3 * problem.gravity:.12e},0.,0.,-1."]
    lines += ["*NODE PRINT, NSET=ALL, FREQUENCY=9999", "U", "*END STEP", ""]
    return "\n".join(lines)


def spent() -> Any:
    """CPU seconds and greatest memory of the programs that were run."""
    return resource.getrusage(resource.RUSAGE_CHILDREN)


def tried(folder: str) -> tuple[int, int]:
    """Increments that were kept, and iterations of all, those given up included."""
    rows = [line.split() for line in (Path(folder) / "job.sta").read_text().splitlines()[2:]]
    return sum(not row[2].endswith("U") for row in rows), sum(int(row[3]) for row in rows)


def solve(problem: Problem, steps: int) -> Found:
    """The beam by CalculiX; the first increment, and the largest, is one over the steps."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "job.inp").write_text(deck(problem, 1 / steps))
        before, wall = spent(), time.perf_counter()
        done = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, env=dict(os.environ))
        wall, after = time.perf_counter() - wall, spent()
        if "Job finished" not in done.stdout:
            raise NotConverged(done.stdout[-200:])
        increments, iterations = tried(folder)
        u = 1e-3 * np.loadtxt(Path(folder) / "job.dat", skiprows=3)[:, 1:]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if np.linalg.det(gradients(problem, u)).min() <= 0 or np.abs(u).max() > 1.5 * problem.points[:, 0].max():
        raise NotConverged(f"cells are inside out, after {cpu:.1f} s")
    outside = {"cpu": cpu, "wall": wall, "peak_mb": after.ru_maxrss / 1024, "setup": float("nan")}
    return Found(
        u, 0.0, iterations, increments, f"CalculiX {calculix.version()}", "another law, 0.5 %", outside=outside
    )


def gradients(problem: Problem, u: Any) -> Any:
    """Deformation gradients (m, 3, 3) of the corners of all cells."""
    X, x = (a[problem.cells[:, 1:4]] - a[problem.cells[:, :1]] for a in (problem.points, problem.points + u))
    return np.linalg.solve(X, x)


if __name__ == "__main__":
    main(solve)
