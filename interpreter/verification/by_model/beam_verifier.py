"""What vouches for beams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.models.beam import curved_beam_limits, flat_strips
from softmark.interpreter.models.beam.beam_declaration import Beam6Dof
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.results.run_report import ModelResult
from softmark.interpreter.verification.by_model.beam_forces_check import balance_of, reactions_of, rod_of
from softmark.interpreter.verification.by_model.verifier import Found, Voucher
from softmark.interpreter.verification.grid_convergence import COARSE
from softmark.interpreter.verification.probe_errors import NO_ERROR, ProbeAnswer, Unknown
from softmark.interpreter.verification.solution_under_test import Answer
from softmark.solvers.independent_forces.solid_forces import ForceBalance
from softmark.solvers.mesh.shape import Swept

TAPERED = 2.0  # times the square of the slope of the sides: stress follows them, and is not along the axis
LEANING, BORED = (
    0.1,
    1.0,
)  # times that slope, of shear: by Poisson's ratio, a cone has 0.04; and of bores that lean else
BENT, STRETCHED = 0.5, 1.2  # times the square of its strain of bending, and times that of stretch


class Beams(Voucher):
    """Of beams: forces from the places of their points, fewer segments, and what their theory leaves out."""

    theory = "beams"  # what theory it is, for messages

    def facts(self, found: Found) -> dict[str, Any]:
        """The largest strain: of the outermost fibre, with shear."""
        if found.solution.displacement is None:
            return {}
        rod, arm = rod_of(found)
        u, v = (max(abs(p[i]) for p in found.case.prism.section.samples()) for i in (0, 1))
        bent, stretched = rod.strain(np.array([arm, v, u]))
        flat = rod.curvatures[:, 1 if v <= u else 2]  # about the axis along the wider side
        bending = np.hypot(rod.curvatures[:, 1], rod.curvatures[:, 2])
        round_ = {} if found.case.prism.section.hollow is None else {"curvature_per_m": float(bending.max())}
        return {
            **round_,
            "largest_strain": bent + stretched, "bending_strain": bent, "axial_strain": stretched,
            "flat_curvature_per_m": float(np.abs(flat).max()),
        }  # fmt: skip

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """By the formulas of solvers/independent_forces/rod_forces.py. Raises Unchecked."""
        return balance_of(found), found.solution.facts.get("residual")

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """By the same formulas. Raises Unchecked."""
        return reactions_of(found)

    def coarser(self, answer: Answer) -> list[tuple[Solution, float]]:
        """Of half and a quarter as many segments. Raises Unknown."""
        thing = answer.declared.thing
        found: list[tuple[Solution, float]] = []
        segments = thing.segments
        while segments > 1 and len(found) < 2:
            fewer = (segments + 1) // 2
            declared = replace(answer.declared, thing=replace(thing, segments=fewer))
            try:
                solution, _ = answer.solved(
                    f"segments {fewer}", declared, answer.case, fewer / thing.segments, slight=True
                )
            except Unknown:  # of one segment, supports may hold all
                if not found:
                    raise
                break
            found.append((solution, segments / fewer))
            segments = fewer
        if not found:
            raise Unknown("a beam of one segment has no coarser one")
        return found

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """What the theory leaves out. Raises Unknown."""
        tensors = isinstance(seen.metric, TensorMetric)
        if not (seen.in_forces or seen.in_displacements or tensors):
            raise Unknown(f"{NO_ERROR}: what the theory of {self.theory} leaves out is known of displacements alone")
        missing = self.left_out(answer)
        if tensors:
            leans = max(map(leaning, self.pieces(answer.case)))
            return (2.0 * missing + leans) * of_sections(answer, seen)
        return (2.0 if seen.in_forces else 1.0) * missing * seen.size  # an energy goes with the square of what bends

    def left_out(self, answer: Answer) -> float:
        """The same of displacements, relative. Raises Unknown."""
        return left_out(answer.declared.thing, answer.case, answer.result)

    def pieces(self, case: Case) -> Sequence[Swept]:
        """What goes along an axis."""
        return [case.prism]


def left_out(thing: Beam6Dof, case: Case, result: ModelResult) -> float:
    """What the theory of beams leaves out, relative: clamps and thickness, curling across flat sections, tubes that
    flatten, and strain.

    Estimates for solid sections, on the safe side of what solids of the same shape show. Bending stretches one side as
    much as it shortens the other, so that a law that is not linear shows in second order; in stretch it does at once.
    What is pulled or pressed along its axis is neither sheared nor curled.
    """
    section, poisson = case.prism.section, case.material.poisson
    spans, checks = max(1, len(case.supports)), result.solve.get("checks") or {}
    names = "bending_strain", "axial_strain", "flat_curvature_per_m", "curvature_per_m"
    bent, stretched, curvature, of_tube = (float(checks.get(n) or 0.0) for n in names)
    length, bends = case.prism.length, flat_strips.bends(section, case.prism.length, bent, stretched)
    missing = bends * flat_strips.missing(section, length, poisson, spans, thing.shear)
    missing += (1.0 - bends) * flat_strips.gripped(section, length, poisson, spans)
    missing += TAPERED * case.prism.slope**2 + curved_beam_limits.left_out(case.prism)
    missing += flat_strips.stiffening(section, poisson, curvature + case.prism.bend)
    missing += flat_strips.ovalling(section, poisson, of_tube)
    strained: float = BENT * bent**2 + STRETCHED * stretched
    if missing + strained > COARSE:
        raise Unknown(f"the beam is too {'thick' if missing > strained else 'strained'} for its theory")
    return missing + strained


def leaning(shape: Swept) -> float:
    """What the stress of sections leaves out where sides lean, relative: it knows how those lean that are outside."""
    return (LEANING if shape.section.hollow is None else BORED) * shape.slope


def of_sections(answer: Answer, seen: ProbeAnswer) -> float:
    """What an error of the stress of sections is relative to. Raises Unknown where the theory knows nothing."""
    from softmark.interpreter.models.beam.end_effect_zones import disturbed

    if place := disturbed(answer.case, answer.declared.thing, seen.X):
        raise Unknown(f"it looks within a width of {place}, where the theory of sections is crude")
    return seen.size


VOUCHER = Beams()
