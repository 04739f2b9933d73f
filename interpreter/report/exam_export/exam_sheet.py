"""Exam sheet of a scene: probe points, reference values and requested metrics, without solving any model.

Its schema is `softmark-exam/1`. Numbers are in SI, null if there is none.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import softmark
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.scene_states import states_of
from softmark.interpreter.models.model_preparation import from_a_model
from softmark.interpreter.pipeline import probe_sampling, reference_runs, report_assembly, run_state
from softmark.interpreter.pipeline.run_environment import describe_scene
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.planning.run_plan import plan_of
from softmark.interpreter.problem.body_case import Fault
from softmark.interpreter.results import atomic_files
from softmark.interpreter.results.json_records import to_plain_json

SCHEMA = "softmark-exam/1"
FILE = "exam.json"
UNITS = "SI: points and displacements in m, times in s, forces in N, moments in N*m, stresses in Pa, energies in J"


def make_sheet(scene: Scene, options: RunOptions) -> dict[str, Any]:
    """Return the exam sheet without its entry of exported models.

    Raises SceneError for probes whose points cannot be found.
    """
    asked, left = plan_of(scene), []
    known = []
    for name in asked.references:
        how = scene.declared[name].thing.how
        if from_a_model(scene.declared[name]) or how == "refined":
            left.append(
                {"what": f"reference `{name}`", "why": "it is computed from results of models, and none was run"}
            )
        else:
            known.append(name)
    works = run_state.make_state_runs(scene, replace(asked, models=(), references=tuple(known)), options, [])
    for work in works:
        reference_runs.read_measurements(work)
        probe_sampling.place_probes(work)
    for work in works:
        reference_runs.solve_references(work)
    report = report_assembly.unfinished_report(works).to_json()
    found = {
        "schema": SCHEMA,
        "softmark": softmark.__version__,
        "units": UNITS,
        "scene": describe_scene(scene),
        "states": list(states_of(scene)),
        "probes": {name: _probe_entry(works[-1], own, left) for name, own in scene.of_kind("probe").items()},
        "metrics": {name: _metric_entry(own) for name, own in scene.of_kind("metric").items()},
        "references": report["references"],
        "expectations": [{"text": e.text, "line": e.location.span.line} for e in scene.expectations],
        "left": left,
    }
    return dict(to_plain_json(found))


def _probe_entry(work: Any, probe: Declared, left: list[dict[str, str]]) -> dict[str, Any]:
    """Return the points of a probe, shape (n, 3), m, in the last state, as an entry of the sheet."""
    own: dict[str, Any] = {"body": probe.thing.body, "text": _declaration_text(probe), "points": None}
    if probe.name not in {known.name for known in work.probes(probe.thing.body)}:
        return own | {"reason": "its points are those of a measurement that could not be read"}
    try:
        place = work.place(probe)
    except (Fault, KeyError) as fault:
        left.append({"what": f"probe `{probe.name}`", "why": str(fault)})
        return own | {"reason": str(fault)}
    own["points"] = place.X.tolist()
    return own if place.triangles is None else own | {"triangles": place.triangles.tolist()}


def _metric_entry(metric: Declared) -> dict[str, Any]:
    return {"text": _declaration_text(metric), "unit": metric.thing.unit}


def _declaration_text(declared: Declared) -> str:
    """Return the text of a declaration after `=`, on one line."""
    return " ".join(declared.location.text.partition("=")[2].split())


def write(found: Mapping[str, Any], folder: Path) -> Path:
    """Write the exam sheet to a file in a folder and return its path. Raises OSError."""
    return atomic_files.replace(folder / FILE, json.dumps(found, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
