"""The static neo-Hookean beam under its weight: ours against FElupe, scikit-fem, NGSolve and CalculiX.

    python tests/benchmarks/peers.py [--meshes 5k 20k 100k tet10] [--only felupe] [--repeat 3] [--json FILE]

One mesh for all, one thread, every package in a fresh process, in turn; medians of CPU seconds from the arrays of
the mesh to displacements. Imports, compilation and a small first solution are left out. Peers of the same law stop at
the same out-of-balance force, 1e-8 of the larger of load and reactions (1e-3 in load steps before the last), and
take the fewest equal load steps with which they converge; those are looked for first. A measurement, not a test.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.elements.tet4 import Tet4
from softmark.solvers.elements.tet10 import Tet10
from softmark.solvers.mesh.cell_splitting import add_midside_nodes, mesh_hexahedra
from softmark.solvers.mesh.structured_meshes import extrude, mesh_disc

HERE = Path(__file__).parent / "peers"
MESHES = {  # edge across and along, m, and whether quadratic
    "5k": (6.5e-3, 4.94e-3, False),
    "20k": (5e-3, 3.8e-3, False),
    "100k": (2.8e-3, 1.96e-3, False),
    "tet10": (7.5e-3, 7.7e-3, True),
}
NEEDS = {
    "softmark": ("softmark",),
    "felupe": ("felupe", "pypardiso"),
    "skfem": ("skfem", "pypardiso"),
    "ngsolve": ("ngsolve", "netgen"),
    "calculix": (),
}
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 24, 28, 32, 40, 48, 64)
ONE = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS", "NUMBA", "NGS")}
COARSE = (4, 10, 20, 50, 100, 200)  # CalculiX: one over its greatest increment, which it cuts by itself
LIMIT = 1800  # s a process may take


def installed(name: str) -> bool:
    """Whether a peer can be run."""
    if name == "calculix":
        return shutil.which("ccx") is not None
    return all(importlib.util.find_spec(module) for module in NEEDS[name])


def write(path: Path, across: float, along: float, ten: bool, share: float = 1.0) -> int:
    """The file of a problem, under a share of the weight; how many cells it has."""
    mesh = mesh_hexahedra(*extrude(mesh_disc(0.019, across), 0.178, along), Tet4)
    mesh = add_midside_nodes(mesh, Tet10) if ten else mesh
    points = np.ascontiguousarray(mesh.points[:, [2, 0, 1]])  # the axis along x
    np.savez(path, points=points, cells=mesh.cells, young=60e3, poisson=NU, density=1070.0, gravity=9.81 * share)
    return len(mesh.cells)


NU = 0.49


def once(folder: Path, name: str, steps: int) -> dict[str, Any]:
    """One run of a package in its own process."""
    out = folder / name
    Path(f"{out}.json").unlink(missing_ok=True)
    command = [sys.executable, str(HERE / f"by_{name}.py"), "mesh.npz", "warm.npz", str(out), str(steps)]
    try:
        subprocess.run(command, cwd=folder, timeout=LIMIT, capture_output=True, env=os.environ | ONE)
        found: dict[str, Any] = json.loads(Path(f"{out}.json").read_text())
    except (subprocess.TimeoutExpired, FileNotFoundError) as error:  # too long, or it crashed
        return {"converged": False, "message": type(error).__name__}
    return found


def fewest(folder: Path, name: str, least: int) -> int | None:
    """The fewest load steps, from `least` up, with which a package converges; None where there are none."""
    if name == "softmark":
        return 1
    for steps in COARSE if name == "calculix" else LADDER:
        if steps >= least:
            found = once(folder, name, steps)
            print(f"  {name}, {steps} steps: {found.get('message', 'converged')}", file=sys.stderr, flush=True)
            if found["converged"]:
                return steps
    return None


def measured(folder: Path, names: list[str], steps: dict[str, int | None], repeat: int) -> list[dict[str, Any]]:
    """Medians over runs in turn, and how far each is from ours."""
    runs: dict[str, list[dict[str, Any]]] = {name: [] for name in names}
    for _ in range(repeat):
        for name in names:
            count = steps[name]
            if count is not None:
                runs[name].append(once(folder, name, count))
    return [row(folder, name, runs[name]) for name in names]


def row(folder: Path, name: str, runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The line of one package in the table."""
    good = [run for run in runs if run["converged"]]
    if not good:
        return {"name": name, "converged": False}
    result = good[-1] | {"name": name, "runs": len(good)}
    for key in ("cpu", "wall", "setup", "peak_mb"):
        result[key] = statistics.median(run[key] for run in good)
    u = np.load(folder / f"{name}.npy")
    ours = np.load(folder / "softmark.npy")
    result["difference"] = float(np.abs(u - ours).max() / np.abs(ours).max())
    return result


def show(title: str, rows: list[dict[str, Any]]) -> None:
    """One mesh as a table."""
    print(
        f"\n| {title} | CPU s | of it set-up | iterations | load steps | s/iteration | wall s | MiB "
        "| off ours, % | x ours |"
    )
    print("| --- " * 10 + "|")
    ours = rows[0]["cpu"]
    for r in rows:
        if not r["converged"]:
            print(f"| {r['name']} | not converged |" + " |" * 8)
            continue
        setup = "" if np.isnan(r["setup"]) else f"{r['setup']:.3f}"
        each = (r["cpu"] - (0.0 if np.isnan(r["setup"]) else r["setup"])) / r["iterations"]
        print(
            f"| {r['version']} {r['note'] and '(' + r['note'] + ')'} | {r['cpu']:.3f} | {setup} | {r['iterations']} "
            f"| {r['steps']} | {each:.4f} | {r['wall']:.2f} | {r['peak_mb']:.0f} | {100 * r['difference']:.1e} "
            f"| {r['cpu'] / ours:.1f} |"
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--meshes", nargs="+", choices=MESHES, default=list(MESHES))
    parser.add_argument("--only", nargs="+", choices=NEEDS, default=list(NEEDS), help="packages; ours is always run")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--steps", nargs="*", default=[], metavar="NAME=N", help="begin the search for load steps here")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    names = ["softmark", *(name for name in options.only if name != "softmark" and installed(name))]
    for name in NEEDS:
        if not installed(name):
            print(f"{name}: not installed")
    tables: dict[str, Any] = {}
    least = {"softmark": 1} | {k: int(v) for k, v in (text.split("=") for text in options.steps)}
    for mesh in options.meshes:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            across, along, ten = MESHES[mesh]
            cells = write(folder / "mesh.npz", across, along, ten)
            write(folder / "warm.npz", 15e-3, 15e-3, ten, 0.01)
            steps = {name: fewest(folder, name, least.get(name, 1)) for name in names}
            if not ten:
                least |= {name: count for name, count in steps.items() if count is not None}
            tables[mesh] = measured(folder, names, steps, options.repeat)
            show(f"{cells} {'quadratic' if ten else 'linear'} tetrahedra", tables[mesh])
            if options.json:
                options.json.write_text(json.dumps(tables, indent=1))


if __name__ == "__main__":
    main()
