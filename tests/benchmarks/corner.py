"""A block dropped on, and dragged over, the sharp edges of a box that goes round under it, for as many steps as wanted.

Run: .venv/bin/python tests/benchmarks/corner.py 10000 implicit_euler

The problem is that of tests/solvers/test_dynamic_contact.py. Every step is asked for NaN and for points behind
a surface; every hundredth for how deep edges cut into facets between the points that keep clear.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.contact.rigid_contact import RigidContact
from softmark.solvers.dynamics import INTEGRATORS
from softmark.solvers.dynamics.dynamic_contact import DynamicContacts
from softmark.solvers.dynamics.time_integration import march
from softmark.solvers.dynamics.trajectory import MotionNotConverged
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.materials import MATERIALS, law_for
from softmark.solvers.mesh.element_interpolation import integrate_cells

sys.path.insert(0, str(Path(__file__).parents[1] / "solvers"))
STEP, PARTS, EVERY = 5e-4, 24, 100


def main(steps: int, integrator: str, uncut: bool = True, friction: float = 0.0) -> None:
    """What came of it, in a line or two."""
    from test_dynamic_contact import dropped

    problem, edge = dropped(_law, _elastic, integrator, uncut, friction)
    impact = DynamicContacts(
        [e for e in problem.assembly.loads if isinstance(e, RigidContact)], problem.amplitudes[1:], ()
    )
    known: dict[str, Any] = {"number": 0, "least": np.inf, "cut": 0.0}

    def look(motion: Any) -> None:
        assert np.isfinite(motion.x).all() and np.isfinite(motion.v).all()  # noqa: PT018
        here = impact.at(motion.time).posed
        known["least"] = min(known["least"], *(float(c.gaps(motion.x).min()) for c in here))
        if known["number"] % EVERY == 0:
            known["cut"] = max(known["cut"], _cut(here[0], edge, motion.x))
        known["number"] += 1

    begin = time.process_time()
    try:
        path, reason = march(problem, STEP * steps, STEP, look), "all"
    except MotionNotConverged as failure:
        path, reason = failure.trajectory, failure.reason
    print(f"{integrator}: {len(path.steps)} steps to {path.times[-1]:.4g} s, {reason}; {len(path.events)} halved, "
          f"{int(path.iterations.sum())} systems, {time.process_time() - begin:.0f} s of CPU")  # fmt: skip
    print(f"least gap {known['least']:.3g} m, deepest cut between points {known['cut']:.3g} m, "
          f"energy gained {path.balance.gain:.2g} of what there was")  # fmt: skip


def _cut(posed: Any, edge: RigidContact, x: Any) -> float:
    """How deep the box lies in flat triangles of the surface, m, by a lattice of PARTS on every one."""
    whole = edge.of[(edge.shares > 0).all(axis=1)]
    triangles = np.unique(np.sort(whole, axis=1), axis=0)
    i, j = np.array([(i, j) for i in range(PARTS + 1) for j in range(PARTS + 1 - i)]).T
    N = np.stack([PARTS - i - j, i, j], axis=1) / PARTS
    points = np.zeros((int(edge.nodes.max()) + 1, 3))
    points[edge.nodes] = edge.X + x.reshape(-1, 3)[edge.nodes]
    places = np.einsum("pa,tai->tpi", N, points[triangles]).reshape(-1, 3)
    return float(max(0.0, -posed.body.gap(places).min()))


def _law(name: str, young: float, poisson: float) -> Any:
    return law_for(MATERIALS[name](young=young, poisson=poisson, density=1000.0), "finite")


def _elastic(mesh: Any, law: Any) -> Elastic:
    parts = integrate_cells(mesh)
    return Elastic(mesh.cells, parts.dNdX, parts.w, law)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("steps", type=int, nargs="?", default=10000)
    parser.add_argument("integrator", nargs="?", default="implicit_euler", choices=[*INTEGRATORS])
    parser.add_argument("--cut", action="store_true", help="keep the points clear that are there at first, and no more")
    parser.add_argument("--friction", type=float, default=0.0, help="of the box")
    asked = parser.parse_args()
    main(asked.steps, asked.integrator, not asked.cut, asked.friction)
