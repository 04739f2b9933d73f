"""Materials with a representative number for each varying constant, for checks before models are built."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from typing import Any

from softmark.interpreter.language.spatial_profiles import Profile
from softmark.solvers.materials.heterogeneous import with_constants
from softmark.solvers.materials.isotropic_material import constants
from softmark.solvers.mesh.boolean_shapes import file_stamp

ALONG = 9  # sample points along each axis of a body's box
ORDINARY = 0.3  # Poisson's ratio
UNKNOWN = {
    "young": 1e30,
    "poisson": 0.0,
    "density": 1000.0,
    "tension": 1000.0,
    "shortening": 0.0,
}  # defaults for values known only from files


def profiles(material: Any) -> dict[str, Profile]:
    """Return the varying constants of a material by name."""
    return {name: value for name, value in constants(material).items() if isinstance(value, Profile)}


def representative_material(material: Any, shape: Any) -> Any:
    """Return a material with numbers for varying constants: means over the body, but the largest Poisson's ratio.

    It is used for orders of magnitude before anything is built. A uniform material is returned unchanged.
    """
    new: dict[str, float] = {}
    for name, profile in _varying_constants_of_all_laws(material).items():
        seen = [v for _, v in sample_constant(profile, shape) if math.isfinite(v)]
        if not seen:
            new[name] = UNKNOWN[name]
        else:
            most = max(seen)  # out of range (reported elsewhere): use an ordinary value
            largest = max(-0.999, most if most <= 0.5 else ORDINARY)
            new[name] = largest if name == "poisson" else abs(math.fsum(v / len(seen) for v in seen))
    return with_constants(material, new) if new else material


def _varying_constants_of_all_laws(material: Any) -> dict[str, Profile]:
    """Return the varying constants of a material and of the laws within it, by name.

    Laws of muscle may not vary. That is reported separately (E367), and other checks must not fail because of it.
    """
    within = vars(material).get("law")
    return (_varying_constants_of_all_laws(within) if hasattr(within, "varying") else {}) | profiles(material)


def sample_constant(profile: Profile, shape: Any) -> Iterator[tuple[tuple[float, ...], float]]:
    """Yield sample points of a body, m, with the value of a constant there; nothing if only a file has the values."""
    if shape.bounds is None or profile.fields:
        return
    yield from _sampled_values(profile, shape, file_stamp(shape))


# Several checks need each constant, and again after edits elsewhere in the scene.


@lru_cache(maxsize=32)
def _sampled_values(profile: Profile, shape: Any, files: Any) -> tuple[tuple[tuple[float, ...], float], ...]:
    return tuple((place, profile.value(place)) for place in _sample_points(shape, files))


@lru_cache(maxsize=16)
def _sample_points(shape: Any, files: Any) -> tuple[tuple[float, ...], ...]:
    axes = ([a + (b - a) * i / (ALONG - 1) for i in range(ALONG)] for a, b in zip(*shape.bounds, strict=True))
    return tuple(place for place in product(*axes) if shape.contains(place))
