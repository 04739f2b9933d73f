"""Checks of contacts in dynamic analyses, and of contact metrics over time."""

from __future__ import annotations

from collections.abc import Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.metrics.metric_base import ForceMetric
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.interpreter.vocabulary.self_contact_words import SelfContact


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors about contacts in dynamic analyses, such as explicit steps, which detect contact too late."""
    contacts = list(scene.of_kind("contact").values())
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    if not contacts or analysis is None or not isinstance(analysis.thing, Dynamic):
        return
    if analysis.thing.explicit:
        yield diagnostic(
            "E680",
            analysis.at("integrator"),
            f"the integrator `{analysis.thing.integrator}` cannot handle the contact `{contacts[0].name}`",
            "explicit integrator",
            "use `generalized_alpha`, `trapezoidal`, `midpoint`, `bdf2` or `implicit_euler`: explicit steps find "
            "contact only after penetration",
        )


def metric_faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of force metrics over time in a static analysis, and of static force metrics in a dynamic one."""
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    moving = analysis is not None and isinstance(analysis.thing, Dynamic)
    for metric in scene.of_kind("metric").values():
        if not (isinstance(metric.thing, ForceMetric) and metric.thing.followed):
            continue
        if not moving and metric.thing.when != "end":
            yield diagnostic(
                "E634",
                metric.at("over"),
                f"`{metric.name}` is the {metric.thing.when} value over time, but the analysis is not dynamic",
                "a static analysis has no time",
                "remove `over`: a static analysis has one value, or one for each state, such as `.at(50 %)`; "
                "or use a dynamic analysis, `dynamic(...)`",
            )
        elif moving and not isinstance(
            scene.declared[named := metric.thing.subject_name or ""].thing, RigidContactPair | SelfContact
        ):
            yield diagnostic(
                "E635",
                metric.at(),
                f"`{metric.name}` is available only in a static analysis, but the analysis is dynamic",
                f"{metric.constructor.name} of `{named}`, not a contact",
                "use a contact metric, `force(CONTACT, along = +z)`, or a displacement; every report has the "
                "energies over time",
            )
