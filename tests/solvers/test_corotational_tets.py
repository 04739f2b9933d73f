"""The fused corotational tetrahedra against the general element with the same law, which is their judge."""

from __future__ import annotations

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.sparsity_patterns import build_pattern
from softmark.solvers.energies import corotational_tets
from softmark.solvers.energies.corotational_tets import CorotationalTets
from softmark.solvers.energies.elastic_energy import Elastic
from softmark.solvers.materials import corotational, polar_decomposition
from softmark.solvers.materials.corotational import Corotational

LAW = Corotational(2.0, 7.0)
SAME = 1e-12  # both work in float64; what differs is the order of some hundred operations of size one


def lattice(n: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of a cube of n^3 cubes, each split into six tetrahedra around its diagonal."""
    index = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    axes = np.eye(3, dtype=int)
    cells = []
    for corner in np.ndindex(n, n, n):
        for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0)):
            path = np.array(corner) + np.concatenate([[[0, 0, 0]], np.cumsum(axes[list(order)], axis=0)])
            nodes = [index[tuple(p)] for p in path]
            odd = order in ((1, 0, 2), (0, 2, 1), (2, 1, 0))
            cells.append([nodes[0], nodes[2], nodes[1], nodes[3]] if odd else nodes)
    points = np.stack(np.meshgrid(*[np.arange(n + 1) / n] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.array(cells, dtype=np.int64)


def energies(points: np.ndarray, cells: np.ndarray) -> tuple[Elastic, CorotationalTets]:
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    dNdX = np.ascontiguousarray(np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)[:, None])
    w = np.linalg.det(edges)[:, None] / 6.0
    assert w.min() > 0
    return Elastic(cells, dNdX, w, LAW), CorotationalTets(cells, dNdX, w, LAW)


def state(name: str, points: np.ndarray) -> np.ndarray:
    """Displacements: what the name says, each node moved a little on its own."""
    rng = np.random.default_rng(5)
    noise = rng.uniform(-0.03, 0.03, points.shape)
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    Q *= np.sign(np.linalg.det(Q))
    F = {
        "rest": np.eye(3),
        "turned": Q,
        "stretched": Q @ np.diag([1.6, 0.7, 1.1]),
        "flat": Q @ np.diag([1.0, 1.2, 0.0]),
        "inverted": Q @ np.diag([1.3, 1.1, -0.4]),
        "mirrored": np.diag([1.3, 1.1, -2.0]),
        "huge": 1e5 * Q,
        "small": 1e-2 * np.eye(3),
    }[name]
    size = float(np.abs(F).max())
    return ((points + noise * min(size, 1.0)) @ F.T - points).ravel()


def test_the_thresholds_are_those_of_the_law() -> None:
    """An energy imports no law, and has its own copies."""
    assert corotational_tets.GAP == polar_decomposition.GAP
    assert corotational_tets.FLOOR == corotational.FLOOR


STATES = ("rest", "turned", "stretched", "flat", "inverted", "mirrored", "huge", "small")


def close(a: np.ndarray, b: np.ndarray, tolerance: float = SAME) -> None:
    np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * max(float(np.abs(a).max()), 1e-300))


def assemblies(held: np.ndarray) -> tuple[Assembly, Assembly]:
    points, cells = lattice()
    slow, fast = energies(points, cells)
    first = Assembly(points.size, held, [slow], [])
    return first, first.with_internal([fast])


@pytest.mark.parametrize("name", STATES)
def test_it_is_the_general_element(name: str) -> None:
    points, cells = lattice()
    slow, fast = energies(points, cells)
    x = state(name, points)
    judge, ours = assemblies(np.arange(9))
    close(np.array(slow.value(x)), np.array(fast.value(x)))
    close(judge.gradient(x, 1.0), ours.gradient(x, 1.0))
    for projected in (False, True):
        close(judge.tangent(x, 1.0, projected).data, ours.tangent(x, 1.0, projected).data)


@pytest.mark.parametrize("name", ["point", "line"])
def test_cells_that_collapsed(name: str) -> None:
    """To a point, R is any rotation: mu |R|^2 + lam/2 tr(I)^2 = 3 mu + 9/2 lam a volume; a line keeps one stretch."""
    points, cells = lattice()
    _, fast = energies(points, cells)
    onto = np.zeros((3, 3)) if name == "point" else np.diag([1.0, 0.0, 0.0])
    x = (points @ onto - points).ravel()
    expected = 3 * LAW.mu + 4.5 * LAW.lam if name == "point" else 2 * LAW.mu + 2 * LAW.lam
    assert fast.value(x) == pytest.approx(expected, rel=SAME)
    g = np.zeros_like(x)
    data = np.zeros(len(build_pattern(x.size, np.zeros(0, dtype=np.int64), [fast.stencils]).indices))
    pattern = build_pattern(x.size, np.zeros(0, dtype=np.int64), [fast.stencils])
    fast.add_gradient(x, g)
    fast.add_hessian(x, data, pattern.slots[0])
    assert np.all(np.isfinite(g))
    assert np.all(np.isfinite(data))


def test_near_the_edge_where_the_rotation_jumps() -> None:
    """At s2 + s3 = d the rotation is known to 1e-16/d; forces are compared to ten times that."""
    points, cells = lattice()
    slow, fast = energies(points, cells)
    for d in (1e-2, 1e-4):
        x = (points @ np.diag([1.5, 1.0, -1.0 + d]) - points).ravel()
        a, b = np.zeros_like(x), np.zeros_like(x)
        slow.add_gradient(x, a)
        fast.add_gradient(x, b)
        close(a, b, 1e-15 / d)


def test_nodes_that_are_held_in_some_directions_only() -> None:
    """Rollers: the columns of a block are no neighbours then, and go to their places one by one."""
    judge, ours = assemblies(np.array([0, 4, 8, 10, 13, 28]))
    x = state("stretched", lattice()[0])
    close(judge.tangent(x, 1.0).data, ours.tangent(x, 1.0).data)


def test_scale() -> None:
    """`scale` multiplies forces and tangent."""
    points, cells = lattice()
    _, fast = energies(points, cells)
    x = state("stretched", points)
    pattern = build_pattern(x.size, np.arange(6), [fast.stencils])
    g, data = np.zeros((2, x.size)), np.zeros((2, len(pattern.indices)))
    fast.add_gradient(x, g[0], 2.5)
    fast.add_hessian(x, data[0], pattern.slots[0], 2.5)
    fast.add_gradient(x, g[1])
    fast.add_hessian(x, data[1], pattern.slots[0])
    close(g[0], 2.5 * g[1])
    close(data[0], 2.5 * data[1])


def test_lagged_traces_of_the_same_state_change_nothing() -> None:
    """With tr(S - I) of this very state the lagged tangent is the exact one."""
    points, cells = lattice()
    _, fast = energies(points, cells)
    x = state("stretched", points)
    pattern = build_pattern(x.size, np.arange(6), [fast.stencils])
    traces, g = np.empty(len(cells)), np.zeros((2, x.size))
    data = np.zeros((2, len(pattern.indices)))
    fast.add_gradient_and_lagged(x, g[0], traces)
    fast.add_both_lagged(x, g[1], data[0], pattern.slots[0], traces)
    fast.add_hessian(x, data[1], pattern.slots[0])
    close(g[0], g[1])
    close(data[0], data[1])


def test_a_state_that_is_not_finite_gives_no_number() -> None:
    points, cells = lattice()
    _, fast = energies(points, cells)
    x = state("rest", points)
    x[40] = np.nan
    assert np.isnan(fast.value(x))


def test_rounding_is_that_of_the_general_element() -> None:
    slow, fast = energies(*lattice())
    x = np.zeros(3)
    assert fast.rounding(x) == pytest.approx(slow.rounding(x), rel=SAME)


@pytest.mark.parametrize("name", [*STATES, "not a number"])
def test_sound_states_have_no_cell_inside_out(name: str) -> None:
    """As determinants of the general element say; a state that is not a number is not sound."""
    points, cells = lattice()
    slow, fast = energies(points, cells)
    x = state("rest" if name == "not a number" else name, points)
    if name == "not a number":
        x[7] = np.nan
        assert not fast.has_no_inverted_cells(x)
    else:
        assert fast.has_no_inverted_cells(x) == bool(np.all(np.linalg.det(slow.F(x)) > 0))
