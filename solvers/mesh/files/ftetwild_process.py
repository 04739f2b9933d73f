"""Tetrahedral meshing by fTetWild in a separate process, so that a crash of its C++ code becomes an error.

`python -m softmark.solvers.mesh.files.ftetwild_process IN OUT` reads and writes numpy arrays.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import types

import numpy as np

STOP = 10.0  # energy of the worst cell at which improvement stops, the authors' default
STEPS = 80  # largest number of improvement steps, the authors' default


def main(given: str, wanted: str) -> None:
    """Fill a surface with tetrahedra.

    `given` is a file with the arrays `points`, `triangles`, `size` and `tolerance`; the mesh is written to `wanted`.
    """
    if importlib.util.find_spec("pyvista") is None:
        # pytetwild asks for it when it is imported, and needs it for its own data types only
        sys.modules["pyvista"] = types.ModuleType("pyvista")
    with np.load(given, allow_pickle=False) as surface:
        points, triangles = surface["points"], surface["triangles"]
        size, tolerance = float(surface["size"]), float(surface["tolerance"])
        field = {name: surface[name] for name in ("bg_vertices", "bg_tets", "bg_values") if name in surface}
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    pytetwild = importlib.import_module("pytetwild")
    nodes, cells = pytetwild.tetrahedralize(
        points, triangles.astype(np.int32), edge_length_abs=size, epsilon=tolerance / extent, optimize=True,
        simplify=True, stop_energy=STOP, num_opt_iter=STEPS, coarsen=False, num_threads=1, loglevel=6, quiet=True,
        vtk_ordering=True, **field,
    )  # fmt: skip
    with open(wanted, "wb") as out:
        np.savez(out, points=nodes, cells=cells.astype(np.int64))


if __name__ == "__main__":
    main(*sys.argv[1:])
