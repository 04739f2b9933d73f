"""What cannot be of materials whose constants vary in space."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.problem.body_case import Case, Fault, case_for, case_of, fault
from softmark.interpreter.problem.representative_constants import looked, profiles


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


def faults(case: Case) -> Iterator[Fault]:
    """Constants that are out of their range somewhere in the body, as far as a look at some places tells."""
    for i, material in enumerate(case.materials):
        for profile in profiles(material).values():
            seen = ((p, v) for p, v in looked(profile, case.shape) if not allowed(profile, v) and _within(case, i, p))
            worst = max(seen, key=lambda found: abs(found[1]) if math.isfinite(found[1]) else math.inf, default=None)
            if worst is not None:
                yield out_of_range(case, profile, worst[1], worst[0])


def _within(case: Case, number: int, place: Any) -> bool:
    """Whether a place is of the material of this number, as far as coordinates tell: groups of files are left out."""
    if case.shape.bounds is None:
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
    where = units.format_vector(tuple(float(c) for c in place), units.LENGTH)
    shown = units.format_value(value, profile.dimension) if math.isfinite(value) else "not a number"
    limits = "a number" if profile.limits is None else profile.limits.words(profile.dimension)
    return fault(
        "E327", profile.at, f"`{profile.name}` must be {limits} all over `{case.body.name}`",
        f"it is {shown} at {where}",
        f"coordinates are those before deformation; bound it, as in `{profile.name} = max(..., ...)`",
    )  # fmt: skip


def unsound(scene: Scene) -> Iterator[Diagnostic]:
    """Constants that are out of their range somewhere in a body."""
    for body in scene.of_kind("body"):
        yield from (found.diagnostic for found in faults(case_of(scene, body)))


def untaken(scene: Scene) -> Iterator[Diagnostic]:
    """Models that know a material that is the same everywhere alone; references say so themselves."""
    for model in scene.asked("model").values():
        if model.thing.graded:
            continue
        try:
            case = case_for(scene, model)
        except Fault:
            continue
        if any(profiles(material) for material in case.materials):
            yield diagnostic("E328", model.at(),
                             f"`{model.name}` knows a material that is the same everywhere, and {varying(case)} in"
                             " space",
                             "one value of each constant",
                             "use `fem(...)`, which takes every constant at its points of integration")  # fmt: skip
