"""Detection of varied names that change the problem, because they change the reference of the errors.

A sweep of a cell size or a tolerance approaches one solution in several ways. A sweep of a load, a length or a
stiffness poses several problems. Errors against different references do not compete, and a configuration that is fast
for one value is no choice at another. A varied name changes the problem if it changes the displacements of a reference
(theory, measurement, or model that serves as one), or the points where they are given.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from softmark.interpreter.study.configurations.configuration_keys import declaration_text

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.results.run_report import ProbeResult, Report
    from softmark.interpreter.study.configurations.task_outcome import PointError

Trace = list[float] | str
SAME = 1e-4  # relative difference below which references are equal up to solver tolerance

# ------------------------------------------------------------------ identification of references


def trace_references(scene: Scene, report: Report, model: str, errors: Mapping[str, PointError]) -> dict[str, Trace]:
    """Return for each reference of a model's errors a few numbers that identify it.

    For each probe with points X and displacements u these are |X|, |u| and weighted sums of X and u, m. A reference
    without displacements, such as a surface, is identified by its declaration and its files.
    """
    found: dict[str, Trace] = {}
    for name in dict.fromkeys(e.against for e in errors.values() if e.against not in (None, model)):
        owner = report.references.get(name) or report.models.get(name)
        if owner is not None and owner.probes:
            found[name] = [v for _, probe in sorted(owner.probes.items()) for v in _identifying_numbers(probe)]
        elif name in report.references:
            found[name] = hashlib.sha256(declaration_text(scene.declared[name]).encode()).hexdigest()
    return found


def _identifying_numbers(probe: ProbeResult) -> list[float]:
    found = []
    for values in (probe.points.ravel().tolist(), probe.displacement.ravel().tolist()):
        found += [math.hypot(*values), sum(v * math.cos(1.7 * i + 0.3) for i, v in enumerate(values))]
    return [v if math.isfinite(v) else 0.0 for v in found]


def _is_different(a: Trace, b: Trace) -> bool:
    """Return whether two references differ; references that cannot be compared, such as failed ones, do not differ."""
    if isinstance(a, str) or isinstance(b, str):
        return isinstance(a, str) and isinstance(b, str) and a != b
    if len(a) != len(b):
        return True
    norms = [max(abs(a[i]), abs(b[i])) for i in range(0, len(a), 2)]
    return any(abs(x - y) > SAME * norms[i // 2] for i, (x, y) in enumerate(zip(a, b, strict=True)))


# ------------------------------------------------------------------ names that change a reference


def mark_problems(points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the results with an entry `problem`: the varied values that change the reference of the errors."""
    changing: dict[str, set[str]] = {}
    for scene in dict.fromkeys(str(p["scene"]) for p in points):
        changing[scene] = _changing_names([p for p in points if str(p["scene"]) == scene])
    return [
        {**p, "problem": {n: t for n, t in (p.get("variation") or {}).items() if n in changing[str(p["scene"])]}}
        for p in points
    ]


def _changing_names(points: Sequence[Mapping[str, Any]]) -> set[str]:
    """Return the varied names that change a reference while all other values stay the same."""
    names = dict.fromkeys(n for p in points for n in p.get("variation") or {})
    return {name for name in names if _is_reference_changed_by(name, points)}


def _is_reference_changed_by(name: str, points: Sequence[Mapping[str, Any]]) -> bool:
    first: dict[tuple[Any, ...], Trace] = {}
    for p in points:
        variation = p.get("variation") or {}
        rest = tuple((n, t) for n, t in variation.items() if n != name)
        for truth, trace in (p.get("measured_from") or {}).items():
            if name in variation and _is_different(first.setdefault((p.get("study"), rest, truth), trace), trace):
                return True
    return False
