"""Checks of friction: loads applied in a single step, and friction metrics of frictionless contacts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import in_state, states_of
from softmark.interpreter.metrics.slip import FrictionMetric
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.contact_words import RigidContactPair
from softmark.references.measured_data import Unreadable

STEP = math.radians(15.0)  # largest rotation per state: slip follows its sine, which is 1.1 % less
NEAR = 1e-9  # relative tolerance


def faults(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of friction metrics without friction, and warnings if the whole load is applied in one step."""
    yield from _check_friction_metrics(scene)
    rubbing = _frictional_contacts(scene)
    if not rubbing or scene.state is not None or states_of(scene):
        return
    yield diagnostic(
        "W670",
        rubbing[0].at("friction"),
        f"`{rubbing[0].name}` has friction, but all of the load is applied in one step",
        "slip depends on the load path",
        "apply the load in steps, `static(states = [25, 50, 75, 100] %)`, and compare with twice as many "
        "states: in one step all points slip along straight lines",
    )


def check_rotations(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of rigid bodies that rotate so far between states that slip is underestimated or reversed.

    Friction assumes that points slide along a straight line in each state.
    """
    bodies = {c.thing.rigid: c for c in _frictional_contacts(scene) if isinstance(c.thing, RigidContactPair)}
    for body, contact in bodies.items():
        for support in (s for s in scene.acting("support", body) if s.thing.prescribes_rotation):
            most = _largest_rotation(scene, support)
            if most > STEP * (1.0 + NEAR):
                yield diagnostic(
                    "E663",
                    support.at(),
                    f"`{support.name}` rotates `{body}` by {math.degrees(most):.4g} deg in one state, too far for "
                    f"the friction of `{contact.name}`",
                    "slip is straight within a state",
                    "rotate it by at most 15 deg from one state to the next, with `amplitude = per_state` and "
                    "`static(states = [...])`: from state to state, points slip along straight lines",
                )


def _largest_rotation(scene: Scene, support: Declared) -> float:
    """Return the largest rotation of a support, rad, between two states or from rest to the first state."""
    try:
        each = [in_state(scene, i).declared[support.name].thing.rotation for i in range(len(states_of(scene)))]
    except Unreadable:  # an unreadable table is reported elsewhere
        return 0.0
    return max(math.dist(a, b) for a, b in pairwise([(0.0, 0.0, 0.0), *(each or [support.thing.rotation])]))


def _frictional_contacts(scene: Scene) -> list[Declared]:
    """Return contacts with friction in a static scene."""
    if any(isinstance(analysis.thing, Dynamic) for analysis in scene.of_kind("analysis").values()):
        return []
    return [c for c in scene.of_kind("contact").values() if getattr(c.thing, "friction", 0.0)]


def _check_friction_metrics(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of friction metrics of contacts without friction."""
    for metric in scene.of_kind("metric").values():
        contact = scene.declared[metric.thing.of] if isinstance(metric.thing, FrictionMetric) else None
        if contact is not None and not getattr(contact.thing, "friction", 0.0):
            yield diagnostic(
                "E662",
                metric.at("of"),
                f"`{metric.name}` needs friction, but `{contact.name}` has none",
                "no friction",
                f"give `{contact.name}` a `friction`, or measure its `force`, its area or its gap"
                if hasattr(contact.thing, "friction") else
                f"measure the `force` of `{contact.name}`: `{contact.constructor.name}` has no friction",
            )  # fmt: skip
