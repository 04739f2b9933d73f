"""Base class `Model` of the declarations of all models. Each model overrides the defaults that differ.

No code asks for the class of a model. A declaration states what a scene may apply to the model, its resolution,
its family and how its shortcuts are removed. Questions that need arrays are answered by the prepared model
(`shared/prepared_model.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.conforming_mesh import cuts_of
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.loads.load import SolidAction
from softmark.interpreter.vocabulary.support_words import Holding, Pinned, RigidPlate

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.conforming_mesh import Cuts
    from softmark.interpreter.results.run_report import ModelKind
    from softmark.solvers.mesh.shape import Shape

MOST = "use a model that supports it, such as `fem(...)`"
OF_NETWORKS = (
    "use gravity, forces and lines of force on axes, or torques; and the supports `fixed`, `displaced` and `pinned`"
)
UNKNOWN = "load not supported"
RENAMED = {  # earlier names of members, which nothing reads any more if a plugin defines them
    "bedded": "supports_elastic_foundations",
    "touches": "supports_rigid_contact",
    "moves": "supports_dynamics",
    "wired": "supports_networks",
    "sectional": "moves_by_sections",
    "composite": "supports_regions",
    "graded": "supports_varying_constants",
    "directed": "supports_anisotropy",
    "remembers": "supports_viscoelasticity",
    "soaks": "supports_poroelasticity",
    "recovers": "supports_perturbed_starts",
    "even": "homogeneous_strain",
    "unsolved": "may_be_unconverged",
    "capped_at": "iteration_cap",
    "forceless": "reason_without_forces",
    "unwalked": "reason_without_robustness",
    "finely": "resolution_fields",
    "doubts": "diagnostics",
    "scene_doubts": "scene_diagnostics",
    "forgets": "history_refusals",
    "turns": "rotation_refusals",
}


class Model:
    """Base class of a model declared in a scene, with default capabilities and properties."""

    # what the model supports: `refusals` reports everything else in validation
    loads: tuple[type[Any], ...] = (SolidAction,)  # kinds of load
    supports: tuple[type[Any], ...] = (Holding,)  # kinds of support
    supports_elastic_foundations = False
    supports_rigid_contact = False
    supports_dynamics = True
    supports_networks = False  # spring and beam networks
    moves_by_sections = False  # moves by rigid sections along an axis
    supports_regions = False
    supports_varying_constants = False
    supports_anisotropy = False
    supports_viscoelasticity = False
    supports_poroelasticity = False
    supports_perturbed_starts = False

    # what kind of model it is
    reduces: str | None = None  # the model whose equations it reduces
    constant = False  # constant stiffness
    reads_file = False  # its displacements are read from a file
    timed = True  # solved by softmark, with timing
    reason_without_robustness = ""  # reason why `dsl robustness` leaves it out, if it does
    reason_without_forces: str | None = None  # reason why it has no forces, if it has none
    homogeneous_strain = False  # the same strain at every point
    may_be_unconverged = False  # may accept states that are not converged
    resolution_fields: tuple[str, ...] = ()  # its fields that set the resolution

    def __init_subclass__(cls) -> None:
        """Raise TypeError if a model defines a member by its earlier name, which nothing reads any more.

        Fields of scenes, which are annotated, may have these names.
        """
        fields = vars(cls).get("__annotations__", {})
        for old, new in RENAMED.items():
            if old in vars(cls) and old not in fields:
                raise TypeError(f"`{cls.__name__}` defines `{old}`, which is called `{new}` now")

    @property
    def own_mesh(self) -> Shape | None:
        """Mesh read from a file, which replaces a mesh generated from the body's shape; None if there is no file."""
        return None

    @property
    def other_material(self) -> Any:
        """Material of the model in place of the body's material; None if the model uses the body's material."""
        return None

    @property
    def iteration_cap(self) -> int | None:
        """Number of Newton iterations after which an unconverged state is accepted; None if none is accepted."""
        return None

    @property
    def shortcuts(self) -> tuple[str, ...]:
        """Names of fields that a scene has set to trade accuracy for speed.

        Such fields leave steps unconverged, use single precision, or start from another state than rest.
        """
        return ()

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """Strain measure and volumetric formulation of the stress law, or the reason why the model has no stress."""
        return "only finite elements and beams have a stress at every point of the body"

    def diagnostics(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return the errors and warnings about this model in a case that can be found without building arrays."""
        return list(self.refusals(declared, case))

    def scene_diagnostics(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """Return the errors and warnings about this model that depend on other declarations of the scene."""
        return []

    def outline(self, case: Case) -> str:
        """Return a one-line description, for `dsl plan`, of the model as it will be built for a case."""
        raise NotImplementedError(f"{type(self).__name__} has no outline")

    def kind(self, case: Case) -> ModelKind | None:
        """Return the kind of the model: its description without resolution, its resolution, and Poisson's ratio.

        Models with equal descriptions are grouped. By default the result is None: the model belongs to no group.
        """
        return None

    def mesh_key(self) -> tuple[Any, ...] | None:
        """Return a key that is equal for models of a body that can share a mesh; None for a model without a mesh."""
        return None

    def cuts(self, case: Case, shape: Shape | None = None) -> Cuts:
        """Return the planes and surfaces inside the body that its meshes must conform to."""
        return cuts_of(case, shape)

    def mesh_words(self, case: Case) -> str:
        """Return a description of the mesh of the model."""
        return ""

    def plain(self, **changes: Any) -> Self:
        """Return the model without options that trade accuracy for speed; `changes` are new values of its fields."""
        changed: Any = replace(self, **changes)  # type: ignore[type-var]  # models are dataclasses
        made: Self = changed
        return made

    def orders(self) -> dict[str, int]:
        """Return the theoretical convergence order of smooth displacements for each of `resolution_fields`."""
        return {}

    def refusals(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield errors for the analysis, loads and supports that the model does not support."""
        if not self.supports_dynamics and isinstance(case.analysis, Dynamic):
            yield diagnostic("E501", declared.at(),
                             f"`{declared.name}` supports only static analyses", "static model",
                             "use `fem(...)` or `beam6dof(...)` in a dynamic analysis")  # fmt: skip
        for load in case.loads:
            if not isinstance(load.thing.action, self.loads):
                label, help = load.thing.action.unsupported or (UNKNOWN, self._supporting_models_help)
                label = UNKNOWN if case.shape.wired else label  # which is no solid
                yield diagnostic("E501", load.at(), f"`{declared.name}` cannot represent the load `{load.name}`",
                                 label, help)  # fmt: skip
        for support in case.supports:
            if not isinstance(support.thing, self.supports):
                hinge = "use `frame6dof(...)` with a `network(...)` for hinged points"
                yield diagnostic(
                    "E501",
                    support.at(),
                    f"`{declared.name}` cannot represent the support `{support.name}`",
                    "support not available",
                    hinge if isinstance(support.thing, Pinned) else self._supporting_models_help,
                )
        for bed in () if self.supports_elastic_foundations else case.beds:
            yield diagnostic("E501", bed.at(), f"`{declared.name}` cannot represent the elastic foundation "
                                               f"`{bed.name}`",
                             "elastic foundation", "use `fem(...)`")  # fmt: skip
        for plate in case.beds if isinstance(case.analysis, Dynamic) else ():
            if isinstance(plate.thing, RigidPlate):
                yield diagnostic(
                    "E413",
                    plate.at(),
                    f"`{plate.name}` is massless, and the analysis is dynamic",
                    "not in a dynamic analysis",
                    "use a static analysis or `quasistatic(...)`, or move the face by `displaced(...)`",
                )
        if case.contacts:
            from softmark.interpreter.models.shared import contact_capabilities

            yield from contact_capabilities.refusals(self, declared, case)
        if case.pairs:
            from softmark.interpreter.models.shared import self_contact_capabilities

            yield from self_contact_capabilities.refusals(self.supports_elastic_foundations, declared, case)
        yield from self.rotation_refusals(declared, case)
        yield from self.history_refusals(declared, case)

    @property
    def _supporting_models_help(self) -> str:
        """Help text that names models with support for the loads and supports that this model lacks."""
        return OF_NETWORKS if self.supports_networks else MOST

    def history_refusals(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield errors if the model does not support the poroelastic or viscoelastic material of the body.

        Warn if time steps are too long for the relaxation of the material.
        """
        if case.porous or case.drains:
            from softmark.interpreter.models.shared import fluid_capabilities

            yield from (
                fluid_capabilities.refusals(self, declared, case)
                if case.porous
                else fluid_capabilities.refuse_unused_drains(case)
            )
        elif case.has_material_history:
            from softmark.interpreter.models.shared import relaxation_capabilities

            yield from relaxation_capabilities.refusals(self, declared, case)

    def rotation_refusals(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield errors for rotating supports whose motion the model cannot represent."""
        if any(support.thing.turns for support in case.supports):
            from softmark.interpreter.models.shared import rotating_supports

            yield from rotating_supports.refusals(self, declared, case)
