"""From the text of a scene to its report: `report_of` is the way, a step a line, each with the room that takes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from softmark import pausing
from softmark.interpreter.front.load import checked
from softmark.interpreter.front.requests import concerning, unknown_models
from softmark.interpreter.language.scene import SceneError
from softmark.interpreter.plan.plan import plan_of
from softmark.interpreter.run.options import Options, Sound, Text

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.language.scene import Scene
    from softmark.interpreter.results.report import Report
    from softmark.interpreter.run.answers import Work
    from softmark.interpreter.run.taken import Keeper

__all__ = ["Options", "Sound", "Text", "report_of", "run", "sound_of"]


def report_of(given: Text | Sound, options: Options, keeper: Keeper | None = None) -> Report:
    """The report of a text, or of a scene that was checked before; each finished model is in a report at once.

    What a `keeper` knows of earlier runs is taken over, and what is found is kept with it. Raises SceneError,
    before anything is solved, for a scene that is in error or of which something cannot be built, and Outdated
    where what was taken over does not go with what was computed.
    """
    sound = given if isinstance(given, Sound) else sound_of(given, options)  # grammar, language, front
    options.begin(sound.scene)
    plan = plan_of(sound.scene, options.only)  # plan: what is asked for, and no more

    from softmark.interpreter.run import answers, reports, taken  # numpy: only what is sound

    known = taken.known(sound.scene, plan, options, keeper)
    works = answers.works_of(sound.scene, plan, options, sound.warnings, known)  # one for each state of the analysis
    if not taken.recalled(works):
        from softmark.interpreter.run import models, probes, references  # solvers: only what is not known

        pausing.end()
        for work in works:
            references.read(work)  # references: what was measured, for probes and supports may lie there
            probes.place(work)  # problem: the points that are looked at
            models.prepare(work)  # models: meshes, energies, supports and loads as arrays
        for work in works:
            references.solve(work)  # references: theories, and limits of refinement
        for name in plan.models:
            for work in works:
                models.solve(work, name)  # solvers; evidence: its forces are found again by other formulas
            _keep_early(works, name, keeper)  # metrics and evidence, of one that took long
            options.keep(reports.unfinished(works))  # metrics: what it is worth; written by the room of reports
        for work in works:
            references.scan(work)  # references: made from what models computed
            taken.doubted(work, work.models)
            models.state(work, work.models)  # evidence: the errors that models state themselves
    report = reports.finished(works)  # metrics and evidence: measured, drawn, held against what was expected
    taken.keep(works, keeper)
    return report


def _keep_early(works: Sequence[Work], name: str, keeper: Keeper | None) -> None:
    """Measure and keep a model that took its time: it need not be solved again where the run is interrupted."""
    if keeper is None or name in works[0].taken or not keeper.early(works, name):
        return
    from softmark.interpreter.run import models, reports, taken

    for work in works:
        taken.doubted(work, (name,))
        models.state(work, (name,))
    reports.measured(works, name)
    keeper.keep_early(works, name)


def sound_of(text: Text, options: Options) -> Sound:
    """A text parsed, compiled and checked; what is doubtful is shown. Raises SceneError with all that is wrong."""
    scene, found = checked(text.source, text.folder, text.file, text.overrides, options.only, text.plugins)
    found = concerning(scene, options.only, found)
    if scene is None:
        raise SceneError(found)
    options.warn(found)
    if problems := unknown_models(scene, options.only):
        raise SceneError(problems)
    return Sound(scene, tuple(found))


def run(scene: Scene, warnings: Sequence[Diagnostic], options: Options) -> Report:
    """The report of a scene that was checked before. Raises SceneError if something cannot be built."""
    return report_of(Sound(scene, tuple(warnings)), options)
