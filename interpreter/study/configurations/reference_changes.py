"""Which variations are other problems: those that change what errors are measured from.

A sweep of a cell size or a tolerance tries to reach one solution in several ways. A sweep of a load, a length or a
stiffness asks several questions: errors against different truths do not compete, and a configuration that is quick at
one value is no choice at another. What errors are measured from says which is which: a varied name that changes its
displacements, or where they are taken, changes the problem; so does one that changes a model that is measured against.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from softmark.interpreter.study.configurations.configuration_keys import words_of

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.results.run_report import ProbeResult, Report
    from softmark.interpreter.study.configurations.task_outcome import PointError

Trace = list[float] | str
SAME = 1e-4  # relative: truths nearer than this are one, solved to another tolerance

# ------------------------------------------------------------------ what a truth is known by


def traces(scene: Scene, report: Report, model: str, errors: Mapping[str, PointError]) -> dict[str, Trace]:
    """A few numbers of everything that a model's errors are measured from.

    They are |X|, |u| and weighted sums of X and u for each probe. A reference without
    displacements, such as a surface, is known by its declaration and its files.
    """
    found: dict[str, Trace] = {}
    for name in dict.fromkeys(e.against for e in errors.values() if e.against not in (None, model)):
        owner = report.references.get(name) or report.models.get(name)
        if owner is not None and owner.probes:
            found[name] = [v for _, probe in sorted(owner.probes.items()) for v in _numbers(probe)]
        elif name in report.references:
            found[name] = hashlib.sha256(words_of(scene.declared[name]).encode()).hexdigest()
    return found


def _numbers(probe: ProbeResult) -> list[float]:
    found = []
    for values in (probe.points.ravel().tolist(), probe.displacement.ravel().tolist()):
        found += [math.hypot(*values), sum(v * math.cos(1.7 * i + 0.3) for i, v in enumerate(values))]
    return [v if math.isfinite(v) else 0.0 for v in found]


def _differ(a: Trace, b: Trace) -> bool:
    """Whether two truths are not the same; what cannot be compared, such as one that failed, says nothing."""
    if isinstance(a, str) or isinstance(b, str):
        return isinstance(a, str) and isinstance(b, str) and a != b
    if len(a) != len(b):
        return True
    norms = [max(abs(a[i]), abs(b[i])) for i in range(0, len(a), 2)]
    return any(abs(x - y) > SAME * norms[i // 2] for i, (x, y) in enumerate(zip(a, b, strict=True)))


# ------------------------------------------------------------------ which names change it


def marked(points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The points, each with its `problem`: what was varied of it that changes what errors are measured from."""
    changing: dict[str, set[str]] = {}
    for scene in dict.fromkeys(str(p["scene"]) for p in points):
        changing[scene] = _changing([p for p in points if str(p["scene"]) == scene])
    return [
        {**p, "problem": {n: t for n, t in (p.get("variation") or {}).items() if n in changing[str(p["scene"])]}}
        for p in points
    ]


def _changing(points: Sequence[Mapping[str, Any]]) -> set[str]:
    """Names of which two values, all else being the same, have different truths."""
    names = dict.fromkeys(n for p in points for n in p.get("variation") or {})
    return {name for name in names if _changes(name, points)}


def _changes(name: str, points: Sequence[Mapping[str, Any]]) -> bool:
    first: dict[tuple[Any, ...], Trace] = {}
    for p in points:
        variation = p.get("variation") or {}
        rest = tuple((n, t) for n, t in variation.items() if n != name)
        for truth, trace in (p.get("measured_from") or {}).items():
            if name in variation and _differ(first.setdefault((p.get("study"), rest, truth), trace), trace):
                return True
    return False
