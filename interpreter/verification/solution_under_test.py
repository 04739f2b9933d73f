"""Solution whose error is estimated: a model, its solution, and other solutions compared with it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models.postprocessing.mesh_stress import add_stress
from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.problem.body_case import Case, Fault, case_for
from softmark.interpreter.results.run_report import ModelResult
from softmark.interpreter.verification.estimation_budget import Budget
from softmark.interpreter.verification.probe_errors import Floats, NoErrorEstimate
from softmark.interpreter.vocabulary.analysis_words import Dynamic

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh

OTHERS = 0.8  # solutions reserved for coarser meshes, if a finer space costs too much, and for other error parts
LONGER = 0.75  # solutions reserved for time steps of twice and four times the length
FACTORED = 300_000  # unknowns up to which a tangent is factored


@dataclass
class SolutionUnderTest:
    """Model and solution whose error is estimated; each further solution for comparison is computed once."""

    scene: Scene
    declared: Declared
    case: Case
    prepared: Prepared
    result: ModelResult
    measured: Mapping[str, Any]
    mesh: DeformedMesh | None
    asked: bool = True
    earlier: SolutionUnderTest | None = None  # the same model in the state before
    _kept: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def budget(self) -> Budget:
        """Nominal CPU time that may be spent on the error estimate."""
        return Budget.of(self.result.solve, self.asked)

    @property
    def dimension(self) -> float:
        """Number of directions in which cells divide the body: 2 for a plane body, else 3."""
        return 2.0 if self.case.planar else 3.0

    @property
    def in_time(self) -> bool:
        """True if the solution is a sequence of time steps, which have an error of their own."""
        return isinstance(self.case.analysis, Dynamic) or self.case.has_material_history

    @property
    def reserved_solution_cost(self) -> float:
        """Cost reserved for solutions that other error parts than finer cells need, relative to this solution."""
        return OTHERS + (LONGER if self.in_time else 0.0)

    @property
    def setup_and_solve_fraction(self) -> float:
        """Fraction of the solution's nominal CPU time for building the model and solving one linear system."""
        took = self.result.solve.get("nominal_cpu_s") or {"setup": 0.0, "solve": 0.0}
        whole, systems = sum(took.values()), max(1, int(self.result.solve.get("iterations") or 1))
        return (took["setup"] + took["solve"] / systems) / whole if whole > 0.0 else 1.0

    @property
    def solid(self) -> Declared:
        """Declaration of the model, or of the full model from which it was reduced."""
        of = self.declared.thing.reduces
        return self.declared if of is None else self.scene.declared[of]

    def once(self, key: str, make: Callable[[], Any]) -> Any:
        """Return the result of `make`, computed once for each `key`. Raises NoErrorEstimate, also on later calls."""
        if key not in self._kept:
            try:
                self._kept[key] = make()
            except NoErrorEstimate as unknown:
                self._kept[key] = unknown
            except Fault as refused:
                self._kept[key] = NoErrorEstimate(refused.diagnostic.message)
            except Exception as error:
                if os.environ.get("SOFTMARK_DEBUG"):
                    raise
                self._kept[key] = NoErrorEstimate(
                    f"another solution stopped with an error ({type(error).__name__}: {error})"
                )
        if isinstance(self._kept[key], NoErrorEstimate):
            raise self._kept[key]
        return self._kept[key]

    def solve_other_model(
        self,
        key: str,
        declared: Declared,
        case: Case,
        costs: float = 1.0,
        slight: bool = False,
        mesh: Callable[[], Mesh] | None = None,
    ) -> tuple[Solution, dict[str, int]]:
        """Solve another model, once for each `key`, and return its solution and size. Raises NoErrorEstimate.

        `costs` is its cost relative to this solution; if it is `slight`, no request is needed. `mesh` makes its mesh,
        unless the mesh follows from its cell size. If a state depends on earlier ones, the model is solved in these as
        well.
        """

        def solve() -> tuple[Solution, dict[str, int]]:
            before = self._previous_state_of(key, case)
            self.budget.must_hold(costs, slight)
            from softmark.interpreter.models.model_preparation import prepared_model

            workshop = BuildContext(scene=self.scene, measured=self.measured)
            if mesh is not None:
                workshop.meshes[declared.thing.meshed_as(case)] = mesh()
            prepared, _ = prepared_model(declared, case, workshop)
            begun = prepared if before is None else prepared.after(before)
            with np.errstate(all="ignore"):
                found = begun.solve(self.budget.check)
            found = replace(found, at_rest=forces_and_energies(declared, case, prepared, found))
            return add_stress(self.scene, declared, case, found), dict(prepared.size)

        solution, size = self.once(key, solve)
        if solution.displacement is None:
            raise NoErrorEstimate(f"the same model on another mesh has no solution ({solution.message})")
        return solution, size

    def _previous_state_of(self, key: str, case: Case) -> DeformedMesh | None:
        """Return the previous state of another model if states depend on earlier ones, else None.

        Raises NoErrorEstimate.
        """
        if self.earlier is None or not case.has_history:
            return None
        known = self.earlier._kept.get(key)
        if isinstance(known, NoErrorEstimate):
            raise known
        # time starts from zero again, the sequence of states does not
        if known is None and not case.has_material_history:
            raise NoErrorEstimate("the previous states were not solved again on the other mesh")
        return None if known is None else known[0].mesh

    def choose_for_all_states(self, key: str, choice: bool) -> bool:
        """Return a choice that is made once for all states: the one made in the previous state, else `choice`."""
        known = {} if self.earlier is None else self.earlier._kept
        found: bool = self._kept.setdefault(key, known.get(key, choice))
        return found

    @property
    def own(self) -> Case:
        """Case of the full model, with the material that the model declares, if any."""
        return case_for(self.scene, self.solid)

    def sized(self, factor: float, **changes: Any) -> Declared:
        """Return the declaration of the full model with its cell size times a factor, and with other changes."""
        size = {} if factor == 1.0 else {"size": self.solid.thing.size * factor}
        return replace(self.solid, thing=self.solid.thing.plain(**size, **changes))

    def require_deformed_mesh(self, costs: float = 1.0) -> DeformedMesh:
        """Return the deformed mesh. Raises NoErrorEstimate if it is unknown or the budget is too small.

        The budget must allow work that costs `costs` times as much as the solution.
        """
        self.budget.must_hold(costs)
        if self.mesh is None:
            raise NoErrorEstimate("the nodal displacements are not known")
        return self.mesh

    def next_step(self) -> Floats | None:
        """Return the nodal displacements of the next Newton step (n, 3), m; None if not known.

        Raises NoErrorEstimate.
        """
        if self.mesh is not None and self.mesh.left is not None:
            return self.mesh.left
        full = self._full_assembly
        if full is None or len(full.free) > FACTORED:
            return None
        self.budget.must_hold(0.5)
        x, (assembly, found) = self.state, self.tangent()
        d = np.zeros_like(x)
        d[assembly.free] = -found.solve(assembly.gradient(x, 1.0)[assembly.free])
        return d.reshape(-1, 3)

    @property
    def _full_assembly(self) -> Any:
        """Return the assembly with all degrees of freedom, also for a reduced model; None if there is none."""
        full = self.prepared.assembly
        return None if full is None or self.mesh is None or full.dofs != self.mesh.displacement.size else full

    @property
    def state(self) -> Floats:
        """Displacements of all nodes (3 n,), m."""
        if self.mesh is None:
            raise NoErrorEstimate("the nodal displacements are not known")
        return np.ascontiguousarray(self.mesh.displacement, dtype=np.float64).ravel()

    def tangent(self) -> tuple[Any, Any]:
        """Return the assembly, and a factor of its tangent in the found state. Raises NoErrorEstimate."""
        from softmark.solvers.linear.factorisations import Singular, factor

        def find() -> tuple[Any, Any]:
            assembly = self._full_assembly
            if assembly is None:
                raise NoErrorEstimate("the stiffness does not depend on the displacements only")
            try:
                return assembly, factor(assembly.tangent(self.state, 1.0), symmetric=assembly.conservative)
            except Singular as error:
                raise NoErrorEstimate(f"the tangent stiffness is singular ({error})") from error

        found: tuple[Any, Any] = self.once("tangent", find)
        return found
