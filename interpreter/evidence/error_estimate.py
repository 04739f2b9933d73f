"""What error a model itself states for what it says, without a look at any reference.

Parts are added up, each a function of what a probe sees. Discretisation: how far the state is from that of a finer
space over the same cells, or where that is not to be had from the same model on coarser meshes. Model: how far the same
model with the best strain measure that its material has is; of beams, estimates of what their theory leaves out.
Rounding: from how near to singular the stiffness is, or from the forces and coordinates. Solver: the Newton step that
would come next. Where one cannot be told, or would cost too much, the model vouches for nothing, and says why. Each is
told in the unit of a metric, by the metric itself, or not at all. What nobody asked for is told where it is free.

A warning of DOUBTS counts as said as well: with it a model says of itself that its answer may be off. With one of VOID
it vouches for nothing.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.evidence import finer, orders, rounding
from softmark.interpreter.evidence.budget import NOT_ASKED, Budget
from softmark.interpreter.evidence.doubts import DOUBTS, doubts_of, is_doubt
from softmark.interpreter.evidence.probe_answers import NO_ERROR, Field, Floats, Seen, Unknown
from softmark.interpreter.evidence.selection_error import selection
from softmark.interpreter.front.course_steps import shows
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.metrics.course_norm import CourseNorm
from softmark.interpreter.models.beam import ribbon
from softmark.interpreter.models.beam.words import Beam6Dof
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.shared.prepared import Solution, Workshop
from softmark.interpreter.models.springs.words import MassSpring
from softmark.interpreter.problem.case import Case, Fault, case_for
from softmark.interpreter.problem.parts.resultants import of_selections
from softmark.interpreter.problem.view import View
from softmark.interpreter.results.report import ModelResult, ProbeResult, clean
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.solvers.elements import element_of

__all__ = ["DOUBTS", "Seen", "Stated", "Unknown", "doubts_of", "is_doubt", "stated"]

VOID = ("W351",)  # states of which no part of the error says anything

FINER = 2.0  # how much finer or coarser the other mesh is
NEAR, APART = 1.25, 1.6  # times as many cells along an edge: less is the same mesh; from here on it will do
THEORY = 2.0  # times the distance of two strain measures on another mesh
ALIKE = 1.25  # the same on the mesh itself
HOPELESS = 1.0  # relative: an error of all that moves is no statement
STEP = 3.0  # times the distance of two steps over r - 1
BENT, STRETCHED = 0.5, 1.2  # of a beam: times the square of its strain of bending, and times that of stretch
LEFT = 2.0  # times the next Newton step
TRIFLE = 1e-6  # relative: a step whose largest node is below that need not be looked up anywhere
FACTORED = 300_000  # unknowns up to which that step is computed
COARSE = orders.COARSE  # relative: more than that is no statement, of parts that are estimates


@dataclass
class Stated:
    """Everything about one model that its error is stated from; other solutions are found once."""

    scene: Scene
    declared: Declared
    case: Case
    prepared: Any
    result: ModelResult
    measured: Mapping[str, Any]
    mesh: Any
    asked: bool = True
    _kept: dict[str, Any] = field(default_factory=dict)

    def of(self, seen: Seen) -> dict[str, Any]:
        """The parts of the error of what a probe sees, and their sum; `reason` where there is none."""
        parts: dict[str, float | None] = {}
        reasons: dict[str, list[str]] = {}
        for name, part in self._parts().items():
            try:
                with self.budget:
                    parts[name] = part(seen)
                if not math.isfinite(parts[name] or 0.0):
                    raise Unknown("a part of the error is not finite")
            except Unknown as unknown:
                parts[name] = None
                reasons.setdefault(str(unknown), []).append(name)
        known = [v for v in parts.values() if v is not None]
        value = sum(known) if len(known) == len(parts) else None
        reason = "; ".join(f"{', '.join(names)}: {why}" for why, names in reasons.items())
        return {"value": value, "unit": seen.unit, "parts": parts, "reason": reason or None}

    def _parts(self) -> dict[str, Callable[[Seen], float]]:
        found: dict[str, Callable[[Seen], float]] = {
            "discretisation": self._discretisation,
            "model": self._model,
            "rounding": self._rounding,
            "solver": self._solver,
        }
        found |= selection(self)
        found |= of_selections(self.result.loads)
        return found | ({"time": self._time} if isinstance(self.case.analysis, Dynamic) else {})

    # -------------------------------------------------------------- other solutions

    @cached_property
    def budget(self) -> Budget:
        """What may be spent on it."""
        return Budget.of(self.result.time, self.asked)

    @property
    def solid(self) -> Declared:
        """The finite elements behind the model: itself, or what it reduces."""
        of = getattr(self.declared.thing, "of", None)
        return self.declared if of is None else self.scene.declared[of]

    def _once(self, key: str, make: Callable[[], Any]) -> Any:
        """What `make` gives, made once. Raises Unknown, again where it did so before."""
        if key not in self._kept:
            try:
                self._kept[key] = make()
            except Unknown as unknown:
                self._kept[key] = unknown
            except Fault as refused:
                self._kept[key] = Unknown(refused.diagnostic.message)
            except Exception as error:
                if os.environ.get("SOFTMARK_DEBUG"):
                    raise
                self._kept[key] = Unknown(f"another solution stopped with an error ({type(error).__name__}: {error})")
        if isinstance(self._kept[key], Unknown):
            raise self._kept[key]
        return self._kept[key]

    def solved(self, key: str, declared: Declared, case: Case) -> tuple[Solution, dict[str, int]]:
        """Another model solved, and its size. Raises Unknown."""

        def solve() -> tuple[Solution, dict[str, int]]:
            from softmark.interpreter.models.prepare import prepared_model

            prepared, _ = prepared_model(declared, case, Workshop(scene=self.scene, measured=self.measured))
            with np.errstate(all="ignore"):
                return prepared.solve(self.budget.check), dict(prepared.size)

        solution, size = self._once(key, solve)
        if solution.displacement is None:
            raise Unknown(f"the same on another mesh has no solution ({solution.message})")
        return solution, size

    @property
    def _own(self) -> Case:
        """The case of the solid, with the material that it takes instead of the body's, if it does."""
        return case_for(self.scene, self.solid)

    def _sized(self, factor: float, **changes: Any) -> Declared:
        """The solid with its size times a factor."""
        size = {} if factor == 1.0 else {"size": self.solid.thing.size * factor}
        return replace(self.solid, thing=finer.plain(self.solid.thing, **size, **changes))

    def _coarser(self) -> list[tuple[Solution, float]]:
        """The same on one or two coarser meshes, with how many times coarser each is than the last. Raises Unknown."""
        if isinstance(self.declared.thing, Beam6Dof):
            return self._coarser_beams()
        if getattr(self.solid.thing, "size", None) is None:
            raise Unknown("its mesh is that of a file, and there is no coarser one")
        found: list[tuple[Solution, float]] = []
        cells = self._cells
        for factor in (FINER, FINER**2):
            try:
                self.budget.must_hold((FINER / factor) ** 3)
                solution, size = self.solved(f"size {factor:g}", self._sized(factor), self._own)
            except Unknown:
                if not found:
                    raise
                break
            ratio = (cells / max(1, size["elements"])) ** (1.0 / 3.0)
            if ratio < (APART if factor > FINER else NEAR):
                break
            found.append((solution, ratio))
            cells = max(1, size["elements"])
        if not found:
            raise Unknown("a coarser mesh is the same one")
        return found

    @property
    def _cells(self) -> int:
        """Cells of the solid's mesh, springs of a network."""
        if isinstance(self.declared.thing, MassSpring) or getattr(self.mesh, "cells", None) is None:
            return max(1, int(self.result.size.get("elements", 1)))
        return len(self.mesh.cells)

    def _coarser_beams(self) -> list[tuple[Solution, float]]:
        thing = self.declared.thing
        found: list[tuple[Solution, float]] = []
        self.budget.must_hold(0.75, slight=True)
        segments = thing.segments
        while segments > 1 and len(found) < 2:
            fewer = (segments + 1) // 2
            declared = replace(self.declared, thing=replace(thing, segments=fewer))
            solution, _ = self.solved(f"segments {fewer}", declared, self.case)
            found.append((solution, segments / fewer))
            segments = fewer
        if not found:
            raise Unknown("a beam of one segment has no coarser one")
        return found

    # -------------------------------------------------------------- the parts

    def _discretisation(self, seen: Seen) -> float:
        thing, why = self.solid.thing, ""
        if isinstance(thing, Fem) and not isinstance(self.case.analysis, Dynamic):
            try:
                return self._from_finer(seen, thing)
            except Unknown as unknown:
                why = str(unknown)
        if why == NOT_ASKED:
            raise Unknown(why)
        try:
            return self._from_coarser(seen)
        except Unknown as unknown:
            raise Unknown(f"{why}; {unknown}" if why and why != str(unknown) else str(unknown)) from unknown

    def _from_finer(self, seen: Seen, thing: Fem) -> float:
        fine = seen.at(self._finer(thing))
        apart, size = fine.apart(seen), fine.size
        left = element_of(thing.element).leaves * apart
        if not left <= HOPELESS * size:
            raise Unknown(f"the mesh is too coarse to say: a finer space is {100 * apart / (size or apart):.3g} % away")
        return left

    def _finer(self, thing: Fem) -> Field:
        own = (self.scene, self.solid, self._own)
        field: Field = self._once("finer", lambda: finer.found(*own, self._on_nodes(), self._tangent, self.budget))
        return field

    def _from_coarser(self, seen: Seen) -> float:
        """From one or two coarser meshes. Raises Unknown."""
        thing = self.solid.thing
        if isinstance(thing, Fem) and thing.locks_at(self._own.material.poisson):
            raise Unknown("its element locks at this Poisson's ratio, and coarse meshes agree on what is wrong")
        (first, ratio), *second = self._coarser()
        near = seen.of(first)
        apart = seen.apart(near)
        orders.must_tell([apart], seen.size)
        theory = element_of(thing.element).order + 1.0 if isinstance(thing, Fem) else 2.0
        farther = None
        if second and abs(second[0][1] - ratio) <= 0.25 * ratio:
            farther = near.apart(near.of(second[0][0]))
        found = orders.index(apart, ratio, theory, farther)
        orders.must_tell([found], seen.size, HOPELESS)
        return found

    def _model(self, seen: Seen) -> float:
        thing = self.solid.thing
        if isinstance(thing, MassSpring):
            raise Unknown("springs are no solid: no estimate of what they cannot do is known")
        if isinstance(thing, Beam6Dof):
            if not seen.in_displacements:
                raise Unknown(f"{NO_ERROR}: what the theory of beams leaves out is known of displacements alone")
            return _of_beams(thing, self.case, self.result) * seen.size
        if not isinstance(thing, Fem):
            raise Unknown("nothing is known of this kind of model")
        best = self._best(thing)
        if best == {}:
            return 0.0
        if isinstance(self.case.analysis, Dynamic):
            return THEORY * self._measures_apart(seen, best)
        return ALIKE * self._grown(seen, thing) * self._best_apart(seen, thing, best)

    def _best(self, thing: Fem) -> dict[str, Any]:
        """What the model would be with the best strain measure that there is, where it is another."""
        material = self.scene.declared[self._own.body.name].thing.material
        strain = "corotational" if material.finite_law() is None else "finite"
        best = {"strain": strain, "rotation": "point", "material": None}
        best |= {"mass": "consistent"} if thing.mass == "uniform" else {}
        if thing.integration == "selective" and strain == "finite" and material.finite_parts() is None:
            best["integration"] = "full"
        return best if any(getattr(thing, n) != v for n, v in best.items()) else {}

    def _best_apart(self, seen: Seen, thing: Fem, best: Mapping[str, Any]) -> float:
        """The distance between the model and the best, both on its own mesh and of one discretisation."""
        own, alike = seen, self._likened(thing, best)
        right = self._another(seen, "best", thing, **best, **alike)
        if alike:
            own = self._another(seen, "alike", thing, **alike)
        apart = right.apart(own)
        if not apart <= HOPELESS * right.size:
            raise Unknown("the best strain of its material leads to quite another state")
        return apart

    def _likened(self, thing: Fem, best: Mapping[str, Any]) -> dict[str, Any]:
        """How both keep the volume where means of it leave unlike parts of the laws at every point of a cell."""
        split = self.scene.declared[self._own.body.name].thing.material.finite_parts() is not None
        if thing.formulation == "mean_dilatation" and best["strain"] == "finite" != thing.strain and split:
            return {"formulation": "displacement", "integration": "selective"}
        return {}

    def _another(self, seen: Seen, key: str, thing: Fem, **changes: Any) -> Seen:
        """What is seen of another model on the same mesh. Raises Unknown."""
        other = replace(self.solid, thing=finer.plain(thing, **changes))
        own = (self.scene, other, case_for(self.scene, other))
        return seen.at(self._once(key, lambda: finer.alike(*own, self._on_nodes(), self.budget)))

    def _on_nodes(self) -> Any:
        """The mesh, deformed, for a solution that costs as much as its own. Raises Unknown."""
        self.budget.must_hold(1.0)
        if getattr(self.mesh, "displacement", None) is None:
            raise Unknown("the displacements of its nodes are not known")
        return self.mesh

    def _grown(self, seen: Seen, thing: Fem) -> float:
        """What a mesh that is too stiff hides of the error of its strain, which grows with the square of the motion."""
        try:
            fine = seen.at(self._finer(thing))
        except Unknown:
            return 1.0
        own = float(np.linalg.norm(seen.u))
        return max(1.0, (float(np.linalg.norm(fine.u)) / own) ** 2) if own > 0.0 else 1.0

    def _measures_apart(self, seen: Seen, best: Mapping[str, Any]) -> float:
        """The distance between the model and the best, both on a coarser mesh."""
        (own, _), *_ = self._coarser()
        better = self._sized(FINER, **best)
        solution, _ = self.solved("best", better, case_for(self.scene, better))
        return seen.of(solution).apart(seen.of(own))

    def _rounding(self, seen: Seen) -> float:
        return rounding.part(self.result, self.case, self.mesh, self._cells, seen)

    def _solver(self, seen: Seen) -> float:
        """The Newton step from the solution with the full tangent: of a reduced model, that of the full one."""
        residual = float(self.result.solve.get("residual") or 0.0)
        if isinstance(self.case.analysis, Dynamic):
            return 10.0 * residual * seen.size
        step: Floats | None = self._once("step", self._next)
        if step is None:
            return 100.0 * residual * seen.size
        most = _at_most(seen, step)
        if most is not None and (most <= TRIFLE * seen.size or not self.asked):
            left = LEFT * most
        else:
            left = LEFT * seen.apart(seen.moved(self._moving(step)))
        if left > COARSE * seen.size:
            change = 100 * left / LEFT / seen.size
            raise Unknown(f"it is no equilibrium: the next step would change it by {change:.2g} %")
        return left

    def _moving(self, step: Floats) -> Field:
        from softmark.interpreter.models.shared.deformed import displacement_of

        return displacement_of(self.mesh.mesh, step)

    def _next(self) -> Floats | None:
        """The displacements (n, 3) that Newton's method would add next; None where not known. Raises Unknown."""
        known: Floats | None = getattr(self.mesh, "left", None)
        if known is not None:
            return known
        full = self._full
        if full is None or len(full.free) > FACTORED:
            return None
        self.budget.must_hold(0.5)
        x, (assembly, found) = self._state, self._tangent()
        d = np.zeros_like(x)
        d[assembly.free] = -found.solve(assembly.gradient(x, 1.0)[assembly.free])
        return d.reshape(-1, 3)

    @property
    def _full(self) -> Any:
        """The assembly of all displacements: of what is reduced, where it is. None where there is none."""
        full: Any = getattr(getattr(self.prepared, "rest", None), "static", self.prepared)
        problem = getattr(full, "problem", None)
        assembly = getattr(problem, "exact", None) or getattr(problem, "assembly", None)
        known = getattr(self.mesh, "displacement", None)
        return None if assembly is None or known is None or assembly.dofs != known.size else assembly

    @property
    def _state(self) -> Floats:
        """Displacements of all nodes (3 n,), m."""
        return np.ascontiguousarray(self.mesh.displacement, dtype=np.float64).ravel()

    def _tangent(self) -> tuple[Any, Any]:
        """The assembly and a factor of its tangent in the state. Raises Unknown."""
        from softmark.solvers.linear.factorisations import Singular, factor

        def find() -> tuple[Any, Any]:
            assembly = self._full
            if assembly is None:
                raise Unknown("its stiffness is not that of displacements alone")
            try:
                return assembly, factor(assembly.tangent(self._state, 1.0), symmetric=assembly.conservative)
            except Singular as error:
                raise Unknown(f"its tangent is singular ({error})") from error

        found: tuple[Any, Any] = self._once("tangent", find)
        return found

    def _time(self, seen: Seen) -> float:
        """The same with a step twice as long, or half as long where that is explicit or would not show a course."""
        analysis = self.case.analysis
        if not isinstance(analysis, Dynamic):
            return 0.0
        # where a step twice as long would not show a course, it might miss it just as this one does
        finer = analysis.integrator == "central_differences" or not shows(self.case, 2.0 * analysis.step)
        self.budget.must_hold(2.0 if finer else 0.5)
        longer = replace(analysis, step=analysis.step * (0.5 if finer else 2.0))
        case = replace(self.case, analysis=longer)
        solution, _ = self.solved("step", self.declared, case)
        apart = seen.apart(seen.of(solution))
        if apart > COARSE * seen.size:
            raise Unknown(f"the step is too long to say: another one is {100 * apart / seen.size:.2g} % away")
        return STEP * apart * (2.0 if finer else 1.0)


def _at_most(seen: Seen, step: Floats) -> float | None:
    """What a step of the nodes (n, 3) changes at most; None of what is not about displacements."""
    if not seen.in_displacements or seen.unit == "s":
        return None
    largest = float(np.linalg.norm(step, axis=1).max(initial=0.0))
    if seen.unit == "m":
        return largest
    size = float(np.sqrt(np.mean(np.sum(np.square(seen.u), axis=-1))))
    return largest / size if size > 0.0 else None


def _of_beams(thing: Beam6Dof, case: Case, result: ModelResult) -> float:
    """What the theory of beams leaves out, relative: clamps and thickness, curling across flat sections, and strain.

    Estimates for solid sections, on the safe side of what solids of the same shape show. Bending stretches one side as
    much as it shortens the other, so that a law that is not linear shows in second order; in stretch it does at once.
    """
    section, poisson = case.shape.section, case.material.poisson
    spans, checks = max(1, len(case.supports)), result.solve.get("checks") or {}
    said = (float(checks.get(n) or 0.0) for n in ("bending_strain", "axial_strain", "flat_curvature_per_m"))
    bent, stretched, curvature = said
    missing = ribbon.missing(section, case.shape.length, poisson, spans, thing.shear)
    missing += ribbon.stiffening(section, poisson, curvature)
    strained: float = BENT * bent**2 + STRETCHED * stretched
    if missing + strained > COARSE:
        raise Unknown(f"the beam is too {'thick' if missing > strained else 'strained'} for its theory")
    return missing + strained


# ------------------------------------------------------------------ of a run


def stated(
    scene: Scene,
    declared: Declared,
    view: View,
    prepared: Any,
    result: ModelResult,
    measured: Mapping[str, Any],
    warnings: Sequence[Diagnostic],
    asked: bool = True,
) -> dict[str, dict[str, Any]]:
    """What a model states of every metric and of every probe, by name; empty where it has no answer.

    Where nobody `asked`, what costs next to nothing.
    """
    if result.status not in ("converged", "capped"):
        return {}
    whole = Stated(scene, declared, view.case, prepared, result, measured, result.mesh, asked)
    doubts, found = doubts_of(scene, declared, warnings), {}
    void = next((f"{code}: {DOUBTS[code]}" for code in VOID if code in doubts), None)
    for name, seen in _asked(scene, result, view).items():
        said = _safely(whole, seen) if void is None else {"value": None, "parts": {}, "reason": void}
        found[name] = clean({**said, "doubts": doubts})
    return found


def _safely(whole: Stated, seen: Seen) -> dict[str, Any]:
    try:
        return whole.of(seen)
    except Exception as error:
        if os.environ.get("SOFTMARK_DEBUG"):
            raise
        reason = f"stating it stopped with an error ({type(error).__name__}: {error})"
        return {"value": None, "parts": {}, "reason": reason}


def _asked(scene: Scene, result: ModelResult, view: View) -> dict[str, Seen]:
    """What is stated: metrics of what probes saw, and probes.

    Of metrics against the model itself as well: how far it can be trusted as a truth, in their terms.
    """
    found = {}
    for name, metric in scene.of_kind("metric").items():
        probe = str(getattr(metric.thing, "probe", None))
        if probe in result.probes:
            found[name] = _seen(result.probes[probe], metric.thing, view)
    return found | {name: _seen(probe, None, view) for name, probe in result.probes.items()}


def _seen(probe: ProbeResult, metric: Any, view: View) -> Seen:
    course = probe.course is not None and (metric is None or isinstance(metric, CourseNorm))
    u, times = (probe.course, probe.times) if course else (probe.displacement, None)
    assert u is not None
    return Seen(probe.points, u, times, metric, view.displacement, probe, view, view.history)
