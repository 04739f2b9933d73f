"""What every metric says."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from softmark.interpreter.metrics.undefined_metric import Undefined

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.metrics.curve_geometry import Course
    from softmark.interpreter.metrics.measurement import Measurement, Seen
    from softmark.interpreter.results.reaction_results import AtRest

    Floats = NDArray[np.float64]

When = Literal["end", "largest", "mean"]
WHEN = "in a motion: its value at the end, the largest of all times, or the mean over time"


class Metric:
    """A number of an answer; what it looks at are its fields `probe` and `against`, where it has them."""

    last: ClassVar[bool] = False  # whether it looks at the last point of its probe alone
    followed: ClassVar[bool] = False  # whether it has values over time in a motion, beside that of its end
    of_all_states: ClassVar[bool] = False  # whether it is of the way through all states: expected of the last alone

    @property
    def unit(self) -> str:
        """Of its value."""
        raise NotImplementedError(f"{type(self).__name__} has no unit")

    @property
    def uncertain(self) -> bool:
        """Whether an uncertainty of the reference, in m, bounds it."""
        return False

    @property
    def looked_at(self) -> str | None:
        """Its probe; None of one about the computation itself."""
        return vars(self).get("probe")

    @property
    def concerned(self) -> str | None:
        """The declaration whose body it is about, if not a probe: a support, a load, a body; None of all bodies."""
        return vars(self).get("body")

    def body_in(self, scene: Scene) -> str | None:
        """The body that it is about; None of all."""
        if (name := self.looked_at or self.concerned) is None:
            return None
        declared = scene.declared[name]
        return name if declared.kind == "body" else vars(declared.thing).get("body")

    def probe_in(self, scene: Scene) -> str | None:
        """The probe at which its number is found, whichever metric looks there; None of one without any."""
        return self.looked_at

    @property
    def measured_from(self) -> str | None:
        """The reference or model that it is an error from."""
        return vars(self).get("against")

    @property
    def in_time(self) -> bool:
        """Whether it has a value at each time of a motion: it is followed, an error of nothing and not of all times."""
        return False

    @property
    def summed_by(self) -> str:
        """What of the values at its points it is."""
        return "max"

    @property
    def direction(self) -> tuple[float, float, float] | None:
        """The one direction that it looks along."""
        return None

    def measure(self, seen: Seen) -> Measurement:
        """Its value, and what else it knows. Raises Undefined, with a reason, where it has none."""
        raise NotImplementedError(f"{type(self).__name__} measures nothing")


class OfForces(Metric):
    """One that is made of what a state of rest says of forces; against another model it is relative to that."""

    natural: ClassVar[str]  # the unit of its value
    followed: ClassVar[bool] = True
    extreme: ClassVar[str] = "largest"  # or `least`: which of its values in a motion is the one to know
    of_surface: ClassVar[bool] = False  # whether it is told of the surface in contact, which is not kept of every step

    @property
    def in_time(self) -> bool:
        """Whether it has a value at each time of a motion."""
        return self.followed and self.measured_from is None and self.when == "end"

    @property
    def when(self) -> str:
        """Which of its values in a motion it is: `end`, `largest` or `mean`."""
        return str(vars(self).get("over", "end"))

    @property
    def unit(self) -> str:
        """Of its value: a plain number where it is an error."""
        return self.natural if self.measured_from is None else "1"

    def amount(self, rest: AtRest) -> Floats:
        """A number (), or a vector of which it is a component (3,), in its natural unit. Raises Undefined."""
        raise NotImplementedError(f"{type(self).__name__} has no value")

    def measure(self, seen: Seen) -> Measurement:
        """Its value, or how far it is from that of another model, relative to its size. Raises Undefined."""
        from softmark.interpreter.metrics.measurement import Measurement

        own = self._known(seen.at_rest)
        if self.measured_from is None:
            course = self.course(seen.at_rest)
            details = self.details(own) | ({} if course is None else self._farthest(course))
            off = None if seen.at_rest is None or seen.at_rest.off is None else seen.at_rest.off * abs(self._along(own))
            return Measurement(self._along(own), details, uncertainty=off, curve=course)
        rest = None if seen.known is None else seen.known.at_rest
        right = self._right(rest)
        if (size := self.size(right)) == 0.0:
            raise Undefined(f"that of `{self.measured_from}` is zero, so nothing is relative to it")
        off = None if rest is None else rest.off
        return Measurement(abs(self._along(own) - self._along(right)) / size, uncertainty=off)

    def _right(self, rest: AtRest | None) -> Floats:
        """What is taken as right. Raises Undefined where that does not say it, whatever our models would say."""
        nothing = Undefined(f"`{self.measured_from}` tells nothing of it")
        try:
            right = self._known(rest)
        except Undefined:
            if rest is None or rest.reason is not None:
                raise
            raise nothing from None
        if math.isnan(self.size(right)):
            raise nothing
        return right

    def size(self, value: Floats) -> float:
        """What an error is relative to: of a vector its size, whatever component is looked at."""
        return math.sqrt(float((value**2).sum()))

    def apart(self, rest: AtRest | None, right: AtRest | None) -> float:
        """How far it is from that of a solution taken as right: of vectors all components, for one may agree by chance.

        In its unit, so that it is relative where it is an error. Raises Undefined.
        """
        far = self.distance(*(self._sound(known) for known in (rest, right)))
        if self.measured_from is None:
            return far
        if (size := self.size(self._known(right))) == 0.0:
            raise Undefined(f"that of `{self.measured_from}` is zero, so nothing is relative to it")
        return far / size

    def distance(self, rest: AtRest, right: AtRest) -> float:
        """The same in its natural unit. Raises Undefined."""
        return self.size(self._chosen(rest) - self._chosen(right))

    def extent(self, rest: AtRest | None) -> float:
        """What a relative error of it is multiplied by, in its unit. Raises Undefined."""
        return self.size(self._known(rest)) if self.measured_from is None else 1.0

    def at_points(self, X: Floats) -> OfForces:
        """The same of points X (n, 3), m, of its probe, where it has one."""
        return self

    def acting(self, rest: AtRest) -> float:
        """What of its kind there is in the whole body, in its natural unit: rounding leaves a part of that."""
        return 0.0

    def details(self, value: Floats) -> dict[str, Any]:
        """What a report has beside the value."""
        return {}

    def _along(self, value: Floats) -> float:
        if self.direction is None:
            return float(value)
        return sum(float(v) * d for v, d in zip(value, self.direction, strict=True) if d)  # a theory may not know all

    def course(self, rest: AtRest | None) -> Course | None:
        """Its values over time, in motion; None at rest. Raises Undefined."""
        if (known := self._sound(rest)).followed is None:
            return None
        from softmark.interpreter.metrics.contact_histories import course

        return course(self, known.followed)

    def _farthest(self, course: Course) -> dict[str, Any]:
        """What a report has besides, of a motion: its largest value, or least, and when that is."""
        at = int((course.y if self.extreme == "least" else -abs(course.y)).argmin())
        unit = course.units[1]
        return {f"{self.extreme}_in_time_{unit}": float(course.y[at]), f"{self.extreme}_at_s": float(course.x[at])}

    def _known(self, rest: AtRest | None) -> Floats:
        return self._chosen(self._sound(rest))

    def _chosen(self, rest: AtRest) -> Floats:
        """What it is of, of a motion at the time that counts. Raises Undefined."""
        if rest.followed is None or self.when == "end":
            return self.amount(rest)
        from softmark.interpreter.metrics.contact_histories import chosen

        return chosen(self, rest.followed)

    def _sound(self, rest: AtRest | None) -> AtRest:
        if rest is None:
            raise Undefined("a reference has no forces")
        if not rest.knows(self.concerned):
            raise Undefined(rest.reason or "")
        return rest


class OfMetric(Metric):
    """One of what another metric, `of`, comes to, relative to what that is held against."""

    if TYPE_CHECKING:
        of: str

    @property
    def unit(self) -> str:
        """Of its value, which is relative."""
        return "1"

    @property
    def concerned(self) -> str:
        """The other metric."""
        return self.of

    def body_in(self, scene: Scene) -> str | None:
        """That of the other metric."""
        body: str | None = scene.declared[self.of].thing.body_in(scene)
        return body


class OfDisplacements(Metric):
    """One that is made of displacements at points, and of nothing else."""

    def value(self, X: Floats, u: Floats, reference: Any) -> float:
        """Of material points X (n, 3) and displacements u (n, 3), m, and those of the reference, if it has one."""
        raise NotImplementedError(f"{type(self).__name__} has no value")

    def measure(self, seen: Seen) -> Measurement:
        """Its value. Raises Undefined where the reference has no displacements."""
        from softmark.interpreter.metrics.measurement import Measurement

        if self.measured_from and (seen.known is None or seen.known.u is None):
            raise Undefined(f"the reference `{self.measured_from}` has no displacements there")
        return Measurement(float(self.value(seen.X, seen.u, seen.known.u if seen.known else None)))
