"""What a run takes over from earlier ones in the same folder, and what it leaves for later ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.run.kept import NOTHING, KeptModel, KeptReferences, Known
from softmark.interpreter.study.expansion import sources
from softmark.interpreter.study.expansion.keys import needed_models
from softmark.interpreter.study.kept import keys, store
from softmark.interpreter.study.kept.places import Unplaced
from softmark.interpreter.study.kept.plain import Reader, Unkept, Writer

if TYPE_CHECKING:
    from softmark.interpreter.language.scene import Scene
    from softmark.interpreter.plan.plan import Plan
    from softmark.interpreter.run.answers import Work
    from softmark.interpreter.run.options import Options

SETTLED = 2.0  # s that sources must be old when a run begins, which has loaded some of them by then
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
        self.scene, self.keys = scene, keys.keys_of(scene, plan, options)
        if self.fresh:
            return NOTHING
        models = {n: found for n in plan.models if (found := self._read(folder, n, scene, KeptModel)) is not None}
        if len(models) == len(plan.models):
            references = self._read(folder, "", scene, KeptReferences)
            if references is not None:
                return Known(models, references)
        computed = needed_models(scene, "")  # others are held against them
        return Known({n: found for n, found in models.items() if n not in computed})

    def keep(self, works: Sequence[Work]) -> None:
        """Keep what was computed. A reference that failed may have a solution the next time: then nothing is."""
        folder, scene, plan = self._folder, self.scene, works[0].plan
        if folder is None or scene is None or not self.keys or _complete(works):
            return
        # a file, or softmark itself, may have been saved since: who knows which of the two was read
        recent = sources.newest() > works[0].started.timestamp() - SETTLED
        if recent or keys.keys_of(scene, plan, works[0].options) != self.keys:
            return
        behind = [n for n in needed_models(scene, "") if n in plan.models]
        fails = any(r.status != "converged" for work in works for r in work.references.values())
        if fails or not all(_lasting(works, name) for name in behind):
            return
        began = works[0].started.isoformat(timespec="seconds")
        try:
            for name in plan.models:
                if name not in works[0].taken and _lasting(works, name):
                    self._write(folder, name, scene, _model(works, name, began))
            self._write(folder, "", scene, _references(works, began))
            store.prune(folder, self.keys.values())
        except OSError as error:
            self.remark(f"results are not kept: {error.strerror or error}")

    @property
    def _folder(self) -> Path | None:
        place = self.place()
        return None if place is None else place / store.FOLDER

    def _read(self, folder: Path, name: str, scene: Scene, cls: type[Any]) -> Any:
        if name not in self.keys:
            return None
        try:
            if (found := store.read(folder, self.keys[name])) is None:
                return None
            value = Reader(scene, found[1]).read(found[0])
        except store.Damaged as damaged:
            self.remark(f"{damaged}: {f'`{name}` is' if name else 'references are'} computed again")
            return None
        except (LookupError, TypeError, ValueError, AttributeError):  # of another version, by whatever accident
            return None
        return value if type(value) is cls else None

    def _write(self, folder: Path, name: str, scene: Scene, value: Any) -> None:
        """Raises OSError; what is of no class that is kept is not."""
        if name not in self.keys:
            return
        writer = Writer(scene)
        try:
            own = writer.write(value)
        except (Unkept, Unplaced):
            return
        store.write(folder, self.keys[name], own, writer.arrays)


def _complete(works: Sequence[Work]) -> bool:
    return works[0].known.references is not None


def _lasting(works: Sequence[Work], name: str) -> bool:
    return all(work.models[name].status not in CHANGEABLE for work in works)


def _model(works: Sequence[Work], name: str, began: str) -> KeptModel:
    steps = ("prepare", "solve")
    told = tuple({step: tuple(work.told.get((step, name), ())) for step in steps} for work in works)
    doubts = tuple(work.doubts.get(name, ()) for work in works)
    return KeptModel(name, began, tuple(work.models[name] for work in works), told, doubts)


def _references(works: Sequence[Work], began: str) -> KeptReferences:
    told = tuple(tuple(work.told.get(("place", ""), ())) for work in works)
    return KeptReferences(began, tuple(work.references for work in works), told)
