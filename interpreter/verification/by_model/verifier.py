"""What can be said for the answers of a kind of model, and what is said where nothing is known of it."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.metrics.tensor_metrics import TensorMetric
from softmark.interpreter.models.postprocessing.nodal_forces import Wrench
from softmark.interpreter.models.shared.prepared_model import Prepared, Solution
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.verification import grid_convergence
from softmark.interpreter.verification.probe_errors import ProbeAnswer, Unknown
from softmark.interpreter.verification.solution_under_test import Answer
from softmark.interpreter.verification.unverified_models import Unchecked
from softmark.records import dataclass
from softmark.solvers.independent_forces.solid_forces import ForceBalance

FINER = 2.0  # how much coarser another mesh is
NEAR, APART = 1.25, 1.6  # times as many cells along an edge: less is the same mesh; from here on it will do


@dataclass(frozen=True)
class Found:
    """A solution that is looked at once more, and what it is one of."""

    scene: Scene
    declared: Declared
    case: Case
    prepared: Prepared
    solution: Solution
    known: dict[Any, Any] = field(default_factory=dict, compare=False)  # what was worked out of it, by what does so


class Voucher:
    """What vouches for a kind of model; nothing does but what its own class says otherwise."""

    holds = False  # its nodes are exactly where supports ask for them
    order = 2.0  # in displacements, that coarser solutions are held to

    # ------------------------------------------------------------------ forces

    def facts(self, found: Found) -> dict[str, Any]:
        """What the report says of a solution beside its balance of forces."""
        return {}

    def balance(self, found: Found) -> tuple[ForceBalance, float | None]:
        """Its forces found again by other formulas, and what its solver claims of them. Raises Unchecked."""
        raise Unchecked(found.declared.thing.forceless or "there is no other formula for this model")

    def reactions(self, found: Found) -> tuple[dict[str, Wrench], float]:
        """What every support does, by the same formulas, and what rounding may make of it, N. Raises Unchecked."""
        raise Unchecked("there is no other formula for this model")

    def rounding(self, found: Found) -> float:
        """The estimated rounding of the internal forces of cells, N; 0 if nothing is known of it. Raises Unchecked."""
        return 0.0

    # ------------------------------------------------------------------ the error that it states

    def discretisation(self, answer: Answer, seen: ProbeAnswer) -> float:
        """How far what is seen is from the limit of refinement. Raises Unknown."""
        return from_coarser(self.coarser(answer), seen, self.order, answer)

    def loads_left(self, answer: Answer, seen: ProbeAnswer, missing: float) -> float:
        """Return the part of the relative load error `missing` that the discretisation error does not contain."""
        return missing

    def is_singular(self, answer: Answer, seen: ProbeAnswer) -> bool:
        """Return whether a stress or strain seems to have no limit under refinement at the probe; True if unknown."""
        return True

    def coarser(self, answer: Answer) -> list[tuple[Solution, float]]:
        """The same, coarser once or twice, with how many times coarser each is than the last. Raises Unknown."""
        raise Unknown("no coarser one of its kind is known")

    def model(self, answer: Answer, seen: ProbeAnswer) -> float:
        """How far the limit of refinement is from the body. Raises Unknown."""
        raise Unknown("nothing is known of this kind of model")

    def cells(self, answer: Answer) -> int:
        """How many parts of equal standing the body is cut into."""
        return max(1, int(answer.result.size.get("elements", 1)))


def from_coarser(coarser: list[tuple[Solution, float]], seen: ProbeAnswer, order: float, answer: Answer) -> float:
    """The error of what is seen, from one or two coarser solutions and the order in theory. Raises Unknown."""
    (first, ratio), *second = coarser
    near = seen.of(first)
    apart = seen.apart(near)
    grid_convergence.must_tell([apart], seen.beside(apart))
    farther = None
    if second and abs(second[0][1] - ratio) <= 0.25 * ratio:
        far = near.of(second[0][0])
        farther = near.apart(far)
        if isinstance(seen.metric, TensorMetric):  # three numbers do not agree by chance, and tensors need not
            apart, farther = seen.change(near), near.change(far)
    if seen.in_forces and answer.case.contacts:
        from softmark.interpreter.verification import contact_error

        found = contact_error.index(answer, seen, apart, ratio, farther)
        grid_convergence.must_tell([found], seen.beside(apart), grid_convergence.HOPELESS)
        return found
    if seen.in_forces and farther is not None and farther > apart * ratio ** (order + grid_convergence.NEAR):
        apart = farther / ratio  # closer than any order says: an energy may pass its limit, and come back
    found = grid_convergence.index(apart, ratio, order, farther)
    grid_convergence.must_tell([found], seen.beside(apart), grid_convergence.HOPELESS)
    return found


class Sized(Voucher):
    """Of models on meshes that aim at a size."""

    def coarser(self, answer: Answer) -> list[tuple[Solution, float]]:
        """On meshes of twice and four times the size. Raises Unknown."""
        if answer.solid.thing.size is None:
            raise Unknown("its mesh is that of a file, and there is no coarser one")
        found: list[tuple[Solution, float]] = []
        cells = self.cells(answer)
        for factor in (FINER, FINER**2):
            try:
                costs = factor**-2.0  # cells in space cost more, time and what is done once less
                solution, size = answer.solved(f"size {factor:g}", answer.sized(factor), answer.own, costs)
            except Unknown:
                if not found:
                    raise
                break
            ratio = (cells / max(1, size["elements"])) ** (1.0 / 3.0)
            if ratio < (APART if factor > FINER else NEAR):
                break
            found.append((solution, ratio))
            cells = max(1, size["elements"])
        if not found:
            raise Unknown("a coarser mesh is the same one")
        return found
