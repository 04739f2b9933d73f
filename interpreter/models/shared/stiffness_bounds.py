"""Bounds of how much softer a body can be than its mesh, if Young's modulus varies within cells.

One polynomial describes the displacements of a cell, so the cell has the arithmetic mean of the modulus, as
parallel layers do (Voigt 1889). Layers in series have the harmonic mean (Reuss 1929). The harmonic mean along a
line is a lower bound of the stiffness of the body along that line; it is attained if all columns along the line
act independently. Layers that the line does not cross cause no loss.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from softmark.interpreter.models.shared.varying_quadrature import ENOUGH, CellQuadrature, FunctionsOfConstants
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.adaptive_quadrature import reference_cell_kind
from softmark.solvers.mesh.mesh import Mesh

LINES = 12  # number of lines through each cell, along each of its axes
EVEN = 129  # equally spaced sample points along a line
MORE = 128  # sample points along a line where the integral of the modulus needed points
CELLS = 300  # largest number of sampled cells
SIDES = {  # normals of the faces of reference cells, outward, and how far along them faces are
    "hexahedra": (np.concatenate([np.eye(3), -np.eye(3)]), np.ones(6)),
    "wedges": (
        np.array([[-1, 0, 0], [0, -1, 0], [1, 1, 0], [0, 0, -1], [0, 0, 1]], dtype=float),
        np.array([0.0, 0.0, 1.0, 1.0, 1.0]),
    ),
    "tetrahedra": (np.concatenate([-np.eye(3), np.ones((1, 3))]), np.array([0.0, 0.0, 0.0, 1.0])),
}
ALL = 0.999  # of the stiffness: largest loss that is assumed


@dataclass(frozen=True)
class StiffnessLoss:
    """Largest possible loss of stiffness of `cells` (k,) whose modulus varies within them.

    `loss` (k, 3) is the lost fraction of the modulus along each of three axes `ways` (k, 3, 3), whose rows have
    unit length. The cells are a sample; each represents `times` cells.
    """

    cells: Ints
    loss: Floats
    ways: Floats
    times: float


@dataclass(frozen=True)
class Moduli:
    """Cell means (m,) of the `shear` modulus, Pa, and of the volumetric `compliance` 1/K, 1/Pa.

    `spread` (m,) is the mean of the varying modulus times the mean of its inverse; it is 1 if the modulus does not
    vary.
    """

    shear: Floats
    compliance: Floats
    spread: Floats


def stiffness_loss(mesh: Mesh, functions: FunctionsOfConstants, seen: CellQuadrature) -> StiffnessLoss:
    """Return how far harmonic means of Young's modulus along lines are below its arithmetic means, by cell.

    The result is cached in the mesh.
    """
    key = stiffness_loss, functions.profiles, functions.kept
    if key not in mesh.selections:
        mesh.selections[key] = _softness(mesh, functions, seen)
    found: StiffnessLoss = mesh.selections[key]
    return found


def _softness(mesh: Mesh, functions: FunctionsOfConstants, seen: CellQuadrature) -> StiffnessLoss:
    """Return how far harmonic means of Young's modulus along lines are below its arithmetic means, without a cache."""
    special = np.zeros(len(mesh.cells), dtype=bool) if seen.rule is None else seen.rule.special
    rng = np.random.default_rng(len(mesh.cells))
    every = np.flatnonzero(special)
    cells = np.sort(rng.permutation(every)[:CELLS])
    fine, starts = seen.fine, np.searchsorted(seen.fine.cell, np.arange(len(mesh.cells) + 1))
    loss, (local, ways) = np.zeros((len(cells), 3)), _axes(mesh, cells)
    for row, cell in enumerate(cells):
        own = slice(starts[cell], starts[cell + 1])
        weight = np.cumsum(np.abs(fine.values[0, own]) * fine.w[own])
        places = fine.xi[own][np.searchsorted(weight, rng.uniform(0.0, weight[-1], LINES)).clip(max=len(weight) - 1)]
        for axis, way in enumerate(local[row]):
            loss[row, axis] = _line_mean_deficit(mesh, functions, cell, places, way, fine.xi[own, axis])
    return StiffnessLoss(cells, loss, ways, len(every) / max(1, len(cells)))


def _axes(mesh: Mesh, cells: Ints) -> tuple[Floats, Floats]:
    """Return three axes of each cell as rows (k, 3, 3), first in local coordinates, then as unit vectors in space.

    Axes of hexahedra lie along their edges. Other cells have edges without fixed directions; their axes are those
    of space.
    """
    middle = mesh.element.gradient(np.array([mesh.element.centre]))[0]
    J = np.einsum("mai,aj->mij", mesh.points[mesh.cells[cells]], middle)
    if reference_cell_kind(mesh.element) == "hexahedra":
        ways = J.swapaxes(1, 2)
        return np.broadcast_to(np.eye(3), J.shape), ways / np.linalg.norm(ways, axis=2, keepdims=True)
    return np.linalg.inv(J).swapaxes(1, 2), np.broadcast_to(np.eye(3), J.shape)


def _line_mean_deficit(
    mesh: Mesh, functions: FunctionsOfConstants, cell: int, places: Floats, way: Floats, known: Floats
) -> float:
    """Return 1 minus the mean ratio of harmonic to arithmetic mean of the modulus along lines in one cell.

    The lines have the local direction `way` (3,) and pass through the local points `places` (k, 3).
    """
    sides, limits = SIDES[reference_cell_kind(mesh.element)]
    with np.errstate(all="ignore"):
        reach = (limits - places @ sides.T) / (sides @ way)  # to the planes of the faces (k, f)
    low = np.where(sides @ way < 0.0, reach, -np.inf).max(axis=1)
    high = np.where(sides @ way > 0.0, reach, np.inf).min(axis=1)
    t = np.linspace(0.0, 1.0, EVEN)
    if reference_cell_kind(mesh.element) == "hexahedra":
        t = np.unique(np.concatenate([t, 0.5 * (1.0 + known[:: max(1, len(known) // MORE)])]))
    s = low[:, None] + t * (high - low)[:, None]
    line = places[:, None] + s[:, :, None] * way
    X = mesh.element.shape(line.reshape(-1, 3)) @ mesh.points[mesh.cells[cell]]
    c = functions.values(X)[0].reshape(s.shape)
    with np.errstate(all="ignore"):
        share = 1.0 / (np.trapezoid(1.0 / c, t, axis=1) * np.trapezoid(c, t, axis=1))
        share = np.where(np.isfinite(share), share, 1.0)
    return float(1.0 - np.clip(share, 0.0, 1.0).mean())


def excess_and_total_energy(mesh: Mesh, u: Floats, modulus: Floats, found: StiffnessLoss | None) -> tuple[float, float]:
    """Return the possible excess of the strain energy of the cells, and their total strain energy, J.

    u (n, 3), m, are nodal displacements and `modulus` (m,), Pa, is the mean modulus of each cell. For the loss
    along an axis, only the strain components on the plane normal to that axis count.
    """
    strain = _strains(mesh, u)
    energy = modulus * mesh.volumes * (strain**2).sum(axis=(1, 2))
    if found is None or not len(found.cells):
        return 0.0, float(energy.sum())
    own = strain[found.cells]
    across = np.einsum("kij,kaj->kai", own, found.ways)
    normal = np.einsum("kai,kai->ka", across, found.ways)
    size = np.maximum((own**2).sum(axis=(1, 2)), 1e-300)
    share = np.clip((2.0 * (across**2).sum(axis=2) - normal**2) / size[:, None], 0.0, 1.0)
    lost = np.minimum((share * found.loss).sum(axis=1), found.loss.max(axis=1, initial=0.0))
    return float((energy[found.cells] * lost).sum() * found.times), float(energy.sum())


def pressure_energies(mesh: Mesh, u: Floats, p: Floats | None, moduli: Moduli) -> tuple[float, float]:
    """Return twice the energy that pressure unknowns neglect, and twice the strain energy of cells, J.

    u (n, 3), m, are nodal displacements. p (m, b), Pa, are pressures at the corners of cells or one per cell; None
    stands for bulk modulus times mean volume change. Pressures p have less energy than the dilatation theta: they
    neglect int (K theta - p)^2 / K dV, where K varies and theta does not.
    """
    strain, V = _strains(mesh, u), mesh.volumes
    theta = np.trace(strain, axis1=1, axis2=2)
    shape = strain - theta[:, None, None] / 3.0 * np.eye(3)
    soft = moduli.compliance
    with np.errstate(all="ignore"):
        each = theta / soft if p is None else p.mean(axis=1)
        mean = soft if p is None or p.shape[1] == 1 else _neighbourhood_means(mesh, soft)
        stiff = np.where(soft > 0.0, moduli.spread / soft, 0.0)  # the arithmetic mean of K, Pa
    ways = (each * mean, theta)
    left = [np.where(soft > 0.0, V * (stiff * t**2 - 2.0 * t * each + each**2 * soft), 0.0) for t in ways]
    energy = V * (2.0 * moduli.shear * (shape**2).sum(axis=(1, 2)) + each**2 * soft)
    by_p, by_theta = (float(np.maximum(each, 0.0).sum()) for each in left)
    return min((1.0 + 4.0 * ENOUGH) * by_p, by_theta), float(energy.sum())  # p^2 has a quadrature error


def _neighbourhood_means(mesh: Mesh, c: Floats) -> Floats:
    """Return means (m,) of cell values c (m,) over each cell and its neighbours.

    Continuous pressures average over such neighbourhoods.
    """
    corners, V = mesh.cells[:, : mesh.element.corners], mesh.volumes
    each, whole = (
        np.bincount(corners.ravel(), np.repeat(w, corners.shape[1]), minlength=len(mesh.points)) for w in (V * c, V)
    )
    found: Floats = (each[corners] / whole[corners]).mean(axis=1)
    return found


def _strains(mesh: Mesh, u: Floats) -> Any:
    """Return Green-Lagrange strains (m, 3, 3) at cell centres for nodal displacements u (n, 3), m."""
    dN = mesh.element.gradient(np.array([mesh.element.centre]))[0]
    J = np.einsum("mai,aj->mij", mesh.points[mesh.cells], dN)
    H = np.einsum("mai,aj->mij", u[mesh.cells], dN) @ np.linalg.inv(J)
    return 0.5 * (H + H.swapaxes(1, 2) + H.swapaxes(1, 2) @ H)
