"""Run cache in a folder: reuse of results of earlier runs, and saving of new results."""

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
    """Run cache in a folder.

    `place` returns the folder once the run has begun, or None if nothing is saved. With `fresh` nothing is reused.
    """

    place: Callable[[], Path | None]
    fresh: bool = False
    remark: Callable[[str], None] = lambda text: None
    scene: Scene | None = None
    keys: dict[str, str] = field(default_factory=dict)

    def without_saved_results(self) -> FolderRunCache:
        """Return a run cache in the same folder that does not reuse earlier results."""
        return replace(self, fresh=True)

    def known(self, scene: Scene, plan: Plan, options: RunOptions) -> SavedResults:
        """Return the saved results that a run can reuse.

        These are all results of the plan or, if some are missing, only the models that no other model is compared with.
        """
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
        """Return whether a solved model should be saved before the run has ended, in case the run is interrupted.

        It should be if it took long and if all references and models needed for its metrics are available.
        """
        seconds = sum(sum(timing.seconds) for work in works for timing in _timings_of_model(work, name))
        return (
            seconds > WORTH
            and self._folder_and_scene is not None
            and self._is_measurable_early(works)
            and self._is_reliable(works)
        )

    def _is_measurable_early(self, works: Sequence[StateRun]) -> bool:
        from softmark.interpreter.models.model_preparation import from_a_model

        scans = any(from_a_model(works[0].scene.declared[name]) for name in works[0].plan.references)
        return not scans and all(name in work.models for work in works for name in self._comparison_models(works))

    def keep_early(self, works: Sequence[StateRun], name: str) -> None:
        """Save a solved model while others are still to be solved."""
        if (place := self._folder_and_scene) is not None:
            with self._report_os_errors():
                self._save_model(*place, works, name)

    def keep(self, works: Sequence[StateRun]) -> None:
        """Save the results of a finished run.

        Nothing is saved if a reference failed, because it may succeed the next time.
        """
        place = self._folder_and_scene
        if place is None or _is_fully_saved(works) or not self._is_reliable(works):
            return
        with self._report_os_errors():
            for name in works[0].plan.models:
                self._save_model(*place, works, name)
            self._write(*place, "", _saved_references(works))
            cache_folder.prune_folder(place[0], self.keys.values())

    @property
    def _folder_and_scene(self) -> tuple[Path, Scene] | None:
        """Folder and scene of the current run; None if nothing is saved."""
        folder, scene = self._folder, self.scene
        return None if folder is None or scene is None or not self.keys else (folder, scene)

    def _comparison_models(self, works: Sequence[StateRun]) -> list[str]:
        """Return the models of the plan that other models are compared with."""
        return [n for n in needed_models(works[0].scene, "") if n in works[0].plan.models]

    def _is_reliable(self, works: Sequence[StateRun]) -> bool:
        """Return whether the results are reliable enough to be saved.

        No file may have changed during the run, and no reference or model used for comparison may have failed.
        """
        # a file, or softmark itself, may have changed since: it is unknown which version was read
        recent = source_digests.newest_change() > works[0].started.timestamp() - SETTLED
        if recent or run_cache_keys.keys_of(works[0].scene, works[0].plan, works[0].options) != self.keys:
            return False
        fails = any(r.status != "converged" for work in works for r in work.references.values())
        return not fails and all(_has_lasting_status(works, name) for name in self._comparison_models(works))

    def _save_model(self, folder: Path, scene: Scene, works: Sequence[StateRun], name: str) -> None:
        if name not in works[0].taken and _has_lasting_status(works, name):
            self._write(folder, scene, name, _saved_model(works, name))

    @contextmanager
    def _report_os_errors(self) -> Iterator[None]:
        """Context in which an OSError is reported as a remark, so that the run continues."""
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
        """Save a value under a name, unless it contains a class that cannot be saved. Raises OSError."""
        if name not in self.keys:
            return
        writer = Writer(scene)
        try:
            own = writer.write(value)
        except (NotSaved, NoDeclaration):
            return
        cache_folder.write_saved(folder, self.keys[name], own, writer.arrays)


def _is_fully_saved(works: Sequence[StateRun]) -> bool:
    return works[0].known.references is not None


def _has_lasting_status(works: Sequence[StateRun], name: str) -> bool:
    return all(work.models[name].status not in CHANGEABLE for work in works)


def _timings_of_model(work: StateRun, name: str) -> Iterator[Timing]:
    """Yield the set-up and solution times of a model in a state."""
    clock = work.models[name].time
    yield from (timing for step in ("setup_s", "solve_s") if (timing := clock.get(step)) is not None)


def _start_time(works: Sequence[StateRun]) -> str:
    return works[0].started.isoformat(timespec="seconds")


def _saved_model(works: Sequence[StateRun], name: str) -> SavedModel:
    steps = ("prepare", "solve")
    told = tuple({step: tuple(work.told.get((step, name), ())) for step in steps} for work in works)
    doubts = tuple(work.doubts.get(name, ()) for work in works)
    return SavedModel(name, _start_time(works), tuple(work.models[name] for work in works), told, doubts)


def _saved_references(works: Sequence[StateRun]) -> SavedReferences:
    told = tuple(tuple(work.told.get(("place", ""), ())) for work in works)
    return SavedReferences(_start_time(works), tuple(work.references for work in works), told)
