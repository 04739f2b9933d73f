"""What a rigid sphere feels that is pressed into a cylinder of gel: forces from outside, to judge ours by.

A sphere of 10 mm in radius, without friction, on the middle of the top of a cylinder of 20 mm in radius and 40 mm in
height whose bottom is held and whose side is free; E = 10 kPa, nu = 0.45. The sphere is exact, not Hertz's paraboloid,
and a point is behind it or not as it lies after the body has deformed, at small strain too.

By CalculiX 2.20 (`tests/benchmarks/indentation_calculix.py section`: CAX8, cells of 0.2 mm under the sphere, contact
from face to face with 1e4 kPa/mm, residual 1e-4), and by the section alone, without it
(`tests/benchmarks/indentation_section.py`: nine-node cells of 0.1 mm, an exact sphere, 3e5 kPa/mm).
"""

from __future__ import annotations

import math

RADIUS, YOUNG, POISSON = 10e-3, 10e3, 0.45  # m, Pa, 1
WIDTH, HEIGHT = 20e-3, 40e-3  # m: radius and height of the cylinder
TRAVELS = (0.25e-3, 0.5e-3, 1e-3)  # m

SMALL = (6.536e-3, 18.317e-3, 50.868e-3)  # N, linear elasticity, by the section
NEO_HOOKEAN = (6.483e-3, 18.177e-3, 50.695e-3)  # N, psi = mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2, by the section
CALCULIX_SMALL = (6.5252e-3, 18.3132e-3, 50.8864e-3)  # N, *ELASTIC without NLGEOM
OTHER_LAW = (6.493e-3, 18.230e-3, 50.917e-3)  # N, psi = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, by the section
CALCULIX_OTHER_LAW = (6.4880e-3, 18.2244e-3, 50.9156e-3)  # N, *HYPERELASTIC, NEO HOOKE with NLGEOM: the same law
ERROR = 2e-3  # of a force: between the two ways, meshes of 0.2 and 0.1 mm and stiffnesses

# A cube of 40 mm around the cylinder is stiffer: under the same pressure its middle sinks 3.34e-4 m/N less (linear, one
# quarter, 30 000 unknowns of quadratic hexahedra, cube and cylinder on one mesh), which is added to the travel.
CUBE_SMALL = (6.622e-3, 18.656e-3, 52.170e-3)  # N: 1.3, 1.9 and 2.6 % above the cylinder
CUBE_NEO_HOOKEAN = (6.568e-3, 18.511e-3, 52.000e-3)  # N
CUBE_ERROR = 4e-3  # of a force: of the cylinder's, and 5 % of what the cube adds


def hertz(travel: float) -> float:
    """F = 4/3 E/(1 - nu^2) sqrt(R) d^1.5, N: a paraboloid on a half-space."""
    return 4 / 3 * YOUNG / (1 - POISSON**2) * math.sqrt(RADIUS) * travel**1.5


def force(travel: float, forces: tuple[float, ...] = SMALL) -> float:
    """Between the travels of a table: what it is of Hertz by the parabola through three, N; from 0.05 to 1 mm.

    By the section itself 0.5895, 1.6631 and 33.342 mN at 0.05, 0.1 and 0.75 mm (small strain): 0.1 % off at most.
    """
    shares = [f / hertz(t) for f, t in zip(forces, TRAVELS, strict=True)]
    weights = [math.prod((travel - s) / (t - s) for s in TRAVELS if s != t) for t in TRAVELS]
    return hertz(travel) * sum(w * s for w, s in zip(weights, shares, strict=True))
