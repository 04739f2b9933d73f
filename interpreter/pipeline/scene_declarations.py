"""Declared names of a scene, as listed in its report."""

from __future__ import annotations

from softmark.interpreter.language.compiled_scene import RIGID, Declared, Scene, is_rigid
from softmark.interpreter.language.expectation_conditions import find_metrics
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.results.declarations import DeclaredName, DeclaredNames
from softmark.interpreter.vocabulary.loads.body_force import Gravity

SUMS = ("N", "N*m", "J", "m^2", "m^3")  # quantities that are summed over the modelled part of a symmetric body
PARTS = {1: "half", 2: "quarter", 3: "eighth"}  # by number of symmetry planes


def names_of(scene: Scene) -> DeclaredNames:
    """Return the names that the text of the scene itself declares, without those imported by `use`."""
    own = {name: declared for name, declared in scene.declared.items() if "." not in name}
    pulls = (d.thing.direction for d in own.values() if isinstance(d.thing, Gravity))
    down = next(pulls, DeclaredNames.down)
    return DeclaredNames(
        {name: _make_declared_name(scene, declared) for name, declared in own.items()}, _expected_metrics(scene), down
    )


def _make_declared_name(scene: Scene, declared: Declared) -> DeclaredName:
    thing, body, metric, stiff = declared.thing, None, declared.kind == "metric", is_rigid(declared)
    if "body" in declared.fields:
        body = thing.body
    return DeclaredName(
        RIGID if stiff else declared.kind, declared.constructor.name, declared.location.span.line,
        declared.constructor.summary, body,
        thing.probe_in(scene) if metric else None, thing.measured_from if metric else None,
        _poisson_ratio(scene, thing.material) if declared.kind == "body" and not stiff else None,
        _covered_body_part(scene, declared) if metric else "",
    )  # fmt: skip


def _covered_body_part(scene: Scene, metric: Declared) -> str:
    """Return the part of the body that a summed metric covers: `the quarter of layer that is modelled`.

    The text is "" if the metric covers the whole body.
    """
    thing = metric.thing
    if not isinstance(thing, ForceMetric) or thing.measured_from is not None or thing.natural not in SUMS:
        return ""
    body, everyone = thing.body_in(scene), scene.of_kind("support").items()
    planes = {n: d.thing.mirror_plane for n, d in everyone if d.thing.is_symmetry_plane and d.thing.body == body}
    if not planes or thing.subject_name in planes:
        return ""
    ways = {normal[0] for normal in planes.values() if normal is not None}
    part = PARTS[len(ways)] if len(ways) == len(planes) else "part"
    return f"the {part} of `{body}` that is modelled, by symmetry ({', '.join(f'`{n}`' for n in planes)})"


def _poisson_ratio(scene: Scene, material: object) -> float | None:
    """Return Poisson's ratio of a material, None if the material does not declare it."""
    known = (d for d in scene.of_kind("material").values() if d.thing is material and "poisson" in d.fields)
    return next((float(d.thing.poisson) for d in known if isinstance(d.thing.poisson, float | int)), None)


def _expected_metrics(scene: Scene) -> tuple[str, ...]:
    """Return the names of model metrics in expectations, in order."""
    nodes = (e.node for e in scene.expectations if e.location.source is scene.source)
    names = (name.parts for node in nodes for name in find_metrics(node))
    return tuple(dict.fromkeys(metric for owner, metric in names if owner in scene.of_kind("model")))
