"""Quadrature rules of the independent forces, by closed forms and by moments.

Their sources differ from those of the rules of the elements.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def extend_along_wedge(flat: tuple[Floats, Floats], t: list[float]) -> tuple[Floats, Floats]:
    """Return points and weights of a wedge: a triangle rule repeated at one, two or three Gauss points t along it."""
    w = {1: [2.0], 2: [1.0, 1.0], 3: [5 / 9, 8 / 9, 5 / 9]}[len(t)]
    xi = np.array([(x, y, z) for z in t for x, y in flat[0]])
    return xi, np.array([v * u for v in w for u in flat[1]])


def strang_rule() -> tuple[Floats, Floats]:
    """Return six points and weights of a triangle rule of degree four, in closed form."""
    root, below = np.sqrt(10.0), np.sqrt(38.0 - 44.0 * np.sqrt(0.4))
    xi, w = [], []
    for sign in (1.0, -1.0):
        a = (8.0 - root + sign * below) / 18.0
        xi += [(a, a), (1.0 - 2.0 * a, a), (a, 1.0 - 2.0 * a)]
        w += 3 * [0.5 * (620.0 + sign * np.sqrt(213125.0 - 53320.0 * root)) / 3720.0]
    return np.array(xi), np.array(w)


def rule_by_moments(n: int, power: int) -> tuple[Floats, Floats]:
    """Return points and weights (n,) on [0, 1] for integrands times (1 - t)^power, exact to degree 2n - 1.

    The points are the roots of the polynomial that is orthogonal to all lower ones, and the weights integrate 1, t, ...
    exactly. Both follow from the moments k! power! / (k + power + 1)! only.
    """
    moments = [factorial(k) * factorial(power) / factorial(k + power + 1) for k in range(2 * n)]
    hankel = np.array([[moments[i + j] for j in range(n)] for i in range(n)])
    t = np.sort(np.roots([1.0, *np.linalg.solve(hankel, -np.array(moments[n:]))[::-1]]).real)
    return t, np.linalg.solve(np.vander(t, increasing=True).T, np.array(moments[:n]))
