"""Results of a run that are saved for later runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from softmark.records import dataclass

if TYPE_CHECKING:
    from softmark.grammar.diagnostic import Diagnostic
    from softmark.interpreter.results.run_report import ModelResult, ReferenceResult


@dataclass(frozen=True)
class WarningGroup:
    """Warnings given together, see `Work.warn`."""

    found: tuple[Diagnostic, ...] = ()
    here: tuple[Diagnostic, ...] = ()
    once: bool = False


@dataclass(frozen=True)
class SavedModel:
    """Saved model of an earlier run: for each state its result, its warnings by step, and shared warnings."""

    name: str
    computed: str  # when, UTC
    results: tuple[ModelResult, ...]
    told: tuple[Mapping[str, tuple[WarningGroup, ...]], ...]  # by step: `prepare`, `solve`
    doubts: tuple[tuple[str, ...], ...]  # warning codes that its stated errors repeat as doubts


@dataclass(frozen=True)
class SavedReferences:
    """Saved references of an earlier run, and the warnings about probe positions, for each state."""

    computed: str
    results: tuple[Mapping[str, ReferenceResult], ...]
    told: tuple[tuple[WarningGroup, ...], ...]


@dataclass(frozen=True)
class SavedResults:
    """Saved results to reuse; references only together with all models."""

    models: Mapping[str, SavedModel] = field(default_factory=dict)
    references: SavedReferences | None = None


NOTHING = SavedResults()
