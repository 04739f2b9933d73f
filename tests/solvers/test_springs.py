"""Networks of springs: derivatives, the lattice that they make of cubes, and what a modulus makes of them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.energies.energy import VectorSpace
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.energies.spring_energy import Springs, stiffness_from_modulus
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.spring_edges import (
    BODY,
    CUBE,
    EDGE,
    FACE,
    Diagonals,
    build_spring_network,
    hexahedron_stiffness_fractions,
)
from softmark.solvers.statics.static_equilibrium import NotConverged, Statics, equilibrium

NONE = np.zeros(0, dtype=np.int64)
BOTH: tuple[Diagonals, ...] = ("faces", "all")


def block(counts: tuple[int, int, int], edges: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    """A block of boxes, all alike; nodes of a cell in the order of VTK."""
    axes = [np.arange(n + 1) * h for n, h in zip(counts, edges, strict=True)]
    points = np.array(list(itertools.product(*axes)), dtype=float)
    number = np.arange(len(points)).reshape([n + 1 for n in counts])
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = [number[tuple(slice(o, o + n) for o, n in zip(c, counts, strict=True))].ravel() for c in corners]
    return Mesh(points, np.stack(cells, axis=1).astype(np.int64), "hex8")


def springs_of(mesh: Mesh, k: np.ndarray, diagonals: Diagonals = "all") -> Springs:
    edges = build_spring_network(mesh, diagonals).edges
    return Springs(edges, mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], k)


def of_modulus(mesh: Mesh, young: float, diagonals: Diagonals = "all") -> Springs:
    net = build_spring_network(mesh, diagonals)
    l0 = np.linalg.norm(mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]], axis=1)
    return springs_of(mesh, stiffness_from_modulus(young, net.weight, l0), diagonals)


def gradient(energy: Springs, x: np.ndarray) -> np.ndarray:
    g = np.zeros_like(x)
    energy.add_gradient(x, g)
    return g


def stiffness(energy: Springs, x: np.ndarray, projected: bool = False) -> np.ndarray:
    return np.asarray(Assembly(x.size, NONE, [energy], []).tangent(x, 1.0, projected).toarray())


def elasticities(mesh: Mesh, springs: Springs) -> np.ndarray:
    """C (6, 6) of a homogeneously strained network: sum of k l0^2 n n n n over its volume, by its own tangent."""
    K = stiffness(springs, np.zeros(mesh.points.size))
    strains = []
    for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)):
        e = np.zeros((3, 3))
        e[i, j] += 0.5
        e[j, i] += 0.5
        strains.append((mesh.points @ e.T).ravel())
    U = np.array(strains)
    return np.asarray(U @ K @ U.T / mesh.volumes.sum())


# ------------------------------------------------------------------ derivatives


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_derivatives_at_unit_scale(seed: int) -> None:
    """k and l0 near 1, many compressed; central differences of h = 1e-5: h^2 psi''' + 1e-16/h = 1e-10."""
    rng = np.random.default_rng(seed)
    mesh = block((1, 1, 1))
    springs = springs_of(mesh, rng.uniform(0.5, 2.0, 28))
    x = rng.uniform(-0.3, 0.3, mesh.points.size)
    ratio = springs.lengths(x) / springs.l0
    assert ratio.min() < 0.9 < 1.1 < ratio.max()
    h = 1e-5
    steps = h * np.eye(x.size)
    g = np.array([springs.value(x + d) - springs.value(x - d) for d in steps]) / (2 * h)
    K = np.array([gradient(springs, x + d) - gradient(springs, x - d) for d in steps]) / (2 * h)
    np.testing.assert_allclose(gradient(springs, x), g, atol=1e-8)
    np.testing.assert_allclose(stiffness(springs, x), K, atol=1e-8)


@pytest.mark.parametrize("projected", [False, True])
def test_kernels_against_einsum(projected: bool) -> None:
    """Each block from its formula, summed densely. Rounding alone differs."""
    rng = np.random.default_rng(5)
    mesh = block((2, 1, 1))
    springs = springs_of(mesh, rng.uniform(0.5, 2.0, len(build_spring_network(mesh).edges)))
    x = rng.uniform(-0.3, 0.3, mesh.points.size)
    y = mesh.points + x.reshape(-1, 3)
    d = y[springs.edges[:, 1]] - y[springs.edges[:, 0]]
    length = np.linalg.norm(d, axis=1)
    n = d / length[:, None]
    c = 1.0 - springs.l0 / length
    c = np.maximum(c, 0.0) if projected else c
    nn = np.einsum("si,sj->sij", n, n)
    H = springs.k[:, None, None] * (nn + c[:, None, None] * (np.eye(3) - nn))
    B = np.zeros((len(n), 3, x.size))  # displacements to stretches
    for s, (a, b) in enumerate(springs.edges):
        B[s, :, 3 * a : 3 * a + 3], B[s, :, 3 * b : 3 * b + 3] = -np.eye(3), np.eye(3)
    dense = np.einsum("sid,sij,sje->de", B, H, B)
    force = np.einsum("sid,si->d", B, (springs.k * (length - springs.l0))[:, None] * n)
    np.testing.assert_allclose(stiffness(springs, x, projected), dense, atol=1e-14 * np.abs(dense).max() * 30)
    np.testing.assert_allclose(gradient(springs, x), force, atol=1e-14)


def test_the_projected_tangent_is_definite_and_exact_where_nothing_is_compressed() -> None:
    """Rounding of eigenvalues of a matrix of norm 20: 1e-14."""
    rng = np.random.default_rng(6)
    mesh = block((1, 1, 1))
    springs = springs_of(mesh, np.ones(28))
    crumpled = -0.5 * mesh.points.ravel() + rng.uniform(-0.05, 0.05, mesh.points.size)
    assert np.linalg.eigvalsh(stiffness(springs, crumpled)).min() < -0.1
    assert np.linalg.eigvalsh(stiffness(springs, crumpled, projected=True)).min() > -1e-13
    swollen = 0.5 * mesh.points.ravel() + rng.uniform(-0.05, 0.05, mesh.points.size)
    np.testing.assert_array_equal(stiffness(springs, swollen), stiffness(springs, swollen, projected=True))


def test_rigid_motions_cost_nothing() -> None:
    """A turn by 2 rad and a shift: every length is what it was, to rounding of coordinates of size 10."""
    mesh = block((2, 1, 1))
    springs = of_modulus(mesh, 1.0)
    angle, axis = 2.0, np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    W = np.cross(np.eye(3), axis)
    Q = np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W
    x = (mesh.points @ (Q - np.eye(3)).T + [3.0, -9.0, 5.0]).ravel()
    assert springs.value(x) < 1e-28
    assert np.abs(gradient(springs, x)).max() < 1e-13
    assert np.linalg.norm(gradient(springs, x)) < 30 * springs.rounding(x)


def test_ends_that_meet_have_no_direction() -> None:
    """Energy k/2 l0^2, and neither force nor tangent: the derivative does not exist there."""
    spring = Springs(np.array([[0, 1]]), np.array([[2.0, 0.0, 0.0]]), np.array([3.0]))
    x = np.array([2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert spring.value(x) == 6.0
    assert not gradient(spring, x).any()
    assert not stiffness(spring, x).any()


# ------------------------------------------------------------------ networks


def test_springs_of_a_tetrahedron() -> None:
    """Each of six edges once, k = E V / l^2 as Van Gelder (1998) has it; V = 1/6, l^2 = 1 or 2."""
    mesh = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 1, 2, 3]]))
    springs = of_modulus(mesh, 12.0)
    expected = {(0, 1): 2, (0, 2): 2, (0, 3): 2, (1, 2): 1, (1, 3): 1, (2, 3): 1}
    found = {(int(a), int(b)): k for (a, b), k in zip(springs.edges, springs.k, strict=True)}
    assert found == pytest.approx(expected, rel=1e-15)


def test_springs_of_a_block_of_cubes() -> None:
    """By counting: 2 x 1 x 1 cubes have 20 edges, 11 faces with two diagonals, 8 body diagonals."""
    net = build_spring_network(block((2, 1, 1)), "all")
    assert np.bincount(net.what).tolist() == [20, 22, 8]
    assert len(np.unique(np.sort(net.edges, axis=1), axis=0)) == 50
    assert [int(net.count[net.what == w].max()) for w in (EDGE, FACE, BODY)] == [2, 2, 1]
    np.testing.assert_allclose(net.volume, net.count)  # of unit cells
    assert len(build_spring_network(block((2, 1, 1)), "faces").edges) == 42


def test_a_spring_that_cells_share_is_one() -> None:
    """Two tetrahedra on a face have 9 edges; V adds up around the three that they share."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -2]])
    net = build_spring_network(Mesh(points, np.array([[0, 1, 2, 3], [0, 2, 1, 4]])))
    assert sorted(net.count.tolist()) == [1, 1, 1, 1, 1, 1, 2, 2, 2]
    np.testing.assert_allclose(net.volume[net.count == 2], 1 / 6 + 2 / 6)
    np.testing.assert_array_equal(net.weight, net.volume)


# ------------------------------------------------------------------ the lattice of cubes


def test_the_lattice_identity() -> None:
    """C11 = (k1 + 2 k2)/a, C12 = C44 = k2/a with half the stiffness on faces, a quarter on edges of the block.

    Born and Huang (1954) for the infinite lattice; that a block of it has the same elasticities is what the weights
    are for. Checked for k1 = 3, k2 = 0.7, a = 0.5: sums of some hundred products, so to rounding.
    """
    a, k1, k2 = 0.5, 3.0, 0.7
    mesh = block((3, 2, 2), (a, a, a))
    net = build_spring_network(mesh, "faces")
    k = np.where(net.what == EDGE, k1 * net.count / 4, k2 * net.count / 2)
    C = elasticities(mesh, springs_of(mesh, k, "faces"))
    expected = np.diag([k1 + k2] * 3 + [k2] * 3) / a
    expected[:3, :3] += k2 / a
    np.testing.assert_allclose(C, expected, atol=1e-13 * C.max())


@pytest.mark.parametrize("diagonals", BOTH)
def test_cubes_have_the_modulus_of_the_material_and_nu_of_a_quarter(diagonals: Diagonals) -> None:
    """lambda = mu = 2E/5. The shares of a cube solve their equations to rounding of the least squares, 1e-12."""
    young, a = 60e3, 5e-3
    mesh = block((2, 2, 2), (a, a, a))
    C = elasticities(mesh, of_modulus(mesh, young, diagonals))
    lame = 0.4 * young
    expected = np.diag([2 * lame] * 3 + [lame] * 3)
    expected[:3, :3] += lame
    np.testing.assert_allclose(C, expected, atol=1e-10 * young)
    S = np.linalg.inv(C)
    assert 1 / S[0, 0] == pytest.approx(young, rel=1e-10)
    assert -S[0, 1] / S[0, 0] == pytest.approx(0.25, rel=1e-10)


def test_120_newtons_per_metre() -> None:
    """E = 60 kPa, a = 5 mm: k = 2 E a / 5 = 120 N/m on edges and face diagonals inside the block."""
    mesh = block((3, 3, 3), (5e-3, 5e-3, 5e-3))
    net, springs = build_spring_network(mesh, "faces"), of_modulus(mesh, 60e3, "faces")
    inside = net.count == np.where(net.what == EDGE, 4, 2)
    assert inside.sum() > 10
    np.testing.assert_allclose(springs.k[inside], 120.0, rtol=1e-10)
    np.testing.assert_allclose(springs.k, 120.0 * net.count / np.where(net.what == EDGE, 4, 2), rtol=1e-10)


@pytest.mark.parametrize("diagonals", BOTH)
def test_the_shares_of_a_cube_add_up_to_six(diagonals: Diagonals) -> None:
    """As the six edges of a tetrahedron do: the sum of k l0^2 is then 6 E V in every network."""
    mesh = block((1, 1, 1))
    found = hexahedron_stiffness_fractions(mesh.points[mesh.cells], diagonals)[0]
    expected = np.repeat(CUBE[diagonals], [12, 12, 4])[: len(found)]
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found.sum() == pytest.approx(6.0, abs=1e-11)


@pytest.mark.parametrize(("long", "within"), [(1.2, 2e-5), (1.4, 2e-5), (1.6, 1e-3), (2.0, 0.3)])
def test_long_cells_are_balanced(long: float, within: float) -> None:
    """With body diagonals, cells up to 1.6 times as long as wide are isotropic; further, springs would have to push.

    The pull towards a cube, 0.01 squared, leaves 5e-6 where shares could solve the equations; at 1.6 their bound just
    binds, 2e-4 measured; at 2.0 a block is too stiff lengthwise by 0.285 (this computation).
    """
    mesh = block((2, 2, 2), (1.0, 1.0, long))
    S = np.linalg.inv(elasticities(mesh, of_modulus(mesh, 1.0)))
    np.testing.assert_allclose(1 / np.diag(S)[:3], 1.0, rtol=within)


def test_the_shares_of_a_cube_would_make_long_cells_too_stiff() -> None:
    """What balancing is for: at 1.4 times the length the block is 1.495 times too stiff (this computation)."""
    mesh = block((2, 2, 2), (1.0, 1.0, 1.4))
    net = build_spring_network(mesh, "all")
    l0 = np.linalg.norm(mesh.points[net.edges[:, 1]] - mesh.points[net.edges[:, 0]], axis=1)
    springs = springs_of(mesh, np.array(CUBE["all"])[net.what] * net.volume / l0**2)
    assert 1 / np.linalg.inv(elasticities(mesh, springs))[2, 2] == pytest.approx(1.495, abs=1e-3)


def test_edges_and_body_diagonals_alone_slide() -> None:
    """Why face diagonals are not left out: rows of nodes move along x, each against its four neighbours, for nothing.

    Then an edge along y or z turns and does not stretch, and a body diagonal joins rows that move together.
    """
    mesh = block((3, 3, 3))
    net = build_spring_network(mesh, "all")
    springs = springs_of(mesh, np.where(net.what == FACE, 0.0, 1.0))
    x = np.zeros_like(mesh.points)
    x[:, 0] = (-1.0) ** np.round(mesh.points[:, 1] + mesh.points[:, 2])
    K = stiffness(springs, np.zeros(x.size))
    assert x.ravel() @ K @ x.ravel() == pytest.approx(0.0, abs=1e-12)
    with_faces = springs_of(mesh, np.ones(len(net.edges)))
    assert x.ravel() @ stiffness(with_faces, np.zeros(x.size)) @ x.ravel() > 10.0


# ------------------------------------------------------------------ equilibrium


def problem(springs: Springs, points: np.ndarray, fixed: np.ndarray, force: np.ndarray) -> Statics:
    assembly = Assembly(points.size, fixed, [springs], [DeadForces(force.ravel())])
    rest = np.zeros(points.size)
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    return Statics(assembly, VectorSpace(points.size), rest, fixed, np.zeros(len(fixed)), extent=extent)


def test_a_pulled_block_stretches_and_thins() -> None:
    """Homogeneous tension sigma: strain sigma/E along, -sigma/4E across, in every cell; 1e-6, and 1e-12 its square."""
    mesh, sigma = block((4, 2, 2)), 1e-6
    springs = of_modulus(mesh, 1.0)
    force = np.zeros_like(mesh.points)
    y, z = (np.where((c == 0) | (c == 2), 0.5, 1.0) for c in mesh.points[:, 1:].T)
    force[:, 0] = sigma * y * z * ((mesh.points[:, 0] == 4) * 1.0 - (mesh.points[:, 0] == 0) * 1.0)
    held = [3 * np.flatnonzero(mesh.points[:, i] == 0) + i for i in range(3)]  # planes of symmetry
    found = equilibrium(problem(springs, mesh.points, np.unique(np.concatenate(held)), force))
    expected = mesh.points * [sigma, -sigma / 4, -sigma / 4]
    np.testing.assert_allclose(found.x.reshape(-1, 3), expected, atol=2e-5 * sigma)


def truss(load: float) -> Statics:
    """Von Mises's truss: two springs k = 1 from (+-1, 0, 0) meet at (0, 0, 0.5), which moves along z under a load."""
    points = np.array([[-1.0, 0, 0], [1, 0, 0], [0, 0, 0.5]])
    edges = np.array([[0, 2], [1, 2]])
    springs = Springs(edges, points[edges[:, 1]] - points[edges[:, 0]], np.ones(2))
    force = np.zeros((3, 3))
    force[2, 2] = -load
    return problem(springs, points, np.arange(8), force)


def truss_force(z: float) -> float:
    """Load that holds the tip at height z: 2 (l0 - l) z / l."""
    length = np.hypot(1.0, z)
    return float(2 * (np.hypot(1.0, 0.5) - length) * z / length)


@pytest.mark.parametrize("z", [0.45, 0.4])
def test_a_truss_before_it_snaps(z: float) -> None:
    """The limit load is at z = 0.278; before it the tip is where the formula of two springs has it."""
    found = equilibrium(truss(truss_force(z)))
    assert found.x[8] == pytest.approx(z - 0.5, abs=1e-8)


def test_a_truss_that_has_snapped_through() -> None:
    """Beyond the limit load, 0.0429, the one equilibrium is below: the springs are longer than at rest and stable."""
    found = equilibrium(truss(0.1))
    z = 0.5 + found.x[8]
    assert z < -0.5
    assert truss_force(z) == pytest.approx(0.1, abs=1e-9)
    assert found.stable


def test_a_network_without_an_equilibrium_says_so() -> None:
    """A node without springs is pulled: nothing can balance it."""
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    springs = Springs(np.array([[0, 1]]), np.array([[1.0, 0, 0]]), np.ones(1))
    force = np.zeros((3, 3))
    force[2, 0] = 1.0
    with pytest.raises(NotConverged):
        equilibrium(problem(springs, points, np.arange(3), force))
