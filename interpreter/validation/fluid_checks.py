"""Checks of pore fluid: fluid metrics without a porous body, and porous bodies without drainage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene, is_rigid
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.pore_pressure import Outflow, PorePressure
from softmark.interpreter.problem.body_case import describe_extent, porous

REMEDY = "use the material `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`"


def metrics(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of fluid metrics.

    These are the outflow through a support that does not drain, other metrics of a support that only drains, and a pore
    pressure without a porous body.
    """
    for metric in scene.of_kind("metric").values():
        thing: Any = metric.thing
        support = scene.declared.get(metric.value("of") or "")
        drain = support is not None and support.kind == "support" and support.thing.role == "drain"
        if isinstance(thing, Outflow) and not drain:
            yield diagnostic(
                "E228",
                metric.at("of"),
                f"no fluid flows through `{thing.of}`",
                "supports the solid, not the fluid",
                "name a support `drained(...)` or `pore_pressure(...)`",
            )
        elif drain and not isinstance(thing, Outflow):
            yield diagnostic(
                "E228",
                metric.at("of"),
                f"`{thing.of}` prescribes the pore pressure and holds no point of the body",
                "has no force",
                "use `outflow(...)` for it, or `force(...)` of a support of the body",
            )
        elif isinstance(thing, PorePressure):
            yield from _check_pressure(scene, metric)


def _check_pressure(scene: Scene, metric: Declared) -> Iterator[Diagnostic]:
    """Check that a pore pressure metric refers to a porous body and to a point inside it."""
    body = scene.declared[metric.thing.body]
    if is_rigid(body) or not porous(body.thing.material):
        yield diagnostic("E228", metric.at("body"), f"`{body.name}` contains no fluid", "no fluid", REMEDY)
    elif not body.thing.shape.fault and not body.thing.shape.contains(metric.thing.at):
        spans = "" if body.thing.shape.bounds is None else f"the body spans {describe_extent(*body.thing.shape.bounds)}"
        yield diagnostic("E504", metric.at("at"), f"`{metric.name}` is evaluated at "
                                                  f"{units.format_vector(metric.thing.at, units.LENGTH)}, outside "
                                                  f"`{body.name}`",
                         "outside the body", spans)  # fmt: skip
