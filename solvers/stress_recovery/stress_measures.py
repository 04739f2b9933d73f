"""Scalar measures of stress and strain: components, principal values, von Mises stress, stretches, volume ratio."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from softmark.records import dataclass
from softmark.solvers.mesh.mesh import Floats, Ints
from softmark.solvers.stress_recovery.sampling_point_stress import SYMMETRIC

AXES = dict(zip(("xx", "yy", "zz", "xy", "yz", "zx"), SYMMETRIC, strict=True))
OfStress = Literal["von_mises", "pressure", "principal_1", "principal_2", "principal_3",
                   "xx", "yy", "zz", "xy", "yz", "zx"]  # fmt: skip
OfStrain = Literal["principal_1", "principal_2", "principal_3", "xx", "yy", "zz", "xy", "yz", "zx"]
OfStretch = Literal["principal_1", "principal_2", "principal_3", "x", "y", "z", "volume"]


@dataclass(frozen=True)
class Tensors:
    """Cauchy stress `six` (n, 6), Pa, and displacement gradient `H` = du/dX (n, 9) at n points.

    If `small` is True, strains are linear in H.
    """

    six: Floats
    H: Floats
    small: bool

    @property
    def cauchy(self) -> Floats:
        """Cauchy stress (n, 3, 3), Pa."""
        return full_tensors(self.six)

    @property
    def F(self) -> Floats:
        """Deformation gradients (n, 3, 3)."""
        F: Floats = self.H.reshape(-1, 3, 3) + np.eye(3)
        return F

    @property
    def nominal(self) -> Floats:
        """First Piola-Kirchhoff stress J sigma F^-T (n, 3, 3), Pa; for small strains the Cauchy stress.

        Component [i, J] is the force along i per undeformed area normal to J.
        """
        if self.small:
            return self.cauchy
        F = self.F
        P: Floats = np.linalg.det(F)[:, None, None] * self.cauchy @ np.linalg.inv(F).swapaxes(1, 2)
        return P

    def strain(self, measure: str) -> Floats:
        """Return a strain tensor (n, 3, 3): green (F^T F - I)/2, biot U - I, or logarithmic ln U.

        For small strains all of them are the symmetric part of H.
        """
        H = self.H.reshape(-1, 3, 3)
        turned = H.swapaxes(1, 2)
        if self.small:
            return 0.5 * (H + turned)
        E: Floats = 0.5 * (H + turned + turned @ H)  # without F^T F - I, which would lose small strains
        if measure == "green":
            return E
        w, V = np.linalg.eigh(E)
        w = 0.5 * np.log1p(2.0 * w) if measure == "logarithmic" else np.sqrt(1.0 + 2.0 * w) - 1.0
        found: Floats = (V * w[:, None, :]) @ V.swapaxes(1, 2)
        return found

    def stretches(self, component: str) -> Floats:
        """Return stretches (n,), selected by `component`.

        `component` is a principal stretch such as principal_1, an undeformed axis x, y or z whose fibres are stretched,
        or `volume` for the volume ratio.
        """
        if component == "volume":
            H = self.H.reshape(-1, 3, 3)
            ratio: Floats = 1.0 + np.trace(H, axis1=1, axis2=2) if self.small else np.linalg.det(self.F)
            return ratio
        if component in ("x", "y", "z"):
            axis = "xyz".index(component)
            H = self.H.reshape(-1, 3, 3)
            grown: Floats = 1.0 + H[:, axis, axis] if self.small else np.linalg.norm(self.F[:, :, axis], axis=1)
            return grown
        return 1.0 + principal_value(self.strain("biot"), component)


@dataclass(frozen=True)
class TensorsBySide:
    """Stress and deformation at points, with one row for every pair of a point and a material there.

    `rows` (k,) are the point numbers in ascending order, `materials` (k,) the material numbers, and `tensors` the
    values of the k pairs. A point inside one material has one row, and a point on an interface has one row for each
    side.
    """

    rows: Ints
    materials: Ints
    tensors: Tensors

    def divide_among_rows(self, amounts: Floats) -> Floats:
        """Return values (k,) for the rows, from values `amounts` (n,) for the points.

        The value of a point is divided evenly among its rows.
        """
        divided: Floats = amounts[self.rows] / np.bincount(self.rows, minlength=len(amounts))[self.rows]
        return divided

    def averaged(self, count: int) -> Tensors:
        """Return the tensors of `count` points, each the mean over the rows of the point."""
        share = self.divide_among_rows(np.ones(count))[:, None]
        six, H = np.zeros((count, 6)), np.zeros((count, 9))
        np.add.at(six, self.rows, share * self.tensors.six)
        np.add.at(H, self.rows, share * self.tensors.H)
        return Tensors(six, H, self.tensors.small)

    def select_materials(self, materials: Ints) -> TensorsBySide:
        """Return the rows of the given materials, and all rows of points without any of these materials."""
        own = np.isin(self.materials, materials)
        none = np.bincount(self.rows, own, minlength=int(self.rows.max(initial=-1)) + 1)[self.rows] == 0.0
        kept = own | none
        tensors = Tensors(self.tensors.six[kept], self.tensors.H[kept], self.tensors.small)
        return TensorsBySide(self.rows[kept], self.materials[kept], tensors)

    @property
    def interface_row_mask(self) -> Any:
        """Mask (k,) of the rows of points with several rows."""
        return np.bincount(self.rows)[self.rows] > 1


def full_tensors(six: Floats) -> Floats:
    """Return symmetric tensors (n, 3, 3) from their six components (n, 6)."""
    found = np.empty((len(six), 3, 3))
    for k, (i, j) in enumerate(SYMMETRIC):
        found[:, i, j] = found[:, j, i] = six[:, k]
    return found


def principal_value(tensors: Floats, component: str) -> Floats:
    """Return an eigenvalue (n,) of symmetric tensors (n, 3, 3): principal_1 (largest) to principal_3 (least)."""
    values: Floats = np.linalg.eigvalsh(tensors)[:, 3 - int(component[-1])].astype(np.float64)
    return values


def von_mises(sigma: Floats) -> Floats:
    """Return the von Mises stress sqrt(3/2 s : s) (n,), Pa, of stresses (n, 3, 3) with deviators s."""
    s = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    value: Floats = np.sqrt(1.5 * (s**2).sum(axis=(1, 2)))
    return value


def extract_component(tensors: Floats, component: str) -> Floats:
    """Return a scalar measure (n,) of tensors (n, 3, 3), in their unit.

    `component` is a component such as xx, a principal value, von_mises or pressure.
    """
    if component in AXES:
        i, j = AXES[component]
        return tensors[:, i, j]
    if component.startswith("principal"):
        return principal_value(tensors, component)
    return OTHERS[component](tensors)


OTHERS: dict[str, Callable[[Floats], Floats]] = {
    "von_mises": von_mises,
    "pressure": lambda sigma: -np.trace(sigma, axis1=1, axis2=2) / 3.0,
}
