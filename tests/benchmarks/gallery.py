"""What the documentation's gallery shows of the shipped scenes: `python tests/benchmarks/gallery.py [SCENE ...]`.

Runs one after another, each in a process of its own, and writes `interpreter/documentation/gallery.json` (numbers,
verdicts, sources, CPU time) and `interpreter/documentation/pictures/gallery/SCENE.png`. Scenes whose text is the one
that their numbers are of are left out: interrupted, it goes on where it was. `--fresh` runs them again, `--timeout` is
s of CPU of each.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

from gallery_pictures import picture_of

from softmark.interpreter.documentation.scene_gallery import NUMBERS, PICTURES, load_results, text_hash
from softmark.interpreter.language.scene_sources import standard_scenes

if TYPE_CHECKING:
    from softmark.interpreter.results.run_report import ModelResult, ReferenceResult

Json = dict[str, Any]
LAST = ("silicone-beam-", "ironing", "half-spheres", "truth-cube", "ventricle", "cantilevers", "pin-", "coated-rod")


def main() -> None:
    """Every scene that is asked for, or those whose numbers are missing or of another text."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--timeout", type=float, default=900.0)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parsed = parser.parse_args()
    if parsed.one:
        print(json.dumps(record_of(parsed.one)))
        return
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in parsed.scenes or sorted(standard_scenes(), key=lambda n: n.startswith(LAST)):
        if parsed.fresh or load_results().get(name, {}).get("sha256") != text_hash(name):
            found = _run(name, parsed.timeout)
            if found is not None:
                _keep({**load_results(), name: found})


def _keep(found: dict[str, Json]) -> None:
    """A line of the file for each scene; of one that is no longer shipped none."""
    kept = {name: found[name] for name in sorted(found) if name in standard_scenes()}
    rows = [f"{json.dumps(name)}: {json.dumps(record, ensure_ascii=False)}" for name, record in kept.items()]
    NUMBERS.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")


def _run(name: str, seconds: float) -> Json | None:
    """The record of a scene from a process of its own, which is given so many s of CPU; None if it ended early."""
    began = time.monotonic()

    def bounded() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 10))

    done = subprocess.run(
        [sys.executable, __file__, "--one", name], stdout=subprocess.PIPE, text=True, preexec_fn=bounded, check=False
    )
    took = time.monotonic() - began
    if done.returncode != 0:
        print(f"{name}: ended with {done.returncode} after {took:.0f} s", flush=True)
        return None
    found: Json = json.loads(done.stdout.splitlines()[-1])
    print(f"{name}: {found['seconds']:.1f} s of CPU, {took:.0f} s", flush=True)
    return found


def record_of(name: str) -> Json:
    """What the gallery keeps of a scene: it is run, and its picture is written."""
    import softmark

    scene = softmark.load(name)
    began = time.process_time()
    report = scene.run()
    seconds = time.process_time() - began
    return {
        "title": report.scene["title"], "sha256": text_hash(name), "softmark": report.environment.get("softmark"),
        "seconds": round(seconds, 2), "status": report.exit_status,
        "models": {n: _model(m) for n, m in report.models.items()},
        "references": {n: _reference(r) for n, r in report.references.items()},
        "expectations": [
            {"text": e.text, "verdict": e.verdict, "value": e.value, "unit": e.unit, "left_out": e.left_out}
            for e in report.expectations
        ],
        "picture": picture_of(report, PICTURES / f"{name}.png"),
    }  # fmt: skip


def _model(m: ModelResult) -> Json:
    clock = m.time.get("solve_cpu_s")
    return {
        "outline": m.outline, "status": m.status, "message": m.message, "dofs": m.size.get("dofs"),
        "cpu": None if clock is None else float(f"{clock.median:.3g}"), "metrics": _metrics(m),
    }  # fmt: skip


def _reference(r: ReferenceResult) -> Json:
    return {"kind": r.kind, "means": r.means, "status": r.status, "source": r.source, "metrics": _metrics(r)}


def _metrics(result: ModelResult | ReferenceResult) -> Json:
    """Values in SI to six digits and units; of what has no value why."""
    return {
        n: {"value": None if m.value is None else float(f"{m.value:.6g}"), "unit": m.unit}
        | ({"reason": m.reason} if m.value is None else {})
        | ({"clock": True} if "verdict" in m.details else {})
        for n, m in result.metrics.items()
    }


if __name__ == "__main__":
    main()
