"""Setup of the contact patch test: makes the stack of blocks of a case, and reads forces and stress of the theory."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.box_and_cylinder_faces import BoxBody, box_body_of_shape
from softmark.interpreter.problem.theories.contact_theory_setup import ContactSetup
from softmark.interpreter.results.reaction_results import ContactNumbers as Touched
from softmark.interpreter.results.reaction_results import EquilibriumForces, Reaction
from softmark.interpreter.vocabulary.amplitude_words import at_full_size
from softmark.interpreter.vocabulary.loads.pressure import PressureLoad
from softmark.interpreter.vocabulary.loads.remote_stress import RemoteStress
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.self_contact_words import REACH, SelfContact
from softmark.interpreter.vocabulary.supports.support import UniformSupport
from softmark.interpreter.vocabulary.supports.symmetry_plane import Symmetric
from softmark.records import dataclass
from softmark.references.contact_patch_test import Block, BlockMaterial, DeformedStack, Joint, Stack
from softmark.references.straight_cantilever import NotApplicable, Vector
from softmark.solvers.materials.neo_hookean import NeoHookean
from softmark.solvers.mesh.disjoint_shapes import DisjointShapes
from softmark.solvers.mesh.shape import add_multiples, cross, dot, replace_coordinate
from softmark.solvers.stress_recovery.analytic_stress_field import AnalyticField

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.mesh.mesh import Floats
    from softmark.solvers.stress_recovery.stress_measures import Tensors
else:
    from softmark.solvers.runtime.lazy_modules import np

SAME = 1e-9  # relative tolerance
WITHIN = 1e-6  # distance of side samples from the ends of a block, relative to its length
EVERYWHERE, NOWHERE = (False, True), (True, False)  # bounds of a condition over a box
PIECES = "use `disjoint(...)` of boxes, or of upright rectangles, of one section along one axis"
ENDS = "hold one end along its normal, move the other along it or load all of it"
SIDES = "leave sides free, or hold one along its normal only: `symmetric(...)`"
LOADS = (
    "use a `traction(...)`, `remote_stress(...)` or `pressure(...)` along the axis, on the whole end that is not held"
)
ALIKE = "use one material, or `poisson = 0`"
NONE = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class BlockPile:
    """Blocks of a case, sorted along the axis `way`: 0, 1 or 2 for x, y or z.

    `first` is the index of the block that the scene names first.
    """

    case: Case
    blocks: tuple[BoxBody, ...]
    way: int
    first: int

    @property
    def whole(self) -> BoxBody:
        """Bounding box of all blocks."""
        return replace(self.blocks[0], high=self.blocks[-1].high)

    @property
    def extent(self) -> float:
        """Diagonal of the stack, m."""
        return self.case.shape.diagonal

    @property
    def across(self) -> tuple[int, ...]:
        """Directions in which the blocks contract laterally, as numbers 0 to 2 of x, y and z."""
        return tuple(c for c in range(3) if c != self.way and not (c == 2 and self.whole.flat))

    def normal(self, end: int) -> Vector:
        """Return the outward unit normal of an end of the stack; 0 is the low end."""
        return self.whole.outward(self.way, end)

    def faces(self, number: int) -> tuple[tuple[Vector, Vector], tuple[Vector, Vector]]:
        """Return the two faces that meet at the joint above a block, each by its low and high corner, m."""
        below, above = self.blocks[number], self.blocks[number + 1]
        return ((replace_coordinate(below.low, self.way, below.high[self.way]), below.high),
                (above.low, replace_coordinate(above.high, self.way, above.low[self.way])))  # fmt: skip

    def ends(self, where: Any) -> set[int]:
        """Return the ends of the stack that a condition selects exactly; 0 is the low end."""
        return self.whole.selected_faces(where, self.way)


def _require_determined_blocks(stack: Stack) -> None:
    """Raise NotApplicable if the position of a block is not determined, or if blocks would be crushed to nothing."""
    if None in stack.ends:
        if stack.has_unglued_joints and stack.traction - stack.pressure >= 0.0:
            raise NotApplicable(
                "its load does not press the blocks together", "load it inward, or glue them: `tied(...)`"
            )
        return
    open_ones = sum(not joint.glued for joint in stack.joints)
    if stack.length_change >= 0.0 and open_ones > 1:
        travel, gaps = (units.format_value(v, units.LENGTH) for v in (stack.gaps - stack.length_change, stack.gaps))
        raise NotApplicable(f"the ends approach by {travel}, but the {open_ones} gaps are {gaps} in all, so that "
                            "blocks between them are free", "prescribe a larger displacement")  # fmt: skip
    if stack.length_change <= -sum(block.length for block in stack.blocks):
        raise NotApplicable(
            "the ends approach by more than the length of the stack", "prescribe a smaller displacement"
        )


# ------------------------------------------------------------------ the blocks


def block_pile_of(case: Case) -> BlockPile:
    """Return the blocks of a case, sorted along their axis. Raises NotApplicable unless they have one section."""
    name = case.body.name
    if not isinstance(case.shape, DisjointShapes):
        raise NotApplicable(f"`{name}` is in one piece", PIECES)
    thickness = case.body.thing.thickness if case.planar else 0.0
    found = [box_body_of_shape(piece, thickness, bool(case.depth)) for piece in _single_shapes(case.shape)]
    blocks = [block for block in found if block is not None]
    if len(blocks) < len(found):
        raise NotApplicable(f"`{name}` has pieces that are not boxes or upright rectangles", PIECES)
    near = SAME * case.shape.diagonal
    first = blocks[0]
    ways = {
        c for block in blocks for c in range(3)
        if abs(block.low[c] - first.low[c]) > near or abs(block.high[c] - first.high[c]) > near
    }  # fmt: skip
    if len(ways) != 1:
        raise NotApplicable(f"the pieces of `{name}` do not lie end to end with one section", PIECES)
    way = ways.pop()
    if case.depth and way != 1:
        raise NotApplicable(f"the pieces of `{name}` lie around each other", "put them on top of each other along y")
    order = sorted(blocks, key=lambda block: block.low[way])
    if any(a.high[way] > b.low[way] + near for a, b in pairwise(order)):
        raise NotApplicable(f"pieces of `{name}` overlap", PIECES)
    return BlockPile(case, tuple(order), way, order.index(first))


def _single_shapes(shape: Any) -> tuple[Any, ...]:
    """Return the single shapes of a `disjoint(...)` shape, in the order of the scene."""
    if not isinstance(shape, DisjointShapes):
        return (shape,)
    return tuple(piece for half in shape.pair for piece in _single_shapes(half))


def _block_without_ends(piled: BlockPile, number: int) -> BoxBody:
    """Return a block that is slightly shortened at both ends.

    A condition on the faces of its neighbours then does not select it, but a condition on its sides does.
    """
    block, way = piled.blocks[number], piled.way
    a, b = block.low[way], block.high[way]
    off = WITHIN * (b - a)
    return replace(
        block, low=replace_coordinate(block.low, way, a + off), high=replace_coordinate(block.high, way, b - off)
    )


def _block_material(piled: BlockPile, number: int) -> BlockMaterial:
    """Return the material of a block. Raises NotApplicable if it is active, or a region covers a part of the block."""
    case, inner = piled.case, _block_without_ends(piled, number)
    material = case.material
    for part, own in zip(case.parts, case.materials[1:], strict=True):
        where = part.thing.where
        selected = NOWHERE if where is None or where.groups else where.over(inner.low, inner.high, piled.extent)
        if selected == EVERYWHERE:
            material = own
        elif selected != NOWHERE or where is None or where.groups:
            raise NotApplicable(
                f"the region `{part.name}` is not a whole block", "make a region of one block, or several"
            )
    if hasattr(material, "passive"):
        raise NotApplicable(f"`{case.body.name}` has an active muscle material", "use a passive material")
    nu = float(material.poisson)
    young = 2.0 * float(material.shear_modulus) * (1.0 + nu)
    free = 1 if case.planar == "plane_strain" else 2
    return BlockMaterial(young, nu, isinstance(material, NeoHookean), free)


def _joint(piled: BlockPile, number: int) -> Joint:
    """Return the joint above a block: its gap, and whether the blocks are tied. Raises NotApplicable."""
    low, high = piled.blocks[number], piled.blocks[number + 1]
    gap = max(high.low[piled.way] - low.high[piled.way], 0.0)
    met = _joint_contacts(piled, number)
    if len(met) != 1:
        between = f"the joint at {'xyz'[piled.way]} = {units.format_value(low.high[piled.way], units.LENGTH)}"
        count = f"{len(met)} contacts meet" if met else "no contact meets"
        raise NotApplicable(
            f"{count} {between}", "use one `self_contact(...)` or `tied(...)` for each joint, on all of both faces"
        )
    thing = met[0].thing
    if isinstance(thing, SelfContact):
        if gap <= SAME * piled.extent:
            raise NotApplicable(
                f"`{met[0].name}` has no gap to close", "leave one between the blocks, or use `tied(...)`"
            )
        return Joint(gap)
    if gap > (thing.reach or REACH * piled.extent):
        raise NotApplicable(f"`{met[0].name}` does not reach across the joint", "put the blocks on each other")
    return Joint(gap, glued=True)


def _joint_contacts(piled: BlockPile, number: int) -> list[Declared]:
    """Return the contacts that select both faces of the joint above a block. Raises NotApplicable."""
    found = []
    for pair in piled.case.pairs:
        each = {pair.thing.where.over(*face, piled.extent) for face in piled.faces(number)}
        if each == {EVERYWHERE}:
            found.append(pair)
        elif each != {NOWHERE}:
            raise NotApplicable(f"`{pair.name}` covers only a part of a joint", "select the whole of both faces")
    return found


# ------------------------------------------------------------------ supports and loads


def _held_ends_and_sides(
    piled: BlockPile, solids: tuple[BlockMaterial, ...]
) -> tuple[tuple[float | None, float | None], set[tuple[int, int, int]]]:
    """Return the prescribed axial displacements of the low and the high end, m, and the sides that are symmetry planes.

    An end that is not held has None. Each side is given by block, direction (0 to 2) and end (0 low, 1 high). Raises
    NotApplicable.
    """
    ends, mirrors = dict[int, float](), set[tuple[int, int, int]]()
    for support in piled.case.named_supports:
        thing, by = at_full_size(support.thing), support.thing.imposed
        if not isinstance(thing, UniformSupport | Symmetric):
            raise NotApplicable(f"the support `{support.name}` does not hold one whole end or one whole side", ENDS)
        along_it = [c for c in thing.components if c in piled.across]
        if any(by[c] for c in along_it):
            raise NotApplicable(f"the support `{support.name}` moves the body across its axis", ENDS)
        taken = piled.ends(thing.where)
        if not taken:
            mirrors |= _symmetry_sides(piled, support, thing)
            continue
        for end in taken:
            if along_it and solids[-end].poisson:
                raise NotApplicable(f"the end that `{support.name}` holds cannot expand or contract laterally",
                              "hold it along its normal only, so that it slides")  # fmt: skip
            if piled.way in thing.components:
                if end in ends:
                    raise NotApplicable(f"`{support.name}` holds an end that is already held", "hold each end once")
                ends[end] = by[piled.way]
    if not ends:
        raise NotApplicable("no end is held along its normal", ENDS)
    return (ends.get(0), ends.get(1)), mirrors


def _symmetry_sides(piled: BlockPile, support: Declared, thing: Any) -> set[tuple[int, int, int]]:
    """Return the sides that a support holds along their normal, by block, direction and end. Raises NotApplicable."""
    found = set()
    for i in range(len(piled.blocks)):
        side = _block_without_ends(piled, i)
        if thing.where.over(side.low, side.high, piled.extent) == NOWHERE:
            continue
        c = thing.components[0]
        taken = side.selected_faces(thing.where, c) if len(thing.components) == 1 and c in piled.across else set()
        if len(taken) != 1:
            raise NotApplicable(f"the support `{support.name}` holds neither an end nor a side", SIDES)
        end = taken.pop()
        if piled.whole.turns and (end or side.low[0] > SAME * piled.extent):
            raise NotApplicable(f"`{support.name}` prevents expansion around its axis", "leave its sides free")
        found.add((i, c, end))
    return found


def _laterally_fixed_points(piled: BlockPile, joints: tuple[Joint, ...], mirrors: set[tuple[int, int, int]],
           solids: tuple[BlockMaterial, ...]) -> tuple[Vector, ...]:  # fmt: skip
    """Return for each block a point, m, that does not move laterally. Raises NotApplicable.

    It lies in the symmetry planes of the block and of blocks tied to it; without them it is the middle of the block.
    """
    found = []
    for i, block in enumerate(piled.blocks):
        root = replace_coordinate(block.middle, 0, 0.0) if block.turns else block.middle
        for c in piled.across:
            held = {end for j, way, end in mirrors if way == c and _is_tied(joints, i, j)}
            if len(held) > 1 and solids[i].poisson:
                raise NotApplicable(f"it cannot expand along {'xyz'[c]}", SIDES)
            if held and not block.turns:
                root = replace_coordinate(root, c, (block.high if held.pop() else block.low)[c])
        found.append(root)
    return tuple(found)


def _is_tied(joints: tuple[Joint, ...], a: int, b: int) -> bool:
    """Return whether all joints between the blocks with the numbers a and b are tied."""
    return all(joint.glued for joint in joints[min(a, b) : max(a, b)])


def _require_equal_contraction(piled: BlockPile, joints: tuple[Joint, ...], solids: tuple[BlockMaterial, ...],
                       roots: tuple[Vector, ...]) -> None:  # fmt: skip
    """Raise NotApplicable if the two faces of a tied or frictional joint contract laterally by different amounts."""
    for i, joint in enumerate(joints):
        pair = _joint_contacts(piled, i)[0]
        friction = getattr(pair.thing, "friction", 0.0)
        if not (joint.glued or friction) or not (solids[i].poisson or solids[i + 1].poisson):
            continue
        alike = all(roots[i][c] == roots[i + 1][c] for c in piled.across)
        if solids[i] != solids[i + 1] or not alike:
            how = f"has friction of {friction:g}" if friction else "is a tied contact"
            remedy = ALIKE + (", or remove `friction`" if friction else ", or let them touch: `self_contact(...)`")
            raise NotApplicable(
                f"`{pair.name}` {how} between blocks whose sections contract by different amounts", remedy
            )


def _end_load(piled: BlockPile, ends: tuple[float | None, float | None]) -> tuple[bool, float, float]:
    """Return whether the free end is loaded, its outward traction, Pa, and its pressure, Pa. Raises NotApplicable."""
    traction, pressure = 0.0, 0.0
    for load in piled.case.loads:
        action = load.thing.action
        taken = piled.ends(action.where) if isinstance(action, SurfaceTraction | RemoteStress | PressureLoad) else set()
        if len(taken) != 1 or ends[end := taken.pop()] is not None:
            raise NotApplicable(f"the load `{load.name}` does not act on exactly the whole end that is not held", LOADS)
        if isinstance(action, PressureLoad):
            pressure += action.pressure
            continue
        n = piled.normal(end)
        vector = action.traction if isinstance(action, SurfaceTraction) else _traction_on_face(action, n)
        along = dot(vector, n)
        if math.hypot(*add_multiples(vector, (-along, n))) > SAME * math.hypot(*vector):
            raise NotApplicable(f"the load `{load.name}` does not act along the axis", LOADS)
        traction += along
    return bool(piled.case.loads), traction, pressure


def _traction_on_face(action: RemoteStress, n: Vector) -> Vector:
    """Return the traction vector, Pa, of a uniaxial remote stress on a face with unit normal n."""
    return add_multiples(NONE, (action.stress * dot(action.direction, n), action.direction))


# ------------------------------------------------------------------ results of the theory


@dataclass(frozen=True)
class JointPressure:
    """Uniform contact pressure on the joints of a stack, Pa, by the number of the block below each joint."""

    piled: BlockPile
    joints: Mapping[int, float]  # of the joint above each of these blocks, Pa

    def pressures(self, X: Any) -> Any:
        """Return the pressures (n,), Pa, at material points X (n, 3), m; nan at points off the contact faces."""
        found, near = np.full(len(X), math.nan), WITHIN * self.piled.extent
        for number, pressure in self.joints.items():
            for low, high in self.piled.faces(number):
                on = np.all((np.array(low) - near <= X) & (np.array(high) + near >= X), axis=1)
                found[on] = pressure
        return found

    @property
    def at_nodes(self) -> Mapping[str, Any]:
        """Return an empty mapping, because a theory has no mesh."""
        return {}


def _contact_force(piled: BlockPile, found: DeformedStack, numbers: list[int]) -> Reaction:
    """Return the force of a contact, through joints above blocks, on all but the block that the scene names first."""
    total, moment, at = NONE, NONE, piled.whole.middle
    for number in numbers:
        if piled.first not in (number, number + 1):
            continue  # both sides are handled with the others
        at = _joint_centre(piled, found, number)
        force = add_multiples(NONE, (found.pull, piled.normal(1 if piled.first == number + 1 else 0)))
        total, moment = add_multiples(total, (1.0, force)), add_multiples(moment, (1.0, cross(at, force)))
    return Reaction(total, moment, at, add_multiples(moment, (-1.0, cross(at, total))))


def _end_centre(piled: BlockPile, found: DeformedStack, end: int) -> Vector:
    """Return the centre of an end (0 low, 1 high), m: deformed for neo-Hookean blocks, undeformed for Hooke's law."""
    return _deformed_position(found, piled.whole.centre(piled.way, end), -end)


def _joint_centre(piled: BlockPile, found: DeformedStack, number: int) -> Vector:
    """Return the centre of the upper face of a block, m: deformed or undeformed as in `_end_centre`."""
    return _deformed_position(found, piled.blocks[number].centre(piled.way, 1), number)


def _deformed_position(found: DeformedStack, at: Vector, number: int) -> Vector:
    """Return the deformed position, m, of a point of a block; the undeformed one if the block has Hooke's law."""
    if not found.stack.blocks[number].solid.large:
        return at
    x, y, z = found.displacement(np.array([at]))[0].tolist()
    return add_multiples(at, (1.0, (x, y, z)))


@dataclass(frozen=True)
class PatchStress(AnalyticField):
    """Stress field of the patch test, by formulas in place of a mesh."""

    theory: DeformedStack

    def at(self, X: Floats) -> Tensors:
        """Return the stress, Pa, at points X (n, 3), m, of the undeformed body."""
        from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC
        from softmark.solvers.stress_recovery.stress_measures import Tensors

        H, sigma = self.theory.fields(X)
        small = not any(block.solid.large for block in self.theory.stack.blocks)
        return Tensors(np.stack([sigma[:, i, j] for i, j in SYMMETRIC], axis=1), H.reshape(-1, 9), small)

    @property
    def usual(self) -> tuple[float, float, float]:
        """Return scales of relative errors: root mean squares of stress, Pa, strain, and deviatoric stress, Pa."""
        blocks, way = self.theory.stack.blocks, self.theory.stack.way
        middles = np.array([replace_coordinate(block.root, way, 0.5 * (block.low + block.high)) for block in blocks])
        H, sigma = self.theory.fields(middles)
        deviator = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3.0
        share = np.array([block.length for block in blocks])
        x, y, z = (float(np.sqrt(np.average((T**2).sum(axis=(1, 2)), weights=share))) for T in (sigma, H, deviator))
        return x, y, z


class PatchTestSetup(ContactSetup):
    """Makes the problem of the contact patch test: a stack of blocks that touch or are tied."""

    def problem_from(self, reference: Declared, case: Case) -> Stack:
        if case.planar == "plane_stress":
            raise NotApplicable("its body is in plane stress", "use `plane_strain(...)`, or a solid")
        piled = block_pile_of(case)
        solids = tuple(_block_material(piled, i) for i in range(len(piled.blocks)))
        joints = tuple(_joint(piled, i) for i in range(len(piled.blocks) - 1))
        ends, mirrors = _held_ends_and_sides(piled, solids)
        loaded, traction, pressure = _end_load(piled, ends)
        if None in ends and not loaded:
            raise NotApplicable("nothing moves or loads its other end", ENDS)
        roots = _laterally_fixed_points(piled, joints, mirrors, solids)
        _require_equal_contraction(piled, joints, solids, roots)
        blocks = tuple(
            Block(block.low[piled.way], block.high[piled.way], solid, root)
            for block, solid, root in zip(piled.blocks, solids, roots, strict=True)
        )
        whole = piled.whole
        found = Stack(blocks, joints, piled.way, piled.across, whole.low, whole.high, whole.area(piled.way),
                      whole.turns, ends, traction, pressure)  # fmt: skip
        _require_determined_blocks(found)
        return found

    def forces(self, case: Case, solution: DeformedStack) -> EquilibriumForces:
        """Return the reaction and contact forces of the theory; energies are nan, because the theory gives none."""
        piled, stack = block_pile_of(case), solution.stack
        reactions, touches = {}, {}
        unknown = math.nan, math.nan, math.nan
        for support in case.supports:
            taken = piled.ends(support.thing.where)
            holds = [end for end in taken if piled.way in support.thing.components]
            if support.thing.implied:  # constraint of a plane body
                reactions[support.name] = Reaction(unknown, unknown, piled.whole.middle, unknown)
                continue
            total, moment = NONE, NONE
            for end in holds:
                force = add_multiples(NONE, (solution.pull, piled.normal(end)))
                total, moment = (
                    add_multiples(total, (1.0, force)),
                    add_multiples(moment, (1.0, cross(_end_centre(piled, solution, end), force))),
                )
            at = _end_centre(piled, solution, holds[0]) if holds else piled.whole.middle
            own = add_multiples(moment, (-1.0, cross(at, total)))
            reactions[support.name] = Reaction(total, moment, at, own)
        for pair in case.pairs:
            numbers = [i for i in range(len(stack.joints)) if pair in _joint_contacts(piled, i)]
            reactions[pair.name] = _contact_force(piled, solution, numbers)
            if isinstance(pair.thing, SelfContact):
                pressures = {
                    i: solution.push / solution.joint_contact_area(i) if solution.push else 0.0 for i in numbers
                }
                touches[pair.name] = Touched(
                    sum(map(solution.joint_contact_area, numbers)),
                    max(pressures.values(), default=0.0),
                    solution.left,
                    field=JointPressure(piled, pressures),
                )
        work = {load.name: None for load in case.loads}
        return EquilibriumForces(
            reactions, work, math.nan, touches=touches, relative_error=sum(map(abs, solution.relative_errors.values()))
        )

    def stress(self, solution: DeformedStack) -> PatchStress:
        return PatchStress(solution)
