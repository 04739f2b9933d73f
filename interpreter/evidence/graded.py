"""Constants that vary in space, looked up once more for the watchdog: by other code for what is read from images."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from softmark.interpreter.language.profiles import Profile
from softmark.interpreter.problem.case import Case
from softmark.interpreter.problem.field_files import Image, loaded, reading
from softmark.interpreter.vocabulary.fields import Field
from softmark.solvers.checks.solids import Floats

if TYPE_CHECKING:
    from collections.abc import Callable

    from softmark.interpreter.evidence.answer import Answer
    from softmark.interpreter.evidence.probe_answers import ProbeAnswer

LOOKED = 32  # points of each look-up at which arithmetic on arrays is done again, one by one
AGREE = 1e-12


def again(field: Field, X: Floats) -> Floats:
    """The values of a field at points X (n, 3), m: of an image by scipy's splines of degree one."""
    known = loaded(field)
    if not isinstance(known, Image):
        return reading(field, X)
    at = np.linalg.solve(np.linalg.inv(known.inverse), (X - known.centre).T)
    found: Floats = field.unit.value * ndimage.map_coordinates(known.numbers, at, order=1, mode="nearest")
    return found


def values(constant: Any, X: Floats) -> Floats:
    """A constant of a material at points X (n, 3), m: (n,). Raises ValueError where arithmetic is not one."""
    if not isinstance(constant, Profile):
        return np.full(len(X), float(constant))
    found: Floats = constant.values(X, again)
    if not constant.fields:
        some = np.linspace(0, len(X) - 1, min(LOOKED, len(X))).astype(int)
        plain = np.array([constant.value(tuple(map(float, X[i]))) for i in some])
        if not np.allclose(found[some], plain, rtol=AGREE, atol=0.0):
            raise ValueError(f"`{constant.name}` comes to other numbers one by one than all at once")
    return found


def constants_of(case: Case) -> Any:
    """What tells Young's modulus and Poisson's ratio of a case at points (n, 3)."""
    material = case.material
    return lambda X: (values(material.young, X), values(material.poisson, X))


def density_of(case: Case) -> Any:
    """A density, kg/m^3: a number, or what tells it at points (n, 3)."""
    rho = case.material.density
    return (lambda X: values(rho, X)) if isinstance(rho, Profile) else rho


def lost(whole: Answer) -> dict[str, Callable[[ProbeAnswer], float]]:
    """The part of the stated error that comes of integrals of constants over cells, where a finer rule finds others.

    A stiffness that is off by a share in every cell moves an answer by that share at most.
    """
    from softmark.interpreter.models.shared.pieces import lost as of_mesh

    mesh = None if whole.prepared is None else whole.prepared.mesh
    left = 0.0 if mesh is None else of_mesh(whole.case, mesh)
    return {"constants": lambda seen: left * seen.size} if left else {}
