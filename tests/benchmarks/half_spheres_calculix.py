"""The two half-spheres of `half_spheres.py` by CalculiX, as bodies of revolution.

    python tests/benchmarks/half_spheres_calculix.py [--kind CAX8 CAX4] [--cells 2 4] [--friction 0.5] [--stiffness 1e5]

Radii of 10, 12 and 14 mm, contact from face to face by a linear penalty from the start, the plate one flat row of cells
whose nodes are all prescribed, rims held up. Its neo-Hookean law is that of Abaqus. Forces on a quarter, N, at 1 to
5 mm. In mm, kPa and mN, for CalculiX takes forces below 1e-6 for none.
"""

from __future__ import annotations

import argparse
import shutil
from typing import Any

import numpy as np
from indentation_calculix import SECTORS, chosen, elements, grid, in_place, nodes, steps, version

Floats = np.ndarray[Any, np.dtype[np.float64]]

SHEAR, BULK = 1e3 / 2.6, 1e3 / 1.2  # kPa: E = 1 MPa, nu = 0.3
RADII = (10.0, 12.0, 14.0)
COARSER = 1.3  # cells of the outer one along its side


def ring(inner: float, outer: float, through: int, along: int) -> tuple[Floats, Any]:
    """Points (n, 2) and eight-node cells (m, 8) from the axis (y) to the rim (x); their third side is the outer."""
    flat, cells = grid(np.linspace(0.0, np.pi / 2, along + 1), np.linspace(inner, outer, through + 1))
    points = np.stack([flat[:, 1] * np.sin(flat[:, 0]), flat[:, 1] * np.cos(flat[:, 0])], axis=1)
    return np.where(np.abs(points) < 1e-9, 0.0, points), cells


def linear(points: Floats, cells: Any) -> tuple[Floats, Any]:
    """Of their corners alone."""
    used, cells = np.unique(cells[:, :4], return_inverse=True)
    return points[used], cells.reshape(-1, 4)


def parts(kind: str, through: int) -> list[tuple[Floats, Any]]:
    """Points and cells of the inner body, the outer one, and the plate."""
    along = round(through / 2 * RADII[0] * np.pi / 2)
    flat = grid(np.linspace(0.0, RADII[2], 5), np.array([RADII[2], RADII[2] + 1.0]))
    made = [ring(*RADII[:2], through, along), ring(*RADII[1:], through, round(along / COARSER)), flat]
    return made if kind.startswith("CAX8") else [linear(*one) for one in made]


def sides(name: str, cells: Any, side: int) -> list[str]:
    """Cards of a surface."""
    return [f"*SURFACE, NAME={name}", *(f"{e},S{side}" for e in cells)]


def contact(k: float, friction: float, slope: float) -> list[str]:
    """Cards of both contacts: plate without friction, and between the bodies."""
    law = ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{k:.6e}"]
    rough = ["*FRICTION", f"{friction},{slope:.6e}"] if friction else []
    pair = "*CONTACT PAIR, TYPE=SURFACE TO SURFACE, INTERACTION="
    return ["*SURFACE INTERACTION, NAME=SMOOTH", *law, "*SURFACE INTERACTION, NAME=ROUGH", *law, *rough,
            f"{pair}SMOOTH", "TOP,PLATE", f"{pair}ROUGH", "SKIN,SHELL"]  # fmt: skip


def deck(kind: str, through: int, k: float, friction: float, slope: float, increment: float) -> str:
    """All cards."""
    lines: list[str] = []
    rim, axis, layers, node, cell = [], [], [], 1, 1
    for (points, cells), name in zip(parts(kind, through), ("ONE", "OTHER", "LID"), strict=True):
        lines += nodes(points, node, "NBALL" if name == "LID" else f"N{name}")
        lines += elements(kind, cells, node, cell, name)
        below, above = (np.hypot(*points[cells[:, i]].T) for i in (0, 2))  # of the first and of the third side
        layers.append(
            (cell + np.flatnonzero(below < below.min() + 1e-6), cell + np.flatnonzero(above > above.max() - 1e-6))
        )
        if name != "LID":
            rim += (node + np.flatnonzero(points[:, 1] < 1e-9)).tolist()
            axis += (node + np.flatnonzero(points[:, 0] < 1e-9)).tolist()
        node, cell = node + len(points), cell + len(cells)
    lines += chosen("NSET", "WALL", rim) + chosen("NSET", "AXIS", axis)
    lines += sides("SKIN", layers[0][1], 3) + sides("SHELL", layers[1][0], 1) + sides("TOP", layers[1][1], 3)
    lines += ["*SURFACE, NAME=PLATE", *(f"{cell - 1 - i},S1" for i in range(4))]
    lines += ["*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, NEO HOOKE", f"{SHEAR / 2:.14e},{2 / BULK:.14e}"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "1e6,0.3"]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=RUBBER" for name in ("ONE", "OTHER")]
    lines += ["*SOLID SECTION, ELSET=LID, MATERIAL=STEEL", *contact(k, friction, slope)]
    lines += ["*BOUNDARY", "WALL,2,2", "AXIS,1,1", "NBALL,1,1"]
    return "\n".join([*lines, *steps((1.0, 2.0, 3.0, 4.0, 5.0), 2, True, increment, tight=True), ""])


def main() -> None:
    """Print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--kind", nargs="+", default=["CAX8"])
    parser.add_argument("--cells", type=int, nargs="+", default=[2, 4], help="through each wall")
    parser.add_argument("--stiffness", type=float, default=1e5, help="k of the contact, kPa/mm")
    parser.add_argument("--slope", type=float, default=1e4, help="of sticking, kPa/mm")
    parser.add_argument("--friction", type=float, default=0.0)
    parser.add_argument("--increment", type=float, default=0.1, help="mm, the first")
    options = parser.parse_args()
    if shutil.which("ccx") is None:
        raise SystemExit("ccx is not on the path")
    print(f"CalculiX {version()}, friction {options.friction:g}; N on a quarter at 1 to 5 mm")
    for kind in options.kind:
        for cells in options.cells:
            asked = (kind, cells, options.stiffness, options.friction, options.slope, options.increment)
            found = in_place(deck(*asked))
            pushes = " ".join(f"{1e-3 * SECTORS * reaction[1] / 4:.4f}" for reaction in found["reactions"])
            print(f"{kind} {cells} cells: {pushes}  {found['iterations']} iterations, {found['cpu']:.0f} s", flush=True)


if __name__ == "__main__":
    main()
