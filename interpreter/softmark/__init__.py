"""softmark: a scene language and its interpreter for assessing deformable models.

    import softmark

    scene = softmark.load("beam.scene", L="120 mm")
    report = scene.run(models=["rod"])
    report.models["rod"].probes["axis"].displacement   # numpy, (n, 3) in m
    report.references["theory"].probes["axis"].position
    report.to_json()                                   # the JSON report as a dict
    report.frame(), report.plot("axis")                # pandas, matplotlib
    report.write("results")                            # its page, and all numbers as JSON

    found = softmark.compare("beam.scene", vary={"h": ["10 mm", "5 mm"]})
    found.points, found.analysis                       # plain dicts: errors and times, and what they tell

    found = softmark.stress("beam.scene")
    found.silent                                       # points that look right and are wrong: there should be none

In Jupyter and in IPython `%load_ext softmark` adds `%%scene`, which runs a cell as a scene.

Nothing is imported before it is used: importing this package costs about a millisecond.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from IPython.core.interactiveshell import InteractiveShell

    from softmark.interpreter.face.api import LoadedScene as LoadedScene
    from softmark.interpreter.face.api import compare as compare
    from softmark.interpreter.face.api import load as load
    from softmark.interpreter.face.api import loads as loads
    from softmark.interpreter.face.api import stress as stress
    from softmark.interpreter.face.arguments import BadArgument as BadArgument
    from softmark.interpreter.face.extras import MissingExtra as MissingExtra
    from softmark.interpreter.face.shown import RunReport as RunReport
    from softmark.interpreter.language.scene import SceneError as SceneError
    from softmark.interpreter.results.report import MetricResult as MetricResult
    from softmark.interpreter.results.report import ModelResult as ModelResult
    from softmark.interpreter.results.report import ProbeResult as ProbeResult
    from softmark.interpreter.results.report import ReferenceResult as ReferenceResult
    from softmark.interpreter.results.report import Report as Report
    from softmark.interpreter.study.compare import Comparison as Comparison
    from softmark.interpreter.study.stability.record import Stress as Stress

__version__ = "0.1.0"

# public name: module that it comes from
_PUBLIC = {
    "load": "softmark.interpreter.face.api",
    "loads": "softmark.interpreter.face.api",
    "compare": "softmark.interpreter.face.api",
    "stress": "softmark.interpreter.face.api",
    "LoadedScene": "softmark.interpreter.face.api",
    "SceneError": "softmark.interpreter.language.scene",
    "BadArgument": "softmark.interpreter.face.arguments",
    "MissingExtra": "softmark.interpreter.face.extras",
    "RunReport": "softmark.interpreter.face.shown",
    "Report": "softmark.interpreter.results.report",
    "ModelResult": "softmark.interpreter.results.report",
    "ReferenceResult": "softmark.interpreter.results.report",
    "ProbeResult": "softmark.interpreter.results.report",
    "MetricResult": "softmark.interpreter.results.report",
    "Comparison": "softmark.interpreter.study.compare",
    "Stress": "softmark.interpreter.study.stability.record",
}


def load_ipython_extension(shell: InteractiveShell) -> None:
    """`%load_ext softmark`: add the magic `%%scene` to a shell of IPython or Jupyter."""
    from softmark.interpreter.face.magic import register

    register(shell)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'softmark' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC]
