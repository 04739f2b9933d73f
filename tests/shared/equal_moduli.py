"""Materials with the same two moduli at rest, whatever constants their laws have."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from softmark.solvers.materials import MATERIALS, Isotropic

# constants of laws that have their own, by the shear modulus
CONSTANTS: dict[str, Callable[[Any], dict[str, Any]]] = {
    "mooney_rivlin": lambda mu: {"c1": 0.3 * mu, "c2": 0.2 * mu},
    "ogden": lambda mu: {"mu": (0.9 * mu, 0.2 * mu, -0.066 * mu), "alpha": (1.3, 2.5, -5.0)},
    "yeoh": lambda mu: {"c1": 0.5 * mu, "c2": -0.02 * mu, "c3": 0.01 * mu},
    "gent": lambda mu: {"mu": mu, "limit": 30.0},
    "arruda_boyce": lambda mu: {"m": mu / CHAINS, "limit": 2.8},
    "fung": lambda mu: {"mu": mu, "b": 0.4},
    "veronda_westmann": lambda mu: {"c": mu / 1.6, "a": 1.6},
}
CHAINS = 1.0 + 3.0 / (5.0 * 2.8**2) + 99.0 / (175.0 * 2.8**4) + 513.0 / (875.0 * 2.8**6) + 42039.0 / (67375.0 * 2.8**8)


def made(name: str, young: Any, poisson: Any, density: Any = 1.0, **more: Any) -> Isotropic:
    """A material by its word, of a Young's modulus in Pa and a Poisson's ratio at rest, and a density in kg/m^3."""
    if name not in CONSTANTS:
        assert "young" in MATERIALS[name].__dataclass_fields__, f"add the constants of `{name}` to CONSTANTS"
        return MATERIALS[name](young, poisson, density)
    constants: Any = CONSTANTS[name](young / (2.0 * (1.0 + poisson)))
    return MATERIALS[name](**constants, poisson=poisson, density=density, **more)
