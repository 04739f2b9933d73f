"""Setup of the theory of torsion of a rubber cylinder, and the reactions that the theory gives."""

from __future__ import annotations

import math

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import end_frame, single_selected_end
from softmark.interpreter.problem.rubber_constants import rubber_of
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.interpreter.vocabulary.supports.rotated_part import Rotated
from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.references.rubber_torsion import TwistedCylinder
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.mesh.shape import add_multiples, cross
from softmark.solvers.mesh.shapes import Cylinder

ALIGNED = 1e-9  # relative tolerance of the rotation axis
REMEDY = "hold one end with `fixed(...)` and rotate the other with `rotated(...)`, without other supports"


class TorsionSetup(TheorySetup):
    """Makes the problem of a solid rubber cylinder that is held at one end and twisted at the other."""

    def problem_from(self, reference: Declared, case: Case) -> TwistedCylinder:
        shape, name = case.shape, case.body.name
        if not isinstance(shape, Cylinder):
            raise NotApplicable(
                f"`{name}` is not a solid cylinder", "use a solid cylinder: other sections warp, or their walls deform"
            )
        if case.parts:
            raise NotApplicable(f"`{name}` does not consist of one material", "use one material for the whole body")
        rubber = rubber_of(case)
        for load in case.loads:
            raise NotApplicable(f"the theory does not include the load `{load.name}`", "remove all loads")
        held, turned = _held_end_and_rotation(case)
        root, axis = end_frame(shape, held)
        away = add_multiples(turned.through, (-1.0, root))
        if math.hypot(*cross(turned.axis, axis)) > ALIGNED or math.hypot(*cross(away, axis)) > ALIGNED * shape.radius:
            raise NotApplicable(
                "the cylinder is not rotated about its own axis", "give the axis and `through` of the cylinder"
            )
        angle = sum(a * b for a, b in zip(turned.rotation, axis, strict=True))
        return TwistedCylinder(shape.length, shape.radius, rubber, case.material.poisson, root, axis, angle)

    def forces(self, case: Case, solution: TwistedCylinder) -> EquilibriumForces:
        """Return the reaction forces and moments of both supports, and the elastic energy, by the theory."""
        found, none = {}, (0.0, 0.0, 0.0)
        for support in case.supports:
            turned = support.thing.prescribes_rotation
            at = add_multiples(solution.root, (solution.length if turned else 0.0, solution.axis))
            sign = 1.0 if turned else -1.0
            force = add_multiples(none, (-sign * solution.thrust, solution.axis))
            moment = add_multiples(none, (sign * solution.torque, solution.axis))
            found[support.name] = Reaction(force, add_multiples(moment, (1.0, cross(at, force))), at, moment)
        return EquilibriumForces(found, {}, solution.energy)


def _held_end_and_rotation(case: Case) -> tuple[int, Rotated]:
    """Return the number of the fixed end (0 is the root), and the support that rotates the other end.

    Raises NotApplicable.
    """
    found: dict[int, object] = {}
    for support in case.supports:
        thing = support.thing
        fixed = isinstance(thing, UniformSupport) and not thing.moves
        if not (fixed or isinstance(thing, Rotated)) or len(thing.components) < 3:
            raise NotApplicable(f"the theory does not include the support `{support.name}`", REMEDY)
        if (end := single_selected_end(thing.where, case.prism)) is None:
            raise NotApplicable(f"the support `{support.name}` does not cover one whole end face", REMEDY)
        if end in found:
            raise NotApplicable("two supports hold one end", REMEDY)
        found[end] = thing
    for end, thing in found.items():
        if isinstance(thing, Rotated) and isinstance(found.get(1 - end), UniformSupport):
            return 1 - end, thing
    raise NotApplicable("one end must be fixed and the other rotated", REMEDY)
