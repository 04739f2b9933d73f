"""Contact fields on the surface of a model for pictures, only for scenes with metrics of such fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.metrics.contact import ContactMetric
from softmark.interpreter.results.run_report import RequestedSurfaceValues

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.solution import View

    Floats = np.ndarray[Any, np.dtype[np.float64]]

WORDS = {  # names and units of contact fields
    "pressure": ("pressure of {}", "Pa"),
    "slip": ("slip of {}", "m"),
    "sticks": ("sticking state of {}, 100 % where it sticks and −100 % where it slides", "1"),
}


def _group_contact_metrics(scene: Scene) -> dict[tuple[str, str], list[Declared]]:
    """Return the contact metrics of a scene, grouped by contact and quantity."""
    found: dict[tuple[str, str], list[Declared]] = {}
    for metric in scene.of_kind("metric").values():
        if isinstance(metric.thing, ContactMetric):
            for number in metric.thing.numbers:
                found.setdefault((metric.thing.of, number), []).append(metric)
    return found


def contact_fields(scene: Scene, view: View, X: Floats) -> Iterator[RequestedSurfaceValues]:
    """Yield the contact fields of a model's body at points X (n, 3) of its surface; zero where there is no contact."""
    own = {*(touch.name for touch in view.case.contacts), *(pair.name for pair in view.case.pairs)}
    touches = {} if view.at_rest is None else view.at_rest.touches
    for (contact, number), metrics in _group_contact_metrics(scene).items():
        if contact not in own:
            continue
        words, unit = WORDS[number]
        known = RequestedSurfaceValues(words.format(contact), unit, tuple(m.name for m in metrics), partly=True)
        field: Any = touches[contact].field if contact in touches else None  # values at nodes of the model
        if field is None or number not in field.at_nodes:
            yield replace(known, reason=f"the contact `{contact}` has no surface field in this model")
            continue
        values = np.nan_to_num(field.values(number, X))
        yield replace(known, values=values, size=float(np.abs(values).max(initial=0.0)))
