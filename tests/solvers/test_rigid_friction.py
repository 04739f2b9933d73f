"""Coulomb friction of points on rigid bodies: its derivatives, and what holds of any state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.contact.barrier_law import Barrier
from softmark.solvers.contact.facet_contact_points import add_points_inside_facets
from softmark.solvers.contact.rigid_friction import RigidFriction
from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.contact.signed_distance.rounded_shapes import BallGap
from softmark.solvers.energies.energy import Floats

BALL = BallGap(1.0, (0.0, 0.0, 0.0))
TURNED = RigidMotion((0.02, -0.01, 0.03), (0.1, 0.2, -0.05), (0.3, 0.0, 0.1))
MU = 0.4


def moved(share: float) -> RigidMotion:
    """On its way to where it is turned."""
    return TURNED.at(share)


def carried(share: float) -> Gap:
    """The unit ball there."""
    return MovedGap(BALL, moved(share))


def rubbing(slid: float, seed: int = 3, count: int = 12) -> tuple[RigidFriction, Floats]:
    """Nodes at random, between 0.2 and 1.4 barrier distances from the ball, about `slid` from their anchors."""
    rng = np.random.default_rng(seed)
    n = rng.standard_normal((count, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    barrier = Barrier(0.1, 2.0)
    x = TURNED.moved((1.0 + 0.1 * rng.uniform(0.2, 1.4, count))[:, None] * n)
    X = x + 0.1 * rng.standard_normal(x.shape)
    anchors = TURNED.back(x + slid * rng.standard_normal(x.shape))
    made = RigidFriction(
        np.arange(count), X, rng.uniform(0.5, 1.0, count), barrier, carried, friction=MU, spring=20.0, carries=moved,
        anchors=anchors,
    )  # fmt: skip
    return made, (x - X).ravel()


def inside(slid: float, seed: int = 3) -> tuple[RigidFriction, Floats]:
    """The same at points inside two facets above the ball, of four nodes each: in front, where tangents are exact."""
    rng = np.random.default_rng(seed)
    X = np.array([(i, j, 0.0) for i in (-0.4, 0.0, 0.4) for j in (-0.2, 0.2)])
    facets = np.array([[0, 2, 3, 1], [2, 4, 5, 3]])
    bare = RigidFriction(
        np.arange(6), X, np.ones(6), Barrier(0.1, 2.0), carried, friction=MU, spring=20.0, carries=moved
    )
    made = add_points_inside_facets(bare, X, facets, 3)
    assert isinstance(made, RigidFriction)
    up = X + (0.0, 0.0, 1.03) + 0.02 * rng.standard_normal(X.shape)
    u = (TURNED.moved(up) - X).ravel()
    p = made.places(u)
    return made.with_anchors(TURNED.back(p + slid * rng.standard_normal(p.shape))), u


def of(energy: RigidFriction) -> Assembly:
    """It alone."""
    return Assembly(3 * len(energy.nodes), np.zeros(0, dtype=np.int64), [], [energy])


@pytest.mark.parametrize("make", [rubbing, inside])
@pytest.mark.parametrize("slid", [1e-3, 0.05, 0.3])
def test_the_tangent_is_that_of_the_forces(slid: float, make: Callable[[float], tuple[RigidFriction, Floats]]) -> None:
    """Central differences of the gradient, all stick, some slide, all slide: 1e-6 of the largest entry, at h = 1e-6."""
    made, x = make(slid)
    whole = of(made)
    K = whole.tangent(x, 1.0).toarray()
    h = 1e-6
    seen = [(whole.gradient(x + h * e, 1.0) - whole.gradient(x - h * e, 1.0)) / (2 * h) for e in np.eye(len(x))]
    assert np.abs(K - np.array(seen).T).max() < 1e-6 * np.abs(K).max()
    assert np.abs(K - K.T).max() > 1e-3 * np.abs(K).max() or slid < 0.01


@pytest.mark.parametrize("make", [rubbing, inside])
@pytest.mark.parametrize("slid", [1e-3, 0.05, 0.3])
def test_a_lag_has_an_energy(slid: float, make: Callable[[float], tuple[RigidFriction, Floats]]) -> None:
    """Forces are its differences, the tangent is theirs and symmetric, and in the state of the lag forces are its."""
    made, x = make(slid)
    lagged = made.lagged(x)
    assert lagged.conservative
    assert not made.conservative
    np.testing.assert_allclose(lagged.forces(x), made.forces(x), rtol=1e-12)
    near = x + 1e-3 * np.random.default_rng(0).standard_normal(len(x))
    whole, h = of(lagged), 1e-6
    g = whole.gradient(near, 1.0)
    seen = [(whole.value(near + h * e, 1.0) - whole.value(near - h * e, 1.0)) / (2 * h) for e in np.eye(len(x))]
    np.testing.assert_allclose(g, seen, atol=1e-7 * np.abs(g).max())
    K = whole.tangent(near, 1.0).toarray()
    curved = [(whole.gradient(near + h * e, 1.0) - whole.gradient(near - h * e, 1.0)) / (2 * h) for e in np.eye(len(x))]
    assert np.abs(K - np.array(curved).T).max() < 1e-6 * np.abs(K).max()
    assert np.abs(K - K.T).max() < 1e-12 * np.abs(K).max()
    definite = of(made).tangent(x, 1.0, projected=True).toarray()
    assert np.linalg.eigvalsh(0.5 * (definite + definite.T)).min() > -1e-10 * np.abs(definite).max()


@pytest.mark.parametrize("seed", range(5))
def test_coulomb(seed: int) -> None:
    """Traction is at most mu p and against slip, is mu p where it slides, and what is lost is not negative."""
    made, x = rubbing(0.01, seed)
    p, slip = made.pressures(x), made.slip(x)
    assert np.all(slip.t <= MU * p * (1 + 1e-12))
    assert 0 < slip.slides.sum() < len(p)
    np.testing.assert_allclose(slip.t[slip.slides], MU * p[slip.slides], rtol=1e-12)
    _, n, _ = made.look(x)
    f = made.forces(x)
    along = f - np.einsum("ij,ij->i", f, n)[:, None] * n
    assert np.all(np.einsum("ij,ij->i", along, slip.s) <= 0.0)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), made.A * slip.t, atol=1e-12)
    assert made.lost(x) >= 0.0


@pytest.mark.parametrize("make", [rubbing, inside])
@pytest.mark.parametrize("slid", [1e-3, 0.3])
def test_what_a_state_leaves(slid: float, make: Callable[[float], tuple[RigidFriction, Floats]]) -> None:
    """From the anchors that a state leaves, the same forces stand in it, and nothing more is lost."""
    made, x = make(slid)
    after = replace(made, anchors=made.final_anchors(x))
    np.testing.assert_allclose(after.forces(x), made.forces(x), atol=1e-9 * np.abs(made.forces(x)).max())
    assert after.lost(x) <= 1e-12 * (made.lost(x) + 1.0)


def test_a_rigid_body_that_only_carries_along_does_not_rub() -> None:
    """Nodes that move and turn with it from rest keep their forces, turned."""
    made, x = rubbing(1e-3)
    rest = TURNED.back(made.places(x))
    still = replace(made, carries=lambda share: RigidMotion(), posed=lambda share: BALL)
    f = still.forces((rest - still.X).ravel())
    turn = TURNED.rotation_matrix
    assert turn is not None
    np.testing.assert_allclose(made.forces(x), f @ turn.T, atol=1e-9 * np.abs(f).max())
