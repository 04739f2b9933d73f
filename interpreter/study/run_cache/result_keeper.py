"""What a run takes over from earlier ones in the same folder, and what it leaves for later ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.pipeline.saved_results import NOTHING, KeptModel, KeptReferences, Known
from softmark.interpreter.study.configurations import source_digests
from softmark.interpreter.study.configurations.configuration_keys import needed_models
from softmark.interpreter.study.run_cache import cache_folder, run_cache_keys
from softmark.interpreter.study.run_cache.result_serialization import Reader, Unkept, Writer
from softmark.interpreter.study.run_cache.warning_locations import Unplaced

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene
    from softmark.interpreter.pipeline.run_options import Options
    from softmark.interpreter.pipeline.run_state import Work
    from softmark.interpreter.planning.run_plan import Plan
    from softmark.interpreter.results.run_report import Timing

SETTLED = 2.0  # s that sources must be old when a run begins, which has loaded some of them by then
WORTH = 1.0  # s that a model must have taken to be kept before its run has ended
CHANGEABLE = ("failed", "skipped")  # how a model may have ended for what no key knows: memory, a program, the network


@dataclass
class Keeper:
    """Of the folder that `place` gives once a run has begun, None of a run without one; `fresh` takes nothing over."""

    place: Callable[[], Path | None]
    fresh: bool = False
    remark: Callable[[str], None] = lambda text: None
    scene: Scene | None = None
    keys: dict[str, str] = field(default_factory=dict)

    def anew(self) -> Keeper:
        """The same that takes nothing over."""
        return replace(self, fresh=True)

    def known(self, scene: Scene, plan: Plan, options: Options) -> Known:
        """What of a plan is known: all of it, or the models that need not be computed for others."""
        if (folder := self._folder) is None:
            return NOTHING
        self.scene, self.keys = scene, run_cache_keys.keys_of(scene, plan, options)
        if self.fresh:
            return NOTHING
        models = {n: found for n in plan.models if (found := self._read(folder, n, scene, KeptModel)) is not None}
        if len(models) == len(plan.models):
            references = self._read(folder, "", scene, KeptReferences)
            if references is not None:
                return Known(models, references)
        computed = needed_models(scene, "")  # others are held against them
        return Known({n: found for n, found in models.items() if n not in computed})

    def early(self, works: Sequence[Work], name: str) -> bool:
        """Whether a model that was solved is worth keeping before the run has ended, which may be interrupted.

        It took its time, and all that it will be measured by is there: models that others are held against are
        solved, and no reference is made from what models compute.
        """
        seconds = sum(sum(timing.seconds) for work in works for timing in _clock(work, name))
        return seconds > WORTH and self._place is not None and self._measurable(works) and self._stands(works)

    def _measurable(self, works: Sequence[Work]) -> bool:
        from softmark.interpreter.models.model_preparation import from_a_model

        scans = any(from_a_model(works[0].scene.declared[name]) for name in works[0].plan.references)
        return not scans and all(name in work.models for work in works for name in self._behind(works))

    def keep_early(self, works: Sequence[Work], name: str) -> None:
        """Keep a model for which it is `early` while others are still to be solved."""
        if (place := self._place) is not None:
            with self._said():
                self._keep(*place, works, name)

    def keep(self, works: Sequence[Work]) -> None:
        """Keep what was computed. A reference that failed may have a solution the next time: then nothing is."""
        place = self._place
        if place is None or _complete(works) or not self._stands(works):
            return
        with self._said():
            for name in works[0].plan.models:
                self._keep(*place, works, name)
            self._write(*place, "", _references(works))
            cache_folder.prune(place[0], self.keys.values())

    @property
    def _place(self) -> tuple[Path, Scene] | None:
        """The folder, and the scene that was asked about; None where nothing of it is kept."""
        folder, scene = self._folder, self.scene
        return None if folder is None or scene is None or not self.keys else (folder, scene)

    def _behind(self, works: Sequence[Work]) -> list[str]:
        """Models of the plan that others are held against."""
        return [n for n in needed_models(works[0].scene, "") if n in works[0].plan.models]

    def _stands(self, works: Sequence[Work]) -> bool:
        """Whether all that models are measured by was found, and from what the keys say."""
        # a file, or softmark itself, may have been saved since: who knows which of the two was read
        recent = source_digests.newest() > works[0].started.timestamp() - SETTLED
        if recent or run_cache_keys.keys_of(works[0].scene, works[0].plan, works[0].options) != self.keys:
            return False
        fails = any(r.status != "converged" for work in works for r in work.references.values())
        return not fails and all(_lasting(works, name) for name in self._behind(works))

    def _keep(self, folder: Path, scene: Scene, works: Sequence[Work], name: str) -> None:
        if name not in works[0].taken and _lasting(works, name):
            self._write(folder, scene, name, _model(works, name))

    @contextmanager
    def _said(self) -> Iterator[None]:
        """Say why results cannot be kept, where that is so: the run goes on without."""
        try:
            yield
        except OSError as error:
            self.remark(f"results are not kept: {error.strerror or error}")

    @property
    def _folder(self) -> Path | None:
        place = self.place()
        return None if place is None else place / cache_folder.FOLDER

    def _read(self, folder: Path, name: str, scene: Scene, cls: type[Any]) -> Any:
        if name not in self.keys:
            return None
        try:
            if (found := cache_folder.read(folder, self.keys[name])) is None:
                return None
            value = Reader(scene, found[1]).read(found[0])
        except cache_folder.Damaged as damaged:
            self.remark(f"{damaged}: {f'`{name}` is' if name else 'references are'} computed again")
            return None
        except (LookupError, TypeError, ValueError, AttributeError):  # of another version, by whatever accident
            return None
        return value if type(value) is cls else None

    def _write(self, folder: Path, scene: Scene, name: str, value: Any) -> None:
        """Raises OSError; what is of no class that is kept is not."""
        if name not in self.keys:
            return
        writer = Writer(scene)
        try:
            own = writer.write(value)
        except (Unkept, Unplaced):
            return
        cache_folder.write(folder, self.keys[name], own, writer.arrays)


def _complete(works: Sequence[Work]) -> bool:
    return works[0].known.references is not None


def _lasting(works: Sequence[Work], name: str) -> bool:
    return all(work.models[name].status not in CHANGEABLE for work in works)


def _clock(work: Work, name: str) -> Iterator[Timing]:
    """What a model took, where it was solved."""
    clock = work.models[name].time
    yield from (timing for step in ("setup_s", "solve_s") if (timing := clock.get(step)) is not None)


def _began(works: Sequence[Work]) -> str:
    return works[0].started.isoformat(timespec="seconds")


def _model(works: Sequence[Work], name: str) -> KeptModel:
    steps = ("prepare", "solve")
    told = tuple({step: tuple(work.told.get((step, name), ())) for step in steps} for work in works)
    doubts = tuple(work.doubts.get(name, ()) for work in works)
    return KeptModel(name, _began(works), tuple(work.models[name] for work in works), told, doubts)


def _references(works: Sequence[Work]) -> KeptReferences:
    told = tuple(tuple(work.told.get(("place", ""), ())) for work in works)
    return KeptReferences(_began(works), tuple(work.references for work in works), told)
