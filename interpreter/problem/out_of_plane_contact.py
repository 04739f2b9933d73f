"""Check that a rigid body intersects the plane of a plane body."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softmark.interpreter.language import units
from softmark.interpreter.language.message_builder import diagnostic

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Declared


def missed_plane_error(rigid: Declared, body: Declared, low: float, high: float) -> Diagnostic | None:
    """Return an error if a rigid body does not intersect the plane z = 0 of a plane body, else None.

    The rigid body extends from z = `low` to `high`, m. Only its section at z = 0 touches a plane body. A rigid
    body next to the plane, or one that ends in it, has no such section.
    """
    if not body.thing.planar or low < 0.0 < high:
        return None
    ends = f"{units.format_value(low, units.LENGTH)} to {units.format_value(high, units.LENGTH)}"
    problem = f"the plane of `{body.name}`, z = 0, does not cut `{rigid.name}`, which spans z from {ends}"
    remedy = "the section at z = 0 acts on the plane body: place the rigid body on both sides of z = 0, "
    moved = isinstance(getattr(rigid.thing.shape, "path", None), str)
    remedy += "by other coordinates in its file" if moved else "by an `origin` below it"
    return diagnostic("E659", rigid.at("shape"), problem, "misses the plane", remedy)
