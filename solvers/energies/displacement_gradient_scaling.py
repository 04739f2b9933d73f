"""Magnification of very small displacement gradients H, whose digits would be lost in F = I + H.

With |H| = 1e-12, F keeps four of the sixteen digits of H, and below 1e-16 none. Stress and energy would then be
rounding noise. If P is linear in H, then P(I + c H) / c is the same stress for every c, and c is chosen so that |c H|
is about one. If P is not linear, |H| below SMALL is magnified to SMALL, where the error of linearising the law is as
small as the rounding error. A law with stress in the undeformed state is not magnified.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.solvers.energies.energy import Floats

SMALL = 2.0**-27  # bound of |H|: its square is 2^-54, about the rounding error
SLIGHT = 2.0**-13  # bound of |H|: above it F keeps twelve digits of H
AGREEING = 1e-12  # relative rounding error of a law


def find_scale(reach: float, linear: bool, largest: Callable[[float], float], kind: Any = np.float64) -> float:
    """Return the power of two, 1 or more, by which displacements are magnified.

    `reach` is an upper bound of |H|, the displacement gradient. `largest` is a function: it returns the largest |H| if
    displacements are multiplied by its argument. `linear` is True if the stress is linear in H.
    """
    if not 0.0 < reach < (1.0 if linear else SMALL):
        return 1.0
    most = -np.log2(np.finfo(kind).tiny) / 4.0  # its square does not overflow
    up = float(2.0 ** min(np.floor(-np.log2(reach)), most))
    if linear:
        return up
    there = largest(up) / up
    return float(2.0 ** min(np.floor(np.log2(SMALL / there)), most)) if 0.0 < there < SMALL else 1.0


def has_no_rest_stress(law: Any, many: int = 1) -> bool:
    """Return whether a law has zero stress in the undeformed state.

    `many` is the number of points if the constants of the law differ from point to point, else 1.
    """
    rest, strained = (
        _stress_at_points(law, many, np.zeros((3, 3))),
        _stress_at_points(law, many, np.diag((0.1, 0.0, -0.1))),
    )
    return bool(np.abs(rest).max() <= AGREEING * np.abs(strained).max())


def is_linear(law: Any, many: int = 1) -> bool:
    """Return whether the stress of a law is a linear function of H, tested with three multiples of one H.

    `many` is the number of points if the constants of the law differ from point to point, else 1.
    """
    H = np.random.default_rng(1).uniform(-0.1, 0.1, (3, 3))
    once, more, less = (_stress_at_points(law, many, k * H) for k in (1.0, 4.0, -2.0))
    with np.errstate(all="ignore"):
        apart = np.abs(more - 4.0 * once).max() + np.abs(less + 2.0 * once).max()
    return bool(apart <= AGREEING * np.abs(once).max())


def first_piola_stress(law: Any, H: Floats) -> Floats:
    """Return the first Piola-Kirchhoff stress (n, 3, 3), Pa, for displacement gradients H (n, 3, 3).

    Very small displacement gradients are magnified before the law is evaluated.
    """
    reach = float(np.abs(H).max(initial=0.0))
    up = 1.0
    if 0.0 < reach < SLIGHT and has_no_rest_stress(law, len(H)):
        up = find_scale(reach, is_linear(law, len(H)), lambda c: c * reach)
    P: Floats = law.P(np.ascontiguousarray(up * H + np.eye(3))) / up
    return P


def _stress_at_points(law: Any, many: int, H: Floats) -> Floats:
    """Return the stress P (many, 3, 3), Pa, for F = I + H, with the same H (3, 3) at `many` points."""
    with np.errstate(all="ignore"):
        found: Floats = law.P(np.broadcast_to(np.eye(3) + H, (many, 3, 3)).copy())
    return found
