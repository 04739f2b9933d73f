"""How the errors that models state compare with those that they have: `python tests/benchmarks/stated.py [--small]`.

Every case is a body under a load; the truth is the same body by elements that do not lock on a mesh that is finer than
that of any model asked, at finite strain. A model is silent where its error is larger than what it states, by more than
the truth may be off, and no warning says that it may be. The table has, by kind of model, how many cases there are, in
how many it states an error, in how many only a warning or nothing, how many are silent, and how many times the stated
error is the true one in the median.
"""

from __future__ import annotations

import json
import random
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from softmark.interpreter.api.python_api import loads
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

UNCERTAIN = 0.003  # of the truth, relative: what its mesh leaves

# per body: shape, support and load; sizes of the truth and of the models; far end
BODIES = {
    "cantilever": (
        "box(size = (60, 10, 10) mm)", "x <= 0 mm", "traction(b, where = x >= 60 mm, vector = (0, 0, {load}) Pa)", 20.0,
        "2.5 mm", ("10 mm", "5 mm"), "(60, 5, 5) mm",
    ),
    "rod": (
        "cylinder(length = 80 mm, radius = 5 mm, axis = +x)", "x <= 0 mm", "gravity({load} m/s^2, direction = -z)",
        10.0, "2.5 mm", ("6 mm", "3.5 mm"), "(80, 0, 0) mm",
    ),
    "block": (
        "box(size = (20, 20, 20) mm)", "x <= 0 mm", "traction(b, where = x >= 20 mm, vector = (-{load}, 0, {load}) Pa)",
        2000.0, "2 mm", ("10 mm", "5 mm"), "(20, 10, 10) mm",
    ),
}  # fmt: skip
SOLIDS = ("tet4", "tet10", "hex8", "hex8, integration = selective", "hex8, formulation = mean_dilatation")
STRAINS = ("small", "corotational", "finite")


@dataclass(frozen=True)
class Case:
    """A body with a material and a load."""

    body: str
    poisson: float
    factor: float  # on the load

    def text(self, small: bool) -> str:
        """The scene."""
        shape, where, load, size, fine, sizes, tip = BODIES[self.body]
        amount = f"{size * self.factor:.6g}"
        fine = "4 mm" if small else fine
        lines = [
            "softmark 1", 'scene "stated errors"',
            f"material m = neo_hookean(young = 60 kPa, poisson = {self.poisson:.6g}, density = 1070 kg/m^3)",
            f"body b = solid({shape}, m)", f"support w = fixed(b, where = {where})",
            f"load l = {load.format(load=amount)}",
            f"model truth = fem(hex8, formulation = mean_dilatation, strain = finite, size = {fine})",
            f"probe line = line(b, from = {tip.replace('60,', '0,').replace('80,', '0,').replace('20, 10', '0, 10')}, "
            f"to = {tip}, points = 9)",
            "metric error = relative_l2_error(line, against = truth)",
        ]  # fmt: skip
        for n, element in enumerate(SOLIDS):
            for strain in STRAINS:
                for k, h in enumerate(sizes[:1] if small else sizes):
                    lines.append(f"model s{n}_{strain}_{k} = fem({element}, strain = {strain}, size = {h})")
        lines.append(f"model springs = mass_spring(stiffness = from_material(), network = hex8, size = {sizes[-1]})")
        if self.body != "block":
            lines += ["model beam20 = beam6dof(segments = 20)", "model beam4 = beam6dof(segments = 4)"]
        return "\n".join(lines) + "\n"


def cases(small: bool) -> list[Case]:
    """Bodies times Poisson's ratios times loads, in an order that is random and always the same."""
    loads, ratios = ((0.1, 1.0), (0.3, 0.499)) if small else ((0.01, 0.3, 1.0, 3.0, 10.0), (0.3, 0.45, 0.49, 0.4999))
    found = [Case(b, p, f) for f in loads for p in ratios for b in (("block",) if small else BODIES)]
    random.Random(0).shuffle(found)
    return found


def outcomes(case: Case, small: bool) -> Iterator[dict[str, Any]]:
    """What came of every model of a case."""
    scene = loads(case.text(small))
    names = tuple(n for n in scene.models if n != "truth")
    report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=names))
    for name in names:
        model = report.models[name]
        kind = SOLIDS[int(name[1])] + " " + name.split("_")[1] if name[0] == "s" and name[1].isdigit() else name
        error, said = model.metrics["error"].value, model.stated.get("error")
        yield {
            "case": f"{case.body} nu {case.poisson:g} load {case.factor:g}", "model": name, "kind": kind.rstrip("0248"),
            "status": model.status, "error": error, **(said.to_json() if said else {}),
            "truth": report.models["truth"].status,
        }  # fmt: skip


def word(row: dict[str, Any]) -> str:
    """stated | said | silent | none, of one outcome."""
    if row["error"] is None:
        return "none"
    if row.get("value") is not None and row["value"] + UNCERTAIN >= row["error"]:
        return "stated"
    return "said" if row.get("value") is None or row.get("doubts") else "silent"


def table(rows: list[dict[str, Any]]) -> str:
    """Counts by kind of model."""
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        kinds[row["kind"]].append(row)
    lines = [f"{'kind':46s} cases stated  said silent  none stated / true"]
    for kind, own in sorted({**kinds, "all": rows}.items(), key=lambda k: (k[0] == "all", k[0])):
        words = [word(row) for row in own]
        ratios = [r["value"] / r["error"] for r in own if r.get("value") and r["error"] and r["error"] > UNCERTAIN]
        over = f"{median(ratios):13.2g}" if ratios else f"{'–':>13s}"
        counts = " ".join(f"{words.count(w):{n}d}" for w, n in (("stated", 6), ("said", 5), ("silent", 6), ("none", 5)))
        lines.append(f"{kind:46s} {len(own):5d} {counts} {over}")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Print the table, and every silent case; 1 where there is one. --keep FILE keeps outcomes as lines of JSON."""
    small, rows = "--small" in arguments, []
    keep = Path(arguments[arguments.index("--keep") + 1]) if "--keep" in arguments else None
    for case in cases(small):
        for row in outcomes(case, small):
            rows.append(row)
            if keep is not None:
                with keep.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
    print(table(rows))
    silent = [row for row in rows if word(row) == "silent"]
    for row in silent:
        print("SILENT", row["case"], row["kind"], row["model"], f"error {row['error']:.3g}, states {row['value']:.3g}")
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
