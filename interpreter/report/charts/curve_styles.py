"""Styles of curves: colour, dash and marker, so that curves can be distinguished without colour.

The colours are those of Okabe and Ito (2008) and three more. They are the classes `c0` to `c8`, which `report.css`
defines for light and dark themes. Models differ in colour, dash and marker. References are thick and neutral and differ
by their dash.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

from softmark.records import dataclass

Role = Literal["model", "reference", "rest", "phase", "bins"]


@dataclass(frozen=True)
class CurveStyle:
    """Style of one curve; `marker` is a key of MARKERS or empty."""

    role: Role
    colour: int = 0
    dash: str = ""
    marker: str = ""

    @property
    def classes(self) -> str:
        """CSS classes of the style, which `report.css` defines."""
        return f"{self.role} c{self.colour}" if self.role in ("model", "bins") else self.role


COLOURS = 9
MODEL_DASHES = ("", "8 3", "3 2", "9 3 2 3", "14 4")
REFERENCE_DASHES = ("", "11 5", "3 4", "14 4 3 4", "6 3", "18 5")


def _circle(x: float, y: float) -> str:
    return f"M{x - 3.2:.1f} {y:.1f}a3.2 3.2 0 1 0 6.4 0a3.2 3.2 0 1 0-6.4 0"


def _square(x: float, y: float) -> str:
    return f"M{x - 2.9:.1f} {y - 2.9:.1f}h5.8v5.8h-5.8z"


def _triangle(x: float, y: float) -> str:
    return f"M{x:.1f} {y - 3.9:.1f}l3.6 6.2h-7.2z"


def _diamond(x: float, y: float) -> str:
    return f"M{x:.1f} {y - 4.2:.1f}l4.2 4.2-4.2 4.2-4.2-4.2z"


def _inverted_triangle(x: float, y: float) -> str:
    return f"M{x:.1f} {y + 3.9:.1f}l-3.6-6.2h7.2z"


def _plus(x: float, y: float) -> str:
    return f"M{x - 4:.1f} {y:.1f}h8M{x:.1f} {y - 4:.1f}v8"


def _cross(x: float, y: float) -> str:
    return f"M{x - 3.2:.1f} {y - 3.2:.1f}l6.4 6.4m-6.4 0l6.4-6.4"


MARKERS: Mapping[str, Callable[[float, float], str]] = {
    "circle": _circle,
    "square": _square,
    "triangle": _triangle,
    "diamond": _diamond,
    "wedge": _inverted_triangle,
    "plus": _plus,
    "cross": _cross,
}

PHASE_DASHES = ("", "3 2", "8 3", "9 3 2 3")
REST = CurveStyle("rest", dash="1 4")


def model_look(index: int) -> CurveStyle:
    """Return the style of the model with this index; the first 315 styles are all different."""
    names = tuple(MARKERS)
    return CurveStyle("model", index % COLOURS, MODEL_DASHES[index % len(MODEL_DASHES)], names[index % len(names)])


def reference_look(index: int) -> CurveStyle:
    """Return the style of the reference with this index; styles have markers from the seventh on."""
    marker = "" if index < len(REFERENCE_DASHES) else tuple(MARKERS)[index % len(MARKERS)]
    return CurveStyle("reference", 0, REFERENCE_DASHES[index % len(REFERENCE_DASHES)], marker)


def phase_look(index: int) -> CurveStyle:
    """Return the style of a solution phase: only marker and dash, because the colour is that of the model."""
    return CurveStyle("phase", 0, PHASE_DASHES[index % len(PHASE_DASHES)], tuple(MARKERS)[index % len(MARKERS)])
