"""What a result of `dsl run` depends on, as one digest: that of comparisons (`configurations/configuration_keys.py`),
and more.

More, because a page is made from it: everything that is declared counts with its text, so that what messages say of it
stands where they say, published values, how the run was asked, and the machine with its variables. Where something
cannot be told surely there is no key, and what has none is computed each time.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.models.external.external_program import Asked
from softmark.interpreter.pipeline.run_environment import environment
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.study.configurations import configuration_keys, source_digests

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.pipeline.run_options import Options
    from softmark.interpreter.planning.run_plan import Plan

SCHEMA = "softmark-kept/3"
COUNTING = (  # first words of variables that may change a number
    "OMP_", "OPENBLAS_", "MKL_", "GOTO_", "BLIS_", "VECLIB_", "KMP_", "NUMBA_", "PYPARDISO_", "SOFTMARK_",
    "NPY_", "LD_",
)  # fmt: skip
IDLE = ("OPENBLAS_THREAD_TIMEOUT",)  # and of those what `dsl` itself sets: how threads wait
ALONE = frozenset(  # ends of the names of files that name no other file
    {".msh", ".vtk", ".vtu", ".stl", ".ply", ".obj", ".off", ".csv", ".tsv", ".txt", ".npz", ".npy", ".nii",
     ".frd", ".xplt"}
)  # fmt: skip
SLICES = ALONE | {".dcm"}  # of those of a folder: one of these stands for all beside it


def keys_of(scene: Scene, plan: Plan, options: Options) -> dict[str, str]:
    """The key of every model of a plan that has one, and under "" that of all references together with all models."""
    shared = [d for d in scene.declared.values() if d.kind not in ("model", "study")]
    if not all(map(_sure, shared)) or (scene.table is not None and scene.table.vocabulary.plugins):
        return {}
    behind = [name for name in configuration_keys.needed_models(scene, "") if name in plan.models]
    base = _digest(SCHEMA, _asked(options), _machine(), str(scene.path), *map(_told, shared), *behind, *plan.references)
    found = {n: key for n in plan.models if (key := _key(scene, n, base)) is not None}
    if any(name not in found for name in behind):  # what all others are held against
        return {}
    if all(name in found for name in plan.models):
        found[""] = _digest(base, *found.values(), *configuration_keys.all_words(scene))
    return found


def _key(scene: Scene, name: str, base: str) -> str | None:
    """Of a model; None where something of it cannot be told surely."""
    whole = [scene.declared[n] for n in with_dependencies(scene, configuration_keys.needed_models(scene, name))]
    if not all(map(_sure, whole)):
        return None
    programs = (d.thing.program for d in whole if isinstance(d.thing, Asked))
    return _digest(
        base, configuration_keys.key_of(scene, name), *map(_told, whole), *map(source_digests.of_installed, programs)
    )


def _told(declared: Declared) -> str:
    """A declaration with its text, and that of overrides of its fields."""
    texts = dict.fromkeys((declared.location.text, *(at.text for at in declared.fields.values())))
    return configuration_keys.words_of(declared) + "\0".join(texts)


def _sure(declared: Declared) -> bool:
    """Whether all is known that a declaration comes to: it is ours, hides nothing, and its files name no others."""
    if " object at 0x" in repr(declared.thing) or source_digests.of_plugins(declared.thing):
        return False
    return all(_alone(name) for name in source_digests.files_of(declared.thing))


def _alone(name: str) -> bool:
    """Whether a file, a public data set, or each file of a folder names no other file."""
    if name.startswith("data:"):
        return True
    path = Path(name)
    if path.is_dir():
        return all(p.is_dir() or _ending(p) in SLICES for p in path.rglob("*"))
    return _ending(path) in ALONE


def _ending(path: Path) -> str:
    return Path(path.name.lower().removesuffix(".gz")).suffix


def _asked(options: Options) -> str:
    return repr((options.repeat, options.stated, options.free, options.draw))


def _machine() -> str:
    """What a report says of the machine but when, and the variables that libraries count by."""
    known: dict[str, Any] = {n: v for n, v in environment(datetime.now(UTC)).items() if n != "started"}
    return repr(known) + "\0".join(_variables())


def _variables() -> Iterator[str]:
    known = (n for n in os.environ if n.startswith(COUNTING) and n not in IDLE)
    yield from (f"{name}={os.environ[name]}" for name in sorted(known))


def _digest(*parts: str) -> str:
    h = hashlib.sha256()
    for part in parts:
        data = part.encode(errors="surrogatepass")
        h.update(f"{len(data)}\0".encode() + data)
    return h.hexdigest()
