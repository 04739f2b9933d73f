"""How supports hold a body: selections, values on degrees of freedom, conflicts, and motions left free."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softmark.interpreter.case import Case, Fault, fault, reach
from softmark.interpreter.models.rigid import free_motions, point_rows
from softmark.interpreter.scene import Declared
from softmark.interpreter.vocabulary.supports import Displaced
from softmark.solvers.energies.energy import Floats, Ints

if TYPE_CHECKING:
    from softmark.solvers.mesh.mesh import Mesh


def selected(case: Case, owner: Declared, points: Floats, what: str) -> np.ndarray:
    """Which of the points (n, 3) a support or load selects (n,). Raises Fault if none or all are."""
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    x, y, z = points.T
    held: np.ndarray = np.asarray(owner.thing.where.holds(x, y, z, extent))
    if not held.any():
        spans = reach(points.min(axis=0).tolist(), points.max(axis=0).tolist())
        raise fault(
            "E302",
            owner.at("where"),
            f"`{owner.name}` selects no {what} of the mesh of `{case.body.name}`",
            "selects nothing",
            f"the mesh spans {spans}, and a thin selection may lie between its points",
        )
    if held.all():
        raise fault(
            "E303",
            owner.at("where"),
            f"`{owner.name}` selects every {what} of `{case.body.name}`",
            "selects everything",
            "nothing would be left to deform; select a part of the body",
        )
    return held


def solid_supports(case: Case, mesh: Mesh) -> tuple[Ints, Floats]:
    values: dict[int, tuple[float, Declared]] = {}
    rows = [np.zeros((0, 6))]
    for support in case.supports:
        nodes = np.nonzero(selected(case, support, mesh.points, "point"))[0]
        by = support.thing.by if isinstance(support.thing, Displaced) else (0.0, 0.0, 0.0)
        rows.append(point_rows(mesh.points[nodes] - mesh.points.mean(axis=0), support.thing.components))
        for c in support.thing.components:
            for dof in 3 * nodes + c:
                known = values.setdefault(int(dof), (by[c], support))
                if known[0] != by[c]:
                    raise conflict(known[1], support)
    must_be_held(case, np.concatenate(rows) / mesh.extent ** np.array([0, 0, 0, 1, 1, 1]))
    fixed = np.array(sorted(values), dtype=np.int64)
    return fixed, np.array([values[d][0] for d in fixed.tolist()])


def conflict(first: Declared, second: Declared) -> Fault:
    """Two supports that impose different values on one degree of freedom."""
    problem = f"`{first.name}` and `{second.name}` hold the same points to different values"
    return fault(
        "E305",
        second.at("where"),
        problem,
        "contradicts the other",
        "select different points or different components",
    )


def must_be_held(case: Case, rows: Floats) -> None:
    """Raise a Fault where the supports leave a rigid motion."""
    motions = free_motions(rows)
    if not motions:
        return
    at = case.supports[0].at() if case.supports else case.body.at()
    free = " and to ".join((", ".join(motions[:-1]), motions[-1])) if len(motions) > 1 else motions[0]
    raise fault(
        "E306",
        at,
        f"the supports of `{case.body.name}` leave it free to {free}",
        "not held enough",
        "hold more components, or more of the body",
    )
