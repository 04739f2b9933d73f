"""Checks of spring and beam networks: unsuitable models, theories of a single beam, and metrics inside a solid."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.volume_change import VolumeChange
from softmark.interpreter.vocabulary.body_words import BeamNetwork
from softmark.interpreter.vocabulary.probe_words import Line, Markers, Point, Surface

if TYPE_CHECKING:
    from collections.abc import Iterator

    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case


def reference(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield the error of a theory that does not apply to a network."""
    yield diagnostic("E344", declared.at(), f"`{declared.name}` does not apply to `{case.body.name}`, a network of "
                                            "beams", "not for networks",
                     "use `frame_theory(...)`, closed forms in `expect` lines, or a `curve(...)`")  # fmt: skip


def check_metrics_and_probes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of metrics and probes that networks do not support."""
    for probe in scene.of_kind("probe").values():
        body = scene.declared.get(probe.value("body") or "")
        if body is None or not isinstance(body.thing, BeamNetwork):
            continue
        part = isinstance(probe.thing, Surface) and probe.thing.where is not None
        if part or not isinstance(probe.thing, Point | Line | Surface | Markers):
            where = "a part of the surface of" if part else "the interior of"
            yield diagnostic("E346", probe.at(), f"`{probe.name}` needs {where} `{body.name}`, a network of beams",
                             "not for networks", "use points, lines or the whole surface")  # fmt: skip
    for metric in scene.of_kind("metric").values():
        body = scene.declared.get(metric.thing.body_in(scene) or "")
        if isinstance(metric.thing, VolumeChange) and body is not None and isinstance(body.thing, BeamNetwork):
            yield diagnostic(
                "E346",
                metric.at(),
                f"`{metric.name}` does not apply to `{body.name}`, a network of beams",
                "not for networks",
                "remove this metric: members overlap at joints, and their rigid sections keep their area",
            )
