"""Viridis colour map, perceptually uniform and readable for colour-blind readers and in grey.

`raster.js` has a copy of it.
"""

from __future__ import annotations

# coefficients of t^0 ... t^6 for red, green and blue; a fit to the map of Smith and van der Walt (2015, CC0)
VIRIDIS = (
    (0.2777, 0.0054, 0.3341),
    (0.1051, 1.4046, 1.3846),
    (-0.3309, 0.2148, 0.0951),
    (-4.6342, -5.7991, -19.3324),
    (6.2283, 14.1799, 56.6906),
    (4.7764, -13.7451, -65.3530),
    (-5.4355, 4.6459, 26.3124),
)


def viridis(t: float) -> str:
    """Return the colour of a number between 0 and 1, as `#rrggbb`."""
    near = min(1.0, max(0.0, t))
    parts = (sum(row[c] * near**k for k, row in enumerate(VIRIDIS)) for c in range(3))
    return "#" + "".join(f"{round(255 * min(1.0, max(0.0, part))):02x}" for part in parts)


def gradient(stops: int = 17) -> str:
    """Return the colour map from left to right as a CSS gradient with `stops` colours."""
    colours = ", ".join(viridis(i / (stops - 1)) for i in range(stops))
    return f"linear-gradient(to right, {colours})"
