"""What a scene says about the experiment itself: bodies, supports, loads, analyses and probes.

To add one: a class in the file of its kind, a line in that kind's table here.
"""

from __future__ import annotations

from typing import Any

from softmark.interpreter.vocabulary.analyses import Static
from softmark.interpreter.vocabulary.bodies import Solid
from softmark.interpreter.vocabulary.loads import Gravity, PointForce, Pressure, Traction
from softmark.interpreter.vocabulary.probes import Line, Point
from softmark.interpreter.vocabulary.supports import Displaced, Fixed

BODIES: dict[str, type[Any]] = {
    "solid": Solid,
}

SUPPORTS: dict[str, type[Any]] = {
    "fixed": Fixed,
    "displaced": Displaced,
}

LOADS: dict[str, type[Any]] = {
    "gravity": Gravity,
    "traction": Traction,
    "pressure": Pressure,
    "point_force": PointForce,
}

ANALYSES: dict[str, type[Any]] = {
    "static": Static,
}

PROBES: dict[str, type[Any]] = {
    "point": Point,
    "line": Line,
}
