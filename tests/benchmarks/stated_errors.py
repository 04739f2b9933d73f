"""How the errors that models state compare with those that they have, and what they cost.

`python tests/benchmarks/stated_errors.py [--small] [--only WORDS] [--keep FILE]`. Every case is a body under a load;
its truth is a finer mesh of quadratic cells or of hexahedra that keep the mean of the volume, at finite strain. Each
model is asked about the displacements along a line (relative) and about that of the tip (m). A row: the true error,
the stated one, their ratio, and what stating cost over what the solution took (CPU). An error is contained where the
stated one, with what the truth may be off, is at least the true one. Below, by kind of model: how many, how many
stated, contained, the median of stated over true, and of the cost.
"""

from __future__ import annotations

import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

from softmark.interpreter.api.python_api import loads
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

UNCERTAIN = 0.004  # of the truth, relative


@dataclass(frozen=True)
class Problem:
    """A body with a support and a load; the truth's model, the sizes of the models, and the end of the line."""

    name: str
    body: str
    load: str
    truth: str
    sizes: tuple[str, ...]
    tip: str
    root: str
    poisson: float = 0.3
    where: str = "x <= 0 mm"
    beams: bool = False
    solids: tuple[str, ...] = ("tet4", "tet10", "hex8", "hex8, integration = selective",
                               "hex8, formulation = mean_dilatation")  # fmt: skip
    strains: tuple[str, ...] = ("corotational", "finite")

    def models(self, small: bool) -> Iterator[tuple[str, str]]:
        """Kind and constructor."""
        sizes = self.sizes[:1] if small else self.sizes
        for element in self.solids:
            for strain in self.strains:
                for size in sizes:
                    yield f"{element} {strain}", f"fem({element}, strain = {strain}, size = {size})"
        if self.beams:
            yield "beam6dof", "beam6dof(segments = 20)"
            yield "beam6dof", "beam6dof(segments = 5)"
        yield "springs", f"mass_spring(stiffness = from_material(), network = hex8, size = {sizes[-1]})"

    def text(self, small: bool) -> str:
        """The scene."""
        lines = [
            "softmark 1", 'scene "stated errors"',
            f"material m = neo_hookean(young = 60 kPa, poisson = {self.poisson:g}, density = 1070 kg/m^3)",
            f"body b = solid({self.body}, m)", f"support w = fixed(b, where = {self.where})", f"load l = {self.load}",
            f"model truth = {self.truth}",
            f"probe line = line(b, from = {self.root}, to = {self.tip}, points = 9)",
            "metric error = relative_l2_error(line, against = truth)",
            "metric tip = tip_error(line, against = truth)",
        ]  # fmt: skip
        lines += [f"model m{i} = {made}" for i, (_, made) in enumerate(self.models(small))]
        return "\n".join(lines) + "\n"


SLENDER = Problem("cantilever", "box(size = (60, 10, 10) mm)", "gravity(1 m/s^2, direction = -z)",
                  "fem(tet10, strain = finite, size = 1.67 mm)", ("5 mm", "2.5 mm"), "(60, 5, 5) mm", "(0, 5, 5) mm",
                  beams=True)  # fmt: skip
BLOCK = Problem("block", "box(size = (20, 20, 20) mm)",
                "traction(b, where = x >= 20 mm, vector = (-1000, 0, 1000) Pa)",
                "fem(tet10, strain = finite, size = 1.67 mm)", ("10 mm", "5 mm", "2.5 mm"), "(20, 10, 10) mm",
                "(0, 10, 10) mm")  # fmt: skip
ROD = Problem("rod", "cylinder(length = 80 mm, radius = 5 mm, axis = +x)", "gravity(3 m/s^2, direction = -z)",
              "fem(tet10, strain = finite, size = 2 mm)", ("5 mm", "2.5 mm"), "(80, 0, 0) mm", "(0, 0, 0) mm",
              beams=True)  # fmt: skip
MEAN = "fem(hex8, formulation = mean_dilatation, strain = finite, size = {})"
PROBLEMS = [
    SLENDER,
    replace(SLENDER, name="cantilever, small strain", load="gravity(0.1 m/s^2, direction = -z)", strains=("small",)),
    replace(SLENDER, name="cantilever, nu 0.45", poisson=0.45),
    replace(SLENDER, name="cantilever, nu 0.49, far", poisson=0.49, load="gravity(5 m/s^2, direction = -z)"),
    replace(SLENDER, name="cantilever, nu 0.499", poisson=0.499, truth=MEAN.format("1.25 mm")),
    BLOCK,
    replace(BLOCK, name="block, small strain", strains=("small",),
            load="traction(b, where = x >= 20 mm, vector = (-10, 0, 10) Pa)"),
    replace(BLOCK, name="block, nu 0.49", poisson=0.49),
    replace(BLOCK, name="block, pressed", load="pressure(b, where = x >= 20 mm, magnitude = 3 kPa)"),
    ROD,
    replace(ROD, name="rod, nu 0.49", poisson=0.49),
]  # fmt: skip


def outcomes(problem: Problem, small: bool) -> Iterator[dict[str, Any]]:
    """What came of every model of a problem, of both metrics."""
    scene = loads(problem.text(small))
    kinds = {f"m{i}": (kind, made) for i, (kind, made) in enumerate(problem.models(small))}
    whole = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False))
    tip = float(abs(whole.models["truth"].probes["line"].displacement[-1]).max())
    for name, (kind, made) in kinds.items():
        run_scene(scene.scene, list(scene.warnings), RunOptions(only=(name,), draw=False))  # whatever is compiled, is
        start = time.process_time()
        plain = run_scene(scene.scene, list(scene.warnings), RunOptions(only=(name,), draw=False)).models[name]
        took = time.process_time() - start
        start = time.process_time()
        asked = run_scene(scene.scene, list(scene.warnings), RunOptions(only=(name,), draw=False, stated=(name,)))
        more = time.process_time() - start - took
        solve = sum(float(plain.time[n].to_json()["median"]) for n in ("setup_cpu_s", "solve_cpu_s") if plain.time[n])
        for metric, size in (("error", 1.0), ("tip", tip)):
            error = whole.models[name].metrics[metric].value
            said = known.to_json() if (known := asked.models[name].stated.get(metric)) else {}
            yield {
                "problem": problem.name, "model": made, "kind": kind, "metric": metric, "unknowns": plain.size["dofs"],
                "error": None if error is None else error / size,
                "stated": None if said.get("value") is None else said["value"] / size,
                "parts": said.get("parts"), "reason": said.get("reason"), "doubts": said.get("doubts"),
                "seconds": more, "solution": solve,
            }  # fmt: skip


def contained(row: dict[str, Any]) -> bool:
    """Whether what is stated is at least the true error, as far as that is known."""
    return bool(row["stated"] + UNCERTAIN >= row["error"])


def line(row: dict[str, Any]) -> str:
    """One model of one problem."""
    cost = row["seconds"] / row["solution"]
    head = f"{row['problem']:26s} {row['model']:62s} {row['metric']:5s} {100 * row['error']:8.3g} %"
    if row["stated"] is None:
        return f"{head}        –                cost {cost:6.2f}  {row['reason']}"
    ratio = row["stated"] / max(row["error"], 1e-12)
    said = f"{100 * row['stated']:8.3g} %  ratio {ratio:7.3g}  cost {cost:6.2f}"
    doubts = f"  {' '.join(row['doubts'])}" if row["doubts"] else ""
    return f"{head} {said}{doubts}" + ("" if contained(row) else "  NOT CONTAINED")


def table(rows: list[dict[str, Any]]) -> str:
    """By kind of model."""
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        kinds[row["kind"]].append(row)
    found = [f"{'kind':46s} {'cases':>6s} {'stated':>6s} {'contained':>9s} {'ratio':>7s} {'cost':>6s} {'s':>7s}"]
    for kind, own in [*sorted(kinds.items()), ("all", rows)]:
        told = [r for r in own if r["stated"] is not None]
        ratios = [r["stated"] / r["error"] for r in told if r["error"] > UNCERTAIN]
        ratio = f"{median(ratios):7.2f}" if ratios else f"{'–':>7s}"
        cost, seconds = (median(v) for v in ([r["seconds"] / r["solution"] for r in own], [r["seconds"] for r in own]))
        counts = f"{len(own):6d} {len(told):6d} {sum(map(contained, told)):9d}"
        found.append(f"{kind:46s} {counts} {ratio} {cost:6.2f} {seconds:7.3f}")
    return "\n".join(found)


def main(arguments: list[str]) -> int:
    """Print every row and the table; 1 where an error is not contained without a doubt. --keep FILE: lines of JSON."""
    small, rows = "--small" in arguments, []
    keep = Path(arguments[arguments.index("--keep") + 1]) if "--keep" in arguments else None
    only = arguments[arguments.index("--only") + 1] if "--only" in arguments else ""
    for problem in (p for p in PROBLEMS if only in p.name):
        for row in outcomes(problem, small):
            if row["error"] is None:
                continue
            rows.append(row)
            print(line(row), flush=True)
            if keep is not None:
                with keep.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print(table(rows))
    return int(any(r["stated"] is not None and not contained(r) and not r["doubts"] for r in rows))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
