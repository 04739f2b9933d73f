"""SOFA (`runSofa`, .scn, components as of version 24): a scene that was never run here, and its answer.

Linear tetrahedra of one material, in SI, the full load in one solve by Newton's method: what comes of a large load is
to be seen in its log. `runSofa -g batch -n 1 model.scn` leaves the deformed mesh as `answer*.vtu`: places, of which it
writes 6 digits, so that displacements have as many fewer as they are less than the body.
Source: SOFA's components StaticSolver (with what it says), VTKExporter and TetrahedronHyperelasticityFEMForceField;
laws as in its NeoHookean.h and STVenantKirchhoff.h, whose parameters are mu and lambda.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from softmark.interpreter.models.outside.adapters import PROGRAMS, on_path
from softmark.interpreter.models.outside.problem import Answer, NoAnswer, NotSettled

if TYPE_CHECKING:
    from softmark.interpreter.models.outside.decks.named import Named
    from softmark.interpreter.models.outside.problem import Problem, Stuff

title = PROGRAMS["sofa"].title
program = "runSofa"
install = "put `runSofa` on the PATH (sofa-framework.org): no package of Debian or Python has it"

FILE = "model.scn"
DIGITS = 6  # of a place, as it writes them
LAWS = {"neo_hookean": "NeoHookean", "st_venant_kirchhoff": "StVenantKirchhoff"}
PLUGINS = (
    "AnimationLoop", "Constraint.Projective", "IO.Mesh", "LinearSolver.Direct", "MechanicalLoad", "ODESolver.Backward",
    "SolidMechanics.FEM.Elastic", "SolidMechanics.FEM.HyperElastic", "StateContainer", "Topology.Container.Dynamic",
)  # fmt: skip
TIGHT = {f"{kind}_tolerance_threshold": value for kind, value in (
    ("absolute_correction", 1e-30), ("relative_correction", 1e-9), ("absolute_residual", 1e-30),
    ("relative_residual", 1e-10),
)}  # fmt: skip


def refuses(problem: Problem) -> list[tuple[str, str]]:
    """What of a problem it does not have, or not as it is meant."""
    found = []
    if problem.element != "tet4":
        found.append((problem.element, "its laws at finite strain are of linear tetrahedra"))
    if len(problem.stuff) > 1:
        found.append(("several materials", "its force fields have one each for a whole mesh"))
    if np.any(problem.values):
        found.append(("a support that moves", "it holds points where they are, or moves them in time"))
    if len(problem.shares) > 1:
        found.append(("several states", "its forces are constant"))
    for stuff in problem.stuff:
        if problem.strain == "finite" and stuff.law not in LAWS:
            found.append((stuff.law, f"of ours it has {', '.join(LAWS)}"))
    return found


def write_named(problem: Problem, named: Named, folder: Path) -> None:
    """Its input."""
    export(problem, named, folder)


def export(problem: Problem, named: Named, folder: Path) -> list[str]:
    """The scene."""
    (folder / FILE).write_text("\n".join([*deck(problem), ""]), encoding="utf-8")
    return [FILE]


def deck(problem: Problem) -> Iterator[str]:
    """Its lines."""
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
    yield _tag("VTKExporter", filename="answer", XMLformat=1, tetras=1, edges=0, exportAtEnd=1)
    yield from ("</Node>", "</Node>")


def _law(stuff: Stuff, strain: str) -> str:
    E, nu = stuff.constants["young"], stuff.constants["poisson"]
    if strain == "small":
        return _tag("TetrahedronFEMForceField", name="law", method="small", youngModulus=E, poissonRatio=nu)
    mu, lam = E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    words: Mapping[str, Any] = {"materialName": LAWS[stuff.law], "ParameterSet": f"{mu!r} {lam!r}"}
    return _tag("TetrahedronHyperelasticityFEMForceField", name="law", **words)


def _tag(component: str, **fields: Any) -> str:
    """A component; arrays are numbers with spaces between them."""
    return f"<{component}{''.join(f' {name}={quoteattr(_text(own))}' for name, own in fields.items())}/>"


def _text(value: Any) -> str:
    return " ".join(map(repr, value.ravel().tolist())) if isinstance(value, np.ndarray) else str(value)


# ------------------------------------------------------------------ running and reading


def version() -> str | None:
    """What it says of itself; None where it is not on the PATH."""
    return on_path.version(program, ("--version",), r"v?(\d+\.\d[\w.]*)")


def places() -> tuple[Path, ...]:
    """The file that is run."""
    return on_path.places(program)


def command(folder: Path) -> list[str]:
    """What is run in the folder."""
    return [program, "-g", "batch", "-n", "1", FILE]


def read(folder: Path) -> Answer:
    """What it has left in a folder. Raises NoAnswer, NotSettled."""
    from softmark.interpreter.models.results.readers.vtu import read_moment
    from softmark.references.measured import Unreadable

    log, files = on_path.log(folder), sorted(folder.glob("answer*.vtu"), key=lambda file: (len(file.name), file.name))
    said = on_path.lines(log, r"\[(ERROR|FATAL|DIVERGED)\]")
    if "[DIVERGED]" in log:
        raise NotSettled(said)
    if not files:
        raise NoAnswer(f"it left no answer.vtu{': ' if said else ''}{said}")
    mesh = ElementTree.parse(folder / FILE).find(".//TetrahedronSetTopologyContainer")
    assert mesh is not None
    X = np.array(mesh.attrib["position"].split(), dtype=np.float64).reshape(-1, 3)
    try:
        x = read_moment(files[-1]).points
    except Unreadable as broken:
        raise NoAnswer(str(broken)) from broken
    if x.shape != X.shape:
        raise NoAnswer(f"{files[-1].name} has {len(x)} points, and the mesh {len(X)}")
    settled = True if "[CONVERGED]" in log else None
    last = 10.0 ** (np.floor(np.log10(np.abs(x), where=x != 0.0, out=np.full(x.shape, -300.0))) + 1 - DIGITS)
    iterations = len(re.findall(r"Newton iteration #", log)) or None
    return Answer((x - X)[None], settled, iterations, said=said, unsure=0.5 * last[None])
