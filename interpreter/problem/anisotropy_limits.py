"""Errors about materials with fibre directions; this module is imported only for scenes that have one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.body_case import Case, Fault, fault
from softmark.interpreter.problem.representative_constants import profiles
from softmark.interpreter.vocabulary.analysis_words import Dynamic

if TYPE_CHECKING:
    import numpy as np

    from softmark.solvers.energies.energy import Floats
else:
    from softmark.solvers.runtime.lazy_modules import np

ASKED = 4096  # points at which a mirror image is looked at
ALIKE = 1e-6  # relative to an energy: rounding, and directions written with as many digits
STRAINED = (  # F at which it is: with stretch all ways, for fibres that resist it alone, and no symmetry of its own
    ((1.05, 0.031, 0.017), (0.009, 1.04, 0.023), (0.027, 0.006, 1.06)),
    ((1.06, -0.028, 0.011), (0.004, 1.03, -0.019), (-0.021, 0.013, 1.07)),
)
FEM = "use `fem(...)` with `strain = finite`, which supports every law"


def is_directed(material: Any) -> bool:
    """Return whether a material has fibre directions; for a plate, whether the material of its solid has."""
    plate = material if not material.thin else material.of
    return bool(getattr(plate, "directed", False))


def has_directed_material(case: Case) -> bool:
    """Return whether one of the materials of a case has fibre directions."""
    return any(is_directed(material) for material in case.materials)


def check_fiber_materials(scene: Scene) -> Iterator[Diagnostic]:
    """Yield errors of materials with fibre directions in a scene.

    They are viscoelastic laws with fibres, laws without the directions that they need, and muscle whose passive law
    cannot be made active.
    """
    for declared in scene.of_kind("material").values():
        thing = declared.thing
        if not is_directed(thing):
            continue
        if thing.branches:
            yield diagnostic(
                "E363",
                declared.at("law"),
                f"`{declared.name}` relaxes a law with fibres, but relaxation supports isotropic laws only",
                "only for isotropic laws",
                "use a law without fibres, or the law without relaxation",
            )
            continue
        if hasattr(thing, "passive"):
            yield from _check_muscle(declared)
            continue
        from softmark.solvers.materials.anisotropic_material import lacks_sheets
        from softmark.solvers.materials.material_axes import InvalidDirection, MaterialFrame

        if lacks_sheets(thing):
            yield diagnostic(
                "E366",
                declared.at("fibres"),
                f"`{declared.name}` needs a direction of sheets, because "
                "its law differs in directions across its fibres",
                "no sheets",
                "give `sheets = +y`, or a rule with sheets such as `helix(...)`",
            )
        elif not thing.turning:
            try:
                MaterialFrame.of(thing.fibres, thing.sheets)
            except InvalidDirection as error:
                yield diagnostic("E366", declared.at("sheets"), f"`{declared.name}` has no direction across its "
                                 f"fibres: {error.reason}", "no direction", "give a direction of sheets across the "
                                                                            "fibres")  # fmt: skip
        for name in ("fibres", "sheets"):
            if wrong := getattr(getattr(thing, name), "fault", ""):
                yield diagnostic("E366", declared.at(name), f"the {name} of `{declared.name}` have no valid rule: "
                                                            f"{wrong}",
                                 "no wall", "give the semi-axes of the wall")  # fmt: skip


def _check_muscle(declared: Declared) -> Iterator[Diagnostic]:
    """Yield the errors about one active muscle material of a case."""
    thing = declared.thing
    law = thing.passive
    if thing.fibres is None:
        yield diagnostic("E367", declared.at("law"), f"`{declared.name}` acts along fibres, but its law has none",
                         "no fibres", "give `own = +x`, or use a law with fibres, such as `guccione(...)`")  # fmt: skip
    elif law.finite_law() is None or hasattr(law, "passive") or law.branches:
        why = "is a muscle already" if hasattr(law, "passive") else "is not a law of finite strain"
        why = "relaxes" if law.branches else why
        yield diagnostic("E367", declared.at("law"), f"the law of `{declared.name}` {why}",
                         "cannot be made active",
                         "use `guccione(...)` or `neo_hookean(...)`, and one muscle only")  # fmt: skip
    elif profiles(law):
        yield diagnostic(
            "E367",
            declared.at("law"),
            f"the law of `{declared.name}` varies in space",
            "one value of each constant",
            "use one value of each constant: only directions may vary",
        )


def check_fiber_model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of options that ignore fibre directions, and of muscle in analyses that do not support it."""
    thing, body = declared.thing, case.body.name
    if thing.strain != "finite":
        yield diagnostic(
            "E363",
            declared.at("strain"),
            f"the material of `{body}` has fibres, but strain = {thing.strain} treats every material as isotropic",
            "only for isotropic materials",
            "use `strain = finite`",
        )
    elif (askew := _check_symmetry(case)) is not None:
        yield askew
    elif (unfit := _check_active_strain(declared, case)) is not None:
        yield unfit
    elif case.planar:
        yield from _check_plane(declared, case)


def _check_active_strain(declared: Declared, case: Case) -> Diagnostic | None:
    """Refuse active strain in dynamics, with history-dependent materials, and on equilibrium paths."""
    own = [m for m in case.materials if hasattr(m, "passive") and not m.pulls]
    if isinstance(case.analysis, Dynamic) and any(m.amplitude is not None for m in own):
        return diagnostic(
            "E368",
            declared.at(),
            f"`{declared.name}` is dynamic, but fibres that shorten with an `amplitude` need a quasistatic analysis",
            "not in a dynamic analysis",
            "use `quasistatic(...)`, a shortening without an `amplitude`, or a tension: `active(..., amplitude = ...)`",
        )
    if any(m.branches for m in case.materials) and any(m.amplitude is not None for m in own):
        return diagnostic(
            "E362",
            declared.at(),
            f"fibres of `{case.body.name}` shorten with an `amplitude`, but a part of it relaxes",
            "not with viscoelasticity",
            "use a shortening without an `amplitude`, or a tension: `active(..., amplitude = ...)`",
        )
    if own and case.analysis.path == "arc_length":
        return diagnostic(
            "E378",
            declared.at(),
            f"`{declared.name}` follows a path from rest, but fibres of "
            f"`{case.body.name}` are shortened before the path begins",
            "no path from rest",
            "use `path = load`, with several states if one step is too long, or a tension, which grows"
            " along the path: `active(...)`",
        )
    return None


def _check_symmetry(case: Case) -> Diagnostic | None:
    """Return the error of uniform fibre directions that are not symmetric about a symmetry plane, or None.

    Directions that vary are checked on a mesh later.
    """
    if not any(support.thing.is_symmetry_plane for support in case.supports):
        return None
    for material in {id(m): m for m in (case.material, *case.materials)}.values():
        if is_directed(material) and not material.thin and not _is_unknown_without_mesh(material):
            try:
                require_symmetric_fibers(replace(case, other_material=material), np.zeros((1, 1, 3)))
            except Fault as refused:
                return refused.diagnostic
    return None


def _is_unknown_without_mesh(material: Any) -> bool:
    """Return whether fibre directions can be checked only on a mesh, or were already refused."""
    from softmark.solvers.materials.anisotropic_material import lacks_sheets
    from softmark.solvers.materials.material_axes import InvalidDirection

    law = getattr(material, "passive", material)
    if material.fibres is None or material.turning or (is_directed(law) and lacks_sheets(law)):
        return True
    try:
        return not (material.frame and (not is_directed(law) or law.frame))
    except InvalidDirection:
        return True


def _check_plane(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Yield errors of fibre directions that would move a plane body out of its plane."""
    kind = case.planar.replace("_", " ")
    for material in case.materials:
        if case.planar == "plane_stress" and is_directed(material):
            yield diagnostic(
                "E365",
                case.body.at("material"),
                f"`{case.body.name}` is in plane stress, which does not support a material with fibres",
                "not in plane stress",
                "use `plane_strain`, or a `solid` as thick as the plate",
            )
        elif is_directed(material) and not _is_in_plane(material):
            yield diagnostic("E365", case.body.at("material"), f"fibres of `{case.body.name}` lie neither within its "
                             f"plane nor along z, and would move it out of {kind}", "neither in the plane nor along z",
                             "use directions within x and y, or +z only, which are the same for all z, or use a "
                             "`solid`"
                             )  # fmt: skip


def _is_in_plane(material: Any) -> bool:
    """Return whether fibre directions lie in the plane or normal to it; False for rules such as `helix(...)`."""
    law = getattr(material, "passive", material)
    known = (material.fibres, *((law.fibres, law.sheets) if is_directed(law) else ()))
    each = [d for d in known if d is not None]
    for direction in each:
        if not isinstance(direction, tuple):
            third = getattr(direction, "components", (None, None, None))[2]
            if third is None or third.root.do != "number" or third.root.value != 0.0:
                return False
        elif direction[2] != 0.0 and (direction[0] != 0.0 or direction[1] != 0.0):
            return False
    return True


def require_symmetric_fibers(case: Case, X: Floats) -> None:
    """Check that fibres at points X (m, q, 3), m, are symmetric about each symmetry plane. Raises Fault.

    Half a body can represent the whole only if they are.
    """
    flat = X.reshape(-1, 3)
    some = flat[:: max(1, len(flat) // ASKED)]
    for support in case.supports:
        if (plane := support.thing.mirror_plane) is not None:
            axis, place = plane
            odd = _first_asymmetric_point(case.material, some, axis, place)
            if odd is not None:
                where = units.format_vector(tuple(float(f"{c:.3g}") for c in odd), units.LENGTH)
                at = f" at {where}" if getattr(case.material, "turning", False) else ""
                raise fault("E369", support.at(), f"fibres of `{case.body.name}`{at} are not symmetric about the "
                                                  f"plane of `{support.name}`", "half does not represent the whole",
                            "model the whole body, or use a wall instead of the plane: `fixed(..., components = "
                            f"{'xyz'[axis]})`")  # fmt: skip


def _first_asymmetric_point(material: Any, X: Floats, axis: int, place: float) -> Floats | None:
    """Return the first of points X (n, 3), m, at which a law differs from its mirror image, or None.

    The mirror plane is normal to the coordinate `axis` at `place`, m.
    """
    from softmark.interpreter.problem.field_files import read_field
    from softmark.solvers.materials.active_stress import ActiveTension
    from softmark.solvers.materials.material_axes import InvalidDirection

    image, turned = X.copy(), np.ones(3)
    image[:, axis] = 2.0 * place - X[:, axis]
    turned[axis] = -1.0
    laws: tuple[Any, ...] = (material,)
    if hasattr(material, "passive"):  # the directions alone: how much it does is mirrored, as other constants are
        laws = ActiveTension(1.0, material.fibres), material.passive
    for law in laws:
        if not is_directed(law):
            continue
        try:
            here, there = law.placed(X[None], read_field), law.placed(image[None], read_field)
        except (
            InvalidDirection
        ) as error:  # of the body itself they are known already: `turned` in models/shared/heterogeneous_material.py
            return X[0] if error.place is None else np.array(error.place)
        for strained in STRAINED:
            F = np.broadcast_to(np.array(strained), (len(X), 3, 3))
            one, other = here.psi(F), there.psi(F * np.outer(turned, turned))
            odd = ~(abs(one - other) <= ALIKE * abs(one))
            if odd.any():
                return np.asarray(X[int(np.argmax(odd))])
    return None


def must_be_isotropic(reference: Declared, case: Case) -> None:
    """Refuse a theory of isotropic bodies for a body with fibres. Raises Fault."""
    if has_directed_material(case):
        raise fault(
            "E364",
            reference.at(),
            f"`{reference.name}` assumes an isotropic solid, but the material of `{case.body.name}` has fibres",
            "only for isotropic materials",
            "compare with measured or published data, or with a finer model: `self_converged(...)`",
        )
