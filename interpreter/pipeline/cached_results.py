"""Taking over what an earlier run has found, as a `Keeper` knows it.

A model is taken over as it was at the end of that run, measured and drawn, with the warnings that came of it, each at
the step at which it came. References are only taken over where all models are: who computes one needs them whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from softmark.interpreter.pipeline.saved_results import NOTHING

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.run_options import Options
    from softmark.interpreter.pipeline.run_state import Work
    from softmark.interpreter.pipeline.saved_results import Known, Told
    from softmark.interpreter.planning.run_plan import Plan


class Keeper(Protocol):
    """Keeps what runs found, for later ones."""

    def known(self, scene: Scene, plan: Plan, options: Options) -> Known:
        """What of a plan was found by an earlier run and would be found again by this one."""

    def anew(self) -> Keeper:
        """The same that knows nothing."""

    def early(self, works: Sequence[Work], name: str) -> bool:
        """Whether a model that was just solved is worth keeping, and can be kept, before the run has ended."""

    def keep_early(self, works: Sequence[Work], name: str) -> None:
        """Keep such a model, once it is measured."""

    def keep(self, works: Sequence[Work]) -> None:
        """Keep what a run has found that was not known."""


class Outdated(Exception):
    """What was taken over does not go with what was computed."""


def known(scene: Scene, plan: Plan, options: Options, keeper: Keeper | None) -> Known:
    """What of a plan an earlier run has found: nothing without a keeper."""
    return NOTHING if keeper is None else keeper.known(scene, plan, options)


def keep(works: Sequence[Work], keeper: Keeper | None) -> None:
    """Keep what was found, where somebody does."""
    if keeper is not None:
        keeper.keep(works)


def begun(work: Work, name: str) -> bool:
    """Whether a model is taken over; what it warned of when it was built is said again."""
    if (kept := work.known.models.get(name)) is None:
        return False
    _tell(work, kept.told[work.number].get("prepare", ()))
    return True


def ended(work: Work, name: str) -> bool:
    """Whether a model is taken over: its result is, and what it warned of when it was solved is said again."""
    if (kept := work.known.models.get(name)) is None:
        return False
    work.models[name] = replace(kept.results[work.number], kept=kept.computed)
    work.taken.add(name)
    _tell(work, kept.told[work.number].get("solve", ()))
    return True


def recalled(works: Sequence[Work]) -> bool:
    """Whether all was found by an earlier run: it is taken over in the order in which it was. Raises Outdated."""
    for work in works:
        if (whole := work.known.references) is None:
            return False
        _tell(work, whole.told[work.number])
        for name, found in whole.results[work.number].items():
            work.references[name] = replace(found, kept=whole.computed)
            work.taken.add(name)
        for name in work.plan.models:
            begun(work, name)
    for name in works[0].plan.models:
        for work in works:
            ended(work, name)
    for work in works:
        doubted(work, work.models)
    return True


def _tell(work: Work, told: Sequence[Told]) -> None:
    for one in told:
        work.warn(one.found, one.here, one.once)


def doubted(work: Work, names: Iterable[str]) -> None:
    """Note what speaks against models before errors are stated. Raises Outdated where that was otherwise.

    Warnings about what models share, such as a support, speak against all of them, whichever met it: what a model of
    this run has stated before another met one is stated again.
    """
    from softmark.interpreter.verification.accuracy_warnings import doubts_of

    work.about = ("", "")
    for name in list(names):
        result, before = work.models[name], work.doubts.get(name)
        work.doubts[name] = found = tuple(doubts_of(work.scene, work.scene.declared[name], work.warnings))
        kept = work.known.models.get(name)
        if kept is not None and result.stated and kept.doubts[work.number] != found:
            raise Outdated
        if kept is None and before not in (None, found):
            work.models[name] = replace(result, stated={})
