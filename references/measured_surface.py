"""Measured surfaces in files, read with trimesh and meshio."""

from __future__ import annotations

import importlib
import math
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.mesh_file_hazards import find_hazard
from softmark.records import dataclass
from softmark.references.data_download import find_file, source_of
from softmark.references.measured_data import FileFrame, MeasuredSurface, Unreadable, Vector
from softmark.references.reference_base import How, Reference
from softmark.references.registration import Registration, face_to_face, icp
from softmark.references.surface_geometry import (
    SurfaceSearch,
    area_vectors,
    areas,
    count_open_edges,
    drop_unused_points,
    find_connected_parts,
    signed_volume,
    unit_normals,
)
from softmark.resource_limits import describe_read_error, limited_resources
from softmark.safe_files import open_regular, read_regular

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Ints = NDArray[np.int64]
    Triangulated = tuple[Array, Ints]  # points (n, 3) in m, triangles (t, 3)
else:
    from softmark.references.lazy_imports import np

ABSURD = 1e50  # m: areas of larger triangles leave the range of numbers
TRIMESH = frozenset({".stl", ".obj", ".ply", ".off"})
VOLUMES = frozenset({"tetgen", "dolfin-xml"})  # which lie in several files
UNENDING = frozenset({"ansys", "tecplot"})  # meshio's readers of these never return from a truncated file

FLAT = 0.99  # |sum of area vectors| / area of a face that counts as flat: normals within some 8 degrees
TILT = math.cos(math.radians(30))  # largest angle of a triangle of the measured face against the held one
ALIKE = (0.8, 1.25)  # area of the measured face over that of the held one


@dataclass(frozen=True)
class SurfaceScan(Reference):
    """The surface of a body in one state, measured and written to a file.

    Formats: STL, OBJ, PLY and OFF through trimesh; VTK, VTU, Gmsh and others through meshio. Quadrilaterals are split,
    duplicate points are merged. `x` and `z` are the file's directions of the scene's axes, y follows; `unit` is the
    length of one unit of the file; `origin` is the position of the file's origin.

    `register = clamp` moves the surface rigidly so that its flat face near the held face of the undeformed body
    coincides with it; the residual is reported. `register = icp` moves it onto the computed surface of each model,
    which hides every error that resembles a rigid motion: then only its shape is compared.

    `uncertainty` is the largest distance of any point of the surface from the truth: smaller differences are not
    significant. A path that begins with `data:` names a public data set, which is downloaded once.
    Source: the authors of the measurement, given by `citation` or the data set.
    """

    path: Annotated[str, "file", "path of the file, relative to the scene, or a data set such as `data:...`"]
    unit: Annotated[float, "m in (0, inf)", "length of one unit of the file's coordinates"]
    uncertainty: Annotated[float, "m in [0, inf)", "largest distance of a measured point from its true position"]
    x: Annotated[Vector, "direction", "direction in the file of the scene's x axis"] = (1.0, 0.0, 0.0)
    z: Annotated[Vector, "direction", "direction in the file of the scene's z axis"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector, "m", "position of the file's origin in the scene"] = (0.0, 0.0, 0.0)
    register: Annotated[Literal["none", "clamp", "icp"], "registration: how the surface is moved onto the body"] = (
        "none"
    )
    near: Annotated[float | None, "m in (0, inf)",
                    "search distance of `clamp` from the held face; default: a tenth of its extent"] = None  # fmt: skip
    keep: Annotated[Literal["all", "largest"], "disconnected parts of the surface to keep"] = "all"
    citation: Annotated[str, "authors of the measurement"] = ""
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    how: ClassVar[How] = "measured"
    source: ClassVar[str] = "the file named in the scene"
    error_meaning: ClassVar[str] = "uncertainty of the position of a measured point, m, as stated in the scene"

    def load(
        self,
        held: Triangulated | None = None,
        target: Triangulated | None = None,
        beside: Path | None = None,
    ) -> MeasuredSurface:
        """Return the surface in the scene's coordinates, registered as the scene requests.

        `held` is the fixed face of the undeformed body, for `clamp`; `target` is the computed surface, for `icp`. File
        names are relative to the folder `beside`. Raises Unreadable.
        """
        points, triangles = read_surface(find_file(self.path, beside))
        frame = FileFrame(self.unit, self.x, self.z, self.origin)
        points, triangles, notes = clean_surface(self.path, frame.points(points, self.path), triangles, self.keep)
        by = source_of(self.citation, self.path, Path(self.path).name)
        return self._register_surface(
            MeasuredSurface(points, triangles, self.uncertainty, by, notes=notes), held, target
        )

    def _register_surface(
        self, measured: MeasuredSurface, held: Triangulated | None, target: Triangulated | None
    ) -> MeasuredSurface:
        onto = {"none": None, "clamp": held, "icp": target}[self.register]
        if self.register == "none":
            return measured
        if onto is None:
            what = "a face of the body that is held" if self.register == "clamp" else "a computed surface"
            raise Unreadable(self.path, f"`register = {self.register}` needs {what}, but there is none",
                             "remove `register`, or add what it needs")  # fmt: skip
        found = (
            self._register_clamped_face(measured, onto)
            if self.register == "clamp"
            else icp(measured.points, SurfaceSearch(*onto))
        )
        note = (
            f"registered ({self.register}): moved by {_describe_registration(found, measured)}, {found.residual.words}"
        )
        note += "" if found.converged else f"; not converged after {found.steps} steps"
        return replace(
            measured, points=found.motion(measured.points), residual=found.residual, notes=(*measured.notes, note)
        )

    def _register_clamped_face(self, measured: MeasuredSurface, held: Triangulated) -> Registration:
        """Return the rigid motion of the measured face onto the fixed face `held` of the body.

        After the motion the measured face is identified again.
        """
        near = self.near or 0.1 * float(np.ptp(held[0][np.unique(held[1])], axis=0).max())
        placed, triangles = measured.points, measured.triangles
        first = face_to_face(placed, self._find_clamped_face(placed, triangles, held, near), *held)
        placed = first.motion(measured.points)
        second = face_to_face(placed, self._find_clamped_face(placed, triangles, held, near), *held)
        return replace(second, motion=first.motion.then(second.motion))

    def _find_clamped_face(self, points: Array, triangles: Ints, held: Triangulated, near: float) -> Ints:
        """Return the triangles (m, 3) near the fixed face `held` that have its orientation. Raises Unreadable."""
        outward, area = area_vectors(*held).sum(axis=0), float(areas(*held).sum())
        if np.linalg.norm(outward) < FLAT * area:
            raise Unreadable(self.path, "`register = clamp` needs a flat held face, and this one is not flat",
                             "remove `register`, and position the surface by `x`, `z` and `origin`")  # fmt: skip
        along = unit_normals(points, triangles) @ (outward / np.linalg.norm(outward)) > TILT
        looking: Ints = triangles[along]
        away = SurfaceSearch(*held).closest(points[looking].mean(axis=1)).distances if len(looking) else np.zeros(0)
        face: Ints = looking[away <= near]
        ratio = float(areas(points, face).sum()) / area
        if not ALIKE[0] <= ratio <= ALIKE[1]:
            raise Unreadable(self.path, f"the surface has no face like the held one within {1e3 * near:.3g} mm of it: "
                             f"the triangles there have {ratio:.2g} of its area",
                             "position the surface by `x`, `z` and `origin` first, or increase `near`")  # fmt: skip
        return face


def _describe_registration(found: Registration, measured: MeasuredSurface) -> str:
    middle = measured.points.mean(axis=0)
    shift = float(np.linalg.norm(found.motion(middle[None])[0] - middle))
    return f"{1e3 * shift:.3g} mm and {math.degrees(found.motion.angle):.3g} degrees"


def clean_surface(name: str, points: Array, triangles: Ints, keep: str = "all") -> tuple[Array, Ints, tuple[str, ...]]:
    """Return a surface without duplicate points, with triangles outward, and notes about the changes.

    If `keep` requests it, small parts are removed as well. Raises Unreadable if no triangle is left or a coordinate is
    not finite.
    """
    _check_coordinates(name, points)
    points, triangles, merged = _merge_points(points, triangles)
    if not len(triangles):
        raise Unreadable(name, "all of its triangles are degenerate", "repair the file")
    notes = [f"{merged} duplicate points are merged"] if merged else []
    part = find_connected_parts(len(points), triangles)
    sizes = np.bincount(part)
    if (sizes > 0).sum() > 1:
        largest = part == sizes.argmax()
        rest = f"{int((sizes > 0).sum()) - 1} smaller parts of {int((~largest).sum())} of {len(part)} triangles"
        notes.append(f"{rest} are {'left out' if keep == 'largest' else 'kept'}")
        if keep == "largest":
            points, triangles = drop_unused_points(points, triangles[largest])
    return points, *_orient_outward(points, triangles, notes)


def _check_coordinates(name: str, points: Array) -> None:
    """Raise Unreadable for coordinates that are not finite, or too large to compute distances."""
    bad = ~(np.abs(points) < ABSURD).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        what = "too large" if np.isfinite(points[first]).all() else "not finite numbers"
        told = ", ".join(f"{x:g}" for x in points[first])
        raise Unreadable(name,
            f"{int(bad.sum())} of {len(points)} points have coordinates that are {what}; the first is point {first} "
            f"at ({told}) m", "repair the file")  # fmt: skip


def _merge_points(points: Array, triangles: Ints) -> tuple[Array, Ints, int]:
    """Return the surface with coincident points merged, and the number of merged points.

    Triangles without area are dropped.
    """
    points, triangles = drop_unused_points(points, triangles)
    single, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.ravel()[triangles].astype(np.int64)
    a, b, c = triangles.T
    kept = triangles[(a != b) & (b != c) & (c != a)]
    return *drop_unused_points(single, kept), len(points) - len(single)


def _orient_outward(points: Array, triangles: Ints, notes: list[str]) -> tuple[Ints, tuple[str, ...]]:
    gaps = count_open_edges(triangles)
    if gaps:
        notes.append(f"the surface is not closed: {gaps} edges without exactly two triangles")
    if signed_volume(points, triangles) < 0:
        notes.append("its triangles faced inward and are reversed")
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    return triangles, tuple(notes)


def read_surface(file: Path) -> tuple[Array, Ints]:
    """Return points (n, 3) and triangles (t, 3) of a file, in its own units and frame. Raises Unreadable."""
    if file.is_dir():
        raise Unreadable(str(file), "it is a folder", "give the path of a file")
    _require_complete(file)
    points, triangles = (_read_by_trimesh if file.suffix.lower() in TRIMESH else _read_by_meshio)(file)
    if not len(triangles):
        raise Unreadable(file.name, "it has no triangles", "write the surface as triangles")
    wrong = ((triangles < 0) | (triangles >= len(points))).any(axis=1)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise Unreadable(file.name, f"a triangle refers to a point that does not exist: triangle {first} has points "
                         f"{', '.join(map(str, triangles[first]))}, and the file has {len(points)} "
                         f"({int(wrong.sum())} of {len(triangles)} do so)", "write the file again")  # fmt: skip
    return np.asarray(points, dtype=float)[:, :3], np.asarray(triangles, dtype=np.int64)


def _require_complete(file: Path) -> None:
    """Raise Unreadable for an empty file, and for a binary STL that is shorter than its header says."""
    try:
        size = file.stat().st_size
        with open_regular(file) as data:
            head = data.read(84)
    except OSError as error:
        raise Unreadable(file.name, f"it cannot be read ({error.strerror})", "check that it can be opened") from None
    if size == 0:
        raise Unreadable(file.name, "it is empty", "write the file again")
    if file.suffix.lower() == ".stl" and len(head) == 84 and not head.lstrip().startswith(b"solid"):
        count = int.from_bytes(head[80:], "little")
        if size < 84 + 50 * count:
            raise Unreadable(file.name, f"it declares {count} triangles but ends after {(size - 84) // 50}",
                             "write the file again")  # fmt: skip


def _read_by_trimesh(file: Path) -> tuple[Any, Any]:
    try:
        trimesh = importlib.import_module("trimesh")
    except ImportError:
        raise Unreadable(file.name, "reading it needs trimesh", "run `pip install trimesh`") from None
    log = importlib.import_module("logging").getLogger("trimesh")
    level = log.level
    log.setLevel("CRITICAL")  # missing textures do not matter here
    try:
        with limited_resources(file):  # without name and path, so that materials in other files stay unread
            data = BytesIO(read_regular(file))
            mesh = trimesh.load_mesh(data, file_type=file.suffix.lower()[1:], process=False, skip_materials=True)
    except Exception as error:  # its readers raise any exception
        reason = f"trimesh cannot read it ({describe_read_error(error)})"
        raise Unreadable(file.name, reason, "write the file again") from None
    finally:
        log.setLevel(level)
    return getattr(mesh, "vertices", np.zeros((0, 3))), getattr(mesh, "faces", np.zeros((0, 3), dtype=int))


def _read_by_meshio(file: Path) -> tuple[Any, Any]:
    data = _read_meshio_mesh(file)
    blocks = []
    for block in data.cells:
        if block.type in _TRIANGLES:
            cells, corners = np.asarray(block.data), _TRIANGLES[block.type]
            if cells.ndim != 2 or cells.shape[1] != max(corners) + 1:
                reason = f"its {block.type} cells have {cells.shape[-1]} nodes each, not {max(corners) + 1}"
                raise Unreadable(file.name, reason, "write the file again")
            blocks.append(cells[:, corners].reshape(-1, 3))
    if not blocks:
        kinds = ", ".join(sorted({b.type for b in data.cells})) or "none"
        raise Unreadable(file.name, f"it has no triangles or quadrilaterals (its cells: {kinds})",
                         "write only the surface of the body")  # fmt: skip
    return data.points, np.concatenate(blocks)


_TRIANGLES = {"triangle": [0, 1, 2], "quad": [0, 1, 2, 0, 2, 3]}


def _read_meshio_mesh(file: Path) -> Any:
    """Return the mesh that meshio reads from a file, in one of the formats of its suffix. Raises Unreadable."""
    try:
        with limited_resources(file):
            elsewhere = find_hazard(file)
    except Exception as error:  # the HDF5 readers raise any exception
        elsewhere = f"it cannot be read ({describe_read_error(error)})"
    if elsewhere:
        raise Unreadable(file.name, elsewhere, "write it as STL, OBJ, PLY or VTK")
    meshio = importlib.import_module("meshio")
    kinds = meshio.extension_to_filetypes.get(file.suffix.lower(), [None])  # None: meshio reports it
    reasons = []
    for kind in (k for k in kinds if k not in UNENDING | VOLUMES):
        said = StringIO()  # meshio prints why it fails, and exits
        try:
            with limited_resources(file), redirect_stdout(said), redirect_stderr(said):
                return meshio.read(file, kind)
        except SystemExit:
            reasons.append(" ".join(said.getvalue().split()) or f"it is not a {kind} file")
        except Exception as error:  # its readers raise any exception
            reasons.append(describe_read_error(error))
    why = "; ".join(reasons) or "in this format it may never finish"
    raise Unreadable(file.name, f"meshio cannot read it ({why})", "write it as STL, OBJ, PLY or VTK")
