"""How far beams are from solids, beside what they state: `python tests/benchmarks/beams.py [N]`, the first N cases.

A beam of rubber, clamped at one end or at both, under its own weight, against ten-node tetrahedra of a third of its
depth at finite strain; `k` is w L^3 / (E I). The error is that of displacements along the axis, relative, l2.
What was found is in `MEASURED` of tests/interpreter/test_stated_beams.py, which holds what beams state against it.
"""

from __future__ import annotations

import math
import sys

import softmark
from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

CASES = [  # length, depth and width (0: round) in mm, Poisson's ratio, k, clamps
    (60, 10, 10, 0.49, 0.5, 1), (60, 10, 10, 0.3, 0.5, 1), (60, 10, 10, 0.49, 6, 1), (75, 10, 0, 0.49, 20, 2),
    (75, 10, 0, 0.3, 20, 2), (75, 10, 0, 0.49, 16, 1), (60, 10, 10, 0.0, 0.5, 1), (60, 10, 10, 0.0, 0.5, 2),
    (30, 10, 10, 0.49, 0.2, 1), (30, 10, 10, 0.3, 0.2, 2), (100, 10, 10, 0.49, 2, 1), (60, 10, 30, 0.49, 0.5, 1),
    (120, 10, 30, 0.49, 2, 1), (150, 10, 10, 0.45, 30, 2), (100, 10, 10, 0.3, 12, 1),
]  # fmt: skip


def scene(length: float, depth: float, width: float, poisson: float, k: float, clamps: int) -> str:
    """One beam and one solid."""
    area = width * depth if width else math.pi * depth**2 / 4
    second = width * depth**3 / 12 if width else math.pi * depth**4 / 64
    weight = k * 60e3 * second * 1e-12 / (1e-3 * length) ** 3 / (1000.0 * area * 1e-6)
    shape, side, up = (
        (f"box(size = ({length}, {width}, {depth}) mm)", width / 2, depth / 2)
        if width
        else (f"cylinder(length = {length} mm, radius = {depth / 2} mm, axis = +x)", 0, 0)
    )
    far = f"support far = fixed(b, where = x >= {length} mm)" if clamps == 2 else ""
    return f"""softmark 1
scene "a beam and a solid"
material m = neo_hookean(young = 60 kPa, poisson = {poisson}, density = 1000 kg/m^3)
body b = solid({shape}, m)
support near = fixed(b, where = x <= 0 mm)
{far}
load weight = gravity({weight!r} m/s^2, direction = -z)
model rod = beam6dof(segments = 80)
model solid = fem(tet10, strain = finite, size = {depth / 3} mm)
probe axis = line(b, from = (0, {side}, {up}) mm, to = ({length}, {side}, {up}) mm, points = 17)
metric error = relative_l2_error(axis, against = solid)
"""


def main() -> None:
    """A line for each case."""
    for case in CASES[: int(sys.argv[1]) if len(sys.argv) > 1 else None]:
        loaded = softmark.loads(scene(*case))
        report = run_scene(loaded.scene, list(loaded.warnings), RunOptions(draw=False, stated=("rod",)))
        rod = report.models["rod"]
        checks = rod.solve["checks"]
        strains = ", ".join(f"{checks[n]:.4f}" for n in ("bending_strain", "axial_strain"))
        print(
            *case,
            f"error {rod.metrics['error'].value:.4f}",
            f"strains {strains}",
            rod.stated["error"].to_json(),
            flush=True,
        )


if __name__ == "__main__":
    main()
