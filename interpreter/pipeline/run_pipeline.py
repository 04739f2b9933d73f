"""Run of a scene from its text to its report; `run_to_report` has one line for each step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from softmark import pausing
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.pipeline.run_options import CheckedScene, RunOptions, SceneText
from softmark.interpreter.planning.run_plan import plan_of
from softmark.interpreter.validation.requested_names import unknown_models, without_unrequested_warnings
from softmark.interpreter.validation.scene_loader import load_scene

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.cached_results import RunCache
    from softmark.interpreter.pipeline.run_state import StateRun
    from softmark.interpreter.results.run_report import Report

__all__ = ["CheckedScene", "RunOptions", "SceneText", "check_text", "run_scene", "run_to_report"]


def run_to_report(given: SceneText | CheckedScene, options: RunOptions, keeper: RunCache | None = None) -> Report:
    """Return the report of a scene, given as a text or as a checked scene.

    After each solved model the callback `options.keep` gets an unfinished report. Saved results of a `keeper` are
    reused, and new ones are saved with it. Raises SceneError before solving if the scene has errors or cannot be built,
    and OutdatedResults if reused results do not agree with computed ones.
    """
    sound = given if isinstance(given, CheckedScene) else check_text(given, options)  # grammar, language, validation
    options.begin(sound.scene)
    plan = plan_of(sound.scene, options.only)  # planning: only what is requested

    from softmark.interpreter.pipeline import cached_results, report_assembly, run_state  # with numpy

    known = cached_results.load_saved_results(sound.scene, plan, options, keeper)
    works = run_state.make_state_runs(sound.scene, plan, options, sound.warnings, known)  # one per state
    if not cached_results.reuse_everything(works):
        from softmark.interpreter.pipeline import model_runs, probe_sampling, reference_runs  # with solvers
        from softmark.solvers.runtime.thread_limits import ALONE

        pausing.resume_collection()
        with ALONE:
            for work in works:
                reference_runs.read_measurements(work)  # references: data that probes and supports may use
                probe_sampling.place_probes(work)  # problem: points of the probes
                model_runs.prepare_models(work)  # models: meshes, energies, supports and loads as arrays
            for work in works:
                reference_runs.solve_references(work)  # references: theories, and limits of refinement
            for name in plan.models:
                for work in works:
                    model_runs.solve_model(work, name)  # solvers; verification: forces by independent formulas
                _save_slow_model_early(works, name, keeper)  # metrics and verification of a slow model
                options.keep(report_assembly.unfinished_report(works))  # metrics so far; written by the report package
            for work in works:
                reference_runs.compute_model_references(work)  # references that depend on models
                cached_results.record_accuracy_warnings(work, work.models)
                model_runs.estimate_model_errors(work, work.models)  # verification: errors that models state
    report = report_assembly.finished_report(works)  # metrics and verification: measure, draw, judge expectations
    cached_results.save_results(works, keeper)
    return report


def _save_slow_model_early(works: Sequence[StateRun], name: str, keeper: RunCache | None) -> None:
    """Evaluate and save a slow model right after its solution, so that an interrupted run need not solve it again."""
    if keeper is None or name in works[0].taken or not keeper.worth_saving_early(works, name):
        return
    from softmark.interpreter.pipeline import cached_results, model_runs, report_assembly

    for work in works:
        cached_results.record_accuracy_warnings(work, (name,))
        model_runs.estimate_model_errors(work, (name,))
    report_assembly.measure_model(works, name)
    keeper.keep_early(works, name)


def check_text(text: SceneText, options: RunOptions) -> CheckedScene:
    """Parse, compile and check a scene text, and report its warnings. Raises SceneError with all errors."""
    scene, found = load_scene(text.source, text.folder, text.file, text.overrides, options.only, text.plugins)
    found = without_unrequested_warnings(scene, options.only, found)
    if scene is None:
        raise SceneError(found)
    options.warn(found)
    if problems := unknown_models(scene, options.only):
        raise SceneError(problems)
    return CheckedScene(scene, tuple(found))


def run_scene(scene: Scene, warnings: Sequence[Diagnostic], options: RunOptions) -> Report:
    """Return the report of a checked scene. Raises SceneError if some part of it cannot be built."""
    return run_to_report(CheckedScene(scene, tuple(warnings)), options)
