"""What is kept of a run for later ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.results.run_report import ModelResult, ReferenceResult


@dataclass(frozen=True)
class Told:
    """Warnings that were given together, see `Work.warn`."""

    found: tuple[Diagnostic, ...] = ()
    here: tuple[Diagnostic, ...] = ()
    once: bool = False


@dataclass(frozen=True)
class KeptModel:
    """A model of an earlier run: of each state its result, what it warned of while each step, and what it met."""

    name: str
    computed: str  # when, UTC
    results: tuple[ModelResult, ...]
    told: tuple[Mapping[str, tuple[Told, ...]], ...]  # by step: `prepare`, `solve`
    doubts: tuple[tuple[str, ...], ...]  # codes that speak against it, which its stated errors repeat


@dataclass(frozen=True)
class KeptReferences:
    """All references of an earlier run, and what was warned of where probes were placed, of each state."""

    computed: str
    results: tuple[Mapping[str, ReferenceResult], ...]
    told: tuple[tuple[Told, ...], ...]


@dataclass(frozen=True)
class Known:
    """What is taken over; references only together with all models."""

    models: Mapping[str, KeptModel] = field(default_factory=dict)
    references: KeptReferences | None = None


NOTHING = Known()
