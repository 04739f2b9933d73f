"""Stated error of a frequency, from the frequencies of the same mode number on other meshes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.metrics.undefined_metric import Undefined
from softmark.interpreter.models.shared.prepared_model import Solution
from softmark.interpreter.problem.solution import View
from softmark.interpreter.verification.grid_convergence import COARSE
from softmark.interpreter.verification.probe_errors import NO_ERROR, Floats, NoErrorEstimate, ProbeResultUnderTest
from softmark.records import dataclass

EPS = float(np.finfo(np.float64).eps)
WAVES = 10.0  # c / h: the fastest of a hex8 cell is 2 sqrt(3) to 6 c / h, that of elements of degree two above it
HARD = 1e4  # bulk over shear modulus above which the volume constraint is not a spring


@dataclass(frozen=True)
class FrequencyUnderTest(ProbeResultUnderTest):
    """Frequency of one vibration mode, whose error is estimated.

    Modes are numbered from the lowest on each mesh, so that crossings cause no jumps.
    """

    vibrations: Callable[[int], Floats] | None = None

    @property
    def is_about_forces(self) -> bool:
        """True: a frequency depends on stiffness and mass, not on displacements of points."""
        return True

    @property
    def size(self) -> float:
        """Frequency, Hz, by which relative errors are multiplied."""
        return self.tone

    @property
    def tone(self) -> float:
        """Frequency, Hz. Raises NoErrorEstimate."""
        if self.vibrations is None or not isinstance(self.metric, Frequency):
            raise NoErrorEstimate(NO_ERROR)
        try:
            found = self.vibrations(self.metric.mode)
        except Undefined as undefined:
            raise NoErrorEstimate(f"{NO_ERROR}: {undefined}") from undefined
        if len(found) < self.metric.mode:
            raise NoErrorEstimate(f"a coarser model has only {len(found)} modes")
        return float(found[-1])

    def lost(self, materials: tuple[Any, ...], far: float, cell: float) -> float:
        """Return the rounding error of the frequency, Hz, for cells of the size `cell`, m, of these materials.

        It contains the rounding of cell coordinates at the distance `far` from the origin, m, and that of the fastest
        vibration of the mesh, a few pressure waves across a cell.
        """
        law = min(materials, key=lambda m: m.density)
        stiff = max(m.shear_modulus * 4.0 / 3.0 + min(m.bulk_modulus, HARD * m.shear_modulus) for m in materials)
        fastest = WAVES * math.sqrt(stiff / law.density) / cell  # rad/s
        ratio = fastest / (2.0 * math.pi * self.tone) if self.tone > 0.0 else math.inf
        found = 10.0 * EPS * (far / cell + ratio**2)
        if not found <= COARSE:
            raise NoErrorEstimate(
                "the frequency is so low compared with those of single cells that it may be rounding error only"
            )
        return found * self.tone

    def of(self, solution: Solution) -> ProbeResultUnderTest:
        """Return the frequency of the same mode in another solution."""
        return replace(self, vibrations=solution.vibrations)

    def change(self, other: ProbeResultUnderTest) -> float:
        """Return the difference from the frequency of another solution, Hz; equal to `apart`.

        Raises NoErrorEstimate.
        """
        return self.apart(other)

    def apart(self, other: ProbeResultUnderTest) -> float:
        """Return the difference from the frequency of another solution, Hz. Raises NoErrorEstimate."""
        if not isinstance(other, FrequencyUnderTest):
            raise NoErrorEstimate(NO_ERROR)
        return abs(other.tone - self.tone)


def frequency_of_view(metric: Frequency, view: View) -> FrequencyUnderTest:
    """Return the frequency that a metric requests from the results of a model."""
    nothing = np.zeros((0, 3))
    return FrequencyUnderTest(
        nothing, nothing, metric=metric, view=view, at_rest=view.at_rest, vibrations=view.vibrations
    )
