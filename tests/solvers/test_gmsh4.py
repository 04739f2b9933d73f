"""Gmsh 4.1 with all elements saved: what is in no physical group stands beside what is in one, and nothing is lost."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from softmark.solvers.mesh.files import gmsh4
from softmark.solvers.mesh.shapes import MeshFile

FILE = Path(__file__).parents[1] / "errors" / "parts" / "named.msh"


def all_saved() -> str:
    """The bar with a face and a cell in no group, and a corner, as Gmsh writes all elements of a body."""
    text = FILE.read_text()
    for line, bare in (
        ("3 0 0 0 0 1 1 1 11 0\n", "3 0 0 0 0 1 1 0 0\n"),
        ("1 0 0 0 1 1 1 1 1 0\n", "1 0 0 0 1 1 1 0 0\n"),
    ):
        assert line in text
        text = text.replace(line, bare)
    text = text.replace("0 0 4 2\n", "1 0 4 2\n1 0 0 0 0\n")
    return text.replace("$Elements\n6 6 1 6\n", "$Elements\n7 7 1 7\n0 1 15 1\n7 1\n")


def as_numbers(text: str) -> bytes:
    """The same in binary numbers of 8 bytes."""
    out = [b"$MeshFormat\n4.1 1 8\n", struct.pack("=i", 1), b"\n$EndMeshFormat\n"]
    out.append((text[text.index("$PhysicalNames") : text.index("$Entities")]).encode())
    for name in ("Entities", "Nodes", "Elements"):
        words = iter(text[text.index(f"${name}\n") : text.index(f"$End{name}")].split()[1:])
        out.append(f"${name}\n".encode())
        counts = [int(next(words)) for _ in range(4)]
        out.append(struct.pack("=4Q", *counts))
        for dim, count in enumerate(counts if name == "Entities" else [counts[0]]):
            for _ in range(count):
                if name == "Entities":
                    out.append(struct.pack("=i", int(next(words))))
                    out.append(
                        struct.pack("=3d" if not dim else "=6d", *(float(next(words)) for _ in range(6 if dim else 3)))
                    )
                    for _ in range(2 if dim else 1):
                        many = int(next(words))
                        out.append(struct.pack(f"=Q{many}i", many, *(int(next(words)) for _ in range(many))))
                    continue
                kind = [int(next(words)) for _ in range(3)]
                many = int(next(words))
                out.append(struct.pack("=3iQ", *kind, many))
                if name == "Nodes":
                    out.append(struct.pack(f"={many}Q", *(int(next(words)) for _ in range(many))))
                    out.append(struct.pack(f"={3 * many}d", *(float(next(words)) for _ in range(3 * many))))
                else:
                    wide = many * (1 + {15: 1, 2: 3, 3: 4, 5: 8}[kind[2]])
                    out.append(struct.pack(f"={wide}Q", *(int(next(words)) for _ in range(wide))))
        out.append(f"\n$End{name}\n".encode())
    return b"".join(out)


@pytest.mark.parametrize("binary", [False, True])
def test_elements_in_no_group_are_read_beside_those_in_one(tmp_path: Path, binary: bool) -> None:
    """It was refused, as meshio stops at such files: now both cells, and the groups that there are."""
    file = tmp_path / "all.msh"
    file.write_bytes(as_numbers(all_saved()) if binary else all_saved().encode())
    mesh = MeshFile(path=str(file), unit=1.0).mesh_with_groups()
    assert mesh.volumes.sum() == pytest.approx(2.0, rel=1e-12)
    assert mesh.groups is not None
    assert {n: g.described for n, g in mesh.groups.items() if n not in ("between", "soft")} == {
        "tip": "1 face", "wall": "1 face", "half": "1 face", "hard": "1 cell",
    }  # fmt: skip


def test_a_file_whose_elements_all_have_groups_is_left_alone(tmp_path: Path) -> None:
    """So is one that breaks off, which meshio may say, and one of another format."""
    assert gmsh4.repair(FILE) is None
    for name, data in {
        "cut": as_numbers(all_saved())[:400], "words": all_saved().encode()[:250], "old": b"$MeshFormat\n2.2 0 8\n",
        "many": all_saved().replace("1 0 4 2\n", "1 99999999999 4 2\n").encode(), "bare": b"$MeshFormat\n4.1",
    }.items():  # fmt: skip
        (file := tmp_path / f"{name}.msh").write_bytes(data)
        assert gmsh4.repair(file) is None, name
