"""How many of a thousand tangled bodies find back to rest, for every law, element and disturbance.

    python tests/benchmarks/recovery.py [--scrambled 1000] [--others 100] [--jobs 2] [--law neo_hookean]
        [--element tet4] [--disturbance scrambled] [--amount 10] [--first 0] [--json FILE]

A block of 3 x 3 x 6 cubes (five tetrahedra each; 2 x 2 x 4 of ten-node ones), clamped at one end, without loads: rest
is its state of least energy and the only right answer. A run is `recovered` where every displacement is within 1e-6 of
the block's size of rest, `no` where the solver says that it did not find back, and WRONG where it claims an equilibrium
that is not rest. Springs and St Venant-Kirchhoff solids have others of no energy at all, folded ones, and must say so.
The last column is the largest distance from rest of a recovered run, in sizes of the block. The exit status is 1 where
a run is WRONG.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.spring_energy import Springs, stiffness_from_modulus
from softmark.solvers.materials import MATERIALS, law_for, shear_and_volume_laws
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.spring_edges import build_spring_network
from softmark.solvers.mesh.structured_meshes import PlaneMesh, mesh_extrusion
from softmark.solvers.statics.perturbed_states import DISTURBANCES, PerturbedNodes, perturb
from softmark.solvers.statics.recovery_from_perturbation import PerturbedBody, find_inverted_cells, recover_equilibrium
from softmark.solvers.statics.static_equilibrium import NotConverged, Statics

NEAR = 1e-6  # of the block's size: at rest
LAWS = ("neo_hookean", "corotational", "stable_neo_hookean", "neo_hookean_isochoric", "st_venant_kirchhoff", "springs")
ELEMENTS = ("tet4", "tet10", "hex8", "hex8 selective")
CHUNK = 25  # runs of one task


@dataclass(frozen=True)
class Block:
    """A block clamped at z = 0: its static problem and its cells."""

    mesh: Mesh
    problem: Statics
    cells: Elastic
    oriented: bool  # whether its energy is one of cells


def lattice(across: int, along: int, kind: str) -> Mesh:
    """A block of cubes of unit edge."""
    side = np.arange(across + 1.0)
    i, j = (a.ravel() for a in np.meshgrid(side, side, indexing="ij"))
    index = np.arange((across + 1) ** 2).reshape(across + 1, across + 1)
    corners = [index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    section = PlaneMesh(np.stack([i, j], axis=1), quads, (i + j).astype(np.int64) % 2)
    return mesh_extrusion(section, float(along), 1.0, kind)


@cache
def block(law: str, element: str) -> Block:
    """The block of a law and an element, Young's modulus 1 Pa and a Poisson's ratio of 0.3."""
    kind = element.split()[0]
    mesh = lattice(2, 4, kind) if kind == "tet10" else lattice(3, 6, kind)
    parts = integrate_cells(mesh)
    strain = law if law == "corotational" else "finite"
    material = MATERIALS[law if law in MATERIALS else "linear_elastic"](1.0, 0.3, 1.0)
    known = law_for(material, "small" if law == "springs" else strain)
    cells = Elastic(mesh.cells, parts.dNdX, parts.w, known)
    energy = springs(mesh) if law == "springs" else integrated(cells, mesh, element, material, strain)
    fixed = np.flatnonzero(np.repeat(mesh.points[:, 2] == 0.0, 3))
    dofs = mesh.points.size
    assembly = Assembly(dofs, fixed, [energy], [], mesh.points)
    held = np.zeros(len(fixed))
    problem = Statics(assembly, VectorSpace(dofs), np.zeros(dofs), fixed, held, extent=mesh.extent)
    if law != "springs":
        problem = replace(problem, sound=lambda x: not len(find_inverted_cells(cells, x)))
    return Block(mesh, problem, cells, law != "springs")


def integrated(cells: Elastic, mesh: Mesh, element: str, material: Any, strain: str) -> Energy:
    """The energy as models integrate it."""
    if element.endswith("selective"):
        laws = shear_and_volume_laws(material, strain)
        if laws is None:
            raise SystemExit(f"{material} does not come apart")
        middle = mean_gradients(mesh)
        return EnergySum((replace(cells, law=laws[0]), Elastic(mesh.cells, middle.dNdX, middle.w, laws[1])))
    known: Any = cells.law
    if strain == "corotational" and mesh.kind == "tet4":
        return CorotationalTets(cells.cells, cells.dNdX, cells.w, known)
    return cells


def springs(mesh: Mesh) -> Springs:
    """Springs along the edges of tetrahedra, or along edges and diagonals of hexahedra."""
    net = build_spring_network(mesh, "all")
    D = mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]]
    return Springs(net.edges, D, stiffness_from_modulus(1.0, net.weight, np.linalg.norm(D, axis=1)))


def one(law: str, element: str, kind: str, amount: float, seed: int) -> dict[str, Any]:
    """What comes of one disturbed block."""
    b = block(law, element)
    x = (perturb(kind, PerturbedNodes(b.mesh.points, b.mesh.cells, amount), seed) - b.mesh.points).ravel()
    x[b.problem.fixed] = 0.0
    cells = b.cells if b.oriented else None
    tangled = PerturbedBody(x, cells, lambda y: find_inverted_cells(b.cells, y), len(b.mesh.cells), seed)
    begun = time.process_time()
    try:
        found = recover_equilibrium(b.problem, tangled)
    except NotConverged as no:
        spent = time.process_time() - begun
        return {"seed": seed, "what": "no", "reason": no.reason, "iterations": len(no.history), "cpu_s": spent}
    away, spent = float(np.abs(found.x).max() / b.mesh.extent), time.process_time() - begun
    known = {"seed": seed, "away": away, "iterations": found.iterations, "cpu_s": spent, **found.facts["recovery"]}
    return {"what": "recovered" if away <= NEAR else "WRONG", **known}


def several(law: str, element: str, kind: str, amount: float, seeds: range) -> list[dict[str, Any]]:
    """The runs of some seeds."""
    block(law, element).problem.assembly.tangent(block(law, element).problem.rest, 1.0, True)  # outside the clock
    return [one(law, element, kind, amount, seed) for seed in seeds]


HEADER = (
    f"{'law':22} {'element':15} {'disturbance':15} {'runs':>5} {'recovered':>9} {'no':>4} {'WRONG':>5}"
    f" {'afresh':>6} {'iter':>5} {'most':>5} {'CPU s':>7} {'away':>8}"
)


def row(law: str, element: str, kind: str, amount: float, runs: list[dict[str, Any]]) -> str:
    """One line of the table; `afresh` counts the runs in which nodes were spread anew."""
    count = {what: sum(r["what"] == what for r in runs) for what in ("recovered", "no", "WRONG")}
    afresh = sum(r.get("attempts", 0) > 0 for r in runs)
    word = kind if amount == 1.0 else f"{kind} {amount:g}x"
    iterations = [r["iterations"] for r in runs]
    away = max((r["away"] for r in runs if r["what"] == "recovered"), default=float("nan"))
    return (
        f"{law:22} {element:15} {word:15} {len(runs):5} {count['recovered']:9} {count['no']:4} {count['WRONG']:5}"
        f" {afresh:6} {median(iterations):5.0f} {max(iterations):5} {mean(r['cpu_s'] for r in runs):7.3f} {away:8.1e}"
    )


def cases(given: argparse.Namespace) -> list[tuple[str, str, str, float, range]]:
    """Law, element, disturbance, amount and seeds of every row."""
    found = []
    for law, element in product(given.law or LAWS, given.element or ELEMENTS):
        if law == "springs" and element not in ("tet4", "hex8"):
            continue
        for kind, amount in product(given.disturbance or DISTURBANCES, given.amount or (1.0, 10.0)):
            if amount != 1.0 and kind != "scrambled" and not given.amount:
                continue
            thorough = kind == "scrambled" and element == "tet4" and law in ("neo_hookean", "corotational")
            count = given.scrambled if thorough else given.others
            found.append((law, element, kind, amount, range(given.first, given.first + count)))
    return found


def main() -> int:
    """Print the table; 1 where a run is WRONG."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scrambled", type=int, default=1000, help="runs of scrambled tet4 of the two main laws")
    parser.add_argument("--others", type=int, default=100, help="runs of every other row")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--law", action="append", choices=LAWS)
    parser.add_argument("--element", action="append", choices=ELEMENTS)
    parser.add_argument("--disturbance", action="append", choices=tuple(DISTURBANCES))
    parser.add_argument("--amount", action="append", type=float)
    parser.add_argument("--json", type=Path, help="every run, one line each")
    given = parser.parse_args()
    wrong = 0
    print(HEADER, flush=True)
    with ProcessPoolExecutor(given.jobs) as pool:
        for *case, seeds in cases(given):
            tasks = [pool.submit(several, *case, seeds[i : i + CHUNK]) for i in range(0, len(seeds), CHUNK)]
            runs = [run for task in tasks for run in task.result()]
            print(row(*case, runs), flush=True)
            wrong += sum(run["what"] == "WRONG" for run in runs)
            if given.json:
                law, element, kind, amount = case
                known = {"law": law, "element": element, "disturbance": kind, "amount": amount}
                with given.json.open("a") as file:
                    file.writelines(json.dumps(known | run) + "\n" for run in runs)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
