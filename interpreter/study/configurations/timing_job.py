"""Timing job: one model of one scene with one set of overrides, as sent to the process that times it."""

from __future__ import annotations

from typing import ClassVar

from softmark.interpreter.results.json_records import JsonRecord
from softmark.records import dataclass

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@dataclass(frozen=True)
class TimingJob(JsonRecord):
    """Configuration to be timed; `key` identifies its times.

    The scene is given as `text` (with the `folder` of its files), or as `file`, which is a path or the name of a
    standard scene. Solutions are repeated until they have taken `least_s` seconds. If the first solution takes longer
    than `patience_s`, it is not a warm-up but is itself timed. A process that needs longer than `costly_s` in total is
    repeated only three times. A process that is not finished after `timeout_s` is killed.
    """

    READ: ClassVar = {"overrides": tuple, "plugins": tuple}
    SELDOM: ClassVar = ("plugins",)

    key: str
    model: str
    file: str | None = None
    text: str | None = None
    folder: str = "."
    overrides: tuple[str, ...] = ()
    label: str = ""
    threads: int = 1
    least_s: float = 0.2
    patience_s: float = 20.0
    costly_s: float = 60.0
    timeout_s: float = 600.0
    plugins: tuple[str, ...] = ()  # plugins to load

    @property
    def called(self) -> str:
        """Name of the timed configuration in messages."""
        return self.label or self.model

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables that fix the number of threads; they must be set before libraries are imported."""
        return dict.fromkeys(THREADS, str(self.threads))
