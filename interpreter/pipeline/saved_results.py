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
    """Warnings stored by one call of `StateRun.warn`; `found`, `here` and `once` are the arguments of the call."""

    found: tuple[Diagnostic, ...] = ()
    here: tuple[Diagnostic, ...] = ()
    once: bool = False


@dataclass(frozen=True)
class SavedModel:
    """Saved model of an earlier run, for each state: result, warnings by step, and codes of accuracy warnings."""

    name: str
    computed: str  # when, UTC
    results: tuple[ModelResult, ...]
    told: tuple[Mapping[str, tuple[WarningGroup, ...]], ...]  # by step: `prepare`, `solve`
    doubts: tuple[tuple[str, ...], ...]  # warning codes that its stated errors repeat as doubts


@dataclass(frozen=True)
class SavedReferences:
    """Saved references of an earlier run: for each state their results, and the warnings about probe positions."""

    computed: str
    results: tuple[Mapping[str, ReferenceResult], ...]
    told: tuple[tuple[WarningGroup, ...], ...]


@dataclass(frozen=True)
class SavedResults:
    """Saved results that a run can reuse; `references` is None unless all models are saved."""

    models: Mapping[str, SavedModel] = field(default_factory=dict)
    references: SavedReferences | None = None


NOTHING = SavedResults()
