"""What a mesh makes of the parts of its body: the material of every cell, and by how much volume a part is missed.

A cell has the material of which it holds the most. Shares of cells are found as those of supports are (gripping.py):
exact for borders that are planes, on straight cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.conditions import Condition
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.models.shared.gripping import MISSED, SMALL, WHOLE, cells_of, fractions
from softmark.interpreter.problem.case import Case, fault
from softmark.interpreter.problem.regions import overlap, remaining, unordered
from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints
from softmark.solvers.mesh.interpolation import Integration
from softmark.solvers.mesh.mesh import Mesh

if TYPE_CHECKING:
    from softmark.interpreter.models.shared.prepared import Prepared

CUBIC: units.Dimension = units.power(units.LENGTH, 3)


@dataclass(frozen=True)
class Taken:
    """What of a part a mesh has, m^3: `asked` of it by the scene, `taken` by its cells.

    `missed` lies in cells of another material, `beyond` in its own cells and not in the part.
    """

    asked: float
    taken: float
    missed: float
    beyond: float

    @property
    def off(self) -> float:
        """What is of the wrong material, as a part of what was asked for."""
        return (self.missed + self.beyond) / self.asked


@dataclass(frozen=True)
class Owners:
    """The number of the material of every cell (m,), 0 that of the body, and what is taken of each part."""

    cells: Ints
    taken: tuple[Taken, ...]
    crossed: Floats  # m^3 of cells that a border passes and that would change their material: leaning by 1, by -1


def pieces(case: Case, mesh: Mesh, parts: Integration) -> Iterator[tuple[Case, Mesh, Integration, Ints]]:
    """The cells of every material that has some, as `Piece` has them (pieces.py). Raises Fault."""
    for number, material in enumerate(case.materials):
        which = np.flatnonzero(owners(case, mesh).cells == number)
        if len(which):
            own = Integration(np.ascontiguousarray(parts.dNdX[which]), parts.w[which], parts.N)
            alone = replace(case, other_material=material, parts=())
            yield alone, Mesh(mesh.points, mesh.cells[which], mesh.kind), own, which


def owners(case: Case, mesh: Mesh) -> Owners:
    """Which cell is of which material; found once for each mesh. Raises Fault for parts that overlap or are empty."""
    key = Owners, tuple((part.thing.where, part.thing.over) for part in case.parts), case.leaning
    if key not in mesh.selections:
        mesh.selections[key] = _found(case, mesh)
    found: Owners = mesh.selections[key]
    return found


def _found(case: Case, mesh: Mesh) -> Owners:
    kind = cells_of(mesh)
    _disjoint(case, mesh)
    shares = np.array([fractions(where, kind, mesh) for where in remaining(case)])  # (r, m)
    shares = np.vstack([np.clip(1.0 - shares.sum(axis=0), 0.0, 1.0), shares])
    shares[0, shares[0] <= SMALL] = 0.0  # of the body: what rounding leaves
    held = shares > SMALL
    most = _most(shares)
    low, high = np.argmax(held, axis=0), len(held) - 1 - np.argmax(held[::-1], axis=0)
    cells = {0: most, 1: high, -1: low}[case.leaning]
    crossed = np.array([float(kind.sizes[most != other].sum()) for other in (high, low)])
    taken = tuple(_taken(part, kind.sizes, own, cells == i) for i, (part, own) in
                  enumerate(zip(case.parts, shares[1:], strict=True), start=1))  # fmt: skip
    return Owners(cells, taken, crossed)


def _most(shares: Floats) -> Ints:
    """The largest share of each cell (m,); of equal ones that of the part, not of the body."""
    found: Ints = len(shares) - 1 - np.argmax(np.round(shares, 9)[::-1], axis=0)
    return found


def _taken(part: Declared, sizes: Floats, share: Floats, own: Any) -> Taken:
    asked = float(share @ sizes)
    if asked <= SMALL * float(sizes.sum()):
        raise fault(
            "E302", part.at("where"), f"`{part.name}` selects no part of `{part.thing.body}`", "selects nothing",
            "a part with a material of its own has a volume within the body, and not under another part alone",
        )  # fmt: skip
    missed, beyond = float((share * sizes)[~own].sum()), float(((1.0 - share) * sizes)[own].sum())
    missed, beyond = (0.0 if v <= WHOLE * asked else v for v in (missed, beyond))
    return Taken(asked, float(sizes[own].sum()), missed, beyond)


def _disjoint(case: Case, mesh: Mesh) -> None:
    """Raises Fault where parts of different materials share a volume and none is said to lie over the other."""
    kind = cells_of(mesh)
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
        yield diagnostic(
            "W391", at,
            f"cells of `{declared.name}` with {100 * own.off:.3g} % of the volume of `{part.name}` are of the wrong "
            "material",
            f"{100 * own.missed / own.asked:.3g} % missed, {100 * own.beyond / own.asked:.3g} % too much",
            "its cells do not end at the border of the part: use a finer mesh, or one with nodes along the border; "
            "`--stated` says what it makes",
        )  # fmt: skip


def missed(case: Case, prepared: Prepared) -> tuple[float, int]:
    """The largest part of a region that is of the wrong material, and to which side its cells are to lean for a bound.

    That side is 0 where nothing is to be gained by it: all is taken, but for what a polygon leaves of a circle.
    """
    if not case.parts or prepared.mesh is None:
        return 0.0, 0
    own = owners(case, prepared.mesh)
    most = max(taken.off for taken in own.taken)
    return most, 0 if most <= MISSED else (1 if own.crossed[0] >= own.crossed[1] else -1)
