"""What a mesh makes of the parts of its body: the material of every cell, and by how much volume a part is missed.

A cell has the material of which it holds the most. Shares of cells are found as those of supports are
(support_selection.py): exact for borders that are planes, on straight cells.
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
from softmark.interpreter.models.shared.support_selection import MISSED, SMALL, WHOLE, cells_of, fractions
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.material_layers import overlap, remaining, unordered
from softmark.interpreter.problem.surface_selection.selected_pieces import Bools, slack_of
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.element_interpolation import Integration
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared_model import Prepared

CUBIC: units.Dimension = units.power(units.LENGTH, 3)
THIN = 0.25  # of a cell: more than that no curve leaves between nodes that follow it


@dataclass(frozen=True)
class Taken:
    """What of a part a mesh has, m^3: `asked` of it by the scene, `taken` by its cells.

    `missed` lies in cells of another material, `beyond` in its own cells and not in the part; `bent` of both lies
    between a curved border and the flat sides of cells that follow it. `beside` is the smallest volume, m^3, of the
    body and of the other parts: what is missed of a large part may be most of a small one.
    """

    asked: float
    taken: float
    missed: float
    beyond: float
    beside: float
    bent: float = 0.0

    @property
    def off(self) -> float:
        """What is of the wrong material, as a part of what was asked for, or of what lies beside it if that is less."""
        return self._share(self.missed + self.beyond)

    @property
    def cut(self) -> float:
        """The same in cells that the border cuts, beside what lies between it and the sides of others."""
        return self._share(max(self.missed + self.beyond - self.bent, 0.0))

    def _share(self, wrong: float) -> float:
        return wrong / min(self.asked, self.beside) if wrong else 0.0


@dataclass(frozen=True)
class Owners:
    """The number of the material of every cell (m,), 0 that of the body, and what is taken of each part.

    `shares` (r + 1, m) are those that every material has of each cell, that of the body first; `sizes` (m,) m^3.
    """

    cells: Ints
    taken: tuple[Taken, ...]
    shares: Floats
    sizes: Floats

    def side(self, part: int) -> int:
        """The way for a part, by its number, to lean, 1 or -1, by which more changes its material."""
        most = _most(self.shares)
        more, less = (float(self.sizes[_leaning(self.shares, most, part, way) != most].sum()) for way in (1, -1))
        return 1 if more >= less else -1


def pieces(case: Case, mesh: Mesh, parts: Integration) -> Iterator[tuple[Case, Mesh, Integration, Ints, int]]:
    """The cells of every material that has some, as `Piece` has them (material_regions.py). Raises Fault."""
    for number, material in enumerate(case.materials):
        which = np.flatnonzero(owners(case, mesh).cells == number)
        if len(which):
            own = Integration(np.ascontiguousarray(parts.dNdX[which]), parts.w[which], parts.N)
            alone = replace(case, other_material=material, parts=())
            yield alone, submesh(mesh, which), own, which, number


def submesh(mesh: Mesh, which: Ints) -> Mesh:
    """Return a mesh of some cells over all nodes; repeated calls return the same mesh with its cached results."""
    kept: list[tuple[Ints, Mesh]] = mesh.selections.setdefault(submesh, [])
    for own, found in kept:
        if np.array_equal(own, which):
            return found
    kept.append((which, Mesh(mesh.points, mesh.cells[which], mesh.kind)))
    return kept[-1][1]


def owners(case: Case, mesh: Mesh) -> Owners:
    """Which cell is of which material; found once for each mesh. Raises Fault for parts that overlap or are empty."""
    key = Owners, tuple((part.thing.where, part.thing.over) for part in case.parts), case.leaning
    if key not in mesh.selections:
        mesh.selections[key] = _found(case, mesh)
    found: Owners = mesh.selections[key]
    return found


def _found(case: Case, mesh: Mesh) -> Owners:
    kind = cells_of(mesh, case.depth)
    _disjoint(case, mesh)
    parts = remaining(case)
    shares = np.array([fractions(where, kind, mesh) for where in parts])  # (r, m)
    along = [_along(where, mesh, f) for where, f in zip(parts, shares, strict=True)]
    shares = np.vstack([np.clip(1.0 - shares.sum(axis=0), 0.0, 1.0), shares])
    shares[0, shares[0] <= SMALL] = 0.0  # of the body: what rounding leaves
    most = _most(shares)
    cells = most if case.leaning == (0, 0) else _leaning(shares, most, *case.leaning)
    asked = shares @ kind.sizes
    taken = []
    for i, part in enumerate(case.parts, start=1):
        beside = np.delete(asked, i)
        least = float(beside[beside > SMALL * asked.sum()].min(initial=asked[i]))
        alike = any(other.thing.material == part.thing.material for other in case.parts[: i - 1])
        if alike and asked[i] <= SMALL * asked.sum():  # it lies within another of the same material
            taken.append(Taken(0.0, 0.0, 0.0, 0.0, least))
        else:
            taken.append(_taken(part, kind.sizes, shares[i], cells == i, along[i - 1], least))
    return Owners(cells, tuple(taken), shares, kind.sizes)


def _along(where: Condition, mesh: Mesh, share: Floats) -> Bools:
    """Cells (m,) that have nodes on a border and none beyond it: what a curve leaves of them between nodes is thin."""
    found = np.minimum(share, 1.0 - share) <= THIN
    on = np.zeros_like(found)
    for border in where.borders:
        slack = slack_of(border, mesh.extent)
        level = np.broadcast_to(border.at(*mesh.points.T), len(mesh.points))[mesh.cells]
        found &= (level.min(axis=1) >= -slack) | (level.max(axis=1) <= slack)
        on |= np.abs(level).min(axis=1) <= slack
    return np.asarray(found & on)


def _leaning(shares: Floats, most: Ints, part: int, side: int) -> Ints:
    """The materials of cells (m,) where those that the border of a part passes are all its own, or none of them."""
    own, others = shares[part], shares.copy()
    others[part] = -1.0
    crossed = (own > SMALL) & (own < 1.0 - WHOLE)
    found: Ints = np.where(crossed, part if side > 0 else _most(others), most)
    return found


def _most(shares: Floats) -> Ints:
    """The largest share of each cell (m,); of equal ones that of the part, not of the body."""
    found: Ints = len(shares) - 1 - np.argmax(np.round(shares, 9)[::-1], axis=0)
    return found


def _taken(part: Declared, sizes: Floats, share: Floats, own: Any, along: Bools, beside: float) -> Taken:
    asked = float(share @ sizes)
    if asked <= SMALL * float(sizes.sum()):
        raise fault(
            "E302", part.at("where"), f"`{part.name}` selects no part of `{part.thing.body}`", "selects nothing",
            "a part with a material of its own has a volume within the body, and not under another part alone",
        )  # fmt: skip
    wrong = np.where(own, 1.0 - share, share) * sizes
    missed, beyond, bent = (float(wrong[which].sum()) for which in (~own, own, along))
    missed, beyond = (0.0 if v <= WHOLE * asked else v for v in (missed, beyond))
    return Taken(asked, float(sizes[own].sum()), missed, beyond, beside, bent)


def _disjoint(case: Case, mesh: Mesh) -> None:
    """Raises Fault where parts of different materials share a volume and none is said to lie over the other."""
    kind = cells_of(mesh, case.depth)
    for a, b in unordered(case):
        both = fractions(Condition.junction("and", a.thing.where, b.thing.where), kind, mesh)
        shared = float(both @ kind.sizes)
        if shared > SMALL * float(kind.sizes.sum()):
            raise overlap(a, b, f"they share {units.show(shared, CUBIC)}")


# ------------------------------------------------------------------ what is said of it


def facts(case: Case, mesh: Mesh) -> dict[str, Any]:
    """The `regions` of what a report says of a solution."""
    found = {}
    for part, own in zip(case.parts, owners(case, mesh).taken, strict=True):
        found[part.name] = {
            "asked_m3": own.asked, "taken_m3": own.taken, "missed_m3": own.missed, "beyond_m3": own.beyond,
        }  # fmt: skip
    return {"regions": found}


def notes(declared: Declared, case: Case, mesh: Mesh) -> Iterator[Diagnostic]:
    """Warnings where cells do not follow a part."""
    for part, own in zip(case.parts, owners(case, mesh).taken, strict=True):
        if own.off <= MISSED:
            continue
        at = declared.at("size" if declared.thing.own_mesh is None else "mesh")
        of = f"`{part.name}`" if own.asked <= own.beside else f"what lies beside `{part.name}`"
        yield diagnostic(
            "W391", at,
            f"cells of `{declared.name}` with {100 * own.off:.3g} % of the volume of {of} are of the wrong material",
            f"{100 * own.missed / own.asked:.3g} % missed, {100 * own.beyond / own.asked:.3g} % too much",
            "its cells do not end at the border of the part: use a finer mesh, or one with nodes along the border; "
            "`--stated` says what it makes",
        )  # fmt: skip


def missed(case: Case, prepared: Prepared) -> list[tuple[float, tuple[int, int]]]:
    """Of every part that cells do not follow what may be made of it, and how they are to lean for a bound.

    That is what is of the wrong material where cells that the border cuts hold next to nothing of it, as a polygon
    leaves of a circle, else without limit. They do not lean, (0, 0), where all that is missed is next to nothing.
    """
    if not case.parts or prepared.mesh is None:
        return []
    own, found = owners(case, prepared.mesh), []
    for number, taken in enumerate(own.taken, start=1):
        if taken.off > 0.0:
            way = (number, own.side(number)) if taken.off > MISSED else (0, 0)
            found.append((taken.off if taken.cut <= MISSED else math.inf, way))
    return found
