"""Distances across slots and folds: of blocks of cubes with some left out, whose distances are whole numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import softmark
from softmark.solvers.contact.surface_separation import least_facing_distance
from softmark.solvers.mesh.mesh import Mesh


def distance(solid: np.ndarray, size: tuple[float, float, float], turn: float = 0.0) -> float | None:
    """Of the surface of the cubes that are in `solid` (k, l, m), with edges of a size, turned about z."""
    grid = np.array(np.meshgrid(*(np.arange(n + 1) for n in solid.shape), indexing="ij")).reshape(3, -1).T
    number = {tuple(p): i for i, p in enumerate(grid.tolist())}
    around = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.array([[number[tuple(np.add(c, o))] for o in around] for c in np.argwhere(solid).tolist()])
    c, s = np.cos(turn), np.sin(turn)
    X = grid * np.array(size) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    facets = Mesh(X, cells, "hex8").facets
    triangles = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])
    a, b, d = (X[triangles[:, i]] for i in range(3))
    n = np.cross(b - a, d - a)
    return least_facing_distance(X, triangles, n / np.linalg.norm(n, axis=1, keepdims=True))


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("width", [1, 2, 3])
def test_a_slot_is_as_wide_as_it_is(width: int, turn: float) -> None:
    """A block of 6 x 4 x 8 cells of 2 x 3 x 0.5 with a slot of so many cells across z."""
    solid = np.ones((6, 4, 8), dtype=bool)
    solid[2:, :, 3 : 3 + width] = False
    assert distance(solid, (2.0, 3.0, 0.5), turn) == pytest.approx(0.5 * width, rel=1e-12)


def test_parts_that_do_not_face_each_other_have_no_distance() -> None:
    """Of a block, and of one with a step, whose walls meet in a right angle."""
    solid = np.ones((6, 4, 8), dtype=bool)
    assert distance(solid, (1.0, 1.0, 1.0)) == np.inf
    solid[3:, :, 4:] = False
    assert distance(solid, (1.0, 1.0, 1.0)) == np.inf


def test_a_finger_above_a_wall() -> None:
    """A hook whose tip, one cell thick, is two cells above the base: 2 times 1.5."""
    solid = np.zeros((6, 1, 6), dtype=bool)
    solid[:, :, 0] = solid[0] = solid[:, :, 5] = True
    solid[5, :, 3:] = True
    assert distance(solid, (1.0, 1.0, 1.5)) == pytest.approx(3.0, rel=1e-12)


FOLD = """material soft = neo_hookean(young = 100 kPa, poisson = 0.3, density = 1000 kg/m^3)
body hook = solid(difference(box(size = (40, 10, 30) mm), box(size = (32, 10, 6) mm, origin = (8, 0, 12) mm)), soft)
support base = fixed(hook, where = z <= 0 mm)
support lid = displaced(hook, where = z >= 30 mm, by = (0, 0, -0.001) mm)
contact fold = self_contact(hook)
model tets = fem(tet4, strain = finite, size = 10 mm)
metric near = gap(fold)
"""


@pytest.mark.slow
@pytest.mark.long
def test_a_fold_that_has_not_closed_yet(tmp_path: Path) -> None:
    """The slot is 6 mm wide, less the micrometre by which the lid comes down, of which it closes a part."""
    pytest.importorskip("manifold3d")
    pytest.importorskip("ipctk")
    (tmp_path / "fold.scene").write_text(FOLD)
    report = softmark.load(str(tmp_path / "fold.scene")).run()
    assert report.models["tets"].metrics["near"].value == pytest.approx(6e-3 - 0.5e-6, abs=0.6e-6)
