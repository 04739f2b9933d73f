"""Laws whose constants differ from point to point: a material with arrays instead of numbers.

A material is `sampled` if one of its constants is an array (m, q) over the q points of m cells. The laws that `law_for`
and similar functions make from such a material are wrapped here, so that each batch of points gets its own constants. A
law with uniform constants is never wrapped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

from softmark.records import dataclass
from softmark.solvers.materials.isotropic_material import Isotropic
from softmark.solvers.materials.tensor_components import result_dtype

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.materials.constitutive_law import Array
else:
    from softmark.solvers.runtime.lazy_modules import np

BLOCK = 4096  # points per block, as many as in batching.py


def map_arrays(thing: Any, change: Callable[[Array], Array]) -> Any:
    """Return a law or a material with `change` applied to all of its arrays, including those of wrapped laws."""
    new = {}
    for f in fields(thing):
        value = getattr(thing, f.name)
        if isinstance(value, np.ndarray):
            new[f.name] = change(value)
        elif is_dataclass(value):
            new[f.name] = map_arrays(value, change)
    return replace(thing, **new) if new else thing


def iterate_arrays(thing: Any) -> Iterator[Array]:
    """Yield the arrays of a law or a material."""
    for f in fields(thing):
        value = getattr(thing, f.name)
        if isinstance(value, np.ndarray):
            yield value
        elif is_dataclass(value):
            yield from iterate_arrays(value)


@dataclass(frozen=True, eq=False)
class HeterogeneousLaw:
    """A law whose constants differ from point to point.

    The wrapped `law` has constants as arrays (m, q), in the order of the evaluation points.
    """

    law: Any

    def __eq__(self, other: object) -> bool:
        """Return whether the law and its constants are equal."""
        if not isinstance(other, HeterogeneousLaw) or type(self.law) is not type(other.law):
            return False
        return all(
            np.array_equal(a, b) for a, b in zip(iterate_arrays(self.law), iterate_arrays(other.law), strict=True)
        )

    __hash__ = None  # type: ignore[assignment]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells and of points per cell, (m, q)."""
        return next(iterate_arrays(self.law)).shape

    def of(self, which: Any, kind: Any = None) -> HeterogeneousLaw:
        """Return the law of the cells `which`, with constants of the floating-point type `kind` if given."""
        return HeterogeneousLaw(map_arrays(self.law, lambda a: a[which].astype(kind or a.dtype, copy=False)))

    def psi(self, F: Array) -> Array:
        """Return the energy per undeformed volume (m q,), J/m^3, at F (m q, 3, 3).

        A single F (1, 3, 3) is evaluated with the constants of the first point.
        """
        return self._evaluate_by_blocks("psi", F, ())

    def P(self, F: Array) -> Array:
        """Return the first Piola-Kirchhoff stress, Pa (m q, 3, 3)."""
        return self._evaluate_by_blocks("P", F, (3, 3))

    def dPdF(self, F: Array) -> Array:
        """Return dP_iJ/dF_kL, Pa (m q, 3, 3, 3, 3)."""
        return self._evaluate_by_blocks("dPdF", F, (3, 3, 3, 3))

    def dPdF_projected(self, F: Array) -> Array:
        """Return the positive semi-definite 9x9 matrix nearest to dPdF, Pa (m q, 3, 3, 3, 3)."""
        return self._evaluate_by_blocks("dPdF_projected", F, (3, 3, 3, 3))

    def opened(self, F: Array) -> Array:
        """Return F with the thickness stretch that makes the stress across a plate zero, (m q, 3, 3)."""
        return self._evaluate_by_blocks("opened", F, (3, 3))

    def at_rest(self, measure: Callable[[Array], Array]) -> Array:
        """Return a measure (m, q) of the stiffness of the undeformed material at every point.

        `measure` maps tensors dP/dF (k, 3, 3, 3, 3), Pa, to numbers (k,).
        """
        found = np.empty(int(np.prod(self.shape)))
        eye = np.eye(3)[None]
        for some, law in self._blocks_with_laws(found.size):
            found[some] = measure(law.dPdF(np.broadcast_to(eye, (len(found[some]), 3, 3))))
        return found.reshape(self.shape)

    def _evaluate_by_blocks(self, name: str, F: Array, tail: tuple[int, ...]) -> Array:
        """Return the results of the method `name` of the law at F, evaluated block by block."""
        if len(F) not in (1, int(np.prod(self.shape))):
            raise ValueError(f"{len(F)} deformation gradients for constants at {self.shape} points")
        out = np.empty((len(F), *tail), dtype=result_dtype(F))
        for some, law in self._blocks_with_laws(len(F)):
            out[some] = getattr(law, name)(F[some])
        return out

    def _blocks_with_laws(self, count: int) -> Iterator[tuple[slice, Any]]:
        flat = map_arrays(self.law, np.ravel)
        for start in range(0, count, BLOCK):
            some = slice(start, min(start + BLOCK, count))
            yield some, map_arrays(flat, lambda a, some=some: a[some])  # type: ignore[misc]


def average_moduli(material: Isotropic, w: Array) -> Isotropic:
    """Return a material whose two moduli are cell means (m, 1) of those of a sampled material.

    w (m, q) are the weights of q points in m cells. For laws linear in their moduli and a uniform deformation in each
    cell, the integral of the energy is the same.
    """
    mu, lam = (_weighted_cell_mean(a, w) for a in (material.shear_modulus, material.lame_lambda))
    each = {"young": mu * (3.0 * lam + 2.0 * mu) / (lam + mu), "poisson": 0.5 * lam / (lam + mu)}
    return with_constants(material, each)


def with_constants(material: Isotropic, new: dict[str, Any]) -> Isotropic:
    """Return the material with some constants replaced by their new values, given by name in `new`.

    A material may wrap a law or a solid; constants that belong to the wrapped object are replaced there.
    """
    own = vars(material)
    if "law" in own and (its := {name: value for name, value in new.items() if name not in own}):
        rest: Any = {name: value for name, value in new.items() if name in own}
        return replace(material, **rest | {"law": with_constants(own["law"], its)})
    of = getattr(material, "of", None)
    more: Any = {} if of is None else {"of": with_constants(of, new)}
    return replace(material, **new, **more)


def _weighted_cell_mean(a: Array | float, w: Array) -> Array:
    mean: Array = (np.broadcast_to(a, w.shape) * w).sum(axis=1, keepdims=True) / w.sum(axis=1, keepdims=True)
    return mean
