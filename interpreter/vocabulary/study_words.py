"""Studies: what is varied, and what is asked of the variations. `dsl compare` and `dsl stress` carry them out."""

from __future__ import annotations

from typing import Annotated, Literal

from softmark.interpreter.language.sweep_values import SweepTarget, Variant
from softmark.records import dataclass


@dataclass(frozen=True)
class Sweep:
    """Computes the scene once for each value of a parameter or of a field.

    `sweep(h, over = [10, 5, 2.5] mm)` varies the parameter `h`; `sweep(rod.segments, over = [5, 10, 20])` a field of a
    declared name, whether the declaration gives it or leaves it at its default. Values are what could stand there:
    quantities, choices (`[implicit_euler, newmark]`), calls. Each is checked as if it were written in its place. A unit
    behind the bracket is that of every item without one.

    `with` another sweep, every value of the one is combined with every value of the other. A model that does not
    depend on what is varied is computed once. A sweep of a load, a length or a material changes what errors are
    measured from: configurations then compete value by value, each with a front of its own.

    `dsl compare` carries studies out, and `dsl run` leaves them alone.
    """

    target: Annotated[SweepTarget, "target", "what is varied: a parameter, or a field of a declared name"]
    over: Annotated[tuple[Variant, ...], "variants", "the values that it takes"]
    models: Annotated[tuple[str, ...] | None, "models", "which models are computed; all of the scene without"] = None
    with_: Annotated[str | None, "study", "another sweep, each of whose values is combined with each of these"] = None


@dataclass(frozen=True)
class Convergence:
    """Asks how fast a metric settles as a sweep refines: observed order, extrapolated value, grid convergence index.

    The sweep has one target, whose values are at least three numbers. Richardson (1911) extrapolation and the index
    follow Roache (1994) and Celik et al. (2008).
    """

    metric: Annotated[str, "metric", "the number that should settle"]
    over: Annotated[str, "study", "the sweep that refines"]


@dataclass(frozen=True)
class Pareto:
    """Asks which configurations of a sweep no other beats in both error and cost.

    A configuration is on the front if none has a smaller error at the same or a smaller cost. Without `cost` it is the
    measured time: of a step in a dynamic analysis, of the whole solution otherwise.
    """

    error: Annotated[str, "metric", "how wrong a configuration is"]
    cost: Annotated[str | None, "metric", "what it costs; the measured time without"] = None
    over: Annotated[str | None, "study", "the sweep; everything that is compared without"] = None


@dataclass(frozen=True)
class Stability:
    """Walks quantities outward from the scene as it is, to the edge of what each model gets right.

    One quantity at a time, everything else as declared: `over = [rubber.poisson, tip.vector, slenderness, coarse.size]`
    names fields of declared things and parameters, as a sweep does. Poisson's ratio goes towards 0.5 by decades of what
    is missing, down to 1e-9 and exactly 0.5; positive numbers by factors (stiffness 12 decades, loads up to 1000 times,
    densities and time steps over 6); whole numbers by doubling; choices through all of theirs; vectors are multiplied.
    A parameter with a range goes to its ends, one that is zero by decades of the range. Each edge is then found by
    bisection, to a ratio of 1.2.

    A closed form that is written in the scene judges as well: `value_error` against `values` of `kind = theory` that
    are an expression of parameters. These and fields of models can be walked: values do not follow a material's.

    Every point is judged by `metric`, a relative error, against the reference that it names, which is solved anew at
    each: `right` within `within` and the uncertainty of the reference; `inaccurate` where the model itself says that it
    may be that far off, by the error that it states or a warning about its accuracy; `silent` where it does not: a
    point that looks right and is wrong. Others are `not_converged`, `diverged`, `refused` by a diagnostic, `failed`,
    `timed_out`, and `unjudged` where the reference has no answer, or is a theory of beams far outside its range.

    `until = failure` goes on through inaccurate points until the model has no answer, `inaccuracy` ends at the first
    that is not right. `maps = pairs` adds a coarse grid for each pair of quantities and each model; so does `auto`
    where there are at most three. `dsl stress` carries it out, and makes one over every number of a scene without one.
    """

    over: Annotated[tuple[SweepTarget, ...] | None, "targets", "what is walked; every number that can be, without"] = (
        None
    )
    until: Annotated[Literal["failure", "inaccuracy"], "where a walk ends"] = "failure"
    models: Annotated[tuple[str, ...] | None, "models", "which models are walked; all of the scene without"] = None
    metric: Annotated[str | None, "metric", "the relative error that judges; the first of the scene without"] = None
    within: Annotated[float, "1 in (0, 1)", "the error that still counts as right"] = 0.05
    maps: Annotated[Literal["auto", "none", "pairs"], "which pairs of quantities are mapped"] = "auto"
