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
    found.points, found.analysis                       # plain dicts: errors and times, and conclusions from them

    found = softmark.robustness("beam.scene")
    found.silent                                       # wrong results without any warning: there should be none

In Jupyter and in IPython `%load_ext softmark` adds `%%scene`, which runs a cell as a scene.

Every module is imported at its first use: importing this package costs about a millisecond.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from IPython.core.interactiveshell import InteractiveShell

    from softmark.interpreter.api.api_arguments import BadArgument as BadArgument
    from softmark.interpreter.api.optional_packages import MissingExtra as MissingExtra
    from softmark.interpreter.api.python_api import LoadedScene as LoadedScene
    from softmark.interpreter.api.python_api import compare as compare
    from softmark.interpreter.api.python_api import load as load
    from softmark.interpreter.api.python_api import loads as loads
    from softmark.interpreter.api.python_api import robustness as robustness
    from softmark.interpreter.api.python_api import stress as stress
    from softmark.interpreter.api.shown_report import RunReport as RunReport
    from softmark.interpreter.language.compiled_scene import SceneError as SceneError
    from softmark.interpreter.results.run_report import MetricResult as MetricResult
    from softmark.interpreter.results.run_report import ModelResult as ModelResult
    from softmark.interpreter.results.run_report import ProbeResult as ProbeResult
    from softmark.interpreter.results.run_report import ReferenceResult as ReferenceResult
    from softmark.interpreter.results.run_report import Report as Report
    from softmark.interpreter.study.comparison_study import Comparison as Comparison
    from softmark.interpreter.study.robustness.robustness_record import Robustness as Robustness

__version__ = "0.1.0"

# public name: module that it comes from
_PUBLIC = {
    "load": "softmark.interpreter.api.python_api",
    "loads": "softmark.interpreter.api.python_api",
    "compare": "softmark.interpreter.api.python_api",
    "robustness": "softmark.interpreter.api.python_api",
    "stress": "softmark.interpreter.api.python_api",
    "LoadedScene": "softmark.interpreter.api.python_api",
    "SceneError": "softmark.interpreter.language.compiled_scene",
    "BadArgument": "softmark.interpreter.api.api_arguments",
    "MissingExtra": "softmark.interpreter.api.optional_packages",
    "RunReport": "softmark.interpreter.api.shown_report",
    "Report": "softmark.interpreter.results.run_report",
    "ModelResult": "softmark.interpreter.results.run_report",
    "ReferenceResult": "softmark.interpreter.results.run_report",
    "ProbeResult": "softmark.interpreter.results.run_report",
    "MetricResult": "softmark.interpreter.results.run_report",
    "Comparison": "softmark.interpreter.study.comparison_study",
    "Robustness": "softmark.interpreter.study.robustness.robustness_record",
}


def load_ipython_extension(shell: InteractiveShell) -> None:
    """Add the magic `%%scene` to a shell of IPython or Jupyter, as the extension `%load_ext softmark`."""
    from softmark.interpreter.api.cell_magic import register

    register(shell)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'softmark' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(_PUBLIC[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_PUBLIC]
