"""Warnings that a body may be softer or stiffer than its mesh, because moduli vary within cells."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.heterogeneous_material import Part, moduli_of, moduli_vary, stiffness_of
from softmark.interpreter.models.shared.stiffness_bounds import (
    ALL,
    Moduli,
    excess_and_total_energy,
    pressure_energies,
    stiffness_loss,
)
from softmark.interpreter.models.shared.varying_quadrature import CellQuadrature
from softmark.solvers.energies.energy import Floats

SOFTER = 0.01  # of the stiffness of a body: a smaller difference causes no warning


def softer_by(u: Floats, parts: Iterable[Part], pressures: bool) -> float:
    """Return the largest fraction by which the body may be softer than its mesh.

    A mesh is too stiff if moduli vary within its cells. Stiffness is measured by the energy of the displacements
    u (n, 3), m.
    """
    lost = total = 0.0
    for own in parts:
        varies = moduli_vary(own.case)
        seen = stiffness_of(own.case, own.mesh, pressures) if varies else None
        if seen is None:
            young = getattr(own.case.material, "young", None)
            if not isinstance(young, float | int):
                return 0.0  # the energies of its parts cannot be compared
            total += excess_and_total_energy(own.mesh, u, np.full(len(own.mesh.cells), float(young)), None)[1]
            continue
        found = stiffness_loss(own.mesh, moduli_of(own.case.material, pressures), seen)
        more, whole = excess_and_total_energy(own.mesh, u, np.abs(seen.means[0]), found)
        lost, total = lost + more, total + whole
    return min(ALL, lost / total) if total > 0.0 else 0.0


def stiffer_by(u: Floats, parts: Iterable[Part], p: Floats | None) -> float:
    """Return the largest fraction by which the body may be stiffer than its mesh.

    Stiffness is the energy in displacements u (n, 3), m. p (m, b), Pa, are the pressures of m cells. If the bulk
    modulus varies within a cell, the pressures of the mesh correspond to its harmonic mean over the cell. In a body,
    the effective bulk modulus is at most the arithmetic mean, which it has under uniform dilatation. The bound follows
    from these two means.
    """
    lost = total = 0.0
    for own in parts:
        varies = moduli_vary(own.case)
        seen = stiffness_of(own.case, own.mesh, True) if varies else None
        means = _cell_mean_moduli(own, seen)
        if means is None:
            return 0.0  # the energies of its parts cannot be compared
        more, whole = pressure_energies(own.mesh, u, None if p is None else p[own.which], means)
        lost, total = lost + (more if varies else 0.0), total + whole
    return lost / total if total > 0.0 else 0.0


def _cell_mean_moduli(own: Part, seen: CellQuadrature | None) -> Moduli | None:
    """Return the cell means of the moduli of a material; None if the material has no Young's modulus."""
    young, nu = (getattr(own.case.material, name, None) for name in ("young", "poisson"))
    ones = np.ones(len(own.mesh.cells))
    if seen is None:
        if not (isinstance(young, float | int) and isinstance(nu, float | int)):
            return None
        return Moduli(young / (2.0 + 2.0 * nu) * ones, 3.0 * (1.0 - 2.0 * nu) / young * ones, ones)
    (modulus, inverse), *_ = moduli_of(own.case.material, True).inverses
    spread = seen.means[modulus] * seen.means[inverse]
    if isinstance(nu, float | int):
        return Moduli(seen.means[0] / (2.0 + 2.0 * nu), 3.0 * (1.0 - 2.0 * nu) * seen.means[1], spread)
    return Moduli(seen.means[0], seen.means[1], spread)


def softness_note(
    declared: Declared, u: Floats, parts: Sequence[Part], p: Floats | None = None
) -> Iterator[Diagnostic]:
    """Yield warnings that the body may be softer or stiffer than its mesh, because moduli vary within cells.

    u (n, 3), m, are nodal displacements and p (m, b), Pa, the pressures of cells.
    """
    pressures = declared.thing.formulation != "displacement"
    stiffer = stiffer_by(u, parts, p) if pressures else 0.0
    if stiffer > SOFTER:
        yield diagnostic(
            "W401", declared.at("formulation"),
            f"`{declared.name}` may underestimate the stiffness of `{parts[0].case.body.name}`, since its "
            "moduli vary inside cells and the pressure interpolation does not follow them",
            f"up to {100 * stiffer:.3g} % too soft",
            "use cells smaller than the variation, or remove `formulation` where Poisson's ratio is not "
            "near 0.5",
        )  # fmt: skip
    share = softer_by(u, parts, pressures)
    if share > SOFTER:
        yield diagnostic(
            "W401", declared.at("size" if declared.thing.own_mesh is None else "mesh"),
            f"`{declared.name}` may overestimate the stiffness of `{parts[0].case.body.name}` by up to "
            f"{100 * share / (1.0 - share):.3g} %, since its moduli vary inside cells",
            f"up to {100 * share:.3g} % of the computed stiffness",
            "use cells smaller than the variation: one cell cannot strain like soft and stiff layers in "
            "series",
        )  # fmt: skip
