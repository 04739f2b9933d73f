"""Warnings about unusual but allowed values, and about unused declarations.

To add a warning: write a function that yields diagnostics, and add a line in LINTS.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from typing import Any

from softmark.grammar import tree
from softmark.grammar.diagnostic import Diagnostic, Fix, Remedy
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Location, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import find_time_dependent
from softmark.interpreter.metrics.frequency import Frequency
from softmark.interpreter.planning.run_plan import find_needed
from softmark.interpreter.vocabulary.amplitude_words import PerState
from softmark.interpreter.vocabulary.analysis_words import Dynamic, Quasistatic
from softmark.interpreter.vocabulary.loads.body_force import BodyForce

LIGHTEST, HEAVIEST = 10.0, 30_000.0  # kg/m^3: a light foam, and more than osmium
SOFTEST, STIFFEST = 10.0, 2e12  # Pa: a very soft gel, and stiffer than diamond
STRONGEST_PULL = 100.0  # m/s^2
WRITTEN = re.compile(r"[\d.]+(?:[eE][+-]?\d+)?\s*[^\s()]*")  # a number with its unit, and no name of a parameter
DENSITY: units.Dimension = (-3, 1, 0, 0, 0)


def _materials(scene: Scene) -> Iterator[tuple[Any, Callable[[str], Location]]]:
    """Yield each material of the scene, with a function for the locations of its fields.

    For a material given inside a body, these are the location of the body's field.
    """
    declared = {id(d.thing) for d in scene.declared.values() if d.kind == "material"}
    for material in scene.of_kind("material").values():
        yield material.thing, material.at
    for body in scene.of_kind("body").values():
        if id(body.thing.material) not in declared:
            yield body.thing.material, lambda field, body=body: body.at("material")  # type: ignore[misc]
    for region in scene.of_kind("region").values():
        if region.thing.material is not None and id(region.thing.material) not in declared:
            yield region.thing.material, lambda field, region=region: region.at("material")  # type: ignore[misc]


def _warn_of_unusual_densities(scene: Scene) -> Iterator[Diagnostic]:
    for material, at in _materials(scene):
        density = material.density
        if not isinstance(density, float | int):  # varies in space
            continue
        if not LIGHTEST <= density <= HEAVIEST:
            factor = 1000.0 if density < LIGHTEST else 1e-3
            meant = units.format_value(density * factor, DENSITY)
            likely = LIGHTEST <= density * factor <= HEAVIEST
            water, at_ = "water has 1000 kg/m^3, or 1 g/cm^3", at("density")
            plain = Fix(meant) if WRITTEN.fullmatch(at_.text) else None
            help = Remedy(f"{water}; did you mean {meant}?", plain) if likely else water
            yield diagnostic("W303", at_,
                             f"a density of {units.format_value(density, DENSITY)} is unlikely for a solid",
                             "off by a factor of 1000?" if likely else "unusual value", help)  # fmt: skip


def _warn_of_unusual_stiffnesses(scene: Scene) -> Iterator[Diagnostic]:
    for material, at in _materials(scene):
        young = None if getattr(material, "directed", False) else material.young
        if not isinstance(young, float | int):  # varies in space, or is missing
            continue
        if young < SOFTEST:
            help = "soft gels have some 100 Pa; `mPa` is a thousandth of a pascal, `MPa` a million"
        elif young > STIFFEST:
            help = "steel has 210 GPa, diamond 1.1 TPa"
        else:
            continue
        yield diagnostic(
            "W310",
            at("young"),
            f"a Young's modulus of {_pascals(young)} is unlikely for a solid",
            "unusual value",
            help,
        )


def _warn_of_unstable_constants(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about constants with which a finite strain law loses stability, if a model uses such a law."""
    if all(getattr(model.thing, "strain", "") != "finite" for model in scene.of_kind("model").values()):
        return
    for material, at in _materials(scene):
        if (known := getattr(material, "polyconvexity_violation", None)) is not None:
            field, why = known
            yield diagnostic("W396", at(field), f"the law is not polyconvex: {why}", "may become unstable",
                             "use `neo_hookean_isochoric` or `stable_neo_hookean`, which are always stable; "
                             "instability of the solution is reported (W366)")  # fmt: skip


def _pascals(young: float) -> str:
    return f"{young:.6g} Pa" if young < SOFTEST else units.format_value(young, units.PRESSURE)


def _warn_of_unusual_gravity(scene: Scene) -> Iterator[Diagnostic]:
    for declared in scene.of_kind("load").values():
        action = declared.thing.action
        pull = math.hypot(*action.acceleration) if isinstance(action, BodyForce) else 0.0
        if pull > STRONGEST_PULL * (1.0 + 1e-12):  # directions have unit length up to rounding
            yield diagnostic("W307", declared.at(declared.thing.strength),
                             f"gravity of {pull:g} m/s^2 is {pull / 9.81:.0f} times that of Earth",
                             "very strong", "on Earth it is 9.81 m/s^2")  # fmt: skip


def _warn_of_idle_dashpots(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about dashpots in an analysis in which nothing has a velocity."""
    analysis = next(iter(scene.of_kind("analysis").values()), None)
    if analysis is not None and isinstance(analysis.thing, Dynamic):
        return
    for bed in scene.of_kind("support").values():
        if bed.thing.damping:
            where = f"in `{analysis.name}`" if analysis else "in a static analysis"
            problem = f"the dashpots of `{bed.name}` have no effect {where}"
            help = "declare `dynamic(...)`, or remove the damping: dashpots act on velocities"
            yield diagnostic("W370", bed.at("damping"), problem, "needs a dynamic analysis", help)


def _warn_of_predetermined_results(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about expectations whose truth is known before anything is computed."""
    for expectation in scene.expectations:
        # a name with a dot is a metric of a model, be the model in error or not, or a parameter of a used scene
        names = (n.text for n, _ in tree.walk(expectation.node) if isinstance(n, tree.Name) and n.parts[1:])
        if all(name in scene.parameters for name in names):
            yield diagnostic("W311", expectation.location, "this expectation does not depend on any computed result",
                             "the same in every run",
                             "compare a metric of a model or reference, such as `rod.eta`")  # fmt: skip


def _warn_of_registered_surfaces(scene: Scene) -> Iterator[Diagnostic]:
    for reference in scene.of_kind("reference").values():
        if reference.thing.registered == "icp":
            yield diagnostic("W316", reference.at("register"),
                             f"`{reference.name}` is registered to each computed surface before it is compared",
                             "hides errors",
                             "use `clamp` to register the fixed face only: errors that look like a rigid motion "
                             "disappear")  # fmt: skip


def _warn_of_static_amplitudes(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about amplitudes over time in a static analysis, which has no time."""
    if any(isinstance(a.thing, Dynamic | Quasistatic) for a in scene.of_kind("analysis").values()):
        return
    for declared in find_time_dependent(scene):
        if declared.thing.amplitude is not None and not isinstance(declared.thing.amplitude, PerState):
            yield diagnostic("W317", declared.at("amplitude"),
                             f"the `amplitude` of `{declared.name}` has no effect in a static analysis",
                             "a static analysis has no time",
                             "declare `analysis NAME = dynamic(...)` to follow the motion; here it acts at its full "
                             "value")  # fmt: skip


def _check_half_models(scene: Scene) -> Iterator[Diagnostic]:
    """Warn that a half model has only symmetric modes, so that another mode may have the lowest frequency."""
    mirrors = [s for s in scene.of_kind("support").values() if s.thing.is_symmetry_plane]
    for metric in scene.of_kind("metric").values():
        own = [s.name for s in mirrors if isinstance(metric.thing, Frequency) and s.thing.body == metric.thing.body]
        if own:
            yield diagnostic("W383", metric.at(),
                             f"`{metric.name}` finds only modes that are symmetric about the plane of `{own[0]}`",
                             "other modes may have lower frequencies",
                             "model the whole body, which also has the other modes")  # fmt: skip


def find_idle_models(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about models that no metric or expectation needs, so that they are not computed."""
    asked = find_needed(scene)
    for name, model in scene.of_kind("model").items():
        if name not in asked:
            yield diagnostic("W308", model.at(), f"no metric or expectation needs `{name}`, so it is not computed",
                             "not needed",
                             "add a probe, a metric or an expectation of its body")  # fmt: skip


def find_unused_names(scene: Scene) -> Iterator[Diagnostic]:
    """Warn about names that nothing refers to.

    A scene without models and references is a library of names and gets no warning.
    """
    if not any(scene.of_kind(kind) for kind in ("model", "reference")):
        return
    for name, at in scene.unused.items():
        kind = "parameter" if name in scene.parameters else "scene"
        if name in scene.declared:
            kind = scene.declared[name].kind
        if kind in ("parameter", "material", "shape", "body", "scene"):
            remedy = "refer to it, or remove it"
            yield diagnostic("W309", at, f"nothing uses the {kind} `{name}`", "not used", remedy)


LINTS: tuple[Callable[[Scene], Iterator[Diagnostic]], ...] = (
    _warn_of_unusual_densities,
    _warn_of_unusual_stiffnesses,
    _warn_of_unstable_constants,
    _warn_of_unusual_gravity,
    _warn_of_idle_dashpots,
    _warn_of_registered_surfaces,
    _warn_of_static_amplitudes,
    _warn_of_predetermined_results,
    _check_half_models,
)
