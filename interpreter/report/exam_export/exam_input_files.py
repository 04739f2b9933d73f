"""Export of models as input files of another program, with an exam sheet and instructions.

Each model has a folder.

If the states of a model are fractions of one load, the model becomes one problem with states in order. For any other
model there is a folder for each state.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.compiled_scene import Declared, Scene, SceneError
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.scene_states import in_state, states_of
from softmark.interpreter.models.external.exporters import FORMATS, import_format
from softmark.interpreter.models.external.exporters.named_parts import NamedParts, collect_named_parts
from softmark.interpreter.models.external.external_declaration import ExternalSolver
from softmark.interpreter.models.external.external_problem import ExternalMaterial, Problem
from softmark.interpreter.models.external.problem_transfer import (
    NotTransferable,
    Reason,
    problem_of,
    untransferable_case_features,
    untransferable_features,
    untransferable_loads,
)
from softmark.interpreter.models.model_preparation import Measurements, prepared_model
from softmark.interpreter.models.shared.prepared_model import BuildContext
from softmark.interpreter.pipeline.run_options import RunOptions
from softmark.interpreter.problem.body_case import Case, Fault, case_for
from softmark.interpreter.report.exam_export import exam_readme, exam_sheet
from softmark.interpreter.results import atomic_files
from softmark.records import dataclass

SAME = 1e-12  # tolerance of proportional loads and motions, relative to the last state
NAMELESS = (
    "regions with their own material are exported by name; other regions only as the nodes that they hold or load"
)

Told = list[tuple[Problem, NamedParts]]


@dataclass(frozen=True)
class ExportResult:
    """Result of an export: the folder, its files, and the things that were left out, with the reasons."""

    folder: Path
    written: tuple[str, ...]
    left: tuple[Reason, ...]


def export(scene: Scene, to: str, only: Sequence[str], folder: Path, options: RunOptions) -> ExportResult:
    """Export the models of a scene, by default all, in the format `to`, together with the exam sheet.

    `only` are the names of requested models. Raises SceneError for a model that cannot be built, if a model in `only`
    cannot be expressed in the format, and if no model can. Raises OSError if the folder cannot be written.
    """
    ready, refused = _exportable_models(scene, to, list(only) or list(scene.of_kind("model")), options)
    if (refused and only) or not ready:
        each = [_error(scene.declared[name], to, why) for name, why in refused.items()]
        raise SceneError(each or [_no_model_error(scene, to)])
    found = exam_sheet.make_sheet(scene, options)
    folder.mkdir(parents=True, exist_ok=True)
    written: list[str] = []
    found["models"] = {name: _write_model(name, each, to, folder, written) for name, each in ready.items()}
    followed = {name: list(_inexact_loads(scene, name)) for name in ready} if FORMATS[to].mesh else {}
    left = [(f"model `{name}`, {what}", why) for name, own in (refused | followed).items()
            for what, why in dict.fromkeys(own)]  # fmt: skip
    left += [(f"region `{name}`", NAMELESS) for name in _unexported_regions(scene, ready)]
    found["left"] += [{"what": what, "why": why} for what, why in left]
    exam_sheet.write(found, folder)
    atomic_files.replace(folder / exam_readme.FILE, exam_readme.readme_text(found, to))
    whole = tuple((own["what"], own["why"]) for own in found["left"])
    return ExportResult(folder, (*written, exam_sheet.FILE, exam_readme.FILE), whole)


def _exportable_models(
    scene: Scene, to: str, names: Sequence[str], options: RunOptions
) -> tuple[dict[str, Told], dict[str, list[Reason]]]:
    """Return the problems of the models that can be exported, and for other models the reasons. Raises SceneError."""
    ready, refused, faults = dict[str, Told](), dict[str, list[Reason]](), list[Diagnostic]()
    workshop = BuildContext(scene=scene, measured=Measurements(scene))
    for name in names:
        options.say("export", name)
        try:
            ready[name] = _problems_of_model(scene, name, to, workshop)
        except NotTransferable as untold:
            refused[name] = untold.reasons
        except Fault as fault:
            faults.append(fault.diagnostic)
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))
    return ready, refused


def _problems_of_model(scene: Scene, name: str, to: str, workshop: BuildContext) -> Told:
    """Return the problems of a model: one, or one for each state. Raises NotTransferable, Fault."""
    each, alone = [], FORMATS[to].mesh
    for own in [in_state(scene, i) for i in range(len(states_of(scene)))] or [scene]:
        declared = _as_softmark_model(own.declared[name])
        case = case_for(own, declared)
        if FORMATS[to].moves:
            each.append(_dynamic_problem(own.declared[name], case, workshop))
            continue
        if found := (untransferable_case_features if alone else untransferable_features)(
            declared.thing, case
        ):  # before anything is built
            raise NotTransferable(found)
        prepared: Any = prepared_model(declared, case, workshop)[0]
        each.append((problem_of(prepared, case, alone), collect_named_parts(prepared, case)))
    found = import_format(to).refuses(each[-1][0])
    if not found and FORMATS[to].by_name:
        found = import_format(to).unsupported_loads(*each[-1])
    if found:
        raise NotTransferable(found)
    shares = _load_fractions([problem for problem, _ in each])
    if shares is None:
        return each
    return [(replace(each[-1][0], shares=shares, values_of_states=states_of(scene)), each[-1][1])]


def _dynamic_problem(declared: Declared, case: Case, workshop: BuildContext) -> tuple[Problem, NamedParts]:
    """Return a dynamic problem with the time steps of the model. Raises NotTransferable, Fault."""
    from softmark.interpreter.models.external import external_builder

    model = _as_softmark_model(declared).thing
    if found := untransferable_features(model, case, moves=True):
        raise NotTransferable(found)
    if model.mass != "lumped" and not isinstance(
        declared.thing, ExternalSolver
    ):  # an external model has no field `mass`
        raise NotTransferable([(f"mass = {model.mass}", "the exported masses are nodal masses: use `mass = lumped`")])
    theirs = declared.thing
    if not isinstance(theirs, ExternalSolver) or not theirs.program_entry.moves:
        theirs = ExternalSolver("mujoco", model.element, model.strain, model.size, model.body, model.mesh)
    if found := list(theirs.invalid_step_options(case)):
        raise NotTransferable(found)
    prepared: Any = external_builder.build_external_dynamics(theirs, declared, case, workshop)
    return prepared.asked(), collect_named_parts(prepared.static, case)


def _inexact_loads(scene: Scene, name: str) -> Iterator[Reason]:
    """Yield the follower loads of a model with the reason; they are exported only as forces in the undeformed state."""
    declared = _as_softmark_model(scene.declared[name])
    yield from untransferable_loads(declared.thing, case_for(scene, declared))


def _unexported_regions(scene: Scene, ready: Iterable[str]) -> Iterator[str]:
    """Yield the names of regions that are not part of an exported mesh."""
    cases = [case_for(scene, scene.declared[name]) for name in ready]
    gone = {part.name for case in cases for part in case.parts}
    bodies = {case.body.name for case in cases}
    for name, region in scene.of_kind("region").items():
        if region.thing.body in bodies and name not in gone:
            yield name


def _as_softmark_model(declared: Declared) -> Declared:
    """Return the declaration of a model of an external program as a model of softmark with the same arguments."""
    return replace(declared, thing=declared.thing.solid) if isinstance(declared.thing, ExternalSolver) else declared


def _load_fractions(problems: Sequence[Problem]) -> tuple[float, ...] | None:
    """Return the loads and motions of each problem as fractions of those of the last problem.

    Return None if they are not proportional.
    """
    each = [np.concatenate([own.forces.ravel(), own.values]) for own in problems]
    last = max(float(each[-1] @ each[-1]), np.finfo(float).tiny)
    if any(len(own) != len(each[-1]) for own in each):
        return None
    found = [float(own @ each[-1]) / last for own in each[:-1]]
    parts = (np.linalg.norm(own - s * each[-1]) <= SAME * last**0.5 for own, s in zip(each[:-1], found, strict=True))
    return (*found, 1.0) if all(parts) else None


def _write_model(name: str, each: Told, to: str, folder: Path, written: list[str]) -> dict[str, Any]:
    """Write the input files of a model and return its entry in the exam sheet."""
    own: list[str] = []
    for number, (problem, named) in enumerate(each, start=1):
        place = Path(name) if len(each) == 1 else Path(name) / f"state-{number}"
        home = atomic_files.make_inner_folder(folder, *place.parts)
        with tempfile.TemporaryDirectory(
            dir=home, prefix=".part-"
        ) as made:  # a format may write its files in several steps
            for file in import_format(to).export(problem, named, Path(made)):
                os.replace(Path(made) / file, home / file)
                own.append((place / file).as_posix())
    written += own
    problem, named = each[-1]
    motion = {} if problem.motion is None else {"step": problem.motion.step, "steps": problem.motion.count}
    return motion | {
        "files": own,
        "element": problem.element,
        "strain": problem.strain,
        "nodes": len(problem.points),
        "cells": len(problem.cells),
        "shares": list(problem.shares),
        "materials": {part: _material_entry(stuff) for part, stuff in zip(named.parts, problem.stuff, strict=True)},
    }


def _material_entry(stuff: ExternalMaterial) -> Mapping[str, Any]:
    return {"law": stuff.law, **stuff.constants, **stuff.choices, "density": stuff.density}


def _error(declared: Declared, to: str, why: Sequence[Reason]) -> Diagnostic:
    listed = "; ".join(dict.fromkeys(f"{what} ({reason})" for what, reason in why))
    return diagnostic(
        "E720",
        declared.at(),
        f"`{declared.name}` cannot be exported to {to}: {listed}",
        "cannot be expressed in that format",
        "choose with `--model` a `fem(...)` model whose element, strain and law the other program supports; if the "
        "body, analysis, supports or loads are the problem, remove them from a copy of the scene",
    )


def _no_model_error(scene: Scene, to: str) -> Diagnostic:
    help = "declare one: `model bricks = fem(hex8, strain = small, size = 5 mm)`"
    return Diagnostic("E720", f"`{scene.title}` has no model to export to {to}", scene.source, None, help=help)
