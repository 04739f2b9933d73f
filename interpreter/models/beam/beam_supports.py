"""How supports hold a rod: found when a scene is checked, where that is not plain, and when it is built."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.models.beam.rigid_motions import AXES, point_rows
from softmark.interpreter.models.shared.support_constraints import Held
from softmark.interpreter.problem.axial_selection import whole
from softmark.interpreter.problem.body_case import Case
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.energies.rod_state import rod_at_rest, rod_from_frames
from softmark.solvers.mesh.shape import Prism, transverse

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.rotating_supports import Turns


def points_of(case: Case, stations: Floats) -> Floats:
    """The points of the axis (n, 3), m, at stations (n,), m from the root."""
    shape = case.prism
    if isinstance(shape, Prism):
        points: Floats = np.array(shape.root) + stations[:, None] * np.array(shape.axis)
        return points
    return np.array([shape.centre(s) for s in stations.tolist()])


def at_rest(case: Case, stations: Floats) -> Floats:
    """The rod through them, free of stress (n * 7,): e2 and e3 lie along the two axes of the section."""
    shape, points = case.prism, points_of(case, stations)
    if isinstance(shape, Prism):
        return rod_at_rest(points, np.array(transverse(shape.axis)[1]))
    return rod_from_frames(points, np.array([shape.frame(s) for s in stations.tolist()]).transpose(0, 2, 1))


def fixed(case: Case, stations: Sequence[float]) -> tuple[Ints, Floats, Turns | None]:
    """Held degrees of freedom of a rod with nodes there (c,), their values (c,), m or rad, and how they come there.

    Raises Fault.
    """
    held = _held(case, stations, 1.0)
    found, target = held.finished()
    way = held.turns(found, target, points_of(case, np.array(stations)), 6)
    if way is not None:
        _held(case, stations, way.early)  # on the way there supports must agree too
    return found, target, way


def held_values(case: Case, stations: Sequence[float]) -> dict[int, tuple[float, Declared]]:
    """Of every held degree of freedom what it is moved by, m or rad, and the support that moves it. Raises Fault."""
    return _held(case, stations, 1.0).values


def _held(case: Case, stations: Sequence[float], share: float) -> Held:
    """What supports hold at a share of their motions: rotations about the material axes. Raises Fault."""
    points = points_of(case, np.array(stations))
    held = Held(case, case.prism.length, points.mean(axis=0), 6 * len(points))
    axes = np.array([case.prism.axis, *transverse(case.prism.axis)])
    for support in case.supports:
        components = support.thing.components
        turns = _held_turns(case.prism.axis, components)
        for node in np.flatnonzero(whole(support.thing.where, case.prism, tuple(stations))).tolist():
            held.rows.append(point_rows(points[node : node + 1] - held.centre, components))
            held.rows.append(np.eye(6)[[3 + t for t in turns]] * case.prism.length)
            moved = support.thing.moved(points[node : node + 1], share)[0].tolist()
            for c in components:
                held.impose(6 * node + c, moved[c], support, points[node], AXES[c])
            for turn in _body_axes(case.prism.axis, turns):
                angle = share * float(axes[turn] @ np.array(support.thing.rotation))
                held.impose(
                    6 * node + 3 + turn, angle, support, points[node], AXES[int(np.abs(axes[turn]).argmax())], True
                )
    return held


def turns_free(case: Case, support: Declared) -> bool:
    """Whether a support turns sections about an axis along which their turns are free."""
    left = set(range(3)) - set(_held_turns(case.prism.axis, support.thing.components))
    return any(abs(support.thing.rotation[t]) > 0.0 for t in left)


def held_by(case: Case, stations: Sequence[float]) -> dict[str, NDArray[np.bool_]]:
    """Of every support the degrees of freedom that it holds (nodes, 6), by name."""
    found = {}
    for support in case.supports:
        components = support.thing.components
        own = [*components, *(3 + t for t in _body_axes(case.prism.axis, _held_turns(case.prism.axis, components)))]
        where = whole(support.thing.where, case.prism, tuple(stations))
        found[support.name] = np.outer(where, np.isin(np.arange(6), own))
    return found


def _held_turns(axis: tuple[float, float, float], components: tuple[int, ...]) -> list[int]:
    """Rotations about x, y, z that a rigid section cannot make while `components` of all its points are held.

    A rotation omega moves a point r of the section by omega x r; component c of that is omega . (r x e_c), so holding c
    takes away the rotations along r x e_c for every r across the axis.
    """
    if len(components) == 3:
        return [0, 1, 2]
    taken = [np.abs(np.cross(r, np.eye(3)[c])) for r in transverse(axis) for c in components]
    return [t for t in range(3) if any(v[t] > 0.5 for v in taken)]


def _body_axes(axis: tuple[float, float, float], turns: list[int]) -> list[int]:
    """The same rotations as degrees of freedom, which are about the rod's own axes e1, e2, e3."""
    if len(turns) == 3:
        return [0, 1, 2]
    frame = np.array([axis, *transverse(axis)])
    return [int(np.argmax(np.abs(frame[:, t]))) for t in turns]
