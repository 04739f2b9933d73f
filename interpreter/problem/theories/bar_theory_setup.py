"""Setup of the theory of an axially loaded bar whose material constants vary along the bar."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Any

from softmark.interpreter.language.compiled_scene import Declared
from softmark.interpreter.language.spatial_profiles import Profile
from softmark.interpreter.problem.body_case import Case
from softmark.interpreter.problem.cross_section_coverage import end_frame, single_selected_end
from softmark.interpreter.problem.theories.theory_setup import TheorySetup
from softmark.interpreter.vocabulary.loads.body_force import BodyForce
from softmark.interpreter.vocabulary.loads.surface_traction import SurfaceTraction
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport
from softmark.references.graded_bar import PulledBar
from softmark.references.straight_cantilever import NotApplicable
from softmark.solvers.mesh.shape import Prism, add_multiples, cross, dot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Floats = Any  # (n,) of numpy, which is not imported where a scene is checked

ALIGNED = 1e-9  # relative tolerance off the axis
SAME = 1e-9  # relative to a constant: how far its values across a section may differ
STATIONS = 33  # sections at which that is looked at
REMEDY = "hold one end face and pull the other: `fixed(...)` and `traction(...)`, or gravity along the axis"


class BarSetup(TheorySetup):
    """Makes the problem of a bar under axial load, whose material constants may vary along the bar."""

    def problem_from(self, reference: Declared, case: Case) -> PulledBar:
        shape = case.shape
        if not isinstance(shape, Prism):
            raise NotApplicable(
                f"`{case.body.name}` is not a straight body with one cross-section", "use a box, a cylinder or a tube"
            )
        if case.parts:
            raise NotApplicable(f"the region `{case.parts[0].name}` has another material",
                          "use one material that varies: `young = ...`")  # fmt: skip
        held = _held_end(case)
        root, axis = end_frame(shape, held)
        material = case.material
        if isinstance(material.poisson, Profile):
            raise NotApplicable("its Poisson's ratio varies", "use `poisson = 0`: otherwise the stress is not uniaxial")
        young, density = (_constant_along_axis(case, c, root, axis) for c in (material.young, material.density))
        force, pull = _end_loads(case, 1 - held, axis)
        area = shape.section.area
        return PulledBar(shape.length, area, root, axis, force * area, pull, young, density, material.poisson)


def _held_end(case: Case) -> int:
    """Return the number of the end that is held along the axis: 0 the root, 1 the tip. Raises NotApplicable."""
    shape, found = case.prism, set()
    for support in case.supports:
        thing = support.thing
        free = [abs(shape.axis[c]) <= ALIGNED for c in thing.components]
        if not isinstance(thing, DisplacementSupport) or thing.moves:
            raise NotApplicable(f"the support `{support.name}` moves the body", REMEDY)
        if all(free):
            continue  # without lateral contraction nothing moves across
        if (end := single_selected_end(thing.where, shape)) is None:
            raise NotApplicable(f"the support `{support.name}` does not cover one whole end face", REMEDY)
        found.add(end)
    if len(found) != 1:
        raise NotApplicable("no end is held along the axis" if not found else "both ends are held", REMEDY)
    return found.pop()


def _end_loads(case: Case, free: int, axis: Any) -> tuple[float, float]:
    """Return the axial traction on the free end, Pa, and the axial acceleration of gravity, m/s^2.

    `free` is the number of the free end. Raises NotApplicable for other loads and for lateral components.
    """
    force, pull = 0.0, 0.0
    for load in case.loads:
        match load.thing.action:
            case SurfaceTraction(where=where, traction=traction):
                if single_selected_end(where, case.prism) != free:
                    raise NotApplicable(f"the load `{load.name}` does not act on exactly the whole free end", REMEDY)
                force += _axial_component(load, traction, axis)
            case BodyForce(acceleration=g):
                pull += _axial_component(load, g, axis)
            case _:
                raise NotApplicable(f"the load `{load.name}` is neither a traction nor gravity", REMEDY)
    return force, pull


def _axial_component(load: Declared, vector: Any, axis: Any) -> float:
    """Return the component of a load's vector along the axis. Raises NotApplicable if it has a lateral component."""
    if math.hypot(*cross(vector, axis)) > ALIGNED * math.hypot(*vector):
        raise NotApplicable(f"the load `{load.name}` does not act along the axis", REMEDY)
    return float(dot(vector, axis))


def _constant_along_axis(case: Case, constant: Any, root: Any, axis: Any) -> Callable[[Floats], Floats]:
    """Return a material constant as a function of the distance from the held end, m: arrays (n,) to arrays (n,).

    Files with values are read only when the function is first called. Raises NotApplicable if the constant varies
    over a cross-section.
    """
    if not isinstance(constant, Profile):
        return lambda s: s * 0.0 + float(constant)
    if not constant.fields:
        for along, across in _section_sample_points(case.prism, root, axis):
            _require_uniform_over_section(constant, constant.value(along), [constant.value(place) for place in across])
        return lambda s: constant.values(_axis_points(s, root, axis), None)

    @cache
    def read() -> Any:
        """Return the function that reads a file of field values, after checking each section. Raises NotApplicable."""
        from softmark.interpreter.problem.field_files import read_field

        for along, across in _section_sample_points(case.prism, root, axis):
            own, *others = constant.values([along, *across], read_field)
            _require_uniform_over_section(constant, own, others)
        return read_field

    return lambda s: constant.values(_axis_points(s, root, axis), read())


def _axis_points(s: Floats, root: Any, axis: Any) -> Any:
    """Return the points of the axis (n, 3), m, at distances s (n,), m, from the root."""
    import numpy as np

    return np.array(root) + s[:, None] * np.array(axis)


def _section_sample_points(shape: Any, root: Any, axis: Any) -> Iterator[tuple[Any, list[Any]]]:
    """Yield points along the axis, m, each with a list of other points of its cross-section, m."""
    _, first, second = shape.frame(0.0)
    for i in range(STATIONS):
        middle = add_multiples(root, (shape.length * i / (STATIONS - 1), axis))
        yield middle, [add_multiples(middle, (u, first), (v, second)) for u, v in shape.section.samples()]


def _require_uniform_over_section(constant: Profile, own: float, others: list[float]) -> None:
    """Raise NotApplicable if a constant varies over a cross-section.

    `own` is its value on the axis, and `others` are its values at other points of the section.
    """
    if not all(abs(other - own) <= SAME * abs(own) for other in others):
        raise NotApplicable(
            f"its `{constant.name}` varies over the cross-section", "use a constant that varies along the axis only"
        )
