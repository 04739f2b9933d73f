"""Trial scenes for each word: a scene must be refused or solved, without an exception or a missing number."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic, Source
from softmark.interpreter.cli.conformance import Breach
from softmark.interpreter.cli.conformance.law_contracts import law_breaches
from softmark.interpreter.cli.conformance.load_contracts import load_breaches
from softmark.interpreter.cli.conformance.metric_contracts import metric_breaches
from softmark.interpreter.cli.conformance.word_contracts import repr_breaches
from softmark.interpreter.help.constructor_examples import example
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.field_schema import Constructor
from softmark.interpreter.language.loaded_plugin import find_faulty_plugin, format_exception
from softmark.interpreter.problem.body_case import Fault, case_for, case_of
from softmark.interpreter.results.state_results import ANSWERED, LEFT_OUT
from softmark.interpreter.validation.scene_loader import load_scene
from softmark.records import dataclass

GEL = "neo_hookean(young = 60 kPa, poisson = 0.3, density = 1000 kg/m^3)"
BOX = "box(size = (40, 20, 20) mm, origin = (0, -10, -10) mm)"
CELLS = "fem(hex8, strain = corotational, size = 10 mm)"
WEIGHT = "gravity(1 m/s^2)"
CLAMP = "support wall = fixed(bar, where = x <= 0 mm)\n"
LOOK = "probe tip = point(bar, at = (40, 0, 0) mm)\n"
LOADED = {  # one example of each load
    "gravity": WEIGHT,
    "remote_stress": "remote_stress(bar, where = x >= 40 mm, magnitude = 1 Pa, direction = +x)",
    "traction": "traction(bar, where = x >= 40 mm, vector = (0, 0, -1) Pa)",
    "pressure": "pressure(bar, where = z >= 10 mm, magnitude = 1 Pa)",
    "point_force": "point_force(bar, at = (40, 0, 0) mm, vector = (0, 0, -0.1) mN)",
    "torque": "torque(bar, where = x >= 40 mm, moment = (0, 0, 1) uN*m)",
    "line_load": "line_load(bar, from = (0, 0, 0) mm, to = (40, 0, 0) mm, vector = (0, 0, -1) mN/m)",
    "centrifugal": "centrifugal(bar, axis = +z, speed = 1 rad/s)",
    "tendon": "tendon(bar, from = (0, 0, 5) mm, to = (40, 0, 5) mm, tension = 0.1 mN)",
}
MOTIONS = {"rest": "", "motion": "analysis a = dynamic(duration = 2 ms, step = 1 ms)\n"}
NAMES = {  # placeholders in examples, and the names of the trial scene that replace them
    "NAME_OF_BODY": "bar", "NAME_OF_PROBE": "tip", "NAME_OF_REFERENCE": "truth", "NAME_OF_MODEL": "cells",
    "NAME_OF_SUPPORT": "wall", "NAME_OF_LOAD": "push", "NAME_OF_MATERIAL": "gel", "NAME_OF_METRIC": "sag",
    "NAME_OF_ANOTHER_METRIC": "sag",
}  # fmt: skip
GIVE = 'give a call that fits a beam of 40 mm along x: `SOFTMARK = {..., "examples": {"word": "word(...)"}}`'
BEAMS = ((GEL, WEIGHT), (GEL.replace("0.3", "0"), "gravity(1 m/s^2, direction = +x)"))  # beams for theories


@dataclass(frozen=True)
class Trial:
    """Word with an example `call` and its plugins, from which trial scenes are made."""

    word: Constructor
    call: str
    folder: Path
    plugins: tuple[str, ...] = ()

    def scene(self, **other: str) -> tuple[Scene | None, list[Diagnostic]]:
        """Return the standard trial scene (None if it has errors) and its errors.

        The trial scene is a clamped beam; `other` replaces some of its lines.
        """
        lines = {"gel": GEL, "box": BOX, "push": WEIGHT, "model": CELLS, "more": "", "motion": ""} | other
        return self._load_lines(
            f"material gel = {lines['gel']}\nbody bar = solid({lines['box']}, gel)\n"
            f"{CLAMP}{LOOK}load push = {lines['push']}\nmodel cells = {lines['model']}\n"
            f"metric sag = displacement(tip, along = -z)\n{lines['motion']}{lines['more']}"
        )

    def body(self) -> tuple[Scene | None, list[Diagnostic]]:
        """Return a scene (None if it has errors) and its errors; the scene has only a body of the tested shape."""
        return self._load_lines(f"material gel = {GEL}\nbody bar = solid({self.call}, gel)\n")

    def _load_lines(self, lines: str) -> tuple[Scene | None, list[Diagnostic]]:
        source = Source("contract", f'softmark 1\nscene "contract"\n{lines}')
        scene, found = load_scene(source, self.folder, self.folder / "contract.scene", plugins=self.plugins)
        return scene, [d for d in found if d.severity == "error"]


def example_call(word: Constructor, given: Mapping[str, str]) -> str:
    """Return a call of a word that fits the trial scene.

    It is the example that the plugin gives, or a call with a sample value for each field.
    """
    call = given.get(word.name) or example(word)
    return re.sub("|".join(sorted(NAMES, key=len, reverse=True)), lambda m: NAMES[m[0]], call)


def trial_breaches(trial: Trial) -> Iterator[Breach]:
    """Yield the breaches of the contract for plugins that trial scenes with a word show.

    Each kind of word has its own test, such as a run with a model. An exception is a breach, too.
    """
    found: list[Breach] = []
    try:
        found += _KINDS[trial.word.kind](trial)
    except Exception as error:
        what = find_faulty_plugin(error) or format_exception(error)
        found.append(Breach(f"a scene with it fails: {what}", "refuse unsupported input with a message"))
    yield from found


def _breach_of_refused_trial(errors: Sequence[Diagnostic], trial: Trial) -> Breach:
    """Return the breach that a word could not be tested, because its trial scene was refused with `errors`."""
    first = errors[0]
    return Breach(f"`{trial.call}` is refused ({first.code}): {first.message}", GIVE, untried=True)


def _run_breaches(trial: Trial, scene: Scene) -> Iterator[Breach]:
    """Run a scene twice and yield breaches.

    The model must be solved, every metric must have a number or a reason, and both runs must give equal numbers.
    """
    from softmark.interpreter.pipeline.run_pipeline import RunOptions, run_scene

    first, again = (run_scene(scene, (), RunOptions(draw=False, only=("cells",))) for _ in range(2))
    model, other = first.models["cells"], again.models["cells"]
    if model.status not in ANSWERED:
        untried = model.status in LEFT_OUT
        yield Breach(f"the scene with it is {model.status.replace('_', ' ')}: {model.message}",
                     "make it solve a beam of 40 mm that is held at one end", untried)  # fmt: skip
        return
    for name, result in model.metrics.items():
        if result.value is None and (result.reason or "").startswith("the plugin"):
            yield Breach(f"`{name}`: {result.reason}", '`raise Undefined("why")` if it has no value')
        if result.value != other.metrics[name].value:
            yield Breach(
                f"`{name}` is {result.value!r} and then {other.metrics[name].value!r}",
                "keep nothing between solutions, and use no random numbers",
            )


# ------------------------------------------------------------------ by kind


def _material_breaches(trial: Trial) -> Iterator[Breach]:
    from softmark.solvers.materials import NoFiniteLaw, law_for

    for strain in ("finite", "corotational"):
        scene, errors = trial.scene(gel=trial.call, model=CELLS.replace("corotational", strain))
        if scene is not None:
            break
    if scene is None:
        yield _breach_of_refused_trial(errors, trial)
        return
    thing = scene.declared["gel"].thing
    yield from repr_breaches(thing)
    names = {f.name for f in trial.word.fields}
    unit = replace(thing, young=1.0) if "young" in names else thing
    try:
        law = law_for(unit, "finite")
    except NoFiniteLaw:
        yield from _run_breaches(trial, scene)
        return
    mu, lam = unit.shear_modulus, unit.lame_lambda
    if np.isfinite(lam):
        yield from law_breaches(
            law if mu < 10.0 else _ScaledLaw(law, mu), mu if mu < 10.0 else 1.0, lam if mu < 10.0 else lam / mu
        )
    yield from _run_breaches(trial, scene)


@dataclass(frozen=True)
class _ScaledLaw:
    """Constitutive law divided by its shear modulus `mu`."""

    law: Any
    mu: float

    def psi(self, F: Any) -> Any:
        """Return the energy density divided by the shear modulus, shape (n,)."""
        return self.law.psi(F) / self.mu

    def P(self, F: Any) -> Any:
        """Return the first Piola-Kirchhoff stress divided by the shear modulus, shape (n, 3, 3)."""
        return self.law.P(F) / self.mu

    def dPdF(self, F: Any) -> Any:
        """Return the elasticity tensor dP/dF divided by the shear modulus, shape (n, 3, 3, 3, 3)."""
        return self.law.dPdF(F) / self.mu


def _load_or_report_refusal(trial: Trial, name: str, **lines: str) -> Generator[Breach, None, Scene | None]:
    """Yield breaches and return the trial scene with the given `lines`, or None if the scene refuses the word.

    The repr of the declared object `name` is tested too.
    """
    scene, errors = trial.scene(**lines)
    if scene is None:
        yield _breach_of_refused_trial(errors, trial)
        return None
    yield from repr_breaches(scene.declared[name].thing)
    return scene


def _load_breaches(trial: Trial) -> Iterator[Breach]:
    from softmark.interpreter.models.shared.model_declaration import Model

    scene = yield from _load_or_report_refusal(trial, "push", push=trial.call)
    if scene is None:
        return
    push = scene.declared["push"].thing
    if push.strength not in {f.attribute for f in trial.word.fields}:
        yield Breach(
            f"`strength` of the load is {push.strength}, which is not a field of `{trial.word.name}`",
            "name the field with its magnitude",
        )
        return
    if not isinstance(push.action, Model.loads):
        yield Breach(f"it acts as {type(push.action).__name__}", "most models refuse it", untried=True)
        return
    broken = list(load_breaches(push))
    yield from broken or _run_breaches(trial, scene)


def _probe_breaches(trial: Trial) -> Iterator[Breach]:
    lines = f"probe one = {trial.call}\nmetric own = displacement(one, along = -z)\n"
    scene = yield from _load_or_report_refusal(trial, "one", more=lines)
    if scene is None:
        return
    X = np.array(scene.declared["one"].thing.stations, dtype=np.float64)
    if X.ndim != 2 or X.shape[1] != 3 or not len(X) or not np.isfinite(X).all():
        yield Breach(f"its stations are {X.shape}", "return at least one point (x, y, z), in m")
        return
    yield from _run_breaches(trial, scene)


def _metric_breaches(trial: Trial) -> Iterator[Breach]:
    lines = f"reference truth = small_deflection(bar)\nmetric one = {trial.call}\n"
    scene = yield from _load_or_report_refusal(trial, "one", more=lines)
    if scene is None:
        return
    broken = list(metric_breaches(trial.word.cls, scene.declared["one"].thing, case_of(scene, "bar")))
    yield from broken or _run_breaches(trial, scene)


def _reference_breaches(trial: Trial) -> Iterator[Breach]:
    from softmark.interpreter.problem.theories.reference_solution import solve_theory

    why = ""
    for gel, push in BEAMS:
        scene, errors = trial.scene(gel=gel, push=push, more=f"reference one = {trial.call}\n")
        if scene is None:
            why = errors[0].message
            continue
        declared = scene.declared["one"]
        yield from repr_breaches(declared.thing)
        if declared.thing.how == "measured":
            yield from _measured_data_breaches(declared.thing)
            return
        case, X = case_for(scene, declared), np.array([[0.0, 0.0, 0.0], [0.02, 0.005, 0.0], [0.04, 0.0, -0.01]])
        try:
            first, again = (solve_theory(declared, case) for _ in range(2))
        except Fault as fault:
            why = fault.diagnostic.message
            continue
        yield from _theory_breaches(first, again, X)
        return
    yield Breach(
        f"it applies to neither beam that it was tested on: {why}", "test it in a scene of its own", untried=True
    )


def _theory_breaches(first: Any, again: Any, X: Any) -> Iterator[Breach]:
    u, v = np.asarray(first.displacement(X)), np.asarray(again.displacement(X))
    if u.shape != X.shape or not np.isfinite(u).all():
        yield Breach(f"its displacements of 3 points are {u.tolist()}", "return finite numbers (n, 3), m")
    elif not np.array_equal(u, v):
        yield Breach("its two solutions of the same problem differ", "keep nothing between solutions")
    if not (np.isfinite(first.estimated_error) and first.estimated_error >= 0.0):
        yield Breach(f"its estimated error is {first.estimated_error}", "return the largest error, m")


def _measured_data_breaches(thing: Any) -> Iterator[Breach]:
    from softmark.references.measured_curve import MeasuredCurve
    from softmark.references.measured_data import MeasuredPoints, MeasuredSurface
    from softmark.references.published_values import KnownValue

    kinds = (MeasuredCurve, MeasuredPoints, MeasuredSurface, KnownValue)
    if not isinstance(found := thing.load(), kinds):
        words = ", ".join(k.__name__ for k in kinds)
        yield Breach(f"`load` returns a {type(found).__name__}", f"return one of {words}")


def _model_breaches(trial: Trial) -> Iterator[Breach]:
    taken = 0
    for load, push in LOADED.items():
        for motion, line in MOTIONS.items():
            scene, errors = trial.scene(model=trial.call, push=push, motion=line)
            if scene is None:
                if any(not d.message or d.span is None for d in errors):
                    yield Breach(
                        f"it refuses {load} in {motion} without a location",
                        "write `diagnostic(code, declared.at(), ...)`",
                    )
                continue
            taken += 1
            outline = scene.declared["cells"].thing.outline(case_for(scene, scene.declared["cells"]))
            if len(outline) <= 5 or "\n" in outline:
                yield Breach(f"its outline is {outline!r}", "return what will be built, on one line")
            yield from _run_breaches(trial, scene)
    if not taken:
        yield _breach_of_refused_trial(errors, trial)


def _shape_breaches(trial: Trial) -> Iterator[Breach]:
    from softmark.references.surface_geometry import signed_volume

    scene, errors = trial.body()
    if scene is None:
        yield _breach_of_refused_trial(errors, trial)
        return
    shape = scene.declared["bar"].thing.shape
    yield from repr_breaches(shape)
    size = max(0.005, (shape.diagonal or float(np.linalg.norm(np.ptp(shape.surface(0.005)[0], axis=0)))) / 10.0)
    mesh = shape.mesh("tet4", size)
    inside, volume = signed_volume(*shape.surface(size)), float(mesh.volumes.sum())
    if not np.isclose(inside, volume, rtol=1e-6):
        yield Breach(
            f"its surface encloses {inside:.6g} m^3, its cells are {volume:.6g}", "make it closed, with outward normals"
        )


_KINDS: Mapping[str, Callable[[Trial], Iterator[Breach]]] = {
    "material": _material_breaches,
    "load": _load_breaches,
    "probe": _probe_breaches,
    "metric": _metric_breaches,
    "reference": _reference_breaches,
    "model": _model_breaches,
    "shape": _shape_breaches,
}


def adapter_breaches(word: str, program: Any, module: Any, folder: Path, plugins: tuple[str, ...]) -> Iterator[Breach]:
    """Yield breaches of the adapter of an external program.

    The adapter must have an installation command. If the program is installed, a trial scene with it must be solved.
    """
    from softmark.interpreter.validation.constructor_registry import CATALOGUE

    if not isinstance(module.install, str) or len(module.install) < 4:
        yield Breach("`install` does not explain how to install it", "give a command, such as `pip install ...`")
    if module.version() is None:
        yield Breach(f"it is not installed here: {module.install}", "install it to test it", untried=True)
        return
    strain, laws = next(iter(program.laws.items()))
    law, outside = CATALOGUE.constructor("material", laws[0]), CATALOGUE.constructor("model", "external_solver")
    assert law is not None
    assert outside is not None
    call = f"external_solver({word}, element = {program.elements[0]}, strain = {strain}, size = 10 mm)"
    trial = Trial(outside, call, folder, plugins)
    scene, errors = trial.scene(gel=example(law), model=call)
    yield from [_breach_of_refused_trial(errors, trial)] if scene is None else _run_breaches(trial, scene)
