"""Preparation of a model with timing, and reading of measured references."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from operator import add
from typing import Any

from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.models import model_builders
from softmark.interpreter.models.shared.prepared_model import BuildContext, Prepared
from softmark.interpreter.problem.body_case import Case, case_for
from softmark.pausing import collection_paused
from softmark.solvers.runtime.work_count import counted, seconds_since


@dataclass(frozen=True)
class ComputingTimes:
    """Times of several runs of the same work: wall and CPU time of each, s, and nominal CPU time of one, s.

    Nominal times are those of `solvers/runtime/work_count.py`.
    """

    wall: tuple[float, ...] = ()
    cpu: tuple[float, ...] = ()
    nominal: float = 0.0

    def __add__(self, other: ComputingTimes) -> ComputingTimes:
        """Return the times of two pieces of work that were both repeated equally often."""
        wall, cpu = map(add, self.wall, other.wall), map(add, self.cpu, other.cpu)
        return ComputingTimes(tuple(wall), tuple(cpu), self.nominal + other.nominal)


def prepared_model(declared: Declared, case: Case, workshop: BuildContext) -> tuple[Prepared, ComputingTimes]:
    """Return a model built for a case, and the times of building it. Raises Fault.

    The time of importing libraries is not included.
    """
    with collection_paused():
        model_builders.load(declared.thing)
    workshop.borrowed = (0.0, 0.0)
    wall, cpu, before = time.perf_counter(), time.process_time(), counted()
    prepared = model_builders.build(declared, case, workshop)
    spent = time.perf_counter() - wall, time.process_time() - cpu
    # a mesh made for another model is charged to this model too
    wall, cpu = (a + b for a, b in zip(spent, workshop.borrowed, strict=True))
    return prepared, ComputingTimes((wall,), (cpu,), seconds_since(before))


def from_a_model(reference: Declared) -> bool:
    """Return whether a reference is computed from a model."""
    return bool(reference.thing.how == "scanned")


def measurement(scene: Scene, declared: Declared) -> Any:
    """Return the data of a measured reference.

    If the scene requests this, the data are moved onto the held face of the body.
    """
    thing, register = declared.thing, declared.thing.registered
    if register == "clamp":
        from softmark.interpreter.problem.probe_points import held_face

        return thing.load(held=held_face(case_for(scene, declared)))
    return replace(thing, register="none").load() if register == "icp" else thing.load()


@dataclass
class Measurements(Mapping[str, Any]):
    """Data of measured references, by name, each read on first use; `seconds` is the (wall, CPU) time of reading."""

    scene: Scene
    seconds: tuple[float, float] = (0.0, 0.0)
    _read: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        """Return the data of a reference. Raises KeyError if the reference is not measured or cannot be read."""
        if name not in self._read:
            wall, cpu = time.perf_counter(), time.process_time()
            self._read[name] = self._read_reference(name)
            spent = time.perf_counter() - wall, time.process_time() - cpu
            self.seconds = self.seconds[0] + spent[0], self.seconds[1] + spent[1]
        if self._read[name] is None:
            raise KeyError(name)
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return (name for name in self.scene.of_kind("reference") if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _read_reference(self, name: str) -> Any:
        declared = self.scene.of_kind("reference").get(name)
        if declared is None or declared.thing.how != "measured":
            return None
        try:
            return measurement(self.scene, declared)
        except Exception:  # the model that needs the file reports its error
            return None
