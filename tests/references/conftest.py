"""The beams that the tests of the references share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from softmark.references.straight_cantilever import Cantilever, Disc


@pytest.fixture
def silicone_beam() -> Cantilever:
    """The silicone cylinder of Marchal et al. 2008, as recovered from the data its authors released."""
    return Cantilever(
        length=0.178,
        section=Disc(0.019),
        young=60e3,
        poisson=0.49,
        density=1070.0,
        root=(0.0, 0.0, 0.0),
        axis=(1.0, 0.0, 0.0),
        gravity=(0.0, 0.0, -9.81),
    )


@pytest.fixture
def loaded() -> Callable[..., Cantilever]:
    """Make a beam of unit length and unit modulus with a given load parameter k = w L^3 / (EI)."""

    def make(k: float, radius: float = 0.01, **changes: Any) -> Cantilever:
        numbers: dict[str, Any] = {
            "length": 1.0,
            "section": Disc(radius),
            "young": 1.0,
            "poisson": 0.3,
            "density": 1.0,
            "root": (0.0, 0.0, 0.0),
            "axis": (1.0, 0.0, 0.0),
            "gravity": (0.0, 0.0, -k * radius**2 / 4),  # k = rho A g / (E I), and I / A = R^2 / 4
        }
        return Cantilever(**(numbers | changes))

    return make
