"""How supports hold a body: selections, values on degrees of freedom, conflicts, and motions left free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.case import Case, Fault, fault, reach
from softmark.interpreter.models.rigid import free_motions, point_rows
from softmark.interpreter.scene import Declared
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.interpreter.vocabulary.supports import Displaced, Follows
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


@dataclass
class Held:
    """Values that supports impose on degrees of freedom, and what they do to rigid motions."""

    case: Case
    extent: float  # m, of the body: makes rotations comparable with displacements
    values: dict[int, tuple[float, Declared]] = field(default_factory=dict)
    rows: list[Floats] = field(default_factory=lambda: [np.zeros((0, 6))])

    def impose(self, dof: int, value: float, support: Declared) -> None:
        """Hold a degree of freedom. Raises Fault where another support holds it to another value."""
        known, owner = self.values.setdefault(dof, (value, support))
        if known != value:
            raise conflict(owner, support)

    def finished(self) -> tuple[Ints, Floats]:
        """The degrees of freedom in order, and their values. Raises Fault where a body at rest is free to move."""
        if not isinstance(self.case.analysis, Dynamic):
            rows = np.concatenate(self.rows) / self.extent ** np.array([0, 0, 0, 1, 1, 1])
            must_be_held(self.case, rows)
        fixed = sorted(self.values)
        return np.array(fixed, dtype=np.int64), np.array([self.values[dof][0] for dof in fixed])


def moved_by(support: Declared) -> tuple[float, float, float]:
    """The displacement that a support imposes, m."""
    return support.thing.by if isinstance(support.thing, Displaced) else (0.0, 0.0, 0.0)


def solid_supports(case: Case, mesh: Mesh, measured: Mapping[str, Any]) -> tuple[Ints, Floats]:
    """Held degrees of freedom of a mesh (c,) and their displacements (c,), m. Raises Fault.

    `measured` has the tracked points that supports may follow, by the name of their reference.
    """
    held = Held(case, mesh.extent)
    for support in case.supports:
        nodes = np.nonzero(selected(case, support, mesh.points, "point"))[0]
        held.rows.append(point_rows(mesh.points[nodes] - mesh.points.mean(axis=0), support.thing.components))
        moved = displacements(support, mesh.points[nodes], measured)
        for c in support.thing.components:
            for node, value in zip(nodes.tolist(), moved[:, c].tolist(), strict=True):
                held.impose(3 * node + c, value, support)
    return held.finished()


def displacements(support: Declared, X: Floats, measured: Mapping[str, Any]) -> Floats:
    """What a support imposes on points X (n, 3) of the undeformed body (n, 3), m. Raises Fault."""
    if isinstance(support.thing, Follows):
        return _followed(support, X, measured)
    return np.tile(moved_by(support), (len(X), 1))


def _followed(support: Declared, X: Floats, measured: Mapping[str, Any]) -> Floats:
    """Displacements (n, 3) of tracked points near the points X, interpolated by thin plate splines."""
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    thing = support.thing
    if thing.of not in measured:
        at, problem = support.at("of"), f"`{support.name}` follows `{thing.of}`, which could not be read"
        raise fault("E406", at, problem, help="the report of the reference says why")
    data = measured[thing.of]
    near = cKDTree(X).query(data.X)[0] <= thing.reach
    points = data.X[near]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) > 3 else np.zeros(3)
    if len(points) < 4 or spread[1] < 1e-6 * spread[0]:
        raise fault(
            "E302",
            support.at("reach"),
            f"`{support.name}` finds {len(points)} tracked points near the part that it moves",
            "too few to tell how it moves",
            "use a larger `reach`, or another `where`",
        )
    # nearly in one plane, as a layer of beads is, only their place within the plane says anything
    centre, axes = points.mean(axis=0), np.linalg.svd(points - points.mean(axis=0))[2]
    flat = spread[2] < 0.1 * spread[1]
    frame = axes[: 2 if flat else 3].T
    try:
        spline = RBFInterpolator((points - centre) @ frame, data.u[near], kernel="thin_plate_spline")
    except np.linalg.LinAlgError:
        raise fault(
            "E302",
            support.at("reach"),
            f"`{support.name}` finds tracked points that lie above one another",
            "no one motion of the part that it moves",
            "use a smaller `reach`, so that one layer is left",
        ) from None
    u: Floats = spline((X - centre) @ frame)
    return u


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
