"""Isotropic laws in principal axes: the energy and its two derivatives by logarithmic principal stretches.

`principal(e)` of a law takes e_a = ln s_a. It returns psi, J/m^3; the principal Kirchhoff stresses tau_a = dpsi/de_a,
Pa; and d tau_a/de_b, Pa, as nested lists. Each e_a is an array (m,) of m points or a number (`float`). For numbers no
arrays are made, and the state of one material point takes microseconds. Results are NaN outside the law's domain.
Source: Ogden (1984), "Non-linear elastic deformations", section 6.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Number = Any  # a number, or an array (m,)
Principal = tuple[Number, list[Number], list[list[Number]]]


def deviatoric_derivatives(
    slopes: Sequence[Number], bends: Sequence[Number]
) -> tuple[list[Number], list[list[Number]]]:
    """Return the first and second derivatives by e of a sum W = sum_a w(t_a), with t = e minus its mean.

    `slopes` are dW/dt_a, and `bends` d2W/dt_a^2.
    """
    (p, q, r), (u, v, w) = slopes, bends
    mean, rest = (p + q + r) / 3.0, (u + v + w) / 9.0
    a, b, c = u / 3.0, v / 3.0, w / 3.0
    xy, yz, zx = rest - a - b, rest - b - c, rest - c - a
    return [p - mean, q - mean, r - mean], [[rest + a, xy, zx], [xy, rest + b, yz], [zx, yz, rest + c]]


def add_symmetric_dyad(bent: list[list[Number]], factor: Number, x: Sequence[Number], y: Sequence[Number]) -> None:
    """Add a symmetric dyad in place: bent_ab += factor (x_a y_b + y_a x_b) / 2."""
    half = 0.5 * factor
    for a, row in enumerate(bent):
        u, v = half * x[a], half * y[a]
        row[0], row[1], row[2] = (
            row[0] + (u * y[0] + v * x[0]), row[1] + (u * y[1] + v * x[1]), row[2] + (u * y[2] + v * x[2])
        )  # fmt: skip


def add_volume_derivatives(tau: list[Number], bent: list[list[Number]], slope: Number, bend: Number) -> None:
    """Add the terms of a volume energy, from its first and second derivative `slope` and `bend` by ln J, Pa.

    They are a pressure, added to `tau`, and a constant matrix, added to `bent`.
    """
    tau[0], tau[1], tau[2] = tau[0] + slope, tau[1] + slope, tau[2] + slope
    for row in bent:
        row[0], row[1], row[2] = row[0] + bend, row[1] + bend, row[2] + bend
