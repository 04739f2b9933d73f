"""Validity maps: the class of a model on a coarse grid over two quantities, both of which may be extreme at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from softmark.interpreter.planning.parameter_walk import Walk
from softmark.interpreter.planning.varied_quantities import Value, WalkedQuantity
from softmark.interpreter.study.robustness.robustness_record import ClassifiedPoint, PairMap


def grid_levels(quantity: WalkedQuantity, walks: Sequence[Walk]) -> list[Value]:
    """Return about six values of a quantity for the grid of a map, or all options of a choice.

    The values lie between the farthest values that walks have tested in both directions.
    """
    if quantity.options:
        return list(quantity.options)
    found: set[float] = {float(quantity.nominal)}
    for direction, parts in (("up", (0.35, 0.7, 1.0)), ("down", (0.5, 1.0))):
        own = [w for w in walks if w.ladder.direction == direction and max(w.seen, default=0.0) > 0]
        if own:
            farthest = max(own, key=lambda w: max(w.seen))
            found |= {
                farthest.ladder.at(_computed_position_near(farthest, part * max(farthest.seen))) for part in parts
            }
    return sorted(found)


def _computed_position_near(walk: Walk, t: float) -> float:
    """Return the position nearest to t at which the walk has a result; t if there is none near."""
    near = min(walk.seen, key=lambda s: abs(s - t))
    return near if abs(near - t) <= 0.2 * max(walk.seen) else t


def quantity_pairs(quantities: Sequence[WalkedQuantity]) -> list[tuple[WalkedQuantity, WalkedQuantity]]:
    """Return all pairs of two different quantities, each pair once."""
    return list(combinations(quantities, 2))


def map_of(
    model: str, x: WalkedQuantity, y: WalkedQuantity, xs: Sequence[Value], ys: Sequence[Value],
    found: Mapping[tuple[Value, Value], ClassifiedPoint],
) -> PairMap:  # fmt: skip
    """Return the validity map of a model over the quantities x (columns) and y (rows)."""
    rows = [[found.get((a, b)) for a in xs] for b in ys]
    classes = [[c.word if c else None for c in row] for row in rows]
    errors = [[c.error if c else None for c in row] for row in rows]
    return PairMap(model, x.name, y.name, list(xs), list(ys), classes, errors)
