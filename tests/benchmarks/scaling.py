"""Time and memory against size: a static solve at small strain from 5 000 to 1 000 000 linear tetrahedra.

    python tests/benchmarks/scaling.py [--poisson 0.3] [--sizes 6.5,3.6,2.1,1.6,1.17] [--method auto] [--threads 1]

A silicone beam that is clamped at one end bends under its weight, from the text of a scene to the report, each size in
a process of its own. CPU seconds: set-up is mesh, elements, loads and pattern; solve is tangent, factor or multigrid,
and iterations. Peak memory is that of the whole process. The exponents are slopes of least squares in logarithms, over
all sizes. A measurement, not a test: nothing is asserted.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from typing import Any

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
SCENE = """
material silicone = neo_hookean(young = 60 kPa, poisson = {poisson}, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
model solid = fem(tet4, strain = small, size = {size} mm{method})
probe tip = point(beam, at = (178, 0, 0) mm)
"""


def one(size: float, poisson: float, method: str) -> dict[str, Any]:
    """Facts about one size, in this process."""
    from softmark.interpreter.api.python_api import loads

    chosen = "" if method == "auto" else f", linear = {method}"
    report = loads(SCENE.format(size=size, poisson=poisson, method=chosen)).run().to_json()
    (found,) = report["models"].values() if isinstance(report["models"], dict) else report["models"]
    (tip,) = found["probes"].values() if found.get("probes") else ({"displacement": [[None] * 3]},)
    return {
        "status": found["status"],
        "message": found.get("message"),
        "elements": found["size"]["elements"],
        "unknowns": found["size"]["dofs"],
        "solver": found["solve"].get("linear_solver"),
        "iterations": found["solve"].get("linear_iterations"),
        "setup": _median(found, "setup_cpu_s"),
        "solve": _median(found, "solve_cpu_s"),
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9,
        "tip": tip["displacement"][0][2],
    }


def _median(found: dict[str, Any], what: str) -> float | None:
    times = found["time"].get(what)
    return times["median"] if times else None


def row(facts: dict[str, Any]) -> str:
    """One line of the table."""
    counts = f"{facts['elements']:>9} {facts['unknowns']:>9}"
    numbers = f"{facts['setup']:>9.2f} {facts['solve'] or float('nan'):>9.2f} {facts['peak']:>7.2f}"
    iterations = facts["iterations"] if facts["iterations"] is not None else "-"
    return f"{counts} {numbers} {iterations!s:>5}  {facts['status']}, {facts['solver']}"


def exponent(rows: list[dict[str, Any]], what: str) -> float:
    """Slope of log time over log unknowns."""
    import numpy as np

    known = [(r["unknowns"], r[what]) for r in rows if r[what]]
    return float(np.polyfit(*np.log(np.array(known).T), 1)[0])


def main() -> None:
    """Each size in a fresh process, then the table's exponents."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--sizes", default="6.2,4.4,3,2.1,1.6,1.17", help="edge lengths, mm")
    parser.add_argument("--poisson", type=float, default=0.3)
    parser.add_argument("--method", default="auto", help="the model's `linear`")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--one", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one, options.poisson, options.method)))
        return
    environment = os.environ | dict.fromkeys(THREADS, str(options.threads))
    print(f"{'elements':>9} {'unknowns':>9} {'set-up s':>9} {'solve s':>9} {'peak GB':>7} {'its':>5}  solver")
    rows = []
    for size in map(float, options.sizes.split(",")):
        command = [sys.executable, __file__, "--one", str(size), "--poisson", str(options.poisson)]
        command += ["--method", options.method]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{size} mm: {(done.stderr.strip() or 'no word').splitlines()[-1]}")
            continue
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        print(row(rows[-1]), flush=True)
    if len(rows) > 1:
        print(f"exponents over unknowns: set-up {exponent(rows, 'setup'):.2f}, solve {exponent(rows, 'solve'):.2f}")


if __name__ == "__main__":
    main()
