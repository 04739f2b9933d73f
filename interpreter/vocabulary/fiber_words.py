"""Rules for fibre directions that vary in space. To add one: a class here and a line in FIBRES.

A rule has a method `at(X, read)`. It returns the fibre directions at undeformed points X (n, 3), m, as vectors (n, 3)
of any length, or a pair of such arrays for fibres and sheets. The argument `read` reads fields from files. The module
imports numpy only when the method is called. The method raises InvalidDirection where no direction is defined.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    Floats = Any  # (n, 3) of numpy

Vector3 = tuple[float, float, float]
NEAR = 1e-12  # tolerance of the depth t
STEPS = 60
OUTSIDE = "it is not in the wall of the helix"
BEYOND = 0.05  # largest depth outside the wall, as a fraction of it: nodes of coarse meshes lie outside


@dataclass(frozen=True)
class Helix:
    """Helical fibres in the wall between two ellipsoids with a common axis, as in a heart ventricle.

    The wall consists of ellipsoidal layers. Their semi-axes vary linearly with the depth t, from 0 at the inner surface
    to 1 at the outer one. In each layer the fibres are tangential, at an angle to the circumferential direction that
    varies linearly from `endo` inside to `epi` outside. A positive angle is a right-handed helix: a fibre that runs
    counter-clockwise around the axis, seen from the tip of the axis vector, advances along the axis. The fibre is f =
    cos(angle) c + sin(angle) l, with c the circumferential and l the meridional direction. Sheet directions are normal
    to the layers. On the axis itself no direction is defined.
    Source: Land et al. (2015), Proc. R. Soc. A 471:20150641, equations for problem 3; Streeter (1979).
    """

    endo: Annotated[float, "rad in [-1.5707963267948966, 1.5707963267948966]", "fibre angle at the inner surface"]
    epi: Annotated[float, "rad in [-1.5707963267948966, 1.5707963267948966]", "fibre angle at the outer surface"]
    inner: Annotated[float, "m in (0, inf)", "semi-axis of the inner ellipsoid across the axis"]
    inner_along: Annotated[float, "m in (0, inf)", "semi-axis of the inner ellipsoid along the axis"]
    outer: Annotated[float, "m in (0, inf)", "semi-axis of the outer ellipsoid across the axis"]
    outer_along: Annotated[float, "m in (0, inf)", "semi-axis of the outer ellipsoid along the axis"]
    axis: Annotated[Vector3, "direction", "direction of the axis, towards the base"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "centre of both ellipsoids"] = (0.0, 0.0, 0.0)

    with_sheets = True

    @property
    def fault(self) -> str:
        """Error message if the inner ellipsoid is not smaller than the outer one, else empty."""
        there = self.inner < self.outer and self.inner_along < self.outer_along
        return "" if there else "its inner ellipsoid must be smaller than its outer one, across the axis and along it"

    def depth(self, r: Floats, z: Floats) -> Floats:
        """Return the depth (n,) in the wall of points at distance r from the axis and height z, m.

        The depth is 0 at the inner and 1 at the outer surface. It is computed by Newton's method.
        """
        import numpy as np

        a, b, wide, long = self.inner, self.inner_along, self.outer - self.inner, self.outer_along - self.inner_along
        t = np.zeros_like(r)
        for _ in range(STEPS):
            x, y = r / (a + t * wide), z / (b + t * long)
            off, slope = x**2 + y**2 - 1.0, -2.0 * (x**2 * wide / (a + t * wide) + y**2 * long / (b + t * long))
            step = off / np.where(slope == 0.0, -1.0, slope)
            t = np.maximum(t - step, -0.5 * min(a / wide, b / long))
            if np.all(np.abs(step) <= NEAR):
                break
        return t

    def at(self, X: Floats, read: Any = None) -> tuple[Floats, Floats]:
        """Return the fibre and sheet directions at points X (n, 3), m, as two arrays (n, 3).

        Raises InvalidDirection on the axis and outside the wall.
        """
        import numpy as np

        from softmark.solvers.materials.material_axes import InvalidDirection

        e = np.array(self.axis)
        Y = X - np.array(self.origin)
        z = Y @ e
        across = Y - z[:, None] * e
        r = np.linalg.norm(across, axis=1)
        t = self.depth(r, z)
        if np.any(far := (t < -BEYOND) | (t > 1.0 + BEYOND) | ~np.isfinite(t)):
            raise InvalidDirection(OUTSIDE, tuple(X[np.argmax(far)]))
        if np.any(r == 0.0):
            raise InvalidDirection("on the axis of a helix no direction is around it", tuple(X[np.argmin(r)]))
        t = np.clip(t, 0.0, 1.0)
        out = across / r[:, None]
        normal = (r / (self.inner + t * (self.outer - self.inner)) ** 2)[:, None] * out
        normal = normal + (z / (self.inner_along + t * (self.outer_along - self.inner_along)) ** 2)[:, None] * e
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        around = np.cross(e, out)
        along = np.cross(normal, around)  # up the meridian
        angle = (self.endo + t * (self.epi - self.endo))[:, None]
        return np.cos(angle) * around + np.sin(angle) * along, normal


FIBRES: dict[str, type[Any]] = {"helix": Helix}
