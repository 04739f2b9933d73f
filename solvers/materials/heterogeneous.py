"""A law whose constants differ from point to point: an isotropic material with arrays in place of numbers.

A material is `sampled` where one of its constants is an array (m, q) over the q points of m cells; the laws that
`law_for` and its kin make of it are then wrapped here, which hands each batch of points its own constants. A law of
constant moduli is never wrapped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.tensor_components import precision

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

BLOCK = 4096  # points whose constants are handed on at a time, as many as a law takes (batching.py)


def changed(thing: Any, change: Callable[[Array], Array]) -> Any:
    """A law or a material with all of its arrays changed, those of the laws within it too."""
    new = {}
    for f in fields(thing):
        value = getattr(thing, f.name)
        if isinstance(value, np.ndarray):
            new[f.name] = change(value)
        elif is_dataclass(value):
            new[f.name] = changed(value, change)
    return replace(thing, **new) if new else thing


def arrays(thing: Any) -> Iterator[Array]:
    """The arrays of a law or a material."""
    for f in fields(thing):
        value = getattr(thing, f.name)
        if isinstance(value, np.ndarray):
            yield value
        elif is_dataclass(value):
            yield from arrays(value)


@dataclass(frozen=True, eq=False)
class Varying:
    """`law` has its constants as arrays (m, q), in the order of the points that it is asked at."""

    law: Any

    def __eq__(self, other: object) -> bool:
        """Whether it is the same law with the same constants."""
        if not isinstance(other, Varying) or type(self.law) is not type(other.law):
            return False
        return all(np.array_equal(a, b) for a, b in zip(arrays(self.law), arrays(other.law), strict=True))

    __hash__ = None  # type: ignore[assignment]

    @property
    def shape(self) -> tuple[int, ...]:
        """(m, q)."""
        return next(arrays(self.law)).shape

    def of(self, which: Any, kind: Any = None) -> Varying:
        """The same of some cells, its constants of another precision if that is asked for."""
        return Varying(changed(self.law, lambda a: a[which].astype(kind or a.dtype, copy=False)))

    def psi(self, F: Array) -> Array:
        """Energy per volume at rest, J/m^3 (m q,); of one F that at the first point."""
        return self._each("psi", F, ())

    def P(self, F: Array) -> Array:
        """First Piola-Kirchhoff stress, Pa (m q, 3, 3)."""
        return self._each("P", F, (3, 3))

    def dPdF(self, F: Array) -> Array:
        """dP_iJ/dF_kL, Pa (m q, 3, 3, 3, 3)."""
        return self._each("dPdF", F, (3, 3, 3, 3))

    def dPdF_projected(self, F: Array) -> Array:
        """The positive semi-definite 9x9 matrix nearest to dPdF, Pa (m q, 3, 3, 3, 3)."""
        return self._each("dPdF_projected", F, (3, 3, 3, 3))

    def opened(self, F: Array) -> Array:
        """Of the law of a plate: F with the stretch across it that leaves no stress there (m q, 3, 3)."""
        return self._each("opened", F, (3, 3))

    def at_rest(self, measure: Callable[[Array], Array]) -> Array:
        """What `measure` makes of dP/dF at rest (k, 3, 3, 3, 3), at every point (m, q)."""
        found = np.empty(int(np.prod(self.shape)))
        eye = np.eye(3)[None]
        for some, law in self._blocks(found.size):
            found[some] = measure(law.dPdF(np.broadcast_to(eye, (len(found[some]), 3, 3))))
        return found.reshape(self.shape)

    def _each(self, name: str, F: Array, tail: tuple[int, ...]) -> Array:
        if len(F) not in (1, int(np.prod(self.shape))):
            raise ValueError(f"{len(F)} deformation gradients for constants at {self.shape} points")
        out = np.empty((len(F), *tail), dtype=precision(F))
        for some, law in self._blocks(len(F)):
            out[some] = getattr(law, name)(F[some])
        return out

    def _blocks(self, count: int) -> Iterator[tuple[slice, Any]]:
        flat = changed(self.law, np.ravel)
        for start in range(0, count, BLOCK):
            some = slice(start, min(start + BLOCK, count))
            yield some, changed(flat, lambda a, some=some: a[some])  # type: ignore[misc]


def averaged(material: Isotropic, w: Array) -> Isotropic:
    """The material whose two moduli are the means of a sampled one over each cell (m, 1), by weights w (m, q).

    What laws that are linear in their moduli integrate to where the deformation is the same all over a cell.
    """
    mu, lam = (_mean(a, w) for a in (material.shear_modulus, material.lame_lambda))
    each = {"young": mu * (3.0 * lam + 2.0 * mu) / (lam + mu), "poisson": 0.5 * lam / (lam + mu)}
    return with_constants(material, each)


def with_constants(material: Isotropic, new: dict[str, Any]) -> Isotropic:
    """The same material with other constants, or its law where that has them; of a plate, what it is of as well."""
    own = vars(material)
    if "law" in own and (its := {name: value for name, value in new.items() if name not in own}):
        rest: Any = {name: value for name, value in new.items() if name in own}
        return replace(material, **rest | {"law": with_constants(own["law"], its)})
    of = getattr(material, "of", None)
    more: Any = {} if of is None else {"of": with_constants(of, new)}
    return replace(material, **new, **more)


def _mean(a: Array | float, w: Array) -> Array:
    mean: Array = (np.broadcast_to(a, w.shape) * w).sum(axis=1, keepdims=True) / w.sum(axis=1, keepdims=True)
    return mean
