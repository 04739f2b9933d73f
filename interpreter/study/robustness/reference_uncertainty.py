"""Uncertainty of a reference: its numerical error and, for a beam theory, its modelling error.

A beam theory differs from the solid body in three effects. A clamp prevents the section from deforming, which stiffens
the root over a part of the depth as a plate is stiffer than a strip, by 1 / (1 - nu^2). The effects of a thick section
grow with the square of depth over length. The material of the theory is linear, which gives an error of the square of
strain. All three are estimated only from the scene, without solving a model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.problem.body_case import Fault, case_for
from softmark.interpreter.problem.theories.reference_solution import problem_of
from softmark.interpreter.results.json_records import JsonRecord, mapping_reader
from softmark.interpreter.study.configurations.task_outcome import (
    PointOutcome,
    PointSummary,
    ProbeTrace,
    TaskAttempt,
    TruthStatement,
)
from softmark.records import dataclass

# times nu^2 width / length, or depth if that is larger. Ten-node tetrahedra of a fifth of the depth, on a beam 10 times
# as long as deep, are 1 % off at nu = 0.3 and nearly right at nu = 0: a root stiffer over 0.28 depths explains it, as
# 4 * 0.28 = 1.1
CLAMPED = 1.2
THICK = 0.2  # times (depth / length)^2
STRAINED = 0.5  # times the square of the largest strain of bending
LARGEST_STRAIN = 0.3  # largest bending strain at the clamp for which a linear section is valid in a soft solid
LINES = ("elastica", "simo_reissner", "small_deflection")


@dataclass(frozen=True)
class LeanReference(JsonRecord):
    """Result of a reference in short: its error, m, and the root mean square displacement at each probe, m."""

    status: str
    message: str | None
    estimated_error: float | None
    sizes: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class LeanOutcome(TaskAttempt):
    """Outcome of a task in short: the numbers that decide its class, without displacement fields."""

    READ: ClassVar = {
        "truths": PointOutcome.READ["truths"], "point": PointSummary.from_json,
        "references": mapping_reader(LeanReference.from_json),
    }  # fmt: skip
    SELDOM: ClassVar = PointOutcome.SELDOM

    key: str
    truths: Mapping[str, TruthStatement] | None
    wall_s: float | None
    cpu_s: float | None
    unfinished: bool
    limit_s: float | None
    point: PointSummary
    references: Mapping[str, LeanReference] = field(default_factory=dict)

    @property
    def status(self) -> str:
        """Status of the solution, such as `converged` or `timed_out`."""
        return self.point.status


def uncertainty_of(outcome: LeanOutcome, against: str, probe: str, metric: str = "") -> float | None:
    """Return the numerical error of a reference relative to its displacement at a probe; None if unknown.

    For a model that serves as the reference it is the error that the model states, in terms of the metric. For given
    values it is their stated uncertainty.
    """
    if (truth := (outcome.truths or {}).get(against)) is not None:
        return None if truth.stated is None else truth.stated.value
    reference = outcome.references.get(against)
    if reference is None or reference.estimated_error is None or not reference.sizes.get(probe):
        given = outcome.point.errors.get(metric)
        return None if given is None else given.uncertainty
    return reference.estimated_error / reference.sizes[probe]


def reduce_outcome(outcome: PointOutcome) -> LeanOutcome:
    """Return an outcome without its displacement fields, with the numbers that decide its class."""
    references = {
        name: LeanReference(
            r.status, r.message, r.estimated_error, {n: _root_mean_square(p) for n, p in r.probes.items()}
        )
        for name, r in outcome.references.items()
    }
    own = (outcome.truths, outcome.wall_s, outcome.cpu_s, outcome.unfinished, outcome.limit_s)
    return LeanOutcome(outcome.key, *own, PointSummary.from_json(outcome.point), references)


def _root_mean_square(probe: ProbeTrace) -> float:
    """Return the root mean square of the magnitudes of displacements at a probe, m."""
    return math.sqrt(sum(math.hypot(*u) ** 2 for u in probe.displacement) / max(1, len(probe.displacement)))


def beam_theory_error(scene: Scene, against: str) -> tuple[float, str | None]:
    """Return the relative modelling error of a beam theory, and the reason if the theory is invalid for this scene.

    For other references the error is 0 and the reason None.
    """
    reference = scene.declared[against]
    if reference.kind != "reference" or reference.constructor.name not in LINES:
        return 0.0, None
    try:
        beam = problem_of(reference, case_for(scene, reference))
    except Fault as refused:
        return 0.0, refused.diagnostic.message
    height, width = beam.section.extents
    k, ratio, widest = beam.load_parameter, height / beam.length, max(height, width) / beam.length
    # phi'(0) = k int (1-s) cos(phi) ds <= k / 2, and phi'(0)^2 / 2 = k int sin(phi) ds <= k
    strain = 0.5 * ratio * min(0.5 * k, math.sqrt(2 * k))
    if strain > LARGEST_STRAIN:
        return (
            0.0,
            f"strains reach {strain:.2g} at the clamp, beyond the range of the linear constitutive law of the theory",
        )
    clamped = CLAMPED * beam.poisson**2 * widest
    return clamped + THICK * widest**2 + STRAINED * strain**2, None
