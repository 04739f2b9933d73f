"""Base class `Model` of the declarations of all models. Each model overrides the defaults that differ.

No code asks for the class of a model. A declaration states what a scene may apply to the model, its resolution,
its family and how its shortcuts are removed. Questions that need arrays are answered by the prepared model
(`shared/prepared_model.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.models.shared.capabilities import CHECKED_FEATURES, Feature, Table, unsupported_feature_errors
from softmark.interpreter.problem.conforming_mesh import cuts_of
from softmark.interpreter.vocabulary.loads.load import SolidAction
from softmark.interpreter.vocabulary.supports.support import DisplacementSupport

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.conforming_mesh import Cuts
    from softmark.interpreter.results.run_report import ModelKind
    from softmark.solvers.mesh.shape import Shape

RENAMED = {  # earlier names of members, which nothing reads any more if a plugin defines them
    "bedded": "capabilities[ELASTIC_FOUNDATION]",
    "touches": "capabilities[RIGID_CONTACT]",
    "moves": "capabilities[DYNAMICS]",
    "wired": "capabilities[NETWORKS]",
    "sectional": "moves_by_sections",
    "composite": "capabilities[REGIONS]",
    "graded": "capabilities[VARYING_CONSTANTS]",
    "directed": "capabilities[ANISOTROPY]",
    "remembers": "capabilities[VISCOELASTICITY]",
    "soaks": "capabilities[POROELASTICITY]",
    "recovers": "capabilities[PERTURBED_STARTS]",
    "even": "homogeneous_strain",
    "unsolved": "may_be_unconverged",
    "capped_at": "iteration_cap",
    "forceless": "reason_without_forces",
    "unwalked": "reason_without_robustness",
    "finely": "resolution_fields",
    "doubts": "diagnostics",
    "scene_doubts": "scene_diagnostics",
    "forgets": "capabilities",
    "turns": "capabilities",
    "history_refusals": "capabilities",
    "rotation_refusals": "capabilities",
    "supports_elastic_foundations": "capabilities[ELASTIC_FOUNDATION]",
    "supports_rigid_contact": "capabilities[RIGID_CONTACT]",
    "supports_dynamics": "capabilities[DYNAMICS]",
    "supports_networks": "capabilities[NETWORKS]",
    "supports_regions": "capabilities[REGIONS]",
    "supports_varying_constants": "capabilities[VARYING_CONSTANTS]",
    "supports_anisotropy": "capabilities[ANISOTROPY]",
    "supports_viscoelasticity": "capabilities[VISCOELASTICITY]",
    "supports_poroelasticity": "capabilities[POROELASTICITY]",
    "supports_perturbed_starts": "capabilities[PERTURBED_STARTS]",
}


class Model:
    """Base class of a model declared in a scene, with default capabilities and properties."""

    # what the model supports; validation reports everything else by `unsupported_feature_errors`
    loads: tuple[type[Any], ...] = (SolidAction,)  # kinds of load
    supports: tuple[type[Any], ...] = (DisplacementSupport,)  # kinds of support
    capabilities: ClassVar[Table] = {}  # supported or not, by features in `shared/capabilities.py`

    # what kind of model it is
    reduces: str | None = None  # the model whose equations it reduces
    moves_by_sections = False  # moves by rigid sections along an axis
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
        return list(self.unsupported_feature_errors(declared, case))

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

    def has_capability(self, feature: Feature) -> bool:
        """Return whether the model supports a feature of a scene."""
        return self.capabilities.get(feature, feature.default) is True

    def unsupported_feature_errors(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Yield errors for the analysis, loads, supports and other features that the model does not support."""
        return unsupported_feature_errors(declared, case, CHECKED_FEATURES)
