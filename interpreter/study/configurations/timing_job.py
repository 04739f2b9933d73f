"""Timing job: one model of one scene with one set of overrides, as sent to a separate process."""

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
    """One configuration to be timed; `key` identifies its times.

    The scene is a `text` (with the `folder` of its files) or a `file`, by its path or its name in the standard library.
    Solutions are repeated until they have taken `least_s` seconds. A first solution that takes longer than `patience_s`
    is not repeated as a warm-up: it is the timed one. A process that needs longer than `costly_s` in total is repeated
    only three times; one that is not finished after `timeout_s` is killed.
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
        """Name of the job for people."""
        return self.label or self.model

    @property
    def environment(self) -> dict[str, str]:
        """Return the variables that fix the number of threads, to be set before libraries are imported."""
        return dict.fromkeys(THREADS, str(self.threads))
