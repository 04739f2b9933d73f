"""Answer under error estimation: a model, its solution, and other solutions compared with it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models.postprocessing.mesh_stress import add_stress
from softmark.interpreter.models.postprocessing.reaction_and_work import forces_and_energies
from softmark.interpreter.models.shared.prepared_model import BuildContext, DeformedMesh, Prepared, Solution
from softmark.interpreter.problem.body_case import Case, Fault, case_for
from softmark.interpreter.results.run_report import ModelResult
from softmark.interpreter.verification.estimation_budget import Budget
from softmark.interpreter.verification.probe_errors import Floats, NoErrorEstimate

FACTORED = 300_000  # unknowns up to which a tangent is factored


@dataclass
class SolutionUnderTest:
    """Data of one model for its error estimate; other solutions are computed once."""

    scene: Scene
    declared: Declared
    case: Case
    prepared: Prepared
    result: ModelResult
    measured: Mapping[str, Any]
    mesh: DeformedMesh | None
    asked: bool = True
    _kept: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def budget(self) -> Budget:
        """CPU time that may be spent on it."""
        return Budget.of(self.result.time, self.asked)

    @property
    def system(self) -> float:
        """Fraction of the whole solution's CPU time that building the model and solving one of its systems took."""
        took = {n: t.median if (t := self.result.time.get(n)) else 0.0 for n in ("setup_cpu_s", "solve_cpu_s")}
        whole, systems = sum(took.values()), max(1, int(self.result.solve.get("iterations") or 1))
        return (took["setup_cpu_s"] + took["solve_cpu_s"] / systems) / whole if whole > 0.0 else 1.0

    @property
    def solid(self) -> Declared:
        """Model itself, or the full model of a reduced one."""
        of = self.declared.thing.reduces
        return self.declared if of is None else self.scene.declared[of]

    def once(self, key: str, make: Callable[[], Any]) -> Any:
        """Return the result of `make`, computed once. Raises NoErrorEstimate, again if it did before."""
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

    def solved(
        self, key: str, declared: Declared, case: Case, costs: float = 1.0, slight: bool = False
    ) -> tuple[Solution, dict[str, int]]:
        """Solve another model, which `costs` so many times this solution; return it and its size.

        Raises NoErrorEstimate.
        """

        def solve() -> tuple[Solution, dict[str, int]]:
            self.budget.must_hold(costs, slight)
            from softmark.interpreter.models.model_preparation import prepared_model

            prepared, _ = prepared_model(declared, case, BuildContext(scene=self.scene, measured=self.measured))
            with np.errstate(all="ignore"):
                found = prepared.solve(self.budget.check)
            found = replace(found, at_rest=forces_and_energies(declared, case, prepared, found))
            return add_stress(self.scene, declared, case, found), dict(prepared.size)

        solution, size = self.once(key, solve)
        if solution.displacement is None:
            raise NoErrorEstimate(f"the same model on another mesh has no solution ({solution.message})")
        return solution, size

    @property
    def own(self) -> Case:
        """Case of the solid, with its own material if it has one."""
        return case_for(self.scene, self.solid)

    def sized(self, factor: float, **changes: Any) -> Declared:
        """Return the solid with its size times a factor."""
        size = {} if factor == 1.0 else {"size": self.solid.thing.size * factor}
        return replace(self.solid, thing=self.solid.thing.plain(**size, **changes))

    def on_nodes(self, costs: float = 1.0) -> DeformedMesh:
        """Return the deformed mesh for work that `costs` so many times the solution. Raises NoErrorEstimate."""
        self.budget.must_hold(costs)
        if self.mesh is None:
            raise NoErrorEstimate("the nodal displacements are not known")
        return self.mesh

    def next_step(self) -> Floats | None:
        """Return the next Newton step (n, 3); None if not known. Raises NoErrorEstimate."""
        if self.mesh is not None and self.mesh.left is not None:
            return self.mesh.left
        full = self._full
        if full is None or len(full.free) > FACTORED:
            return None
        self.budget.must_hold(0.5)
        x, (assembly, found) = self.state, self.tangent()
        d = np.zeros_like(x)
        d[assembly.free] = -found.solve(assembly.gradient(x, 1.0)[assembly.free])
        return d.reshape(-1, 3)

    @property
    def _full(self) -> Any:
        """Return the assembly of all displacements, for a reduced model the full one; None if there is none."""
        full = self.prepared.assembly
        return None if full is None or self.mesh is None or full.dofs != self.mesh.displacement.size else full

    @property
    def state(self) -> Floats:
        """Displacements of all nodes (3 n,), m."""
        if self.mesh is None:
            raise NoErrorEstimate("the nodal displacements are not known")
        return np.ascontiguousarray(self.mesh.displacement, dtype=np.float64).ravel()

    def tangent(self) -> tuple[Any, Any]:
        """Return the assembly and a factor of its tangent in the state. Raises NoErrorEstimate."""
        from softmark.solvers.linear.factorisations import Singular, factor

        def find() -> tuple[Any, Any]:
            assembly = self._full
            if assembly is None:
                raise NoErrorEstimate("its stiffness does not depend on displacements only")
            try:
                return assembly, factor(assembly.tangent(self.state, 1.0), symmetric=assembly.conservative)
            except Singular as error:
                raise NoErrorEstimate(f"its tangent is singular ({error})") from error

        found: tuple[Any, Any] = self.once("tangent", find)
        return found
