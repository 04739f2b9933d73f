"""Spring networks on a mesh: its edges, and for hexahedra also diagonals that keep them from folding."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.optimize import nnls

from softmark.records import dataclass
from softmark.solvers.elements.element import Element
from softmark.solvers.elements.hex8 import Hex8
from softmark.solvers.mesh.mesh import Floats, Ints, Mesh

Diagonals = Literal["faces", "all"]

EDGE, FACE, BODY = 0, 1, 2  # edge or diagonal of each spring

# Shares of E V / l0^2 that make a cube isotropic with Young's modulus E, as edge, face and body diagonal; in each row
# 12 edges, 12 face diagonals and 4 body diagonals add up to 6. A lattice of cubes with edge a has the elasticities
# C1111 = (k_e + 2 k_f + 4/3 k_b) / a and C1122 = C1212 = (k_f + 4/3 k_b) / a; isotropy asks for C1111 = 3 C1122.
# "faces": k_e = k_f = 2 E a / 5. "all": half of that, and half of edges with body diagonals, k_e = 8/3 k_b = 4 E a / 5.
# Edges and body diagonals alone are isotropic too, but rows of such a lattice slide past each other without force.
CUBE: dict[str, tuple[float, float, float]] = {"faces": (0.1, 0.4, 0.0), "all": (0.15, 0.2, 0.45)}
LEAST = 0.1  # smallest share relative to a cube's, so that no cell comes loose
PULL = 0.01  # weight towards a cube's shares, where the solution is not unique


@dataclass(frozen=True)
class SpringNetwork:
    """Springs of a network, each once: node pairs `edges` (n, 2) and the kind of edge or diagonal `what` (n,).

    `count` (n,) is the number of cells that share a spring, and `volume` (n,) the sum of their volumes, m^3. `weight`
    (n,), m^3, is the same sum with each cell's volume multiplied by the spring's share in that cell
    (`hexahedron_stiffness_fractions`). A modulus E is represented by the stiffness E weight / l0^2 of a spring of
    length l0. Inside a lattice of cubes an edge has four cells and a face diagonal two. On the surface of a block they
    have fewer, and so less stiffness.
    """

    edges: Ints
    what: Ints
    count: Ints
    volume: Floats
    weight: Floats


def build_spring_network(mesh: Mesh, diagonals: Diagonals = "all") -> SpringNetwork:
    """Return the springs of a mesh: the edges of its cells, and the diagonals of hexahedra.

    In tetrahedra each edge has the stiffness fraction 1, which is the rule of Van Gelder (1998).
    `hexahedron_stiffness_fractions` describes hexahedra.
    """
    pairs, what = _springs_of_element(mesh.element, diagonals)
    ends = np.sort(mesh.cells[:, pairs].reshape(-1, 2), axis=1)  # (m springs, 2)
    nodes = int(ends.max()) + 1
    keys, first, which = np.unique(ends @ [nodes, 1], return_index=True, return_inverse=True)
    edges = np.stack(np.divmod(keys, nodes), axis=1)
    volumes = np.repeat(mesh.volumes, len(pairs))
    share = np.ones(len(ends))
    if mesh.element.diagonals[0]:
        share = hexahedron_stiffness_fractions(mesh.points[mesh.cells], diagonals).ravel()
    along = np.tile(what, len(mesh.cells))[first]
    volume, weight = np.bincount(which, volumes), np.bincount(which, share * volumes)
    return SpringNetwork(edges, along, np.bincount(which), volume.astype(float), weight.astype(float))


def _springs_of_element(element: type[Element], diagonals: Diagonals) -> tuple[Ints, Ints]:
    """Return the node pairs of a cell's springs (s, 2), and the kind of edge or diagonal of each (s,)."""
    families = {EDGE: element.edges, FACE: element.diagonals[0]}
    if diagonals == "all":
        families[BODY] = element.diagonals[1]
    pairs = np.array([pair for family in families.values() for pair in family], dtype=np.int64)
    what = np.repeat(list(families), [len(family) for family in families.values()])
    return pairs, what.astype(np.int64)


def hexahedron_stiffness_fractions(corners: Floats, diagonals: Diagonals) -> Floats:
    """Return the stiffness of each spring in hexahedra as a fraction of E V / l0^2, shape (m, springs).

    `corners` (m, 8, 3) are those of the hexahedra, V is the volume, E the modulus and l0 the spring's length. Under
    homogeneous strain, springs with stiffness k and direction n store the energy of a solid with the elasticity C = sum
    k l0^2 n n n n / V. The fractions are chosen so that C is nearest to 2E/5 (II + two transposes), the isotropic solid
    of modulus E and nu = 1/4, with no fraction below a tenth of a cube's. If several choices are equally near, the one
    nearest to the fractions of a cube is taken. Cubes have the fractions CUBE. With body diagonals, bricks up to 1.6
    times as long as wide become isotropic; with the fractions of a cube, a brick 1.4 times as long would be too stiff
    lengthwise by a half.
    """
    pairs, what = _springs_of_element(Hex8, diagonals)
    usual = np.array(CUBE[diagonals])[what]
    d = corners[:, pairs[:, 1]] - corners[:, pairs[:, 0]]
    n = d / np.linalg.norm(d, axis=2, keepdims=True)  # (m, springs, 3)
    # cells of an extruded mesh repeat: each kind is solved once
    _, first, which = np.unique(np.round(n.reshape(len(n), -1), 9), axis=0, return_index=True, return_inverse=True)
    balanced: Floats = np.array([_fit_stiffness_fractions(directions, usual) for directions in n[first]])[which.ravel()]
    return balanced


def _fit_stiffness_fractions(n: Floats, usual: Floats) -> Floats:
    """Return the stiffness fractions (s,) of springs with directions n (s, 3), by non-negative least squares.

    `usual` (s,) are the fractions in a cube.
    """
    nn = np.einsum("si,sj->sij", n, n)
    A = np.einsum("sij,skl->ijkls", nn, nn).reshape(81, -1)
    one = np.eye(3)
    isotropic = np.einsum("ij,kl->ijkl", one, one)
    isotropic = isotropic + isotropic.transpose(0, 2, 1, 3) + isotropic.transpose(0, 3, 2, 1)
    least = LEAST * usual
    rows = np.concatenate([A, PULL * np.eye(len(n))])
    aim = np.concatenate([0.4 * isotropic.ravel() - A @ least, PULL * (usual - least)])
    extra, _ = nnls(rows, aim)
    shares: Floats = least + extra
    return shares
