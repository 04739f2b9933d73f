"""Active strain: muscle whose fibres have a shorter rest length, in any law."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass
from softmark.solvers.materials.active_wrapper import ActiveMaterial
from softmark.solvers.materials.anisotropic_material import FIBRES
from softmark.solvers.materials.tensor_components import product

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np


@dataclass(frozen=True)
class ActiveStrain(ActiveMaterial):
    """Muscle by active strain: the stress-free length of the fibres is shortened, with any passive law.

    psi = psi of the law at F Fa^-1, f the fibres before deformation, and Fa = (1 - s) f (x) f + (1 - s)^(-1/2)
    (I - f (x) f) Unloaded, the muscle is free of stress at F = Fa: its fibres are shorter by the fraction
    `shortening` = s, and it is thicker across them, because Fa preserves the volume. Held at its initial length
    it has the stress of the law at a fibre stretch of 1 / (1 - s). The force therefore decreases as the muscle
    shortens, unlike the prescribed tension of `active`. A negative s lengthens the fibres. An `amplitude`
    changes s from state to state, or over the time of a quasistatic analysis; in a dynamic analysis s is
    constant and an amplitude is refused. s may vary in space. It acts in full from the start and is not raised
    with the loads: if one step is too large, use several states.
    Source: Ambrosi, Pezzuto (2012), "Active stress vs. active strain in mechanobiology: constitutive issues",
    J. Elasticity 107:199; Nardinocchi, Teresi (2007), J. Elasticity 88:27.
    """

    law: Annotated[Any, "material", "passive material"]
    shortening: Annotated[float, "1 in [-0.5, 0.5]", "s, relative shortening of unloaded fibres"]
    own: Annotated[Any, "fibres", FIBRES + "; default: those of the law"] = None
    amplitude: Annotated[
        Any | None, "amplitude", "amplitude of the shortening; default: full shortening from the start"
    ] = None
    varying = ("density", "shortening")
    does = "shortening"

    def _psi(self, f: Array) -> Array:
        psi: Array = self.within._psi(product(f, self._inverse_active_stretch(f)))
        return psi

    def _P(self, f: Array) -> Array:
        A = self._inverse_active_stretch(f)
        P: Array = product(self.within._P(product(f, A)), A)
        return P

    def _dPdF(self, f: Array, H: Array) -> None:
        A = self._inverse_active_stretch(f)
        self.within._dPdF(product(f, A), H)
        _transform_tangent(H, A)

    def _inverse_active_stretch(self, f: Array) -> Array:
        """Return the inverse active stretch Fa^-1 (3, 3, m or 1), symmetric and of determinant one.

        It has the floating-point type of f (3, 3, m).
        """
        d, left = self.frame.axes(f.dtype)[0], 1.0 - np.asarray(self.shortening, dtype=f.dtype)
        across, along = np.sqrt(left), 1.0 / left
        A: Array = (along - across) * (d[:, None] * d[None])
        for i in range(3):
            A[i, i] += across
        return A


def _transform_tangent(H: Array, A: Array) -> None:
    """Transform a tangent H by A = Fa^-1: H_iJkL <- H_iMkN A_MJ A_NL, on and above the diagonal.

    A (3, 3, m or 1) is symmetric.
    """
    for r in range(9):
        H[r + 1 :, r] = H[r, r + 1 :]
    whole = np.empty_like(H)
    for i in range(0, 9, 3):
        for J in range(3):
            whole[i + J] = A[0, J] * H[i] + A[1, J] * H[i + 1] + A[2, J] * H[i + 2]
    for k in range(0, 9, 3):
        for L in range(3):
            c = k + L
            H[: c + 1, c] = (
                A[0, L] * whole[: c + 1, k] + A[1, L] * whole[: c + 1, k + 1] + A[2, L] * whole[: c + 1, k + 2]
            )
