"""Validity range of a model along a quantity as text, limited to the judged points."""

from __future__ import annotations

from collections.abc import Callable, Collection

from softmark.interpreter.study.robustness.robustness_record import ChoiceEdge, ValidityEdge

Shown = Callable[[float], str]  # a value in its unit


def range_ends(own: Collection[ValidityEdge], shown: Shown) -> list[str]:
    """Return both ends of the range in which a model is right as text, or one text if they are equal.

    `own` are the validity edges in all tested directions.
    """
    found = [v for e in own for v in (e.first_right, e.last_right) if v is not None]
    return list(dict.fromkeys(shown(v) for v in (min(found), max(found)))) if found else []


def nowhere_right(own: Collection[ValidityEdge]) -> str:
    """Return a phrase for a model that was right at no point."""
    if not any(e.judged for e in own):
        return "not judged"
    here = next(iter(own)).here
    return (
        "not right at any judged point; not judged at the value of the scene"
        if here == "unjudged"
        else "not right, even at the value of the scene"
    )


def unjudged_points_phrase(own: Collection[ValidityEdge]) -> str:
    """Return a phrase on points inside the range that were not judged, or an empty text."""
    if next(iter(own)).here == "unjudged":
        return "not judged at the value of the scene"
    blind = sum(e.blind for e in own)
    return f"{blind} point{'s' if blind != 1 else ''} in between not judged" if blind else ""


def options_by_class(edge: ChoiceEdge) -> list[tuple[str, list[str]]]:
    """Return each verdict with the options that have it, the verdict `right` first."""
    words = dict.fromkeys(("right", *edge.classes.values()))
    return [(word, own) for word in words if (own := edge.options_of_class(word))]
