"""How far a model was found right along a quantity, in words that say no more than what was judged."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

Json = Mapping[str, Any]
Shown = Callable[[float], str]  # a value in its unit


def ends(own: Collection[Json], shown: Shown) -> list[str]:
    """Both ends of where a model was found right, in all directions that it was walked; one where they are the same."""
    found = [v for e in own for v in (e["first_right"], e["last_right"]) if v is not None]
    return list(dict.fromkeys(shown(v) for v in (min(found), max(found)))) if found else []


def nowhere(own: Collection[Json]) -> str:
    """What is said of a model that was found right at no point."""
    if not any(e["judged"] for e in own):
        return "not judged"
    here = next(iter(own))["here"]
    return "not right where it was judged, which is not here" if here == "unjudged" else "not right, even here"


def gaps(own: Collection[Json]) -> str:
    """What was not judged between the ends, or nothing."""
    if next(iter(own))["here"] == "unjudged":
        return "not judged here"
    blind = sum(e["blind"] for e in own)
    return f"{blind} point{'s' if blind != 1 else ''} between not judged" if blind else ""


def chosen(edge: Json) -> list[tuple[str, Sequence[str]]]:
    """The options of a quantity that is chosen, under the class that each came to: what is right first."""
    classes: Mapping[str, str] = edge.get("classes") or _older(edge)
    words = dict.fromkeys(("right", *classes.values()))
    return [(word, [o for o, w in classes.items() if w == word]) for word in words if word in classes.values()]


def _older(edge: Json) -> dict[str, str]:
    right: Iterable[str] = edge["right"]
    return {**dict.fromkeys(right, "right"), **dict.fromkeys(edge.get("wrong") or (), str(edge["class"]))}
