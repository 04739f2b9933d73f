"""What cannot be of materials that know directions: asked of scenes that have one alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.messages import diagnostic
from softmark.interpreter.language.scene import Declared, Scene
from softmark.interpreter.problem.case import Case, fault
from softmark.interpreter.vocabulary.analyses import Dynamic

FEM = "use `fem(...)` with `strain = finite`, which takes every law as it is"


def directed(material: Any) -> bool:
    """Whether a material knows directions: of a plate, what it is made of."""
    plate = material if not material.thin else material.of
    return bool(getattr(plate, "directed", False))


def of_case(case: Case) -> bool:
    """Whether one of the materials of a case does."""
    return any(directed(material) for material in case.materials)


def materials(scene: Scene) -> Iterator[Diagnostic]:
    """Directions that are missing, and muscle of what cannot pull."""
    for declared in scene.of_kind("material").values():
        thing = declared.thing
        if not directed(thing):
            continue
        if thing.branches:
            yield diagnostic("E363", declared.at("law"), f"`{declared.name}` relaxes around a law with fibres, and "
                             "relaxation is known of isotropic laws alone", "knows no directions",
                             "use a law without fibres, or the law by itself")  # fmt: skip
            continue
        if hasattr(thing, "passive"):
            yield from _muscle(declared)
            continue
        from softmark.solvers.materials.anisotropic import missing_sheets
        from softmark.solvers.materials.frame import Frame, NoDirection

        if missing_sheets(thing):
            yield diagnostic("E366", declared.at("fibres"), f"`{declared.name}` is unlike in directions across its "
                             "fibres, and nothing says which these are", "no sheets",
                             "give `sheets = +y`, or a rule that knows sheets, as `helix(...)` does")  # fmt: skip
        elif not thing.turning:
            try:
                Frame.of(thing.fibres, thing.sheets)
            except NoDirection as error:
                yield diagnostic("E366", declared.at("sheets"), f"`{declared.name}` has no direction across its "
                                 f"fibres: {error.reason}", "no direction", "sheets lie across fibres")  # fmt: skip
        for name in ("fibres", "sheets"):
            if wrong := getattr(getattr(thing, name), "fault", ""):
                yield diagnostic("E366", declared.at(name), f"the {name} of `{declared.name}` have no rule: {wrong}",
                                 "no wall", "give the wall's own semi-axes")  # fmt: skip


def _muscle(declared: Declared) -> Iterator[Diagnostic]:
    thing = declared.thing
    law = thing.passive
    if thing.fibres is None:
        yield diagnostic("E367", declared.at("law"), f"`{declared.name}` pulls along fibres, and its law has none",
                         "no fibres", "give `own = +x`, or a law with fibres, such as `guccione(...)`")  # fmt: skip
    elif law.finite_law() is None or hasattr(law, "passive") or law.branches:
        why = "pulls already" if hasattr(law, "passive") else "has no law of finite strain"
        why = "relaxes" if law.branches else why
        yield diagnostic("E367", declared.at("law"), f"`{declared.name}` is of what {why}",
                         "not a law that it can add to",
                         "use `guccione(...)` or `neo_hookean(...)`, and one tension")  # fmt: skip
    elif not law.uniform and not getattr(law, "turning", False):
        yield diagnostic("E367", declared.at("law"), f"`{declared.name}` is of what varies in space",
                         "one value of each constant", "directions may vary, other constants not")  # fmt: skip


def model(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """A model that would take a material for an isotropic one, or a motion that muscle is not known in."""
    thing, body = declared.thing, case.body.name
    if not getattr(thing, "directed", False):
        yield diagnostic("E363", declared.at(), f"`{declared.name}` knows isotropic materials alone, and that of "
                         f"`{body}` has fibres", "knows no directions", FEM)  # fmt: skip
    elif thing.strain != "finite":
        yield diagnostic("E363", declared.at("strain"), f"the material of `{body}` has fibres, and strain = "
                         f"{thing.strain} takes every material for an isotropic one", "knows no directions",
                         "use `strain = finite`")  # fmt: skip
    elif case.planar:
        yield from _planar(declared, case)
    elif isinstance(case.analysis, Dynamic) and any(hasattr(m, "passive") for m in case.materials):
        yield diagnostic("E368", declared.at(), f"`{declared.name}` moves, and muscle pulls at rest alone",
                         "not in a dynamic analysis", "use `static()`, in which tension grows with loads, or the law"
                         " without `active`")  # fmt: skip


def _planar(declared: Declared, case: Case) -> Iterator[Diagnostic]:
    """Directions that would move a slice out of its plane."""
    kind = case.planar.replace("_", " ")
    for material in case.materials:
        if case.planar == "plane_stress" and directed(material):
            yield diagnostic("E365", case.body.at("material"), f"`{case.body.name}` is in plane stress, which is not "
                             "known of a material with fibres", "not in plane stress",
                             "use `plane_strain`, or a `solid` as thick as the plate")  # fmt: skip
        elif directed(material) and not _level(material):
            yield diagnostic("E365", case.body.at("material"), f"fibres of `{case.body.name}` lie neither within its "
                             f"plane nor along z, and would move it out of {kind}", "askew",
                             "the same for all z are directions within x and y, or +z alone; else use a `solid`"
                             )  # fmt: skip


def _level(material: Any) -> bool:
    """Whether directions lie within the plane or across it; of a rule, whether it says so."""
    each = [d for d in (material.fibres, material.sheets) if d is not None]
    for direction in each:
        if not isinstance(direction, tuple):
            third = getattr(direction, "components", (None, None, None))[2]
            if third is None or third.root.do != "number" or third.root.value != 0.0:
                return False
        elif direction[2] != 0.0 and (direction[0] != 0.0 or direction[1] != 0.0):
            return False
    return True


def must_be_isotropic(reference: Declared, case: Case) -> None:
    """Raises Fault for a theory of isotropic bodies, of one with fibres."""
    if of_case(case):
        raise fault("E364", reference.at(), f"`{reference.name}` is solved for an isotropic solid, and the material of "
                    f"`{case.body.name}` has fibres", "knows no directions", "compare with what was measured or "
                    "published, or with a finer model: `self_converged(...)`")  # fmt: skip
