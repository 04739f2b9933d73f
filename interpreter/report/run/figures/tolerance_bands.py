"""Small drawing of a computed number next to the reference value with its band of uncertainty."""

from __future__ import annotations

from softmark.interpreter.report.page.html_markup import tag
from softmark.records import dataclass

WIDTH, HEIGHT, EDGE = 132.0, 18.0, 7.0
REACH = 4.0  # multiple of the longer side of the band; values farther away are drawn as an arrow at the edge


@dataclass(frozen=True)
class Band:
    """Reference value with the ends of its uncertainty band, and all numbers that are compared with it."""

    value: float
    ends: tuple[float, float]
    everyone: tuple[float, ...]

    @property
    def range(self) -> tuple[float, float]:
        """Range of values in the drawing: it contains all numbers, unless the band would then become invisible."""
        low, high = self.ends
        side = max(self.value - low, high - self.value)
        reach = REACH * side or max((abs(v - self.value) for v in self.everyone), default=0.0) or 1.0
        near = [v for v in (*self.everyone, low, high, self.value) if abs(v - self.value) <= reach]
        far = [self.value + reach * (1.0 if v > self.value else -1.0) for v in self.everyone if v not in near]
        return min([*near, *far]), max([*near, *far])

    def _pixel_x(self, v: float) -> float:
        low, high = self.range
        share = (min(max(v, low), high) - low) / ((high - low) or 1.0)
        return EDGE + share * (WIDTH - 2.0 * EDGE)

    def render_svg(self, found: float, said: str) -> str:
        """Return the SVG of the drawing with the number `found` marked; `said` is that number as text."""
        (low, high), middle = self.range, HEIGHT / 2.0
        left, right = (self._pixel_x(v) for v in self.ends)
        parts = [
            tag("path", class_="axis", d=f"M{EDGE} {middle}H{WIDTH - EDGE}"),
            tag("rect", x=f"{left:.1f}", y="2", width=f"{max(right - left, 1.0):.1f}", height=f"{HEIGHT - 4.0:g}"),
            tag("path", class_="given", d=f"M{self._pixel_x(self.value):.1f} 2V{HEIGHT - 2.0:g}"),
            tag("path", class_="found", d=_mark(self._pixel_x(found), middle, (found > high) - (found < low))),
        ]
        box = f"0 0 {WIDTH:g} {HEIGHT:g}"
        return tag("svg", *parts, class_="band", viewBox=box, width=f"{WIDTH:g}", height=f"{HEIGHT:g}", role="img",
                   aria_label=said)  # fmt: skip


def _mark(x: float, y: float, beyond: int) -> str:
    """Return the SVG path of a diamond, or of an arrow if the value is outside the drawing (`beyond` is -1 or 1)."""
    if beyond:
        return f"M{x + 4.5 * beyond:.1f} {y:g}l{-7 * beyond} -4.5v9z"
    return f"M{x:.1f} {y - 4.5:g}l4.5 4.5l-4.5 4.5l-4.5 -4.5z"
