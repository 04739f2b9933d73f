"""What pieces of a body do to each other counted once more, for the watchdog, as beds are (bed_check.py)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.interpreter.evidence.unchecked import Unchecked
from softmark.interpreter.models.shared.pairing import pairs_on

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared import Moved
    from softmark.interpreter.problem.case import Case
    from softmark.solvers.checks.solids import Floats


def of_pairs(case: Case, mesh: Moved, u: Floats) -> dict[str, Floats]:
    """Forces on the nodes (n, 3), N, of every contact of the body with itself and of every tie, by its name.

    Raises Unchecked.
    """
    found = {}
    each: dict[str, Any] = pairs_on(case, mesh.mesh)
    for name, pair in each.items():
        g = np.zeros(u.size)
        (pair.pressing if pair.rubs else pair).add_gradient(u.ravel(), g)
        if pair.rubs:
            g -= _rubbed(name, pair, mesh, u.ravel())
        found[name] = -g.reshape(-1, 3)
    return found


def _rubbed(name: str, pair: Any, mesh: Moved, u: Floats) -> Floats:
    """What friction does to the nodes (3 n,), N, by formulas of its own, from the springs that a state leaves."""
    from softmark.solvers.checks import sliding

    own, skin, pressing = mesh.rubbed.get(name), pair.skin, pair.pressing
    if own is None or own.anchors.s.shape[0] != skin.points:
        raise Unchecked(f"what the friction of `{name}` remembers is not known")
    which = np.flatnonzero(own.anchors.n.any(axis=1))
    V = skin.places(u)
    p, x = V[skin.corners + which], V[: skin.corners]
    pairs = sliding.near(p, x, skin.faces, pressing.distance)
    pairs = pairs[_other(skin, which[pairs[:, 0]], pairs[:, 1], pressing.alone)]
    area = 0.5 * skin.A[which]
    N = area[:, None] * sliding.pressures(p, x, skin.faces, pairs, pressing.distance, pressing.stiffness)
    pull = (area * pair.spring)[:, None] * own.anchors.s[which]
    n = sliding.normals(x[skin.faces[skin.own[which]]])
    f, on = sliding.rubbed(p, x, skin.faces, pairs, pull, pair.friction * np.abs((n * N).sum(axis=1)))
    each = np.zeros_like(V)
    each[: skin.corners] = on
    each[skin.corners + which] = f
    found: Floats = skin.M.T @ each.ravel()
    return found


def _other(skin: Any, samples: Any, faces: Any, alone: bool) -> Any:
    """Which pairs of samples and faces (c,) may press: of other pieces, or of facets that share no corner."""
    if alone:
        return skin.patch[skin.corners + samples] != skin.patch[skin.faces[faces, 0]]
    mine, its = skin.of[samples], skin.home[faces]
    corners = [set(skin.faces[skin.home == facet].ravel().tolist()) for facet in range(int(skin.home.max()) + 1)]
    return np.array([not corners[a] & corners[b] for a, b in zip(mine.tolist(), its.tolist(), strict=True)], bool)
