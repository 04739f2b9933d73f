"""The patch tests of MacNeal and Harder (1985): boundary displacements of a constant strain give that strain exactly.

Nodes are those of their figures 1 and 2, E = 1e6 and nu = 0.25. In the solid u = 1e-3 (2x + y + z, x + 2y + z,
x + y + 2z) / 2, so that normal stresses are 2000 and shear stresses 400; in the membrane u = 1e-3 (x + y/2, y + x/2),
so that plane stress is 1333.333, 1333.333 and 400. Tolerance: the 1e-9 of a solve that is linear.
"""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

import softmark

SOLID = Path(__file__).parents[1] / "errors" / "parts" / "macneal-harder.inp"
LAW = "linear_elastic(young = 1 MPa, poisson = 0.25, density = 1000 kg/m^3)"
PLANE = np.array([(0, 0), (0.24, 0), (0.24, 0.12), (0, 0.12), (0.04, 0.02), (0.18, 0.03), (0.16, 0.08), (0.08, 0.08)])
CELLS = np.array([(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)])


def scene(path: Path, body: str, nodes: np.ndarray, moved: np.ndarray, model: str, at: tuple[float, ...]) -> str:
    """Each of some nodes moved by a vector; stress and displacement at a point."""
    lines = [f"material own = {LAW}", f"body patch = {body}"]
    for i, (x, u) in enumerate(zip(nodes.tolist(), moved.tolist(), strict=True)):
        where = " + ".join(f"({a} - {v!r} m)^2" for a, v in zip("xyz", x, strict=False))
        along = ", components = (x, y)" if len(u) == 2 else ""
        by = f"({', '.join(map(repr, [*u, 0.0][:3]))}) m"
        lines.append(f"support s{i} = displaced(patch, where = {where} <= (0.1 mm)^2, by = {by}{along})")
    lines += [f"model m = {model}", f"probe p = point(patch, at = ({', '.join(map(repr, at))}) m)",
              "metric u = displacement(p, along = +x)", "metric v = displacement(p, along = +y)"]  # fmt: skip
    lines += [f"metric s{c} = stress(p, component = {c})" for c in ("xx", "yy", "xy")]
    (path / "patch.scene").write_text("\n".join([*lines, ""]))
    return str(path / "patch.scene")


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    "model",
    ["hex8, strain = small", "hex20, strain = small",
     "hex27, strain = small", "hex8, strain = small, formulation = mean_dilatation",
     "hex8, strain = small, integration = selective"],
)  # fmt: skip
def test_the_patch_of_solids(model: str, tmp_path: Path) -> None:
    X = meshio.abaqus.read(SOLID).points
    (tmp_path / "patch.inp").write_text(SOLID.read_text())
    outer = X[8:]
    moved = 0.5e-3 * (outer + outer.sum(axis=1, keepdims=True))
    body = 'solid(mesh("patch.inp", unit = 1 m), own)'
    if not model.startswith("hex8"):  # their edges and faces are held as well, at nodes between the corners
        edges, faces = _between()
        outer = np.concatenate([outer, edges, *([faces] if model.startswith("hex27") else [])])
        moved = 0.5e-3 * (outer + outer.sum(axis=1, keepdims=True))
    at = (0.45, 0.55, 0.4)
    report = softmark.load(scene(tmp_path, body, outer, moved, f"fem({model})", at)).run()
    found = {name: own.value for name, own in report.models["m"].metrics.items()}
    right = {"u": 0.5e-3 * (0.45 + 1.4), "v": 0.5e-3 * (0.55 + 1.4), "sxx": 2000.0, "syy": 2000.0, "sxy": 400.0}
    assert found == pytest.approx(right, rel=1e-9)


def _between() -> tuple[np.ndarray, np.ndarray]:
    """Middles of the edges and faces of the unit cube."""
    cube = np.array([(x, y, z) for x in (0, 0.5, 1) for y in (0, 0.5, 1) for z in (0, 0.5, 1)])
    halves = (cube == 0.5).sum(axis=1)
    return cube[halves == 1], cube[halves == 2]


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("element", ["quad4", "quad8", "quad9"])
def test_the_patch_of_membranes(element: str, tmp_path: Path) -> None:
    meshio.Mesh(np.pad(PLANE, ((0, 0), (0, 1))), [("quad", CELLS)]).write(tmp_path / "patch.vtk")
    outer = PLANE[:4]
    if element != "quad4":
        outer = np.concatenate([outer, 0.5 * (outer + np.roll(outer, -1, axis=0))])
    moved = 1e-3 * (outer + 0.5 * outer[:, ::-1])
    body = 'plane_stress(mesh("patch.vtk", unit = 1 m), own, thickness = 1 mm)'
    report = softmark.load(
        scene(tmp_path, body, outer, moved, f"fem({element}, strain = small)", (0.1, 0.05, 0.0))
    ).run()
    found = {name: own.value for name, own in report.models["m"].metrics.items()}
    right = {"u": 1e-3 * 0.125, "v": 1e-3 * 0.1, "sxx": 4000.0 / 3.0, "syy": 4000.0 / 3.0, "sxy": 400.0}
    assert found == pytest.approx(right, rel=1e-9)
