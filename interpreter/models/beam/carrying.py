"""What acts at the nodes of a beam at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.answers.carried import Carried
from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import Energy, Floats
from softmark.solvers.energies.rod import RodElastic
from softmark.solvers.energies.rod_rotation import rotation


def on_rod(assembly: Assembly, rest: Floats, x: Floats, loads: Sequence[tuple[Declared, Energy]]) -> Carried:
    """Of a state x (nodes * 7,); moments are about the material axes, as the solver's are."""
    nodes, start = x.reshape(-1, 7), rest.reshape(-1, 7)
    left = assembly.gradient(x, 1.0).reshape(-1, 6)
    own = {load.name: acting(energy, x) for load, energy in loads}
    energy = sum(_energy(e, x) for e in assembly.internal if isinstance(e, RodElastic))
    u = nodes[:, :3] - start[:, :3]
    work = {load.name: -e.value(x) if e.conservative else None for load, e in loads}
    return Carried(start[:, :3], u, nodes[:, :3], left, own, float(energy), work, rotation(nodes[:, 3:]))


def acting(load: Energy, x: Floats) -> Floats:
    """Forces and moments about the material axes of a load in a state x (n, 6)."""
    g = np.zeros(x.size // 7 * 6)
    load.add_gradient(x, g)
    return -g.reshape(-1, 6)


def _energy(elastic: RodElastic, x: Floats) -> float:
    """Strain energy, J, of the modes that have any: those that are switched off are constraints."""
    modes = elastic.mode_energies(x)
    modes[list(elastic.stiffness.rigid)] = 0.0
    return float(modes.sum())
