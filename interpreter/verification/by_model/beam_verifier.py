"""Verifier of beam models."""

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
from softmark.interpreter.verification.by_model.verifier import VerifiedSolution, Verifier
from softmark.interpreter.verification.grid_convergence import COARSE, HOPELESS, error_from_finer, require_close_grids
from softmark.interpreter.verification.probe_errors import NO_ERROR, NoErrorEstimate, ProbeResultUnderTest
from softmark.interpreter.verification.solution_under_test import LONGER, SolutionUnderTest
from softmark.solvers.independent_forces.solid_forces import ForceBalance
from softmark.solvers.mesh.shape import Swept

TAPERED = 2.0  # times the square of the slope of the sides: stress follows them, and is not along the axis
LEANING, BORED = (
    0.1,
    1.0,
)  # times that slope, of shear: by Poisson's ratio, a cone has 0.04; and of bores that lean else
FIXED = 0.5  # part of the cost of a solution that fewer segments do not reduce
BENT, STRETCHED = 0.5, 1.2  # times the square of its strain of bending, and times that of stretch


class BeamVerifier(Verifier):
    """Verifier of beams, by forces from displaced points, other numbers of segments, and errors of beam theory."""

    theory = "beams"  # what theory it is, for messages

    def facts(self, found: VerifiedSolution) -> dict[str, Any]:
        """Return the largest strain of the outermost fibre, including shear."""
        if found.solution.displacement is None:
            return {}
        rod, arm = rod_of(found)
        u, v = (max(abs(p[i]) for p in found.case.prism.section.samples()) for i in (0, 1))
        bent, stretched = rod.strain(np.array([arm, v, u]))
        flat = rod.curvatures[:, 1 if v <= u else 2]  # about the axis along the wider side
        bending = np.hypot(rod.curvatures[:, 1], rod.curvatures[:, 2])
        twisted = arm * float(np.abs(rod.curvatures[:, 0]).max())
        round_ = {} if found.case.prism.section.hole_radius is None else {"curvature_per_m": float(bending.max())}
        return {
            **round_,
            "largest_strain": bent + stretched, "bending_strain": bent, "axial_strain": stretched,
            "flat_curvature_per_m": float(np.abs(flat).max()), "twist_strain": twisted,
        }  # fmt: skip

    def balance(self, found: VerifiedSolution) -> tuple[ForceBalance, float | None]:
        """Compute the force balance by solvers/independent_forces/rod_forces.py. Raises NoIndependentFormula."""
        return balance_of(found), found.solution.facts.get("residual")

    def reactions(self, found: VerifiedSolution) -> tuple[dict[str, Wrench], float]:
        """Return the reaction of every support by the formulas of rod_forces.py, and their rounding error, N.

        Raises NoIndependentFormula.
        """
        return reactions_of(found)

    def discretisation(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the discretisation error, from a solution with twice as many segments. Raises NoErrorEstimate.

        If that solution costs too much, solutions with fewer segments are used.
        """
        segments = answer.declared.thing.segments
        try:
            with answer.budget.reserving(answer.reserved_solution_cost if answer.asked else 0.0):
                fine = seen.of(self._solve_with_segments(answer, 2 * segments))
        except NoErrorEstimate:
            with answer.budget.reserving(LONGER if answer.in_time else 0.0):
                return super().discretisation(answer, seen)
        farther, apart = None, seen.apart(fine)
        if segments % 2 == 0:
            farther = seen.of(self._solve_with_segments(answer, segments // 2)).apart(seen)
        found = error_from_finer(apart, 2.0, self.order, farther)
        require_close_grids([found], max(seen.size, seen.acting), HOPELESS)
        return found

    def _solve_with_segments(self, answer: SolutionUnderTest, segments: int) -> Solution:
        """Return the solution with another number of segments. Raises NoErrorEstimate."""
        thing = answer.declared.thing
        declared = replace(answer.declared, thing=replace(thing, segments=segments))
        ratio = segments / thing.segments
        costs = max(ratio, FIXED + (1.0 - FIXED) * ratio)
        return answer.solve_other_model(f"segments {segments}", declared, answer.case, costs, slight=True)[0]

    def coarser(self, answer: SolutionUnderTest) -> list[tuple[Solution, float]]:
        """Return solutions with half and a quarter of the segments, each with its ratio to the one before it.

        Raises NoErrorEstimate.
        """
        thing = answer.declared.thing
        found: list[tuple[Solution, float]] = []
        segments = thing.segments
        while segments > 1 and len(found) < 2:
            fewer = (segments + 1) // 2
            try:
                solution = self._solve_with_segments(answer, fewer)
            except NoErrorEstimate:  # of one segment, supports may hold all
                if not found:
                    raise
                break
            found.append((solution, segments / fewer))
            segments = fewer
        if not found:
            raise NoErrorEstimate("a beam of one segment has no coarser mesh to compare with")
        return found

    def model(self, answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
        """Return the error of beam theory in a result, in the unit of its metric. Raises NoErrorEstimate."""
        tensors = isinstance(seen.metric, TensorMetric)
        if not (seen.is_about_forces or seen.is_about_displacements or tensors):
            raise NoErrorEstimate(f"{NO_ERROR}: the error of {self.theory} theory is known for displacements only")
        missing = self.left_out(answer)
        if tensors:
            leans = max(map(taper_error, self.pieces(answer.case)))
            return (2.0 * missing + leans) * section_stress_scale(answer, seen)
        return (
            (2.0 if seen.is_about_forces else 1.0) * missing * seen.size
        )  # an energy goes with the square of what bends

    def left_out(self, answer: SolutionUnderTest) -> float:
        """Return the relative displacement error of beam theory. Raises NoErrorEstimate."""
        return theory_error(answer.declared.thing, answer.case, answer.result)

    def pieces(self, case: Case) -> Sequence[Swept]:
        """Return the prismatic or tapered bodies to which beam theory is applied."""
        return [case.prism]


def theory_error(thing: Beam6Dof, case: Case, result: ModelResult) -> float:
    """Return the relative error of beam theory due to clamps, thickness, curling, ovalization and strain.

    The estimates apply to solid sections and are conservative compared with solids of the same shape. In bending one
    side is stretched as much as the other is compressed, so a nonlinear law has only a second-order effect. In axial
    stretch its effect is of first order. Axially loaded bodies neither shear nor curl.
    """
    section, poisson = case.prism.section, case.material.poisson
    spans, checks = max(1, len(case.supports)), result.solve.get("checks") or {}
    names = "bending_strain", "axial_strain", "flat_curvature_per_m", "curvature_per_m"
    bent, stretched, curvature, of_tube = (float(checks.get(n) or 0.0) for n in names)
    length, bends = case.prism.length, flat_strips.bending_share(section, case.prism.length, bent, stretched)
    twists = min(1.0, float(checks.get("twist_strain") or 0.0) / bent) ** 2 if bent > 0.0 else 0.0
    clamped = (1.0 - twists) * flat_strips.clamp_effect_on_bending(section, length, poisson, spans, thing.shear)
    missing = bends * (clamped + twists * flat_strips.clamp_effect_on_torsion(section, length, poisson, spans))
    missing += (1.0 - bends) * flat_strips.clamp_effect_on_stretch(section, length, poisson, spans)
    missing += TAPERED * case.prism.taper_slope**2 + curved_beam_limits.slender_rod_error(case.prism)
    missing += flat_strips.strip_stiffening(section, poisson, curvature + case.prism.axis_curvature)
    missing += flat_strips.ovalling_softening(section, poisson, of_tube)
    strained: float = BENT * bent**2 + STRETCHED * stretched
    if missing + strained > COARSE:
        raise NoErrorEstimate(
            "the beam is too thick for beam theory" if missing > strained else "the strain is too large for beam theory"
        )
    return missing + strained


def taper_error(shape: Swept) -> float:
    """Return the relative error of section stress due to tapered sides.

    The stress formula already accounts for the slope of the outer surface.
    """
    return (LEANING if shape.section.hole_radius is None else BORED) * shape.taper_slope


def section_stress_scale(answer: SolutionUnderTest, seen: ProbeResultUnderTest) -> float:
    """Return the stress or strain by which a relative error of section stress is multiplied.

    Raises NoErrorEstimate if the theory gives no section stress.
    """
    from softmark.interpreter.models.beam.end_effect_zones import nearby_disturbance

    if place := nearby_disturbance(answer.case, answer.declared.thing, seen.X):
        raise NoErrorEstimate(f"the probe is within one section width of {place}, where beam theory is inaccurate")
    return seen.size


VERIFIER = BeamVerifier()
