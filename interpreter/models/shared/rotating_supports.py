"""Rotating supports: imposed displacements along circles, and options of models that exclude them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case
    from softmark.solvers.energies.energy import Floats, Ints
    from softmark.solvers.statics.winding_number import CellChain
else:
    from softmark.solvers.runtime.lazy_modules import np

STEP = math.radians(15.0)  # largest rotation in a load step: its chord is off the circle by 0.9 % of the radius
EARLY = 0.381966  # load fraction at which supports must also agree, because a full turn ends where it began


@dataclass(frozen=True)
class RotatedPoints:
    """Points X (k, 3), m, that one rotating support moves on circles.

    Each entry is one displacement component `along` (k,) of a point, with its index `places` (k,) in the imposed
    values.
    """

    support: Any
    places: Ints
    X: Floats
    along: Ints


@dataclass(frozen=True)
class RotationPath:
    """Imposed displacements as a function of the load fraction when supports rotate.

    Values of points on `circles` follow the rotation; the other values are proportional to `target` (c,). `chains` are
    chains of cells between supports, by which lost full turns are detected.
    """

    target: Floats
    circles: Sequence[RotatedPoints]
    chains: tuple[CellChain, ...] = ()  # chains of cells from support to support
    early = EARLY

    @property
    def largest_load_step(self) -> float:
        """Largest allowed load step, as a fraction of the full load."""
        return STEP / max(math.hypot(*own.support.rotation) for own in self.circles)

    def at(self, share: float) -> Floats:
        """Return the imposed values (c,), m or rad, at a load fraction `share`."""
        found: Floats = share * self.target
        for own in self.circles:
            found[own.places] = own.support.prescribed_displacements(own.X, share)[np.arange(len(own.along)), own.along]
        return found

    def lost_turn_message(self, x: Floats, share: float) -> str | None:
        """Return the reason why a state x (dofs,) lacks full turns that its supports have made; None if it has them."""
        u = x[: 3 * (len(x) // 3)].reshape(-1, 3)  # pressures come last
        return next((why for chain in self.chains if (why := chain.lost_turn_message(u, share))), None)


def rotation_path(owners: Mapping[int, Declared], held: Ints, points: Floats, per_node: int,
             target: Floats) -> RotationPath | None:  # fmt: skip
    """Return the path of imposed values of the `held` degrees of freedom (c,); None if no support rotates.

    `points` (n, 3), m, are the nodes, each with `per_node` degrees of freedom. `owners` has the support of each
    degree of freedom. Rotational degrees of freedom are not on circles.
    """
    own: dict[str, list[int]] = {}
    for number, dof in enumerate(held.tolist()):
        if owners[dof].thing.rotates and dof % per_node < 3:
            own.setdefault(owners[dof].name, []).append(number)
    circles = []
    for numbers in own.values():
        dofs = held[numbers]
        thing, places = owners[int(dofs[0])].thing, np.array(numbers, dtype=np.int64)
        circles.append(RotatedPoints(thing, places, points[dofs // per_node], dofs % per_node))
    return RotationPath(target, circles) if circles else None


def unsupported_reason(model: Any, case: Case) -> tuple[str, str] | None:
    """Return why options or the analysis exclude rotating supports, and the remedy; None if they do not."""
    analysis = case.analysis
    if isinstance(analysis, Dynamic):
        return None
    if model.may_be_unconverged:
        return "an iteration limit leaves no room for load steps", "remove `max_iterations` and `max_linear_iterations`"
    if analysis.path != "load":
        return "`path = arc_length` imposes displacements in proportion to the load", "use `path = load`"
    if analysis.disturbed != "none":
        return "a disturbed start may lead to another equilibrium path", "remove `disturbed`"
    return None
