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
from softmark.interpreter.models.shared.capabilities import SOLID_FEATURES, supported_features
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
    """Finite element model that another program solves, on the mesh and with the loads of `fem`.

    Give the `program`, and `element`, `strain` and `size` as for `fem(...)`. The mesh, supports and nodal forces
    are those of `fem(...)`; element formulation, quadrature, law and solver are those of the program. It must be
    installed. It runs in a separate process with limits on time, memory and output, and with one thread unless
    `threads` allows more.

    Static problems with supports at nodes and dead loads are solved by these programs:
      calculix    tet4, tet10, hex8, hex20; finite strain with st_venant_kirchhoff, neo_hookean_isochoric, mooney_rivlin
                  and yeoh
      felupe      all elements; neo_hookean and neo_hookean_isochoric, in bodies of one material
      scikit_fem  all elements but hex20; small strain only
      ngsolve     tet4 and tet10; small strain only
      dolfinx     all elements but hex20; st_venant_kirchhoff, neo_hookean, neo_hookean_isochoric, stable_neo_hookean,
                  mooney_rivlin, yeoh, gent and fung. It is searched for in each `python3` on the PATH, or only in the
                  Python that the variable SOFTMARK_DOLFINX_PYTHON names, and compiles its forms during set-up.

    Three further programs read the files of `dsl export`; at finite strain they have st_venant_kirchhoff and
    neo_hookean. softmark has never been tested with these programs installed, only with their file formats:
      febio       tet4 and hex8; finite strain only
      polyfem     tet4, and straight tet10 at small strain; supports, weight and uniform tractions on whole facets
      sofa        tet4, in bodies of one material; supports that do not move

    `mujoco`, `newton_vbd` and `newton_xpbd` integrate in time: they solve only dynamic analyses of tet4 at finite
    strain, with mechanical models of their own, which `dsl plan` and `solve.means` in the report describe. `step`
    is the time step, and `iterations` the number of iterations per step. Damping is taken from the analysis. The
    integrator is that of the program; for MuJoCo it is explicit if that of the analysis is. A program that ends
    each step after a fixed number of iterations has the status `capped`.

    Other outcomes: if the program cannot represent the scene exactly, the model is `unsupported`, with the reason
    (W710); if it is not installed, `skipped`, with a message on how to install it; if it crashes, exceeds a limit
    or gives no valid answer, `failed`, with the last lines of its output. Static displacements are inserted into
    softmark's equations. The model is `not_converged` if the imbalance exceeds 1e-4 of the loads and the rounding
    of the program's output, or if this rounding exceeds a tenth of the loads. Reactions and stress are computed
    from the displacements by softmark's law.

    Limits: dynamic results are not inserted into softmark's equations; compare them with references and other
    models. Stability and discretization error are not checked. The solution time is that of the program's own clock
    if it has one, else that of its whole process, which is marked as an upper bound. The report gives times of
    set-up, solution and files.
    """

    # features that the program lacks are reported as unsupported, with all else that cannot be transferred
    capabilities = supported_features(*SOLID_FEATURES)
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
        """softmark's own finite element model of the same problem, which determines mesh, supports and loads."""
        return self.solid

    @property
    def solid(self) -> Fem:
        """softmark's own finite element model on the same mesh, which determines mesh, supports and loads."""
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
