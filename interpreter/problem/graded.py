"""Materials whose constants vary in space: what is known of them before anything is built."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

from softmark.interpreter.language import units
from softmark.interpreter.language.profiles import Profile
from softmark.interpreter.language.scene import Declared
from softmark.interpreter.problem.case import Case, Fault, fault
from softmark.solvers.materials.isotropic import constants

ALONG = 9  # places along each axis of the body's box that are looked at before anything is built
ORDINARY = 0.3  # Poisson's ratio
UNKNOWN = {"young": 1e30, "poisson": 0.0, "density": 1000.0}  # of what only files tell: nothing is doubted of it


def profiles(material: Any) -> dict[str, Profile]:
    """The constants of a material that vary in space, by their names."""
    return {name: value for name, value in constants(material).items() if isinstance(value, Profile)}


def varying(case: Case) -> str:
    """Which constants of any of its materials vary, in words: "`young` and `density` of `bar` vary"."""
    names = dict.fromkeys(f"`{name}`" for material in case.materials for name in profiles(material))
    return f"{' and '.join(names)} of `{case.body.name}` {'varies' if len(names) == 1 else 'vary'}"


def must_be_uniform(reference: Declared, case: Case) -> None:
    """Raises Fault for a theory of bodies that are the same everywhere, of one that is not."""
    if case.uniform or reference.thing.graded:
        return
    raise fault(
        "E329", reference.at(),
        f"`{reference.name}` is solved for one value of each constant, and {varying(case)} in space",
        "one value of each constant",
        "compare with what was measured or published, or with a finer model: `self_converged(...)`; `graded_bar(...)`"
        " knows a bar that varies along its axis",
    )  # fmt: skip


def typical(case: Case, material: Any) -> Any:
    """A material with numbers in place of what varies: means over the body's box, of Poisson's ratio the largest.

    For what is said of it before anything is built, and for orders of magnitude. One of constant numbers is itself.
    """
    new: dict[str, float] = {}
    for name, profile in profiles(material).items():
        seen = [v for _, v in _looked(case, profile) if math.isfinite(v)]
        if not seen:
            new[name] = UNKNOWN[name]
        else:
            most = max(seen)  # above its range, which is said, it stands for a solid like others
            largest = max(-0.999, most if most <= 0.5 else ORDINARY)
            new[name] = largest if name == "poisson" else abs(math.fsum(seen)) / len(seen)
    if not new:
        return material
    of = getattr(material, "of", None)
    return replace(material, **new, **({} if of is None else {"of": replace(of, **new)}))


def _looked(case: Case, profile: Profile) -> Iterator[tuple[tuple[float, ...], float]]:
    """Places of the body's box, and the constant there."""
    if case.shape.bounds is None or profile.fields:
        return
    low, high = case.shape.bounds
    axes = ([a + (b - a) * i / (ALONG - 1) for i in range(ALONG)] for a, b in zip(low, high, strict=True))
    for place in product(*axes):
        yield place, profile.value(place)


def faults(case: Case) -> Iterator[Fault]:
    """Constants that are out of their range somewhere in the body, as far as a look at some places tells."""
    for i, material in enumerate(case.materials):
        for profile in profiles(material).values():
            seen = ((p, v) for p, v in _looked(case, profile) if not allowed(profile, v) and _within(case, i, p))
            worst = max(seen, key=lambda found: abs(found[1]) if math.isfinite(found[1]) else math.inf, default=None)
            if worst is not None:
                yield out_of_range(case, profile, worst[1], worst[0])


def _within(case: Case, number: int, place: Any) -> bool:
    """Whether a place is of the material of this number, as far as coordinates tell: groups of files are left out."""
    if not case.shape.contains(place) or case.shape.bounds is None:
        return False
    extent = math.dist(*case.shape.bounds)
    for i, part in enumerate(case.parts, start=1):
        where = part.thing.where
        if where.groups:
            return False
        if bool(where.holds(*place, extent)) != (i == number):
            return False
    return True


def allowed(profile: Profile, value: float) -> bool:
    """Whether a value is one that the constant may have."""
    return math.isfinite(value) and (profile.limits is None or value in profile.limits)


def out_of_range(case: Case, profile: Profile, value: float, place: Any) -> Fault:
    """A Fault of a constant that has no value at a place, or one that it must not have."""
    where = units.show_all(tuple(float(c) for c in place), units.LENGTH)
    shown = units.show(value, profile.dimension) if math.isfinite(value) else "not a number"
    limits = "a number" if profile.limits is None else profile.limits.words(profile.dimension)
    return fault(
        "E327", profile.at, f"`{profile.name}` must be {limits} all over `{case.body.name}`",
        f"it is {shown} at {where}",
        f"coordinates are those before deformation; bound it, as in `{profile.name} = max(..., ...)`",
    )  # fmt: skip
