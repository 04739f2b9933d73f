"""What error a model itself states for what it says, without a look at any reference.

Four parts are added up. Discretisation: how far the same model on a coarser mesh is from it, times a safety factor.
Model: how far the same model with the best strain measure that its material has is, on that coarser mesh; of beams,
estimates of what their theory leaves out. Rounding: from how near to singular the stiffness is, or from the forces and
coordinates. Solver: the Newton step that would come next. Where one of them cannot be told the model vouches for
nothing, and says why. Each is told in the terms of a metric, by the metric itself, or not at all.

A warning of DOUBTS counts as said as well: with it a model says of itself that its answer may be off. With one of VOID
it vouches for nothing.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.case import Case, Fault, case_for
from softmark.interpreter.measuring import View, measured_by
from softmark.interpreter.metrics.course_norm import CourseNorm
from softmark.interpreter.metrics.seen import Known
from softmark.interpreter.metrics.seen import Seen as Looked
from softmark.interpreter.metrics.undefined import Undefined
from softmark.interpreter.models.beam6dof import Beam6Dof
from softmark.interpreter.models.fem import Fem
from softmark.interpreter.models.mass_spring import MassSpring
from softmark.interpreter.models.prepared import Solution, Workshop
from softmark.interpreter.results import ModelResult, ProbeResult, clean
from softmark.interpreter.scene import Declared, Scene
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.interpreter.wider import selection

Floats = NDArray[np.float64]
Field = Callable[[Floats], Floats]

# warnings by which a model, or the scene for it, says that its answer may be off
DOUBTS: dict[str, str] = {
    "W301": "its element locks",
    "W302": "its strain cannot follow the rotation",
    "W304": "the beam is not slender",
    "W305": "its mesh loses volume",
    "W306": "its strain met a large rotation",
    "W312": "its mesh is coarser than the body",
    "W314": "the state may not be the only one",
    "W318": "energies do not balance",
    "W321": "springs have a Poisson's ratio of their own",
    "W322": "springs do not know the material's law",
    "W324": "cells of its network are inside out",
    "W331": "it is outside of its training",
    "W351": "cells are inside out",
    "W352": "the tolerance is looser than what is read",
    "W353": "its forces were not found again",
    "W361": "the integrator has taken much of the energy",
    "W362": "the step does not resolve the slowest vibration",
    "W364": "its mesh has slivers",
    "W375": "its supports hold another part than they select",
}

VOID = ("W351",)  # states of which no part of the error says anything

SAFETY = 3.0  # of two grids (Roache 1994): times their distance over r - 1, as if errors fell with the size alone
COARSE = 0.3  # relative distance of two grids above which neither says anything
FINER = 2.0  # how much finer or coarser the other mesh is
NEAR, APART = 1.25, 1.6  # times as many cells along an edge: less is the same mesh; from here on it will do
MOST = 20_000  # cells of a finer mesh, where there is no coarser one
THEORY = 2.0  # times the distance of two strain measures
CLAMPED = 2.5  # (d/L)^2 times that: what clamps and end faces do to a beam; solids show up to 1.8
LEFT = 2.0  # times the next Newton step
FACTORED = 300_000  # unknowns up to which that step is computed
EPS = float(np.finfo(np.float64).eps)
USUAL = 1e6 * EPS  # what rounding does at least where the stiffness was not looked at: a condition number of 1e6
LOST = 1e-6  # of a cell that the rounding of coordinates may take: with more, nobody knows what it does


def is_doubt(code: str) -> bool:
    """Whether a warning says that a model's answer may be off."""
    return code in DOUBTS


def doubts_of(scene: Scene, declared: Declared, warnings: Sequence[Diagnostic]) -> list[str]:
    """Codes of the warnings that are doubts and not about another model."""
    others = [d.location for n, d in scene.of_kind("model").items() if n != declared.name]

    def concerns(warning: Diagnostic) -> bool:
        at = warning.span
        return at is None or not any(
            o.source is warning.source and o.span.start <= at.start < o.span.end for o in others
        )

    return list(dict.fromkeys(w.code for w in warnings if is_doubt(w.code) and concerns(w)))


class Unknown(Exception):
    """A part of the error that cannot be told; the text says why."""


NO_ERROR = "no error of this metric can be stated"


@dataclass(frozen=True)
class Seen:
    """What a probe saw of a model: displacements (n, 3), or with times those of all (t, n, 3).

    `field` are displacements anywhere, at the end; `probe` and `view` what else the metric may look at.
    """

    X: Floats
    u: Floats
    times: Floats | None = None
    metric: Any = None
    field: Field | None = None
    probe: ProbeResult | None = None
    view: View | None = None

    def of(self, solution: Solution) -> Seen:
        """What the same probe sees of another solution, at the same times. Raises Unknown."""
        return replace(self, u=self._of(solution), field=solution.displacement)

    def moved(self, step: Field) -> Seen:
        """What it would see if displacements were added, static."""
        own = self.field
        field = None if own is None else lambda X: own(X) + step(X)
        return replace(self, u=self.u + np.asarray(step(self.X)), field=field)

    @property
    def in_displacements(self) -> bool:
        """Whether it is about an l2 norm of displacements, or a like one of plain arrays."""
        return self.metric is None or self.times is not None or hasattr(self.metric, "value")

    def _of(self, solution: Solution) -> Floats:
        if solution.displacement is None:
            raise Unknown(solution.message or "there is no solution")
        if self.times is None or solution.history is None:
            return np.asarray(solution.displacement(self.X))
        theirs = np.asarray(solution.history.displacement(self.X))
        flat = theirs.reshape(len(theirs), -1)
        columns = [np.interp(self.times, solution.history.times, column) for column in flat.T]
        return np.array(columns).T.reshape(len(self.times), *theirs.shape[1:])

    def apart(self, other: Seen) -> float:
        """How far another solution is from this one, as the metric has it. Raises Unknown."""
        if not np.all(np.isfinite(other.u)):
            raise Unknown("another solution is not finite")
        if self.metric is not None and self.times is None:
            return self._measured(other)
        size = float(np.linalg.norm(self.u))
        if size == 0.0:
            raise Unknown("the probe does not move, so nothing is relative to it")
        return float(np.linalg.norm(other.u - self.u)) / size

    def _measured(self, other: Seen) -> float:
        """The metric of another solution, with this one taken as right. Raises Unknown."""
        metric, view, probe = self.metric, self.view, self.probe
        if view is None or probe is None or str(getattr(metric, "statistic", "")).endswith("sd"):
            raise Unknown(f"{NO_ERROR}: it is no distance of two solutions")
        known = Known(view.name, self.u, self.field)
        weights = view.weights.get(metric.probe)
        try:
            looked = Looked(view.name, view.case, self.X, other.u, probe.triangles, weights, known, other.field)
            return measured_by(metric, looked).value
        except Undefined as undefined:
            raise Unknown(f"{NO_ERROR}: {undefined}") from undefined


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
    _kept: dict[str, Any] = field(default_factory=dict)

    def of(self, seen: Seen) -> dict[str, Any]:
        """The parts of the error of what a probe sees, and their sum; `reason` where there is none."""
        parts: dict[str, float | None] = {}
        reasons = []
        for name, part in self._parts().items():
            try:
                parts[name] = part(seen)
                if not math.isfinite(parts[name] or 0.0):
                    raise Unknown("a part of the error is not finite")
            except Unknown as unknown:
                parts[name] = None
                reasons.append(f"{name}: {unknown}")
        known = [v for v in parts.values() if v is not None]
        value = sum(known) if len(known) == len(parts) else None
        return {"value": value, "parts": parts, "reason": "; ".join(reasons) or None}

    def _parts(self) -> dict[str, Callable[[Seen], float]]:
        found: dict[str, Callable[[Seen], float]] = {
            "discretisation": self._discretisation,
            "model": self._model,
            "rounding": self._rounding,
            "solver": self._solver,
        }
        return found | selection(self) | ({"time": self._time} if isinstance(self.case.analysis, Dynamic) else {})

    # -------------------------------------------------------------- other solutions

    @property
    def solid(self) -> Declared:
        """The finite elements behind the model: itself, or what it reduces."""
        of = getattr(self.declared.thing, "of", None)
        return self.declared if of is None else self.scene.declared[of]

    def _solved(self, key: str, declared: Declared, case: Case) -> tuple[Solution, dict[str, int]]:
        """Another model solved, and its size. Raises Unknown."""
        if key not in self._kept:
            from softmark.interpreter.preparing import prepared_model

            try:
                prepared, _ = prepared_model(declared, case, Workshop(scene=self.scene, measured=self.measured))
                with np.errstate(all="ignore"):
                    self._kept[key] = prepared.solve(lambda iteration: None), dict(prepared.size)
            except Fault as refused:
                self._kept[key] = Unknown(refused.diagnostic.message)
            except Exception as error:
                if os.environ.get("SOFTMARK_DEBUG"):
                    raise
                self._kept[key] = Unknown(f"another solution stopped with an error ({type(error).__name__}: {error})")
        found = self._kept[key]
        if isinstance(found, Unknown):
            raise found
        solution: Solution = found[0]
        if solution.displacement is None:
            raise Unknown(f"the same on another mesh has no solution ({solution.message})")
        return solution, found[1]

    @property
    def _own(self) -> Case:
        """The case of the solid, with the material that it takes instead of the body's, if it does."""
        return case_for(self.scene, self.solid)

    def _sized(self, factor: float, **changes: Any) -> Declared:
        """The solid with its size times a factor."""
        thing = self.solid.thing
        fresh = {"cap": None, "linear_cap": None, "start": None, "precision": "double", "linear": "auto"}
        usual = {n: v for n, v in fresh.items() if hasattr(thing, n)}
        size = {} if factor == 1.0 else {"size": thing.size * factor}
        return replace(self.solid, thing=replace(thing, **usual, **size, **changes))

    def _other(self) -> tuple[Solution, float, bool]:
        """The same on another mesh, how many times coarser or finer it is, and whether it is finer. Raises Unknown."""
        if isinstance(self.declared.thing, Beam6Dof):
            return self._other_beam()
        if getattr(self.solid.thing, "size", None) is None:
            raise Unknown("its mesh is that of a file, and there is no coarser one")
        found, cells = [], self._cells
        for factor in (FINER, 1.0 / FINER):
            if factor < 1.0 and cells * FINER**3 > MOST:
                break
            solution, size = self._solved(f"size {factor:g}", self._sized(factor), self._own)
            ratio = (cells / max(1, size["elements"])) ** (1.0 / 3.0)
            found.append((solution, max(ratio, 1.0 / ratio), factor < 1.0))
            if found[-1][1] >= APART:
                break
        best = max(found, key=lambda other: other[1])
        if best[1] < NEAR:
            raise Unknown("a coarser mesh is the same one, and a finer one too large, or the same as well")
        return best

    @property
    def _cells(self) -> int:
        """Cells of the solid's mesh, springs of a network."""
        if isinstance(self.declared.thing, MassSpring) or getattr(self.mesh, "cells", None) is None:
            return max(1, int(self.result.size.get("elements", 1)))
        return len(self.mesh.cells)

    def _other_beam(self) -> tuple[Solution, float, bool]:
        thing, finer = self.declared.thing, self.declared.thing.segments < 2
        segments = 2 * thing.segments if finer else (thing.segments + 1) // 2
        declared = replace(self.declared, thing=replace(thing, segments=segments))
        solution, _ = self._solved("segments", declared, self.case)
        ratio = segments / thing.segments
        return solution, ratio if finer else 1.0 / ratio, finer

    # -------------------------------------------------------------- the parts

    def _discretisation(self, seen: Seen) -> float:
        thing = self.solid.thing
        if isinstance(thing, Fem) and thing.locks_at(self._own.material.poisson):
            raise Unknown("its element locks at this Poisson's ratio, and coarse meshes agree on what is wrong")
        solution, ratio, finer = self._other()
        apart = seen.apart(seen.of(solution))
        if apart > COARSE:
            raise Unknown(f"the mesh is too coarse to say: another one is {100 * apart:.2g} % away")
        return SAFETY * apart * (ratio if finer else 1.0) / (ratio - 1.0)

    def _model(self, seen: Seen) -> float:
        thing = self.solid.thing
        if isinstance(thing, MassSpring):
            raise Unknown("springs are no solid: no estimate of what they cannot do is known")
        if isinstance(thing, Beam6Dof):
            if not seen.in_displacements:
                raise Unknown(f"{NO_ERROR}: what the theory of beams leaves out is known of displacements alone")
            return _of_beams(thing, self.case, self.result)
        if not isinstance(thing, Fem):
            raise Unknown("nothing is known of this kind of model")
        best = self._best(thing)
        if best == {}:
            return 0.0
        return THEORY * self._measures_apart(seen, best)

    def _best(self, thing: Fem) -> dict[str, Any]:
        """What the model would be with the best strain measure that there is, where it is another."""
        material = self.scene.declared[self._own.body.name].thing.material
        strain = "corotational" if material.finite_law() is None else "finite"
        best = {"strain": strain, "rotation": "point", "material": None}
        best |= {"mass": "consistent"} if thing.mass == "uniform" else {}
        if thing.integration == "selective" and strain == "finite" and material.finite_parts() is None:
            best["integration"] = "full"
        return best if any(getattr(thing, n) != v for n, v in best.items()) else {}

    def _measures_apart(self, seen: Seen, best: Mapping[str, Any]) -> float:
        """The distance between the model and the best, both on the same mesh: another one, where there is one."""
        try:
            own, _, finer = self._other()
            factor = 1.0 / FINER if finer else FINER
        except Unknown:
            own, factor = None, 1.0
        better = self._sized(factor, **best)
        solution, _ = self._solved("best", better, case_for(self.scene, better))
        return seen.of(solution).apart(seen if own is None else seen.of(own))

    def _rounding(self, seen: Seen) -> float:
        """What the solver found from its stiffness, or else from forces and coordinates."""
        facts, (far, cell) = self.result.solve, self._reach(seen)
        if EPS * far > LOST * cell:
            raise Unknown(f"it lies so far from the origin that rounding takes {EPS * far / cell:.1g} of a cell")
        if facts.get("rounding") is not None:
            return float(facts["rounding"])
        if facts.get("condition") is not None:
            return 10.0 * EPS * float(facts["condition"])
        checks = facts.get("checks") or {}
        # differences of coordinates along a cell, of which strain is a part
        strain = float(checks.get("largest_strain") or 0.0) or float(np.abs(seen.u).max()) / self._extent(seen)
        lost = EPS * far / (cell * strain) if strain > 0.0 else math.inf
        found = 10.0 * (max(USUAL, float(checks.get("rounding") or 0.0)) + lost)
        if not found <= COARSE:
            raise Unknown("its strain is so small beside its coordinates that rounding may take all of it")
        return found

    def _points(self, seen: Seen) -> Floats:
        found = getattr(self.mesh, "points", None)
        return seen.X if found is None or not len(found) else np.asarray(found)

    def _extent(self, seen: Seen) -> float:
        """Of the body, m."""
        bounds = np.ptp(self._points(seen), axis=0).max()
        return float(bounds) or float(getattr(self.case.shape, "length", 0.0)) or 1.0

    def _reach(self, seen: Seen) -> tuple[float, float]:
        """The largest coordinate, before or after deformation, and the shortest side of a cell, m."""
        points, cells = self._points(seen), getattr(self.mesh, "cells", None)
        far = float(np.abs(points).max() + np.abs(seen.u).max())
        if cells is not None and len(cells) and points is not seen.X:
            corners = points[np.asarray(cells)]  # (m, a, 3)
            sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
            return far, float(sides.min()) or math.ulp(0.0)
        return far, self._extent(seen) / self._cells

    def _solver(self, seen: Seen) -> float:
        """The Newton step from the solution with the full tangent: of a reduced model, that of the full one."""
        residual = self.result.solve.get("residual")
        if isinstance(self.case.analysis, Dynamic):
            return 10.0 * float(residual or 0.0)
        step = self._newton_step()
        if step is None:
            return 100.0 * float(residual or 0.0)
        left = LEFT * seen.apart(seen.moved(step))
        if left > COARSE:
            raise Unknown(f"it is no equilibrium: the next step would change it by {100 * left / LEFT:.2g} %")
        return left

    def _newton_step(self) -> Callable[[Floats], Floats] | None:
        """The displacements that Newton's method would add next; None where that is not known. Raises Unknown."""
        if "step" not in self._kept:
            self._kept["step"] = self._next()
        found: Callable[[Floats], Floats] | None = self._kept["step"]
        return found

    def _next(self) -> Callable[[Floats], Floats] | None:
        from softmark.interpreter.models.solid import displacement_of
        from softmark.solvers.linear import Singular, factor

        full: Any = getattr(getattr(self.prepared, "rest", None), "static", self.prepared)  # what is reduced
        problem = getattr(full, "problem", None)
        assembly = getattr(problem, "exact", None) or getattr(problem, "assembly", None)
        if self.mesh is None or assembly is None or assembly.dofs != self.mesh.displacement.size:
            return None
        if len(assembly.free) > FACTORED:
            return None
        x = np.ascontiguousarray(self.mesh.displacement, dtype=np.float64).ravel()
        d = np.zeros_like(x)
        try:
            found = factor(assembly.tangent(x, 1.0), symmetric=assembly.conservative)
            d[assembly.free] = -found.solve(assembly.gradient(x, 1.0)[assembly.free])
        except Singular as error:
            raise Unknown(f"its tangent is singular ({error})") from error
        return displacement_of(self.mesh.mesh, d.reshape(-1, 3))

    def _time(self, seen: Seen) -> float:
        """The same with a step twice as long, or of an explicit integrator half as long."""
        analysis = self.case.analysis
        finer = getattr(analysis, "integrator", "") == "central_differences"
        if not isinstance(analysis, Dynamic):
            return 0.0
        longer = replace(analysis, step=analysis.step * (0.5 if finer else 2.0))
        case = replace(self.case, analysis=longer)
        solution, _ = self._solved("step", self.declared, case)
        apart = seen.apart(seen.of(solution))
        if apart > COARSE:
            raise Unknown(f"the step is too long to say: another one is {100 * apart:.2g} % away")
        return SAFETY * apart * (2.0 if finer else 1.0)


def _of_beams(thing: Beam6Dof, case: Case, result: ModelResult) -> float:
    """What the theory of beams leaves out, relative: clamps and warping (d/L)^2, without shear that too, and strain.

    Estimates for solid sections, on the safe side of what solids of the same shape show. Bending stretches one side as
    much as it shortens the other, so that a law that is not linear shows in second order; in stretch it does at once.
    """
    section = case.shape.section
    depth: float = 2.0 * max(max(abs(u), abs(v)) for u, v in section.samples())
    spans = max(1, len(case.supports))
    slender = (depth * spans / case.shape.length) ** 2
    checks = result.solve.get("checks") or {}
    bent, stretched = (float(checks.get(n) or 0.0) for n in ("bending_strain", "axial_strain"))
    missing = slender * (CLAMPED if thing.shear else CLAMPED + 1.0)
    total: float = missing + bent**2 + 2.0 * stretched
    if total > COARSE:
        raise Unknown("the beam is too thick or too strained for its theory")
    return total


# ------------------------------------------------------------------ of a run


def stated(
    scene: Scene,
    declared: Declared,
    view: View,
    prepared: Any,
    result: ModelResult,
    measured: Mapping[str, Any],
    warnings: Sequence[Diagnostic],
) -> dict[str, dict[str, Any]]:
    """What a model states of every relative metric and of every probe, by name; empty where it has no answer."""
    if result.status not in ("converged", "capped"):
        return {}
    whole = Stated(scene, declared, view.case, prepared, result, measured, result.mesh)
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
    """What is stated: metrics that are relative errors against something, and probes.

    Of metrics against the model itself as well: how far it can be trusted as a truth, in their terms.
    """
    found = {}
    for name, metric in scene.of_kind("metric").items():
        probe = str(getattr(metric.thing, "probe", None))
        relative = metric.thing.unit == "1" and getattr(metric.thing, "against", None) is not None
        if relative and probe in result.probes:
            found[name] = _seen(result.probes[probe], metric.thing, view)
    return found | {name: _seen(probe, None, view) for name, probe in result.probes.items()}


def _seen(probe: ProbeResult, metric: Any, view: View) -> Seen:
    course = probe.course is not None and (metric is None or isinstance(metric, CourseNorm))
    u, times = (probe.course, probe.times) if course else (probe.displacement, None)
    assert u is not None
    return Seen(probe.points, u, times, metric, view.displacement, probe, view)
