"""Materials that know directions: what every one of them has, whatever its law is.

To add one: a dataclass on `Anisotropic` with `fibres`, `density` and `bulk` beside its constants, `shear_modulus`, and
the part of its law that is beside K/2 (J - 1)^2: `_shape_psi`, `_shape_P` and `_add_shape` (guccione.py); where that is
made of invariants of fibres, a dataclass on `Reinforced` (fiber_reinforced.py).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from softmark.solvers.materials.batching import Blockwise
from softmark.solvers.materials.constitutive_law import project
from softmark.solvers.materials.material_axes import Frame
from softmark.solvers.materials.tensor_components import (
    add_cross,
    add_outer,
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

FIBRES = "the direction of the fibres: `+x`, `(1, 1, 0)`, expressions as in `(-y, x, 0 mm)`, or a rule as `helix(...)`"
BULK = "K in K/2 (J - 1)^2, beside what the law itself resists; without one the volume cannot change"
Density = Annotated[float, "kg/m^3 in (0, inf)", "mass per volume of the undeformed solid"]
Fibres = Annotated[Any, "fibres", FIBRES]
Sheets = Annotated[Any, "fibres", "the direction of the sheets, of which what lies along the fibres does not count"]
Bulk = Annotated[float | None, "Pa in (0, inf)", BULK]


class Anisotropic(Blockwise):
    """A solid with directions: psi = shape(F, f, s) + K/2 (J - 1)^2, J = det F > 0.

    `fibres` and `sheets` are directions, rules that make them of places, or a `Frame` of points.
    """

    fibres: Any
    density: float
    bulk: float | None
    sheets: Any = None
    thin = False
    varying: tuple[str, ...] = ("density",)  # numbers that may vary in space: directions do by rules of their own
    directed = True  # what isotropic theories must not be asked about
    branches: tuple[tuple[float, float], ...] = ()  # nothing of it relaxes
    pulls = False  # it has a part that comes with the loads
    sheeted = False  # it is not alike in all directions across the fibres

    # ------------------------------------------------------------------ the law

    @abstractmethod
    def _shape_psi(self, f: Array, axes: Array) -> Array:
        """Energy density (m,) beside that of the volume, of f (3, 3, m) and of directions (3, 3, m or 1)."""

    @abstractmethod
    def _shape_P(self, f: Array, axes: Array) -> Array:
        """Its stress (3, 3, m)."""

    @abstractmethod
    def _set_shape(self, f: Array, axes: Array, H: Array) -> None:
        """Writes its stiffness into H (9, 9, m), on and above the diagonal."""

    def _psi(self, f: Array) -> Array:
        j = volume_change(displacement_gradient(f))
        psi = self._shape_psi(f, self.frame.axes(f.dtype)) + 0.5 * self._resisting * j * j
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
            add_cross(H, (self.bulk * j) * f)

    def dPdF_projected(self, F: Array) -> Array:
        """The positive semi-definite 9x9 matrix nearest to dPdF, Pa (m, 3, 3, 3, 3)."""
        return project(self.dPdF(F))

    def finite_law(self) -> Law | None:
        """The law itself; of a solid whose volume cannot change, without the pressure that holds it."""
        return self

    def finite_parts(self) -> tuple[Law, Law] | None:
        """None: its stiffness to a change of volume is not all in one modulus."""
        return None

    def isochoric(self) -> Law | None:
        """None: its shape is one of F as it is, and not of the part that keeps the volume."""
        return None

    def finite_mixed(self) -> tuple[Law, Constraint] | None:
        """The law with `local_bulk` for K, and J - 1, which a pressure holds with the rest."""
        from softmark.solvers.materials.volumetric_constraints import VolumeRatio

        return self._with_bulk(self.local_bulk), VolumeRatio()

    def _with_bulk(self, bulk: float) -> Any:
        return self._with(bulk=bulk)

    def _with(self, **new: Any) -> Any:
        """The same with other fields: every law is a dataclass."""
        own: Any = self
        return replace(own, **new)

    # ------------------------------------------------------------------ directions

    @property
    def frame(self) -> Frame:
        """Its directions. Raises TypeError where they are made of places, and none are known."""
        if isinstance(self.fibres, Frame):
            return self.fibres
        if not self.uniform:
            raise TypeError("directions that vary in space, without places")
        return Frame.of(self.fibres, self.sheets)

    @property
    def uniform(self) -> bool:
        """Whether its directions and its density are the same everywhere."""
        return isinstance(self.density, float | int) and not self.turning

    @property
    def turning(self) -> bool:
        """Whether its directions are made of places."""
        return any(map(of_places, (self.fibres, self.sheets)))

    @property
    def sampled(self) -> bool:
        """Whether its directions are arrays, those of every point of integration (heterogeneous.py)."""
        return isinstance(self.fibres, Frame) and self.fibres.sampled

    def placed(self, X: Array, read: Any = None) -> Any:
        """The same with its directions at points X (m, q, 3), m; `read` reads fields. Raises NoDirection."""
        if not self.turning:
            return self
        frame = directions_at(self.fibres, self.sheets, X, read)
        return self._with(fibres=frame, **self._no_sheets)

    @property
    def _no_sheets(self) -> dict[str, None]:
        return {"sheets": None} if "sheets" in vars(self) else {}

    # ------------------------------------------------------------------ orders of magnitude

    @property
    @abstractmethod
    def shear_modulus(self) -> float:
        """The mean over all directions of its resistance to shear at rest, Pa: Voigt's, with fibres that are taut."""

    @property
    def incompressible(self) -> bool:
        """Whether its volume cannot change at all."""
        return self.bulk is None

    @property
    def bulk_modulus(self) -> float:
        """K, Pa; infinite where its volume cannot change. What the law itself resists is left out."""
        return math.inf if self.bulk is None else self.bulk

    @property
    def lame_lambda(self) -> float:
        """lam of the isotropic solid that has these two moduli, Pa."""
        return self.bulk_modulus - 2.0 / 3.0 * self.shear_modulus

    @property
    def young(self) -> float:
        """Young's modulus of the isotropic solid that has these two moduli, Pa: for orders of magnitude alone."""
        return 2.0 * self.shear_modulus * (1.0 + self.poisson)

    @property
    def poisson(self) -> float:
        """Its Poisson's ratio: by how much its elements lock."""
        if self.bulk is None:
            return 0.5
        K, mu = self.bulk, self.shear_modulus
        return (3.0 * K - 2.0 * mu) / (6.0 * K + 2.0 * mu)

    @property
    def local_bulk(self) -> float:
        """What of K stays at every point of a cell where a pressure takes the rest, Pa.

        A third of the shear modulus, for the reasons that `Isotropic.local_lambda` has, or half of a smaller K.
        """
        third = self.shear_modulus / 3.0
        return third if self.bulk is None else min(third, 0.5 * self.bulk)

    @property
    def pressure_modulus(self) -> float:
        """M of `finite_mixed`, Pa; infinite where its volume cannot change."""
        return self.bulk_modulus - self.local_bulk

    @property
    def _resisting(self) -> float:
        return 0.0 if self.bulk is None else self.bulk


def missing_sheets(material: Any) -> bool:
    """Whether its law tells directions across the fibres apart, and nothing says which they are."""
    rule = material.fibres
    return bool(material.sheeted and material.sheets is None and not isinstance(rule, Frame) and
                not getattr(rule, "with_sheets", False))  # fmt: skip


def of_places(direction: Any) -> bool:
    """Whether a direction is made of places: expressions, or a rule, and no `Frame` of points that are known."""
    return hasattr(direction, "at") and not isinstance(direction, Frame)


def constant_at(profile: Any, X: Array, read: Any) -> Array:
    """A constant that varies in space at points X (m, q, 3), m: (m, q)."""
    found: Array = profile.values(X.reshape(-1, 3), read).reshape(X.shape[:-1])
    return found


def directions_at(fibres: Any, sheets: Any, X: Array, read: Any) -> Frame:
    """Directions, and rules that make them of places, at points X (m, q, 3), m. Raises NoDirection."""
    flat = X.reshape(-1, 3)
    f, s = _at(fibres, flat, read), _at(sheets, flat, read)
    f, known = f if isinstance(f, tuple) else (f, None)
    s = s[0] if isinstance(s, tuple) else known if s is None else s
    return Frame.at(f, s, X.shape[:-1])


def _at(direction: Any, X: Array, read: Any) -> Any:
    """A direction at points (n, 3), m: (n, 3), or those of fibres and of sheets of a rule that knows both."""
    if direction is None:
        return None
    if hasattr(direction, "at"):
        return direction.at(X, read)
    return np.broadcast_to(np.array(direction, dtype=float), X.shape)


def along(f: Array, d: Array) -> Array:
    """F d (3, m) of f (3, 3, m) and d (3, m or 1)."""
    found: Array = f[:, 0] * d[0] + f[:, 1] * d[1] + f[:, 2] * d[2]
    return found


def lengthened(moved: Array, d: Array) -> Array:
    """|F d|^2 - 1 (m,), accurate near rest, of F d - d (3, m) and unit vectors d (3, m or 1)."""
    found: Array = sum((2.0 * d[i] + moved[i]) * moved[i] for i in range(3))
    return found


def dyad(a: Array, b: Array) -> Array:
    """a (x) b (9, m) of a (3, m) and b (3, m or 1)."""
    found: Array = (a[:, None] * b[None]).reshape(9, -1)
    return found
