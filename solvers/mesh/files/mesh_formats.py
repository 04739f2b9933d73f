"""Checks of mesh files by their names: formats of surfaces only, formats of volume meshes, and remedies.

No file is read here, and numpy is not needed.
"""

from __future__ import annotations

from pathlib import Path

SURFACES = frozenset({".stl", ".ply", ".off", ".obj", ".svg", ".wkt"})  # no tetrahedra or hexahedra in these
MESHES = frozenset({
    ".avs", ".bdf", ".cgns", ".dat", ".dato", ".e", ".ele", ".ex2", ".exo", ".f3grid", ".fem", ".gz", ".h5m", ".hmf",
    ".inp", ".mdpa", ".med", ".mesh", ".meshb", ".msh", ".nas", ".node", ".post", ".su2", ".tec", ".ugrid", ".vol",
    ".vtk", ".vtu", ".xdmf", ".xmf", ".xml",
})  # fmt: skip
MERGED = frozenset({".stl", ".msh", ".mesh", ".obj"})  # surfaces that Gmsh can merge and fill


def find_format_problem(path: str) -> tuple[str, str] | None:
    """Return why a file cannot contain a solid mesh, and the remedy; None if it can contain one.

    The file's name and size are examined, not its content.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix in SURFACES:
        return f"{suffix} files contain a surface, without tetrahedra or hexahedra", advise_filling(file)
    if suffix not in MESHES:
        known = "convert it to .vtu, .vtk, .msh, .inp or .mesh, and name that file"
        return f"`{suffix or file.name}` is not a known extension of mesh files", known
    if file.is_file() and file.stat().st_size == 0:
        return "it is empty", "write the file again"
    return None


def advise_filling(file: Path) -> str:
    """Return advice on filling a surface with tetrahedra.

    In Gmsh a volume must be declared first; otherwise `gmsh -3` leaves only triangles.
    """
    suffix, name = file.suffix.lower(), file.name
    first = ""
    if suffix not in MERGED:
        first, name = f"run `meshio convert {name} {file.stem}.stl`, then ", f"{file.stem}.stl"
    script, made = f"{file.stem}-filled.geo", f"{file.stem}-filled.msh"
    return ("write `tetrahedralized(...)` instead of `mesh(...)` to fill the closed surface; or use Gmsh: "
            f"{first}write a file `{script}` with the line\n"
            f'`Merge "{name}"; Surface Loop(1) = Surface{{:}}; Volume(1) = {{1}};`\n'
            f"and `gmsh -3 {script} -o {made}`; then name `{made}` here")  # fmt: skip
