"""Contracts of loads: forces are proportional to their size, and a load states where it is not symmetric."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.cli.conformance import Breach

Floats = NDArray[np.float64]
Forces = tuple[Floats, float]

AREAS = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.2, -0.5, 0.7)])  # m^2, to ask tractions for
PLACES = (0.0, 0.013)  # m: where planes of symmetry are tried
EXACT = 1e-12  # relative to the largest component: rounding


class RecordedForces:
    """Operations of `IndependentForces` that record their numbers and return no forces.

    `constant` (3,), m/s^2, and `gradient` (3, 3), 1/s^2, are the sum of all forces per mass.
    """

    small = True

    def __init__(self, action: Any) -> None:
        self.numbers: list[Floats] = []
        self.constant, self.gradient = np.zeros(3), np.zeros((3, 3))
        self.known = action.independent_forces(self) is not None

    def mass_forces(self, constant: Any, gradient: Any = None) -> Forces:
        """Record a force per mass."""
        slope = np.zeros((3, 3)) if gradient is None else np.array(gradient, dtype=np.float64)
        self.constant, self.gradient = self.constant + np.array(constant), self.gradient + slope
        return self._record(constant, slope)

    def area_forces(self, where: Any, push: Any, linear: bool = False, deformed: bool = False) -> Forces:
        """Record the forces on a few area vectors."""
        return self._record(push(AREAS))

    def surface_moment(self, where: Any, moment: Any) -> Forces:
        """Record a moment."""
        return self._record(moment)

    def point_force(self, at: Any, force: Any) -> Forces:
        """Record a force at a point."""
        return self._record(force)

    def line_force(self, begin: Any, end: Any, force: Any) -> Forces:
        """Record a force per length."""
        return self._record(force)

    def _record(self, *values: Any) -> Forces:
        self.numbers += [np.ravel(np.array(value, dtype=np.float64)) for value in values]
        return np.zeros((1, 3)), 0.0


def load_breaches(load: Any) -> Iterator[Breach]:
    """Yield breaches of a load whose forces are not proportional to its size, or whose symmetry is not as it states."""
    whole, half = (RecordedForces(one.action) for one in (load, load.part(0.5)))
    if not (_is_half(whole.numbers, half.numbers) if whole.known else _has_half_fields(load)):
        yield Breach("half of it does not have half of the effect", "make `action` proportional to its `strength`")
    if whole.known and load.action.surface is None and not load.action.points:
        yield from _symmetry_breaches(load.action, whole)


def _is_half(whole: Sequence[Any], half: Sequence[Any]) -> bool:
    """Return whether there are values that are not zero, and the second ones are half of the first."""
    return any(np.any(a) for a in whole) and all(
        np.allclose(b, 0.5 * np.array(a), EXACT, atol=0.0) for a, b in zip(whole, half, strict=True)
    )


def _has_half_fields(load: Any) -> bool:
    """Return whether the fields of the action that differ between the load and its half are halved."""
    whole, half = (vars(one.action) for one in (load, load.part(0.5)))
    changed = [name for name in whole if whole[name] != half[name]]
    return _is_half([whole[name] for name in changed], [half[name] for name in changed])


def _symmetry_breaches(action: Any, seen: RecordedForces) -> Iterator[Breach]:
    """Yield breaches of a force per mass that is not symmetric where the load reports no fault."""
    c, G = seen.constant, seen.gradient
    size = EXACT * max(np.abs(c).max(), np.abs(G).max())
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        mixed = float(np.abs([G[axis, others], G[others, axis]]).max())
        for place in PLACES:
            across = max(mixed, abs(float(c[axis] + G[axis, axis] * place)))
            if across > size and action.mirror_fault(axis, place, "plane") is None:
                yield Breach(
                    f"it is not symmetric about the plane {'xyz'[axis]} = {place:g} m, but `mirror_fault` returns None",
                    "define `mirror_fault` of its action, as in vocabulary/loads/body_force.py",
                )
                break
    if max(abs(c[2]), np.abs(G[2]).max()) > size and action.plane_fault(False) is None:
        yield Breach("it acts along z on a plane body, but `plane_fault` returns None",
                     "define `plane_fault` of its action, as in vocabulary/loads/centrifugal.py")  # fmt: skip
    swirl = G.copy()
    swirl[1, 1] = 0.0
    swirl[[0, 2], [0, 2]] -= 0.5 * (G[0, 0] + G[2, 2])
    uneven = max(np.abs(c[[0, 2]]).max(), np.abs(swirl).max())
    if uneven > size and action.plane_fault(True) is None and action.axial_fault("body") is None:
        yield Breach("it is not symmetric about the y axis, but `axial_fault` returns None",
                     "define `axial_fault` of its action, as in vocabulary/loads/body_force.py")  # fmt: skip
