"""Sample points of a probe for metrics of stress or strain.

They are integration points for a mean, or candidate points for a largest value. The mean over a line is the integral
over the line divided by its length. It is computed at Gauss points on pieces of the line that end where the material
changes and are no longer than half a cell. The mean over a surface is the mean over its triangles, which are cut where
the material changes. At a point on an interface of materials a mean uses the average of both sides, and the largest
value is taken from both sides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from softmark.interpreter.problem.probe_domains import ProbeDomain
from softmark.records import dataclass

if TYPE_CHECKING:
    import numpy as np

    from softmark.interpreter.metrics.measurement import Floats, Ints
    from softmark.solvers.stress_recovery.stress_field import Number, Stresses
    from softmark.solvers.stress_recovery.stress_measures import Tensors, TensorsBySide
else:
    from softmark.solvers.runtime.lazy_modules import np

GAUSS = 3  # Gauss points on a piece of a line: exact for polynomials of degree five
PIECES = 2000  # largest number of pieces of a line, without cuts at interfaces
SHORT = 0.5  # length of a piece relative to the cell size
EVEN = 1e-9  # relative tolerance for evenly spaced points
Over = Literal["largest", "mean"]


@dataclass(frozen=True)
class ProbeSamples:
    """Sample points X (n, 3), m, and their weights (n,) in a mean, which add up to 1.

    `materials` are the numbers of the materials inside a surface or a volume. At points on its border, only values on
    the sides of these materials are used.
    """

    X: Floats
    shares: Floats
    materials: Ints | None = None

    def sides(self, field: Stresses) -> TensorsBySide:
        """Return the tensors of a field at the sample points, on each side that belongs to the probe."""
        found = field.sides(self.X)
        return found if self.materials is None else found.select_materials(self.materials)


@dataclass(frozen=True)
class ProbePlace:
    """Location of a stress or strain metric's probe: points X (n, 3), m, triangles or weights, and domain."""

    X: Floats
    triangles: Ints | None = None
    weights: Floats | None = None
    domain: ProbeDomain | None = None

    def sampled(self, over: Over, field: Stresses, number: Number | None = None) -> ProbeSamples:
        """Return the sample points of the probe for the mean or the largest value (`over`) of a field.

        For the largest value of a scalar `number` they include nodes of the mesh.
        """
        domain = self.domain or ProbeDomain()
        if over == "largest":
            X = self._extreme_value_points(domain, field, number)
            inner = self._material_numbers(domain, field)
            if number is None and len(X) > len(self.X):  # points on an interface have no unique side
                rows = field.sides(X).rows
                single = np.bincount(rows, minlength=len(X)) == 1
                single[: len(self.X)] = True
                X = X[single]
            return ProbeSamples(X, np.full(len(X), 1.0 / len(X)), inner)
        if domain.ends is not None:
            return _line_samples(domain.ends, len(self.X), field)
        if domain.points is not None and domain.weights is not None:
            return ProbeSamples(domain.points, domain.weights / domain.weights.sum())
        return ProbeSamples(self.X, mean_weights(self.X, self.weights, self.triangles))

    def evaluation_points(self, over: Over) -> Floats:
        """Return the points of the probe (n, 3), m; for a largest value also points on the border of its domain."""
        if over == "mean" or self.domain is None or self.domain.border is None:
            return self.X
        return np.concatenate([self.X, self.domain.border])

    def _material_numbers(self, domain: ProbeDomain, field: Stresses) -> Ints | None:
        """Return the material numbers inside a surface or a volume; None if the field has only one material."""
        inner = self.X if self.weights is not None else domain.points
        if domain.border is None or inner is None or len(getattr(field, "each", ())) < 2:
            return None
        found: Ints = np.unique(field.sides(inner).materials)
        return found

    def _extreme_value_points(self, domain: ProbeDomain, field: Stresses, number: Number | None) -> Floats:
        """Return the points (n, 3), m, among which the largest value is taken."""
        found = [self.X]
        if domain.border is not None:
            found.append(domain.border)
        if domain.ends is not None:
            begin, end = domain.ends
            found.append(begin + field.interface_crossings(begin, end)[:, None] * (end - begin))
        if number is not None and domain.nodes != "none":
            found.append(field.peaks(number, domain.holds, domain.nodes == "surface"))
        return found[0] if sum(map(len, found[1:])) == 0 else np.concatenate(found)


def _line_samples(ends: tuple[Floats, Floats], points: int, field: Stresses) -> ProbeSamples:
    """Return Gauss points on the pieces of a line between `ends`, whose probe has a number of `points`."""
    begin, end = ends
    length = float(np.linalg.norm(end - begin))
    if length == 0.0:
        return ProbeSamples(begin[None], np.ones(1))
    wanted = max(points - 1, 1) if np.isinf(field.spacing) else int(np.ceil(length / (SHORT * field.spacing)))
    even = np.linspace(0.0, 1.0, 1 + min(max(wanted, points - 1, 1), PIECES))
    t = np.unique(np.concatenate([even, field.interface_crossings(begin, end)]))
    xi, w = np.polynomial.legendre.leggauss(GAUSS)
    size = np.diff(t)
    at = (t[:-1, None] + size[:, None] * (0.5 + 0.5 * xi)).ravel()
    return ProbeSamples(begin + at[:, None] * (end - begin), (size[:, None] * (0.5 * w)).ravel())


def pair_sides(one: Stresses, other: Stresses, samples: ProbeSamples) -> tuple[TensorsBySide, Tensors]:
    """Return the tensors of one field on each side at sample points, and those of the other field on the same sides.

    If the two fields have different materials at the same points, both are averaged over their sides.
    """
    own, theirs = samples.sides(one), samples.sides(other)
    if np.array_equal(own.rows, theirs.rows) and np.array_equal(own.materials, theirs.materials):
        return own, theirs.tensors
    from softmark.solvers.stress_recovery.stress_measures import TensorsBySide

    count = len(samples.X)
    rows = np.arange(count)
    return TensorsBySide(rows, np.zeros(count, dtype=np.int64), own.averaged(count)), theirs.averaged(count)


def mean_weights(X: Floats, weights: Floats | None, triangles: Ints | None) -> Floats:
    """Return the weights (n,) of points X (n, 3) in a mean; they add up to 1.

    A weight is the volume or the area that a point represents, from `weights` (n,) or `triangles` (k, 3). Without these
    all weights are equal, except that both ends of evenly spaced points on a straight line count half (trapezoidal
    rule).
    """
    if weights is not None:
        told: Floats = weights / weights.sum()
        return told
    if triangles is None or not len(triangles):
        return _trapezoidal_weights(X)
    corners = X[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    found: Floats = np.bincount(triangles.ravel(), np.repeat(areas, 3), minlength=len(X)) / (3.0 * areas.sum())
    return found


def _trapezoidal_weights(X: Floats) -> Floats:
    """Return weights (n,), which add up to 1, of points (n, 3) that have no areas or volumes."""
    count = len(X)
    w: Floats = np.ones(count)
    steps = np.diff(X, axis=0)
    if count > 2 and np.ptp(steps, axis=0).max() <= EVEN * np.abs(steps).max():
        w[[0, -1]] = 0.5
    w /= w.sum()
    return w
