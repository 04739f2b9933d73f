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
RADII = (1.55e-3, 2.207e-3, 3.10e-3)  # m, of what is pressed, linear elasticity, by the section: to 1 %
SMALL_AREA = tuple(math.pi * radius**2 for radius in RADII)  # m^2
SMALL_PRESSURE = (1273.0, 1818.0, 2623.0)  # Pa, at the axis, by the section: what is near it, and 0.25 % more as Hertz'
ERROR = 2e-3  # of a force: between the two ways, meshes of 0.2 and 0.1 mm and stiffnesses

TOLD = {"push": (SMALL, ERROR), "area": (SMALL_AREA, 2e-2), "top": (SMALL_PRESSURE, 5e-3)}  # and how far it is known

CYLINDER = """softmark 1
scene "a sphere on the middle of a cylinder"
material gel   = linear_elastic(young = 10 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     block = axisymmetric(
    quadrilateral((0, -40, 0) mm, (20, -40, 0) mm, (20, 0, 0) mm, (0, 0, 0) mm),
    gel,
)
body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 10, 0) mm))
support  floor = fixed(block, where = y <= -40 mm)
support  hand  = displaced(ball, by = (0, -1, 0) mm, amplitude = per_state)
contact  touch = rigid_contact(ball, block, where = y >= 0 mm)
analysis press = static(states = [{travel}] %)
model    quads = fem({element}, size = {size} mm, strain = small)
metric   push  = force(touch, along = -y)
metric   area  = contact_area(touch)
metric   top   = contact_pressure(touch)
"""

# A cube of 40 mm around the cylinder is stiffer: under the same pressure its middle sinks 3.34e-4 m/N less (linear, one
# quarter, 30 000 unknowns of quadratic hexahedra, cube and cylinder on one mesh), which is added to the travel.
CUBE_SMALL = (6.622e-3, 18.656e-3, 52.170e-3)  # N: 1.3, 1.9 and 2.6 % above the cylinder
CUBE_NEO_HOOKEAN = (6.568e-3, 18.511e-3, 52.000e-3)  # N
CUBE_ERROR = 4e-3  # of a force: of the cylinder's, and 5 % of what the cube adds
CALCULIX_CUBE_SMALL = (6.6209e-3, 18.6740e-3, 52.2660e-3)  # N, a quarter in space, C3D20 of 0.8 mm, 1e4 kPa/mm

# A quarter of that cube, by cells that are finer below the sphere.
QUARTER = """softmark 1
scene "a sphere on the middle of a cube"
material gel   = linear_elastic(young = 10 kPa, poisson = 0.45, density = 1000 kg/m^3)
body     block = solid(box((20, 20, 40) mm), gel)
body     ball  = rigid(sphere(radius = 10 mm, origin = (0, 0, 50) mm))
support  floor = fixed(block, where = z <= 0 mm)
support  left  = symmetric(block, where = x <= 0 mm)
support  front = symmetric(block, where = y <= 0 mm)
support  hand  = displaced(ball, by = (0, 0, -1) mm, amplitude = per_state)
contact  touch = rigid_contact(ball, block, where = z >= 40 mm)
analysis press = static(states = [25, 50, 100] %)
model    cells = fem({element}, strain = small, size = {size} mm, refine_factor = {finer},
    refine_at = x <= 0 mm and y <= 0 mm and z >= 40 mm)
metric   push  = force(touch, along = -z)
"""


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
