"""Static neo-Hookean beam under full gravity: our CPU time against FElupe's with pardiso, one mesh, one run.

    python tests/benchmarks/static_beam.py [--repeat 5] [--section 0.0065] [--along 0.00494]

One thread, repetitions interleaved (ours, theirs, ours, ...), medians of CPU time, compilation and imports
excluded. Both start from rest and end at a relative residual of 1e-8; FElupe ramps the load in as few equal
steps as it converges with. A measurement, not a test: nothing is asserted, and the largest difference is
printed.
"""
# ruff: noqa: E402 - threads must be set before anything that reads their number is imported

from __future__ import annotations

import os

for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"

import argparse
import cProfile
import pstats
import statistics
import time
import warnings
from collections.abc import Callable
from functools import partial
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
PARTS = {  # file and functions, and what their time (with that of all they call) is spent on
    ("structured.py", ("disc", "extrude", "split")): "mesh",
    ("assembly.py", ("prepare",)): "pattern",
    ("assembly.py", ("tangent",)): "tangents",
    ("assembly.py", ("gradient", "value")): "forces and energies",
    ("linear.py", ("factor",)): "factorisation",
    ("linear.py", ("solve",)): "solution of systems",
}


def prepared(section: float, along: float) -> Any:
    """Our model, on a mesh with edges of about `section` across and `along` the axis (m)."""
    scene = loads(SCENE.format(size=section)).scene
    declared, case = scene.declared["solid"], case_of(scene, scene.declared["beam"].name)
    mesh = split(*extrude(disc(0.019, section), 0.178, along))
    mesh = Mesh(np.ascontiguousarray(mesh.points[:, [2, 0, 1]]), mesh.cells)  # the axis along x
    return declared.thing.prepare(declared, case, Workshop({("beam", "tet4", section): mesh}))


def solved(model: Any) -> Any:
    """Our solution."""
    return model.solve(lambda iteration: None)


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
        found = felupe.newtonraphson(
            items=[body, weight],
            x0=field,
            dof0=dof0,
            dof1=dof1,
            ext0=felupe.dof.apply(field, clamp, dof0),
            solver=spsolve,
            tol=1e-8,
            maxiter=40,
            verbose=0,
        )
        iterations += found.iterations
    return np.array(field[0].values), iterations


def fewest_steps(mesh: Mesh) -> int:
    """The load steps with which FElupe converges."""
    for steps in (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 24, 32):
        try:
            felupe_run(mesh, steps)
        except Exception:  # it gives up in several ways
            continue
        return steps
    raise SystemExit("FElupe converges with none of the load steps that were tried")


def cpu(action: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of an action, and what it returns."""
    start = time.process_time()
    value = action()
    return time.process_time() - start, value


def profile(section: float, along: float) -> dict[str, tuple[int, float]]:
    """Calls and CPU seconds of our parts in one run; the profiler itself adds a little to each."""
    watch = cProfile.Profile(time.process_time)
    watch.runcall(lambda: solved(prepared(section, along)))
    found = dict.fromkeys(PARTS.values(), (0, 0.0))
    for (file, _, name), (_, calls, _, seconds, _) in pstats.Stats(watch).stats.items():  # type: ignore[attr-defined]
        for (where, names), part in PARTS.items():
            if name in names and file.endswith(os.sep + where) and "softmark" not in name:
                found[part] = (found[part][0] + calls, found[part][1] + seconds)
    return found


def compare(options: argparse.Namespace) -> None:
    """Print the table."""
    model = prepared(options.section, options.along)
    model.warm()
    steps = fewest_steps(model.mesh)
    set_up, own, theirs = [], [], []
    for _ in range(options.repeat):
        seconds, model = cpu(partial(prepared, options.section, options.along))
        set_up.append(seconds)
        seconds, solution = cpu(partial(solved, model))
        own.append(seconds)
        seconds, (u, iterations) = cpu(partial(felupe_run, model.mesh, steps))
        theirs.append(seconds)
    difference = np.abs(solution.displacement(model.mesh.points) - u).max() / np.abs(u).max()
    print(f"{len(model.mesh.cells)} tetrahedra, {model.size['dofs']} unknowns")
    print(f"largest difference: {difference:.1e} of the largest displacement")
    print(f"{'CPU seconds':<28}{'median':>8}{'min':>8}{'max':>8}")
    facts = solution.facts
    for label, times, note in (
        ("softmark, scene to set-up", set_up, ""),
        ("softmark, solution", own, f"{facts['iterations']} iterations, {facts['steps']} load step"),
        ("FElupe with pardiso, all", theirs, f"{iterations} iterations, {steps} load steps"),
    ):
        row = f"{label:<28}{statistics.median(times):>8.3f}{min(times):>8.3f}{max(times):>8.3f}"
        print(f"{row}   {note}".rstrip())
    ratios = [(a + b) / c for a, b, c in zip(set_up, own, theirs, strict=True)]
    print(f"ratio of all of softmark to FElupe: {statistics.median(ratios):.2f}")


def main() -> None:
    """Compare, then show where our time goes."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--section", type=float, default=6.5e-3, help="edge length across, m")
    parser.add_argument(
        "--along", type=float, default=4.94e-3, help="edge length along, m; the defaults give 5760 cells"
    )
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    compare(options)
    print("\nsoftmark, one run under the profiler")
    for part, (calls, seconds) in profile(options.section, options.along).items():
        print(f"{part:<28}{seconds:>8.3f}   {calls} calls")


if __name__ == "__main__":
    main()
