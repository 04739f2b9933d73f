"""How much softer a body may be than its cells, of a model and what it found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.shared.graded import Part, moduli_of, moduli_vary, stiffness_of
from softmark.interpreter.models.shared.stiffness_bounds import ALL, energies, softness
from softmark.solvers.energies.energy import Floats

SOFTER = 0.01  # of the stiffness of a body: less goes without a warning


def softer_by(u: Floats, parts: Iterable[Part], pressures: bool) -> float:
    """The share of its stiffness that a body in displacements u (n, 3), m, may lack, for moduli that vary within cells."""
    lost = total = 0.0
    for own in parts:
        varies = moduli_vary(own.case)
        seen = stiffness_of(own.case, own.mesh, pressures) if varies else None
        if seen is None:
            young = getattr(own.case.material, "young", None)
            if not isinstance(young, float | int):
                return 0.0  # energies of its parts are not known on one scale
            total += energies(own.mesh, u, np.full(len(own.mesh.cells), float(young)), None)[1]
            continue
        found = softness(own.mesh, moduli_of(own.case.material, pressures), seen)
        more, whole = energies(own.mesh, u, np.abs(seen.means[0]), found)
        lost, total = lost + more, total + whole
    return min(ALL, lost / total) if total > 0.0 else 0.0


def softness_note(declared: Declared, u: Floats, parts: Sequence[Part]) -> Iterator[Diagnostic]:
    """A warning where a body may be softer than its cells, which do not see layers one behind the other."""
    share = softer_by(u, parts, declared.thing.formulation != "displacement")
    if share > SOFTER:
        yield diagnostic(
            "W401", declared.at("size" if declared.thing.own_mesh is None else "mesh"),
            f"`{declared.name}` may take `{parts[0].case.body.name}` for up to {100 * share / (1.0 - share):.3g} % stiffer than it"
            " is, for its moduli vary within cells",
            f"up to {100 * share:.3g} % of its stiffness",
            "cells cannot strain as softer and stiffer layers behind one another do: use a mesh whose cells are smaller"
            " than what varies",
        )  # fmt: skip
