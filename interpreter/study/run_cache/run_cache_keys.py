"""Keys of saved results of `dsl run`, which cover more dependencies than `configuration_keys.py`.

A report page is made from a saved result. So the key also covers the text of all declarations (messages quote it),
published values, the options of the run, and the machine with its environment variables. If any dependency is uncertain
there is no key, and the result is computed each time.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softmark.interpreter.models.external.external_program import ExternalModel
from softmark.interpreter.pipeline.run_environment import describe_environment
from softmark.interpreter.planning.declaration_dependencies import with_dependencies
from softmark.interpreter.study.configurations import configuration_keys, source_digests

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.pipeline.run_options import RunOptions
    from softmark.interpreter.planning.run_plan import Plan

SCHEMA = "softmark-kept/3"
COUNTING = (  # prefixes of environment variables that may change a number
    "OMP_", "OPENBLAS_", "MKL_", "GOTO_", "BLIS_", "VECLIB_", "KMP_", "NUMBA_", "PYPARDISO_", "SOFTMARK_",
    "NPY_", "LD_",
)  # fmt: skip
NO_EFFECT = ("OPENBLAS_NUM_THREADS",)  # except this: runs use one thread in any case
ALONE = frozenset(  # extensions of files that refer to no other file
    {".msh", ".vtk", ".vtu", ".stl", ".ply", ".obj", ".off", ".csv", ".tsv", ".txt", ".npz", ".npy", ".nii",
     ".frd", ".xplt"}
)  # fmt: skip
SLICES = ALONE | {".dcm"}  # extensions in a folder, where one file represents all


def keys_of(scene: Scene, plan: Plan, options: RunOptions) -> dict[str, str]:
    """Return the key of every model of a plan, except models with an uncertain dependency.

    The key under the empty name is that of all references and models together.
    """
    shared = [d for d in scene.declared.values() if d.kind not in ("model", "study")]
    if not all(map(_has_known_dependencies, shared)) or (scene.table is not None and scene.table.vocabulary.plugins):
        return {}
    behind = [name for name in configuration_keys.needed_models(scene, "") if name in plan.models]
    base = _digest(
        SCHEMA,
        _options_text(options),
        _machine(),
        str(scene.path),
        *map(_declaration_text, shared),
        *behind,
        *plan.references,
    )
    found = {n: key for n in plan.models if (key := _model_key(scene, n, base)) is not None}
    if any(name not in found for name in behind):  # models that all others are compared with
        return {}
    if all(name in found for name in plan.models):
        found[""] = _digest(base, *found.values(), *configuration_keys.non_study_texts(scene))
    return found


def _model_key(scene: Scene, name: str, base: str) -> str | None:
    """Return the key of a model; None if a dependency is uncertain."""
    whole = [scene.declared[n] for n in with_dependencies(scene, configuration_keys.needed_models(scene, name))]
    if not all(map(_has_known_dependencies, whole)):
        return None
    programs = (d.thing.program for d in whole if isinstance(d.thing, ExternalModel))
    return _digest(
        base,
        configuration_keys.key_of(scene, name),
        *map(_declaration_text, whole),
        *map(source_digests.digest_installed, programs),
    )


def _declaration_text(declared: Declared) -> str:
    """Return a declaration as text, including the source texts of its fields."""
    texts = dict.fromkeys((declared.location.text, *(at.text for at in declared.fields.values())))
    return configuration_keys.declaration_text(declared) + "\0".join(texts)


def _has_known_dependencies(declared: Declared) -> bool:
    """Return whether all dependencies of a declaration are known.

    It must not come from a plugin, its repr must show all its values, and its files must not refer to other files.
    """
    if " object at 0x" in repr(declared.thing) or source_digests.digest_plugins(declared.thing):
        return False
    return all(_is_self_contained(name) for name in source_digests.files_of(declared.thing))


def _is_self_contained(name: str) -> bool:
    """Return whether a file, a public data set, or every file of a folder refers to no other file."""
    if name.startswith("data:"):
        return True
    path = Path(name)
    if path.is_dir():
        return all(p.is_dir() or _file_suffix(p) in SLICES for p in path.rglob("*"))
    return _file_suffix(path) in ALONE


def _file_suffix(path: Path) -> str:
    return Path(path.name.lower().removesuffix(".gz")).suffix


def _options_text(options: RunOptions) -> str:
    return repr((options.repeat, options.stated, options.free, options.draw))


def _machine() -> str:
    """Return a description of the machine as text, with the environment variables that affect libraries."""
    known: dict[str, Any] = {n: v for n, v in describe_environment(datetime.now(UTC)).items() if n != "started"}
    return repr(known) + "\0".join(_environment_variables())


def _environment_variables() -> Iterator[str]:
    known = (n for n in os.environ if n.startswith(COUNTING) and n not in NO_EFFECT)
    yield from (f"{name}={os.environ[name]}" for name in sorted(known))


def _digest(*parts: str) -> str:
    h = hashlib.sha256()
    for part in parts:
        data = part.encode(errors="surrogatepass")
        h.update(f"{len(data)}\0".encode() + data)
    return h.hexdigest()
