"""Homogeneous deformation that supports and loads of a body impose.

Each support must select whole faces. On a pair of opposite faces it imposes a stretch along their normal, or a
shear along the faces. The module uses no arrays, because validation needs it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field
from functools import lru_cache

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.records import dataclass
from softmark.solvers.mesh.shape import Prism, RoundPrism, Shape
from softmark.solvers.mesh.shapes import Box

Face = tuple[int, int]  # the axis of its normal, and 0 of the lower or 1 of the upper face
Vector3 = tuple[float, float, float]
ACROSS = 9  # sample points along each direction of a face
AROUND = 16  # sample points around a round body
SAME = 1e-9  # relative: nearer amounts count as equal
NAMES = "xyz"
WHOLE = "a material point supports only whole faces of the body, such as `where = x <= 0 mm`"
SHEARS = "remove the components along the face, or use `fem(...)`: a material point has no shear traction"
OPPOSITE = "hold the opposite face along its normal, such as `fixed(..., components = x)`"
NEEDS = {
    "uniaxial": "one pair of opposite faces held or pulled along its normal, and no others",
    "equibiaxial": "two pairs of opposite faces pulled equally along their normals, and the third pair free",
    "planar": "one pair of opposite faces pulled along its normal, one held, and the third free",
    "simple_shear": "two opposite faces held in all directions, with one moved parallel to the other",
    "confined": "all faces held along their normals, and one pair of them moved",
}


@dataclass(frozen=True)
class ImposedState:
    """Homogeneous state along x, y and z that supports and loads impose.

    `stretches` are None along free axes, where `stresses` are the imposed nominal stresses, Pa. `shear` is an
    off-diagonal entry (a, b) of F with its value. `driven` are the axes that are moved or loaded. The point `anchors`
    (x, y, z), m, is displaced by `shifts`, m; displacements of other points are relative to it. `let_go` are the
    constraints that such a state violates: names of supports, and axes.
    """

    stretches: tuple[float | None, float | None, float | None]
    stresses: Vector3
    shear: tuple[int, int, float] | None
    driven: tuple[int, ...]
    anchors: Vector3
    shifts: Vector3
    let_go: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class ImposedOnFaces:
    """Displacements of whole faces imposed by supports, m, by face and component, and nominal stresses of loads, Pa."""

    case: Case
    held: dict[tuple[Face, int], tuple[float, str]] = field(default_factory=dict)
    pulled: dict[int, float] = field(default_factory=dict)  # by axis: force per undeformed area, Pa

    @property
    def bounds(self) -> tuple[Vector3, Vector3]:
        """Lower and upper corner of the body's bounding box, m."""
        assert self.case.shape.bounds is not None
        return self.case.shape.bounds

    def extent(self, axis: int) -> float:
        """Return the extent of the body along x, y or z, m."""
        return self.bounds[1][axis] - self.bounds[0][axis]

    def relative_displacement(self, axis: int, component: int) -> float | None:
        """Return the displacement, m, of the upper face of an axis relative to the lower face; None if one is free."""
        low, high = (self.held.get(((axis, side), component)) for side in (0, 1))
        return None if low is None or high is None else high[0] - low[0]

    def stretch(self, axis: int) -> float | None:
        """Return the imposed stretch along an axis; None if no stretch is imposed."""
        apart = self.relative_displacement(axis, axis)
        return None if apart is None else 1.0 + apart / self.extent(axis)


def is_block(case: Case) -> bool:
    """Return whether a body is a box, or a straight cylinder or tube along x, y or z."""
    shape = case.shape
    round_one = isinstance(shape, RoundPrism) and max(abs(a) for a in shape.axis) > 1.0 - 1e-12
    return isinstance(shape, Box) or round_one


def collect_imposed_on_faces(case: Case, model: str) -> ImposedOnFaces:
    """Return the displacements and stresses imposed on whole faces.

    Raises Fault if a support or load selects something other than whole faces.
    """
    found = ImposedOnFaces(case)
    for support in case.supports:
        for face in _whole_faces(case, support, support.thing.where, model):
            for c in support.thing.components:
                amount = float(support.thing.displacement[c])
                other = found.held.setdefault((face, c), (amount, support.name))
                if abs(other[0] - amount) > SAME * case.shape.diagonal:
                    raise fault(
                        "E356",
                        support.at(),
                        f"`{support.name}` and `{other[1]}` move the same face by different amounts",
                        "ambiguous",
                        "use one support for each face",
                    )
    for load in case.loads:
        _add_face_stress(found, load, model)
    return found


def _add_face_stress(found: ImposedOnFaces, load: Declared, model: str) -> None:
    """Add the stress of a traction on whole faces. Raises Fault if it is not along the normal."""
    action = load.thing.action
    if not isinstance(action, SurfaceTraction):
        return  # refused as no load that it takes
    for axis, side in _whole_faces(found.case, load, action.where, model):
        slack = SAME * max(abs(t) for t in action.traction)
        if isinstance(found.case.shape, RoundPrism) and abs(found.case.prism.axis[axis]) < 0.5:
            raise _partial_face_fault(load, model, "on a round side", "pull on an end face, along its normal")
        if any(abs(t) > slack for c, t in enumerate(action.traction) if c != axis):
            raise _partial_face_fault(load, model, "not along the normal of the face", SHEARS)
        if ((axis, 1 - side), axis) not in found.held:
            raise _partial_face_fault(load, model, "the opposite face is not held", OPPOSITE)
        pull = action.traction[axis] * (1.0 if side else -1.0)
        found.pulled[axis] = found.pulled.get(axis, 0.0) + pull


def _whole_faces(case: Case, declared: Declared, where: Condition, model: str) -> list[Face]:
    """Return the whole faces that a condition selects. Raises Fault if it selects anything else."""
    found = _selected_faces(case.shape, where)
    if not found:
        raise _partial_face_fault(declared, model, "does not select a whole face")
    return found


@lru_cache(maxsize=256)  # each state and check needs the same result
def _selected_faces(shape: Shape, where: Condition) -> list[Face]:
    """Return the faces that a condition selects; none if it selects something else, or nothing."""
    extent, about = shape.diagonal, where.axes
    faces: dict[Face, bool] = {}
    inner: list[tuple[Face, ...]] = []
    known: dict[tuple[float, ...], bool] = {}  # values by the coordinates of the condition
    for point, own in _grid_points_with_faces(shape):
        place = (0 in about and point[0], 1 in about and point[1], 2 in about and point[2])
        if (holds := known.get(place)) is None:
            holds = known[place] = bool(where.holds(*point, extent))
        for face in own:
            faces[face] = faces.get(face, True) and holds
        if holds:
            inner.append(own)
    found = [face for face, whole in faces.items() if whole]
    return found if all(set(own) & set(found) for own in inner) else []


def _partial_face_fault(declared: Declared, model: str, why: str, help: str = WHOLE) -> Fault:
    """Return the Fault for a support or load that a material point cannot represent, for the reason `why`."""
    kind = "load" if declared.kind == "load" else "support"
    return fault(
        "E356", declared.at("where"), f"`{model}` cannot represent the {kind} `{declared.name}`", why, help
    )  # fmt: skip


@lru_cache(maxsize=16)
def _grid_points_with_faces(shape: Shape) -> tuple[tuple[Vector3, tuple[Face, ...]], ...]:
    """Return the points of a grid over the whole body, each with the body faces on which it lies."""
    return tuple(_generate_grid_points_with_faces(shape))


def _generate_grid_points_with_faces(shape: Shape) -> Iterator[tuple[Vector3, tuple[Face, ...]]]:
    """Yield the points of a grid over the whole body, interior too, each with the body faces on which it lies."""
    assert shape.bounds is not None
    low, high = shape.bounds
    if isinstance(shape, Box):
        steps = range(ACROSS)
        for at in ((i, j, k) for i in steps for j in steps for k in steps):
            point = tuple(a + (b - a) * n / (ACROSS - 1) for a, b, n in zip(low, high, at, strict=True))
            own = tuple((axis, n // (ACROSS - 1)) for axis, n in enumerate(at) if n in (0, ACROSS - 1))
            yield point, own  # type: ignore[misc]
        return
    assert isinstance(shape, Prism)
    axis = max(range(3), key=lambda a: abs(shape.axis[a]))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    side = ((first, 0), (first, 1), (second, 0), (second, 1))
    inner, outer = shape.section.hole_radius or 0.0, 0.5 * (high[first] - low[first])
    for n in range(ACROSS):
        end = ((axis, n // (ACROSS - 1)),) if n in (0, ACROSS - 1) else ()
        for r in (inner, 0.5 * (inner + outer), outer):
            for k in range(AROUND):
                centre = [0.5 * (a + b) for a, b in zip(low, high, strict=True)]
                centre[axis] = low[axis] + (high[axis] - low[axis]) * n / (ACROSS - 1)
                centre[first] += r * math.cos(2.0 * math.pi * k / AROUND)
                centre[second] += r * math.sin(2.0 * math.pi * k / AROUND)
                yield (centre[0], centre[1], centre[2]), (*end, *(side if r == outer else ()))


# ------------------------------------------------------------------ the state that a word stands for


def imposed_state(case: Case, word: str, model: Declared) -> ImposedState:
    """Return the imposed state if it is of the kind `word`. Raises Fault if supports and loads impose another state."""
    faces = collect_imposed_on_faces(case, model.name)
    stretches = [faces.stretch(axis) for axis in range(3)]
    if word == "simple_shear":
        if (sheared := _imposed_shear(faces, stretches)) is not None:
            return _make_imposed_state(faces, [1.0, 1.0, 1.0], sheared, (sheared[0],))
    elif (moved := _imposed_axes(faces, stretches, word)) is not None:
        return _make_imposed_state(faces, stretches, None, tuple(moved))
    raise fault("E356", model.at("state"), f"the supports and loads of `{case.body.name}` do not impose the "
                                           f"{word.replace('_', ' ')} state of `{model.name}`",
                _describe_imposed(faces, stretches),
                f"hold or load the faces as follows: {NEEDS[word]}")  # fmt: skip


def _imposed_axes(faces: ImposedOnFaces, stretches: list[float | None], word: str) -> list[int] | None:
    """Return the axes that are moved or loaded in a state of stretches; None if the state is not of the kind `word`.

    In planar tension, a width held by wide grips is added to `stretches`.
    """
    known = [axis for axis in range(3) if stretches[axis] is not None or axis in faces.pulled]
    if word == "uniaxial":
        return known if len(known) == 1 else None
    if word == "equibiaxial":
        return known if len(known) == 2 and _have_equal_state(faces, stretches, known) else None
    if word == "planar" and len(known) == 1:
        wide = _gripped_direction(faces, known[0])
        if wide is None:
            return None
        stretches[wide] = 1.0
        return known
    if len(known) != (2 if word == "planar" else 3):
        return None
    moved = [axis for axis in known if not _is_unit_stretch(stretches[axis])] or known[:1]
    return moved if len(moved) == 1 else None


def _is_unit_stretch(stretch: float | None) -> bool:
    """Return whether the stretch is imposed and equal to 1."""
    return stretch is not None and abs(stretch - 1.0) <= SAME


def _describe_imposed(faces: ImposedOnFaces, stretches: list[float | None]) -> str:
    """Return a description of the stretch or stress imposed along each axis."""
    words = (
        f"{NAMES[a]} {'held' if abs(s - 1.0) <= SAME else 'stretched'}" if s is not None
        else f"{NAMES[a]} {'pulled' if a in faces.pulled else 'free'}"
        for a, s in enumerate(stretches)
    )  # fmt: skip
    return f"they impose: {', '.join(words)}"


def _have_equal_state(faces: ImposedOnFaces, stretches: list[float | None], axes: list[int]) -> bool:
    """Return whether two axes have equal stretches, or equal stresses."""
    one, other = (stretches[a] if stretches[a] is not None else faces.pulled[a] for a in axes)
    kinds = {stretches[a] is None for a in axes}
    return len(kinds) == 1 and abs(one - other) <= SAME * max(abs(one), abs(other))  # type: ignore[operator, arg-type]


def _gripped_direction(faces: ImposedOnFaces, axis: int) -> int | None:
    """Return the lateral direction in which grips hold both end faces of an axis; None if there is none.

    If they hold both lateral directions, the result is the one in which the body is wider.
    """
    held = [c for c in range(3) if c != axis and faces.relative_displacement(axis, c) is not None]
    return max(held, key=faces.extent, default=None)


def _imposed_shear(faces: ImposedOnFaces, stretches: list[float | None]) -> tuple[int, int, float] | None:
    """Return the off-diagonal entry (a, b) of F that two faces impose, with its value; None for another deformation."""
    found = []
    for b in range(3):
        apart = [faces.relative_displacement(b, c) for c in range(3)]
        if None in apart or not _is_unit_stretch(stretches[b]):
            continue
        slides = [c for c in range(3) if c != b and abs(apart[c] or 0.0) > SAME * faces.extent(b)]
        if len(slides) <= 1:
            a = slides[0] if slides else (b + 1) % 3
            found.append((a, b, (apart[a] or 0.0) / faces.extent(b)))
    others = [s for s in stretches if s is not None and not _is_unit_stretch(s)]
    return max(found, key=lambda entry: abs(entry[2]), default=None) if not others and not faces.pulled else None


def _make_imposed_state(
    faces: ImposedOnFaces,
    stretches: list[float | None],
    shear: tuple[int, int, float] | None,
    moved: tuple[int, ...],
) -> ImposedState:
    """Return the imposed state with given stretches and shear; `moved` are the axes that are moved or loaded."""
    low, high = faces.bounds
    anchors, shifts = [], []
    for axis in range(3):
        here = [(side, faces.held[(axis, side), axis][0]) for side in (0, 1) if ((axis, side), axis) in faces.held]
        side, shift = here[0] if here else (None, 0.0)
        anchors.append(0.5 * (low[axis] + high[axis]) if side is None else (low, high)[side][axis])
        shifts.append(shift)
    if shear is not None:
        shifts[shear[0]] = faces.held[(shear[1], 0), shear[0]][0]
        anchors[shear[1]] = low[shear[1]]
    pulled = tuple(faces.pulled.get(axis, 0.0) if stretches[axis] is None else 0.0 for axis in range(3))
    let_go = _violated_constraints(faces, stretches) if shear is None else ()
    return ImposedState(tuple(stretches), pulled, shear, moved, tuple(anchors), tuple(shifts), let_go)  # type: ignore[arg-type]


def _violated_constraints(faces: ImposedOnFaces, stretches: list[float | None]) -> tuple[tuple[str, int], ...]:
    """Return the constraints that the state violates: names of supports that hold a face laterally, and the axis."""
    found = (
        (name, c) for ((axis, _), c), (_, name) in faces.held.items()
        if c != axis and (stretches[c] is None or abs(stretches[c] - 1.0) > SAME)  # type: ignore[operator]
    )  # fmt: skip
    return tuple(dict.fromkeys(found))
