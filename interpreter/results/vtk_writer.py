"""Writer of meshes and surfaces for ParaView: undeformed meshes with displacements, and surfaces with errors.

Meshes in contact have the contact pressure and the gap of each contact at their nodes. Meshes have stress at their
nodes if the scene asks for stress. Porous bodies have their fluid pressure. If material constants vary in space, cells
have the mean constants, in SI.

A mesh is an object with the attributes `points` (n, 3), m, `cells` (m, a), `kind` (an element's word, nodes in VTK's
order) and `displacement` (n, 3), m; with a history also `times` (t,), s, and `frames` (t, n, 3), m. ParaView's filter
Warp By Vector with `displacement` shows the deformed body.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.results.atomic_files import make_inner_folder, replace, replace_atomically
from softmark.interpreter.results.run_report import DrawnSurface, ModelResult, ReferenceResult, Report
from softmark.solvers.elements import element_of

Floats = NDArray[np.float64]
OWN = ("surface", "end")  # endings of a model's own files, not used for rigid bodies
# meshio 5 writes it, but its own table lacks it
meshio._mesh.topological_dimension.setdefault("wedge15", 3)


def write_vtu(report: Report, folder: str | Path) -> list[Path]:
    """Write vtu/NAME.vtu for each mesh and vtu/NAME-surface.vtu for each surface, in m; return their paths.

    Each rigid body next to a deformable one is written as vtu/NAME-BALL.vtu. A result with a history gets one file for
    each time and NAME.pvd, which ParaView opens as one animation. A result with states gets one file for each solved
    state, with the value of the state in place of the time. Raises OSError, and UnknownElement for an unknown kind of
    cell.
    """
    target = make_inner_folder(Path(folder), "vtu")
    written: list[Path] = []
    taken: set[str] = set()
    for outcome in report.outcomes:
        name = _unique_file_name(outcome.name, taken)
        if outcome.states:
            written += _write_states(target, name, outcome)
            continue
        if isinstance(outcome, ModelResult) and outcome.mesh is not None:
            written += _write_mesh(target, name, outcome)
        if outcome.shape is not None:
            written += _write_surface(target, f"{name}-surface", outcome.shape)
            written += _write_rigid_bodies(target, name, outcome.shape, outcome.shape.times)
    return written


def _unique_file_name(name: str, taken: set[str]) -> str:
    """Return a file name for a result, without characters that file systems refuse, and not in `taken`."""
    base = re.sub(r"[^\w.-]+", "_", name)[:80].strip(".") or "unnamed"
    own, n = base, 1
    while own.lower() in taken:
        own, n = f"{base}-{n + 1}", n + 1
    taken.add(own.lower())
    return own


def _write_mesh(target: Path, name: str, outcome: ModelResult) -> list[Path]:
    """Write the undeformed mesh of a model with its displacements; return the paths.

    A model with a history has displacements at each time, and stress at the end.
    """
    mesh: Any = outcome.mesh
    stress, constants = outcome.stress, _material_constant_fields(outcome)
    X, cells = np.asarray(mesh.points), [(element_of(mesh.kind).meshio, np.asarray(mesh.cells))]
    times, frames, last = mesh.times, mesh.frames, {"displacement": np.asarray(mesh.displacement)}
    known = ({} if stress is None else _stress_fields(stress)) | _fluid_pressure_field(mesh) | _contact_fields(outcome)
    if times is None or frames is None:
        return [_write_file(target / f"{name}.vtu", X, cells, last | known, constants)]
    states = ((X, {"displacement": np.asarray(u)}) for u in frames)
    files = _write_time_series(target, name, times, cells, states, constants)
    return [*files, *([_write_file(target / f"{name}-end.vtu", X, cells, last | known, constants)] if known else [])]


def _write_states(target: Path, name: str, outcome: ModelResult | ReferenceResult) -> list[Path]:
    """Write a mesh and a surface for each solved state; return the paths."""
    each: Sequence[Any] = outcome.each
    pairs, written = list(zip(outcome.states, each, strict=True)), list[Path]()
    solved = [(s, r) for s, r in pairs if isinstance(r, ModelResult) and r.mesh is not None]
    if solved:
        first = solved[0][1].mesh
        cells = [(element_of(first.kind).meshio, np.asarray(first.cells))]
        data = ((np.asarray(r.mesh.points), _nodal_fields(r)) for _, r in solved)
        written += _write_time_series(
            target, name, np.array([s for s, _ in solved]), cells, data, _material_constant_fields(solved[0][1])
        )
    seen = [(s, r.shape) for s, r in pairs if r.shape is not None]
    if seen:
        errors = ((x.position, {} if x.error is None else {"error": x.error}) for _, x in seen)
        triangles, values = [("triangle", seen[0][1].triangles)], np.array([s for s, _ in seen])
        written += _write_time_series(target, f"{name}-surface", values, triangles, errors)
        if outcome.shape is not None and outcome.shape.labels:  # some state has no shape: only the last is written
            written += _write_rigid_bodies(target, name, outcome.shape, values)
    return written


def _nodal_fields(result: ModelResult) -> dict[str, Floats]:
    """Return displacements at static equilibrium, and stress if the scene asks for it, at the nodes, by name."""
    known = {} if result.stress is None else _stress_fields(result.stress)
    return (
        {"displacement": np.asarray(result.mesh.displacement)}
        | known
        | _fluid_pressure_field(result.mesh)
        | _contact_fields(result)
    )


def _fluid_pressure_field(mesh: Any) -> dict[str, Floats]:
    """Return the fluid pressure at the nodes of a porous body, Pa; empty for other bodies."""
    found = getattr(mesh, "pore_pressure", None)
    return {} if found is None else {"pore_pressure": np.asarray(found)}


def _contact_fields(result: ModelResult) -> dict[str, Floats]:
    """Return the pressure, Pa, and the gap, m, of each contact at the nodes; empty without contacts."""
    fields = {name: own.touch.field for name, own in result.contacts.items()}
    known = {name: field.at_nodes for name, field in fields.items() if field is not None}
    return {f"{name}_{word}": values for name, own in known.items() for word, values in own.items()}


def _material_constant_fields(result: ModelResult) -> dict[str, Floats]:
    """Return the material constants that vary in space, by name, for each cell."""
    found: dict[str, Floats] = {} if result.constants is None else result.constants()
    return found


def _stress_fields(stress: Any) -> dict[str, Floats]:
    """Return the Cauchy stress at the nodes, Pa, as xx yy zz xy yz zx (ParaView's order), and von Mises stress.

    The result is empty if there is no stress; the stress metrics give the reason.
    """
    from softmark.solvers.stress_recovery.sampling_point_stress import StressUnavailable

    try:
        field = stress()
        return {"stress": field.at_nodes().six, "von_mises": field.von_mises(), "strain": field.strain()}
    except StressUnavailable:
        return {}


def _write_surface(target: Path, name: str, shape: DrawnSurface) -> list[Path]:
    """Write the deformed surface, with the error of its points at the end if it is known; return the paths."""
    cells = [("triangle", shape.triangles)]
    error = {} if shape.error is None else {"error": shape.error}
    if shape.times is None or shape.frames is None:
        return [_write_file(target / f"{name}.vtu", shape.position, cells, error)]
    start = shape.frames[0]
    states = ((x, {"displacement": x - start}) for x in shape.frames)
    return [
        *_write_time_series(target, name, shape.times, cells, states),
        *([_write_file(target / f"{name}-end.vtu", shape.position, cells, error)] if error else []),
    ]


def _write_rigid_bodies(target: Path, name: str, shape: DrawnSurface, times: Floats | None) -> list[Path]:
    """Write the rigid bodies that a model may touch as NAME-BALL.vtu, or one file for each time or state."""
    written: list[Path] = []
    taken = {f"{name}-{word}".lower() for word in OWN}
    for own in shape.instruments:
        file, triangles = _unique_file_name(f"{name}-{own.name}", taken), [("triangle", own.triangles)]
        if times is None or len(own.turns) == 1:
            written.append(_write_file(target / f"{file}.vtu", own.at(-1), triangles, {}))
        else:
            written += _write_time_series(target, file, times, triangles, ((own.at(i), {}) for i in range(len(times))))
    return written


def _write_time_series(
    target: Path,
    name: str,
    times: Floats,
    cells: Sequence[tuple[str, Any]],
    states: Iterator[tuple[Floats, dict[str, Floats]]],
    of_cells: Mapping[str, Floats] | None = None,
) -> list[Path]:
    """Write a file for each time, and the collection that lists the files with their times; return the paths."""
    files = [
        _write_file(target / f"{name}-{i:04d}.vtu", X, cells, data, of_cells) for i, (X, data) in enumerate(states)
    ]
    entries = "".join(
        f'    <DataSet timestep="{float(t)!r}" part="0" file={quoteattr(file.name)}/>\n'
        for t, file in zip(times, files, strict=True)
    )
    collection = target / f"{name}.pvd"
    replace(
        collection,
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n'
        f"  <Collection>\n{entries}  </Collection>\n</VTKFile>\n",
    )
    return [collection, *files]


def _write_file(
    path: Path, X: Floats, cells: Sequence[tuple[str, Any]], data: dict[str, Floats],
    of_cells: Mapping[str, Floats] | None = None,
) -> Path:  # fmt: skip
    known = {name: [values] for name, values in (of_cells or {}).items()}
    with replace_atomically(path) as part:
        meshio.Mesh(X, list(cells), point_data=data, cell_data=known).write(part)
    return path
