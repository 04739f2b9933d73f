"""Errors about materials whose constants vary in space."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.problem.body_case import Case, Fault, case_of, fault
from softmark.interpreter.problem.representative_constants import profiles, sample_constant


def describe_varying(case: Case) -> str:
    """Return text that names the varying constants of a case: "`young` and `density` of `bar` vary"."""
    names = dict.fromkeys(f"`{name}`" for material in case.materials for name in profiles(material))
    return f"{' and '.join(names)} of `{case.body.name}` {'varies' if len(names) == 1 else 'vary'}"


def must_be_uniform(reference: Declared, case: Case) -> None:
    """Refuse a theory of uniform bodies for a body with varying constants. Raises Fault."""
    if case.uniform or reference.thing.supports_varying_constants:
        return
    raise fault(
        "E329", reference.at(),
        f"`{reference.name}` assumes one value of each constant, but {describe_varying(case)} in space",
        "one value of each constant",
        "compare with measured or published data, or with a finer model, `self_converged(...)`; for a bar that "
        "varies along its axis use `graded_bar(...)`",
    )  # fmt: skip


def out_of_range_faults(case: Case) -> Iterator[Fault]:
    """Yield Faults for constants that are out of range at sample points of the body."""
    for i, material in enumerate(case.materials):
        for profile in profiles(material).values():
            seen = (
                (p, v)
                for p, v in sample_constant(profile, case.shape)
                if not is_allowed(profile, v) and _has_material(case, i, p)
            )
            worst = max(seen, key=lambda found: abs(found[1]) if math.isfinite(found[1]) else math.inf, default=None)
            if worst is not None:
                yield out_of_range_fault(case, profile, worst[1], worst[0])


def _has_material(case: Case, number: int, place: Any) -> bool:
    """Return whether a point has the material with this number, by the coordinates only.

    Groups of mesh files are ignored.
    """
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


def is_allowed(profile: Profile, value: float) -> bool:
    """Return whether a value of the constant is in its allowed range."""
    return math.isfinite(value) and (profile.limits is None or value in profile.limits)


def out_of_range_fault(case: Case, profile: Profile, value: float, place: Any) -> Fault:
    """Return the Fault for a constant that has no value, or a forbidden value, at a place."""
    where = units.format_vector(tuple(float(c) for c in place), units.LENGTH)
    shown = units.format_value(value, profile.dimension) if math.isfinite(value) else "not a number"
    limits = "a number" if profile.limits is None else profile.limits.words(profile.dimension)
    return fault(
        "E327", profile.at, f"everywhere in `{case.body.name}`, `{profile.name}` must be {limits}",
        f"it is {shown} at {where}",
        f"bound it, as in `{profile.name} = max(..., ...)`; coordinates are those before deformation",
    )  # fmt: skip


def check_ranges(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of constants that are out of range at sample points of a body."""
    for body in scene.of_kind("body"):
        yield from (found.diagnostic for found in out_of_range_faults(case_of(scene, body)))
