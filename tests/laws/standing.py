"""A standing law: no model of a random scene is wrong by more than it states.

`python tests/laws/standing.py [--count 300] [--from 0] [--keep FILE]` runs random bodies with partial supports, partial
loads and courses through the interpreter, holds what every model says against a truth that shares no code with it
(truth.py), and prints who was wrong by more than he stated, with the truth's own uncertainty granted. A warning that is
a doubt counts as said, and is counted apart. Exit status 1 where there is one that was silent.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import truth
from cases import Case

from softmark.interpreter.api.python_api import loads
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene


def judged(case: Case) -> Iterator[dict[str, Any]]:
    """What came of every model of a case: error, what it stated, and the word for it."""
    with tempfile.TemporaryDirectory() as folder:
        file = _written(case, Path(folder)) if case.from_file else None
        begun = time.process_time()
        try:
            scene = loads(case.text(file))
            report = run_scene(scene.scene, list(scene.warnings), RunOptions(draw=False, stated=()))
        except SceneError as refused:
            codes = sorted({d.code for d in refused.diagnostics})
            yield {"seed": case.seed, "model": "all", "word": "refused", "why": codes}
            return
        spent = time.process_time() - begun
    right: truth.Truth | None = None
    for name, model in report.models.items():
        row: dict[str, Any] = {"seed": case.seed, "model": name, "cpu_s": spent, "message": model.message}
        if "axis" not in model.probes:
            yield row | {"word": "no answer"}
            continue
        probe = model.probes["axis"]
        if right is None:
            right = truth.in_motion(case, np.asarray(probe.times)) if case.course else truth.at_rest(case)
        u = np.asarray(probe.displacement if probe.course is None else probe.course)
        error = float(np.linalg.norm(u - right.u) / np.linalg.norm(right.u))
        stated = model.stated["axis"].to_json() if "axis" in model.stated else {}
        row |= {"error": error, "uncertainty": right.uncertainty, **stated}
        yield row | {"word": _word(error, right.uncertainty, stated)}


def _word(error: float, uncertainty: float, stated: dict[str, Any]) -> str:
    """stated | doubted | unstated | silent."""
    if stated.get("value") is None:
        return "doubted" if stated.get("doubts") else "unstated"
    if error <= stated["value"] + uncertainty:
        return "stated"
    return "doubted" if stated.get("doubts") else "silent"


def _written(case: Case, folder: Path) -> str:
    """The body as a mesh file of tetrahedra whose nodes lie where no selection wants them."""
    import meshio
    import skfem

    counts = [max(2, round(s / case.mesh)) for s in case.size]
    planes = [np.linspace(0, s, n + 1) for s, n in zip(case.size, counts, strict=True)]
    mesh = skfem.MeshTet.init_tensor(*planes)
    cells = mesh.t.T.copy()
    a, b, c, d = (mesh.p.T[cells[:, i]] for i in range(4))
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    path = folder / "body.vtu"
    meshio.write_points_cells(path, mesh.p.T, [("tetra", cells)])
    return str(path)


def for_files(case: Case) -> Case:
    """With models that a file of tetrahedra can be used for."""
    from dataclasses import replace

    return replace(case, models=("tet4", "tet10")) if case.from_file else case


def table(rows: list[dict[str, Any]]) -> str:
    """Counts by kind of scene and model, and how many times the stated error is the true one in the median."""
    kinds = {0: "at rest", 1: "at rest, from a file", 2: "in motion"}
    words = ("stated", "doubted", "unstated", "silent", "no answer", "refused")
    lines = [f"{'':34s}" + "".join(f"{w:>10s}" for w in words) + "   stated / true"]
    for key in [*sorted({(r["seed"] % 3, r["model"]) for r in rows}), (None, "all")]:
        own = [r for r in rows if key[0] is None or (r["seed"] % 3, r["model"]) == key]
        ratios = [r["value"] / r["error"] for r in own if r.get("value") and r["error"] > 2 * r["uncertainty"]]
        counts = "".join(f"{sum(r['word'] == w for r in own):10d}" for w in words)
        label = "all" if key[0] is None else f"{kinds[key[0]]}, {key[1].rstrip('_')}"
        lines.append(f"{label:34s}{counts}   {median(ratios) if ratios else float('nan'):.2g}")
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Print the table and every silent case; 1 where there is one."""
    from cases import random_case

    def option(name: str, usual: str) -> str:
        return arguments[arguments.index(name) + 1] if name in arguments else usual

    first, count, keep = int(option("--from", "0")), int(option("--count", "300")), option("--keep", "")
    rows: list[dict[str, Any]] = []
    for seed in range(first, first + count):
        for row in judged(for_files(random_case(seed))):
            rows.append(row)
            if keep:
                with Path(keep).open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row, default=str) + "\n")
    print(table(rows))
    silent = [r for r in rows if r["word"] == "silent"]
    for r in silent:
        print(f"SILENT seed {r['seed']} {r['model']}: {r['error']:.3g} off, states {r['value']:.3g}, "
              f"truth known to {r['uncertainty']:.2g}")  # fmt: skip
    return 1 if silent else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
