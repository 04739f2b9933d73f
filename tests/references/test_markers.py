"""Tracked points: the table's format, its frame, and the Truth Cube."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from softmark.references.measured_data import Unreadable
from softmark.references.tracked_points import TrackedPoints

SHARED = Path(__file__).parents[3] / "shared" / "data"
CUBE = "data:truth-cube/truthcube_uniaxial_positions.csv"

TABLE = """Beads of a block, in mm
x0,y0,z0,x1,y1,z1,name
0,0,0,1,0,0,a
10,0,0,,,,b
0,20,0,0,21,2,c
"""


def table(folder: Path, text: str = TABLE) -> str:
    (folder / "beads.csv").write_text(text)
    return str(folder / "beads.csv")


@pytest.fixture
def measured_data(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(os.environ.get("SOFTMARK_DATA") or SHARED)
    if not (folder / "truth-cube").is_dir():
        pytest.skip(f"no measured data in {folder}: set SOFTMARK_DATA")
    monkeypatch.setenv("SOFTMARK_DATA", str(folder))


def test_positions_become_displacements_in_the_scene(tmp_path: Path) -> None:
    found = TrackedPoints(table(tmp_path), 1e-3, 1e-4, x=(0, 1, 0), z=(0, 0, 1), origin=(1.0, 0, 0)).load()
    # The scene's x is the file's y, its z the file's z, so its y is the file's -x.
    assert pytest.approx(np.array([[1.0, 0, 0], [1.02, 0, 0]])) == found.X
    assert found.u == pytest.approx(np.array([[0, -1e-3, 0], [1e-3, 0, 2e-3]]))
    assert found.x == pytest.approx(found.X + found.u)
    assert found.names == ("a", "c")
    assert found.grid is None
    assert found.notes == ("1 of 3 points without a position are omitted",)
    assert found.uncertainty == 1e-4


def test_states_are_chosen_by_number(tmp_path: Path) -> None:
    text = "z2,x0,y0,z0,x2,y2\n3,0,0,1,1,2\n"  # columns in any order
    found = TrackedPoints(table(tmp_path, text), 1.0, 0.0, state=2).load()
    assert found.u == pytest.approx(np.array([[1.0, 2.0, 2.0]]))
    assert found.names == ("1",)
    back = TrackedPoints(table(tmp_path, text), 1.0, 0.0, state=0, rest=2).load()
    assert back.u == pytest.approx(-found.u)
    with pytest.raises(Unreadable, match="the table has no state 1; its states are 0, 2"):
        TrackedPoints(table(tmp_path, text), 1.0, 0.0).load()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "its header has no columns x0, y0, z0"),
        ("a,b\n1,2\n", "its header has no columns x0, y0, z0"),
        ("x0,y0,z0,x1,y1,z1,X1\n0,0,0,1,1,1,5\n", "several columns are called `x1`: number 4, 7"),
        ("x0,y0,z0,x1,y1,z1\n", "it has no rows"),
        ("x0,y0,z0,x1,y1,z1\n1,2,3\n", "a row has 3 fields, the header has 6"),
        ("x0,y0,z0,x1,y1,z1\n1,2,3,4,5,six\n", "`six` in column z1 is not a number"),
        ("x0,y0,z0,x1,y1,z1\n1,2,3,,,\n", "no point has a position in states 0 and 1"),
    ],
)
def test_tables_that_cannot_be_used(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(Unreadable, match=reason):
        TrackedPoints(table(tmp_path, text), 1.0, 0.0).load()


def test_a_table_that_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "beads.csv").write_bytes(b"\xff\xfe\x00x0,y0,z0")
    with pytest.raises(Unreadable, match="it cannot be read"):
        TrackedPoints("beads.csv", 1.0, 0.0).load(beside=tmp_path)


@pytest.mark.parametrize(
    ("state", "layers"),
    [
        (1, [0.32, 0.82, 1.49, 2.23, 2.94, 3.67, 4.34]),
        (2, [0.90, 2.12, 3.66, 5.33, 6.98, 8.66, 10.16]),
        (3, [1.47, 3.24, 5.58, 8.02, 10.47, 12.87, 15.02]),
    ],
)
def test_the_layers_of_the_truth_cube(measured_data: None, state: int, layers: list[float]) -> None:
    # Mean vertical displacement of the seven layers of beads, from the bottom up, by an independent reading of
    # the table; given to 0.01 mm. -z is up in the file, so the scene's z is the file's -z.
    found = TrackedPoints(CUBE, 1e-3, 0.3e-3, state=state, z=(0, 0, -1)).load()
    assert found.X.shape == (343, 3)
    assert found.grid is not None
    down = [-1e3 * found.u[found.grid[:, 2] == k, 2].mean() for k in range(1, 8)]
    assert down == pytest.approx(layers, abs=0.0051)
    assert found.names[0] == "1,1,1"
    assert found.source.startswith("Kerdok")


def test_the_grid_of_the_truth_cube(measured_data: None) -> None:
    # Beads lie nominally 10 mm apart: 10.09 +- 0.42 mm, by an independent reading of the table.
    found = TrackedPoints(CUBE, 1e-3, 0.3e-3, z=(0, 0, -1)).load()
    assert found.grid is not None
    order = np.lexsort(found.grid.T[::-1])
    X = found.X[order].reshape(7, 7, 7, 3)
    apart = np.concatenate([np.linalg.norm(np.diff(X, axis=a), axis=-1).ravel() for a in range(3)])
    assert 1e3 * apart.mean() == pytest.approx(10.09, abs=0.1)
    assert X[:, :, 6, 2].mean() > X[:, :, 0, 2].mean()  # layer 7 is the top
