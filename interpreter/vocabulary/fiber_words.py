"""Directions of fibres that vary in space, by rules. To add one: a class here, a line in FIBRES.

What a rule has: `at(X, read)`, the directions at points X (n, 3) in m before deformation: (n, 3), of any length, or two
such of fibres and of sheets; `read` reads fields. It is computed with numpy, which is not imported before. Raises
NoDirection where it has none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from softmark.records import dataclass

if TYPE_CHECKING:
    Floats = Any  # (n, 3) of numpy

Vector3 = tuple[float, float, float]
NEAR = 1e-12  # of the wall: how well its layer through a point is found
STEPS = 60
OUTSIDE = "it is not in the wall of the helix"
BEYOND = 0.05  # of the wall: how far outside of it a point may be, as nodes of coarse meshes are


@dataclass(frozen=True)
class Helix:
    """Fibres that wind around the wall between two ellipsoids about one axis, as those of a ventricle do.

    The wall's layers are the ellipsoids whose semi-axes lie between those of the inner and the outer one, in proportion
    to the depth t, 0 inside and 1 outside. In each layer fibres lie along it, at an angle from the way around the axis:
    `endo` inside, `epi` outside, in proportion to t between. A positive angle is that of a right-handed screw: who goes
    around the axis counter-clockwise, as seen from its tip, goes along it. f = cos(angle) c + sin(angle) l, with c
    around the axis and l along the meridian. Sheets go out from layer to layer, across the fibres. On the axis itself,
    where no direction is around it, there are none.
    Source: Land et al. (2015), Proc. R. Soc. A 471:20150641, equations for problem 3; Streeter (1979).
    """

    endo: Annotated[float, "rad in [-1.5707963267948966, 1.5707963267948966]", "the angle at the inner surface"]
    epi: Annotated[float, "rad in [-1.5707963267948966, 1.5707963267948966]", "the angle at the outer surface"]
    inner: Annotated[float, "m in (0, inf)", "semi-axis of the inner ellipsoid across the axis"]
    inner_along: Annotated[float, "m in (0, inf)", "its semi-axis along the axis"]
    outer: Annotated[float, "m in (0, inf)", "semi-axis of the outer ellipsoid across the axis"]
    outer_along: Annotated[float, "m in (0, inf)", "its semi-axis along the axis"]
    axis: Annotated[Vector3, "direction", "of the axis, towards the base"] = (0.0, 0.0, 1.0)
    origin: Annotated[Vector3, "m", "the centre of both ellipsoids"] = (0.0, 0.0, 0.0)

    with_sheets = True

    @property
    def fault(self) -> str:
        """A wall that is not there."""
        there = self.inner < self.outer and self.inner_along < self.outer_along
        return "" if there else "its inner ellipsoid must be smaller than its outer one, across the axis and along it"

    def depth(self, r: Floats, z: Floats) -> Floats:
        """The layer t (n,) at distances r from the axis and z along it, m: 0 inside, 1 outside, by Newton's method."""
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
        """Fibres and sheets at points X (n, 3), m. Raises NoDirection on the axis and far outside of the wall."""
        import numpy as np

        from softmark.solvers.materials.material_axes import NoDirection

        e = np.array(self.axis)
        Y = X - np.array(self.origin)
        z = Y @ e
        across = Y - z[:, None] * e
        r = np.linalg.norm(across, axis=1)
        t = self.depth(r, z)
        if np.any(far := (t < -BEYOND) | (t > 1.0 + BEYOND) | ~np.isfinite(t)):
            raise NoDirection(OUTSIDE, tuple(X[np.argmax(far)]))
        if np.any(r == 0.0):
            raise NoDirection("on the axis of a helix no direction is around it", tuple(X[np.argmin(r)]))
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
