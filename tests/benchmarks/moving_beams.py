"""What a step of a beam in motion costs: `python tests/benchmarks/moving_beams.py [SEGMENTS]`, 20 without.

A clamped bar of rubber let go under its weight and one load more, in steps of 1 ms: CPU of a step, median and
ninth decile, and Newton iterations. Compare two versions within one run of both: times of one alone mean little.
"""

from __future__ import annotations

import sys

import numpy as np

import softmark
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.procedures.dynamic_analysis import DynamicAnalysis
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_for
from softmark.solvers.dynamics.time_integration import march

SCENE = """
material gum = linear_elastic(young = 1.8 MPa, poisson = 0.3, density = 1000 kg/m^3)
body bar = solid(box(size = (200, 6, 6) mm, origin = (0, -3, -3) mm), gum)
support wall = fixed(bar, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
{more}
analysis motion = dynamic(duration = 0.5 s, step = 1 ms, integrator = {integrator})
model rod = beam6dof(segments = {segments})
probe tip = point(bar, at = (200, 0, 0) mm)
"""
LOADS = {
    "force": "load aside = point_force(bar, at = (200, 0, 0) mm, vector = (0, 15, 0) mN)",
    "torque": "load twist = torque(bar, where = x >= 200 mm, moment = (1, 0, 0) N*mm)",
    "tendon": "load pull = tendon(bar, from = (0, 0, 8) mm, to = (200, 0, 8) mm, tension = 20 mN, winding = 180 deg)",
    "guides": "load pull = tendon(bar, from = (0, 0, 8) mm, to = (200, 0, 8) mm, tension = 20 mN, guides = 6)",
}


def main() -> None:
    """A line for each load and integrator."""
    segments = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for integrator in ("midpoint", "implicit_euler", "generalized_alpha"):
        for name, more in LOADS.items():
            scene = softmark.loads(SCENE.format(more=more, integrator=integrator, segments=segments)).scene
            rod = scene.declared["rod"]
            prepared = build(rod, case_for(scene, rod), BuildContext(scene=scene))
            assert isinstance(prepared, DynamicAnalysis)
            march(prepared.problem, 0.01, 1e-3)
            track = march(prepared.problem, 0.5, 1e-3)
            low, high = np.quantile(track.cpu, [0.5, 0.9]) * 1e3
            print(f"{integrator:20} {name:8} {low:6.3f} ms {high:6.3f} ms  {track.iterations.mean():.2f} iterations")


if __name__ == "__main__":
    main()
