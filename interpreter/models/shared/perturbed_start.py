"""Static analyses from a perturbed start: which models support them, and how each model is perturbed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.capabilities import PERTURBED_STARTS, unsupported_feature_errors
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.energies.elastic_energy import Elastic
    from softmark.solvers.energies.energy import Floats, Ints
    from softmark.solvers.statics.static_equilibrium import Equilibrium, Statics


@dataclass(frozen=True)
class Disturbance:
    """Perturbation of the start state: its `kind`, its `amount` and the `seed` of the random numbers."""

    kind: str
    amount: float
    seed: int


def disturbance_of(case: Case) -> Disturbance | None:
    """Return the perturbation of a case; None if there is none."""
    analysis: Any = case.analysis
    kind = analysis.disturbed
    return None if kind == "none" else Disturbance(kind, analysis.amount, analysis.seed)


def check_perturbed_start(scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
    """Return the errors of a model in a case with a perturbed start."""
    known = disturbance_of(case)
    if known is None:
        return []
    model, word = declared.thing, f"`disturbed = {known.kind}`"
    if refused := list(unsupported_feature_errors(declared, case, (PERTURBED_STARTS,))):
        return refused
    found = []
    for field in model.shortcuts:
        problem = f"{word} needs every step solved in double precision from the disturbed state: remove `{field}`"
        found.append(diagnostic("E571", declared.at(field), problem, "not with `disturbed`", "leave it out"))
    if case.analysis.path != "load":
        problem = f"`path = arc_length` follows equilibria from rest, but {word} starts far from equilibrium"
        analysis = next(iter(scene.of_kind("analysis").values()))
        found.append(diagnostic("E571", analysis.at("path"), problem, "only one of the two", "remove one of the two"))
    return found


def perturbed_solid_state(known: Disturbance, problem: Statics, points: Floats, cells: Ints) -> Floats:
    """Return a perturbed state (dofs,) with displacements, m, that satisfy the supports; other unknowns are 0."""
    import numpy as np

    from softmark.solvers.statics.perturbed_states import PerturbedNodes, perturb

    x = np.zeros(len(problem.rest))
    x[: points.size] = (perturb(known.kind, PerturbedNodes(points, cells, known.amount), known.seed) - points).ravel()
    x[problem.fixed] = problem.rest[problem.fixed] + problem.target
    return x


def recover_solid(known: Disturbance, problem: Statics, points: Floats, elastic: Elastic) -> Equilibrium:
    """Return the equilibrium that a solid reaches from its perturbed start. Raises NotConverged."""
    from softmark.solvers.statics.recovery_from_perturbation import (
        PerturbedBody,
        find_inverted_cells,
        recover_equilibrium,
    )

    state = perturbed_solid_state(known, problem, points, elastic.cells)
    displacements = points.size  # the first unknowns
    return recover_equilibrium(
        problem,
        PerturbedBody(
            state, elastic, lambda x: find_inverted_cells(elastic, x[:displacements]), len(elastic.cells), known.seed
        ),
    )


def recover_spring_equilibrium(known: Disturbance, problem: Statics, points: Floats, elastic: Elastic) -> Equilibrium:
    """Return the equilibrium that a spring network reaches from its perturbed start. Raises NotConverged.

    `elastic` provides the cells of the network; its law is not used. Springs do not distinguish the inside of a
    cell from its outside: only their own energy guides the solution, and a network that has folded is reported.
    """
    from softmark.solvers.statics.recovery_from_perturbation import (
        PerturbedBody,
        find_inverted_cells,
        recover_equilibrium,
    )

    state = perturbed_solid_state(known, problem, points, elastic.cells)
    tangled = PerturbedBody(state, None, lambda x: find_inverted_cells(elastic, x), len(elastic.cells), known.seed)
    return recover_equilibrium(problem, tangled)


def recover_rod(known: Disturbance, problem: Statics, rest: Floats) -> Equilibrium:
    """Return the equilibrium that a rod reaches from its perturbed start. Raises NotConverged.

    The cross-sections are also rotated at random if the kind of perturbation is `scrambled` or `spun`.
    """
    import numpy as np

    from softmark.solvers.energies.rod_state import chain_elements
    from softmark.solvers.statics.perturbed_states import PerturbedNodes, perturb
    from softmark.solvers.statics.recovery_from_perturbation import PerturbedBody, recover_equilibrium

    nodes = rest.reshape(-1, 7)
    body = PerturbedNodes(nodes[:, :3], chain_elements(len(nodes)), known.amount)
    x = nodes.copy()
    x[:, :3] = perturb(known.kind, body, known.seed)
    if known.kind in ("scrambled", "spun"):
        q = np.random.default_rng([known.seed, 2]).standard_normal((len(nodes), 4))
        x[:, 3:] = q / np.linalg.norm(q, axis=1, keepdims=True)
    held = np.zeros((len(nodes), 6), dtype=np.bool_)
    held.ravel()[problem.fixed] = True
    x[:, :3][held[:, :3]] = nodes[:, :3][held[:, :3]]
    x[held[:, 3:].any(axis=1), 3:] = nodes[held[:, 3:].any(axis=1), 3:]
    d = np.zeros(problem.space.dofs)
    d[problem.fixed] = problem.target
    return recover_equilibrium(problem, PerturbedBody(problem.space.move(x.ravel(), d), seed=known.seed))
