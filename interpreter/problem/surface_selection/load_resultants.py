"""Resultants of the loads on a model (force, moment and area), compared with the loads of the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.surface_selection.exact_surface import limit_of_facet_area, select_surface, volume
from softmark.interpreter.problem.surface_selection.facet_patches import Floats
from softmark.interpreter.problem.surface_selection.loaded_surface_part import LoadedSurface
from softmark.interpreter.results.load_results import Resultant, Vector, to_vector
from softmark.interpreter.vocabulary.loads.load import Action
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.records import dataclass
from softmark.solvers.elements import WORDS, find_element
from softmark.solvers.mesh.boolean_shapes import BooleanShape

SHOWN = 1e-3  # relative load error below which no warning is given
CURVED = "use a smaller size, or tet10, whose facets are curved"
NEARER = "use a smaller size: its curved facets meet the surface at their nodes only"  # of tet10 and the like
FLATTER = "use a smaller size, or smaller `facets`: between their corners they are flat, for elements of any order"


class BuiltModel(Protocol):
    """Protocol of a built model whose loads are summed; models/shared/prepared_model.py fulfils it."""

    @property
    def mesh(self) -> Any:
        """Mesh of the model, or None."""

    @property
    def points(self) -> Floats:
        """Undeformed points at which the loads of the model act (n, 3), m."""

    def forces(self) -> Sequence[tuple[Declared, Floats]]:
        """Return each load with its forces at `points` (n, 3), N; for a beam with moments (n, 6), N and N m."""


def resultants(case: Case, prepared: BuiltModel) -> dict[str, Resultant]:
    """Return the resultant of every load of a built model, by name."""
    mesh, points = prepared.mesh, prepared.points
    return {load.name: _resultant(case, load, mesh, points, f) for load, f in prepared.forces()}


def largest_load_error(found: Mapping[str, Resultant]) -> float | None:
    """Return the largest relative error of a surface load; None without surface loads."""
    return max((r.missing for r in found.values() if r.area is not None), default=None)


def _resultant(case: Case, load: Declared, mesh: Any, points: Floats, f: Floats) -> Resultant:
    if case.depth:
        return _revolved_resultant(case, load, mesh, f)
    forces, turns = f[:, :3], f[:, 3:]  # a beam's nodes take moments too
    force, moment = to_vector(forces.sum(axis=0)), to_vector(np.cross(points, forces).sum(axis=0) + _sum_moments(turns))
    action = load.thing.action
    if action.points:
        return _resultant_at_points(action, force, moment)
    if action.balanced:
        return Resultant(force, moment, None, (0.0, 0.0, 0.0), 1.0, exact_moment=(0.0, 0.0, 0.0))
    known: LoadedSurface | None = None if mesh is None else mesh.selections.get(action.surface)
    exact, area = action.exact_resultant(ExactCaseBody(case))
    if (given := action.moment_vector) is not None:
        return _moment_resultant(given, force, moment, known, area)
    if known is None and isinstance(action, SurfaceTraction) and area:  # acts on the end of a beam
        taken = float(np.linalg.norm(force)) / (float(np.linalg.norm(action.traction)) or 1.0)
        return Resultant(force, moment, taken, exact, taken / area if taken else 1.0)
    if known is None:
        return Resultant(force, moment, None, exact, 1.0 if exact is None else _force_ratio(force, exact))
    area = area or _converged_facet_area(case, action.surface, mesh)
    share = known.area / area if area else 1.0
    return Resultant(force, moment, known.area, exact, share, known.remainder, known.leaning)


def _converged_facet_area(case: Case, where: Condition, mesh: Any) -> float | None:
    """Return the limit of the facet area under refinement, m^2, for a combined body with parts known only by facets."""
    made = getattr(mesh, "filling", None)
    return (
        limit_of_facet_area(case.shape, where, made.size)
        if made is not None and isinstance(case.shape, BooleanShape)
        else None
    )


def _revolved_resultant(case: Case, load: Declared, mesh: Any, f: Floats) -> Resultant:
    """Return the resultant of forces f (n, 3), N, on whole rings of a body of revolution.

    Only its axial component is not zero, because the others cancel around the axis.
    """
    force, none = (0.0, float(f[:, 1].sum()), 0.0), (0.0, 0.0, 0.0)
    known: LoadedSurface | None = mesh.selections.get(load.thing.action.surface)
    if known is None:
        return Resultant(force, none, None, None, 1.0)
    area = known.area_with_depth(case.depth)
    wider = area / known.area
    return Resultant(force, none, area, None, 1.0, wider * known.remainder, wider * known.leaning)


def _resultant_at_points(action: Action, force: Vector, moment: Vector) -> Resultant:
    """Return the resultant of a point or line load, exact up to rounding on a mesh that contains its points."""
    length = action.length
    at = np.mean([point for _, point in action.points], axis=0)
    exact = (1.0 if length is None else length) * np.array(action.vector)
    share, turn = _force_ratio(force, to_vector(exact)), to_vector(np.cross(at, exact))
    return Resultant(force, moment, None, to_vector(exact), share, exact_moment=turn, length=length)


def _moment_resultant(
    given: Vector, force: Vector, moment: Vector, known: LoadedSurface | None, area: float | None
) -> Resultant:
    """Return the resultant of a moment load, for a solid with the area on which it acts, m^2."""
    nothing = (0.0, 0.0, 0.0)
    if known is None:
        return Resultant(force, moment, area, nothing, _force_ratio(moment, given), exact_moment=given)
    share = known.area / area if area else 1.0
    return Resultant(force, moment, known.area, nothing if area else None, share, known.remainder, known.leaning,
                     exact_moment=given)  # fmt: skip


def _sum_moments(turns: Floats) -> Floats:
    """Return the sum (3,), N m, of moments at nodes (n, 3); zero if there are none (n, 0)."""
    found: Floats = turns.sum(axis=0) if turns.shape[1] else np.zeros(3)
    return found


@dataclass(frozen=True)
class ExactCaseBody:
    """The body of a case, without a mesh, on which a load finds its exact resultant."""

    case: Case

    def mass(self) -> float | None:
        """Return the mass of a homogeneous body, kg; None if its volume is not known, or its material varies."""
        case = self.case
        if case.parts or not case.uniform or (known := volume(case.shape)) is None:
            return None
        mass: float = case.material.density * known
        return mass

    def area(self, where: Condition) -> tuple[float, Vector] | None:
        """Return the selected area, m^2, and its area vector, m^2; None if they are not known."""
        found = select_surface(self.case.shape, where)
        return None if found is None else (found[0], to_vector(found[1]))


def _force_ratio(force: Vector, exact: Vector) -> float:
    """Return the component of a force along the exact one, relative to its size; 1 if the exact one is zero."""
    size = float(np.dot(exact, exact))
    return float(np.dot(force, exact)) / size if size else 1.0


def _remedy(case: Case, declared: Declared) -> str:
    """Return a remedy that brings the facets of a model closer to the curved surface of its body."""
    if case.shape.enclosed:
        return FLATTER
    element = getattr(declared.thing, "element", "")
    return NEARER if element in WORDS and find_element(element).order > 1 else CURVED


def load_mismatch_warnings(case: Case, declared: Declared, found: Mapping[str, Resultant]) -> tuple[Diagnostic, ...]:
    """Return a warning for each surface load whose resultant on the mesh differs from that of the scene."""
    notes, at = [], declared.at("size") if "size" in declared.fields else declared.at()
    for name, r in found.items():
        if r.area is None:
            continue
        if abs(1.0 - r.share) > SHOWN and r.remainder <= SHOWN * r.area:
            notes.append(diagnostic(
                "W371", at,
                f"in `{declared.name}`, `{name}` acts on {100 * r.share:.4g} % of the surface of "
                f"`{case.body.name}` that it selects",
                "facets approximate the curved surface",
                f"{_remedy(case, declared)}; the report lists this force and the exact one",
            ))  # fmt: skip
        if r.remainder > SHOWN * r.area:
            notes.append(diagnostic(
                "W372", at,
                f"the area that `{name}` acts on in `{declared.name}` is uncertain by "
                f"{min(100.0, 100 * r.remainder / r.area):.3g} %",
                "the border of the selection was not resolved everywhere",
                "select by another coordinate: a border that runs along the surface does not define where it cuts "
                "the surface",
            ))  # fmt: skip
    return tuple(notes)
