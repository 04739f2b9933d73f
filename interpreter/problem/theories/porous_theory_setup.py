"""Setup of poroelastic theories: makes the porous column, slab or disc of a case, and reads results."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.box_and_cylinder_faces import BoxBody, CylinderBody, box_or_cylinder_body
from softmark.interpreter.problem.theories.relaxation_theory_setup import amplitude_until
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.interpreter.vocabulary.amplitude_words import at_full_size
from softmark.interpreter.vocabulary.analysis_words import Quasistatic
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.records import dataclass
from softmark.references.confined_compression import Permeability, PressedColumn
from softmark.references.poroelastic_compression import CompressedPorousBody
from softmark.references.porous_skeletons import WHOLE, Skeleton
from softmark.references.straight_cantilever import NotApplicable, Vector
from softmark.references.terzaghi import Column, Drains
from softmark.solvers.mesh.shape import add_multiples, cross, replace_coordinate

ALIGNED = 1e-9  # relative tolerance off the axis
DRIVE = "hold one end along the axis and move or press the other: `displaced(...)` or `traction(...)`"
PLATES = (
    "hold one plate along its normal and move the other: `displaced(...)`, or `traction(...)` on a face that is "
    "`rigid_plate(...)`"
)
SIDES = "hold its sides along their normals: `fixed(..., components = x)`"
SMALL = 0.01  # strain below which no warning about small strain is given
LARGE = "it assumes small strains, but they reach {:.3g} %: a body with large ones differs"
Body = BoxBody | CylinderBody


@dataclass(frozen=True)
class HeldAndDrivenEnds:
    """Held end and driven end of a body, normal to its axis; a support moves the driven end, or a load acts on it.

    `way` is the direction of the axis: 0, 1 or 2 for x, y or z. `driving` is the support or load, and `force`
    is True for a load. `amount` is the axial displacement, m, or traction, Pa, positive outward.
    """

    body: Body
    way: int  # of x, y and z
    held: int  # 0 the low end, 1 the high one
    driving: Declared
    force: bool
    amount: float  # N/m^2 or m, along the axis outward

    @property
    def axis(self) -> Vector:
        """Unit vector from the held end to the driven end."""
        return self.body.outward(self.way, 1 - self.held)

    @property
    def root(self) -> Vector:
        """Centre of the held end, m; for a body of revolution the point on its axis."""
        return self.body.centre(self.way, self.held)

    @property
    def length(self) -> float:
        """Distance between the ends, m."""
        return self.body.size(self.way)

    @property
    def area(self) -> float:
        """Area of one end, m^2; for a body of revolution the area of the full circle or ring."""
        return self.body.area(self.way)

    @property
    def driven_ends(self) -> set[int]:
        """Number of the driven end (0 low, 1 high), as a set of one number."""
        return {1 - self.held}

    def selected_ends(self, where: Any) -> set[int]:
        """Return the numbers (0 low, 1 high) of the ends that a condition selects exactly."""
        return self.body.selected_faces(where, self.way)


def _quasistatic_analysis(case: Case) -> Quasistatic:
    """Return the quasistatic analysis of a case with one material. Raises NotApplicable."""
    if not isinstance(case.analysis, Quasistatic):
        raise NotApplicable("the analysis is not quasistatic", "use `quasistatic(...)`")
    if case.parts:
        raise NotApplicable(
            f"`{case.body.name}` does not consist of one material", "use one material for the whole body"
        )
    return case.analysis


def _find_ends(case: Case, remedy: str) -> HeldAndDrivenEnds:
    """Return the held and the driven end of a case. Raises NotApplicable with `remedy` as its advice."""
    body = box_or_cylinder_body(case)
    drivers = [s for s in case.supports if at_full_size(s.thing).moves]
    drivers += [load for load in case.loads if any(_displacement_or_traction(load))]
    for support in case.supports:
        if not isinstance(support.thing, DisplacementSupport):
            raise NotApplicable(f"the theory does not include the support `{support.name}`", remedy)
    if len(drivers) != 1:
        raise NotApplicable("the body is not driven by exactly one load or support", remedy)
    driving = drivers[0]
    vector = _displacement_or_traction(driving)
    ways = [c for c in range(3) if abs(vector[c]) > ALIGNED * math.hypot(*vector)]
    if isinstance(body, CylinderBody):
        axis = body.shape.axis
        if math.hypot(*cross(vector, axis)) > ALIGNED * math.hypot(*vector):
            raise NotApplicable(f"`{driving.name}` does not act along the axis", remedy)
        ways = [c for c in range(3) if abs(axis[c]) > ALIGNED]
    if len(ways) != 1:
        raise NotApplicable(f"`{driving.name}` does not act along x, y or z", "rotate the scene so that it does")
    return _ends_along(case, body, ways[0], driving, vector, remedy)


def _ends_along(case: Case, body: Body, way: int, driving: Declared, vector: Vector, remedy: str) -> HeldAndDrivenEnds:
    """Return the held and the driven end of a body whose axis has the direction `way`, 0 to 2.

    `driving` is the support or load that drives one end with the displacement or traction `vector`. Raises
    NotApplicable with `remedy` as its advice.
    """
    force = driving.kind == "load"
    where = at_full_size(driving.thing).action.where if force else at_full_size(driving.thing).where
    ends = HeldAndDrivenEnds(body, way, 0, driving, force, 0.0)  # held end and amount are found below
    driven = ends.selected_ends(where)
    if len(driven) != 1:
        raise NotApplicable(f"`{driving.name}` does not act on exactly one whole end face", remedy)
    held = set()
    for support in case.supports:
        if way not in support.thing.components:
            continue
        if support.thing.components != (way,) and not _are_sides_held(case, ends):
            raise NotApplicable(f"the support `{support.name}` prevents lateral expansion of its end", remedy)
        if len(own := ends.selected_ends(support.thing.where)) != 1:
            raise NotApplicable(f"the support `{support.name}` does not act on exactly one whole end face", remedy)
        held |= own if support.name != driving.name else set()
    if held != {0, 1} - driven:
        raise NotApplicable("exactly one end must be held along the axis", remedy)
    ends = replace(ends, held=held.pop())
    return replace(ends, amount=sum(v * a for v, a in zip(vector, ends.axis, strict=True)))


def _displacement_or_traction(declared: Declared) -> Vector:
    """Return the displacement, m, of a support or the traction, Pa, of a load. Raises NotApplicable."""
    thing = at_full_size(declared.thing)
    if declared.kind == "support":
        shift: Vector = thing.imposed
        return shift
    if not isinstance(thing.action, SurfaceTraction):
        raise NotApplicable(f"the load `{declared.name}` is not a traction", DRIVE)
    return thing.action.traction


def _are_sides_held(case: Case, ends: HeldAndDrivenEnds) -> bool:
    """Return whether supports prevent lateral motion, either of all sides or of the whole body."""
    body = ends.body
    across = [c for c in range(3) if c != ends.way]
    if isinstance(body, CylinderBody):
        return any(
            set(across) <= set(s.thing.components) and body.around(s.thing.where) and not at_full_size(s.thing).moves
            for s in case.supports
        )
    return all(_held_sides(case, body, c) == {0, 1} for c in across)


def _held_sides(case: Case, body: BoxBody, across: int) -> set[int]:
    """Return which sides normal to the lateral direction `across` (0 to 2) are held: 0 the low, 1 the high side."""
    if body.flat and across == 2:
        return {0, 1}
    found = {0} if body.turns and body.low[0] == 0.0 and across == 0 else set()
    for support in case.named_supports:
        if across in support.thing.components and not at_full_size(support.thing).moves:
            if body.is_wholly_selected(support.thing.where):
                return {0, 1}
            found |= body.selected_faces(support.thing.where, across)
    return found


# ------------------------------------------------------------------ drainage


def _check_no_fluid_pressure(case: Case) -> None:
    """Check that a surface is drained, and that drained surfaces have zero pore pressure. Raises NotApplicable."""
    for drain in case.drains:
        if drain.thing.moves:
            raise NotApplicable(f"`{drain.name}` applies a pore pressure", "use `drained(...)`")
    if not case.drains:
        raise NotApplicable("no face lets fluid through", "add `drained(...)`")


def _open_ends(case: Case, ends: HeldAndDrivenEnds) -> Drains:
    """Return which ends are drained, "held", "driven" or "both". Raises NotApplicable if other surfaces are drained."""
    _check_no_fluid_pressure(case)
    found: set[int] = set()
    for drain in case.drains:
        if not (own := ends.selected_ends(drain.thing.where)):
            raise NotApplicable(f"`{drain.name}` drains a surface that is not one of its ends", "drain whole ends only")
        found |= own
    if len(found) == 2:
        return "both"
    return "held" if found == {ends.held} else "driven"


# ------------------------------------------------------------------ problems of the theories


def _analysis_ends_and_drains(case: Case) -> tuple[Quasistatic, HeldAndDrivenEnds, Drains]:
    """Return the analysis, the ends, and which ends are drained. Raises NotApplicable if the sides can move."""
    analysis, ends = _quasistatic_analysis(case), _find_ends(case, DRIVE)
    if not _are_sides_held(case, ends):
        raise NotApplicable(f"the sides of `{case.body.name}` can move", SIDES)
    return analysis, ends, _open_ends(case, ends)


def _moduli(case: Case) -> tuple[float, float]:
    """Return the shear modulus and the confined compression modulus of the undeformed drained skeleton, Pa."""
    law = case.material.law
    return law.shear_modulus, law.lame_lambda + 2.0 * law.shear_modulus


def skeleton_of(case: Case) -> Skeleton:
    """Return the law of the drained skeleton of a case, for confined compression.

    Raises NotApplicable if the theory has no formula for this law.
    """
    from softmark.interpreter.problem.rubber_constants import rubber_of, word_of

    law = case.material.law
    word = word_of(law)
    if word in WHOLE:
        return Skeleton(word, law.shear_modulus, law.lame_lambda)
    if word == "linear_elastic":
        raise NotApplicable("`linear_elastic` is a law of small strain", "use `terzaghi(...)`, or `neo_hookean(...)`")
    rubber = rubber_of(replace(case, other_material=law))
    volumetric = vars(law).get("volumetric", "squared")
    return Skeleton(word, law.shear_modulus, law.lame_lambda, rubber, volumetric)


def _open_faces(case: Case, body: BoxBody, axis: int) -> set[int]:
    """Return which faces normal to the direction `axis` (0 to 2) are drained: 0 the low face, 1 the high face."""
    return set[int]().union(*(body.selected_faces(d.thing.where, axis) for d in case.drains))


# ------------------------------------------------------------------ results of the theories


@dataclass(frozen=True)
class FluidResults:
    """Fluid results of a theory: the pore pressure, and the outflow through each support, m^3."""

    theory: Any
    outflows: Mapping[str, float]  # m^3, by support

    @property
    def pressures(self) -> tuple[float, float]:
        """Least and largest pressure in the body: both nan, because theories do not compute them."""
        return math.nan, math.nan

    def pressure(self, point: Vector) -> float:
        """Return the fluid pressure, Pa, at a material point, m."""
        import numpy as np

        return float(self.theory.pressure(np.array([point]))[0])


def _outflows(case: Case, ends: HeldAndDrivenEnds, theory: Any) -> dict[str, float]:
    """Return the outflow through each drained support, m^3, by its name.

    With two drained ends, each has half the outflow. An end that several supports select is counted once.
    """
    both, taken, found = getattr(theory, "drains", "") == "both", set[int](), {}
    for drain in case.drains:
        own = ends.selected_ends(drain.thing.where) if both else {0}
        found[drain.name] = theory.lost * len(own - taken) / (2.0 if both else 1.0)
        taken |= own
    return found


# ------------------------------------------------------------------ setups


class PorousSetup(TheorySetup):
    """Base of the setups for theories of a poroelastic body with one held and one driven end."""

    admits_rigid_plates = admits_material_history = is_poroelastic = True

    def forces(self, case: Case, solution: Any) -> EquilibriumForces:
        """Return the axial reaction forces and the fluid results of a theory; lateral forces are not known, nan."""
        ends = _find_ends(case, DRIVE)
        none, found = (0.0, 0.0, 0.0), {}
        unknown = (math.nan, math.nan, math.nan)
        for support in case.supports:
            own = ends.selected_ends(support.thing.where)
            if ends.way not in support.thing.components or not own:
                found[support.name] = Reaction(unknown, unknown, solution.root, unknown)
                continue
            sign, far = (-1.0, 0.0) if own == {ends.held} else (1.0, ends.length)
            force, at = (
                add_multiples(none, (sign * solution.pull, ends.axis)),
                add_multiples(solution.root, (far, ends.axis)),
            )
            found[support.name] = Reaction(force, cross(at, force), at, none)
        nothing = Reaction(none, none, solution.root, none)  # for supports without constrained points
        found |= {own.name: nothing for own in (*case.beds, *case.drains)}
        work = {} if not ends.force else {ends.driving.name: None}
        return EquilibriumForces(
            found, work, math.nan, dissipated=math.nan, fluid=FluidResults(solution, _outflows(case, ends, solution))
        )

    def warning(self, solution: Any) -> str | None:
        """Return a warning if strains are too large for this theory of small strain, else None."""
        large = getattr(solution, "strained", 0.0)
        return LARGE.format(100.0 * large) if large > SMALL else None


class PorousColumnSetup(PorousSetup):
    """Makes the problem of a porous column in small strain that cannot expand laterally."""

    def problem_from(self, reference: Declared, case: Case) -> Column:
        analysis, ends, drains = _analysis_ends_and_drains(case)
        driven = amplitude_until(at_full_size(ends.driving.thing).amplitude, analysis.duration)
        amount = ends.amount * ends.area if ends.force else ends.amount
        return Column(ends.length, ends.area, ends.root, ends.axis, drains, _moduli(case)[1],
                      case.material.permeability, ends.force, amount, driven, analysis.now)  # fmt: skip


class FinitePorousColumnSetup(PorousSetup):
    """Makes the problem of a porous column in finite strain that cannot expand laterally."""

    def problem_from(self, reference: Declared, case: Case) -> PressedColumn:
        analysis, ends, drains = _analysis_ends_and_drains(case)
        material = case.material
        driven = amplitude_until(at_full_size(ends.driving.thing).amplitude, analysis.duration)
        k = Permeability(material.permeability, material.exponent, material.stiffening, material.solid)
        times = tuple(float(t) for t in analysis.moments if 0.0 < t < analysis.now)
        return PressedColumn(ends.length, ends.area, ends.root, ends.axis, drains, skeleton_of(case), k, ends.force,
                             ends.amount, driven, analysis.now, times)  # fmt: skip

    def facts(self, solution: Any) -> Mapping[str, Any]:
        return {"force_error_N": solution.pull_error}


class CompressedPorousBodySetup(PorousSetup):
    """Base of the setups for a porous slab or disc that two plates compress and that expands laterally."""

    def dimensions(self, case: Case, ends: HeldAndDrivenEnds) -> tuple[int, float, Vector, Vector]:
        """Return the dimension, the half-width or radius, m, a fixed point, m, and the lateral unit vector of the body.

        The dimension is 1 for a slab, which expands along one direction, and 2 for a disc. Raises NotApplicable.
        """
        raise NotImplementedError(f"{type(self).__name__} has no dimensions")

    def problem_from(self, reference: Declared, case: Case) -> CompressedPorousBody:
        analysis, ends = _quasistatic_analysis(case), _find_ends(case, PLATES)
        if ends.force and not any(
            b.thing.is_massless_plate and ends.selected_ends(b.thing.where) == ends.driven_ends for b in case.beds
        ):
            raise NotApplicable(f"the load `{ends.driving.name}` does not keep its plate parallel", PLATES)
        _check_no_fluid_pressure(case)
        dimension, half, root, across = self.dimensions(case, ends)
        driven = amplitude_until(at_full_size(ends.driving.thing).amplitude, analysis.duration)
        shear, modulus = _moduli(case)
        amount = ends.amount * ends.area if ends.force else ends.amount
        return CompressedPorousBody(dimension, half, ends.length, ends.area, root, ends.axis, across, shear, modulus,
                        case.material.permeability, ends.force, amount, driven, analysis.now)  # fmt: skip


class PorousSlabSetup(CompressedPorousBodySetup):
    """Makes the problem of a porous slab between plates, in plane strain."""

    def dimensions(self, case: Case, ends: HeldAndDrivenEnds) -> tuple[int, float, Vector, Vector]:
        """Return 1, the half-width, m, a point of the symmetry plane, m, and the lateral unit vector of a slab.

        Raises NotApplicable.
        """
        body = ends.body
        if not isinstance(body, BoxBody) or body.turns:
            raise NotApplicable(f"`{case.body.name}` is not a slab", "use a box, or a rectangle in `plane_strain(...)`")
        sides = [c for c in range(3) if c != ends.way]
        open_ = {c: _open_faces(case, body, c) for c in sides}
        ways = [c for c in sides if open_[c]]
        if len(ways) != 1 or not all(body.selected_faces(d.thing.where, ways[0]) for d in case.drains):
            raise NotApplicable(
                "its fluid does not leave along exactly one direction",
                "apply `drained(...)` to whole sides normal to one direction",
            )
        way, other = ways[0], next(c for c in sides if c != ways[0])
        if _held_sides(case, body, other) != {0, 1}:
            raise NotApplicable(
                f"it can expand along {'xyz'[other]}", "hold both faces there, or use `plane_strain(...)`"
            )
        held = _held_sides(case, body, way)
        if len(held) != 1 or open_[way] != {0, 1} - held:
            raise NotApplicable(f"along {'xyz'[way]} it needs one side held as a plane of symmetry, and the other free "
                                "and drained",
                          "model one half: hold its middle plane, undrained, and drain the other side")  # fmt: skip
        root = replace_coordinate(ends.root, way, (body.low, body.high)[held.pop()][way])
        return 1, body.size(way), root, replace_coordinate((0.0, 0.0, 0.0), way, 1.0)


class PorousDiscSetup(CompressedPorousBodySetup):
    """Makes the problem of a porous disc between plates."""

    def dimensions(self, case: Case, ends: HeldAndDrivenEnds) -> tuple[int, float, Vector, Vector]:
        """Return 2, the radius, m, the centre of the held plate, m, and a zero vector in place of a lateral direction.

        Raises NotApplicable.
        """
        body, none = ends.body, (0.0, 0.0, 0.0)
        remedy = "use a `cylinder(...)`, or a rectangle that begins at x = 0 in `axisymmetric(...)`"
        if isinstance(body, BoxBody):
            if not body.turns or body.low[0] != 0.0 or ends.way != 1:
                raise NotApplicable(f"`{case.body.name}` is not a disc", remedy)
            if any(body.selected_faces(d.thing.where, 0) != {1} for d in case.drains):
                raise NotApplicable(
                    "its drained surface is not exactly its whole side", "apply `drained(...)` to all of its side"
                )
            if 1 in _held_sides(case, body, 0):
                raise NotApplicable("its side is held", "leave it free")
            return 2, body.high[0], ends.root, none
        if not all(body.around(d.thing.where) for d in case.drains):
            raise NotApplicable(
                "its drained surface is not exactly its whole side", "apply `drained(...)` to all of its side"
            )
        for support in case.named_supports:
            if ends.selected_ends(support.thing.where) and support.thing.components == (ends.way,):
                continue
            if not all(body.selects_axial_plane(support.thing.where, c) for c in support.thing.components):
                raise NotApplicable(f"the support `{support.name}` prevents radial motion",
                              "hold points across its axis only on the planes through it")  # fmt: skip
        return 2, body.shape.radius, ends.root, none
