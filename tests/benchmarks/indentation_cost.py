"""What contact costs: a sphere pressed into a cube, state by state, beside the same states without contact.

    python tests/benchmarks/indentation_cost.py [--element tet4 tet10] [--size 3.7] [--repeat 3] [--calculix]

The cube of `tests/shared/indented_cylinder.py`, 40 mm wide, of about 5 000 tetrahedra, a sphere of 10 mm in radius
without friction, and even states of travel up to 1 mm. Without contact as many states of an equal force, spread over a
patch of the top, drive the same mesh. Seconds of CPU of the solutions alone: no compiling, no reports, no stated
errors. With `--calculix` the same mesh by CalculiX, all of its run, and how far both are from the truth.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
import indented_cylinder

from softmark import loads
from softmark.interpreter.pipeline import model_runs, probe_sampling, run_state
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.planning.run_plan import plan_of

CUBE = """softmark 1
scene "a cube"
material gel  = {law}(young = 10 kPa, poisson = 0.45, density = 1000 kg/m^3)
body    block = solid(box((40, 40, 40) mm), gel)
support floor = fixed(block, where = z <= 0 mm)
{pressed}
analysis press = static(states = [{states}] %)
model   cells = fem({element}, strain = {strain}, size = {size} mm)
"""
SPHERE = """body    ball  = rigid(sphere(radius = 10 mm, origin = (20, 20, 50) mm))
support hand  = displaced(ball, by = (0, 0, -1) mm, amplitude = per_state)
contact touch = rigid_contact(ball, block, where = z >= 40 mm)
metric  push  = force(touch, along = -z)"""
SPREAD = """load push = traction(block, where = z >= 40 mm and abs(x - 20 mm) <= {half} mm
    and abs(y - 20 mm) <= {half} mm,
    vector = (0, 0, -{stress}) Pa, amplitude = per_state)
metric held = force(floor, along = +z)"""


def prepared(text: str) -> list[Any]:
    """Of every state, warm."""
    scene = loads(text).scene
    found = []
    for work in run_state.make_state_runs(scene, plan_of(scene, ()), RunOptions(draw=False), []):
        probe_sampling.place_probes(work)
        model_runs.prepare_models(work)
        found.append(work.prepared["cells"][0])
    found[0].warm()
    return found


def solved(text: str) -> dict[str, Any]:
    """Seconds of CPU over all states, linear systems, and the force on the sphere at each, N."""
    before, cpu, systems, forces = None, 0.0, 0, []
    for state in prepared(text):
        began = state if before is None else state.after(before)
        start = time.process_time()
        found = began.solve(lambda iteration: None)
        cpu += time.process_time() - start
        if found.mesh is None:
            raise SystemExit(found.message)
        before, systems = found.mesh, systems + found.facts["factorisations"]
        if state.contacts:
            own = found.carried()
            forces.append(-float(own.wrench(own.beds["touch"]).force[2]))
    mesh = began.mesh
    return {"cpu": cpu, "systems": systems, "forces": forces, "cells": len(mesh.cells), "points": 1e3 * mesh.points,
            "mesh": mesh.cells}  # fmt: skip


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--element", nargs="+", default=["tet4", "tet10"])
    parser.add_argument("--size", type=float, default=3.7, help="of cells, mm")
    parser.add_argument("--strain", default="finite", choices=["small", "finite"])
    parser.add_argument("--states", type=int, default=20)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--half", type=float, default=3.0, help="half the width of the patch without contact, mm")
    parser.add_argument("--calculix", action="store_true")
    options = parser.parse_args()
    print(
        "| element | cells | contact, CPU s | systems | without | systems | ratio | off, % | CalculiX, CPU s | off, % |"
    )
    print("| --- " * 10 + "|")
    for element in options.element:
        print(row(element, options), flush=True)


def row(element: str, options: argparse.Namespace) -> str:
    """Of an element, medians of repetitions that take turns."""
    finite = options.strain == "finite"
    truth = (indented_cylinder.CUBE_NEO_HOOKEAN if finite else indented_cylinder.CUBE_SMALL)[-1]
    states = ", ".join(f"{100 * (i + 1) / options.states:g}" for i in range(options.states))
    known = {"element": element, "size": options.size, "strain": options.strain, "states": states}
    known["law"] = "neo_hookean" if finite else "linear_elastic"
    spread = SPREAD.format(half=options.half, stress=truth / (2e-3 * options.half) ** 2)
    with_it, without, theirs = [], [], []
    for _ in range(options.repeat):
        with_it.append(solved(CUBE.format(pressed=SPHERE, **known)))
        without.append(solved(CUBE.format(pressed=spread, **known)))
        if options.calculix:
            from indentation_calculix import solid

            theirs.append(solid(with_it[-1]["points"], with_it[-1]["mesh"], options.states, finite=finite))
    a, b = (statistics.median(one["cpu"] for one in each) for each in (with_it, without))
    ratio = statistics.median(one["cpu"] / other["cpu"] for one, other in zip(with_it, without, strict=True))
    off = 100 * (with_it[0]["forces"][-1] / truth - 1)
    cells = [element, with_it[0]["cells"], f"{a:.2f}", with_it[0]["systems"], f"{b:.2f}", without[0]["systems"],
             f"{ratio:.2f}", f"{off:.1f}"]  # fmt: skip
    if theirs:
        cpu = statistics.median(one["cpu"] for one in theirs)
        cells += [f"{cpu:.2f}", f"{100 * (theirs[0]['forces'][-1] / truth - 1):.1f}"]
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main()
