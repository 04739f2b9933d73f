"""Description of scene and machine in a report: everything that is needed to repeat the run."""

from __future__ import annotations

import hashlib
import platform
from datetime import datetime
from functools import cache
from typing import Any

from softmark.grammar.diagnostic import Source, make_encodable
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Scene
from softmark.interpreter.language.expression_evaluation import Quantity
from softmark.interpreter.language.scene_sources import standard_name
from softmark.solvers.runtime.parallel_compilation import count_processors


def describe_scene(scene: Scene) -> dict[str, Any]:
    """Return title, file, digest, text and parameters of a scene, as report entries."""
    source: Source = scene.source
    parameters = {}
    for name, p in scene.parameters.items():
        value = p.value.value if isinstance(p.value, Quantity) else list(p.value.values)
        parameters[name] = {"value": value, "unit": units.si_unit(p.value.dimension), "text": p.text}
    return {
        "title": scene.title,
        "file": make_encodable(scene.path or source.name),
        "standard": standard_name(scene.path),
        "sha256": hashlib.sha256(source.text.encode()).hexdigest(),
        "parameters": parameters,
        "text": source.text,
        "published": [
            {"metric": column.thing.metric, "source": column.thing.source}
            for column in scene.of_kind("published").values()
        ],
        "overridden": sorted(n for n, p in scene.parameters.items() if p.overridden),
        "overrides": list(scene.overrides),
    } | _describe_plugins(scene)


def _describe_plugins(scene: Scene) -> dict[str, Any]:
    """Return the report entry of the plugins that the scene uses; empty if there are none."""
    named = scene.table.vocabulary.plugins if scene.table else ()
    told = [{"name": p.name, "file": make_encodable(p.file), "sha256": p.sha256} for p in named]
    return {"plugins": told} if told else {}


def describe_environment(started: datetime) -> dict[str, Any]:
    """Return the report entries about machine and software on which results may depend."""
    import softmark

    return {
        "softmark": softmark.__version__,
        "python": platform.python_version(),
        **_library_versions(),
        "platform": platform.platform(),
        "cpu": _cpu_name(),
        "threads": count_processors(),
        "started": started.isoformat(timespec="seconds"),
    }


@cache
def _library_versions() -> dict[str, str]:
    """Return the versions of the numerical libraries; they are cached, since reading them takes milliseconds."""
    from importlib.metadata import version

    return {name: version(name) for name in ("numpy", "scipy", "numba")}


@cache
def _cpu_name() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "unknown")
    except OSError:
        return platform.processor() or "unknown"
