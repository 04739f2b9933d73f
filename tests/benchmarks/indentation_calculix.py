"""A rigid sphere pressed into a block by CalculiX: the force by its section, and what a solid of tetrahedra costs.

    python tests/benchmarks/indentation_calculix.py section [--edge 0.2 0.1] [--stiffness 1e5] [--finite]
    python tests/benchmarks/indentation_calculix.py block [--edge 0.8] [--stiffness 1e4] [--finite]
    python tests/benchmarks/indentation_calculix.py solid SCENE [--model NAME] [--states 20] [--json FILE]

`section`: the cylinder of 40 mm by 40 mm of `indentation_section.py`, eight-node quadrilaterals, the sphere a shell
of such quadrilaterals whose nodes are all prescribed, contact from face to face by a linear penalty. `block`: a
quarter of the cube of 40 mm, twenty-node hexahedra. `solid`: a mesh of ours, of four- or ten-node tetrahedra, its
lowest face fixed, the sphere on the middle of its highest. In mm, kPa and mN, for CalculiX takes forces below 1e-6 for
none.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from indentation_section import FINE, HEIGHT, LAM, MU, POISSON, RADIUS, TRAVELS, WIDTH, YOUNG, graded, hertz

from softmark.interpreter.models.external.adapters.calculix import cards_of_set, nodes, version
from softmark.interpreter.models.external.adapters.calculix import cells as cards

Floats = np.ndarray[Any, np.dtype[np.float64]]

SECTORS = 180  # CalculiX turns a section into a sector of 2 degrees, and prints the reactions of that
ARC = 30.0  # degrees from the tip: as far as the sphere has a surface
TIGHT = "1e-4,1e-3"  # residual, and correction, by their means, at which an iteration is the last (0.005, 0.01)
SHELL = 1.0  # mm: how thick the shell is that stands for it


def grid(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Points (n, 2) and eight-node cells (m, 8), counted from 0, of the grid x by y in its own coordinates."""
    s, t = (np.sort(np.concatenate([a, 0.5 * (a[1:] + a[:-1])])) for a in (x, y))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(0, len(s) - 2, 2), np.arange(0, len(t) - 2, 2), indexing="ij"))
    around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    cells = np.stack([(i + a) * len(t) + j + b for a, b in around], axis=1)
    points = np.stack([a.ravel() for a in np.meshgrid(s, t, indexing="ij")], axis=1)
    used, cells = np.unique(cells, return_inverse=True)
    return points[used], cells.reshape(-1, 8)


def elements(kind: str, cells: Any, node: int, first: int, name: str) -> list[str]:
    """Cards of elements, numbered from `first`."""
    return cards(kind, cells, node, range(first, first + len(cells)), name)


def materials(finite: bool) -> list[str]:
    """Cards of what block and ball are made of."""
    bulk = LAM + 2 / 3 * MU
    law = (
        ["*HYPERELASTIC, NEO HOOKE", f"{MU / 2:.14e},{2 / bulk:.14e}"] if finite else ["*ELASTIC", f"{YOUNG},{POISSON}"]
    )
    rest = ["*SOLID SECTION, ELSET=BLOCK, MATERIAL=GEL", "*SOLID SECTION, ELSET=BALL, MATERIAL=STEEL"]
    return ["*MATERIAL, NAME=GEL", *law, "*MATERIAL, NAME=STEEL", "*ELASTIC", f"{1e3 * YOUNG},0.3", *rest]


def touching(k: float) -> list[str]:
    """Cards of contact from face to face, with a pressure k times the depth."""
    return [
        "*SURFACE INTERACTION, NAME=SOFT",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{k:.6e}",
        "*CONTACT PAIR, INTERACTION=SOFT, TYPE=SURFACE TO SURFACE",
        "TOP,TIP",
    ]


def steps(travels: Any, down: int, finite: bool, increments: float, tight: bool) -> list[str]:
    """Cards of one step for each travel, and the forces that are printed at its end."""
    lines = []
    for travel in travels:
        lines += ["*STEP, NLGEOM, INC=1000" if finite else "*STEP, INC=1000", "*STATIC", f"{increments},1.,1e-6,1."]
        lines += ["*CONTROLS, PARAMETERS=FIELD", TIGHT] if tight else []
        lines += ["*BOUNDARY", f"NBALL,{down},{down},{-travel:.12e}"]
        lines += ["*NODE PRINT, NSET=WALL, TOTALS=ONLY, FREQUENCY=9999", "RF", "*END STEP"]
    return lines


def section_deck(edge: float, k: float, finite: bool, travels: Any = TRAVELS) -> str:
    """The section of the cylinder, and of the shell of the sphere above it."""
    z = HEIGHT - graded(edge, FINE / 2, HEIGHT)[::-1]
    points, cells = grid(graded(edge, FINE, WIDTH), z)
    angles = np.radians(np.linspace(0.0, ARC, round(np.radians(ARC) * RADIUS / edge) + 1))
    ball, shell = grid(angles, np.array([RADIUS - SHELL, RADIUS]))
    ball = np.stack([ball[:, 1] * np.sin(ball[:, 0]), HEIGHT + RADIUS - ball[:, 1] * np.cos(ball[:, 0])], axis=1)
    shell = shell[:, [3, 2, 1, 0, 6, 5, 4, 7]]  # turned: outwards is down
    n, m = len(points), len(cells)
    lines = [*nodes(points, 1, "NBLOCK"), *nodes(ball, n + 1, "NBALL")]
    lines += [*elements("CAX8", cells, 1, 1, "BLOCK"), *elements("CAX8", shell, n + 1, m + 1, "BALL")]
    lines += cards_of_set("NSET", "WALL", np.flatnonzero(points[:, 1] < 1e-9) + 1)
    lines += cards_of_set("NSET", "AXIS", np.flatnonzero(points[:, 0] < 1e-9) + 1)
    near = (points[cells[:, 3], 1] > HEIGHT - 1e-9) & (points[cells[:, 2], 0] < FINE + 1.0)
    lines += ["*SURFACE, NAME=TOP", *(f"{e},S3" for e in np.flatnonzero(near) + 1)]
    lines += ["*SURFACE, NAME=TIP", *(f"{m + 1 + e},S1" for e in range(len(shell)))]
    lines += [*materials(finite), *touching(k)]
    lines += ["*BOUNDARY", "WALL,1,2", "AXIS,1,1", "NBALL,1,1"]
    return "\n".join([*lines, *steps(travels, 2, finite, 0.5, tight=True), ""])


def run(deck: str, folder: Path) -> dict[str, Any]:
    """Run a deck: the reactions of each step (3,), CPU seconds, increments and iterations.

    Raises RuntimeError where CalculiX does not come to the end.
    """
    (folder / "job.inp").write_text(deck)
    before, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, env=os.environ | ONE)
    wall, after = time.perf_counter() - wall, resource.getrusage(resource.RUSAGE_CHILDREN)
    if "Job finished" not in done.stdout:
        raise RuntimeError(done.stdout[-600:] + done.stderr[-300:])
    rows = [line.split() for line in (folder / "job.sta").read_text().splitlines()[2:]]
    lines = [line.split() for line in (folder / "job.dat").read_text().splitlines()]
    totals = [[float(v) for v in line] for line in lines if len(line) == 3 and "E" in line[0]]
    return {
        "cpu": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "wall": wall,
        "increments": sum(not row[2].endswith("U") for row in rows),
        "iterations": sum(int(row[3]) for row in rows),
        "reactions": totals,
    }


ONE = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS")} | {"CCX_NPROC_EQUATION_SOLVER": "1"}
SIDES = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])  # of tetrahedra, in the order of CalculiX


def twenty() -> Any:
    """Where the nodes of a cell of twenty are, in halves of its sides: (20, 3), S1 at z = 0."""
    corners = [(x, y, z) for z in (0, 2) for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))]
    ends = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    middles = [tuple((a + b) // 2 for a, b in zip(corners[i], corners[j], strict=True)) for i, j in ends]
    return np.array([*corners, *middles])


def cap(count: int, across: float = 5.0) -> tuple[Floats, Any]:
    """A square patch of a shell about the lowest point of a sphere at 0: points (n, 3), mm, C3D20 cells (m, 20)."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    keys = np.stack([2 * i, 2 * j, np.zeros_like(i)], axis=1)[:, None] + twenty()  # from the outside (S1) inwards
    found, cells = np.unique(keys.reshape(-1, 3), axis=0, return_inverse=True)
    x, y = (found[:, :2] / count - 1.0).T * across
    radius = RADIUS - SHELL * found[:, 2] / 2
    points = np.stack([x, y, -np.sqrt(RADIUS**2 - x**2 - y**2)], axis=1) * (radius / RADIUS)[:, None]
    return points, cells.reshape(-1, 20)


def top_sides(points: Floats, cells: Any) -> list[tuple[int, int]]:
    """(cell, side) from 1 of the highest face, as far as the sphere may touch it; mm."""
    corners = points[cells[:, SIDES]]  # (m, 4, 3, 3)
    middle = 0.5 * (points.min(0) + points.max(0))
    flat = (corners[..., 2] > points[:, 2].max() - 1e-6).all(-1)
    near = np.linalg.norm(corners[..., :2] - middle[:2], axis=-1).min(-1) < FINE
    return [(int(e) + 1, int(s) + 1) for e, s in np.argwhere(flat & near)]


def solid_deck(points: Floats, cells: Any, travels: Any, k: float, finite: bool, patch: int = 10) -> str:
    """A body of four- or ten-node tetrahedra, points (n, 3) in mm."""
    n, m = len(points), len(cells)
    ball, shell = cap(patch)
    middle = 0.5 * (points.min(0) + points.max(0))
    ball += (middle[0], middle[1], points[:, 2].max() + RADIUS)
    kind = "C3D10" if cells.shape[1] == 10 else "C3D4"
    lines = [*nodes(points, 1, "NBLOCK"), *nodes(ball, n + 1, "NBALL")]
    lines += elements(kind, cells, 1, 1, "BLOCK")
    lines += elements("C3D20R", shell, n + 1, m + 1, "BALL")
    lines += cards_of_set("NSET", "WALL", np.flatnonzero(points[:, 2] < points[:, 2].min() + 1e-6) + 1)
    lines += ["*SURFACE, NAME=TOP", *(f"{e},S{s}" for e, s in top_sides(points, cells))]
    lines += ["*SURFACE, NAME=TIP", *(f"{m + 1 + e},S1" for e in range(len(shell)))]
    lines += [*materials(finite), *touching(k), "*BOUNDARY", "WALL,1,3", "NBALL,1,2"]
    return "\n".join([*lines, *steps(travels, 3, finite, 1.0, tight=False), ""])


def bricks(*sides: Floats) -> tuple[Floats, Any]:
    """Points (n, 3) and twenty-node cells of a box with corners at places along x, y and z; S1 of a cell is below."""
    steps = [np.sort(np.concatenate([a, 0.5 * (a[1:] + a[:-1])])) for a in sides]
    first = np.stack(np.meshgrid(*(np.arange(0, len(a) - 2, 2) for a in steps), indexing="ij"), -1).reshape(-1, 3)
    keys = first[:, None] + twenty()
    found, cells = np.unique(keys.reshape(-1, 3), axis=0, return_inverse=True)
    return np.stack([a[i] for a, i in zip(steps, found.T, strict=True)], axis=1), cells.reshape(-1, 20)


def block_deck(edge: float, k: float, finite: bool, growth: float = 1.3) -> str:
    """A quarter of the cube of 40 mm, of twenty-node cells `edge` wide under the sphere."""
    across, z = graded(edge, FINE, WIDTH, growth), HEIGHT - graded(edge, FINE / 2, HEIGHT, growth)[::-1]
    points, cells = bricks(across, across, z)
    n, m = len(points), len(cells)
    ball, shell = cap(2 * round(5.0 / edge))
    ball += (0.0, 0.0, HEIGHT + RADIUS)
    lines = [*nodes(points, 1, "NBLOCK"), *nodes(ball, n + 1, "NBALL")]
    lines += elements("C3D20", cells, 1, 1, "BLOCK") + elements("C3D20R", shell, n + 1, m + 1, "BALL")
    for name, axis in (("SIDEX", 0), ("SIDEY", 1), ("WALL", 2)):
        lines += cards_of_set("NSET", name, np.flatnonzero(points[:, axis] < 1e-9) + 1)
    corners = points[cells[:, 4:8]]
    near = (corners[:, :, 2] > HEIGHT - 1e-9).all(1) & (np.linalg.norm(corners[:, 0, :2], axis=1) < FINE + 1.0)
    lines += ["*SURFACE, NAME=TOP", *(f"{e},S2" for e in np.flatnonzero(near) + 1)]
    lines += ["*SURFACE, NAME=TIP", *(f"{m + 1 + e},S1" for e in range(len(shell)))]
    lines += [*materials(finite), *touching(k), "*BOUNDARY", "WALL,1,3", "SIDEX,1,1", "SIDEY,2,2", "NBALL,1,2"]
    return "\n".join([*lines, *steps(TRAVELS, 3, finite, 0.5, tight=True), ""])


def read(path: Path, model: str = "") -> tuple[Floats, Any]:
    """Points in mm and cells: of a scene's model, of what `numpy.savez` left, or of a file for meshio, in m."""
    if path.suffix == ".scene":
        return of_scene(path.read_text(), model)
    if path.suffix == ".npz":
        held = np.load(path)
        return 1e3 * held["points"], held["cells"]
    import meshio

    mesh = meshio.read(path)
    block = next(b for b in mesh.cells if b.type in ("tetra", "tetra10"))
    return 1e3 * mesh.points, block.data


def of_scene(text: str, model: str = "") -> tuple[Floats, Any]:
    """Points (n, 3), mm, and cells that a model of a scene (its first, if none is named) is solved on."""
    import softmark
    from softmark.interpreter.pipeline import model_runs, probe_sampling, run_state
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.planning.run_plan import plan_of

    scene = softmark.loads(text).scene
    plan = plan_of(scene, (model,) if model else ())
    work = run_state.make_state_runs(scene, plan, RunOptions(draw=False), [])[0]
    probe_sampling.place_probes(work)
    model_runs.prepare_models(work)
    mesh = work.prepared[model or plan.models[0]][0].mesh
    return 1e3 * mesh.points, mesh.cells


def in_place(deck: str) -> dict[str, Any]:
    """Run a deck in a folder that goes."""
    with tempfile.TemporaryDirectory() as folder:
        return run(deck, Path(folder))


DECKS = {"section": (section_deck, SECTORS, 1), "block": (block_deck, 4, 2)}  # parts of the whole, axis of the force


def forces(way: str, edges: list[float], stiffness: list[float], finite: bool) -> None:
    """Print what the section, or the block, gives, beside Hertz."""
    deck, parts, axis = DECKS[way]
    print(f"CalculiX {version()}, {way}, {'NLGEOM, *HYPERELASTIC NEO HOOKE' if finite else '*ELASTIC, no NLGEOM'}; mN")
    heads = [f"{travel} mm" for travel in TRAVELS]
    print(f"| edge, mm | k, kPa/mm | {' | '.join(heads)} | iterations | CPU s |\n" + "| --- " * 7 + "|")
    print(f"| Hertz | | {' | '.join(f'{hertz(travel):.4f}' for travel in TRAVELS)} | | |")
    for edge in edges:
        for k in stiffness:
            found = in_place(deck(edge, k, finite))
            pushes = " | ".join(f"{parts * reaction[axis]:.4f}" for reaction in found["reactions"])
            print(f"| {edge} | {k:g} | {pushes} | {found['iterations']} | {found['cpu']:.1f} |", flush=True)


def solid(points: Floats, cells: Any, states: int = 20, k: float = 1e3, finite: bool = False) -> dict[str, Any]:
    """The force (N) of each of `states` even states of travel up to 1 mm, and what they cost.

    `points` (n, 3) in mm, `cells` (m, 4 or 10). Raises RuntimeError where CalculiX does not come to the end.
    """
    travels = np.linspace(0.0, TRAVELS[-1], states + 1)[1:]
    found = in_place(solid_deck(points, cells, travels, k, finite))
    pushes = [1e-3 * reaction[2] for reaction in found.pop("reactions")]
    return found | {"version": version(), "travels": (1e-3 * travels).tolist(), "forces": pushes}


def cost(options: argparse.Namespace) -> None:
    """Print, and keep, what a mesh gives."""
    points, cells = read(options.mesh, options.model)
    found = solid(points, cells, options.states, options.stiffness, options.finite)
    print(f"{len(cells)} cells: {found['cpu']:.2f} s of CPU, {found['iterations']} iterations")
    for travel, push in zip(found["travels"], found["forces"], strict=True):
        print(f"{1e3 * travel:7.3f} mm {1e3 * push:10.4f} mN  {1e3 * push / hertz(1e3 * travel):7.4f} of Hertz")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    ways = parser.add_subparsers(dest="way", required=True)
    flat = ways.add_parser("section", help="the force by the section of a cylinder")
    flat.add_argument("--edge", type=float, nargs="+", default=[0.4, 0.2], help="mm, of cells under the sphere")
    flat.add_argument("--stiffness", type=float, nargs="+", default=[1e4], help="k of the contact, kPa/mm")
    flat.add_argument("--finite", action="store_true")
    cube = ways.add_parser("block", help="the force by a quarter of a cube in space")
    cube.add_argument("--edge", type=float, nargs="+", default=[0.8], help="mm, of cells under the sphere")
    cube.add_argument("--stiffness", type=float, nargs="+", default=[1e4], help="k of the contact, kPa/mm")
    cube.add_argument("--finite", action="store_true")
    full = ways.add_parser("solid", help="a mesh of tetrahedra: forces and what they cost")
    full.add_argument("mesh", type=Path, help="a scene; points in m and cells, .npz; or a file for meshio")
    full.add_argument("--model", default="", help="of the scene; its first, if not named")
    full.add_argument("--states", type=int, default=20)
    full.add_argument("--stiffness", type=float, default=1e3, help="k of the contact, kPa/mm")
    full.add_argument("--finite", action="store_true")
    full.add_argument("--json", type=Path)
    options = parser.parse_args()
    if shutil.which("ccx") is None:
        raise SystemExit("ccx is not on the path")
    if options.way in DECKS:
        forces(options.way, options.edge, options.stiffness, options.finite)
    else:
        cost(options)


if __name__ == "__main__":
    main()
