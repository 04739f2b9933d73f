"""Check for result files whose displacements seem to be in a wrong unit, off by a power of a thousand.

A result file does not state the unit of its displacements. If its lengths fit the body, only the displacements show the
mistake. Other factors are treated as ordinary errors.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.imported_results.support_compliance import ANOTHER
from softmark.interpreter.results.run_report import ModelResult, ProbeResult, ReferenceResult

FACTORS = {1e3: "a thousand times as far", 1e-3: "a thousandth as far"}
NEAR = 0.1  # relative to a factor: an answer that is wrong by just so much for another reason is not likely


def other_units(
    scene: Scene, models: Mapping[str, ModelResult], references: Mapping[str, ReferenceResult]
) -> list[Diagnostic]:
    """Return a warning for each result file whose displacements differ from another result by a power of a thousand."""
    found = []
    for name, own in models.items():
        if own.status != "read":
            continue
        others: list[ModelResult | ReferenceResult] = [
            *references.values(),
            *(m for m in models.values() if m.status == "converged"),
        ]
        told = next(_probes_off_by_factor(own.probes, others), None)
        if told is not None:
            probe, other, words = told
            declared = scene.declared[name]
            found.append(
                diagnostic(
                    "W704",
                    declared.at("unit"),
                    f"`{name}` moves `{probe}` {words} as `{other}` does",
                    "wrong unit?",
                    ANOTHER,
                )
            )
    return found


def _probes_off_by_factor(
    own: Mapping[str, ProbeResult], others: Iterable[ModelResult | ReferenceResult]
) -> Iterator[tuple[str, str, str]]:
    """Yield each probe at which another result differs by a power of a thousand.

    Each item is the name of the probe, the name of the other result, and the factor as text.
    """
    for other in others:
        for name in (n for n in own if n in other.probes):
            mine, theirs = _largest_probe_displacement(own[name]), _largest_probe_displacement(other.probes[name])
            for factor, words in FACTORS.items():
                if theirs > 0.0 and abs(mine / theirs / factor - 1.0) <= NEAR:
                    yield name, other.name, words


def _largest_probe_displacement(seen: ProbeResult) -> float:
    """Return the largest displacement of the points of a probe, m."""
    u = seen.displacement if seen.course is None else seen.course
    return float(np.linalg.norm(u, axis=-1).max(initial=0.0))
