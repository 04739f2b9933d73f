"""Where fibres by expressions have no direction within cells, between the points that laws are asked at.

Cells are cut into parts, and parts again, until interval arithmetic shows of each that there is a direction all over
it, or none; what stays open holds places where it vanishes or ends, such as an axis, of no volume.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.interval_arithmetic import Values, over
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.spatial_profiles import Streams
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.field_files import reading
from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.mesh.element_interpolation import integration

if TYPE_CHECKING:
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.mesh import Ints, Mesh

DEEP = 4  # times a cell is cut, to parts of a sixteenth of its length
MOST = 200_000  # parts at a time, beyond which they are cut no further
ALIKE = 0.9  # cosine between directions around a part: where they are that near it has one, whatever is within
BULGE = 0.1  # of the extents of a part: how far one with curved sides may reach beyond its corners


@dataclass(frozen=True)
class Hollow:
    """Shares of the volume of some cells: without a direction, and of those cells in which one ends; a place, m."""

    without: float
    touched: float
    place: tuple[float, ...]


def rules(material: Any) -> tuple[Streams, ...]:
    """The directions of a material that are expressions."""
    law = getattr(material, "passive", material)
    each = (getattr(m, name, None) for m in (material, law) for name in ("fibres", "sheets"))
    return tuple({id(rule): rule for rule in each if isinstance(rule, Streams)}.values())


def hollow(rule: Streams, mesh: Mesh, axial: bool) -> Hollow | None:
    """What a mesh has of places without a direction, kept with it; None where all of it has one.

    Of fields from files it is looked at at the points of a finer rule: nothing is known between these. Of a body of
    revolution (`axial`) volumes are those of its rings.
    """
    key: Any = (hollow, rule)
    if key not in mesh.selections:
        sampled = any(part.fields for part in rule.components)
        mesh.selections[key] = _sampled(rule, mesh) if sampled else _looked(rule, mesh, axial)
    found: Hollow | None = mesh.selections[key]
    return found


def _looked(rule: Streams, mesh: Mesh, axial: bool) -> Hollow | None:
    element = mesh.element
    volumes = np.abs(mesh.volumes)
    if axial:
        volumes = volumes * mesh.points[mesh.cells][:, : element.corners, 0].mean(axis=1)
    share = CELLS[element.linear].shape(element.children().reshape(-1, 3)).reshape(-1, element.corners, element.corners)
    corners = np.broadcast_to(element.places()[: element.corners], (len(mesh.cells), element.corners, 3))
    which, without, places = np.arange(len(mesh.cells)), 0.0, np.empty((0, 3))
    for depth in range(DEEP + 1):
        X = _positions(mesh, which, corners)
        each = _enclosed(rule, X, element.order > 1)
        sound = np.any([one.sound for one in each], axis=0) & ~np.any([one.may for one in each], axis=0)
        none = np.all([one.zero for one in each], axis=0) | np.any([one.none for one in each], axis=0)
        if none.any():
            size = _parts(mesh, which[none], corners[none]) * (X[none][:, :, 0].mean(axis=1) if axial else 1.0)
            without += float(size.sum()) / len(share) ** depth
            places = X[none].mean(axis=1)
        left = ~sound & ~none
        which, corners = which[left], corners[left]
        if not len(which) or depth == DEEP or len(which) * len(share) > MOST:
            break
        corners = np.einsum("kca,mai->mkci", share, corners).reshape(-1, element.corners, 3)
        which = np.repeat(which, len(share))
    if len(which):
        X = _positions(mesh, which, corners)
        odd = ~_alike(rule, X)
        which, X = which[odd], X[odd]
    if without == 0.0 and not len(which):
        return None
    touched = float(volumes[np.unique(which)].sum())
    place = (places if without else X.mean(axis=1))[0]
    total = float(volumes.sum())
    return Hollow(min(1.0, without / total), touched / total, tuple(map(float, place)))


def _sampled(rule: Streams, mesh: Mesh) -> Hollow | None:
    """Of what fields enter: the volume that belongs to points of a finer rule without a direction."""
    finer = mesh.element.mass_quadrature()
    X = np.einsum("qa,mai->mqi", mesh.element.shape(finer[0]), mesh.points[mesh.cells]).reshape(-1, 3)
    w = integration(mesh, rule=finer).w.ravel()
    with np.errstate(all="ignore"):
        size = np.linalg.norm(rule.at(X, reading), axis=1)
    odd = ~(np.isfinite(size) & (size > 0.0))
    if not odd.any():
        return None
    return Hollow(float(w[odd].sum() / w.sum()), 0.0, tuple(map(float, X[odd][0])))


def _positions(mesh: Mesh, which: Ints, corners: Floats) -> Floats:
    """The corners of parts of cells (n, c, 3), m, of their local points."""
    n, c, _ = corners.shape
    N = mesh.element.shape(corners.reshape(-1, 3)).reshape(n, c, -1)
    found: Floats = np.einsum("nca,nai->nci", N, mesh.points[mesh.cells[which]])
    return found


def _parts(mesh: Mesh, which: Ints, corners: Floats) -> Floats:
    """Volumes of the cells (n,), m^3, if all of each were as it is amid a part: that of a part is its share of it."""
    element = mesh.element
    dN = element.gradient(corners.mean(axis=1))
    J = np.einsum("nak,nai->nki", dN, mesh.points[mesh.cells[which]])
    found: Floats = np.abs(np.linalg.det(J)) * element.volume
    return found


def _enclosed(rule: Streams, X: Floats, curved: bool) -> list[Values]:
    low, high = X.min(axis=1), X.max(axis=1)
    if curved:
        low, high = low - BULGE * (high - low), high + BULGE * (high - low)
    return [over(part.root, low, high) for part in rule.components]


def _alike(rule: Streams, X: Floats) -> Any:
    """Of which parts (n, c, 3) directions at the corners and amid them are nearly one line (n,)."""
    at = np.concatenate([X, X.mean(axis=1, keepdims=True)], axis=1)
    with np.errstate(all="ignore"):
        d = rule.at(at.reshape(-1, 3), reading).reshape(at.shape)
        d = d / np.linalg.norm(d, axis=2, keepdims=True)
        none = np.isnan(d).any(axis=2)  # on a surface where it ends both sides may be one line
        near = np.abs(np.einsum("nai,nbi->nab", d, d)) >= ALIKE
    return (near | none[:, :, None] | none[:, None, :]).all(axis=(1, 2)) & ~none.all(axis=1)


# ------------------------------------------------------------------ what is said of it


def must_have_directions(case: Case, mesh: Mesh) -> None:
    """Raises Fault where a part of the volume has no direction."""
    for rule, found in _hollows(case, mesh):
        if found.without > 0.0:
            raise fault(
                "E383", case.body.at("material"),
                f"the fibres of `{case.body.name}` have no direction in at least {units.show_share(found.without)} of "
                f"its volume: `{rule}` vanishes there, or has no value", f"as around {_shown(found)}",
                "give a direction that is never nothing, or a region of its own without fibres",
            )  # fmt: skip


def notes(case: Case, mesh: Mesh) -> Iterator[Diagnostic]:
    """A warning where directions end within cells."""
    for rule, found in _hollows(case, mesh):
        if found.touched > 0.0:
            yield diagnostic(
                "W389", case.body.at("material"),
                f"`{rule}` vanishes, or has no value, within cells that are {units.show_share(found.touched)} of the "
                f"volume of `{case.body.name}`", f"as near {_shown(found)}",
                "fibres turn there within one cell, and what is found depends on the mesh: give that place a region "
                "without fibres, or leave it out of the body",
            )  # fmt: skip


def _hollows(case: Case, mesh: Mesh) -> Iterator[tuple[Streams, Hollow]]:
    """What a mesh has of places without a direction, of each rule of its material that leaves some."""
    for rule in rules(case.material):
        found = hollow(rule, mesh, case.depth > 0.0)
        if found is not None:
            yield rule, found


def _shown(found: Hollow) -> str:
    return units.show_all(tuple(float(f"{c:.3g}") for c in found.place), units.LENGTH)
