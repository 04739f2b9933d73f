"""Reuse of the results of an earlier run, found by a `RunCache`.

The result of a model is reused as it was at the end of the earlier run, with its metrics, its drawn surface and its
warnings. Each warning is repeated in the step that first gave it. References are reused only if all models are, since
computing a reference needs complete models.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from softmark.interpreter.pipeline.saved_results import NOTHING

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.pipeline.run_state import StateRun
    from softmark.interpreter.pipeline.saved_results import SavedResults, WarningGroup
    from softmark.interpreter.planning.run_plan import Plan


class RunCache(Protocol):
    """Cache that saves the results of runs for later runs."""

    def known(self, scene: Scene, plan: Plan, options: RunOptions) -> SavedResults:
        """Return the saved results that this run would compute identically."""

    def without_saved_results(self) -> RunCache:
        """Return a cache that saves the results of this run but has none from earlier runs."""

    def worth_saving_early(self, works: Sequence[StateRun], name: str) -> bool:
        """Return whether the model `name`, just solved, can be saved at once, and was slow enough for that."""

    def keep_early(self, works: Sequence[StateRun], name: str) -> None:
        """Save the model `name` before the run has ended; its metrics must have been evaluated."""

    def keep(self, works: Sequence[StateRun]) -> None:
        """Save the new results of a run; `works` are the runs of its states."""


class OutdatedResults(Exception):
    """Error: results reused from an earlier run do not agree with results of this run."""


def load_saved_results(scene: Scene, plan: Plan, options: RunOptions, keeper: RunCache | None) -> SavedResults:
    """Return the saved results that a plan can reuse; empty if `keeper` is None."""
    return NOTHING if keeper is None else keeper.known(scene, plan, options)


def save_results(works: Sequence[StateRun], keeper: RunCache | None) -> None:
    """Save the results of a run, unless `keeper` is None."""
    if keeper is not None:
        keeper.keep(works)


def reuse_prepared_model(work: StateRun, name: str) -> bool:
    """Repeat the warnings from building a model if its saved result is reused; return whether it is reused."""
    if (kept := work.known.models.get(name)) is None:
        return False
    _repeat_warnings(work, kept.told[work.number].get("prepare", ()))
    return True


def reuse_solved_model(work: StateRun, name: str) -> bool:
    """Use the saved result of a model, with the warnings of its solution; return whether there was one."""
    if (kept := work.known.models.get(name)) is None:
        return False
    work.models[name] = replace(kept.results[work.number], kept=kept.computed)
    work.taken.add(name)
    _repeat_warnings(work, kept.told[work.number].get("solve", ()))
    return True


def reuse_everything(works: Sequence[StateRun]) -> bool:
    """Restore all models and references in their original order if all are saved; return whether they are.

    Raises OutdatedResults.
    """
    for work in works:
        if (whole := work.known.references) is None:
            return False
        _repeat_warnings(work, whole.told[work.number])
        for name, found in whole.results[work.number].items():
            work.references[name] = replace(found, kept=whole.computed)
            work.taken.add(name)
        for name in work.plan.models:
            reuse_prepared_model(work, name)
    for name in works[0].plan.models:
        for work in works:
            reuse_solved_model(work, name)
    for work in works:
        record_accuracy_warnings(work, work.models)
    return True


def _repeat_warnings(work: StateRun, told: Sequence[WarningGroup]) -> None:
    for one in told:
        work.warn(one.found, one.here, one.once)


def record_accuracy_warnings(work: StateRun, names: Iterable[str]) -> None:
    """Record for each model the codes of accuracy warnings that concern it, before it states its errors.

    Warnings about shared objects, such as a support, concern all models, whichever of them gave the warning first. A
    model that stated its error before such a warning states it again. Raises OutdatedResults if the codes differ from
    those of the earlier run.
    """
    from softmark.interpreter.verification.accuracy_warnings import accuracy_warning_codes

    work.about = ("", "")
    for name in list(names):
        result, before = work.models[name], work.doubts.get(name)
        work.doubts[name] = found = tuple(accuracy_warning_codes(work.scene, work.scene.declared[name], work.warnings))
        kept = work.known.models.get(name)
        if kept is not None and result.stated and kept.doubts[work.number] != found:
            raise OutdatedResults
        if kept is None and before not in (None, found):
            work.models[name] = replace(result, stated={})
