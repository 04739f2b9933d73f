"""What MuJoCo and PyElastica make of a rod that is let go: error against time a step, at three numbers of segments.

    python tests/benchmarks/rods_by_others.py [--radius "19 mm"] [--young "60 kPa"]

Both move the sections and masses of ours under their weight for 0.12 s, a beam 178 mm long; truth is `beam6dof` of 80
segments by steps of 0.5 ms. Error: of the tip's course, of its way. Time: median of a step by the program's own clock.
Measured with MuJoCo 4.0.0 and PyElastica 1.0.0, on two cores shared with other work; ms to a factor of two.

    radius, young    program     step      10            20            40 segments
    19 mm, 60 kPa    mujoco      1 ms      8.1 %  0.10   9.2 %  0.10   9.4 %  0.25 ms
                     mujoco      0.1 ms    7.7 %  0.10   8.8 %  0.15   9.1 %  0.19 ms
                     pyelastica  0.05 ms   1.5 %  0.03   0.66 % 0.03   0.28 % 0.06 ms
    4 mm, 1.35 MPa   mujoco      1 ms      0.82 % 0.08   0.96 % 0.16   1.2 %  0.27 ms
                     mujoco      0.1 ms    1.2 %  0.10   0.17 % 0.15   0.40 % 0.26 ms
                     pyelastica  0.02 ms   2.4 %  0.05   1.2 %  0.03   0.63 % 0.05 ms

MuJoCo's rod keeps its length, does not shear, and has no inertia of sections across it: of the silicone beam, five
times as long as thick, that leaves 9 %, of the slender one 0.4. Ours takes 0.8 ms for a step of 80 segments.
"""

from __future__ import annotations

import argparse
import statistics
from typing import Any

import softmark
from softmark.interpreter.pipeline import run_pipeline

SCENE = """softmark 1
scene "a rod that is let go"
material silicone = st_venant_kirchhoff(young = {young}, poisson = 0.3, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = {radius}, axis = +x), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis fall = dynamic(duration = 0.12 s, step = 0.5 ms, integrator = bdf2)
model ours = beam6dof(segments = 80)
probe tip = point(beam, at = (178, 0, 0) mm)
metric off = trajectory_error(tip, against = ours)
"""
SEGMENTS = (10, 20, 40)


def main() -> None:
    """A line for each program, step and number of segments."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--radius", default="19 mm")
    parser.add_argument("--young", default="60 kPa")
    asked = parser.parse_args()
    explicit = "0.05 ms" if asked.radius == "19 mm" else "0.02 ms"
    runs = [
        (p, h, n) for p, h in (("mujoco", "1 ms"), ("mujoco", "0.1 ms"), ("pyelastica", explicit)) for n in SEGMENTS
    ]
    models = "".join(
        f"model m{i} = external_rod({p}, segments = {n}, step = {h}, time = 500 s)\n"
        for i, (p, h, n) in enumerate(runs)
    )
    loaded = softmark.loads(SCENE.format(young=asked.young, radius=asked.radius) + models)
    found: dict[str, Any] = dict(run_pipeline.run_scene(loaded.scene, [], run_pipeline.RunOptions(draw=False)).models)
    for i, (program, step, count) in enumerate(runs):
        own = found[f"m{i}"]
        off = own.metrics["off"].value if "off" in own.metrics else None
        if off is None:
            print(f"{program:11} {step:>8} {count:3} {own.status}: {own.message}")
            continue
        each = 1e3 * statistics.median(own.time["step_s"].seconds)
        print(f"{program:11} {step:>8} {count:3} {100 * off:8.3f} % {each:8.3f} ms", flush=True)


if __name__ == "__main__":
    main()
