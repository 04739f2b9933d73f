"""Material regions of a body on a mesh: the material of every cell, and the volume error of each region.

A cell has the material that fills most of it. Volume fractions of cells are computed as for supports
(support_selection.py): they are exact for plane borders and straight cells.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.coordinate_conditions import Condition
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.shared.support_selection import MISSED, SMALL, WHOLE, cells_of, selected_fractions
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.material_layers import overlap_fault, region_conditions, unordered_overlaps
from softmark.interpreter.problem.surface_selection.selected_pieces import Bools, slack_of
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.element_interpolation import IntegrationPoints
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Prepared

CUBIC: units.Dimension = units.raise_dimension(units.LENGTH, 3)
THIN = 0.25  # of a cell: a curve cuts less than this off a cell whose nodes follow it


@dataclass(frozen=True)
class RegionVolume:
    """Volume of a material region, m^3: in the scene (`asked`), and of the cells that have its material (`taken`).

    `missed` is the part of the region in cells of another material; `beyond` is the part of its cells outside the
    region. `bent` is the part of both that lies between a curved border and the flat sides of cells along that border.
    `beside` is the smallest volume, m^3, of the body and the other regions, because a small error of a large region may
    be large for a small neighbour.
    """

    asked: float
    taken: float
    missed: float
    beyond: float
    beside: float
    bent: float = 0.0

    @property
    def wrong_material_fraction(self) -> float:
        """Volume with the wrong material, relative to the region or to its smallest neighbour, whichever is smaller."""
        return self._share(self.missed + self.beyond)

    @property
    def cut_cell_error(self) -> float:
        """Relative volume with the wrong material in cells that the border of the region crosses.

        The value is `off` without the volume between a curved border and the flat sides of cells along that border.
        """
        return self._share(max(self.missed + self.beyond - self.bent, 0.0))

    def _share(self, wrong: float) -> float:
        """Return the volume `wrong`, m^3, relative to the region or to its smallest neighbour, whichever is smaller."""
        return wrong / min(self.asked, self.beside) if wrong else 0.0


@dataclass(frozen=True)
class CellMaterials:
    """Material of every cell of a mesh, and the volumes of each region.

    `cells` (m,) are indices of materials, 0 for the body. `shares` (r + 1, m) are the volume fractions of every
    material in each cell, first of the body. `sizes` (m,) are cell volumes, m^3.
    """

    cells: Ints
    taken: tuple[RegionVolume, ...]
    shares: Floats
    sizes: Floats

    def larger_change_side(self, part: int) -> int:
        """Return which assignment of the cells cut by the border of region `part` changes more volume.

        1 means that the region gets all cut cells, -1 that it gets none.
        """
        most = _dominant_material(self.shares)
        more, less = (
            float(self.sizes[_assign_cut_cells(self.shares, most, part, way) != most].sum()) for way in (1, -1)
        )
        return 1 if more >= less else -1


def region_meshes(
    case: Case, mesh: Mesh, parts: IntegrationPoints
) -> Iterator[tuple[Case, Mesh, IntegrationPoints, Ints, int]]:
    """Yield the cells of every material that fills at least one cell. Raises Fault.

    The values are fields of `MaterialRegion` (material_regions.py): case, mesh, integration, cell indices and index
    of the material.
    """
    for number, material in enumerate(case.materials):
        which = np.flatnonzero(materials_of_cells(case, mesh).cells == number)
        if len(which):
            own = IntegrationPoints(np.ascontiguousarray(parts.dNdX[which]), parts.w[which], parts.N)
            alone = replace(case, other_material=material, parts=())
            yield alone, submesh(mesh, which), own, which, number


def submesh(mesh: Mesh, which: Ints) -> Mesh:
    """Return a mesh of the cells `which` with all nodes; repeated calls return the same mesh with its caches."""
    kept: list[tuple[Ints, Mesh]] = mesh.selections.setdefault(submesh, [])
    for own, found in kept:
        if np.array_equal(own, which):
            return found
    kept.append((which, Mesh(mesh.points, mesh.cells[which], mesh.kind)))
    return kept[-1][1]


def materials_of_cells(case: Case, mesh: Mesh) -> CellMaterials:
    """Return the material of every cell, cached in the mesh. Raises Fault if regions overlap or are empty."""
    key = CellMaterials, tuple((part.thing.where, part.thing.over) for part in case.parts), case.leaning
    if key not in mesh.selections:
        mesh.selections[key] = _assign_materials(case, mesh)
    found: CellMaterials = mesh.selections[key]
    return found


def _assign_materials(case: Case, mesh: Mesh) -> CellMaterials:
    """Return the material of every cell. Raises Fault if regions overlap or are empty."""
    kind = cells_of(mesh, case.depth)
    _must_be_disjoint(case, mesh)
    parts = region_conditions(case)
    shares = np.array([selected_fractions(where, kind, mesh) for where in parts])  # (r, m)
    along = [_follows_curve(where, mesh, f) for where, f in zip(parts, shares, strict=True)]
    shares = np.vstack([np.clip(1.0 - shares.sum(axis=0), 0.0, 1.0), shares])
    shares[0, shares[0] <= SMALL] = 0.0  # fraction of the body that is only rounding
    most = _dominant_material(shares)
    cells = most if case.leaning == (0, 0) else _assign_cut_cells(shares, most, *case.leaning)
    asked = shares @ kind.sizes
    taken = []
    for i, part in enumerate(case.parts, start=1):
        beside = np.delete(asked, i)
        least = float(beside[beside > SMALL * asked.sum()].min(initial=asked[i]))
        alike = any(other.thing.material == part.thing.material for other in case.parts[: i - 1])
        if alike and asked[i] <= SMALL * asked.sum():  # it lies within another region of the same material
            taken.append(RegionVolume(0.0, 0.0, 0.0, 0.0, least))
        else:
            taken.append(_region_volume(part, kind.sizes, shares[i], cells == i, along[i - 1], least))
    return CellMaterials(cells, tuple(taken), shares, kind.sizes)


def _follows_curve(where: Condition, mesh: Mesh, share: Floats) -> Bools:
    """Return a mask (m,) of the cells that follow a curved border of a region.

    Such cells have nodes on the border but none beyond it, so that the curve cuts only slivers off them. `share` (m,)
    is the fraction of each cell in the region.
    """
    found = np.minimum(share, 1.0 - share) <= THIN
    on = np.zeros_like(found)
    for border in where.borders:
        slack = slack_of(border, mesh.extent)
        level = np.broadcast_to(border.at(*mesh.points.T), len(mesh.points))[mesh.cells]
        found &= (level.min(axis=1) >= -slack) | (level.max(axis=1) <= slack)
        on |= np.abs(level).min(axis=1) <= slack
    return np.asarray(found & on)


def _assign_cut_cells(shares: Floats, most: Ints, part: int, side: int) -> Ints:
    """Return the materials (m,) of cells with all cut cells of region `part` assigned to one side of its border.

    A positive `side` assigns them to the region; otherwise they get the dominant one of their other materials.
    `most` (m,) are the materials of the cells that are not cut.
    """
    own, others = shares[part], shares.copy()
    others[part] = -1.0
    crossed = (own > SMALL) & (own < 1.0 - WHOLE)
    found: Ints = np.where(crossed, part if side > 0 else _dominant_material(others), most)
    return found


def _dominant_material(shares: Floats) -> Ints:
    """Return the material (m,) with the largest volume fraction of each cell.

    A region takes precedence over the body if their fractions are equal.
    """
    found: Ints = len(shares) - 1 - np.argmax(np.round(shares, 9)[::-1], axis=0)
    return found


def _region_volume(part: Declared, sizes: Floats, share: Floats, own: Any, along: Bools, beside: float) -> RegionVolume:
    """Return the volumes of one region. Raises Fault if it is empty."""
    asked = float(share @ sizes)
    if asked <= SMALL * float(sizes.sum()):
        raise fault(
            "E302", part.at("where"), f"`{part.name}` selects no part of `{part.thing.body}`", "selects nothing",
            "a region must have a volume inside the body that is not covered by other regions",
        )  # fmt: skip
    wrong = np.where(own, 1.0 - share, share) * sizes
    missed, beyond, bent = (float(wrong[which].sum()) for which in (~own, own, along))
    missed, beyond = (0.0 if v <= WHOLE * asked else v for v in (missed, beyond))
    return RegionVolume(asked, float(sizes[own].sum()), missed, beyond, beside, bent)


def _must_be_disjoint(case: Case, mesh: Mesh) -> None:
    """Raise Fault if regions of different materials overlap and no order of precedence is declared for them."""
    kind = cells_of(mesh, case.depth)
    for a, b in unordered_overlaps(case):
        both = selected_fractions(Condition.junction("and", a.thing.where, b.thing.where), kind, mesh)
        shared = float(both @ kind.sizes)
        if shared > SMALL * float(kind.sizes.sum()):
            raise overlap_fault(a, b, f"common volume {units.format_value(shared, CUBIC)}")


# ------------------------------------------------------------------ what is said of it


def region_report(case: Case, mesh: Mesh) -> dict[str, Any]:
    """Return the `regions` part of a report: the volume errors of material regions."""
    found = {}
    for part, own in zip(case.parts, materials_of_cells(case, mesh).taken, strict=True):
        found[part.name] = {
            "asked_m3": own.asked, "taken_m3": own.taken, "missed_m3": own.missed, "beyond_m3": own.beyond,
        }  # fmt: skip
    return {"regions": found}


def notes(declared: Declared, case: Case, mesh: Mesh) -> Iterator[Diagnostic]:
    """Yield a warning for every region whose border the cells do not follow."""
    for part, own in zip(case.parts, materials_of_cells(case, mesh).taken, strict=True):
        if own.wrong_material_fraction <= MISSED:
            continue
        at = declared.at("size" if declared.thing.own_mesh is None else "mesh")
        of = f"`{part.name}`" if own.asked <= own.beside else f"the body outside `{part.name}`"
        yield diagnostic(
            "W391", at,
            f"cells of `{declared.name}` with {100 * own.wrong_material_fraction:.3g} % of the volume "
            f"of {of} have the wrong material",
            f"{100 * own.missed / own.asked:.3g} % missing, {100 * own.beyond / own.asked:.3g} % too much",
            "use a finer mesh, or one with nodes along the border of the region; `--stated` reports the effect",
        )  # fmt: skip


def region_errors(case: Case, prepared: Prepared) -> list[tuple[float, tuple[int, int]]]:
    """Return the relative volume error of each region whose border cells do not follow, and how to bound its effect.

    The effect is bounded by a second solution, in which cut cells have another material: (index of the region, side),
    the arguments of `_assign_cut_cells`. It is (0, 0), no change, if the error is negligible. The error is infinite
    if the border cuts through cells; it is finite if only slivers are cut off, as between a circle and an inscribed
    polygon.
    """
    if not case.parts or prepared.mesh is None:
        return []
    own, found = materials_of_cells(case, prepared.mesh), []
    for number, taken in enumerate(own.taken, start=1):
        if taken.wrong_material_fraction > 0.0:
            way = (number, own.larger_change_side(number)) if taken.wrong_material_fraction > MISSED else (0, 0)
            found.append((taken.wrong_material_fraction if taken.cut_cell_error <= MISSED else math.inf, way))
    return found
