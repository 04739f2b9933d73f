"""Warnings about meshes in contact with rigid bodies: partly selected facets, and facets that penetrate.

A facet takes part in contact as a whole, even if `where` selects only a part of it. The force on such facets may be
wrong by that part, which is included in the stated error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.coordinate_conditions import EVERYWHERE
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.number_formatting import round_significant
from softmark.interpreter.metrics.contact import ContactArea, ContactPressure
from softmark.interpreter.metrics.pressure_along import PressureAlong
from softmark.interpreter.models.shared.rigid_contact_setup import longest_triangle_side
from softmark.interpreter.problem.surface_selection.loaded_surface_part import find_loaded_surface
from softmark.interpreter.verification.contact_error import force_excess
from softmark.solvers.contact.signed_distance import gap_of

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.metrics.metric_base import Metric
    from softmark.interpreter.problem.body_case import Case, RigidBodyContact
    from softmark.interpreter.results.reaction_results import EquilibriumForces
    from softmark.interpreter.verification.probe_errors import ProbeResultUnderTest
    from softmark.interpreter.verification.solution_under_test import SolutionUnderTest
    from softmark.solvers.mesh.mesh import Mesh

NOTHING = 1e-6  # relative to the body size
WIDE = 0.05  # relative to the displacement: such a gap changes forces by a tenth, other results by more
DEEP = 0.25  # relative to the displacement or the least radius of the rigid body: limit of penetration


def selected_area_ratios(case: Case, mesh: Mesh | None) -> dict[str, float]:
    """Return the ratio of contact facet area to selected area for each contact for which both areas are known."""
    found = {touch.name: _selected_area_ratio(case, touch, mesh) for touch in case.contacts if mesh is not None}
    return {name: share for name, share in found.items() if share is not None}


def _selected_area_ratio(case: Case, touch: RigidBodyContact, mesh: Mesh) -> float | None:
    where = touch.thing.where
    if where == EVERYWHERE:
        return None
    from softmark.interpreter.problem.surface_selection.exact_surface import select_surface
    from softmark.interpreter.problem.surface_selection.region_outline import selected_edge_area

    known = None if case.planar else select_surface(case.shape, where)
    exact = selected_edge_area(case.shape, where, case.depth) if case.planar else known and known[0]
    own = find_loaded_surface(case.shape, mesh, where)
    taken = np.unique(own.selected_facets, axis=0)
    sides = find_loaded_surface(case.shape, mesh, EVERYWHERE)
    return sides.of_facets(taken).area_with_depth(case.depth) / exact if exact else None


def selection_errors(whole: SolutionUnderTest) -> dict[str, Callable[[ProbeResultUnderTest], float]]:
    """Return the error part due to partly selected contact facets, as {part name: function of a probe result}.

    It is empty if all contact facets are selected wholly.
    """
    mesh = whole.prepared.mesh
    if mesh is None:
        return {}
    cut = {
        t.name: np.unique(find_loaded_surface(whole.case.shape, mesh, t.thing.where).nodes) for t in whole.case.contacts
    }
    if not any(len(nodes) for nodes in cut.values()):
        return {}
    return {
        "touching": lambda seen: max(_force_share(seen.at_rest, name, own) for name, own in cut.items()) * seen.size
    }


def _force_share(rest: EquilibriumForces | None, name: str, nodes: Any) -> float:
    """Return the fraction of a contact's nodal forces that acts on the given nodes."""
    field: Any = None if rest is None or name not in rest.touches else rest.touches[name].field
    if field is None:
        return 0.0
    f = np.maximum(field.pressing.f, 0.0)
    return float(f[nodes].sum() / total) if (total := float(f.sum())) > 0.0 else 0.0


def penetration_warnings(
    declared: Declared, case: Case, rest: EquilibriumForces, mesh: Mesh | None, facts: Mapping[str, Any]
) -> Iterator[Diagnostic]:
    """Yield a warning for each contact whose facets penetrate so deep that they do not follow the rigid body."""
    checks = (facts.get("checks") or {}).get("contact") or {}
    for touch in case.contacts:
        gap, deep = gap_of(touch.rigid.thing.shape), (checks.get(touch.name) or {}).get("overlap") or 0.0
        sharpest = np.inf if gap is None else gap.least_curvature_radius
        most = max(DEEP * min(rest.moved, sharpest or np.inf), NOTHING * rest.extent)
        if mesh is not None and rest.reason is None and deep > most:
            yield diagnostic(
                "W659",
                declared.at("size"),
                f"facets of `{declared.name}` penetrate `{touch.rigid.name}` by "
                f"{units.format_value(round_significant(deep, 2), units.LENGTH)} between their nodes",
                "too coarse for the rigid body",
                _cell_size_remedy(case, touch, mesh, sharpest, deep / most),
            )


def _cell_size_remedy(case: Case, touch: RigidBodyContact, mesh: Mesh, sharpest: float, times: float) -> str:
    """Return a remedy that names a cell size, for facets that penetrate `times` deeper than allowed.

    `sharpest` is the least radius of the rigid body, m. A chord of length h penetrates a round body by h^2 / (8 r), and
    a sharp edge by a fraction of h.
    """
    if 0.0 < sharpest < _longest_side(case, touch, mesh):
        return (
            "use cells no larger than the smallest radius of the rigid body: with the present ones it may "
            "have passed between the nodes"
        )
    if not sharpest:
        ratio = f"{round_significant(times, 2):g}"
        return (
            f"use cells about {ratio} times smaller: next to a sharp edge the penetration is proportional "
            "to the cell size"
        )
    finer = (
        f"{round_significant(times**0.5, 2):g} times smaller: the penetration is proportional to the "
        "square of the cell size"
    )
    radius = units.format_value(round_significant(sharpest, 2), units.LENGTH)
    least = f"the cells are already no larger than the smallest radius, {radius}; "
    return f"{least if np.isfinite(sharpest) else ''}use cells about {finer}"


def _longest_side(case: Case, touch: RigidBodyContact, mesh: Mesh) -> float:
    """Return the longest side of contact facets, m; for a slice of a plane body only sides in its plane."""
    points = mesh.points * (1.0, 1.0, 0.0) if case.planar else mesh.points
    return longest_triangle_side(points, find_loaded_surface(case.shape, mesh, touch.thing.where).selected_facets)


def contradiction_warnings(
    declared: Declared, rest: EquilibriumForces, metrics: Iterable[Metric]
) -> Iterator[Diagnostic]:
    """Yield a warning for each contact whose force exceeds the requested area times the largest pressure."""
    asked = {metric.of for metric in metrics if isinstance(metric, ContactArea | ContactPressure | PressureAlong)}
    for name in sorted(asked & set(rest.touches)):
        touch = rest.touches[name]
        if (times := force_excess(touch)) is not None:
            area = units.format_value(round_significant(touch.area, 3), units.AREA)
            most = units.format_value(round_significant(touch.pressure, 3), units.PRESSURE)
            yield diagnostic(
                "W660",
                declared.at("size"),
                f"the contact force of `{name}` is {round_significant(times, 2):g} times the product of "
                f"its area, {area}, and its largest pressure, {most}, in `{declared.name}`",
                "too coarse for area and pressure",
                "use smaller cells, so that several of them are in contact: the force is inaccurate "
                "too, though less so",
            )


def gap_warnings(declared: Declared, case: Case, rest: EquilibriumForces) -> Iterator[Diagnostic]:
    """Yield a warning for each contact whose barrier leaves a gap that is too wide."""
    for contact in (*(touch.declared for touch in case.contacts), *case.pairs):
        touch = rest.touches.get(contact.name)
        if touch is None or rest.reason is not None:
            continue
        if touch.left > WIDE * rest.moved > 0.0:
            left, moved = (
                units.format_value(round_significant(own, 2), units.LENGTH) for own in (touch.left, rest.moved)
            )
            yield diagnostic(
                "W661",
                contact.at("distance" if "distance" in contact.fields else ""),
                f"the barrier of `{contact.name}` leaves a gap of {left}, while `{declared.name}` moves "
                f"by only {moved}",
                "wide contact gap",
                "the rigid body or other surface acts as if it were larger by this gap: "
                + (
                    "write a smaller `distance`, or remove `distance`"
                    if "distance" in contact.fields
                    else "add a `distance` smaller than this gap"
                ),
            )
