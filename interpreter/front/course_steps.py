"""Whether the time step of a scene shows the courses of its loads and supports; both are in the text.

Loads enter as their exact means over each step, so that a short pulse has the right impulse; what swings faster than
steps follow is seen as something slower. Supports are held where they are at the ends of steps, and what they do
between two is not seen at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.vocabulary.analyses import Dynamic
from softmark.interpreter.vocabulary.courses import Pulse, Ramp, Sine, Smooth

if TYPE_CHECKING:
    from softmark.interpreter.problem.case import Case

SEEN = 4.0  # steps to a swing: with fewer, the step twice as long that states an error sees another swing
SHOWN = 10.0  # steps to a swing: with fewer, second-order integrators are off by more than 3 % of it
HELD = 2.0  # steps that a support is held elsewhere, at least
NEAR = 1e-6  # of a step: what begins and ends there does so with a step


def unresolved(scene: Scene) -> Iterator[Diagnostic]:
    """Courses that the step does not show: errors where what is computed would be another course, else warnings."""
    analysis = next((a.thing for a in scene.of_kind("analysis").values()), None)
    if not isinstance(analysis, Dynamic):
        return
    for declared in (*scene.of_kind("load").values(), *scene.of_kind("support").values()):
        course = declared.thing.course
        if course is None:
            continue
        if isinstance(course, Sine):
            yield from _swinging(declared, course, analysis.step)
        elif course.start >= analysis.duration:
            yield diagnostic("W378", declared.at("course"), f"`{declared.name}` begins after the end of the analysis",
                             f"at {_time(course.start)}, and the end is at {_time(analysis.duration)}",
                             "it plays no part; analyse a longer `duration`")  # fmt: skip
        elif declared.kind == "support":
            yield from _moved(declared, course, analysis.step)
        elif isinstance(course, Pulse) and _width(course) < analysis.step * (1.0 - NEAR):
            yield diagnostic("W378", declared.at("course"), f"the pulse of `{declared.name}` is shorter than a step",
                             f"{_time(_width(course))} of a step of {_time(analysis.step)}",
                             "its impulse is right, and so is what is slow; to see how it acts, take a step of"
                             f" {_time(_round(_width(course) / SHOWN))} or less")  # fmt: skip


def shows(case: Case, step: float) -> bool:
    """Whether steps of this length show every swing of a case's loads and supports."""
    things = [d.thing for d in (*case.loads, *case.supports)]
    swings = [t.course for t in things if isinstance(t.course, Sine)]
    return all(1.0 / (c.frequency * step) >= SEEN for c in swings)


def _swinging(declared: Declared, course: Sine, step: float) -> Iterator[Diagnostic]:
    count = 1.0 / (course.frequency * step)
    if count >= SHOWN * (1.0 - NEAR):
        return
    label = f"{count:.3g} steps of {_time(step)} to a swing of {_time(1.0 / course.frequency)}"
    better = _time(_round(1.0 / (SHOWN * course.frequency)))
    if count < SEEN:
        yield diagnostic("E381", declared.at("course"),
                         f"the step does not show the swings of `{declared.name}`", label,
                         "what is computed would be another, slower swing: take a step of"
                         f" {better} or less")  # fmt: skip
    else:
        yield diagnostic("W377", declared.at("course"), f"there are few steps to a swing of `{declared.name}`", label,
                         "its size and its phase are off by several percent: take a step of"
                         f" {better} or less")  # fmt: skip


def _moved(declared: Declared, course: Pulse | Ramp | Smooth, step: float) -> Iterator[Diagnostic]:
    """Of a support that moves: where it is between two steps plays no part."""
    if not isinstance(course, Pulse):
        if course.over < step * (1.0 - NEAR):
            yield diagnostic("W378", declared.at("course"), f"`{declared.name}` moves all the way within a step",
                             f"{_time(course.over)} of a step of {_time(step)}",
                             "how quickly it does is not seen: take a step of"
                             f" {_time(_round(course.over / SHOWN))} or less")  # fmt: skip
        return
    width = _width(course)
    if width < HELD * step * (1.0 - NEAR):
        yield diagnostic("E382", declared.at("course"), f"the step does not show the pulse of `{declared.name}`",
                         f"{width / step:.2g} steps of {_time(step)}",
                         "where a support is between two steps is not seen: take a step of"
                         f" {_time(_round(width / SHOWN))} or less")  # fmt: skip
    elif width < SHOWN * step and not (_whole(course.start / step) and _whole(course.until / step)):
        yield diagnostic("W378", declared.at("course"),
                         f"the pulse of `{declared.name}` begins or ends between two steps",
                         f"{width / step:.3g} steps of {_time(step)}",
                         "a support is moved for whole steps: take one that divides its times, or one of"
                         f" {_time(_round(width / SHOWN))} or less")  # fmt: skip


def _width(course: Pulse) -> float:
    """How long it acts, s."""
    return max(0.0, course.until - course.start)


def _whole(number: float) -> bool:
    return abs(number - round(number)) < NEAR


def _round(step: float) -> float:
    """Down to two digits."""
    if not step > 0.0:
        return step
    digit = 10.0 ** (math.floor(math.log10(step)) - 1)
    return float(f"{math.floor(step / digit * (1.0 + 1e-12)) * digit:.2g}")


def _time(t: float) -> str:
    return units.show(float(f"{t:.4g}"), units.TIME)
