"""Rigid bodies in the figure of deformed shapes: their data on the page, the drawn box, and the caption.

The picture covers the deformable bodies with some margin. A rigid body that extends farther, such as a floor, is cut
off at the edge of the picture.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from softmark.interpreter.report.page.html_markup import join_few_names
from softmark.interpreter.report.view3d.compact_surfaces import Floats, bounds, encode_16_bits, packed_triangles
from softmark.interpreter.results.run_report import DrawnRigidBody, DrawnSurface
from softmark.records import dataclass

AROUND = 0.35  # margin for rigid bodies on each side, as a fraction of the diagonal of all bodies


@dataclass(frozen=True)
class PictureBox:
    """Box that the pictures cover, given by its corners (3,), m."""

    low: Floats
    high: Floats

    def positions(self, shape: DrawnSurface) -> list[Floats]:
        """Return the points (n, 3), m, of the rigid bodies of a shape at all times, moved into the box."""
        each = ((own, i) for own in shape.instruments for i in range(len(own.turns)))
        return [self.within(own.at(i)) for own, i in each]

    def within(self, X: Floats) -> Floats:
        """Return points (n, 3), m; those outside the box are moved to its edge."""
        return np.clip(X, self.low, self.high)


def picture_box(shapes: Iterable[DrawnSurface]) -> PictureBox:
    """Return the box around the deformable bodies at all times, with a margin."""
    ends = [bounds(shape) for shape in shapes]
    low, high = np.min([a for a, _ in ends], axis=0), np.max([b for _, b in ends], axis=0)
    more = AROUND * float(np.linalg.norm(high - low))
    return PictureBox(low - more, high + more)


def packed_instruments(shapes: Mapping[str, DrawnSurface]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Return data that `instruments.js` reads: each rigid surface once, and its positions for each shape."""
    known: dict[bytes, int] = {}
    surfaces: list[dict[str, Any]] = []
    each: dict[str, dict[str, Any]] = {}
    for name, shape in shapes.items():
        places = []
        for own in shape.instruments:
            key = own.X.tobytes() + own.triangles.tobytes() + own.name.encode()
            if key not in known:
                known[key] = len(surfaces)
                surfaces.append(_pack_rigid_surface(own))
            places.append({"of": known[key], "turns": own.turns.reshape(-1, 9).tolist(), "shifts": own.shifts.tolist()})
        each[name] = {"instruments": places}
    room = picture_box(shapes.values())
    return {"instruments": surfaces, "room": [room.low.tolist(), room.high.tolist()]}, each


def _pack_rigid_surface(own: DrawnRigidBody) -> dict[str, Any]:
    low, high = own.X.min(axis=0), own.X.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    found = {"name": own.name, "points": len(own.X), "low": low.tolist(), "span": span.tolist()}
    return found | {"position": encode_16_bits((own.X - low) / span)} | packed_triangles(own.triangles)


def caption(shapes: Iterable[DrawnSurface], moment: str) -> str:
    """Return a sentence for the caption that rigid bodies are drawn translucent; empty if there are none.

    `moment` is a phrase added at its end, such as ` in each state`.
    """
    names = [f"`{name}`" for name in dict.fromkeys(own.name for shape in shapes for own in shape.instruments)]
    if not names:
        return ""
    verb = "is rigid, and drawn" if len(names) == 1 else "are rigid, and drawn"
    return f" {join_few_names(names)} {verb} translucent, where {'it is' if len(names) == 1 else 'they are'}{moment}."
