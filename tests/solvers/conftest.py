"""What the tests of the solvers share: energies, supports and problems of solids."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

from softmark.solvers.assembly import Assembly
from softmark.solvers.elements.interpolation import integration
from softmark.solvers.energies.elastic import Elastic
from softmark.solvers.energies.energy import Energy, VectorSpace
from softmark.solvers.energies.loads import DeadForces
from softmark.solvers.materials import MATERIALS, Law, law_for
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.statics import Statics


@pytest.fixture(scope="session")
def law() -> Callable[..., Law]:
    """A law by its name: `small`, `corotational`, or a material's own law of finite strain."""

    def make(name: str, young: float = 1.0, poisson: float = 0.3) -> Law:
        if name in MATERIALS:
            return law_for(MATERIALS[name](young, poisson, 1.0), "finite")
        return law_for(MATERIALS["linear_elastic"](young, poisson, 1.0), name)

    return make


@pytest.fixture(scope="session")
def elastic() -> Callable[[Mesh, Law], Elastic]:
    """The elastic energy of a law over the cells of a mesh."""

    def make(mesh: Mesh, law: Law) -> Elastic:
        parts = integration(mesh)
        return Elastic(mesh.cells, parts.dNdX, parts.w, law)

    return make


@pytest.fixture(scope="session")
def weight() -> Callable[[Mesh, tuple[float, float, float]], DeadForces]:
    """Forces of a body force b (N/m^3): a quarter of each cell's to each of its nodes."""

    def make(mesh: Mesh, b: tuple[float, float, float]) -> DeadForces:
        f = np.zeros_like(mesh.points)
        np.add.at(f, mesh.cells, (mesh.volumes / 4)[:, None, None] * np.array(b))
        return DeadForces(f.ravel())

    return make


@pytest.fixture(scope="session")
def problem() -> Callable[..., Statics]:
    """The static problem of an energy: `held` (n,) nodes or (n, 3) components are moved by `to` (n, 3)."""

    def make(
        mesh: Mesh,
        energy: Energy,
        held: np.ndarray,
        loads: Sequence[Energy] = (),
        to: Any = 0.0,
        **options: Any,
    ) -> Statics:
        chosen = np.broadcast_to(held if held.ndim == 2 else held[:, None], mesh.points.shape)
        fixed = np.flatnonzero(chosen.ravel())
        target = np.broadcast_to(to, mesh.points.shape)[chosen]
        dofs = mesh.points.size
        assembly = Assembly(dofs, fixed, [energy], loads)
        rest = options.pop("rest", np.zeros(dofs))
        return Statics(assembly, VectorSpace(dofs), rest, fixed, target, **options)

    return make
