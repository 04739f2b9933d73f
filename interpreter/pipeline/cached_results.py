"""Reuse of results of an earlier run, found by a `RunCache`.

A model's result is reused as it was at the end of that run, measured and drawn, with its warnings, each repeated at the
step that gave it. References are reused only if all models are, since computing a reference needs whole models.
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
    """Cache of results of runs, for later runs."""

    def known(self, scene: Scene, plan: Plan, options: RunOptions) -> SavedResults:
        """Return the saved results of a plan that this run would compute identically."""

    def without_saved_results(self) -> RunCache:
        """Return the same cache without the saved results."""

    def worth_saving_early(self, works: Sequence[StateRun], name: str) -> bool:
        """Return whether a model that was just solved is worth saving, and can be saved, before the run has ended."""

    def keep_early(self, works: Sequence[StateRun], name: str) -> None:
        """Save such a model, once it is measured."""

    def keep(self, works: Sequence[StateRun]) -> None:
        """Save the new results of a run."""


class OutdatedResults(Exception):
    """Reused results do not agree with computed ones."""


def load_saved_results(scene: Scene, plan: Plan, options: RunOptions, keeper: RunCache | None) -> SavedResults:
    """Return the saved results that a plan can reuse; empty without a keeper."""
    return NOTHING if keeper is None else keeper.known(scene, plan, options)


def save_results(works: Sequence[StateRun], keeper: RunCache | None) -> None:
    """Save the results if there is a keeper."""
    if keeper is not None:
        keeper.keep(works)


def reuse_prepared_model(work: StateRun, name: str) -> bool:
    """Return whether a model is reused; if so, repeat the warnings given when it was built."""
    if (kept := work.known.models.get(name)) is None:
        return False
    _repeat_warnings(work, kept.told[work.number].get("prepare", ()))
    return True


def reuse_solved_model(work: StateRun, name: str) -> bool:
    """Return whether a model is reused; if so, take its result and repeat the warnings given when it was solved."""
    if (kept := work.known.models.get(name)) is None:
        return False
    work.models[name] = replace(kept.results[work.number], kept=kept.computed)
    work.taken.add(name)
    _repeat_warnings(work, kept.told[work.number].get("solve", ()))
    return True


def reuse_everything(works: Sequence[StateRun]) -> bool:
    """Return whether everything is reused, after restoring it in the original order. Raises OutdatedResults."""
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
        record_doubts(work, work.models)
    return True


def _repeat_warnings(work: StateRun, told: Sequence[WarningGroup]) -> None:
    for one in told:
        work.warn(one.found, one.here, one.once)


def record_doubts(work: StateRun, names: Iterable[str]) -> None:
    """Record warnings that concern models before errors are stated. Raises OutdatedResults if they differ from the
    earlier run.

    Warnings about shared objects, such as a support, concern all models, whichever of them gave the warning first. A
    model that stated its error before such a warning states it again.
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
