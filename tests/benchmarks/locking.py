"""Error against Poisson's ratio at a fixed mesh: Lamé's thick sphere for every element and formulation.

    python tests/benchmarks/locking.py [--along 4] [--svg locking.svg]

Radii 1 and 2 m, E = 1000 Pa, internal pressure 1 Pa, one eighth with planes of symmetry; the error is that of the
displacements of all nodes, relative in the Euclidean norm. `--along` is the number of cells along a patch for linear
elements; quadratic ones take half as many, and about as many unknowns. Also Cook's membrane in plane strain, nu =
0.4999 (E = 250, F = 100): the corner C should rise by 7.403, which is what Q2/Q1 comes to on fine meshes.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from softmark.solvers.assembly.assembly import Assembly
from softmark.solvers.assembly.mixed_elements import mixed_energy
from softmark.solvers.elements import ELEMENTS
from softmark.solvers.energies.elastic_energy import Elastic, EnergySum
from softmark.solvers.energies.energy import Floats, VectorSpace
from softmark.solvers.energies.external_loads import DeadForces, FollowerPressure
from softmark.solvers.energies.mixed_displacement_pressure import DisplacementEnergy, MeanDilatation
from softmark.solvers.materials import MATERIALS, law_for, mixed_for, shear_and_volume_laws
from softmark.solvers.mesh.cell_splitting import mesh_hexahedra, two_colour_points
from softmark.solvers.mesh.element_interpolation import integrate_cells, mean_gradients
from softmark.solvers.mesh.mesh import Mesh
from softmark.solvers.mesh.shapes import Box
from softmark.solvers.statics.static_equilibrium import LinearSolverOptions, Statics, equilibrium

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
from hollow_sphere_octant import octant

RATIOS = (0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.5)
FORMS = (
    ("tet4", "displacement"), ("hex8", "displacement"), ("tet10", "displacement"), ("hex8", "selective"),
    ("hex8", "mean_dilatation"), ("hex8", "mixed"), ("tet10", "mixed"), ("hex20", "displacement"), ("hex20", "mixed"),
    ("hex27", "displacement"), ("hex27", "mixed"),
)  # fmt: skip


def energy_of(mesh: Mesh, form: str, what: Any) -> Any:
    """The energy of small strain of a formulation."""
    parts = integrate_cells(mesh)
    body, split = (mesh.cells, parts.dNdX, parts.w), mixed_for(what, "small")
    if form == "mixed" and split is not None:
        return mixed_energy(mesh, parts, split, what.shear_modulus)
    if form == "mean_dilatation" and split is not None:
        return MeanDilatation(*body, split.shape, split.constraint, split.modulus)
    if form == "selective":
        middle, laws = mean_gradients(mesh), shear_and_volume_laws(what, "small")
        assert laws is not None
        return EnergySum((Elastic(*body, laws[0]), Elastic(mesh.cells, middle.dNdX, middle.w, laws[1])))
    return Elastic(*body, law_for(what, "small"))


def solved(mesh: Mesh, form: str, what: Any, f: Floats, fixed: Any) -> Floats:
    """Displacements (n, 3), m."""
    energy, n = energy_of(mesh, form, what), mesh.points.size
    dofs = int(getattr(energy, "dofs", n))
    assembly = Assembly(dofs, fixed, [energy], [DisplacementEnergy(DeadForces(f), n)])
    spare = energy.spare[assembly.free] if form == "mixed" else None
    problem = Statics(assembly, VectorSpace(dofs), np.zeros(dofs), fixed, np.zeros(len(fixed)), convex=True,
                      linear=LinearSolverOptions(spare=spare))  # fmt: skip
    return equilibrium(problem).x[:n].reshape(-1, 3)


def sphere_error(kind: str, form: str, n: int, nu: float) -> float:
    """Relative error of Lamé's sphere: u_r = p a^3 r/(E (b^3 - a^3)) [(1 - 2 nu) + (1 + nu) b^3/(2 r^3)]."""
    mesh = octant(1.0, 2.0, n, n, kind)
    r = np.linalg.norm(mesh.points, axis=1)
    exact = ((1 - 2 * nu) + (1 + nu) * 4 / r**3)[:, None] * mesh.points / 7000
    inside = mesh.facets[(np.abs(r[mesh.facets] - 1.0) < 1e-6).all(axis=1)]
    f = np.zeros(mesh.points.size)
    FollowerPressure(mesh.points, inside, 1.0).add_gradient(np.zeros_like(f), f)
    fixed = np.concatenate([3 * np.flatnonzero(np.abs(mesh.points[:, i]) < 1e-9) + i for i in range(3)])
    u = solved(mesh, form, MATERIALS["linear_elastic"](1000.0, nu, 1.0), -f, fixed)
    return float(np.linalg.norm(u - exact) / np.linalg.norm(exact))


def cook(kind: str, form: str, n: int, nu: float = 0.4999, young: float = 250.0, force: float = 100.0) -> float:
    """How far the corner (48, 52) of Cook's membrane rises in plane strain; n cells along each side, one through it."""
    bricks = Box((1.0, 1.0, 1.0)).mesh("hex8", 1.0 / n)
    low = bricks.points.min(axis=0)
    s, t, z = (bricks.points - low).T
    through = 48.0 / n
    layer = (z[bricks.cells] < 1.0 / n + 1e-9).all(axis=1)
    used, cells = np.unique(bricks.cells[layer], return_inverse=True)
    s, t, z = s[used], t[used], z[used]
    points = np.stack([48 * s, 44 * t + s * (44 + t * 16 - 44 * t), z * n * through], axis=1)
    bricks = Mesh(points, cells.reshape(-1, 8), "hex8")
    mesh = mesh_hexahedra(points, bricks.cells, two_colour_points(bricks), ELEMENTS[kind])
    x, y, z = mesh.points.T
    fixed = np.concatenate([3 * np.flatnonzero(x < 1e-9) + i for i in range(2)] + [3 * np.arange(len(x)) + 2])
    f = np.zeros_like(mesh.points)
    facets = mesh.facets[(x[mesh.facets] > 48 - 1e-9).all(axis=1)]
    one = FollowerPressure(mesh.points, facets, 1.0)  # along -x: its shares of the area are those of the shear
    g = np.zeros(mesh.points.size)
    one.add_gradient(np.zeros_like(g), g)
    f[:, 1] = g.reshape(-1, 3)[:, 0]
    f *= force / f[:, 1].sum() * through  # per unit of thickness
    u = solved(mesh, form, MATERIALS["linear_elastic"](young, nu, 1.0), f.ravel(), np.unique(fixed))
    corner = np.argmin((x - 48) ** 2 + (y - 52) ** 2)
    return float(u[corner, 1])


def figure(rows: list[tuple[str, list[float | None]]]) -> str:
    """Errors against 0.5 - nu, both in logarithms, as SVG; 0.5 itself stands at the right edge."""
    width, height, left, top = 640, 400, 70, 20
    colours = ("#b2182b", "#ef8a62", "#d6a400", "#4393c3", "#2166ac", "#5aae61", "#1b7837")
    at = [left + i * (width - left - 170) / (len(RATIOS) - 1) for i in range(len(RATIOS))]

    def y(e: float) -> float:
        return top + (height - top - 40) * (0.0 - math.log10(max(e, 1e-4))) / 4.0

    box = f'viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12"'
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" {box}>']
    for power in range(-4, 1):
        out.append(f'<path d="M{left} {y(10.0**power):.1f}H{at[-1]:.1f}" stroke="#ddd"/>'
                   f'<text x="{left - 8}" y="{y(10.0**power) + 4:.1f}" text-anchor="end">1e{power}</text>')  # fmt: skip
    out += [f'<text x="{a:.1f}" y="{height - 18}" text-anchor="middle">{nu:g}</text>'
            for a, nu in zip(at, RATIOS, strict=True)]  # fmt: skip
    for k, (name, errors) in enumerate(rows):
        known = [(a, y(e)) for a, e in zip(at, errors, strict=True) if e is not None]
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in known)
        place = f'x="{at[-1] + 12:.1f}" y="{top + 20 + 18 * k}"'
        out.append(f'<polyline points="{path}" fill="none" stroke="{colours[k]}" stroke-width="2"/>')
        out.append(f'<text {place} fill="{colours[k]}">{name}</text>')
    words = "relative error of displacements against Poisson's ratio"
    out.append(f'<text x="{left}" y="{height - 3}">{words}</text></svg>')
    return "\n".join(out) + "\n"


def main() -> None:
    """Print the tables, and draw the first."""
    reader = argparse.ArgumentParser(description=__doc__)
    reader.add_argument("--along", type=int, default=4)
    reader.add_argument("--svg", type=Path)
    given = reader.parse_args()
    print("Lamé's sphere, relative error".ljust(32) + "".join(f"{nu:>10g}" for nu in RATIOS))
    rows: list[tuple[str, list[float | None]]] = []
    for kind, form in FORMS:
        n = max(1, given.along // 2) if ELEMENTS[kind].order == 2 else given.along
        errors = [sphere_error(kind, form, n, nu) if nu < 0.5 or form == "mixed" else None for nu in RATIOS]
        rows.append((f"{kind} {form.replace('_', ' ')}", errors))
        print(rows[-1][0].ljust(32) + "".join(f"{'-' if e is None else f'{e:.2e}':>10}" for e in errors), flush=True)
    print("\nCook's membrane, plane strain, nu = 0.4999: rise of C, 7.403 in the limit")
    print("cells along a side".ljust(32) + "".join(f"{n:>10}" for n in (4, 8, 16)))
    for kind, form in FORMS:
        sides = [n // 2 if ELEMENTS[kind].order == 2 else n for n in (4, 8, 16)]
        rises = [cook(kind, form, n) for n in sides]
        print(f"{kind} {form.replace('_', ' ')}".ljust(32) + "".join(f"{rise:>10.3f}" for rise in rises), flush=True)
    if given.svg:
        given.svg.write_text(figure(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
