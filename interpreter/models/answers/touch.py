"""What a contact comes to in a state, and what presses where."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.models.shared.contacting import plane_modulus
from softmark.interpreter.results.reactions import Touch
from softmark.records import dataclass
from softmark.solvers.contact.pressing import Pressing
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.interpreter.problem.case import Case
    from softmark.interpreter.results.loads import Vector
    from softmark.solvers.contact.touching import Touching

ON = 1e-3  # of the extent of the surface: a point that is farther from it is not on it


@dataclass(frozen=True)
class Surface:
    """A surface at rest at X (n, 3), m, and what presses on it; `may` are the nodes (m,) that may touch."""

    X: Floats
    may: Ints
    pressing: Pressing

    @cached_property
    def at_nodes(self) -> Mapping[str, Floats]:
        """`pressure`, Pa, and `gap`, m, at all nodes (n,)."""
        own = np.full(len(self.X), np.nan)
        own[self.may] = self.pressing.g[self.may]
        return {"pressure": self.pressing.pressures, "gap": own}

    def pressure(self, point: Vector) -> float | None:
        """At a material point, m: Pa, linear on triangles. None where it is not on the surface."""
        from softmark.solvers.contact.gaps.surface import shares

        split = np.array(self.pressing.plain.halves)
        triangles = self.pressing.corners[:, split].reshape(-1, 3)
        X = self.X[triangles]
        share = shares(np.broadcast_to(np.array(point), (len(X), 3)), X)
        far = np.linalg.norm(np.einsum("tk,tki->ti", share, X) - np.array(point), axis=1)
        nearest = int(far.argmin())
        if far[nearest] > ON * float(np.linalg.norm(np.ptp(X.reshape(-1, 3), axis=0))):
            return None
        return float(share[nearest] @ self.pressing.pressures[triangles[nearest]])


def touch_of(case: Case, contact: Touching, X: Floats, x: Floats, u: Floats) -> Touch:
    """What a contact comes to, of nodes at X (n, 3), m, that are taken to be at x (n, 3) when moved by u (3 n,)."""
    f, g = np.zeros(len(X)), np.full(len(X), np.inf)
    g[contact.nodes] = contact.gaps(u)
    f[contact.nodes] = contact.A * contact.pressures(u)
    assert contact.facets is not None
    own = Pressing(contact.facets, x, f, g, plane_modulus(case), case.depth)
    return Touch(own.area, own.largest, float(g.min()), own.left, Surface(X, contact.nodes, own))
