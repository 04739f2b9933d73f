"""softmark: a scene language and its interpreter for assessing deformable models.

    import softmark

    scene = softmark.load("beam.scene", L="120 mm")
    report = scene.run(models=["rod"])
    report.models["rod"].probes["axis"].displacement   # numpy, (n, 3) in m
    report.references["theory"].probes["axis"].position
    report.to_json()                                   # the JSON report as a dict

    found = softmark.compare("beam.scene", vary={"h": ["10 mm", "5 mm"]})
    found.points, found.analysis                       # plain dicts: errors and times, and what they tell

    found = softmark.stress("beam.scene")
    found.silent                                       # points that look right and are wrong: there should be none

Nothing is imported before it is used: importing this package costs about a millisecond.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from softmark.interpreter.api import LoadedScene as LoadedScene
    from softmark.interpreter.api import compare as compare
    from softmark.interpreter.api import load as load
    from softmark.interpreter.api import loads as loads
    from softmark.interpreter.api import stress as stress
    from softmark.interpreter.arguments import BadArgument as BadArgument
    from softmark.interpreter.results import MetricResult as MetricResult
    from softmark.interpreter.results import ModelResult as ModelResult
    from softmark.interpreter.results import ProbeResult as ProbeResult
    from softmark.interpreter.results import ReferenceResult as ReferenceResult
    from softmark.interpreter.results import Report as Report
    from softmark.interpreter.scene import SceneError as SceneError
    from softmark.interpreter.study.compare import Comparison as Comparison
    from softmark.interpreter.study.stress.engine import Stress as Stress

__version__ = "0.1.0"

# public name: module that it comes from
_PUBLIC = {
    "load": "softmark.interpreter.api",
    "loads": "softmark.interpreter.api",
    "compare": "softmark.interpreter.api",
    "stress": "softmark.interpreter.api",
    "LoadedScene": "softmark.interpreter.api",
    "SceneError": "softmark.interpreter.scene",
    "BadArgument": "softmark.interpreter.arguments",
    "Report": "softmark.interpreter.results",
    "ModelResult": "softmark.interpreter.results",
    "ReferenceResult": "softmark.interpreter.results",
    "ProbeResult": "softmark.interpreter.results",
    "MetricResult": "softmark.interpreter.results",
    "Comparison": "softmark.interpreter.study.compare",
    "Stress": "softmark.interpreter.study.stress.engine",
}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'softmark' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC]
