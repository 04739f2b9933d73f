"""Export of a scene for SOFA (.scn, components as of version 24); the scene was never run in SOFA here.

The scene has linear tetrahedra of one material, in SI units. The full load is solved in one step by Newton's method;
the log shows whether a large load was reached. `runSofa -g batch -n 1 model.scn` writes the undeformed mesh with nodal
displacements `u` to `answer*.vtu`, because the six digits of deformed positions would be too few.
Source: SOFA's components StaticSolver and TetrahedronHyperelasticityFEMForceField; laws as in NeoHookean.h and
STVenantKirchhoff.h, whose parameters are mu and lambda.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

if TYPE_CHECKING:
    from softmark.interpreter.models.external.exporters.named_parts import NamedParts
    from softmark.interpreter.models.external.external_problem import ExternalMaterial, Problem

FILE = "model.scn"
ANSWER, FIELD = "answer", "u"  # its files, answer*.vtu, and the displacements there
LAWS = {"neo_hookean": "NeoHookean", "st_venant_kirchhoff": "StVenantKirchhoff"}
PLUGINS = (
    "AnimationLoop", "Constraint.Projective", "Engine.Transform", "IO.Mesh", "LinearSolver.Direct", "MechanicalLoad",
    "ODESolver.Backward", "SolidMechanics.FEM.Elastic", "SolidMechanics.FEM.HyperElastic", "StateContainer",
    "Topology.Container.Dynamic",
)  # fmt: skip
# its residual is held against that after the first iteration, which of a linear law is rounding already: there the
# second correction, of 1e-9 of the displacement at most, is the last
TIGHT = {f"{kind}_tolerance_threshold": value for kind, value in (
    ("absolute_correction", 1e-30), ("relative_correction", 1e-9), ("absolute_residual", 1e-30),
    ("relative_residual", 1e-10),
)}  # fmt: skip


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """Return features of a problem that SOFA does not have, or defines differently."""
    found = []
    if problem.element != "tet4":
        found.append((problem.element, "its finite-strain laws need linear tetrahedra"))
    if len(problem.stuff) > 1:
        found.append(("several materials", "each force field has one material for the whole mesh"))
    if np.any(problem.values):
        found.append(("a support that moves", "it holds points in place, or moves them in time"))
    if len(problem.shares) > 1:
        found.append(("several states", "its forces are constant"))
    for stuff in problem.stuff:
        if problem.strain == "finite" and stuff.law not in LAWS:
            found.append((stuff.law, f"of the laws of softmark it has {', '.join(LAWS)}"))
    return found


def export(problem: Problem, named: NamedParts, folder: Path) -> list[str]:
    """Write the SOFA scene into a folder, and return the names of the written files."""
    (folder / FILE).write_text("\n".join([*deck(problem), ""]), encoding="utf-8")
    return [FILE]


def deck(problem: Problem) -> Iterator[str]:
    """Yield the lines of the SOFA scene as XML."""
    loaded = np.flatnonzero(problem.forces.any(axis=1))
    yield '<?xml version="1.0"?>'
    yield "<!-- units: m, Pa, N -->"
    yield '<Node name="root" dt="1" gravity="0 0 0">'
    yield from (_tag("RequiredPlugin", pluginName=f"Sofa.Component.{own}") for own in PLUGINS)
    yield from (_tag("DefaultAnimationLoop"), '<Node name="body">')
    yield _tag("StaticSolver", newton_iterations=100, printLog=1, **TIGHT)
    yield _tag("SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    yield _tag("TetrahedronSetTopologyContainer", name="mesh", position=problem.points, tetrahedra=problem.cells)
    yield _tag("MechanicalObject", name="state", template="Vec3d", src="@mesh")
    yield _law(problem.stuff[0], problem.strain)
    for c in range(3):
        if len(own := problem.held[problem.held[:, 1] == c, 0]):
            way = " ".join(str(int(i == c)) for i in range(3))
            yield _tag("PartialFixedProjectiveConstraint", name=f"held_{'xyz'[c]}", indices=own, fixedDirections=way)
    if len(loaded):
        yield _tag("ConstantForceField", name="load", indices=loaded, forces=problem.forces[loaded])
    moved = {"input": "@state.position", "substractor": "@state.rest_position"}
    yield _tag("DifferenceEngine", name="moved", **moved)
    shown = {"position": "@state.rest_position", "pointsDataFields": f"{FIELD}=moved.output"}
    yield _tag("VTKExporter", filename=ANSWER, XMLformat=1, tetras=1, edges=0, exportAtEnd=1, **shown)
    yield from ("</Node>", "</Node>")


def _law(stuff: ExternalMaterial, strain: str) -> str:
    """Return the XML element of the SOFA component for a material law."""
    E, nu = stuff.constants["young"], stuff.constants["poisson"]
    if strain == "small":
        return _tag("TetrahedronFEMForceField", name="law", method="small", youngModulus=E, poissonRatio=nu)
    mu, lam = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    words: Mapping[str, Any] = {"materialName": LAWS[stuff.law], "ParameterSet": f"{mu!r} {lam!r}"}
    return _tag("TetrahedronHyperelasticityFEMForceField", name="law", **words)


def _tag(component: str, **fields: Any) -> str:
    """Return a component as an XML tag; arrays are written as numbers separated by spaces."""
    return f"<{component}{''.join(f' {name}={quoteattr(_text(own))}' for name, own in fields.items())}/>"


def _text(value: Any) -> str:
    """Return the value of an XML attribute as text."""
    return " ".join(map(repr, value.ravel().tolist())) if isinstance(value, np.ndarray) else str(value)
