"""Features of a scene that a model may not support, and the error for each of them.

Each feature is one `Feature`. The table `Model.capabilities` of a model lists the features that the model supports, or
error texts for features that it does not support. To add a feature: write an entry here, and a line in the table of
each model that supports it. The checks `limits` of supported features are in modules of their own, which are imported
only for scenes with the feature.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared
    from softmark.interpreter.problem.body_case import Case

UNSUPPORTED_SOLID_HELP = "use a model that supports it, such as `fem(...)`"
UNSUPPORTED_NETWORK_HELP = (
    "use gravity, forces and lines of force on axes, or torques; and the supports `fixed`, `displaced` and `pinned`"
)
UNKNOWN_LOAD = "load not supported"


@dataclass(frozen=True)
class RefusalTexts:
    """Texts of the error about an unsupported feature that a model has in place of those of the `Feature`.

    None keeps the text of the feature. `reason` fills the part {reason} of the message. The error points to
    `field` of the model if it is given.
    """

    label: str | None = None
    help: str | None = None
    reason: str | None = None
    code: str | None = None
    message: str | None = None
    field: str | None = None


Checks = Callable[["Declared", "Case"], Iterator[Diagnostic]]


@dataclass(frozen=True, eq=False)
class Feature:
    """Feature of a scene that some models do not support, with the error for those models.

    `needed_by` returns the declarations of a case that need the feature. The error points to each of them, or
    to the model if `at_model`. The texts are templates with the fields model, body, reduces (the model that a
    reduced model reduces), name (of the declaration that needs the feature), reason, and those that `details`
    returns. `default` states whether models support the feature if their table does not list it. `invalid`
    yields errors of the scene that do not depend on the model; if there are any, nothing else is reported.
    `limits` yields errors for a model that supports the feature.
    """

    name: str
    needed_by: Callable[[Any, Case], Sequence[Declared]]
    code: str
    message: str
    label: str
    help: str
    at_model: bool = False
    reason: str = ""
    details: Callable[[Any, Case, Declared], Mapping[str, str]] | None = None
    default: bool = False
    invalid: Callable[[Case], Iterator[Diagnostic]] | None = None
    limits: Checks | None = None

    def unsupported_error(
        self, declared: Declared, case: Case, thing: Declared, own: RefusalTexts | None = None
    ) -> Diagnostic:
        """Return the error that a declared model does not support this feature.

        `thing` is the declaration that needs the feature; `own` are texts of the model that replace those of the
        feature.
        """
        own = own or RefusalTexts()
        words: dict[str, Any] = {
            "model": declared.name,
            "body": case.body.name,
            "name": thing.name,
            "reduces": declared.thing.reduces,
            "reason": own.reason or self.reason,
        }
        if self.details is not None:
            words.update(self.details(declared.thing, case, thing))
        at = declared.at(own.field) if own.field else declared.at() if self.at_model else thing.at()
        message = (own.message or self.message).format(**words)
        label, help = (text.format(**words) for text in (own.label or self.label, own.help or self.help))
        return diagnostic(own.code or self.code, at, message, label, help)


Table = Mapping[Feature, bool | RefusalTexts]  # what a model supports, or its own texts where it does not


def unsupported_feature_errors(declared: Declared, case: Case, features: Sequence[Feature]) -> Iterator[Diagnostic]:
    """Yield the errors of a declared model for those of these features that a case needs, in their order."""
    model = declared.thing
    for feature in features:
        needing = feature.needed_by(model, case)
        if not needing:
            continue
        if feature.invalid is not None and (errors := list(feature.invalid(case))):
            yield from errors
        elif not model.has_capability(feature):
            entry = model.capabilities.get(feature)
            own = entry if isinstance(entry, RefusalTexts) else None
            once = feature.at_model or (own is not None and own.field is not None)
            for thing in needing[:1] if once else needing:
                yield feature.unsupported_error(declared, case, thing, own)
        elif feature.limits is not None:
            yield from feature.limits(declared, case)


def _needed_by_body(is_needed: Callable[[Case], bool]) -> Callable[[Any, Case], Sequence[Declared]]:
    """Return a function for `Feature.needed_by` that returns the body if `is_needed(case)`, else nothing."""
    return lambda model, case: (case.body,) if is_needed(case) else ()


def _load_error_texts(model: Any, case: Case, load: Declared) -> Mapping[str, str]:
    """Return the texts {label} and {help} of the error about a load of an unsupported kind."""
    label, help = load.thing.action.unsupported or (UNKNOWN_LOAD, _supporting_models_help(model))
    return {"label": UNKNOWN_LOAD if case.shape.wired else label, "help": help}  # a network is no solid


def _support_error_texts(model: Any, case: Case, support: Declared) -> Mapping[str, str]:
    """Return the text {help} of the error about a support of an unsupported kind."""
    return {"help": support.thing.unsupported_help or _supporting_models_help(model)}


def _supporting_models_help(model: Any) -> str:
    """Return the help of an error about an unsupported load or support: what to use instead."""
    return UNSUPPORTED_NETWORK_HELP if model.has_capability(NETWORKS) else UNSUPPORTED_SOLID_HELP


def _region_error_texts(model: Any, case: Case, body: Declared) -> Mapping[str, str]:
    """Return the text {regions}: the names of the regions of a body."""
    return {"regions": ", ".join(f"`{part.name}`" for part in case.parts)}


def _has_varying_constants(case: Case) -> bool:
    from softmark.interpreter.problem.representative_constants import profiles

    return any(profiles(material) for material in case.materials)


def _varying_constant_error_texts(model: Any, case: Case, body: Declared) -> Mapping[str, str]:
    """Return the text {constants}: which material constants of a case vary in space."""
    from softmark.interpreter.problem.heterogeneity_limits import describe_varying

    return {"constants": describe_varying(case)}


def _is_anisotropic(case: Case) -> bool:
    return any(getattr(material, "directed", False) for material in (*case.materials, case.body.thing.material))


def _anisotropy_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.problem import anisotropy_limits

    yield from anisotropy_limits.check_fiber_model(declared, case)


def _rigid_contact_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import contact_limits

    yield from contact_limits.check_rigid_contact(declared, case)


def _self_contact_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import contact_limits

    yield from contact_limits.check_self_contact(declared, case)


def _rotation_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import rotating_supports

    if (why := rotating_supports.unsupported_reason(declared.thing, case)) is not None:
        own = RefusalTexts(reason=why[0], help=why[1])
        for support in ROTATING_SUPPORTS.needed_by(declared.thing, case):
            yield ROTATING_SUPPORTS.unsupported_error(declared, case, support, own)


def _invalid_poroelastic_material(case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import poroelastic_limits

    yield from poroelastic_limits.check_material(case)


def _poroelastic_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import poroelastic_limits

    yield from poroelastic_limits.check_model(declared, case)


def _invalid_prony_series(case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import viscoelastic_limits

    yield from viscoelastic_limits.check_material(case)


def _viscoelastic_limits(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    from softmark.interpreter.models.shared import viscoelastic_limits

    yield from viscoelastic_limits.check_model(declared, case)


def _perturbation_error_texts(model: Any, case: Case, body: Declared) -> Mapping[str, str]:
    """Return the text {kind}: how the analysis perturbs the start."""
    return {"kind": case.analysis.disturbed}


DYNAMICS = Feature(
    name="dynamic analysis",
    needed_by=_needed_by_body(lambda case: isinstance(case.analysis, Dynamic)),
    code="E501",
    message="`{model}` supports only static analyses",
    label="static model",
    help="use `fem(...)` or `beam6dof(...)` in a dynamic analysis",
    at_model=True,
    default=True,
)
LOADS = Feature(
    name="load of another kind than `Model.loads`",
    needed_by=lambda model, case: [load for load in case.loads if not isinstance(load.thing.action, model.loads)],
    code="E501",
    message="`{model}` cannot represent the load `{name}`",
    label="{label}",
    help="{help}",
    details=_load_error_texts,
)
SUPPORTS = Feature(
    name="support of another kind than `Model.supports`",
    needed_by=lambda model, case: [held for held in case.supports if not isinstance(held.thing, model.supports)],
    code="E501",
    message="`{model}` cannot represent the support `{name}`",
    label="support not available",
    help="{help}",
    details=_support_error_texts,
)
NETWORKS = Feature(
    name="network of springs or beams",
    needed_by=_needed_by_body(lambda case: case.shape.wired),
    code="E344",
    message="`{model}` does not support `{body}`, a network of beams",
    label="not for networks",
    help="use `frame6dof(segments = 8)`",
    at_model=True,
)
REGIONS = Feature(
    name="regions of other materials",
    needed_by=_needed_by_body(lambda case: bool(case.parts)),
    code="E593",
    message="`{model}` supports one material, but `{body}` has regions of other materials: {regions}",
    label="one material only",
    help="use a full `fem(...)` model, or remove the `material` of the regions",
    at_model=True,
    details=_region_error_texts,
)
VARYING_CONSTANTS = Feature(
    name="constants that vary in space",
    needed_by=_needed_by_body(_has_varying_constants),
    code="E328",
    message="`{model}` supports a homogeneous material only, but {constants} in space",
    label="one value of each constant",
    help="use `fem(...)`, which evaluates every constant at its integration points",
    at_model=True,
    details=_varying_constant_error_texts,
)
ANISOTROPY = Feature(
    name="material with fibres",
    needed_by=_needed_by_body(_is_anisotropic),
    code="E363",
    message="`{model}` supports isotropic materials only, but the material of `{body}` has fibres",
    label="only for isotropic materials",
    help="use `fem(...)` with `strain = finite`, which supports every law",
    at_model=True,
    limits=_anisotropy_limits,
)
ELASTIC_FOUNDATION = Feature(
    name="elastic foundation or rigid plate",
    needed_by=lambda model, case: case.beds,
    code="E501",
    message="`{model}` cannot represent the elastic foundation `{name}`",
    label="elastic foundation",
    help="use `fem(...)`",
)
MASSLESS_PLATE = Feature(
    name="massless rigid plate in a dynamic analysis",
    needed_by=lambda model, case: (
        [bed for bed in case.beds if bed.thing.is_massless_plate] if isinstance(case.analysis, Dynamic) else ()
    ),
    code="E413",
    message="`{name}` is massless, and the analysis is dynamic",
    label="not in a dynamic analysis",
    help="use a static analysis or `quasistatic(...)`, or move the face by `displaced(...)`",
)
RIGID_CONTACT = Feature(
    name="contact with rigid bodies",
    needed_by=lambda model, case: [touch.declared for touch in case.contacts[:1]],
    code="E650",
    message="`{model}` cannot represent the contact `{name}`",
    label="contact not supported",
    help="use `fem(...)`, which supports contact",
    limits=_rigid_contact_limits,
)
SELF_CONTACT = Feature(
    name="self-contact, or a tie of two surfaces",
    needed_by=lambda model, case: case.pairs,
    code="E633",
    message="`{model}` has no surface for contact",
    label="no finite elements",
    help="use `fem(...)`",
    limits=_self_contact_limits,
)
ROTATING_SUPPORTS = Feature(
    name="rotating supports",
    needed_by=lambda model, case: [support for support in case.supports if support.thing.rotates],
    code="E519",
    message="`{model}` does not support the rotation `{name}`: {reason}",
    label="needs load steps from rest",
    help=UNSUPPORTED_SOLID_HELP,
    reason="its points cannot move on circles",
    default=True,
    limits=_rotation_limits,
)
UNUSED_DRAIN = Feature(
    name="drained boundary of a body without fluid",
    needed_by=lambda model, case: () if case.porous else case.drains,
    code="E371",
    message="`{name}` drains `{body}`, which contains no fluid",
    label="no fluid",
    help="use the material `biphasic(LAW, permeability = 1e-15 m^4/(N*s))`, or remove the support",
)
POROELASTICITY = Feature(
    name="poroelastic body",
    needed_by=_needed_by_body(lambda case: case.porous),
    code="E372",
    message="`{model}` does not support fluid, but `{body}` is poroelastic",
    label="for solids without fluid",
    help="use `fem(tet10, ...)`, or only the drained law",
    at_model=True,
    invalid=_invalid_poroelastic_material,
    limits=_poroelastic_limits,
)
VISCOELASTICITY = Feature(
    name="viscoelastic body",
    needed_by=_needed_by_body(lambda case: case.has_material_history and not (case.porous or case.drains)),
    code="E358",
    message="`{model}` does not support stress relaxation, but `{body}` is viscoelastic",
    label="for elastic materials",
    help="use `fem(...)` or `beam6dof(...)`, or only the elastic law",
    at_model=True,
    invalid=_invalid_prony_series,
    limits=_viscoelastic_limits,
)
PERTURBED_STARTS = Feature(
    name="static analysis from a perturbed start",
    needed_by=_needed_by_body(lambda case: case.analysis.disturbed != "none"),
    code="E571",
    message="`disturbed = {kind}` cannot be used with `{model}`, {reason}",
    label="no disturbed start",
    help="use `fem`, `mass_spring` or `beam6dof`",
    at_model=True,
    reason="which starts undeformed",
    details=_perturbation_error_texts,
)


SOLID_FEATURES = (
    REGIONS, VARYING_CONSTANTS, ANISOTROPY, ELASTIC_FOUNDATION, RIGID_CONTACT, SELF_CONTACT, POROELASTICITY,
    VISCOELASTICITY,
)  # fmt: skip  # features that finite elements of a solid support


def supported_features(*features: Feature) -> dict[Feature, bool | RefusalTexts]:
    """Return the table `Model.capabilities` of a model that supports these features."""
    return dict.fromkeys(features, True)


NETWORK_START_TEXTS = RefusalTexts(help="leave it out: networks start undeformed")

REDUCIBLE_FEATURES = (
    ELASTIC_FOUNDATION, RIGID_CONTACT, SELF_CONTACT, ROTATING_SUPPORTS, UNUSED_DRAIN, POROELASTICITY, VISCOELASTICITY,
)  # fmt: skip
CHECKED_FEATURES = (
    DYNAMICS, LOADS, SUPPORTS, ELASTIC_FOUNDATION, MASSLESS_PLATE, RIGID_CONTACT, SELF_CONTACT, ROTATING_SUPPORTS,
    UNUSED_DRAIN, POROELASTICITY, VISCOELASTICITY,
)  # fmt: skip
