"""Detection of places within cells at which fibre directions given by expressions are undefined.

Cells are subdivided until interval arithmetic proves for each part that a direction exists in all of it or in
none. The undecided parts contain places of zero volume at which the direction vanishes or is discontinuous,
such as an axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.interval_arithmetic import ValueBounds, bound_expression
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.spatial_profiles import DirectionProfile
from softmark.interpreter.problem.body_case import Case, fault
from softmark.interpreter.problem.field_files import read_field
from softmark.records import dataclass
from softmark.solvers.elements import CELLS
from softmark.solvers.mesh.element_interpolation import integrate_cells

if TYPE_CHECKING:
    from softmark.solvers.energies.energy import Floats
    from softmark.solvers.mesh.mesh import Ints, Mesh

DEEP = 4  # number of subdivisions of a cell, to parts of a sixteenth of its length
MOST = 200_000  # largest number of parts, beyond which they are not subdivided further
ALIKE = 0.9  # cosine between directions around a part: above it the part counts as having a direction
BULGE = 0.1  # of the extents of a part: how far a part with curved sides may reach beyond its corners


@dataclass(frozen=True)
class UndefinedDirections:
    """Part of the volume of a body in which a fibre direction is undefined.

    `without` is the volume fraction without a direction, and `touched` that of cells with a singularity. `place`
    (3,), m, is one such place.
    """

    without: float
    touched: float
    place: tuple[float, ...]


def direction_profiles(material: Any) -> tuple[DirectionProfile, ...]:
    """Return the fibre and sheet directions of a material that are given by expressions."""
    law = getattr(material, "passive", material)
    each = (getattr(m, name, None) for m in (material, law) for name in ("fibres", "sheets"))
    return tuple({id(rule): rule for rule in each if isinstance(rule, DirectionProfile)}.values())


def undefined_directions(rule: DirectionProfile, mesh: Mesh, axial: bool) -> UndefinedDirections | None:
    """Return the part of a mesh in which a direction is undefined, cached in the mesh; None if it exists everywhere.

    Fields read from files are checked only at points of a finer rule. For a body of revolution (`axial`), volumes
    are those of rings.
    """
    key: Any = (undefined_directions, rule)
    if key not in mesh.selections:
        sampled = any(part.fields for part in rule.components)
        mesh.selections[key] = (
            _undefined_volume_by_samples(rule, mesh) if sampled else _undefined_volume_by_intervals(rule, mesh, axial)
        )
    found: UndefinedDirections | None = mesh.selections[key]
    return found


def _undefined_volume_by_intervals(rule: DirectionProfile, mesh: Mesh, axial: bool) -> UndefinedDirections | None:
    """Return the part of a mesh in which a direction is undefined, by interval arithmetic on subdivided cells."""
    element = mesh.element
    volumes = np.abs(mesh.volumes)
    if axial:
        volumes = volumes * mesh.points[mesh.cells][:, : element.corners, 0].mean(axis=1)
    share = (
        CELLS[element.linear]
        .shape(element.child_corners().reshape(-1, 3))
        .reshape(-1, element.corners, element.corners)
    )
    corners = np.broadcast_to(element.places()[: element.corners], (len(mesh.cells), element.corners, 3))
    which, without, places = np.arange(len(mesh.cells)), 0.0, np.empty((0, 3))
    for depth in range(DEEP + 1):
        X = _positions(mesh, which, corners)
        each = _direction_bounds(rule, X, element.order > 1)
        sound = np.any([one.sound for one in each], axis=0) & ~np.any([one.may for one in each], axis=0)
        none = np.all([one.zero for one in each], axis=0) | np.any([one.none for one in each], axis=0)
        if none.any():
            size = _cell_volumes(mesh, which[none], corners[none]) * (X[none][:, :, 0].mean(axis=1) if axial else 1.0)
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
        odd = ~_are_nearly_parallel(rule, X)
        which, X = which[odd], X[odd]
    if without == 0.0 and not len(which):
        return None
    touched = float(volumes[np.unique(which)].sum())
    place = (places if without else X.mean(axis=1))[0]
    total = float(volumes.sum())
    return UndefinedDirections(min(1.0, without / total), touched / total, tuple(map(float, place)))


def _undefined_volume_by_samples(rule: DirectionProfile, mesh: Mesh) -> UndefinedDirections | None:
    """Return the part of a mesh in which a direction read from a field file is undefined, by sampling a finer rule."""
    finer = mesh.element.mass_quadrature()
    X = np.einsum("qa,mai->mqi", mesh.element.shape(finer[0]), mesh.points[mesh.cells]).reshape(-1, 3)
    w = integrate_cells(mesh, rule=finer).w.ravel()
    with np.errstate(all="ignore"):
        size = np.linalg.norm(rule.at(X, read_field), axis=1)
    odd = ~(np.isfinite(size) & (size > 0.0))
    if not odd.any():
        return None
    return UndefinedDirections(float(w[odd].sum() / w.sum()), 0.0, tuple(map(float, X[odd][0])))


def _positions(mesh: Mesh, which: Ints, corners: Floats) -> Floats:
    """Return the positions (n, c, 3), m, of parts of cells, given by their local `corners` (n, c, 3)."""
    n, c, _ = corners.shape
    N = mesh.element.shape(corners.reshape(-1, 3)).reshape(n, c, -1)
    found: Floats = np.einsum("nca,nai->nci", N, mesh.points[mesh.cells[which]])
    return found


def _cell_volumes(mesh: Mesh, which: Ints, corners: Floats) -> Floats:
    """Return the volumes (n,), m^3, that cells would have with the Jacobian at the centre of a part.

    A part has its local fraction of that volume.
    """
    element = mesh.element
    dN = element.gradient(corners.mean(axis=1))
    J = np.einsum("nak,nai->nki", dN, mesh.points[mesh.cells[which]])
    found: Floats = np.abs(np.linalg.det(J)) * element.volume
    return found


def _direction_bounds(rule: DirectionProfile, X: Floats, curved: bool) -> list[ValueBounds]:
    """Return interval bounds of each component of the direction over parts of cells with corners X (n, c, 3), m."""
    low, high = X.min(axis=1), X.max(axis=1)
    if curved:
        low, high = low - BULGE * (high - low), high + BULGE * (high - low)
    return [bound_expression(part.root, low, high) for part in rule.components]


def _are_nearly_parallel(rule: DirectionProfile, X: Floats) -> Any:
    """Return a mask (n,) of the parts of cells in which directions at corners and centre are nearly parallel.

    X (n, c, 3), m, are the corners of the parts.
    """
    at = np.concatenate([X, X.mean(axis=1, keepdims=True)], axis=1)
    with np.errstate(all="ignore"):
        d = rule.at(at.reshape(-1, 3), read_field).reshape(at.shape)
        d = d / np.linalg.norm(d, axis=2, keepdims=True)
        none = np.isnan(d).any(axis=2)  # opposite directions on both sides of a surface may be one line
        near = np.abs(np.einsum("nai,nbi->nab", d, d)) >= ALIKE
    return (near | none[:, :, None] | none[:, None, :]).all(axis=(1, 2)) & ~none.all(axis=1)


# ------------------------------------------------------------------ what is said of it


def must_have_directions(case: Case, mesh: Mesh) -> None:
    """Raise Fault if fibre directions are undefined in a part of the volume."""
    for rule, found in _undefined_directions_of_material(case, mesh):
        if found.without > 0.0:
            raise fault(
                "E383",
                case.body.at("material"),
                f"the fibre direction of `{case.body.name}` is undefined in at least "
                f"{units.format_volume_fraction(found.without)} of its volume: `{rule}` is zero or has "
                "no value there",
                f"for example around {_format_singular_point(found)}",
                "write a direction that is nowhere zero, or add a region without fibres there",
            )


def notes(case: Case, mesh: Mesh) -> Iterator[Diagnostic]:
    """Yield a warning if fibre directions are discontinuous within cells."""
    for rule, found in _undefined_directions_of_material(case, mesh):
        if found.touched > 0.0:
            yield diagnostic(
                "W389",
                case.body.at("material"),
                f"the fibre direction `{rule}` is zero or undefined inside cells that fill "
                f"{units.format_volume_fraction(found.touched)} of the volume of `{case.body.name}`",
                f"for example near {_format_singular_point(found)}",
                "add a region without fibres there, or cut that place out of the body: the direction "
                "changes abruptly inside a cell, so results depend on the mesh",
            )


def _undefined_directions_of_material(case: Case, mesh: Mesh) -> Iterator[tuple[DirectionProfile, UndefinedDirections]]:
    """Yield each direction of the material that is undefined somewhere, with the part of the mesh concerned."""
    for rule in direction_profiles(case.material):
        found = undefined_directions(rule, mesh, case.depth > 0.0)
        if found is not None:
            yield rule, found


def _format_singular_point(found: UndefinedDirections) -> str:
    """Return the place of a singularity as text with its unit."""
    return units.format_vector(tuple(float(f"{c:.3g}") for c in found.place), units.LENGTH)
