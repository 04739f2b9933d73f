"""What is to be timed: one model of one scene under one set of overrides, as it goes to a process of its own."""

from __future__ import annotations

from typing import ClassVar

from softmark.interpreter.results.json_records import Plain
from softmark.records import dataclass

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@dataclass(frozen=True)
class TimingJob(Plain):
    """One configuration to be timed; `key` is what its times are known by.

    The scene is a `text` (with the `folder` that its files lie in) or a `file`, by its path or its name in the standard
    library. Solutions are repeated until they have taken `least_s` seconds. A first solution that takes longer than
    `patience_s` is not done twice to warm up: it is the one that is timed. A process that needs longer than
    `costly_s` in all is repeated three times only; one that is not done after `timeout_s` is ended.
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
    plugins: tuple[str, ...] = ()  # that its words may be of

    @property
    def called(self) -> str:
        """What a person knows it by."""
        return self.label or self.model

    @property
    def environment(self) -> dict[str, str]:
        """Variables that fix the number of threads, before anything that reads them is imported."""
        return dict.fromkeys(THREADS, str(self.threads))
