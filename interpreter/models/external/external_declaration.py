"""Declaration of finite element models that external programs solve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

from softmark.interpreter.models.external import problem_transfer
from softmark.interpreter.models.external.adapters import PROGRAMS
from softmark.interpreter.models.external.external_program import ExternalModel
from softmark.interpreter.models.external.problem_transfer import Reason
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.shared.capabilities import SOLID, supported
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.vocabulary.loads.line_force import LineForce
from softmark.records import dataclass
from softmark.solvers.materials import MATERIALS

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.conforming_mesh import Cuts
    from softmark.interpreter.results.run_report import ModelKind
    from softmark.solvers.mesh.shape import Shape

    Word = str
else:
    Word = Literal[tuple(PROGRAMS)]


@dataclass(frozen=True)
class ExternalSolver(ExternalModel):
    """Finite elements solved by another program, on the mesh and with the loads of `fem`, assessed like any model.

    The mesh, supports and nodal forces are those of `fem(...)` with the same element, size and strain. Element
    formulation, quadrature, law and solver are those of the program. It runs in a separate process, with limits on
    time, memory and output, and with one thread unless more are requested; none of its code is imported.

    `calculix` has tet4, tet10, hex8 and hex20; at finite strain st_venant_kirchhoff, neo_hookean_isochoric,
    mooney_rivlin and yeoh. `felupe` has all five elements; neo_hookean and neo_hookean_isochoric, in bodies of one
    material. `scikit_fem` has all but hex20, and small strain only; `ngsolve` has tet4 and tet10, and small strain
    only. `dolfinx` has all but hex20; st_venant_kirchhoff, neo_hookean, neo_hookean_isochoric, stable_neo_hookean,
    mooney_rivlin, yeoh, gent and fung; it is searched for in each `python3` on the PATH, or only in the Python that the
    variable SOFTMARK_DOLFINX_PYTHON names, and compiles its forms during set-up. All these solve static problems with
    supports at nodes and dead loads.

    `febio` has tet4 and hex8, and finite strain only; `polyfem` has tet4 and, at small strain, straight tet10, with
    supports on whole facets, weight and uniform tractions on whole facets; `sofa` has tet4, in bodies of one material,
    with supports that do not move. At finite strain all three have st_venant_kirchhoff and neo_hookean. They read the
    files of `dsl export`. They were never run where softmark is developed and are therefore unchecked: their input
    files are tested as text, and reading their results on files that tests create following their source code.

    `mujoco`, `newton_vbd` and `newton_xpbd` integrate in time, and support only dynamic analyses of tet4 at finite
    strain. Their mechanical models are their own, and are assessed as such; the outline and `solve.means` describe
    them. Steps are of `step`, with `iterations` if they iterate. Damping is that of the analysis; the integrator is the
    program's, for MuJoCo explicit if that of the analysis is. Dynamic results are not checked in softmark's equations:
    references and other models assess them. A program whose steps end after a fixed number of iterations, whatever the
    residual, is `capped`.

    If the program cannot represent the scene exactly, nothing is approximated: the model is `unsupported`, with the
    reason, and validation reports W710. If it is not installed, the model is `skipped`, with a message on how to
    install it. If it hangs, crashes, writes too much output, runs out of memory or leaves no valid answer, the model is
    `failed`, with the last lines of its output. An exit status of 0 and its own log are not sufficient: its
    displacements are checked in softmark's own equations. If the remaining imbalance exceeds 1e-4 of the loads, in
    addition to the effect of rounding in its output, the model is `not_converged`; also if that rounding alone exceeds
    a tenth of the loads. Reactions and stress are computed from its displacements with softmark's law. Its stability
    and discretization error are unchecked.

    The solution time is taken from the program's own clock if it has one, else from its whole process, which is marked
    as an upper bound. Set-up, solution and file times are separate in the facts of the report.
    """

    # features that the program lacks are reported as unsupported, with all else that cannot be transferred
    capabilities = supported(*SOLID)
    resolution_fields = ("size",)
    loads = (*Model.loads, LineForce)

    program: Annotated[Word, "external program"]
    element: Annotated[str, "element", "element, as for `fem(...)`: tet4, tet10, hex8, hex20 or hex27"]
    strain: Annotated[Literal["small", "finite"], "strain measure"]
    size: Annotated[float | None, "m in (0, inf)", "target edge length of cells"] = None
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None
    mesh: Annotated[Any | None, "shape", "mesh from a file, used instead of a mesh of the body's shape"] = None
    time: Annotated[float, "s in (0, inf)", "limit of the program's wall-clock time"] = 60.0
    memory: Annotated[float, "1 in (0, 100000]", "limit of the program's address space, GB"] = 4.0
    threads: Annotated[int, "1 in [1, 256]", "number of threads that the program may use"] = 1
    step: Annotated[float | None, "s in (0, inf)", "time step of the program; default: that of the analysis"] = None
    iterations: Annotated[
        int | None, "1 in [1, 100000]", "iterations per time step; default: chosen by the program"
    ] = None

    @property
    def ours(self) -> Fem:
        """Our finite element model that defines the problem."""
        return self.solid

    @property
    def solid(self) -> Fem:
        """Our finite element model on the same mesh, which determines mesh, supports and loads."""
        mass: Any = "lumped" if self.program_entry.moves else "consistent"
        return Fem(self.element, self.strain, self.size, self.body, self.mesh, mass=mass)

    @property
    def constant(self) -> bool:  # type: ignore[override]
        """True if the stiffness is constant."""
        return self.solid.constant

    @property
    def own_mesh(self) -> Shape | None:
        """Mesh read from a file, which replaces a mesh generated from the body's shape; None if there is no file."""
        return self.mesh

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """Strain measure and formulation of our law, which is evaluated with the program's displacements."""
        return self.solid.stress_law

    def orders(self) -> dict[str, int]:
        """Return the convergence order of the element."""
        return self.solid.orders()

    def mesh_key(self) -> tuple[Any, ...]:
        """Return a key that is equal for models of a body that can share a mesh."""
        return self.solid.mesh_key()

    def mesh_words(self, case: Case) -> str:
        """Return a description of the mesh of the model."""
        return self.solid.mesh_words(case)

    def cuts(self, case: Case, shape: Shape | None = None) -> Cuts:
        """Return the planes and surfaces inside the body that its meshes must conform to."""
        return self.solid.cuts(case, shape)

    def reasons(self, case: Case) -> list[Reason]:
        """Return the features of the scene that the program cannot compute exactly, with reasons."""
        moves = bool(self.program_entry.moves)
        return [
            *problem_transfer.untransferable_features(self.solid, case, moves),
            *self._features_excluded_by_program(case),
            *self.invalid_step_options(case),
        ]

    def _features_excluded_by_program(self, case: Case) -> Iterator[Reason]:
        """Yield the features of a case that the table entry of the program excludes, with reasons."""
        program = self.program_entry
        if self.element not in program.elements:
            yield f"element = {self.element}", f"its adapter supports {', '.join(program.elements)}"
        if (why := program.save.get((self.element, self.strain))) is not None:
            yield f"{self.element} at {self.strain} strain", why
        laws = program.laws.get(self.strain, ())
        if not laws:
            yield f"strain = {self.strain}", f"its adapter supports strain = {' and '.join(program.laws)}"
            return
        for material in () if self.strain == "small" else case.materials:
            law = next((word for word, kind in MATERIALS.items() if type(material) is kind), type(material).__name__)
            if law not in laws:
                yield f"the law {law}", f"in finite strain its adapter supports {', '.join(laws)}"
        if len(case.materials) > 1 and not program.several:
            yield "several materials", "its adapter supports one material for the whole body"

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan` and the report."""
        means = f"; {self.program_entry.moves}" if self.program_entry.moves else ""
        means += "" if self.program_entry.tried else "; this adapter has never been run with the program"
        return f"{self.program_entry.title}: {self.solid.outline(case)}{means}"

    def kind(self, case: Case) -> ModelKind | None:
        """Return the kind of the model: its description without mesh size, the mesh size, and Poisson's ratio.

        The result is None if the mesh has no size, because it is read from a file.
        """
        solid = self.solid.kind(case)
        if solid is None:
            return None
        return replace(solid, words=f"{solid.words}, {self.program_entry.title}")
