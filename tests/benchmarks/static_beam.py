"""Static neo-Hookean beam under full gravity: our CPU time against FElupe's with pardiso, on one mesh, in one run.

    python tests/benchmarks/static_beam.py [--repeat 5] [--section 0.0065] [--along 0.00494]

One thread, repetitions interleaved (ours, theirs, ours, ...), medians of CPU time, compilation and imports excluded.
Both start from rest and end at a relative residual of 1e-8; FElupe ramps the load in as few equal steps as it
converges with. A measurement, not a test: nothing is asserted but that the two agree.
"""

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"  # before anything that reads it is imported

import argparse
import statistics
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from softmark.interpreter.api import loads
from softmark.interpreter.case import case_of
from softmark.interpreter.models.prepared import Workshop
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.structured import disc, extrude, split

SCENE = """
material silicone = neo_hookean(young = 60 kPa, poisson = 0.49, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model solid = fem(tet4, strain = finite, size = {size} m)
probe tip = point(beam, at = (178, 0, 0) mm)
"""
E, NU, DOWN = 60e3, 0.49, np.array([0.0, 0.0, -1070 * 9.81])


def prepared(section: float, along: float) -> Any:
    """Our model, on a mesh with edges of about `section` across and `along` the axis (m)."""
    scene = loads(SCENE.format(size=section)).scene
    declared, case = scene.declared["solid"], case_of(scene, scene.declared["beam"].name)
    mesh = split(*extrude(disc(0.019, section), 0.178, along))
    mesh = Mesh(np.ascontiguousarray(mesh.points[:, [2, 0, 1]]), mesh.cells)  # the axis along x
    return declared.thing.prepare(declared, case, Workshop({("beam", "tet4", section): mesh}))


def felupe_run(mesh: Mesh, steps: int) -> tuple[np.ndarray, int]:
    """Displacements and Newton iterations of FElupe."""
    import felupe
    from pypardiso import spsolve

    region = felupe.RegionTetra(felupe.Mesh(mesh.points, mesh.cells, "tetra"))
    field = felupe.FieldContainer([felupe.Field(region, dim=3)])
    clamp = {"wall": felupe.Boundary(field[0], fx=0.0)}
    dof0, dof1 = felupe.dof.partition(field, clamp)
    law = felupe.NeoHookeCompressible(mu=E / (2 * (1 + NU)), lmbda=E * NU / ((1 + NU) * (1 - 2 * NU)))
    body, weight = felupe.SolidBody(law, field), felupe.SolidBodyForce(field)
    iterations = 0
    for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
        weight.update(part * DOWN)
        found = felupe.newtonraphson(items=[body, weight], x0=field, dof0=dof0, dof1=dof1, tol=1e-8, maxiter=40, verbose=0,
                                     solver=spsolve, ext0=felupe.dof.apply(field, clamp, dof0))  # fmt: skip
        iterations += found.iterations
    return np.array(field[0].values), iterations


def fewest_steps(mesh: Mesh) -> int:
    for steps in (1, 2, 3, 4, 6, 8, 12, 16, 24, 32):
        try:
            felupe_run(mesh, steps)
        except Exception:  # FElupe gives up in several ways
            continue
        return steps
    raise SystemExit("FElupe converges with none of the load steps that were tried")


def cpu(action: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    value = action()
    return time.process_time() - start, value


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--section", type=float, default=6.5e-3, help="edge length across, m")
    parser.add_argument("--along", type=float, default=4.94e-3, help="edge length along, m; the defaults give 5760 cells")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    model = prepared(options.section, options.along)
    model.warm()
    steps = fewest_steps(model.mesh)
    set_up, own, theirs = [], [], []
    for _ in range(options.repeat):
        seconds, model = cpu(lambda: prepared(options.section, options.along))
        set_up.append(seconds)
        seconds, solution = cpu(lambda: model.solve(lambda iteration: None))
        own.append(seconds)
        seconds, (u, iterations) = cpu(lambda: felupe_run(model.mesh, steps))
        theirs.append(seconds)
    ours = solution.displacement(model.mesh.points)
    difference = np.abs(ours - u).max() / np.abs(u).max()
    print(f"{len(model.mesh.cells)} tetrahedra, {model.size['dofs']} unknowns, largest difference {difference:.1e} of the displacement")
    row = "{:<28}{:>8.3f}{:>8.3f}{:>8.3f} s CPU   {}"
    print(f"{'':<28}{'median':>8}{'min':>8}{'max':>8}")
    for label, times, note in (
        ("softmark, mesh and set-up", set_up, ""),
        ("softmark, solve", own, f"{solution.facts['iterations']} iterations, {solution.facts['steps']} load step"),
        ("FElupe with pardiso, all", theirs, f"{iterations} iterations, {steps} load steps"),
    ):
        print(row.format(label, statistics.median(times), min(times), max(times), note))
    both = [a + b for a, b in zip(set_up, own, strict=True)]
    print(f"ratio, set-up and solve to FElupe: {statistics.median(a / b for a, b in zip(both, theirs, strict=True)):.2f}")


if __name__ == "__main__":
    main()
