"""Constants that vary in space, looked up once more for the watchdog: by other code for what is read from images."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from softmark.interpreter.evidence.materials import alone
from softmark.interpreter.language.profiles import Profile
from softmark.interpreter.models.shared.pieces import some_cells
from softmark.interpreter.models.shared.prepared import Moved
from softmark.interpreter.problem.case import Case
from softmark.interpreter.problem.field_files import Image, loaded, reading
from softmark.interpreter.vocabulary.fields import Field
from softmark.solvers.checks import solids
from softmark.solvers.checks.solids import Floats

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from softmark.interpreter.evidence.answer import Answer
    from softmark.interpreter.evidence.probe_answers import ProbeAnswer

LOOKED = 32  # points of each look-up at which arithmetic on arrays is done again, one by one
AGREE = 1e-12


def again(field: Field, X: Floats) -> Floats:
    """The values of a field at points X (n, 3), m: of an image by scipy's splines of degree one."""
    known = loaded(field)
    if not isinstance(known, Image):
        return reading(field, X)
    at = np.linalg.solve(np.linalg.inv(known.inverse), (X - known.centre).T)
    found: Floats = field.unit.value * ndimage.map_coordinates(known.numbers, at, order=1, mode="nearest")
    return found


def values(constant: Any, X: Floats) -> Floats:
    """A constant of a material at points X (n, 3), m: (n,). Raises ValueError where arithmetic is not one."""
    if not isinstance(constant, Profile):
        return np.full(len(X), float(constant))
    found: Floats = constant.values(X, again)
    if not constant.fields:
        some = np.linspace(0, len(X) - 1, min(LOOKED, len(X))).astype(int)
        plain = np.array([constant.value(tuple(map(float, X[i]))) for i in some])
        if not np.allclose(found[some], plain, rtol=AGREE, atol=0.0):
            raise ValueError(f"`{constant.name}` comes to other numbers one by one than all at once")
    return found


def constants_of(case: Case) -> Any:
    """What tells Young's modulus and Poisson's ratio of a case at points (n, 3)."""
    material = case.material
    return lambda X: (values(material.young, X), values(material.poisson, X))


def density_of(case: Case) -> Any:
    """A density, kg/m^3: a number, or what tells it at points (n, 3)."""
    rho = case.material.density
    return (lambda X: values(rho, X)) if isinstance(rho, Profile) else rho


# ------------------------------------------------------------------ integrals by another quadrature

LOOKED_AT = (6, 4)  # cells of each material with points of their own, and others, that are integrated again
PANELS = (8, 7)  # of each direction of a cell, with three Gauss points in each: the difference tells their own error
OFF = 0.01  # of an integral: more than an element's own points may miss of it


def integrated(case: Case, mesh: Moved, pressures: bool) -> tuple[dict[str, Any], str | None]:
    """How far integrals of constants over some cells are from those by composite Gauss rules; why that is too far.

    The latter are products of panels over the cube that each cell is a collapsed image of, and share nothing with the
    points that a model chose. Integrals are those of each constant, and of it times each local coordinate.
    """
    worst, reason = 0.0, None
    for own, which in alone(case, mesh):
        part = some_cells(mesh.mesh, which)
        for name, rows, seen in _integrands(own, part, pressures):
            for cell in _chosen(seen, len(part.cells)):
                off, allowed = _compared(rows, seen, part, cell)
                worst = max(worst, off)
                if off > allowed and reason is None:
                    reason = (f"the integral of `{name}` over a cell is {100 * off:.2g} % away from what another "
                              f"quadrature finds")  # fmt: skip
    return {"integrals_off": worst}, reason


def _integrands(case: Case, mesh: Any, pressures: bool) -> Iterator[tuple[str, Callable[[Floats], Floats], Any]]:
    """Constants by name, what tells functions of them (g, n) at points (n, 3), and how the model integrates them."""
    from softmark.interpreter.models.shared import graded

    material = case.material
    if (seen := graded.density_resolved(case, mesh)) is not None:
        yield "density", lambda X: values(material.density, X)[None], seen
    if (seen := graded.stiffness_of(case, mesh, pressures)) is None:
        return
    active = next((n for n in graded.ACTIVE if isinstance(getattr(material, n, None), Profile)), None)
    if active is not None:
        yield active, lambda X: values(getattr(material, active), X)[None], seen
        return

    def moduli(X: Floats) -> Floats:
        E, nu = values(material.young, X), np.minimum(values(material.poisson, X), 0.5 - 1e-9)
        if not isinstance(material.poisson, Profile):
            return np.stack([E, 1.0 / E] if pressures else [E])
        K = E / (3.0 - 6.0 * nu)
        return np.stack([E / (2.0 + 2.0 * nu), 1.0 / K if pressures else K])

    yield "young" if isinstance(material.young, Profile) else "poisson", moduli, seen


def _chosen(seen: Any, count: int) -> Any:
    """Numbers of some cells: with points of their own, and without."""
    own = np.zeros(count, dtype=bool) if seen.rule is None else seen.rule.special
    rng = np.random.default_rng(count)
    return np.concatenate(
        [rng.permutation(np.flatnonzero(which))[:n] for which, n in zip((own, ~own), LOOKED_AT, strict=True)]
    )


def _compared(rows: Callable[[Floats], Floats], seen: Any, mesh: Any, cell: int) -> tuple[float, float]:
    """By how much the integrals over a cell differ, relative to the size of the functions, and what they may."""
    corners, kind = mesh.points[mesh.cells[[cell]]], mesh.kind
    if seen.rule is None or not seen.rule.special[cell]:
        xi, w = seen.own
    else:
        xi, w = (each[cell] for each in seen.rule.local(mesh))

    def integrals(xi: Floats, w: Floats) -> tuple[Floats, Floats]:
        X = (solids.shape(kind, xi) @ corners)[0]
        c, v = rows(X), w * solids.gradients(mesh.points, mesh.cells[[cell]], kind, xi)[1][0]
        return np.stack([c @ v, *(c @ (v * t) for t in xi.T)]), np.abs(c) @ np.abs(v)

    (found, _), (fine, size), (less, _) = (integrals(*r) for r in ((xi, w), *(panels(kind, n) for n in PANELS)))
    scale = size + 1e-3 * seen.total / len(mesh.cells)
    off = (np.abs(found - fine) / scale)[: 1 if mesh.element.constant else None]  # one strain: no moments
    many = 3 * PANELS[0]
    X = (solids.shape(kind, panels(kind, PANELS[0])[0]) @ corners)[0]
    c = rows(X).reshape(-1, many, many, many)
    jumps = np.max([np.abs(np.diff(c, axis=a)).max(axis=(1, 2, 3)) for a in (1, 2, 3)], axis=0)
    coarse = 4.0 * np.abs(fine - less).max(axis=0) + jumps * seen.volumes[cell] / many  # what panels do not resolve
    allowed = OFF + (coarse + seen.missed[cell] * seen.total) / scale
    worst = int(np.argmax(off.max(axis=0) - allowed))
    return float(off[:, worst].max()), float(allowed[worst])


@cache
def panels(kind: str, many: int) -> tuple[Floats, Floats]:
    """Local points (q, 3) and weights (q,): three Gauss points in each of so many panels of every direction.

    Of the cube; for wedges and tetrahedra of the cube that collapses into them.
    """
    t, v = np.polynomial.legendre.leggauss(3)
    t, v = ((np.arange(many)[:, None] + 0.5 * (1.0 + t)).ravel() / many, np.tile(0.5 * v, many) / many)
    a, b, c = (g.ravel() for g in np.meshgrid(t, t, t, indexing="ij"))
    w = np.einsum("i,j,k->ijk", v, v, v).ravel()
    if solids.square(kind):
        return 2.0 * np.stack([a, b, c], axis=1) - 1.0, 8.0 * w
    if solids.wedged(kind):
        return np.stack([a, (1.0 - a) * b, 2.0 * c - 1.0], axis=1), 2.0 * w * (1.0 - a)
    return np.stack([a, (1.0 - a) * b, (1.0 - a) * (1.0 - b) * c], axis=1), w * (1.0 - a) ** 2 * (1.0 - b)


# ------------------------------------------------------------------ stated error


def lost(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of constants that vary within cells.

    Integrals over cells may be off: a stiffness that is off by a share in every cell moves an answer by that share at
    most. And a body may be softer than its cells, by the bounds of layers behind one another, or stiffer than those with
    pressures (stiffness_bounds.py).
    """
    from softmark.interpreter.models.shared.pieces import lost as of_mesh
    from softmark.interpreter.models.shared.pieces import softer_by, stiffer_by

    mesh = None if whole.prepared is None else whole.prepared.mesh
    left = 0.0 if mesh is None else of_mesh(whole.case, mesh)
    if mesh is not None and whole.mesh is not None and len(whole.mesh.points) == len(mesh.points):
        formulation = getattr(whole.declared.thing, "formulation", "displacement")
        u = np.asarray(whole.mesh.displacement, dtype=np.float64)
        share = softer_by(whole.case, mesh, u, formulation != "displacement")
        left += share / (1.0 - share)
        if formulation != "displacement":
            left += stiffer_by(whole.case, mesh, u, whole.mesh.pressures)
    return {"constants": lambda seen: left * seen.size} if left else {}
