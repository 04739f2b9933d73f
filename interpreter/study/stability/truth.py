"""How far a truth can be trusted: the numerical error of a reference, and for a theory of beams its own.

A theory of a line is not the solid. It leaves out that a clamp keeps its section from changing, which stiffens the
root over a part of the depth as a plate is stiffer than a strip, by 1 / (1 - nu^2); what remains of a thick section,
with the square of depth over length; and, since its material is linear, the square of strain. All three are estimated
from the scene alone; no model is asked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from softmark.interpreter.language.scene import Scene
from softmark.interpreter.problem.beam_theory import cantilever_of
from softmark.interpreter.problem.case import Fault, case_for

# times nu^2 width / length, or depth if that is larger. Ten-node tetrahedra of a fifth of the depth, on a beam 10 times
# as long as deep, are 1 % off at nu = 0.3 and nearly right at nu = 0: a root stiffer over 0.28 depths explains it, as
# 4 * 0.28 = 1.1
CLAMPED = 1.2
THICK = 0.2  # times (depth / length)^2
STRAINED = 0.5  # times the square of the largest strain of bending
LARGEST_STRAIN = 0.3  # of the fibres at the clamp, beyond which a linear section says nothing of a soft solid
LINES = ("elastica", "simo_reissner", "small_deflection")


def uncertainty_of(outcome: Mapping[str, Any], against: str, probe: str) -> float | None:
    """The numerical error of a reference relative to what it says the probe moves; None where it is not known.

    Of a model that is taken as right it is what the model states, in the terms of the metric.
    """
    if (truth := (outcome.get("truths") or {}).get(against)) is not None:
        value = (truth.get("stated") or {}).get("value")
        return None if value is None else float(value)
    reference = (outcome.get("references") or {}).get(against) or {}
    error, size = reference.get("estimated_error"), (reference.get("sizes") or {}).get(probe)
    return None if error is None or not size else float(error) / float(size)


def lean(outcome: Mapping[str, Any]) -> dict[str, Any]:
    """What of an outcome decides its class: fields of displacements as their root mean square."""
    point = outcome["point"]
    kept = ("status", "message", "outline", "size", "errors", "warnings", "stated")
    references = {
        name: {
            "status": r.get("status"), "message": r.get("message"), "estimated_error": r.get("estimated_error"),
            "sizes": {n: _size(p["displacement"]) for n, p in (r.get("probes") or {}).items()},
        }
        for name, r in (outcome.get("references") or {}).items()
    }  # fmt: skip
    own = {n: v for n, v in outcome.items() if n not in ("point", "references")}
    return {**own, "point": {n: point[n] for n in kept if n in point}, "references": references}


def _size(displacement: list[list[float]]) -> float:
    """Root mean square of the lengths of displacements, m."""
    return math.sqrt(sum(math.hypot(*u) ** 2 for u in displacement) / max(1, len(displacement)))


def theory_of(scene: Scene, against: str) -> tuple[float, str | None]:
    """What a theory of beams leaves out, relative, and why it is no truth here, if it is none."""
    reference = scene.declared[against]
    if reference.kind != "reference" or reference.constructor.name not in LINES:
        return 0.0, None
    try:
        beam = cantilever_of(reference, case_for(scene, reference))
    except Fault as refused:
        return 0.0, refused.diagnostic.message
    height, width = beam.section.extents
    k, ratio, widest = beam.load_parameter, height / beam.length, max(height, width) / beam.length
    # phi'(0) = k int (1-s) cos(phi) ds <= k / 2, and phi'(0)^2 / 2 = k int sin(phi) ds <= k
    strain = 0.5 * ratio * min(0.5 * k, math.sqrt(2 * k))
    if strain > LARGEST_STRAIN:
        return 0.0, f"strains reach {strain:.2g} at the clamp: the theory is linear in them, and the solid is not"
    clamped = CLAMPED * beam.poisson**2 * widest
    return clamped + THICK * widest**2 + STRAINED * strain**2, None
