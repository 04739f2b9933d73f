"""Supports of a rod as held degrees of freedom, for validation of a scene and for building."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.rigid_motions import AXES, rigid_motion_rows
from softmark.interpreter.models.shared.support_constraints import Constraints
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import selects_whole_sections
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_state import rod_at_rest, rod_from_frames
from softmark.solvers.mesh.shape import Prism, transverse

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rotating_supports import RotationPath


def points_of(case: Case, stations: Floats) -> Floats:
    """Return the points of the axis (n, 3), m, at stations (n,), m from the root."""
    shape = case.prism
    if isinstance(shape, Prism):
        points: Floats = np.array(shape.root) + stations[:, None] * np.array(shape.axis)
        return points
    return np.array([shape.centre(s) for s in stations.tolist()])


def undeformed_rod(case: Case, stations: Floats) -> Floats:
    """Return the stress-free rod (n * 7,) with nodes at these stations, m; e2 and e3 are the section's axes."""
    shape, points = case.prism, points_of(case, stations)
    if isinstance(shape, Prism):
        return rod_at_rest(points, np.array(transverse(shape.axis)[1]))
    return rod_from_frames(points, np.array([shape.frame(s) for s in stations.tolist()]).transpose(0, 2, 1))


def constrained_dofs(case: Case, stations: Sequence[float]) -> tuple[Ints, Floats, RotationPath | None]:
    """Return held degrees of freedom (c,), their values (c,), m or rad, and the path of rotating supports.

    Raises Fault. The nodes of the rod are at the `stations`, m from the root.
    """
    held = _support_constraints(case, stations, 1.0)
    found, target = held.held_dofs_and_values()
    way = held.turns(found, target, points_of(case, np.array(stations)), 6)
    if way is not None:
        _support_constraints(case, stations, way.early)  # supports must also agree at smaller load fractions
    return found, target, way


def held_values(case: Case, stations: Sequence[float]) -> dict[int, tuple[float, Declared]]:
    """Return, by held degree of freedom, its imposed value, m or rad, and the support that imposes it. Raises Fault."""
    return _support_constraints(case, stations, 1.0).values


def _support_constraints(case: Case, stations: Sequence[float], share: float) -> Constraints:
    """Return the constraints at a fraction `share` of the support motions. Raises Fault.

    Rotations are about the material axes.
    """
    points = points_of(case, np.array(stations))
    held = Constraints(case, case.prism.length, points.mean(axis=0), 6 * len(points))
    axes = np.array([case.prism.axis, *transverse(case.prism.axis)])
    for support in case.supports:
        components = support.thing.components
        turns = _prevented_rotations(case.prism.axis, components)
        for node in np.flatnonzero(selects_whole_sections(support.thing.where, case.prism, tuple(stations))).tolist():
            held.rows.append(rigid_motion_rows(points[node : node + 1] - held.centre, components))
            held.rows.append(np.eye(6)[[3 + t for t in turns]] * case.prism.length)
            moved = support.thing.prescribed_displacements(points[node : node + 1], share)[0].tolist()
            for c in components:
                held.impose(6 * node + c, moved[c], support, points[node], AXES[c])
            for turn in _rotations_about_rod_axes(case.prism.axis, turns):
                angle = share * float(axes[turn] @ np.array(support.thing.rotation))
                held.impose(
                    6 * node + 3 + turn, angle, support, points[node], AXES[int(np.abs(axes[turn]).argmax())], True
                )
    return held


def rotates_free_sections(case: Case, support: Declared) -> bool:
    """Return whether a support prescribes a rotation of sections about an axis about which it does not hold them.

    The displacement components that a support holds determine which rotations it prevents.
    """
    left = set(range(3)) - set(_prevented_rotations(case.prism.axis, support.thing.components))
    return any(abs(support.thing.rotation[t]) > 0.0 for t in left)


def held_dof_masks(case: Case, stations: Sequence[float]) -> dict[str, NDArray[np.bool_]]:
    """Return a mask of the degrees of freedom that each support holds (nodes, 6), by name of the support."""
    found = {}
    for support in case.supports:
        components = support.thing.components
        own = [
            *components,
            *(
                3 + t
                for t in _rotations_about_rod_axes(case.prism.axis, _prevented_rotations(case.prism.axis, components))
            ),
        ]
        where = selects_whole_sections(support.thing.where, case.prism, tuple(stations))
        found[support.name] = np.outer(where, np.isin(np.arange(6), own))
    return found


def _prevented_rotations(axis: tuple[float, float, float], components: tuple[int, ...]) -> list[int]:
    """Return the rotations about x, y, z that a rigid section cannot make if `components` of its points are held.

    A rotation omega moves a point r of the section by omega x r, whose component c is omega . (r x e_c). Holding
    the component c therefore prevents the rotations along r x e_c for every r normal to the axis.
    """
    if len(components) == 3:
        return [0, 1, 2]
    taken = [np.abs(np.cross(r, np.eye(3)[c])) for r in transverse(axis) for c in components]
    return [t for t in range(3) if any(v[t] > 0.5 for v in taken)]


def _rotations_about_rod_axes(axis: tuple[float, float, float], turns: list[int]) -> list[int]:
    """Return rotations about x, y, z as degrees of freedom about the axes e1, e2, e3 of a rod along `axis`."""
    if len(turns) == 3:
        return [0, 1, 2]
    frame = np.array([axis, *transverse(axis)])
    return [int(np.argmax(np.abs(frame[:, t]))) for t in turns]
