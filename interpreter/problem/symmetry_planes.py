"""Checks of symmetry planes: the body, loads and rigid bodies must be symmetric about each `symmetric(...)` plane."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case, Fault
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.supports.symmetry_plane import IN_PLANE
from softmark.solvers.mesh.rigid_shapes import HalfSpace

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.energies.energy import Floats, Ints
    from softmark.solvers.mesh.mesh import Mesh
    from softmark.solvers.mesh.shape import Bounds
else:
    from softmark.solvers.runtime.lazy_modules import np


def asymmetric_load_error(support: Declared, load: Declared) -> Diagnostic | None:
    """Return the error of a load that is not symmetric about the symmetry plane `support`, or None."""
    if (reason := load.thing.action.mirror_fault(*support.thing.mirror_plane, support.name)) is None:
        return None
    field, problem, label, help = reason
    return diagnostic("E582", load.at(field), f"`{load.name}` {problem}", label, help)


def rigid_body_motion_error(support: Declared, rigid: Declared, way: Declared) -> Diagnostic | None:
    """Return the error of a rigid body that a symmetry plane cuts and that moves out of this plane, or None.

    `support` is the symmetry plane, `rigid` the rigid body, and `way` the support that prescribes its displacement or
    rotation. Rigid bodies from files and filled surfaces are not checked.
    """
    shape = rigid.thing.shape
    if support.thing.mirror_plane is None or not way.thing.on_rigid_bodies or shape.fault:
        return None
    if shape.prebuilt or shape.enclosed:
        return None  # its file is only read when needed
    across, at = support.thing.mirror_plane
    bounds = shape.bounds
    if bounds is not None:
        slack = IN_PLANE * shape.diagonal
        if not bounds[0][across] + slack < at < bounds[1][across] - slack:
            return None  # its mirror image comes from the other side
    elif not isinstance(shape, HalfSpace) or shape.normal[across]:
        return None
    tilts = any(c for i, c in enumerate(way.thing.rotation) if i != across)
    if not (way.thing.imposed[across] or tilts):
        return None
    does = "rotates" if tilts else "moves"
    return diagnostic("E582", way.at(), f"`{way.name}` {does} `{rigid.name}` across the plane of symmetry"
                      f" `{support.name}`, which cuts the rigid body", "its mirror image moves the other way",
                      f"model the whole body: motion along {'xyz'[across]} is not symmetric")  # fmt: skip


def initial_motion_error(support: Declared, analysis: Declared) -> Diagnostic | None:
    """Return the error of an initial velocity normal to a symmetry plane, or of a spin about an axis in it, or None."""
    if not isinstance(analysis.thing, Dynamic):
        return None
    across = support.thing.mirror_plane[0]
    way = "xyz"[across]
    if analysis.thing.velocity[across]:
        return diagnostic("E582", analysis.at("velocity"),
                          f"the initial velocity of `{analysis.name}` crosses the plane of symmetry `{support.name}`",
                          f"along {way}; its mirror image moves the other way",
                          "give a velocity along the plane, or model the whole body: points of the plane do not "
                          f"move along {way}")  # fmt: skip
    if any(turn for i, turn in enumerate(analysis.thing.spin) if i != across):
        return diagnostic("E582", analysis.at("spin"),
                          f"the initial spin of `{analysis.name}` rotates the plane of symmetry `{support.name}`",
                          "its mirror image rotates the other way",
                          f"give a spin about {way}, which is symmetric, or model the whole body")  # fmt: skip
    return None


def point_force_warning(support: Declared, load: Declared, bounds: Bounds | None) -> Diagnostic | None:
    """Return a warning for a point force on the symmetry plane `support`, or None.

    The normal component of such a force vanishes, and its other components count half.
    """
    (axis, place), action = support.thing.mirror_plane, load.thing.action
    if bounds is None or not action.points:
        return None
    near = IN_PLANE * max(b - a for a, b in zip(*bounds, strict=True))
    if any(abs(at[axis] - place) > near for _, at in action.points):
        return None
    if action.vector[axis]:
        return diagnostic("E582", load.at("vector"),
                          f"`{load.name}` pulls across the plane of symmetry `{support.name}` that it acts in",
                          f"along {'xyz'[axis]}; its mirror image pulls the other way",
                          "make the force lie in the plane")  # fmt: skip
    return diagnostic("W335", load.at(action.points[0][0]),
                      f"`{load.name}` acts in the plane of symmetry `{support.name}`, so half of it belongs to the "
                      "mirror image",
                      "shared with the mirror image",
                      "give half of the force on the whole body, or ignore this if it is half already")  # fmt: skip


def _tolerance(points: Floats) -> float:
    """Return the distance, m, within which points (m, 3), m, of a body count as in a symmetry plane."""
    return IN_PLANE * float((points.max(axis=0) - points.min(axis=0)).max())


def must_not_act_on_plane(case: Case, acting: Declared, X: Floats, points: Floats) -> None:
    """Refuse a load, an elastic foundation or a drain with a facet on a symmetry plane. Raises Fault.

    X are the nodes (f, k, 3), m, of its facets, `points` (m, 3), m, those of the body. Such a facet is not part of the
    surface of the full body.
    """
    for support in case.supports:
        if (plane := support.thing.mirror_plane) is None or not len(X):
            continue
        axis, place = plane
        if bool((abs(X[..., axis] - place).max(axis=1) <= _tolerance(points)).any()):
            raise Fault(diagnostic("E582", acting.at("where"),
                                   f"`{acting.name}` acts on the plane of symmetry `{support.name}`",
                                   "inside the whole body, not on its surface",
                                   "select only the outer surface, without the plane"))  # fmt: skip


def must_not_act_on_axis(case: Case, acting: Declared, X: Floats, points: Floats, *, partly: bool = False) -> None:
    """Refuse a load, foundation or drain on the axis of a body of revolution, which has no area. Raises Fault.

    X are the nodes (f, k, 3), m, of its facets, `points` (m, 3), m, those of the body. The Fault is raised if all
    facets lie on the axis, or with `partly` if some do: a prescribed value there acts on the body, whereas an integral
    is zero.
    """
    if not case.depth or not len(X):
        return
    axial = abs(X[..., 0]).max(axis=1) <= _tolerance(points)
    if bool(axial.any() if partly else axial.all()):
        raise Fault(diagnostic("E430", acting.at("where"),
                               f"`{acting.name}` acts on the axis of revolution of `{case.body.name}`",
                               "a line inside the body, which has no area",
                               "select a part of the surface away from the axis, as in `x >= 10 mm`"))  # fmt: skip


def refuse_moment_at_plane(case: Case, load: Declared, X: Floats, points: Floats) -> None:
    """Refuse a moment on facets that meet a symmetry plane. Raises Fault.

    X are the nodes (f, k, 3), m, of its facets, `points` (m, 3), m, those of the body. A face that continues beyond the
    plane transmits a force in each half, and no moment about the centre of the half.
    """
    for support in case.supports:
        if (plane := support.thing.mirror_plane) is None:
            continue
        axis, place = plane
        if bool((abs(X[..., axis] - place) <= _tolerance(points)).any()):
            raise Fault(diagnostic("E582", load.at("where"),
                                   f"`{load.name}` twists a face that the plane of symmetry `{support.name}` cuts in "
                                   "half",
                                   "half a face has another moment",
                                   "model the whole body, or load a face that ends before the plane"))  # fmt: skip


def must_lie_in_plane(case: Case, support: Declared, mesh: Mesh, nodes: Ints) -> None:
    """Check that the nodes (n,) of a symmetry support lie in its plane and form facets. Raises Fault.

    The mesh must lie on one side of the plane.
    """
    if (plane := support.thing.mirror_plane) is None:
        return
    points, X = mesh.points, mesh.points[nodes]
    axis, place = plane
    near, beyond = _tolerance(points), points[:, axis] - place
    both = float(beyond.min()) < -near and float(beyond.max()) > near
    if both or float(abs(X[:, axis] - place).max()) > near:
        X = points[:, axis] if both else X[:, axis]
        raise Fault(diagnostic("E582", support.at("where"),
                               f"`{case.body.name}` does not end at the plane of symmetry `{support.name}`",
                               f"it spans {units.format_value(float(X.min()), units.LENGTH)} to "
                               f"{units.format_value(float(X.max()), units.LENGTH)}",
                               "move the body so that it ends at the plane and lies on one side of it"))  # fmt: skip
    held = np.zeros(len(points), dtype=np.bool_)
    held[nodes] = True
    if not held[mesh.facets].all(axis=1).any():
        raise Fault(diagnostic("E582", support.at("where"),
                               f"`{case.body.name}` has no face in the plane of symmetry `{support.name}`",
                               "it touches the plane in a point or a line",
                               "model the half, which joins its mirror image at a face, or use `fixed`"))  # fmt: skip
