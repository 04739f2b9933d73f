"""Studies: parameters to vary and questions about the results, for `dsl compare` and `dsl robustness`."""

from __future__ import annotations

from typing import Annotated, Literal

from softmark.interpreter.language.sweep_values import SweepTarget, Variant
from softmark.records import dataclass


@dataclass(frozen=True)
class Sweep:
    """Solves the scene once for each value of a parameter or a field.

    `sweep(h, over = [10, 5, 2.5] mm)` varies the parameter `h`. `sweep(rod.segments, over = [5, 10, 20])` varies a
    field of a declared name, whether it is given in the declaration or has its default. Values are anything that the
    field accepts: quantities, choices (`[implicit_euler, newmark]`), calls. Each value is checked as if it were written
    in the scene. A unit after the bracket applies to all items without a unit.

    `with` another sweep, all combinations of both are solved. A model that does not depend on the varied value is
    solved only once. A sweep of a load, a length or a material also changes the reference: configurations are then
    compared separately for each value, each with a Pareto front of its own.

    `dsl compare` runs studies; `dsl run` ignores them.
    """

    target: Annotated[SweepTarget, "target", "parameter, or field of a declared name, to vary"]
    over: Annotated[tuple[Variant, ...], "variants", "values to use"]
    models: Annotated[tuple[str, ...] | None, "models", "models to solve; default: all models of the scene"] = None
    with_: Annotated[str | None, "study", "another sweep to combine with: all pairs of values are solved"] = None


@dataclass(frozen=True)
class Convergence:
    """Observed order, extrapolated value and grid convergence index of a metric in a refinement sweep.

    The sweep has one target with at least three numeric values. The extrapolation (Richardson 1911) and the index
    follow Roache (1994) and Celik et al. (2008).
    """

    metric: Annotated[str, "metric", "metric that should converge"]
    over: Annotated[str, "study", "sweep that refines the model"]


@dataclass(frozen=True)
class Pareto:
    """Pareto front of a sweep: the configurations that no other one beats in both error and cost.

    A configuration is on the front if no other one has a smaller error at the same or a smaller cost. The default cost
    is the measured time: of one step in a dynamic analysis, of the whole solution otherwise.
    """

    error: Annotated[str, "metric", "error of a configuration"]
    cost: Annotated[str | None, "metric", "cost of a configuration; default: the measured time"] = None
    over: Annotated[str | None, "study", "sweep; default: all configurations that are compared"] = None


@dataclass(frozen=True)
class RobustnessStudy:
    """Robustness study: varies quantities one at a time, away from the scene's values, until each model fails.

    Everything else stays as declared. `over = [rubber.poisson, tip.vector, slenderness, coarse.size]` names parameters
    and fields of declared things, as in a sweep. Poisson's ratio approaches 0.5 in decades of the difference, down to
    1e-9 and then exactly 0.5. Positive numbers are multiplied and divided by factors (stiffness over 12 decades, loads
    up to 1000 times, densities and time steps over 6 decades). Whole numbers are doubled, choices go through all
    values, and vectors are scaled. A parameter with a range goes to its ends; one that is zero grows by decades of the
    range. Each limit is then refined by bisection, to a ratio of 1.2.

    Every point is compared by `metric`, a relative error, with its reference, which is solved again at each point. The
    outcome is `right` if the error is below `within` plus the uncertainty of the reference. It is `inaccurate` if the
    model itself reports that the error may be that large, by its stated error or a warning about its accuracy. It is
    `silent` if the model does not: the result looks right and is wrong. Other outcomes are `not_converged`, `diverged`,
    `refused` by a diagnostic, `failed`, `timed_out`, and `unjudged` if the reference has no result or is a beam theory
    far outside its range.

    A formula in the scene can be the reference as well: `value_error` against `values` of `kind = theory` that are an
    expression of parameters. Then only these parameters and fields of models can be varied, because the values do not
    follow changes of a material.

    `until = failure` continues through inaccurate points until the model gives no result; `inaccuracy` stops at the
    first point that is not right. `maps = pairs` adds a coarse grid for each pair of quantities and each model; `auto`
    does so if there are at most three quantities. `dsl robustness` runs the study; a scene without such a study gets
    one over all its numbers.
    """

    over: Annotated[
        tuple[SweepTarget, ...] | None, "targets", "parameters and fields to vary; default: every numeric field"
    ] = None
    until: Annotated[Literal["failure", "inaccuracy"], "stopping rule"] = "failure"
    models: Annotated[tuple[str, ...] | None, "models", "models to test; default: all models of the scene"] = None
    metric: Annotated[str | None, "metric", "relative error to use; default: the first in the scene"] = None
    within: Annotated[float, "1 in (0, 1)", "largest relative error that counts as right"] = 0.05
    maps: Annotated[Literal["auto", "none", "pairs"], "pairs of quantities to map"] = "auto"
