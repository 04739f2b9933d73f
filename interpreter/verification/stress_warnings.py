"""Warnings about unresolved stress, where adjacent cells disagree; they need no further solution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.metric_base import DisplacementMetric
from softmark.interpreter.metrics.metric_evaluation import collect_metric_input, measure_metric
from softmark.interpreter.metrics.probe_samples import ProbePlace
from softmark.interpreter.metrics.tensor_metrics import TensorMetric, stress_field_of
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.models.shared.prepared_model import Prepared
from softmark.interpreter.problem.solution import View

if TYPE_CHECKING:
    from softmark.interpreter.verification.surface_traction_check import TractionMismatch
    from softmark.solvers.mesh.mesh import Mesh

MIXED = 0.05  # relative to a cell: that much of another material is no matter of how sides are bent
APART = 0.25  # of the recovered stress, in the mean square over the cells around: the mesh does not show what is there

# What a tolerance leaves of stresses that cancel, as in free muscle that has grown shorter: of modulus times strain.
CANCELLED = 1e-8


def asks_for_stress(scene: Scene) -> bool:
    """Return whether a scene has metrics of stress or strain."""
    return any(isinstance(m.thing, TensorMetric) for m in scene.of_kind("metric").values())


def stress_warnings(scene: Scene, view: View, prepared: Prepared) -> tuple[Diagnostic, ...]:
    """Return warnings about stress and strain metrics that are singular, or at which adjacent cells disagree."""
    asked = [m for m in scene.of_kind("metric").values() if isinstance(m.thing, TensorMetric)]
    found = [d for metric in asked for d in _metric_warnings(metric, view, prepared, scene.declared[view.name].thing)]
    if any(load.thing.action.points for load in view.case.loads):
        found += _unbounded_displacement_warnings(scene, view, prepared)
    if view.case.contacts:
        found += _singular_pressure_warnings(scene, view)
    return tuple(found)


def _singular_pressure_warnings(scene: Scene, view: View) -> Iterator[Diagnostic]:
    """Yield warnings about contact pressures at sharp edges and tips."""
    from softmark.interpreter.verification.contact_singularities import singular_pressure

    for metric in scene.of_kind("metric").values():
        seen = view.probes.get(metric.thing.probe_name or "")
        if place := singular_pressure(
            metric.thing, view.case, view.at_rest, np.zeros((0, 3)) if seen is None else seen.points
        ):
            yield diagnostic(
                "W388",
                metric.at("probe" if seen is not None else ""),
                f"`{metric.name}` is evaluated at {place}, where the pressure is singular: its value "
                "depends on the mesh",
                "singular pressure",
                "the value grows with every mesh refinement: evaluate it a cell or more away, or use a rounded shape",
            )


def _unbounded_displacement_warnings(scene: Scene, view: View, prepared: Prepared) -> Iterator[Diagnostic]:
    """Yield warnings about displacements of a solid under a point or line force."""
    from softmark.interpreter.verification.stress_singularities import load_of_unbounded_displacement, place_of

    for metric in scene.of_kind("metric").values():
        seen = view.probes.get(metric.thing.probe_name or "")
        if not isinstance(metric.thing, DisplacementMetric) or metric.thing.statistic_name != "max" or seen is None:
            continue
        last = slice(-1 if metric.thing.last else 0, None)
        if seen.displacement is None:
            continue
        if load := load_of_unbounded_displacement(view.case, prepared.mesh, seen.points[last], seen.displacement[last]):
            line = load.thing.action.length is not None or view.case.planar
            grows = "like the logarithm of 1/h" if line else "like 1/h"
            yield diagnostic(
                "W384",
                metric.at("probe"),
                f"`{metric.name}` is evaluated at {place_of(load)}, where the displacement of a solid "
                "is singular: its value depends on the mesh",
                "singular displacement",
                f"with the cell size h, the value grows {grows}: evaluate it a cell or more away, "
                f"or use a traction on a {'strip' if line else 'patch'}",
            )


def _beam_end_warnings(metric: Declared, view: View, thing: Any) -> Iterator[Diagnostic]:
    """Yield warnings about beam sections near supports, where they cannot warp or contract."""
    from softmark.interpreter.models.beam.end_effect_zones import nearby_disturbance

    if place := nearby_disturbance(view.case, thing, view.probes[metric.thing.probe].points):
        yield diagnostic(
            "W356", metric.at("probe"),
            f"`{metric.name}` is evaluated in `{view.name}` within one section width of {place}, where beam "
            "theory is inaccurate",
            "warping and contraction are restrained",
            "the value is valid only far from supports, forces and joints: use `fem(...)` for local "
            "effects",
        )  # fmt: skip


def _region_border_warnings(metric: Declared, view: View, mesh: Mesh) -> Iterator[Diagnostic]:
    """Yield warnings about points in or next to cells that a region border crosses.

    Such cells have the wrong material, although adjacent cells may agree.
    """
    from softmark.interpreter.models.shared.region_cells import materials_of_cells
    from softmark.solvers.mesh.element_interpolation import locate_points

    own = materials_of_cells(view.case, mesh)
    mixed = np.take_along_axis(own.shares, own.cells[None], axis=0)[0] < 1.0 - MIXED
    if not mixed.any():
        return
    touched = np.zeros(len(mesh.points), dtype=np.bool_)
    touched[mesh.cells[mixed]] = True
    there = locate_points(mesh, view.probes[metric.thing.probe].points).nodes
    if many := int(touched[there].any(axis=1).sum()):
        yield diagnostic(
            "W357",
            metric.at("probe"),
            f"{many} of {len(there)} points of `{metric.name}` in `{view.name}` lie in or next to cells "
            "crossed by a material border",
            "stress jumps inside cells",
            "each cell has one material, so stress is inaccurate there: use a mesh with nodes along the "
            "border, or evaluate the stress two cells or more away",
        )


def place_of_metric(metric: TensorMetric, view: View) -> ProbePlace:
    """Return the probe of a metric in the view of a model."""
    probe, name = view.probes[metric.probe], metric.probe
    return ProbePlace(probe.points, probe.triangles, view.weights.get(name), view.domains.get(name))


def _describe_sides(metric: TensorMetric, details: Mapping[str, Any]) -> str:
    """Return as text how a metric combines the two values at points on an interface."""
    if metric.over == "mean":
        return "the mean takes half of each side there: move the probe to one side of the interface"
    values = next((value for name, value in details.items() if name.startswith("sides_")), None)
    if values is None:
        return "both sides are evaluated there, but the largest value lies elsewhere"
    dimension = units.PRESSURE if metric.natural == "Pa" else units.NONE
    shown = " and ".join(units.format_value(value, dimension) for value in values)
    return f"the two sides have {shown}, and the value is the largest: move the probe to one side of the interface"


def _traction_warnings(metric: Declared, view: View, value: float) -> Iterator[Diagnostic]:
    """Yield a warning if the stress at the surface contradicts the applied traction."""
    found = mismatch_of(metric.thing, view)
    if found is None or view.stress is None:
        return
    stress = stress_field_of(view.stress)
    cancelled = CANCELLED * view.case.least_young * stress.usual[1]
    if found.error <= max(APART * max(abs(value), metric.thing.usual(stress)), cancelled):
        return
    names = " and ".join(f"`{name}`" for name in found.loads)
    acts = f"{names} apply" if len(found.loads) > 1 else f"{names} applies" if names else "the free surface has"
    way = "normal" if found.along else "shear"
    at, own, applied = units.format_vector(found.at.tolist(), units.LENGTH), *(
        units.format_value(t, units.PRESSURE) for t in (found.found, found.applied)
    )  # fmt: skip
    yield diagnostic(
        "W405",
        metric.at("probe"),
        f"`{metric.name}` is evaluated at {at}, where the {way} traction of the stress in `{view.name}` "
        f"is {own}, but {acts} {applied}",
        "surface traction not satisfied",
        "the cells are too coarse for the loaded area: use cells of at most a third of its size",
    )


def mismatch_of(metric: TensorMetric, view: View) -> TractionMismatch | None:
    """Return the mismatch between a model's surface stress and the applied traction at a metric's probe, or None."""
    from softmark.interpreter.verification.surface_traction_check import mismatch  # which beams have no need of

    try:
        return mismatch(metric, view.case, place_of_metric(metric, view), stress_field_of(view.stress), view.at_rest)
    except Undefined:
        return None


def _metric_warnings(metric: Declared, view: View, prepared: Prepared, thing: Any) -> Iterator[Diagnostic]:
    if view.message is not None or metric.thing.probe not in view.probes:
        return
    from softmark.interpreter.verification.stress_singularities import singular_stress

    if prepared.mesh is None and view.stress is not None:
        if not (thing.homogeneous_strain or isinstance(thing.stress_law, str)):
            yield from _beam_end_warnings(metric, view, thing)
        return
    place = singular_stress(
        metric.thing, view.case, prepared.mesh, place_of_metric(metric.thing, view).evaluation_points(metric.thing.over)
    )
    if place and view.stress is not None:
        yield diagnostic(
            "W388",
            metric.at("probe"),
            f"`{metric.name}` is evaluated at {place}, where the stress is singular: its value depends on the mesh",
            "singular stress",
            "the value grows with every mesh refinement: evaluate a part that ends a cell or more away, "
            "or use the mean",
        )
        return
    try:
        alone = replace(metric.thing, against=None)
        measured = measure_metric(alone, collect_metric_input(alone, view, {}))
    except Undefined:
        return
    details = measured.details
    if metric.thing.measured_from is None:
        yield from _traction_warnings(metric, view, measured.value)
    if metric.thing.over == "mean" and not details["where_materials_meet"]:
        return
    crossed = (
        tuple(_region_border_warnings(metric, view, prepared.mesh))
        if view.case.parts and prepared.mesh is not None
        else ()
    )
    yield from crossed
    if not crossed and (many := details["where_materials_meet"]):
        yield diagnostic(
            "W345",
            metric.at("probe"),
            f"{many} of {details['points']} points of `{metric.name}` in `{view.name}` lie on the "
            "interface between regions",
            "stress jumps across the interface",
            _describe_sides(metric.thing, details),
        )
    if metric.thing.over == "mean":
        return
    apart = details["cells_apart_1"]
    if not apart > APART:
        return
    place = units.format_vector(details["at_m"], units.LENGTH)
    yield diagnostic(
        "W387",
        metric.at(),
        f"the {metric.thing.decisive_tensor_part} of neighbouring cells of `{view.name}` differs by "
        f"{100 * apart:.0f} % at {place}, where `{metric.name}` is evaluated",
        "not resolved by the mesh",
        "refine the mesh there; at a re-entrant corner stress is singular, and `--stated` reports whether it converges",
    )
