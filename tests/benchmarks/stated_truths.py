"""Stated errors beside true ones, where theory knows the truth: `python tests/benchmarks/stated_truths.py [--help]`.

Every case is a body whose answer theory knows (`closed_forms.py`). The table has, per quantity, the value, the truth,
the true error, the stated one and their ratio. Below it: how many quantities have a number, how many of the numbers are
smaller than the true error, the quartiles of the ratio, and what stating cost (CPU) over the solution. Ratios leave out
what is exact: true errors below 1e-7 of the quantity's scale.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import numpy as np
from closed_forms import Case, cases

from softmark.interpreter.api.python_api import loads
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene
from softmark.interpreter.verification import error_estimate

EXACT = 1e-7  # of the scale of a quantity: true errors below it have no ratio
FREE = 5.0  # s of CPU that stating may take in any case
SOLUTIONS = 2.0  # times the solution that it may take where that is more


def rows(case: Case) -> Iterator[dict[str, Any]]:
    """One per quantity of every model."""
    scene = loads(case.scene())
    spent: dict[str, float] = {}
    plain = error_estimate.estimate_errors

    def timed(scene_: Any, declared: Any, *others: Any, **more: Any) -> Any:
        start = time.process_time()
        try:
            return plain(scene_, declared, *others, **more)
        finally:
            spent[declared.name] = time.process_time() - start

    for i, made in enumerate(case.models):
        name = f"m{i}"
        options = RunOptions(only=(name,), draw=False, stated=(name,))
        run_scene(scene.scene, list(scene.warnings), options)  # whatever is compiled, is
        error_estimate.estimate_errors = timed
        try:
            model = run_scene(scene.scene, list(scene.warnings), options).models[name]
        finally:
            error_estimate.estimate_errors = plain
        took = sum(t.median for n in ("setup_cpu_s", "solve_cpu_s") if (t := model.time.get(n)))
        for metric, (_, truth, scale) in case.truths.items():
            value, said = model.metrics[f"q_{metric}"].value, model.stated.get(f"q_{metric}")
            off = None if value is None else abs(value - truth)
            yield {
                "case": case.name, "half": case.half, "model": made, "metric": metric, "value": value, "truth": truth,
                "off": off, "scale": abs(scale), "slack": case.error * abs(truth),
                "stated": None if said is None else said.value, "parts": None if said is None else dict(said.parts),
                "reason": None if said is None else said.reason, "status": model.status,
                "cost": spent.get(name, 0.0), "took": took,
            }  # fmt: skip


def ratio(row: dict[str, Any]) -> float | None:
    """Stated over true; None of what is exact or has no number."""
    if row["stated"] is None or row["off"] is None or row["off"] <= max(EXACT * row["scale"], 3 * row["slack"]):
        return None
    return float(row["stated"] / row["off"])


def below(row: dict[str, Any]) -> bool:
    """Whether the true error is the larger, by more than rounding and what is not known of the truth."""
    return row["stated"] is not None and row["off"] > row["stated"] + row["slack"] + 1e-9 * row["scale"]


def line(row: dict[str, Any]) -> str:
    """One quantity."""
    off = "–" if row["off"] is None else f"{100 * row['off'] / row['scale']:9.3g}"
    said = "        –" if row["stated"] is None else f"{100 * row['stated'] / row['scale']:9.3g}"
    times = f"{r:7.2f}" if (r := ratio(row)) is not None else "       "
    parts = " ".join(f"{k}={100 * v / row['scale']:.2g}" for k, v in (row["parts"] or {}).items() if v)
    head = f"{row['case'][:22]:22s} {row['model'][:48]:48s} {row['metric']:5s} {row['value'] or math.nan:12.5g}"
    word = " BELOW" if row["off"] is not None and below(row) else ""
    cost = f"{row['cost']:6.2f} s / {row['took']:5.2f} s"
    return f"{head} {row['truth']:12.5g} {off} % {said} % {times} {cost}{word}  {row['reason'] or parts}"


def summary(found: list[dict[str, Any]]) -> str:
    """The counts."""
    told = [r for r in found if r["stated"] is not None]
    ratios = [q for r in told if (q := ratio(r)) is not None]
    low, _, high = quantiles(ratios) if len(ratios) > 1 else (math.nan,) * 3
    short = sum(below(r) for r in told)
    dear = {(r["case"], r["model"]) for r in found if r["cost"] > max(FREE, SOLUTIONS * r["took"])}
    asked = {(r["case"], r["model"]) for r in found}
    costs = list({(r["case"], r["model"]): r["cost"] / max(r["took"], 1e-9) for r in found}.values())
    middle = median(ratios) if ratios else math.nan
    return (
        f"{len(found)} quantities, {len(found) - len(told)} without a number, {short} below the truth "
        f"({100 * short / max(len(told), 1):.1f} %); ratio: median {middle:.2f}, quartiles {low:.2f} and {high:.2f}, "
        f"largest {max(ratios, default=math.nan):.3g} of {len(ratios)}; {len(dear)} of {len(asked)} models over "
        f"{FREE:g} s and {SOLUTIONS:g} solutions, cost over solution in the median {median(costs):.1f}"
    )


def main() -> None:
    """Print the table. --keep FILE: lines of JSON."""
    words = argparse.ArgumentParser(description=(__doc__ or "").split(":")[0])
    words.add_argument("--half", choices=("tune", "held"), help="half of the cases")
    words.add_argument("--only", default="", help="cases whose names hold these words")
    words.add_argument("--keep", type=Path, help="a file for all numbers, as lines of JSON")
    asked = words.parse_args()
    found: list[dict[str, Any]] = []
    for case in cases():
        if asked.half in (None, case.half) and asked.only in case.name:
            for row in rows(case):
                found.append(row)
                print(line(row), flush=True)
                if asked.keep:
                    with asked.keep.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(row) + "\n")
    for half in ("tune", "held"):
        if own := [r for r in found if r["half"] == half]:
            print(half, summary(own))
    print("all ", summary(found))


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
