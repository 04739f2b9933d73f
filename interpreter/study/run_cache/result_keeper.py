"""Cache of run results in a folder: reuse of earlier results, and saving of new ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.pipeline.saved_results import NOTHING, SavedModel, SavedReferences, SavedResults
from softmark.interpreter.study.configurations import source_digests
from softmark.interpreter.study.configurations.configuration_keys import needed_models
from softmark.interpreter.study.run_cache import cache_folder, run_cache_keys
from softmark.interpreter.study.run_cache.result_serialization import NotSaved, Reader, Writer
from softmark.interpreter.study.run_cache.warning_locations import NoDeclaration

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.pipeline.run_state import StateRun
    from softmark.interpreter.planning.run_plan import Plan
    from softmark.interpreter.results.run_report import Timing

SETTLED = 2.0  # s, minimum age of the sources when a run begins, since some are already loaded
WORTH = 1.0  # s, minimum time of a model to be saved before the end of its run
CHANGEABLE = ("failed", "skipped")  # statuses that may have causes outside the key: memory, a program, the network


@dataclass
class FolderRunCache:
    """Run cache in the folder that `place` returns once a run has begun, None without one; `fresh` reuses nothing."""

    place: Callable[[], Path | None]
    fresh: bool = False
    remark: Callable[[str], None] = lambda text: None
    scene: Scene | None = None
    keys: dict[str, str] = field(default_factory=dict)

    def without_saved_results(self) -> FolderRunCache:
        """Return the same cache without reuse."""
        return replace(self, fresh=True)

    def known(self, scene: Scene, plan: Plan, options: RunOptions) -> SavedResults:
        """Return the saved results of a plan: all, or the models that others do not need to be computed."""
        if (folder := self._folder) is None:
            return NOTHING
        self.scene, self.keys = scene, run_cache_keys.keys_of(scene, plan, options)
        if self.fresh:
            return NOTHING
        models = {n: found for n in plan.models if (found := self._read(folder, n, scene, SavedModel)) is not None}
        if len(models) == len(plan.models):
            references = self._read(folder, "", scene, SavedReferences)
            if references is not None:
                return SavedResults(models, references)
        computed = needed_models(scene, "")  # other models are compared with them
        return SavedResults({n: found for n, found in models.items() if n not in computed})

    def worth_saving_early(self, works: Sequence[StateRun], name: str) -> bool:
        """Return whether a solved model is worth saving before the run, which may be interrupted, has ended.

        It is if it was slow and everything that measures it is available: the models that others are compared with are
        solved, and no reference depends on models.
        """
        seconds = sum(sum(timing.seconds) for work in works for timing in _clock(work, name))
        return seconds > WORTH and self._place is not None and self._measurable(works) and self._stands(works)

    def _measurable(self, works: Sequence[StateRun]) -> bool:
        from softmark.interpreter.models.model_preparation import from_a_model

        scans = any(from_a_model(works[0].scene.declared[name]) for name in works[0].plan.references)
        return not scans and all(name in work.models for work in works for name in self._behind(works))

    def keep_early(self, works: Sequence[StateRun], name: str) -> None:
        """Save a model that is worth saving early, while others are still to be solved."""
        if (place := self._place) is not None:
            with self._said():
                self._keep(*place, works, name)

    def keep(self, works: Sequence[StateRun]) -> None:
        """Save computed results, but nothing if a reference failed, since it may succeed the next time."""
        place = self._place
        if place is None or _complete(works) or not self._stands(works):
            return
        with self._said():
            for name in works[0].plan.models:
                self._keep(*place, works, name)
            self._write(*place, "", _references(works))
            cache_folder.prune_folder(place[0], self.keys.values())

    @property
    def _place(self) -> tuple[Path, Scene] | None:
        """Return the folder and the scene of the current run; None if nothing is saved."""
        folder, scene = self._folder, self.scene
        return None if folder is None or scene is None or not self.keys else (folder, scene)

    def _behind(self, works: Sequence[StateRun]) -> list[str]:
        """Return the models of the plan that others are compared with."""
        return [n for n in needed_models(works[0].scene, "") if n in works[0].plan.models]

    def _stands(self, works: Sequence[StateRun]) -> bool:
        """Return whether everything that measures models was found, from sources that the keys describe."""
        # a file, or softmark itself, may have changed since: it is unknown which version was read
        recent = source_digests.newest_change() > works[0].started.timestamp() - SETTLED
        if recent or run_cache_keys.keys_of(works[0].scene, works[0].plan, works[0].options) != self.keys:
            return False
        fails = any(r.status != "converged" for work in works for r in work.references.values())
        return not fails and all(_lasting(works, name) for name in self._behind(works))

    def _keep(self, folder: Path, scene: Scene, works: Sequence[StateRun], name: str) -> None:
        if name not in works[0].taken and _lasting(works, name):
            self._write(folder, scene, name, _model(works, name))

    @contextmanager
    def _said(self) -> Iterator[None]:
        """Report why results cannot be saved, and let the run continue."""
        try:
            yield
        except OSError as error:
            self.remark(f"results cannot be cached: {error.strerror or error}")

    @property
    def _folder(self) -> Path | None:
        place = self.place()
        return None if place is None else place / cache_folder.FOLDER

    def _read(self, folder: Path, name: str, scene: Scene, cls: type[Any]) -> Any:
        if name not in self.keys:
            return None
        try:
            if (found := cache_folder.read_saved(folder, self.keys[name])) is None:
                return None
            value = Reader(scene, found[1]).read(found[0])
        except cache_folder.DamagedFile as damaged:
            self.remark(f"{damaged}: {f'`{name}` is' if name else 'references are'} computed again")
            return None
        except (LookupError, TypeError, ValueError, AttributeError):  # of another version, by accident
            return None
        return value if type(value) is cls else None

    def _write(self, folder: Path, scene: Scene, name: str, value: Any) -> None:
        """Save a value, unless it has a class that is not saved. Raises OSError."""
        if name not in self.keys:
            return
        writer = Writer(scene)
        try:
            own = writer.write(value)
        except (NotSaved, NoDeclaration):
            return
        cache_folder.write_saved(folder, self.keys[name], own, writer.arrays)


def _complete(works: Sequence[StateRun]) -> bool:
    return works[0].known.references is not None


def _lasting(works: Sequence[StateRun], name: str) -> bool:
    return all(work.models[name].status not in CHANGEABLE for work in works)


def _clock(work: StateRun, name: str) -> Iterator[Timing]:
    """Yield the times of a model in all states where it was solved."""
    clock = work.models[name].time
    yield from (timing for step in ("setup_s", "solve_s") if (timing := clock.get(step)) is not None)


def _began(works: Sequence[StateRun]) -> str:
    return works[0].started.isoformat(timespec="seconds")


def _model(works: Sequence[StateRun], name: str) -> SavedModel:
    steps = ("prepare", "solve")
    told = tuple({step: tuple(work.told.get((step, name), ())) for step in steps} for work in works)
    doubts = tuple(work.doubts.get(name, ()) for work in works)
    return SavedModel(name, _began(works), tuple(work.models[name] for work in works), told, doubts)


def _references(works: Sequence[StateRun]) -> SavedReferences:
    told = tuple(tuple(work.told.get(("place", ""), ())) for work in works)
    return SavedReferences(_began(works), tuple(work.references for work in works), told)
