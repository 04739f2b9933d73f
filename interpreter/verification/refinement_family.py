"""Mesh refinement of several models, each extrapolated to the limit of zero cell size."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models import model_builders
from softmark.interpreter.models.shared.prepared_model import BuildContext, Solution
from softmark.interpreter.models.shared.support_selection import select_supports
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.validation.refinement_checks import Method, extrapolation_obstacle, methods_of
from softmark.records import dataclass
from softmark.references.convergence_orders import SAFETY_THREE, SAFETY_TWO, estimate_convergence

Floats = NDArray[np.float64]
Field = Callable[[Floats], Floats]  # points (n, 3) -> displacements (n, 3), m

LOWEST = 0.5  # observed order below which nothing is extrapolated
ABOVE = 0.5  # amount above the order of the element up to which an observed order counts as asymptotic
FIRST = 1.0  # least order of an error part that a larger part of the opposite sign may hide
TRIFLE = 1e-6  # relative to the largest change: a smaller one has no order
NEIGHBOURHOODS = 64  # of the body, in which an order is observed
ALIGNED = 0.5  # cosine between successive changes of the field, below which they do not point to one limit
STREWN = 2000  # points over the body, at least, for norms
APART = 2.0  # times the sum of two estimates: models farther apart than that contradict each other
LARGEST = 0.05  # relative to the largest displacement: a reference with a larger error is none


class NoLimit(Exception):
    """Exception for solutions that have no limit that could serve as a reference; the message has the numbers."""


@dataclass(frozen=True)
class Limit:
    """Limit of a method under refinement: a field, its error estimate, and how it was found."""

    name: str
    displacement: Field
    estimate: float  # m, at the point where it is largest
    order: float | None
    extrapolated: bool
    doubt: str | None

    def words(self) -> str:
        """Return the limit as text: `quads: order 1.93, within 0.01 mm`."""
        order = "order unknown" if self.order is None else f"order {self.order:.2f}"
        doubt = f" ({self.doubt})" if self.doubt else ""
        return f"{self.name}: {order}{doubt}, error at most {units.format_value(self.estimate, units.LENGTH)}"


@dataclass(frozen=True)
class ConvergedReference:
    """Displacement field of the method with the smallest error estimate, m, with its error and solutions."""

    displacement: Field
    estimated_error: float
    facts: Mapping[str, Any]


@dataclass(frozen=True)
class SamplePoints:
    """Points X (n, 3), m, at which fields are compared, and the volumes that the first points represent.

    `weights` (k,), m^3, are the volumes of the first k points; the other points have none.
    """

    X: Floats
    weights: Floats

    def l2_norm(self, u: Floats) -> float:
        """Return the L2 norm over the body of a field u (n, 3) known at the points."""
        return float(np.sqrt(self.inner(u, u)))

    def inner(self, u: Floats, v: Floats) -> float:
        """Return the L2 inner product over the body of two fields (n, 3) known at the points."""
        count = len(self.weights)
        return float(self.weights @ np.sum(u[:count] * v[:count], axis=1))


def largest_norm(u: Floats) -> float:
    """Return the largest norm of the displacements u (n, 3), m."""
    return float(np.linalg.norm(u, axis=1).max(initial=0.0))


# ------------------------------------------------------------------ extrapolation


@dataclass(frozen=True)
class Family:
    """Solutions of one method on several meshes, from coarse to fine."""

    name: str
    formal: float  # order of the element in displacements
    sizes: Sequence[float]  # m, of the cells of its meshes
    fields: Sequence[Field]
    tolerance: float = 0.0  # of the solutions, relative
    unfit: str | None = None  # why its meshes cannot be extrapolated, if they cannot


def extrapolate_limit(family: Family, where: SamplePoints) -> Limit:
    """Return the limit of one method under refinement."""
    u = [field(where.X) for field in family.fields]
    changes = [b - a for a, b in pairwise(u)]
    coarse, fine = (where.l2_norm(c) for c in changes[-2:])
    # distances of the finest three from the finest, as values of one quantity
    found = estimate_convergence(list(zip(family.sizes[-3:], (fine + coarse, fine, 0.0), strict=True)))
    doubt = family.unfit or found.reason or _not_asymptotic_reason(found.order or 0.0, family, where, changes)
    left = family.tolerance * largest_norm(u[-1])  # what the solver leaves
    if doubt is None and found.order is not None:
        return _extrapolate(family, found.order, changes[-2:], left, where.X)
    apart = max(largest_norm(b - a) for a, b in combinations(u, 2))
    return Limit(family.name, family.fields[-1], SAFETY_TWO * apart + left, found.order, False, doubt)


def _not_asymptotic_reason(order: float, family: Family, where: SamplePoints, changes: list[Floats]) -> str | None:
    """Return why a family is not in the asymptotic range, or None."""
    if not LOWEST <= order <= family.formal + ABOVE:
        return f"far from the theoretical order {family.formal:g}"
    coarse, fine = changes[-2:]
    norms = where.l2_norm(coarse) * where.l2_norm(fine)
    if norms > 0 and where.inner(coarse, fine) < ALIGNED * norms:
        return "successive changes do not point towards one limit"
    return None


def _extrapolate(family: Family, order: float, changes: list[Floats], left: float, X: Floats) -> Limit:
    """Return the extrapolated limit u = u1 + (u1 - u2) / (r^p - 1) and its error, with at most the formal order.

    Higher observed orders indicate meshes that are too coarse.
    Source: Oberkampf and Roy 2010, section 8.8.
    """
    finer = float(np.log(family.sizes[-2] / family.sizes[-1]))
    beyond = float(1.0 / np.expm1(order * finer))
    second, finest = family.fields[-2:]

    def displacement(X: Floats) -> Floats:
        u = finest(X)
        return u + beyond * (u - second(X))

    orders = _local_orders(
        family, [_local_root_mean_square(X, change) for change in changes], min(order, family.formal)
    )
    change = np.linalg.norm(changes[-1], axis=1)
    cautious = SAFETY_THREE * float((change / np.expm1(orders * finer)).max(initial=0.0))
    hidden = largest_norm(changes[-1]) / float(np.expm1(FIRST * finer))
    return Limit(family.name, displacement, max(cautious, hidden) + left, order, True, None)


def _local_root_mean_square(X: Floats, change: Floats) -> Floats:
    """Return the root mean square of a change (n, 3), m, over the neighbourhood of each point X (n, 3), shape (n,).

    A change has zeros between its waves, and a point on one of them would show any order.
    """
    from scipy.spatial import cKDTree

    near = max(1, len(X) // NEIGHBOURHOODS)
    own = cKDTree(X).query(X, k=[*range(1, near + 1)])[1]
    return np.asarray(np.sqrt(np.mean(np.sum(np.square(change), axis=1)[own], axis=1)), dtype=np.float64)


def _local_orders(family: Family, changes: list[Floats], highest: float) -> Floats:
    """Return the observed convergence order at each point (n,), at most `highest`.

    It follows from the sizes of the last two changes near the point. Clamped edges have a lower order than points far
    from them, which a single order of the whole body would hide.
    """
    coarse, fine = changes
    least = TRIFLE * max(float(change.max(initial=0.0)) for change in changes)
    known = (coarse > least) & (fine > least)
    ratio = np.where(known, coarse, np.inf) / np.where(known, fine, 1.0)
    low, high = np.full(len(ratio), min(LOWEST, highest)), np.full(len(ratio), highest)
    h3, h2, h1 = family.sizes[-3:]
    for _ in range(50):  # (h3^p - h2^p) / (h2^p - h1^p) rises with p
        middle = 0.5 * (low + high)
        above = (h3**middle - h2**middle) / (h2**middle - h1**middle) < ratio
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return high


def combine_limits(limits: Sequence[Limit], where: SamplePoints) -> tuple[Limit, float]:
    """Return the limit with the smallest error, and its error, m, from the distances to the others. Raises NoLimit."""
    fields = [own.displacement(where.X) for own in limits]
    for (a, u), (b, v) in combinations(zip(limits, fields, strict=True), 2):
        apart = largest_norm(u - v)
        if apart > APART * (a.estimate + b.estimate):
            raise NoLimit("the limits of its methods contradict each other: they differ by "
                          f"{units.format_value(apart, units.LENGTH)}; {a.words()}; {b.words()}")  # fmt: skip
    best = min(range(len(limits)), key=lambda i: limits[i].estimate)
    error = max(limits[best].estimate, *(largest_norm(u - fields[best]) for u in fields))
    whole = largest_norm(fields[best])
    if error > LARGEST * whole:
        told = "; ".join(own.words() for own in limits)
        size, most = units.format_value(error, units.LENGTH), units.format_value(whole, units.LENGTH)
        raise NoLimit(f"its error of {size} is more than {100 * LARGEST:g} % of the largest displacement, "
                      f"{most}; {told}; add smaller sizes")  # fmt: skip
    return limits[best], error


# ------------------------------------------------------------------ solutions


@dataclass(frozen=True)
class Member:
    """One model solved at one cell size."""

    size: float
    actual: float  # m: the edge of a cube of the mean volume of a cell
    displacement: Field
    mesh: Any
    facts: Mapping[str, Any]


def find_reference(
    scene: Scene, reference: Declared, points: Floats, measured: Mapping[str, Any], say: Callable[[str, str], None]
) -> ConvergedReference:
    """Return the limit of the models that a reference names, at `points` (n, 3), m, and over the body.

    Raises Fault if a model cannot be built, and NoLimit if there is no limit.
    """
    sizes = reference.thing.sizes.values
    methods = methods_of(scene, reference)
    steps = [(method, size) for method in methods for size in sizes]
    members = []
    for number, (method, size) in enumerate(steps, start=1):
        told = f"{reference.name}: {method.declared.name}, size = {units.format_value(size, units.LENGTH)}"
        say("reference", f"{told} ({number} of {len(steps)})")
        members.append(_solve_at_size(method, size, BuildContext(scene=scene, measured=measured)))
    families = [members[i : i + len(sizes)] for i in range(0, len(members), len(sizes))]
    where = _sample_mesh(families[0][0].mesh, points)
    shop = BuildContext(scene=scene, measured=measured)
    limits = [_extrapolate_method(m, f, where, shop) for m, f in zip(methods, families, strict=True)]
    best, error = combine_limits(limits, where)
    return ConvergedReference(best.displacement, error, _facts(methods, families, limits, best))


def _extrapolate_method(
    method: Method, members: Sequence[Member], where: SamplePoints, workshop: BuildContext
) -> Limit:
    """Return the limit of one method, whose error includes the parts of supports that the meshes miss."""
    unheld = _support_mismatch(method.case, members)
    family = Family(
        method.declared.name,
        method.formal_order,
        [m.actual for m in members],
        [m.displacement for m in members],
        method.case.analysis.tolerance,
        unheld
        or extrapolation_obstacle(
            method.case.shape, [m.size for m in members], method.declared.thing.cuts(method.case)
        ),
    )
    found = extrapolate_limit(family, where)
    if unheld is None:
        return found
    wide = _solve_at_size(replace(method, case=replace(method.case, wide=True)), members[-1].size, workshop)
    apart = largest_norm(wide.displacement(where.X) - members[-1].displacement(where.X))
    return replace(found, estimate=found.estimate + apart)


def _support_mismatch(case: Case, members: Sequence[Member]) -> str | None:
    """Return the reason if meshes hold other parts than the supports select, so that extrapolation fails, else None."""
    for member in members:
        for name, own in select_supports(case, member.mesh).items():
            if own.held < 1.0 or own.beyond > 0.0:
                size = units.format_value(member.size, units.LENGTH)
                return f"cells of {size} hold only {100 * own.held:.3g} % of the part that `{name}` selects"
    return None


def _solve_at_size(method: Method, size: float, workshop: BuildContext) -> Member:
    """Solve one model at one cell size. Raises Fault, or NoLimit if it finds no equilibrium."""
    declared = method.at(size)
    model_builders.load(declared.thing)
    prepared = model_builders.build(declared, method.case, workshop)
    prepared.warm()
    wall, cpu = time.perf_counter(), time.process_time()
    solution: Solution = prepared.solve(lambda iteration: None)
    spent = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    if solution.displacement is None or solution.mesh is None:
        where = f"`{declared.name}` with size {units.format_value(size, units.LENGTH)}"
        raise NoLimit(f"{where} has no solution: {solution.message}")
    mesh = solution.mesh.mesh
    actual = float(mesh.volumes.sum() / len(mesh.cells)) ** (1 / 3)
    return Member(size, actual, solution.displacement, mesh, {**prepared.size, **spent})


def _sample_mesh(mesh: Any, points: Floats) -> SamplePoints:
    """Return random points in a mesh's cells, with the volume of each, and the requested `points` (n, 3), m.

    Regular points would be nodes of the finer meshes, whose errors are not typical of the field.
    """
    each = -(-STREWN // len(mesh.cells))
    xi = mesh.element.random_points(np.random.default_rng(0), each)
    X = np.einsum("qa,mai->mqi", mesh.element.shape(xi), mesh.points[mesh.cells]).reshape(-1, 3)
    return SamplePoints(np.concatenate([X, points]), np.repeat(mesh.volumes / each, each))


def _facts(
    methods: Sequence[Method], families: Sequence[Sequence[Member]], limits: Sequence[Limit], best: Limit
) -> dict[str, Any]:
    """Return the facts of a converged reference for the report."""
    found = {}
    for method, family, own in zip(methods, families, limits, strict=True):
        found[method.declared.name] = {
            "order": own.order,
            "formal_order": method.formal_order,
            "estimate": own.estimate,
            "extrapolated": own.extrapolated,
            "doubt": own.doubt,
            "members": [{"size": m.size, "cell": m.actual, **m.facts} for m in family],
        }
    notes = ["computed by the same solver as the models: it checks the discretisation, not the code"]
    return {"methods": found, "taken": best.name, "notes": notes}
