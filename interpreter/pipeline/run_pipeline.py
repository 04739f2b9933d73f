"""From the text of a scene to its report: `report_of` is the way, a step a line, each with the room that takes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from softmark import pausing
from softmark.interpreter.language.compiled_scene import SceneError
from softmark.interpreter.pipeline.run_options import Options, Sound, Text
from softmark.interpreter.planning.run_plan import plan_of
from softmark.interpreter.validation.requested_names import without_unrequested_warnings, unknown_models
from softmark.interpreter.validation.scene_loader import load_scene

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.cached_results import Keeper
    from softmark.interpreter.pipeline.run_state import Work
    from softmark.interpreter.results.run_report import Report

__all__ = ["Options", "Sound", "Text", "report_of", "run", "sound_of"]


def report_of(given: Text | Sound, options: Options, keeper: Keeper | None = None) -> Report:
    """The report of a text, or of a scene that was checked before; each finished model is in a report at once.

    What a `keeper` knows of earlier runs is taken over, and what is found is kept with it. Raises SceneError,
    before anything is solved, for a scene that is in error or of which something cannot be built, and Outdated
    where what was taken over does not go with what was computed.
    """
    sound = given if isinstance(given, Sound) else sound_of(given, options)  # grammar, language, validation
    options.begin(sound.scene)
    plan = plan_of(sound.scene, options.only)  # plan: what is asked for, and no more

    from softmark.interpreter.pipeline import cached_results, report_assembly, run_state  # numpy: only what is sound

    known = cached_results.known(sound.scene, plan, options, keeper)
    works = run_state.works_of(sound.scene, plan, options, sound.warnings, known)  # one for each state of the analysis
    if not cached_results.recalled(works):
        # solvers: only what is not known
        from softmark.interpreter.pipeline import model_runs, probe_sampling, reference_runs

        pausing.end()
        for work in works:
            reference_runs.read(work)  # references: what was measured, for probes and supports may lie there
            probe_sampling.place(work)  # problem: the points that are looked at
            model_runs.prepare(work)  # models: meshes, energies, supports and loads as arrays
        for work in works:
            reference_runs.solve(work)  # references: theories, and limits of refinement
        for name in plan.models:
            for work in works:
                model_runs.solve(work, name)  # solvers; verification: its forces are found again by other formulas
            _keep_early(works, name, keeper)  # metrics and verification, of one that took long
            options.keep(report_assembly.unfinished(works))  # metrics: what it is worth; written by the room of reports
        for work in works:
            reference_runs.scan(work)  # references: made from what models computed
            cached_results.doubted(work, work.models)
            model_runs.state(work, work.models)  # verification: the errors that models state themselves
    report = report_assembly.finished(
        works
    )  # metrics and verification: measured, drawn, held against what was expected
    cached_results.keep(works, keeper)
    return report


def _keep_early(works: Sequence[Work], name: str, keeper: Keeper | None) -> None:
    """Measure and keep a model that took its time: it need not be solved again where the run is interrupted."""
    if keeper is None or name in works[0].taken or not keeper.early(works, name):
        return
    from softmark.interpreter.pipeline import cached_results, model_runs, report_assembly

    for work in works:
        cached_results.doubted(work, (name,))
        model_runs.state(work, (name,))
    report_assembly.measured(works, name)
    keeper.keep_early(works, name)


def sound_of(text: Text, options: Options) -> Sound:
    """A text parsed, compiled and checked; what is doubtful is shown. Raises SceneError with all that is wrong."""
    scene, found = load_scene(text.source, text.folder, text.file, text.overrides, options.only, text.plugins)
    found = without_unrequested_warnings(scene, options.only, found)
    if scene is None:
        raise SceneError(found)
    options.warn(found)
    if problems := unknown_models(scene, options.only):
        raise SceneError(problems)
    return Sound(scene, tuple(found))


def run(scene: Scene, warnings: Sequence[Diagnostic], options: Options) -> Report:
    """The report of a scene that was checked before. Raises SceneError if something cannot be built."""
    return report_of(Sound(scene, tuple(warnings)), options)
