"""Check for initial overlap of a rigid body with another body, judged by shapes; a run also checks meshes.

Only certain overlaps are reported: a surface point of the deformable body that no support constrains and that lies
clearly inside the rigid body. Shapes from files, planes and parts of a surface are checked during the run.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.language.message_builder import diagnostic

if TYPE_CHECKING:
    from softmark.solvers.mesh.shape import Shape, Vector3

LINES = 5  # sample lines along each axis
SURE = 0.02  # least depth relative to the smaller body, since facets lie inside round surfaces
HALVES = 30  # bisections of a line to find the surface


def check_initial_overlap(scene: Scene, contact: Declared, rigid: Declared, body: Declared) -> Iterator[Diagnostic]:
    """Yield an error with a surface point of the deformable body that lies inside the rigid body, if there is one."""
    if contact.thing.where is not EVERYWHERE or body.thing.planar:
        return
    held = [s.thing.where for s in scene.acting("support", body.name) if getattr(s.thing, "where", None) is not None]
    inner, outer = rigid.thing.shape, body.thing.shape
    for at in _surface_points_inside(inner, outer):
        if not any(where.holds(*at, outer.diagonal) for where in held):
            place = units.format_vector([round(c, 6) for c in at], units.LENGTH)
            yield diagnostic(
                "E611", contact.at(),
                f"`{rigid.name}` overlaps `{body.name}` at the start: both contain {place}",
                "overlap at the start",
                "move it away until the bodies only touch, and press it in with a support: `displaced(..., by = "
                "...)`",
            )  # fmt: skip
            return


def _surface_points_inside(inner: Shape, outer: Shape) -> Iterator[Vector3]:
    """Yield surface points of `outer`, m, that are clearly inside `inner`, on a few lines along the axes."""
    if inner.bounds is None or outer.bounds is None:
        return
    low = [max(a, b) for a, b in zip(inner.bounds[0], outer.bounds[0], strict=True)]
    high = [min(a, b) for a, b in zip(inner.bounds[1], outer.bounds[1], strict=True)]
    if any(a >= b for a, b in zip(low, high, strict=True)):
        return
    deep = SURE * min(inner.diagonal, outer.diagonal)
    shares = [(i + 0.5) / LINES for i in range(LINES)]
    for part in product(shares, repeat=3):
        x, y, z = (a + s * (b - a) for a, b, s in zip(low, high, part, strict=True))
        if not (inner.contains((x, y, z)) and outer.contains((x, y, z))):
            continue
        for axis, (end, way) in product(range(3), zip(outer.bounds, (-1, 1), strict=True)):
            beyond = [x, y, z]
            beyond[axis] = end[axis] + way * deep
            at = _surface_crossing(outer, (x, y, z), (beyond[0], beyond[1], beyond[2]))
            if _is_well_inside(inner, at, deep):
                yield at


def _surface_crossing(shape: Shape, within: Vector3, beyond: Vector3) -> Vector3:
    """Return the point, m, at which a line from inside a shape to outside crosses its surface."""
    a, b = within, beyond
    for _ in range(HALVES):
        middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]))
        a, b = (middle, b) if shape.contains(middle) else (a, middle)
    return a


def _is_well_inside(shape: Shape, at: Vector3, deep: float) -> bool:
    """Return whether a point and the corners of a cube around it are inside a shape."""
    x, y, z = at
    return all(shape.contains((x + i * deep, y + j * deep, z + k * deep)) for i, j, k in product((-1, 1), repeat=3))
