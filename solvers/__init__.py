"""Numerics on plain arrays, usable without the rest; packages import only those before them (tests/test_rooms.py).

    runtime             kernels cached on disk, lazy imports, threads
    materials           material laws: psi(F), P, dP/dF
    elements            reference cells: shape functions, quadrature, facets
    mesh                points and cells, shapes, files, interpolation on a mesh
    energies            value, gradient, Hessian over local degrees of freedom
    sparse              factorisations and iterative solvers of this project
    assembly            sums of energies over shared degrees of freedom
    stress_recovery     stress and strain of a solved mesh, recovered at nodes
    linear              selection of a linear solver
    statics             equilibrium, stability, equilibrium paths
    dynamics            time integrators
    contact             contact and friction
    model_reduction     reduced models with few unknowns
    independent_forces  forces computed again by other formulas
    api                 Python interface, built from all of these

To solve a solid without a scene, SI units throughout:

    from softmark.solvers import Cylinder, Solid, clamp, equilibrium, gravity, material

    rubber = material("neo_hookean", young=60e3, poisson=0.49, density=1070.0)
    beam = Solid(Cylinder(length=0.178, radius=0.019).mesh("tet10", size=0.01), rubber)
    wall = clamp(beam, beam.nodes(lambda X: X[:, 0] <= 0.0))
    equilibrium(beam, [wall], [gravity(beam, (0.0, 0.0, -9.81))]).displacement  # (n, 3), m

A module is imported when one of the names is first used, and nothing of softmark outside this package is imported.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than this
if TYPE_CHECKING:
    from typing import Any

    from softmark.solvers.api.analyses import AtRest as AtRest
    from softmark.solvers.api.analyses import InMotion as InMotion
    from softmark.solvers.api.analyses import equilibrium as equilibrium
    from softmark.solvers.api.analyses import march as march
    from softmark.solvers.api.elastic_solid import Solid as Solid
    from softmark.solvers.api.elastic_solid import material as material
    from softmark.solvers.api.solid_loads import gravity as gravity
    from softmark.solvers.api.solid_loads import pressure as pressure
    from softmark.solvers.api.solid_loads import traction as traction
    from softmark.solvers.api.solid_supports import Clamp as Clamp
    from softmark.solvers.api.solid_supports import clamp as clamp
    from softmark.solvers.mesh.files.mesh_reader import read_cells
    from softmark.solvers.mesh.mesh import Mesh as Mesh
    from softmark.solvers.mesh.shapes import Box as Box
    from softmark.solvers.mesh.shapes import Cylinder as Cylinder
    from softmark.solvers.statics.static_problem import NotConverged as NotConverged

    read = read_cells

# where each public name comes from: a module, and the name there if it differs
_PUBLIC = {
    "Box": "mesh.shapes",
    "Cylinder": "mesh.shapes",
    "Mesh": "mesh.mesh",
    "read": "mesh.files.mesh_reader:read_cells",
    "material": "api.elastic_solid",
    "Solid": "api.elastic_solid",
    "clamp": "api.solid_supports",
    "Clamp": "api.solid_supports",
    "gravity": "api.solid_loads",
    "pressure": "api.solid_loads",
    "traction": "api.solid_loads",
    "equilibrium": "api.analyses",
    "AtRest": "api.analyses",
    "march": "api.analyses",
    "InMotion": "api.analyses",
    "NotConverged": "statics.static_problem",
}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'softmark.solvers' has no attribute {name!r}")
    import importlib

    module, _, own = _PUBLIC[name].partition(":")
    return getattr(importlib.import_module(f"softmark.solvers.{module}"), own or name)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC]
