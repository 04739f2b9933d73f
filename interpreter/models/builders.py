"""What builds each model: its words know nothing of arrays, and what makes arrays of them is imported when asked for.

To add a model: its words in MODELS, and the module that builds it here, with `load(model)`, which imports what
building needs, and `prepare(model, declared, case, workshop)`, which raises Fault.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from softmark.interpreter.language.plugins import blamed
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.beam.words import Beam6Dof
from softmark.interpreter.models.fem.words import Fem
from softmark.interpreter.models.homogeneous.words import Homogeneous
from softmark.interpreter.models.network.words import Frame6Dof
from softmark.interpreter.models.outside.rods.words import OutsideRod
from softmark.interpreter.models.outside.words import Outside
from softmark.interpreter.models.reduced.words import Modal, Pod
from softmark.interpreter.models.results.words import Results
from softmark.interpreter.models.shared.prepared import Prepared, Workshop
from softmark.interpreter.models.springs.words import MassSpring
from softmark.interpreter.problem.case import Case
from softmark.records import dataclass


@dataclass(frozen=True)
class Builder:
    """What builds a model that is none of ours."""

    load: Callable[[Any], None]
    prepare: Callable[[Any, Declared, Case, Workshop], Prepared]


PREPARED = ("size", "notes", "mesh", "assembly", "points", "forces", "outside", "warm", "after", "solve")

BUILDERS: dict[type[Any], str | Builder] = {
    Fem: "softmark.interpreter.models.fem.build",
    Beam6Dof: "softmark.interpreter.models.beam.build",
    Frame6Dof: "softmark.interpreter.models.network.build",
    Homogeneous: "softmark.interpreter.models.homogeneous.build",
    MassSpring: "softmark.interpreter.models.springs.build",
    Outside: "softmark.interpreter.models.outside.build",
    OutsideRod: "softmark.interpreter.models.outside.rods.build",
    Modal: "softmark.interpreter.models.reduced.equations",
    Pod: "softmark.interpreter.models.reduced.equations",
    Results: "softmark.interpreter.models.results.build",
}

# of bodies whose stress relaxes
REMEMBERING: dict[type[Any], str] = {
    Fem: "softmark.interpreter.models.fem.ageing",
    Beam6Dof: "softmark.interpreter.models.beam.ageing",
    Outside: "softmark.interpreter.models.outside.build",  # which says that it is not
    OutsideRod: "softmark.interpreter.models.outside.rods.build",
}
# of bodies that fluid seeps through
SOAKED: dict[type[Any], str] = {
    Fem: "softmark.interpreter.models.fem.seeping",
    Outside: "softmark.interpreter.models.outside.build",
}


def load(model: Any) -> None:
    """Import what building a model needs, so that no clock counts it. Raises KeyError for what is no model."""
    _builder(model).load(model)


def build(declared: Declared, case: Case, workshop: Workshop) -> Prepared:
    """A model of a scene as arrays, ready to solve; the workshop may build others for it. Raises Fault."""
    workshop.build = build
    builder = _builder(declared.thing)
    if case.remembers:
        known = (SOAKED if case.porous else REMEMBERING).get(type(declared.thing))
        builder = builder if known is None else import_module(known)
    try:
        prepared: Prepared = builder.prepare(declared.thing, declared, case, workshop)
        missing = [n for n in PREPARED if isinstance(builder, Builder) and not hasattr(prepared, n)]
    except Exception as error:
        if (whose := blamed(error)) is None:
            raise
        from softmark.interpreter.models.shared.unbuilt import Unbuilt

        return Unbuilt(whose, "failed")
    if missing:
        from softmark.interpreter.models.shared.unbuilt import Unbuilt

        return Unbuilt(f"what builds it gives a {type(prepared).__name__} without `{missing[0]}`", "failed")
    return prepared


def _builder(model: Any) -> Any:
    known = BUILDERS[type(model)]
    return known if isinstance(known, Builder) else import_module(known)
