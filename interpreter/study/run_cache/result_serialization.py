"""Serialization of results as JSON with arrays, exact for floats and tuples.

Only classes in CLASSES are read, and no code is ever executed. To save another class, add its name there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.pipeline import saved_results
from softmark.interpreter.results import error_statements, load_results, reaction_results, run_report, state_results
from softmark.interpreter.study.run_cache import warning_locations

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Scene

CLASSES: Mapping[str, Any] = {
    cls.__name__: cls
    for cls in (
        run_report.Timing,
        run_report.ProbeResult,
        run_report.RequestedSurfaceValues,
        run_report.DrawnRigidBody,
        run_report.DrawnSurface,
        run_report.PlottedCurve,
        run_report.MetricResult,
        run_report.ModelKind,
        run_report.ModelResult,
        run_report.ReferenceResult,
        error_statements.StatedError,
        load_results.Resultant,
        reaction_results.Reaction,
        reaction_results.SupportResult,
        reaction_results.ContactNumbers,
        reaction_results.Friction,
        reaction_results.ContactResult,
        saved_results.WarningGroup,
        saved_results.SavedModel,
        saved_results.SavedReferences,
    )
}
LEFT: Mapping[type[Any], tuple[str, ...]] = {  # fields only for output files, not for the report
    run_report.ModelResult: ("mesh", "stress", "constants"), reaction_results.ContactNumbers: ("field",),
}  # fmt: skip
NUMBERS = "biuf"  # kinds of arrays: no objects


class NotSaved(Exception):
    """Error: a value has a class that is not in CLASSES."""


@dataclass
class Writer:
    """Converter of values to JSON; the JSON refers to `arrays` by their index."""

    scene: Scene
    arrays: list[np.ndarray] = field(default_factory=list)

    def write(self, value: Any) -> Any:
        """Convert a value. Raises NotSaved, NoDeclaration."""
        cls = type(value)
        if value is None or cls in (bool, int, str):
            return value
        if cls is float:
            return value if math.isfinite(value) else {"~float": repr(value)}
        if cls is state_results.TimeState:
            return {"~moment": float(value)}
        if isinstance(value, np.ndarray | np.generic):
            return {"~array" if cls is np.ndarray else "~number": self._array(np.asarray(value))}
        if cls is tuple:
            return {"~tuple": [self.write(v) for v in value]}
        if cls is list:
            return [self.write(v) for v in value]
        if isinstance(value, Mapping):
            return {"~pairs": [[self.write(k), self.write(v)] for k, v in value.items()]}
        if isinstance(value, Diagnostic):
            return {"~warning": warning_locations.to_json(value, self.scene)}
        if CLASSES.get(cls.__name__) is not cls:
            raise NotSaved(f"{cls.__module__}.{cls.__qualname__}")
        named = [f.name for f in fields(cls) if f.name not in LEFT.get(cls, ())]
        return {"~class": cls.__name__, "fields": {n: self.write(getattr(value, n)) for n in named}}

    def _array(self, value: np.ndarray) -> int:
        if value.dtype.kind not in NUMBERS:
            raise NotSaved(f"an array of {value.dtype}")
        self.arrays.append(value)
        return len(self.arrays) - 1


@dataclass(frozen=True)
class Reader:
    """Converter of saved JSON back to the results of a run."""

    scene: Scene
    arrays: Mapping[int, np.ndarray]

    def read(self, value: Any) -> Any:
        """Convert JSON to a value. Raises LookupError, TypeError or ValueError for invalid JSON."""
        if isinstance(value, list):
            return [self.read(v) for v in value]
        if not isinstance(value, dict):
            return value
        if "~class" in value:
            own = {str(n): self.read(v) for n, v in value["fields"].items()}
            return CLASSES[value["~class"]](**own)
        ((what, inner),) = value.items()
        return _READ[what](self, inner)

    def pairs(self, inner: Any) -> dict[Any, Any]:
        """Convert a list of (key, value) pairs to a dictionary."""
        return {self.read(k): self.read(v) for k, v in inner}


_READ: Mapping[str, Any] = {
    "~float": lambda reader, inner: float(inner),
    "~moment": lambda reader, inner: state_results.TimeState(inner),
    "~array": lambda reader, inner: reader.arrays[inner],
    "~number": lambda reader, inner: reader.arrays[inner][()],
    "~tuple": lambda reader, inner: tuple(reader.read(v) for v in inner),
    "~pairs": Reader.pairs,
    "~warning": lambda reader, inner: warning_locations.from_json(inner, reader.scene),
}
