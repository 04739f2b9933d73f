"""Declarations of reduced-order models: a finite element model in a space of a few displacement fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.models.fem.fem_declaration import Fem
from softmark.interpreter.models.reduced import training_scenes
from softmark.interpreter.models.shared.capabilities import (
    ELASTIC_FOUNDATION,
    PERTURBED_STARTS,
    REDUCIBLE_FEATURES,
    RIGID_CONTACT,
    ROTATING_SUPPORTS,
    SELF_CONTACT,
    VARYING_CONSTANTS,
    RefusalTexts,
    Table,
    unsupported_feature_errors,
)
from softmark.interpreter.models.shared.model_declaration import Model
from softmark.interpreter.problem.body_case import other_body
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.study_words import Sweep
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case

ADVICE = "train on a range that contains the scene, and check `full_residual`"
PARTS = (0.25, 0.5, 0.75, 1.0)  # fractions of all loads for training, by default


class Reduced(Model):
    """Base class of reduced-order models."""

    capabilities: ClassVar[Table] = {
        VARYING_CONSTANTS: True,
        ELASTIC_FOUNDATION: RefusalTexts(
            code="E532",
            message="`{model}` cannot reduce a body on the elastic foundation `{name}`",
            help="use `{reduces}` directly",
            field="of",
        ),
        RIGID_CONTACT: RefusalTexts(label="a contact", help="use `{reduces}` directly"),
        SELF_CONTACT: RefusalTexts(
            message="`{model}` cannot represent `{name}`", label="contact or tie", help="use `{reduces}` directly"
        ),
        ROTATING_SUPPORTS: RefusalTexts(
            reason="its displacement modes are straight lines, but rotating points move on circles",
            help="use `{reduces}`",
        ),
        PERTURBED_STARTS: RefusalTexts(reason="which has only a few displacement modes"),
    }
    of: str

    @property
    def reduces(self) -> str:  # type: ignore[override]
        """Name of the finite element model whose equations are reduced."""
        return self.of

    def scene_diagnostics(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors if the named finite element model cannot be reduced."""
        found = (
            _check_reducible(scene, declared, case),
            _check_sampled_small_strain(scene, declared),
            _check_imposed_displacements(declared, case),
        )
        return [
            *(d for d in found if d is not None),
            *unsupported_feature_errors(declared, case, REDUCIBLE_FEATURES),
        ]


@dataclass(frozen=True)
class Modal(Reduced):
    """Finite element model in the space of its lowest vibration modes.

    The space contains `modes` vibration modes of the model `of` about rest (with its mass and supports) and its linear
    response to each load. With `derivatives` it also contains as many modal derivatives, the fields along which static
    responses curve as they grow (Idelsohn and Cardona 1985; Barbic and James 2005); without them a body that rotates by
    more than a few degrees locks. There is no training: the space depends on the loads of the scene and their places,
    not on their size.

    `cells = sampled` evaluates only cells that a non-negative least squares fit selects and weights (ECSW: Farhat,
    Avery, Chapman and Cortial 2014), so that the cost of a solution does not grow with the mesh. They are fitted to the
    reduced model's own states at a quarter, half, three quarters and all of the load, and to its initial stiffness. The
    space keeps the supports fixed; imposed displacements enter by the linear response to them. Loads are reduced
    exactly.

    `converged` refers to the reduced equations. `full_residual` in the report is the residual of the full model's
    equations, relative to its loads, and `estimated_error` is the corresponding displacement error (`W419`). Options of
    `of` that trade accuracy for speed (caps, precision, linear solver, start) are ignored.
    Source: Krysl, Lall and Marsden (2001).
    """

    of: Annotated[str, "model", "finite element model that is reduced"]
    modes: Annotated[int, "1 in [1, 2000]", "number of vibration modes"] = 20
    derivatives: Annotated[bool, "add modal derivatives, as many as modes"] = True
    cells: Annotated[Literal["all", "sampled"], "cells that are evaluated: all, or a weighted sample"] = "all"
    sampling: Annotated[float, "1 in (0, 1)", "largest relative error of the forces from sampled cells"] = 0.01
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return the errors of the model that do not depend on other declarations."""
        return []

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan` and the report."""
        derived = " with their derivatives" if self.derivatives else ""
        return (
            f"`{self.of}` reduced to {self.modes} vibration modes{derived} and its linear "
            f"responses{_describe_cell_sampling(self)}"
        )


@dataclass(frozen=True)
class Pod(Reduced):
    """Reduced model of a finite element model, with few unknowns, by proper orthogonal decomposition (POD).

    Name the finite element model in `of`. It is first solved for a set of training states. The reduced model then
    represents the displacement as a sum of `modes` fixed fields, those that approximate the training states best
    (Sirovich 1987). By default, `modes` is the smallest number for which at most `tolerance` of the root mean
    square of the states is lost. `norm` is the inner product in which fields are compared: that of the mass or of
    the strain energy.

    The training states are the equilibria at the fractions `training` of all loads and imposed displacements; the
    default is `[0.25, 0.5, 0.75, 1]`. If `over` names a sweep, they are computed for each of its values: `over =
    directions` with `study directions = sweep(weight.direction, over = [-z, +y])`. Sweeps may vary loads, imposed
    displacements and materials, but not the mesh. A warning reports a scene outside the ranges of the training.

    With `cells = sampled`, forces are computed in a sample of the cells only, so that the cost of a solution does
    not grow with the mesh. A non-negative least squares fit selects and weights these cells (ECSW: Farhat, Avery,
    Chapman and Cortial 2014). In all training states, and for small displacements, their reduced forces differ from
    those of all cells by at most `sampling`. Loads are reduced exactly; a pressure that follows the surface is
    evaluated on all of its facets.

    The time for training counts as set-up time and is in the report, also for a model that shares the training of
    another.

    Limits: the status `converged` refers only to the reduced equations. The report therefore gives `full_residual`,
    the residual of the equations of the full model relative to its loads, and `estimated_error`, the corresponding
    displacement error (`W419`). In a dynamic analysis, the training states are static.
    """

    of: Annotated[str, "model", "finite element model that is reduced"]
    training: Annotated[
        Any | None, "values", "fractions of all loads in the training set, such as `[0.25, 0.5, 0.75, 1]`"
    ] = None
    over: Annotated[str | None, "study", "sweep whose values are all used in training; default: the scene itself"] = (
        None
    )
    modes: Annotated[int | None, "1 in [1, 2000]", "number of fields; default: as many as `tolerance` needs"] = None
    tolerance: Annotated[float, "1 in (0, 1)", "relative part of the training states that may be left out"] = 1e-4
    norm: Annotated[Literal["mass", "energy"], "inner product that measures lengths of fields"] = "mass"
    cells: Annotated[Literal["all", "sampled"], "cells that are evaluated: all, or a weighted sample"] = "all"
    sampling: Annotated[float, "1 in (0, 1)", "largest relative error of the forces from sampled cells"] = 0.01
    body: Annotated[str | None, "body", "body; needed if the scene has several"] = None

    @property
    def parts(self) -> tuple[float, ...]:
        """Fractions of the loads at which training states are computed."""
        return PARTS if self.training is None else tuple(float(v) for v in self.training.values)

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return the errors of the model that do not depend on other declarations."""
        found = (
            self._check_training_fractions(declared),
            self._check_mode_count(declared),
            self._training_range_warning(declared),
        )
        return [d for d in found if d is not None]

    def scene_diagnostics(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return errors about the finite element model to be reduced and about the training."""
        found = super().scene_diagnostics(scene, declared, case)
        swept = self._check_sweep(scene, declared)
        if swept is None and not found:
            swept = training_scenes.check_same_mesh(scene, declared)
        return found + ([] if swept is None else [swept])

    def _check_training_fractions(self, declared: Declared) -> Diagnostic | None:
        if self.training is not None and any(self.training.dimension):
            label, help = (
                "has a unit",
                "write fractions of the load as numbers, `[0.5, 1]`; to sweep a quantity use `over`",
            )
        elif not self.parts:
            label, help = "empty", "write fractions of the loads, such as `[0.25, 0.5, 0.75, 1]`"
        elif min(self.parts) <= 0.0:
            label, help = (
                "not positive",
                "write fractions greater than 0: the unloaded state contains no information",
            )
        else:
            return None
        return diagnostic(
            "E532", declared.at("training"), f"`{declared.name}` cannot be trained on these load fractions", label, help
        )

    def _check_mode_count(self, declared: Declared) -> Diagnostic | None:
        states = len(set(self.parts))
        if self.modes is None or self.over is not None or self.modes <= states or not states:
            return None
        return diagnostic(
            "E532",
            declared.at("modes"),
            f"`{declared.name}` asks for {self.modes} modes from {states} training states",
            "more modes than training states",
            "add load fractions or a sweep, or reduce `modes`",
        )

    def _training_range_warning(self, declared: Declared) -> Diagnostic | None:
        """Return a warning if the training ends below the full load of the scene."""
        if not self.parts or max(self.parts) >= 1.0 or self._check_training_fractions(declared) is not None:
            return None
        at, most = declared.at("training"), 100 * max(self.parts)
        problem = f"`{declared.name}` extrapolates: it is trained only up to {most:g} % of the load"
        return diagnostic("W331", at, problem, "below full load", ADVICE)

    def _check_sweep(self, scene: Scene, declared: Declared) -> Diagnostic | None:
        if self.over is None:
            return None
        study = scene.declared[self.over]
        if isinstance(study.thing, Sweep):
            return None
        word = study.constructor.name
        problem = f"`{declared.name}` is trained over `{self.over}`, which is not a sweep"
        return diagnostic("E532", declared.at("over"), problem, f"a {word}", "name a `sweep(...)`, or remove `over`")

    def outline(self, case: Case) -> str:
        """Return a one-line description of the model for `dsl plan` and the report."""
        size = f"{self.modes} modes" if self.modes else f"modes to {self.tolerance:g} of its solutions"
        parts = ", ".join(f"{100 * part:g}" for part in self.parts)
        swept = f" over {self.over}" if self.over else ""
        return f"`{self.of}` reduced to {size}, trained at {parts} % of the load{swept}{_describe_cell_sampling(self)}"


def _describe_cell_sampling(model: Modal | Pod) -> str:
    return ", cells sampled" if model.cells == "sampled" else ""


def _check_reducible(scene: Scene, declared: Declared, case: Case) -> Diagnostic | None:
    """Return an error unless the model to be reduced is a finite element model of the same body."""
    full = scene.declared[declared.thing.of]
    if not isinstance(full.thing, Fem):
        word = full.constructor.name
        problem = f"`{declared.name}` cannot reduce `{full.name}`"
        return diagnostic("E532", declared.at("of"), problem, f"a {word}", "name a model made by `fem(...)`")
    if full.thing.formulation == "mixed":
        at, problem = declared.at("of"), f"`{declared.name}` cannot reduce `{full.name}`, which has pressures"
        help = "reduce `hex8` with `formulation = mean_dilatation`"
        return diagnostic("E554", at, problem, "saddle point system", help)
    if (body := other_body(scene, full, case)) is None:
        return None
    problem = f"`{declared.name}` is a model of `{case.body.name}`, and `{full.name}` is not"
    return diagnostic("E532", declared.at("of"), problem, "different bodies", f"write `body = {body}`")


def _check_sampled_small_strain(scene: Scene, declared: Declared) -> Diagnostic | None:
    """Return an error for sampled cells with small strain, whose reduced equations need no cells at all."""
    full = scene.declared[declared.thing.of].thing
    if declared.thing.cells == "all" or not full.constant:
        return None
    problem = f"`{declared.name}` samples cells of a model with constant stiffness"
    help = "remove `cells`: with small strain the reduced system is one small matrix, and no cell is evaluated again"
    return diagnostic("E532", declared.at("cells"), problem, "nothing to sample", help)


def _check_imposed_displacements(declared: Declared, case: Case) -> Diagnostic | None:
    """Return an error for an explicit integrator with imposed displacements, which couple the mass of all unknowns."""
    analysis = case.analysis
    moved = any(support.thing.displaces for support in case.supports)
    if not isinstance(analysis, Dynamic) or not analysis.explicit or not moved:
        return None
    problem = f"`{declared.name}` cannot be integrated by {analysis.integrator} with moving supports"
    return diagnostic("E532", declared.at("of"), problem, "mass matrix not diagonal", "use an implicit integrator")
