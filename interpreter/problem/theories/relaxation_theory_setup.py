"""Setup of the theory of a viscoelastic bar, and the forces that the theory gives."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import end_frame, single_selected_end
from softmark.interpreter.problem.theories.bar_theory_setup import ALIGNED
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.interpreter.vocabulary.amplitude_words import Pulse, Ramp, Sine, Smooth, Table, at_full_size
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.references.prony import Amplitude, HarmonicAmplitudeSegment, RelaxingBar
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.materials.viscoelastic import Viscoelastic
from softmark.solvers.mesh.shape import Prism, add_multiples, cross, dot, replace_coordinate

REMEDY = "hold one end face along the axis and move or pull the other: `displaced(...)` or `traction(...)`"


class ViscoelasticBarSetup(TheorySetup):
    """Makes the problem of a viscoelastic bar under a displacement or force that varies in time by an amplitude."""

    admits_material_history = True

    def problem_from(self, reference: Declared, case: Case) -> RelaxingBar:
        shape, name, material, analysis = case.shape, case.body.name, case.material, case.analysis
        if not isinstance(shape, Prism):
            raise NotApplicable(
                f"`{name}` is not a straight body with one cross-section", "use a box, a cylinder or a tube"
            )
        if case.parts or not isinstance(material, Viscoelastic):
            raise NotApplicable(
                f"`{name}` does not consist of one viscoelastic material", "use `viscoelastic(...)` for the whole body"
            )
        if not material.branches:
            raise NotApplicable(
                "no part of its stress relaxes",
                "give a part that relaxes, or compare with the theory of an elastic body",
            )
        if material.of == "shape" and material.poisson != 0.5:
            raise NotApplicable(
                "its bulk modulus is constant while its shear modulus relaxes", "use `of = whole`, or `poisson = 0.5`"
            )
        if not isinstance(analysis, Quasistatic):
            raise NotApplicable("the analysis is not quasistatic", "use `quasistatic(...)`")
        held, driving, amount = _held_end_and_driving_action(case)
        root, axis = end_frame(shape, held)
        force = driving.kind == "load"
        g, tau = zip(*material.branches, strict=True)
        now = analysis.now
        sign = dot(amount, axis)
        if math.hypot(*cross(amount, axis)) > ALIGNED * math.hypot(*amount):
            raise NotApplicable(f"`{driving.name}` does not act along the axis", REMEDY)
        amplitude = at_full_size(driving.thing).amplitude
        area = shape.section.area
        return RelaxingBar(shape.length, area, root, axis, _fixed_point(case, root), material.young, material.poisson,
                           g, tau, force, sign * (area if force else 1.0), amplitude_until(amplitude, now),
                           now)  # fmt: skip

    def forces(self, case: Case, solution: RelaxingBar) -> EquilibriumForces:
        """Return the reaction forces, the stored energy and the dissipated energy by the theory."""
        held, driving, _ = _held_end_and_driving_action(case)
        none, found = (0.0, 0.0, 0.0), {}
        for support in case.supports:
            end = single_selected_end(support.thing.where, case.prism)
            along = any(abs(case.prism.axis[c]) > ALIGNED for c in support.thing.components)
            size = 0.0 if not along else solution.pull if end != held else -solution.pull
            at = add_multiples(solution.root, (0.0 if end == held else solution.length, solution.axis))
            force = add_multiples(none, (size, solution.axis))
            found[support.name] = Reaction(force, cross(at, force), at, none)
        work = {} if driving.kind != "load" else {driving.name: None}
        return EquilibriumForces(found, work, solution.stored, dissipated=solution.dissipated)


def _held_end_and_driving_action(case: Case) -> tuple[int, Declared, Any]:
    """Return the held end (0 is the root), the support or load that drives the other end, and its vector.

    The vector is the displacement of the support, m, or the traction of the load, Pa. Raises NotApplicable.
    """
    shape = case.prism
    ends: dict[int, Declared] = {}
    for support in case.supports:
        thing = at_full_size(support.thing)
        along = [abs(shape.axis[c]) > ALIGNED for c in thing.components]
        if not isinstance(thing, DisplacementSupport):
            raise NotApplicable(f"the theory does not include the support `{support.name}`", REMEDY)
        if not any(along):
            if thing.moves:
                raise NotApplicable(f"the support `{support.name}` moves the body across its axis", REMEDY)
            continue
        if not all(along) and case.material.poisson != 0.0:
            raise NotApplicable(f"the support `{support.name}` prevents lateral contraction of its end", REMEDY)
        if (end := single_selected_end(thing.where, shape)) is None or end in ends:
            raise NotApplicable(f"the support `{support.name}` does not act on exactly one whole end face", REMEDY)
        ends[end] = support
    held = [end for end, support in ends.items() if not at_full_size(support.thing).moves]
    movers = [support for support in ends.values() if at_full_size(support.thing).moves]
    if len(held) != 1 or len(movers) + len(case.loads) != 1:
        raise NotApplicable(
            "exactly one end must be held, and exactly one load or support must drive the other end", REMEDY
        )
    if movers:
        return held[0], movers[0], at_full_size(movers[0].thing).displacement
    load = case.loads[0]
    action = at_full_size(load.thing).action
    if not isinstance(action, SurfaceTraction) or single_selected_end(action.where, shape) != 1 - held[0]:
        raise NotApplicable(f"the load `{load.name}` is not a traction on the whole free end", REMEDY)
    return held[0], load, action.traction


def _fixed_point(case: Case, root: Any) -> Any:
    """Return a point, m, that does not move laterally: on the planes that supports hold, otherwise on the axis.

    `root` is the centre of the held end, m. Raises NotApplicable.
    """
    low, high = case.shape.bounds or (root, root)
    found = list(root)
    for support in case.supports:
        for c in support.thing.components:
            if abs(case.prism.axis[c]) > ALIGNED:
                continue
            x, y, z = (0.5 * (a + b) for a, b in zip(low, high, strict=True))
            sides = [replace_coordinate((x, y, z), c, value) for value in (low[c], root[c], high[c])]
            holds = [bool(support.thing.where.holds(*p, case.shape.diagonal)) for p in sides]
            if sum(holds) == 1:
                found[c] = sides[holds.index(True)][c]
            elif case.material.poisson != 0.0:
                raise NotApplicable(f"the support `{support.name}` does not hold a plane along the axis", REMEDY)
    return tuple(found)


def amplitude_until(amplitude: Any, now: float) -> Amplitude:
    """Return an amplitude of a scene until time `now`, s, in the theory's form: jumps, and segments with their slopes.

    Raises NotApplicable for amplitudes that the theory does not support.
    """
    match amplitude:
        case None:
            return Amplitude([(0.0, 1.0)], [])
        case Ramp(over=over, start=start):
            return Amplitude([], [HarmonicAmplitudeSegment(start, start + over, 1.0 / over)])
        case Smooth(over=over, start=start):  # (1 - cos)/2: its slope is w/2 sin
            w = math.pi / over
            return Amplitude([], [HarmonicAmplitudeSegment(start, start + over, -0.5j * w, w)])
        case Sine(frequency=frequency):
            w = 2.0 * math.pi * frequency
            return Amplitude([], [HarmonicAmplitudeSegment(0.0, now, w, w)])
        case Pulse(start=start, until=until):
            return Amplitude([(start, 1.0), (until, -1.0)] if start < until else [], [])
        case Table():
            times, shares, _ = amplitude.rows
            rows = list(zip(times, shares, strict=True))
            slopes = [
                HarmonicAmplitudeSegment(max(0.0, a), b, (q - p) / (b - a))
                for (a, p), (b, q) in pairwise(rows)
                if b > 0.0
            ]
            return Amplitude([(0.0, amplitude.at(0.0))], slopes)
    raise NotApplicable(
        "the theory does not support its `amplitude`", "use `ramp`, `smooth`, `sine`, `pulse` or `table`"
    )
