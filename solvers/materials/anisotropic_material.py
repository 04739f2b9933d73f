"""Base class of anisotropic materials, with everything that does not depend on the particular law.

To add a material, derive a dataclass from `Anisotropic`, with `fibres`, `density` and `bulk` among its constants. It
defines `shear_modulus`, and its law without K/2 (J - 1)^2: `_shape_psi`, `_shape_P` and `_set_shape` (guccione.py shows
an example). A law of fibre invariants derives from `FiberReinforced` (fiber_reinforced.py).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from softmark.solvers.materials.batching import BatchedLaw
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.material_axes import MaterialFrame
from softmark.solvers.materials.tensor_components import (
    add_outer,
    add_tensor_cross_product,
    cofactor,
    displacement_gradient,
    volume_change,
)

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array, Law
    from softmark.solvers.materials.volumetric_constraints import Constraint
else:
    from softmark.solvers.runtime.lazy_modules import np

FIBRES = (
    "direction of the fibres: `+x`, `(1, 1, 0)`, expressions such as `(-y, x, 0 mm)`, or a rule such as `helix(...)`"
)
BULK = "K in the additional energy K/2 (J - 1)^2; default: incompressible"
Density = Annotated[float, "kg/m^3 in (0, inf)", "mass per volume of the undeformed solid"]
Fibres = Annotated[Any, "fibres", FIBRES]
Sheets = Annotated[Any, "fibres", "direction of the sheets; only its component normal to the fibres counts"]
Bulk = Annotated[float | None, "Pa in (0, inf)", BULK]


class Anisotropic(BatchedLaw):
    """Anisotropic solid: psi = shape(F, f, s) + K/2 (J - 1)^2, J = det F > 0, with fibres f and sheets s.

    The first term of psi depends on the whole F, and K is the bulk modulus. `fibres` and `sheets` are directions,
    functions of position that return directions, or a `MaterialFrame` of points.
    """

    fibres: Any
    density: float
    bulk: float | None
    sheets: Any = None
    thin = False
    varying: tuple[str, ...] = ("density",)  # constants that may vary in space; directions vary by their own rules
    directed = True  # isotropic theories do not apply
    branches: tuple[tuple[float, float], ...] = ()  # no viscoelastic branches
    pulls = False  # an active part is applied with the loads
    sheeted = False  # it is anisotropic across the fibres

    # ------------------------------------------------------------------ the law

    @abstractmethod
    def _shape_psi(self, f: Array, axes: Array) -> Array:
        """Return the energy density (m,) without the volume part, J/m^3.

        f (3, 3, m) are the components of F, and `axes` (3, 3, m or 1) the material directions.
        """

    @abstractmethod
    def _shape_P(self, f: Array, axes: Array) -> Array:
        """Return the first Piola-Kirchhoff stress (3, 3, m) of `_shape_psi`, Pa."""

    @abstractmethod
    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        """Write the stiffness of `_shape_psi`, Pa, into H (9, 9, m), on and above the diagonal."""

    def _psi(self, f: Array) -> Array:
        j = volume_change(displacement_gradient(f))
        psi = self._shape_psi(f, self.frame.axes(f.dtype)) + 0.5 * self._volume_term_modulus * j * j
        return np.where((j > -1.0) & ~np.isnan(psi), psi, np.inf)

    def _P(self, f: Array) -> Array:
        P = self._shape_P(f, self.frame.axes(f.dtype))
        if self.bulk is not None:
            P += (self.bulk * volume_change(displacement_gradient(f))) * cofactor(f)
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        self._set_shape(f, self.frame.axes(f.dtype), H)
        if self.bulk is not None:
            C, j = cofactor(f).reshape(9, -1), volume_change(displacement_gradient(f))
            add_outer(H, self.bulk * C, C)
            add_tensor_cross_product(H, (self.bulk * j) * f)

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3)."""
        return project(self.dPdF(F))

    def finite_law(self) -> Law | None:
        """Return the law itself; for an incompressible solid, the law without the volume energy."""
        return self

    def finite_parts(self) -> tuple[Law, Law] | None:
        """Return None (no split): the volume stiffness is not proportional to a single modulus."""
        return None

    def isochoric(self) -> Law | None:
        """Return None: psi has no isochoric part, because all of its terms depend on F itself, not on J^(-1/3) F."""
        return None

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """Return the law with K replaced by `local_bulk`, and the constraint J - 1.

        The pressure of the constraint carries the remaining part of K.
        """
        from softmark.solvers.materials.volumetric_constraints import VolumeRatio

        return self._with_bulk(self.local_bulk), VolumeRatio()

    def _with_bulk(self, bulk: float) -> Any:
        """Return a copy of the material with the bulk modulus `bulk`, Pa."""
        return self._with(bulk=bulk)

    def _with(self, **new: Any) -> Any:
        """Return a copy of the material with other field values; every material is a dataclass."""
        own: Any = self
        return replace(own, **new)

    # ------------------------------------------------------------------ directions

    @property
    def frame(self) -> MaterialFrame:
        """Material directions. Raises TypeError if they are functions of position that were not evaluated."""
        if isinstance(self.fibres, MaterialFrame):
            return self.fibres
        if not self.uniform:
            raise TypeError("directions that vary in space, without places")
        return MaterialFrame.of(self.fibres, self.sheets)

    @property
    def uniform(self) -> bool:
        """True if directions and density are the same everywhere."""
        return isinstance(self.density, float | int) and not self.turning

    @property
    def turning(self) -> bool:
        """True if the directions are functions of position."""
        return any(map(depends_on_position, (self.fibres, self.sheets)))

    @property
    def sampled(self) -> bool:
        """True if the directions are arrays, one per integration point (heterogeneous.py)."""
        return isinstance(self.fibres, MaterialFrame) and self.fibres.sampled

    def placed(self, X: Array, read: Any = None) -> Any:
        """Return the material with directions evaluated at points X (m, q, 3), m; `read` reads field files.

        Raises InvalidDirection.
        """
        if not self.turning:
            return self
        frame = directions_at(self.fibres, self.sheets, X, read)
        return self._with(fibres=frame, **self._sheets_removal)

    @property
    def _sheets_removal(self) -> dict[str, None]:
        return {"sheets": None} if "sheets" in vars(self) else {}

    # ------------------------------------------------------------------ orders of magnitude

    @property
    @abstractmethod
    def shear_modulus(self) -> float:
        """Shear modulus at rest averaged over all directions (Voigt), with fibres in tension, Pa."""

    @property
    def incompressible(self) -> bool:
        """True if the volume cannot change."""
        return self.bulk is None

    @property
    def bulk_modulus(self) -> float:
        """Bulk modulus K, Pa; infinite if incompressible. The volume stiffness of the shape part is not included."""
        return math.inf if self.bulk is None else self.bulk

    @property
    def lame_lambda(self) -> float:
        """Lame constant lam of the isotropic solid with this shear and bulk modulus, Pa."""
        return self.bulk_modulus - 2.0 / 3.0 * self.shear_modulus

    @property
    def young(self) -> float:
        """Young's modulus of the isotropic solid with this shear and bulk modulus, Pa; for orders of magnitude only."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson)

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the isotropic solid with this shear and bulk modulus; it indicates volumetric locking."""
        if self.bulk is None:
            return 0.5
        K, mu = self.bulk, self.shear_modulus
        return (3.0 * K - 2.0 * mu) / (6.0 * K + 2.0 * mu)

    @property
    def local_bulk(self) -> float:
        """Part of the bulk modulus that stays in the point-wise law if a cell pressure carries the other part, Pa.

        It is a third of the shear modulus, for the reasons given in `Isotropic.local_lambda`, or half of K if that is
        less.
        """
        third = self.shear_modulus / 3.0
        return third if self.bulk is None else min(third, 0.5 * self.bulk)

    @property
    def pressure_modulus(self) -> float:
        """Modulus M of the energy term M/2 g^2 of `finite_mixed`, Pa; infinite if incompressible."""
        return self.bulk_modulus - self.local_bulk

    @property
    def _volume_term_modulus(self) -> float:
        return 0.0 if self.bulk is None else self.bulk


def lacks_sheets(material: Any) -> bool:
    """Return whether the law distinguishes directions across the fibres but no sheet directions are given."""
    rule = material.fibres
    return bool(material.sheeted and material.sheets is None and not isinstance(rule, MaterialFrame) and
                not getattr(rule, "with_sheets", False))  # fmt: skip


def depends_on_position(direction: Any) -> bool:
    """Return whether a direction is a function of position (expressions or a rule) instead of an evaluated frame."""
    return hasattr(direction, "at") and not isinstance(direction, MaterialFrame)


def constant_at(profile: Any, X: Array, read: Any) -> Array:
    """Return the values (m, q) of a spatially varying constant at points X (m, q, 3), m; `read` reads field files."""
    found: Array = profile.values(X.reshape(-1, 3), read).reshape(X.shape[:-1])
    return found


def directions_at(fibres: Any, sheets: Any, X: Array, read: Any) -> MaterialFrame:
    """Return the material directions at points X (m, q, 3), m, by evaluating functions of position.

    `read` reads field files. Raises InvalidDirection.
    """
    flat = X.reshape(-1, 3)
    f, s = _direction_at(fibres, flat, read), _direction_at(sheets, flat, read)
    f, known = f if isinstance(f, tuple) else (f, None)
    s = s[0] if isinstance(s, tuple) else known if s is None else s
    return MaterialFrame.at(f, s, X.shape[:-1])


def _direction_at(direction: Any, X: Array, read: Any) -> Any:
    """Return a direction (n, 3) at points X (n, 3), m, or None if no direction is given; `read` reads field files.

    A rule that defines both fibres and sheets returns both.
    """
    if direction is None:
        return None
    if hasattr(direction, "at"):
        return direction.at(X, read)
    return np.broadcast_to(np.array(direction, dtype=float), X.shape)


def transform_direction(f: Array, d: Array) -> Array:
    """Return the deformed directions F d (3, m), from f (3, 3, m) and d (3, m or 1)."""
    found: Array = f[:, 0] * d[0] + f[:, 1] * d[1] + f[:, 2] * d[2]
    return found


def squared_stretch_change(moved: Array, d: Array) -> Array:
    """Return |F d|^2 - 1 (m,), accurate near rest, from `moved` = F d - d (3, m) and unit vectors d (3, m or 1)."""
    found: Array = sum((2.0 * d[i] + moved[i]) * moved[i] for i in range(3))
    return found


def dyad(a: Array, b: Array) -> Array:
    """Return a (x) b (9, m) of a (3, m) and b (3, m or 1)."""
    found: Array = (a[:, None] * b[None]).reshape(9, -1)
    return found
