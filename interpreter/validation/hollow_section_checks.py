"""Checks of points on the axis of a hollow member, where there is no material.

Beam theories still locate such points by whole sections.
"""

from __future__ import annotations

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.problem.body_case import Fault, body_of

OF_WALLS = "select points of the wall: the axis of a hollow member has no material, and so no stress and strain"
OF_BEAMS = (
    "the axis of a hollow member has no material: {instead}, or use only the beam models `beam6dof(...)` and "
    "`frame6dof(...)`, which accept points on the axis"
)
INSTEAD = {"load": "apply a traction to the end face or to a strip of the wall", "probe": "select points of the wall"}


def axis_point_refusal(scene: Scene, declared: Declared) -> str | None:
    """Return the reason and remedy if a load or probe cannot lie on the axis of a hollow body, or None.

    It can lie there if all models of the body are beams, whose sections move and are loaded as wholes, and if no stress
    is requested.
    """
    if declared.kind == "probe" and any(
        isinstance(metric.thing, TensorMetric) and metric.thing.probe == declared.name
        for metric in scene.of_kind("metric").values()
    ):
        return OF_WALLS
    models = [m for m in scene.of_kind("model").values() if _is_of_body(scene, m, declared.thing.body)]
    if models and all(model.thing.moves_by_sections for model in models):
        return None
    return OF_BEAMS.format(instead=INSTEAD[declared.kind])


def _is_of_body(scene: Scene, model: Declared, body: str) -> bool:
    """Return whether a model represents this body."""
    try:
        return body_of(scene, model) == body
    except Fault:  # reported elsewhere
        return False
