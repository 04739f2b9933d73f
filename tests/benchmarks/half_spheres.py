"""Two half-spheres of rubber, one in the other, pressed by a plate: the force by element, mesh, gap and friction.

    .venv/bin/python tests/benchmarks/half_spheres.py [--friction 0.5] [--cells quad4:0.5 quad8:1]

The problem of Puso and Laursen (2004) as Areias et al. (2015) and Zimmerman and Ateshian (2018) have it, on bodies of
revolution. Forces on a quarter, N, at 1, 2, 3, 4 and 5 mm of travel, beside what others published (digitised by
Batistic, solids4foam's solid-benchmarks, hyperElasticity/compressedSpheres).
"""

from __future__ import annotations

import argparse
import time

from softmark import loads

SCENE = """softmark 1
scene "Half-spheres"
material rubber = neo_hookean(young = 1 MPa, poisson = 0.3, density = 1000 kg/m^3)
body spheres = axisymmetric(
    disjoint(
        quarter_ring(inner = 10 mm, outer = 12 mm),
        quarter_ring(inner = {inner} mm, outer = {outer} mm),
        coarser = {coarser},
    ),
    rubber,
)
body     plate   = rigid(half_space(origin = (0, {outer}, 0) mm, normal = -y))
support  floor   = symmetric(spheres, where = y <= 0 mm)
support  press   = displaced(plate, by = (0, -5, 0) mm, amplitude = per_state)
contact  lid     = rigid_contact(plate, spheres, distance = 0.01 mm)
contact  rub     = self_contact(
    spheres, where = x^2 + y^2 > (11.5 mm)^2 and x^2 + y^2 < (12.5 mm)^2, friction = {friction})
analysis squeeze = static(states = [{states}] %, tolerance = 1e-6)
model    rings   = fem({element}, strain = finite, size = {size} mm)
metric   force   = force(lid, along = -y)
expect rings.force > 0 N
"""

OTHERS = {
    0.0: {
        "FEBio": (0.293, 0.776, 1.263, 1.804, 2.441),
        "Abaqus": (0.374, 0.799, 1.272, 1.819, 2.402),
        "Puso and Laursen": (0.158, 0.662, 1.202, 1.816, 2.322),
        "Areias": (0.296, 0.667, 1.072, 1.641, 2.241),
    },
    0.5: {
        "FEBio": (0.365, 0.83, 1.346, 1.946, 2.586),
        "Abaqus": (0.364, 0.819, 1.3, 1.918, 2.576),
        "Areias": (0.315, 0.699, 1.129, 1.702, 2.343),
    },
}


def forces(element: str, size: float, gap: float, friction: float, steps: int, coarser: float) -> str:
    """A line of the table."""
    shares = ", ".join(f"{100.0 * (i + 1) / (5 * steps):.6g}" for i in range(5 * steps))
    text = SCENE.format(
        inner=12.0 + gap,
        outer=14.0 + gap,
        coarser=coarser,
        states=shares,
        friction=friction,
        element=element,
        size=size,
    )
    begun = time.process_time()
    model = loads(text).run().models["rings"]
    found = [value / 4.0 for value in model.metrics["force"].states[steps - 1 :: steps] if value is not None]
    numbers = "  ".join(f"{value:.3f}" for value in found)
    return f"{numbers}   {time.process_time() - begun:.0f} s   {model.status} {model.message or ''}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--gap", type=float, nargs="+", default=[0.02])
    parser.add_argument("--steps", type=int, default=2, help="states for each mm")
    parser.add_argument("--coarser", type=float, default=1.15)
    parser.add_argument("--cells", nargs="+", default=["quad8:1", "quad8:0.5", "quad4:1", "quad4:0.67", "quad4:0.5"])
    asked = parser.parse_args()
    for name, values in OTHERS.get(asked.friction, {}).items():
        print(f"{name:>24}  " + "  ".join(f"{value:.3f}" for value in values), flush=True)
    for cells in asked.cells:
        element, size = cells.split(":")
        for gap in asked.gap:
            name = f"{element} {size} mm, gap {gap:g}"
            line = forces(element, float(size), gap, asked.friction, asked.steps, asked.coarser)
            print(f"{name:>24}  {line}", flush=True)


if __name__ == "__main__":
    main()
