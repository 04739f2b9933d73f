"""What is to be timed: one model of one scene under one set of overrides, as it goes to a process of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any

from softmark.records import dataclass

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


@dataclass(frozen=True)
class TimingJob:
    """One configuration to be timed; `key` is what its times are known by.

    The scene is a `text` (with the `folder` that its files lie in) or a `file`, by its path or its name in the standard
    library. Solutions are repeated until they have taken `least_s` seconds. A first solution that takes longer than
    `patience_s` is not done twice to warm up: it is the one that is timed. A process that needs longer than
    `costly_s` in all is repeated three times only; one that is not done after `timeout_s` is ended.
    """

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

    @property
    def called(self) -> str:
        """What a person knows it by."""
        return self.label or self.model

    @property
    def environment(self) -> dict[str, str]:
        """Variables that fix the number of threads, before anything that reads them is imported."""
        return dict.fromkeys(THREADS, str(self.threads))

    def to_json(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def of_json(cls, values: Mapping[str, Any]) -> TimingJob:
        """From plain values; those that are no part of a job are passed over."""
        own = {f.name: values[f.name] for f in fields(cls) if f.name in values}
        own["overrides"] = tuple(own.get("overrides", ()))
        return cls(**own)
