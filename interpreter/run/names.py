"""What a report says of the names of a scene."""

from __future__ import annotations

from softmark.interpreter.language.expectations import metrics_in
from softmark.interpreter.language.scene import RIGID, Declared, Scene, rigid
from softmark.interpreter.results.names import Named, Names
from softmark.interpreter.vocabulary.loads import Gravity


def names_of(scene: Scene) -> Names:
    """Those that the scene's own text declares, not those from `use`."""
    own = {name: declared for name, declared in scene.declared.items() if "." not in name}
    pulls = (d.thing.direction for d in own.values() if isinstance(d.thing, Gravity))
    down = next(pulls, Names.down)
    return Names({name: _named(scene, declared) for name, declared in own.items()}, _expected(scene), down)


def _named(scene: Scene, declared: Declared) -> Named:
    thing, body, metric, stiff = declared.thing, None, declared.kind == "metric", rigid(declared)
    if "body" in declared.fields:
        body = thing.body
    return Named(
        RIGID if stiff else declared.kind, declared.constructor.name, declared.location.span.line,
        declared.constructor.summary, body,
        thing.probe_in(scene) if metric else None, thing.measured_from if metric else None,
        _poisson(scene, thing.material) if declared.kind == "body" and not stiff else None,
    )  # fmt: skip


def _poisson(scene: Scene, material: object) -> float | None:
    """Poisson's ratio of a material that is declared with one."""
    known = (d for d in scene.of_kind("material").values() if d.thing is material and "poisson" in d.fields)
    return next((float(d.thing.poisson) for d in known if isinstance(d.thing.poisson, float | int)), None)


def _expected(scene: Scene) -> tuple[str, ...]:
    """Metrics that expectations ask for of models."""
    nodes = (e.node for e in scene.expectations if e.location.source is scene.source)
    names = (name.parts for node in nodes for name in metrics_in(node))
    return tuple(dict.fromkeys(metric for owner, metric in names if owner in scene.of_kind("model")))
